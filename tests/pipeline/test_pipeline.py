"""Pipeline.sample(index) is a pure function of (recipe, index)."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
import pytest

from gen_data.core.asset_types import Asset, AssetFacts, Keypoint, MeshData
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.errors import ConfigError, LayoutRejected, Rejection, SceneRejected
from gen_data.core.interfaces import DatasetInfo, Modality, SensorInfo, Settled, Stage
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.sample import ImageTruth
from gen_data.core.scene import Articulation, Body, Camera, Instance, Scene
from gen_data.core.se3 import SE3
from gen_data.core.serialization import canonical_json, from_plain
from gen_data.core.streams import Streams
from gen_data.pipeline import Pipeline
from gen_data.pipeline.finalize_scene import finalize_scene
from gen_data.pipeline.pipeline import PipelineConfig

CAMERA = Camera("color", SE3(), Intrinsics.from_hfov(8, 6, 1.0))


@dataclass(frozen=True)
class Draws:
    """A randomizer that writes its draw into the environment's yaw."""

    name: str
    stage: Stage

    def __call__(self, scene: Scene, assets: object, rng: Any) -> Scene:
        yaw_rad = scene.environment.yaw_rad + rng.uniform()
        return replace(scene, environment=replace(scene.environment, yaw_rad=yaw_rad))


@dataclass(frozen=True)
class Refuses:
    """A randomizer that finds no valid draw in its first attempts."""

    name: str
    stage: Stage
    threshold: float

    def __call__(self, scene: Scene, assets: object, rng: Any) -> Scene:
        if rng.uniform() < self.threshold:
            raise LayoutRejected(Rejection("draw too small", "lower the threshold"))
        return scene


class AcceptingPhysics:
    def __init__(self) -> None:
        self.settled = 0

    def __enter__(self) -> AcceptingPhysics:
        return self

    def __exit__(self, *exception: object) -> None:
        """Nor to stop."""

    def settle(self, scene: Scene) -> Settled:
        self.settled += 1
        return Settled(scene)


class RefusingPhysics(AcceptingPhysics):
    def settle(self, scene: Scene) -> Settled:
        reason = "object fell off" if scene.environment.yaw_rad % 1 < 0.5 else "still moving"
        return Settled(scene, Rejection(reason, "fewer objects (randomizers.clutter.count)"))


@dataclass(frozen=True)
class OneCamera:
    """A sensor that returns the scene's yaw as a one-pixel image."""

    name: str = "color"

    def mount(self, scene: Scene) -> Scene:
        return replace(scene, cameras=(CAMERA,))

    def capture(self, scene: Scene, renderer: Any, channels: Any, rng: Any) -> SensorReading:
        """The yaw, and one draw of the sensor's own stream."""
        values = np.array([[scene.environment.yaw_rad, rng.uniform()]])
        return SensorReading(self.name, scene.cameras[0], {Channel.RGB: values})


def pipeline(
    *randomizers: Any,
    physics: Any = None,
    seed: int = 7,
    views_per_scene: int = 3,
    splits: Mapping[str, float] | None = None,
) -> Pipeline:
    sensor = OneCamera()
    recipe = PipelineConfig(
        open_scene=lambda streams: (sensor.mount(Scene("test")), randomizers, (sensor,)),
        channels=frozenset(),
        image_truth=lambda scene, reading: ImageTruth(reading.camera, ()),
        split_shares=splits or {"train": 0.8, "val": 0.2},
        layout_attempts_max=5,
        info=DatasetInfo(
            "test", seed, 100, views_per_scene, (), (SensorInfo("color", Modality.CAMERA),)
        ),
        exporters={},
    )
    engine = physics or AcceptingPhysics()
    return Pipeline(recipe, None, lambda: engine, lambda: None)  # type: ignore[arg-type]


def seen(made: Pipeline, index: int) -> np.ndarray:
    return made.sample(index).capture.readings["color"].channels[Channel.RGB]


BUILD = Draws("build", Stage.BUILD)
VIEW = Draws("view", Stage.VIEW)


def test_order_and_history_leave_a_sample_unchanged() -> None:
    """Sample 4 after 0..9, and alone in a fresh pipeline."""
    with pipeline(BUILD, VIEW) as one, pipeline(BUILD, VIEW) as other:
        after_others = [seen(one, i) for i in (9, 0, 3, 4)][-1]
        alone = seen(other, 4)

    assert np.array_equal(after_others, alone)


def test_views_share_a_scene_and_differ_in_what_is_drawn_per_view() -> None:
    """Scene draws are the same in all views of a scene; view draws are not."""
    with pipeline(BUILD) as scenes, pipeline(BUILD, VIEW) as views:
        same = {float(seen(scenes, i)[0, 0]) for i in (3, 4, 5)}
        different = {float(seen(views, i)[0, 0]) for i in (3, 4, 5)}
        next_scene = float(seen(scenes, 6)[0, 0])

    assert len(same) == 1
    assert len(different) == 3
    assert next_scene not in same


def test_inserting_a_randomizer_leaves_other_draws_unchanged() -> None:
    """Streams are keyed by name: another randomizer adds its own draw and moves none."""
    new = Draws("new", Stage.BUILD)
    with pipeline(BUILD) as alone, pipeline(new, BUILD) as both, pipeline(new) as only_new:
        expected = seen(alone, 0)[0, 0] + seen(only_new, 0)[0, 0]

        assert seen(both, 0)[0, 0] == pytest.approx(expected, abs=1e-12)


def test_one_settled_scene_serves_all_its_views() -> None:
    """Physics runs once per scene, not once per view."""
    physics = AcceptingPhysics()
    with pipeline(BUILD, VIEW, physics=physics) as made:
        for index in range(6):
            made.sample(index)

    assert physics.settled == 2


def test_scene_that_is_never_valid_is_rejected_with_the_tally() -> None:
    """Five attempts, each with other draws; the error counts the reasons and names a remedy."""
    with pipeline(BUILD, physics=RefusingPhysics()) as made, pytest.raises(SceneRejected) as error:
        made.sample(3)

    assert str(error.value).startswith("scene 1: no valid layout in 5 attempts (")
    assert sum(Counter(r.reason for r in error.value.rejections).values()) == 5
    assert "Try: 1. fewer objects (randomizers.clutter.count)" in str(error.value)


@pytest.mark.parametrize("stage", [Stage.BUILD, Stage.VIEW])
def test_refused_draw_is_tried_again_with_other_streams(stage: Stage) -> None:
    """A layout that a randomizer refuses costs an attempt, not the sample."""
    attempts = set()
    for seed in range(12):
        with pipeline(Refuses("picky", stage, 0.5), seed=seed) as made:
            attempts.add(made.sample(0).attempts)

    assert max(attempts) > 1 or stage is Stage.VIEW


@dataclass(frozen=True)
class NeedsRoom:
    """A randomizer that can draw the views ``of`` only of layouts with a yaw of at least ``least``.

    Attributes:
        error: Raised where there is no room.
    """

    of: tuple[int, ...]
    least: float = 0.6
    error: Exception = field(
        default_factory=lambda: LayoutRejected(Rejection("no place for camera", "fewer cups"))
    )
    name: str = "orbit"
    stage: Stage = Stage.VIEW

    def __call__(self, scene: Scene, assets: object, rng: Any) -> Scene:
        if rng.streams.view in self.of and scene.environment.yaw_rad < self.least:
            raise self.error
        return scene


def facts(made: Pipeline, index: int) -> tuple[int, int, float]:
    """Attempts at the scene and the view, and the yaw of the scene."""
    sample = made.sample(index)
    return sample.attempts, sample.view_attempts, sample.scene.environment.yaw_rad


def layouts_rad(scene: int) -> list[float]:
    """Yaws of the layouts of a scene, attempt by attempt."""
    streams = [Streams(7, scene, attempt=attempt) for attempt in range(5)]
    drawn = [BUILD(Scene("test"), None, one.rng("randomizer/build")) for one in streams]
    return [layout.environment.yaw_rad for layout in drawn]


def test_a_layout_without_room_for_one_of_its_views_is_drawn_again_for_all() -> None:
    """40 scenes: each is the first of its layouts with room for view 2, also in views 0 and 1."""
    with pipeline(BUILD, NeedsRoom(of=(2,))) as made:
        found = [facts(made, index) for index in range(120)]
    numbers = Counter[int]()
    for scene in range(40):
        yaws_rad = layouts_rad(scene)
        number = next(k for k, yaw_rad in enumerate(yaws_rad) if yaw_rad >= 0.6)
        assert set(found[3 * scene : 3 * scene + 3]) == {(number + 1, 1, yaws_rad[number])}
        numbers[number] += 1
    assert numbers[0] > 10
    assert numbers[1] > 5


@pytest.mark.parametrize("order", [(2, 1, 0), (1, 2, 0), (0, 1, 2)])
def test_layouts_do_not_depend_on_the_view_that_is_asked_for_first(order: tuple[int, ...]) -> None:
    """All of one pipeline in order, and each view by another pipeline, in any order."""
    picky = BUILD, VIEW, NeedsRoom(of=(1,)), NeedsRoom(of=(2,), name="other", least=0.3)
    with pipeline(*picky) as one:
        expected = [canonical_json(one.sample(index).scene) for index in range(30)]
    for scene in range(10):
        with pipeline(*picky) as other:
            for view in order:
                index = 3 * scene + view
                assert canonical_json(other.sample(index).scene) == expected[index]
        with pipeline(*picky) as alone:
            index = 3 * scene + order[0]
            assert canonical_json(alone.sample(index).scene) == expected[index]


def test_layouts_that_never_have_room_for_a_view_are_refused_with_the_view() -> None:
    """Five draws for each of five layouts, which the other samples of the scene do not repeat."""
    physics = AcceptingPhysics()
    made = pipeline(BUILD, NeedsRoom(of=(1,), least=9.0), physics=physics)
    text = (
        "scene 1: no valid layout in 5 attempts (5 x no place for camera).\n"
        "  Best: attempt 1: all 5 draws of view 1 are rejected.\n"
        "  Try: 1. fewer cups"
    )
    with made:
        for index in (3, 4, 5):
            with pytest.raises(SceneRejected) as error:
                made.sample(index)
            assert str(error.value) == text
        assert physics.settled == 5


def test_the_best_layout_is_the_one_that_has_room_for_most_views() -> None:
    """Only the layout of scene 1 with the largest yaw has room for view 1, and none for view 2."""
    yaws_rad = layouts_rad(1)
    limits = (NeedsRoom((1,), max(yaws_rad)), NeedsRoom((2,), 9.0, name="other"))
    with pipeline(BUILD, *limits) as made, pytest.raises(SceneRejected) as error:
        made.sample(3)
    number = 1 + yaws_rad.index(max(yaws_rad))
    assert number > 1
    best = f"Best: attempt {number}: all 5 draws of view 2 are rejected."
    assert best in str(error.value)


def test_an_error_of_a_view_leaves_the_other_views_of_its_scene() -> None:
    """Only a rejection is a property of the layout; another fault is one of its view alone."""
    broken = NeedsRoom(of=(1,), least=9.0, error=ValueError("broken texture"))
    with pipeline(BUILD, broken) as made, pipeline(BUILD) as free:
        for index in (3, 5):
            assert facts(made, index) == facts(free, index)
        for _ in range(2):
            with pytest.raises(ValueError, match="broken texture"):
                made.sample(4)


def test_every_view_of_a_scene_is_drawn_once() -> None:
    """The draws that decide on the layout serve the samples, in any order."""
    drawn: Counter[tuple[int, int]] = Counter()

    @dataclass(frozen=True)
    class Counts:
        name: str = "counts"
        stage: Stage = Stage.VIEW

        def __call__(self, scene: Scene, assets: Any, rng: Any) -> Scene:
            drawn[rng.streams.scene, rng.streams.view] += 1
            return scene

    with pipeline(BUILD, Counts()) as made:
        for index in (1, 0, 2, 5, 3, 4):
            made.sample(index)
    assert drawn == Counter((scene, view) for scene in range(2) for view in range(3))


def test_more_instances_than_label_images_hold_are_refused() -> None:
    """Before physics and rendering: 65535 ids and 0 fill 16 bits."""

    @dataclass(frozen=True)
    class Crowd:
        name: str = "crowd"
        stage: Stage = Stage.BUILD
        count: int = 65_536

        def __call__(self, scene: Scene, assets: Any, rng: Any) -> Scene:
            return replace(scene, instances=(Instance(1, "it", "it", 1, "it"),) * self.count)

    text = r"scene 0: 65536 instances.*room for 65535; place fewer"
    with pipeline(Crowd()) as made, pytest.raises(ConfigError, match=text):
        made.sample(0)


def test_splits_have_their_shares_and_do_not_cut_scenes() -> None:
    """Shares within four standard errors over 2,000 scenes; all views of a scene in one split."""
    shares = {"train": 0.7, "val": 0.2, "test": 0.1}
    with pipeline(BUILD, splits=shares) as made:
        counts = Counter(made.split(scene) for scene in range(2000))
        views = {made.sample(i).split for i in (30, 31, 32)}

    for name, share in shares.items():
        assert abs(counts[name] / 2000 - share) < 4 * (share * (1 - share) / 2000) ** 0.5
    assert len(views) == 1


class TwoBoxes:
    """Assets of which every one is a box of 2 x 4 x 6 cm with a point at its top."""

    def get(self, asset_id: str) -> Asset:
        facts = AssetFacts("small", (("lid", "open"), ("state", "new")))
        return Asset(asset_id, "object", "mug", (), "", "", "", "", facts=lambda: facts)

    def keypoints(self, asset_id: str) -> tuple[Keypoint, ...]:
        return (Keypoint("top", (0.0, 0.0, 0.03)),)

    def body_bounds_m(self, asset_id: str) -> None:
        """None: there are no mirrors."""

    def bounds_m(self, asset_id: str) -> Any:
        return (-0.01, -0.02, -0.03), (0.01, 0.02, 0.03)

    def mesh(self, asset_id: str) -> MeshData:
        """Its two extreme corners are all that bounds need."""
        low, high = self.bounds_m(asset_id)
        none = np.zeros((0, 3), np.int32)
        corners = np.array([low, high], np.float32)
        return MeshData(corners, none, corners, corners[:, :2], np.zeros(0, np.int32), ())


def test_freezing_fills_ids_frames_and_boxes() -> None:
    """One body: its own frame and scaled bounds. A robot: its base and a box around its links."""
    quarter = SE3.about_z(np.pi / 2, (1.0, 0.0, 0.5))
    scene = Scene(
        "test",
        bodies=(
            Body("cup", "box", quarter, scale=2.0, instance_id=1),
            Body("arm/a", "box", SE3((0.0, 0.0, 0.0)), instance_id=2, part_id=1),
            Body("arm/b", "box", SE3((0.0, 0.0, 1.0)), instance_id=2, part_id=2),
        ),
        instances=(
            Instance(1, "cup", "mug", 0, "box", attributes=(("lid", "shut"),)),
            Instance(2, "arm", "robot_arm", 0, "arm"),
        ),
        articulations=(Articulation("arm", "arm", 2, SE3((0.0, 0.0, -1.0)), ()),),
    )

    frozen = finalize_scene(scene, TwoBoxes(), {"mug": 1, "robot_arm": 2})  # type: ignore[arg-type]

    cup, arm = frozen.instances
    assert (cup.category_id, arm.category_id) == (1, 2)
    assert cup.T_world_instance == quarter
    assert (cup.subcategory, dict(cup.attributes)) == ("small", {"lid": "shut", "state": "new"})
    assert cup.keypoints == (Keypoint("top", (0.0, 0.0, 0.06), 0.1),)
    assert cup.box_max_m == pytest.approx((0.02, 0.04, 0.06))
    assert arm.T_world_instance == SE3((0.0, 0.0, -1.0))
    assert arm.box_min_m == pytest.approx((-0.01, -0.02, 0.97), abs=1e-6)
    assert arm.box_max_m == pytest.approx((0.01, 0.02, 2.03), abs=1e-6)


class WithMirrors(TwoBoxes):
    """Boxes of 4 cm width, 1 cm of which are mirrors on both sides."""

    def body_bounds_m(self, asset_id: str) -> Any:
        return (-0.01, -0.01, -0.03), (0.01, 0.01, 0.03)


@pytest.mark.parametrize(("extent", "width_m"), [("body", 0.04), ("all", 0.08)])
def test_boxes_leave_out_mirrors_unless_all_is_labelled(
    extent: Literal["body", "all"], width_m: float
) -> None:
    """A body of twice its size; its measures for other code stay whole."""
    scene = Scene(
        "test",
        bodies=(Body("car", "box", SE3((1.0, 0.0, 0.5)), scale=2.0, instance_id=1),),
        instances=(Instance(1, "car", "car", 0, "box"),),
        box3d=extent,
    )

    (car,) = finalize_scene(scene, WithMirrors(), {"car": 1}).instances  # type: ignore[arg-type]

    assert car.box3d.size_m == pytest.approx((0.04, width_m, 0.12), abs=1e-9)
    assert car.box3d.T_frame_box.translation_m == pytest.approx((1.0, 0.0, 0.5), abs=1e-9)
    assert car.box_max_m == pytest.approx((0.02, 0.04, 0.06), abs=1e-9)
    assert from_plain(Instance, json.loads(canonical_json(car))) == car
