"""Annotators on images drawn by hand, where every number can be counted on paper."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.annotations import TABLE
from gen_data.annotations.annotate import Thresholds, annotate_objects
from gen_data.annotations.boxes3d import annotate_boxes
from gen_data.core.boxes import BoxPx
from gen_data.core.capture import Channel, SensorReading, Silhouette
from gen_data.core.errors import ConfigError, SampleError
from gen_data.core.interfaces import Annotator
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.sample import KeypointTruth, ObjectTruth
from gen_data.core.scene import Camera, Instance, Scene
from gen_data.core.se3 import SE3, look_at

W, H = 20, 12
CAMERA = Camera(
    "color", look_at((2.0, 1.0, 0.5), (0.0, 0.0, 0.0)), Intrinsics(W, H, 15.0, 15.0, 10.0, 6.0)
)
ARM = Instance(
    2,
    "arm",
    "robot",
    1,
    "franka",
    parts=("base", "elbow", "hand"),
    T_world_instance=SE3.about_z(0.5, (0.1, 0.2, 0.3)),
    box_min_m=(-0.1, -0.2, 0.0),
    box_max_m=(0.3, 0.2, 1.0),
)
MUG = Instance(
    5,
    "mug",
    "cup",
    2,
    "mug",
    T_world_instance=SE3((0.4, -0.1, 0.0), (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)),
    box_min_m=(-0.04, -0.04, 0.0),
    box_max_m=(0.04, 0.04, 0.1),
)
CARPET = Instance(9, "carpet", "rug", 3, "rug", annotated=False)


def image(rectangles: Mapping[tuple[int, int, int, int], int]) -> NDArray[np.uint16]:
    """An image of rectangles (x_min, y_min, x_max, y_max) in order of painting."""
    pixels = np.zeros((H, W), np.uint16)
    for (x0, y0, x1, y1), value in rectangles.items():
        pixels[y0:y1, x0:x1] = value
    return pixels


def scene_and_reading() -> tuple[Scene, SensorReading]:
    """The mug stands before the arm, which leaves the image at the left; a carpet lies below.

    The arm's silhouette is 10 x 8 = 80 px; 4 of its columns are outside the image and 12 of its
    pixels are behind the mug.
    """
    ids = image({(0, 9, 20, 12): 9, (0, 2, 6, 10): 2, (4, 4, 8, 10): 5})
    reading = SensorReading(
        "color",
        CAMERA,
        {
            Channel.INSTANCE: ids,
            Channel.NORMALS: np.full((H, W, 3), (0.0, 0.0, -1.0), np.float32),
            Channel.Z_DEPTH: np.where(ids == 5, 1.5, 2.0).astype(np.float32),
            Channel.CATEGORY: np.array([0, 0, 1, 0, 0, 2, 0, 0, 0, 3], np.uint16)[ids],
            Channel.PART: image({(0, 2, 6, 4): 3, (0, 4, 3, 10): 1, (4, 4, 8, 10): 0}),
        },
        {
            2: Silhouette(2, -4, 2, np.ones((8, 10), bool)),
            5: Silhouette(5, 4, 4, np.ones((6, 4), bool)),
            9: Silhouette(9, 0, 9, np.ones((3, 20), bool)),
        },
    )
    return Scene("hand", instances=(MUG, CARPET, ARM)), reading


def annotators(*names: str) -> list[Annotator]:
    made = [TABLE.load(name)() for name in names or TABLE]
    return [annotator for annotator in made if isinstance(annotator, Annotator)]


@pytest.fixture
def truths() -> tuple[ObjectTruth, ...]:
    return annotate_objects(*scene_and_reading(), annotators(), Thresholds()).objects


def test_measures_are_of_visible_and_whole_silhouettes(truths: tuple[ObjectTruth, ...]) -> None:
    """By instance id: of 80 px of the arm, 32 are left of the image and 12 behind the mug.

    The carpet is seen and has no annotation.
    """
    assert [
        (t.instance.name, t.visible_px, t.box, t.amodal_box, t.visible_fraction, t.occlusion)
        for t in truths
    ] == [
        ("arm", 36, BoxPx(0, 2, 6, 10), BoxPx(-4, 2, 6, 10), 36 / 80, 12 / 48),
        ("mug", 24, BoxPx(4, 4, 8, 10), BoxPx(4, 4, 8, 10), 1.0, 0.0),
    ]
    assert [t.truncation for t in truths] == [32 / 80, 0.0]


def test_masks_fill_their_boxes(truths: tuple[ObjectTruth, ...]) -> None:
    """The arm lacks the 2 x 6 px that the mug covers; its amodal mask has them."""
    arm, _ = truths
    assert arm.mask is not None
    assert arm.amodal_mask is not None

    expected = np.ones((8, 6), bool)
    expected[2:, 4:] = False
    np.testing.assert_array_equal(arm.mask.pixels, expected)
    assert (arm.mask.x_px, arm.mask.y_px) == (0, 2)
    assert (arm.amodal_mask.x_px, arm.amodal_mask.y_px) == (0, 2)
    np.testing.assert_array_equal(arm.amodal_mask.pixels, np.ones((8, 6), bool))


def test_an_amodal_mask_is_tight_after_clipping() -> None:
    """An L whose foot is outside the image: the rest is narrower than the clip."""
    scene, reading = scene_and_reading()
    outline = np.zeros((8, 10), bool)
    outline[:, 4:] = True
    outline[7, :] = True
    outline[:6, 4:6] = False
    lying = replace(reading, silhouettes={**reading.silhouettes, 2: Silhouette(2, -4, 2, outline)})
    (annotator,) = annotators("amodal_masks")

    mask = annotator.annotate(scene, lying, ObjectTruth(ARM, 1, None)).amodal_mask

    assert mask is not None
    assert (mask.x_px, mask.y_px, mask.pixels.shape) == (0, 2, (8, 6))
    np.testing.assert_array_equal(mask.pixels, outline[:, 4:])
    upper = replace(reading, silhouettes={2: Silhouette(2, -4, -7, outline[:, ::-1])})
    cut = annotator.annotate(scene, upper, ObjectTruth(ARM, 1, None)).amodal_mask
    assert cut is not None
    assert (cut.x_px, cut.y_px, cut.pixels.shape) == (0, 0, (1, 6))


def test_part_pixels_are_counted_by_name(truths: tuple[ObjectTruth, ...]) -> None:
    """Hand 12, base 18; the elbow is not seen; 6 px belong to no part. Mugs have no parts."""
    arm, mug = truths

    assert arm.part_px == {"base": 18, "elbow": 0, "hand": 12}
    assert mug.part_px is None


def test_the_pose_in_the_camera_undoes_the_cameras_own(truths: tuple[ObjectTruth, ...]) -> None:
    for truth in truths:
        assert truth.T_camera_object is not None
        expected = np.linalg.inv(CAMERA.T_world_camera.matrix()) @ (
            truth.instance.T_world_instance.matrix()
        )
        np.testing.assert_allclose(truth.T_camera_object.matrix(), expected, atol=1e-12)


def test_boxes_in_both_frames_are_the_instances_bounds(truths: tuple[ObjectTruth, ...]) -> None:
    """The eight combinations of bounds, carried by matrices, are the boxes' corners."""
    for truth in truths:
        low, high = truth.instance.box_min_m, truth.instance.box_max_m
        local = np.array(
            [[x, y, z, 1] for x in (low[0], high[0]) for y in (low[1], high[1])
             for z in (low[2], high[2])]
        )  # fmt: skip
        world = local @ truth.instance.T_world_instance.matrix().T
        camera = world @ np.linalg.inv(CAMERA.T_world_camera.matrix()).T
        assert truth.box3d_world is not None
        assert truth.box3d_camera is not None
        np.testing.assert_allclose(truth.box3d_world.corners(), world[:, :3], atol=1e-12)
        np.testing.assert_allclose(truth.box3d_camera.corners(), camera[:, :3], atol=1e-12)


def test_boxes_of_space_leave_out_what_is_beside_the_body() -> None:
    """In every frame, also of samples as a whole; the centre moves by half of the missing part."""
    scene, reading = scene_and_reading()
    arm = replace(ARM, body_bounds_m=((-0.1, -0.2, 0.0), (0.2, 0.1, 1.0)))
    scene = replace(scene, instances=(MUG, arm))

    (seen, _) = annotate_objects(scene, reading, annotators("boxes3d"), Thresholds()).objects
    frame = annotate_boxes(scene, SE3())

    assert seen.box3d_world is not None and seen.box3d_camera is not None
    whole = ARM.box3d
    moved = ARM.T_world_instance.rotate(np.array([-0.05, -0.05, 0.0]))
    for box in (seen.box3d_world, frame[2]):
        assert box.size_m == pytest.approx((0.3, 0.3, 1.0))
        between = np.subtract(box.T_frame_box.translation_m, whole.T_frame_box.translation_m)
        assert between == pytest.approx(moved)
    assert seen.box3d_camera.size_m == seen.box3d_world.size_m
    assert frame[5] == MUG.box3d


@pytest.mark.parametrize(
    ("thresholds", "listed"),
    [
        (Thresholds(), ["arm", "mug"]),
        (Thresholds(min_visible_px=24), ["arm", "mug"]),
        (Thresholds(min_visible_px=25), ["arm"]),
        (Thresholds(min_visible_fraction=0.45), ["arm", "mug"]),
        (Thresholds(min_visible_fraction=0.46), ["mug"]),
        (Thresholds(min_box_px=4), ["arm", "mug"]),
        (Thresholds(min_box_px=5), ["arm"]),
        (Thresholds(min_visible_px=999, include_invisible=True), ["arm", "mug"]),
    ],
)
def test_thresholds_are_the_smallest_listed_values(
    thresholds: Thresholds, listed: list[str]
) -> None:
    """Arm: 36 px, 0.45 visible, 6 x 8 px. Mug: 24 px, whole, 4 x 6 px."""
    truth = annotate_objects(*scene_and_reading(), annotators(), thresholds)

    assert [t.instance.name for t in truth.objects] == listed


def test_hidden_and_absent_instances_are_listed_only_on_request() -> None:
    """One without a pixel has no box, an empty mask, and no visible fraction."""
    scene, reading = scene_and_reading()
    ghost = replace(MUG, instance_id=6, name="ghost")
    scene = replace(scene, instances=(*scene.instances, ghost))
    for silhouette in (
        Silhouette(6, 0, 0, np.zeros((0, 0), bool)),
        Silhouette(6, -30, 0, np.ones((3, 3), bool)),
    ):
        gone = replace(reading, silhouettes={**reading.silhouettes, 6: silhouette})

        usual = annotate_objects(scene, gone, annotators(), Thresholds())
        complete = annotate_objects(scene, gone, annotators(), Thresholds(include_invisible=True))

        assert len(usual.objects) == 2
        last = complete.objects[-1]
        assert (last.instance, last.visible_px, last.box) == (ghost, 0, None)
        assert (last.visible_fraction, last.occlusion, last.truncation) == (0.0, 0.0, 1.0)
        assert last.mask is not None
        assert last.mask.pixels.shape == (0, 0)


def test_a_fraction_that_is_not_measured_cannot_be_a_threshold() -> None:
    """The message states the missing annotation."""
    with pytest.raises(ConfigError, match="add 'visibility' to annotations"):
        annotate_objects(
            *scene_and_reading(), annotators("poses"), Thresholds(min_visible_fraction=0.1)
        )


def test_without_annotators_nothing_is_annotated() -> None:
    """A data set of images only needs no id image."""
    scene, reading = scene_and_reading()

    truth = annotate_objects(scene, replace(reading, channels={}), [], Thresholds())

    assert truth.objects == ()
    assert truth.camera is CAMERA


def keypoint(image_px: tuple[float, float], visibility: Any) -> KeypointTruth:
    """A keypoint named ``tip``, one metre ahead."""
    return KeypointTruth("tip", (0.0, 0.0, 1.0), image_px, visibility)


WHOLE = np.ones((8, 10), bool)
"""The silhouette of the arm; a hole in the next is at a visible pixel."""
HOLED = WHOLE.copy()
HOLED[3, 4] = False


class _Liar:
    channels = frozenset({Channel.INSTANCE})

    def __init__(self, **changes: Any) -> None:
        self.changes = changes

    def annotate(self, scene: Scene, reading: SensorReading, truth: ObjectTruth) -> ObjectTruth:
        return replace(
            truth, **{k: v(truth) if callable(v) else v for k, v in self.changes.items()}
        )


Spoiled = tuple[Scene, SensorReading, list[Any]]
Spoil = Callable[[Scene, SensorReading], Spoiled]


def silhouette(**changes: Any) -> Spoil:
    """The arm has another silhouette."""

    def spoil(scene: Scene, reading: SensorReading) -> Spoiled:
        bad = replace(reading.silhouettes[2], **changes)
        return scene, replace(reading, silhouettes={**reading.silhouettes, 2: bad}), []

    return spoil


def arm(**changes: Any) -> Spoil:
    """The arm is another one in the scene."""
    return lambda scene, reading: (
        replace(scene, instances=(replace(ARM, **changes), MUG)), reading, []
    )  # fmt: skip


def told(**changes: Any) -> Spoil:
    """Another annotator changes the truth; callables receive the truth before it."""
    return lambda scene, reading: (scene, reading, [_Liar(**changes)])


def turned(truth: ObjectTruth) -> Any:
    """A mask of the right shape and count."""
    assert truth.mask is not None
    return replace(truth.mask, pixels=truth.mask.pixels[::-1, ::-1])


@pytest.mark.parametrize(
    ("spoil", "fault"),
    [
        (silhouette(x_px=-5), "leaves the box"),
        (silhouette(mask=HOLED), "visible that are not in its silhouette"),
        (silhouette(mask=np.pad(WHOLE, ((0, 1), (0, 0)))), "not stored tight"),
        (silhouette(mask=np.zeros((0, 0), bool)), "leaves the box None"),
        (lambda scene, reading: (scene, replace(reading, silhouettes={}), []),
         "the renderer returned no silhouette"),
        (arm(T_world_instance=SE3((0.0, math.nan, 0.0))), "not rigid"),
        (arm(T_world_instance=SE3((0.0, 0.0, 0.0), (math.nan, 0.0, 0.0, 0.0))), "not rigid"),
        (arm(box_max_m=(-0.2, 0.2, 1.0)), "has the size"),
        (arm(box_max_m=(math.inf, 0.2, 1.0)), "has the size"),
        (arm(box_min_m=(0.0, 0.0, 0.0), box_max_m=(0.0, 0.0, 0.0)), "has the size"),
        (arm(parts=("base",)), "shows part 3; it has 1 parts"),
        (arm(category_id=2), "another category than 2"),
        (told(visible_px=35), "does not hold its 35 visible pixels"),
        (told(box=BoxPx(0, 2, 7, 10)), "not the tight box"),
        (told(box=BoxPx(0, 2, 5, 10)), "does not hold"),
        (told(box=BoxPx(0, 2, 6, 13)), "leaves the image"),
        (told(visible_fraction=1.01), "visible_fraction is 1.01"),
        (told(occlusion=-0.1), "occlusion is -0.1"),
        (told(truncation=math.nan), "truncation is nan"),
        (told(T_camera_object=SE3((0.0, 0.0, 1.0), (1.0, 0.1, 0.0, 0.0))), "not a rigid pose"),
        (told(keypoints=(keypoint((20.0, 3.0), 2),)), "'tip' at .* px is not in the image"),
        (told(keypoints=(keypoint((2.0, 3.0), 0),)), "'tip' is not in the image and has a place"),
        (told(keypoints=(keypoint((2.0, math.nan), 1),)), "'tip' is nowhere"),
        (told(mask=turned), "mask is not its visible pixels"),
    ],
)  # fmt: skip
def test_contradictions_between_scene_image_and_labels_stop_the_sample(
    spoil: Spoil, fault: str
) -> None:
    """Third-party annotators are held to the same contract."""
    scene, reading, liars = spoil(*scene_and_reading())

    with pytest.raises(SampleError, match=f"instance 2 'arm': .*{fault}"):
        annotate_objects(scene, reading, [*annotators(), *liars], Thresholds())


def test_an_annotated_instance_without_a_category_stops_the_sample() -> None:
    """Category 0 means none: no format could write it."""
    scene, reading, _ = arm(category_id=0)(*scene_and_reading())

    with pytest.raises(SampleError, match="annotated and its category 'robot' has no id"):
        annotate_objects(scene, reading, annotators("poses"), Thresholds())
