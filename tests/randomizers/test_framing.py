"""Cameras that frame an object: its size and place in the image, for any lens.

Expected images are projected by OpenCV, and by hand for panoramas.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from gen_data.config.distributions import Choice, Constant, LogUniform, Normal, Uniform
from gen_data.core.errors import ConfigError, LayoutRejected
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.scene import Body, Camera, ObjectGroup, Region, Scene, SupportSurface
from gen_data.core.se3 import SE3, Array
from gen_data.randomizers.camera_pose import CameraPose
from gen_data.randomizers.framing import Framing, Thing, frame, long_side_share
from tests import opencv
from tests.randomizers.doubles import FakeAssets, box_of, corners_of, rng_of

LENSES = {
    "pinhole": Intrinsics.from_hfov(640, 480, math.radians(65.0)),
    "portrait": Intrinsics(480, 640, 560.0, 565.0, 247.0, 311.0),
    "barrel": Intrinsics(
        640, 480, 500.0, 505.0, 322.0, 236.0,
        Lens("brown_conrady", (-0.2, 0.03, 0.001, -0.001, 0.0, 0.0, 0.0, 0.0)),
    ),
    "fisheye": Intrinsics(
        640, 480, 180.0, 180.0, 318.0, 243.0,
        Lens("kannala_brandt", (-0.02, 0.003, 0.0, 0.0), math.radians(100.0)),
    ),
    "panorama": Intrinsics(
        800, 400, 400 / math.pi, 400 / math.pi, 400.0, 200.0, Lens("equirectangular")
    ),
}  # fmt: skip

GROUP = ObjectGroup("clutter", ("table",), ("brick", "bottle", "ball"), 3, "drop")
TABLE = SupportSurface("table", "table", SE3((0.0, 0.0, 0.74)), (1.2, 0.8), 1.5)
SCENE = Scene(
    "test",
    bodies=(
        Body("table", "table", instance_id=1),
        Body("clutter/0", "brick", SE3((0.3, 0.1, 0.76)), instance_id=2, group="clutter"),
        Body("clutter/1", "bottle", SE3((-0.3, 0.2, 0.88)), instance_id=3, group="clutter"),
        Body("clutter/2", "ball", SE3((0.1, -0.2, 0.86)), 0.5, instance_id=4, group="clutter"),
    ),
    surfaces=(TABLE,),
    groups=(GROUP,),
    focus=Region((0.0, 0.0, 0.86), (1.2, 0.8, 0.24)),
    interior_m=((-2.8, -2.3, 0.1), (2.8, 2.3, 2.6)),
    cameras=(Camera("color", SE3(), LENSES["pinhole"]),),
)


def seen_px(points_camera_m: Array, k: Intrinsics) -> Array:
    """Image points, [n, 2], by OpenCV, whose pixel centres and ours differ by the same half."""
    if k.lens.model == "equirectangular":
        x, y, z = points_camera_m.T
        angles = np.stack([np.arctan2(x, z), np.arctan2(y, np.hypot(x, z))], axis=-1)
        return np.asarray(angles * (k.fx_px, k.fy_px) + (k.cx_px, k.cy_px))
    return opencv.places(k, points_camera_m)


def framed(scene: Scene = SCENE, number: int = 0, **given: object) -> Camera:
    values: dict[str, object] = {"aim": Constant("clutter"), "fills": Constant(0.3), **given}
    pose = CameraPose(name="close", **values)  # type: ignore[arg-type]
    return pose(scene, FakeAssets(), rng_of("close", number, index=number)).cameras[0]


def share_of(body: Body, camera: Camera) -> float:
    """Longer side of a box's image over the longer side of the image, by OpenCV."""
    k = camera.intrinsics
    points = seen_px(camera.T_world_camera.inverse().apply(corners_of(body)), k)
    return float(np.ptp(points, axis=0).max()) / max(k.width_px, k.height_px)


@pytest.mark.parametrize("lens", LENSES)
@settings(max_examples=25, deadline=None)
@given(
    share=st.floats(0.03, 0.6), azimuth=st.floats(-math.pi, math.pi),
    elevation=st.floats(-1.5, 1.5), aside=st.tuples(st.floats(-0.15, 0.15), st.floats(-0.15, 0.15)),
    roll=st.floats(-0.5, 0.5), seed=st.integers(0, 1000),
)  # fmt: skip
# The axis of a level camera would be within a milliradian of the vertical.
@example(
    share=0.5, azimuth=2.5, elevation=-1.4307098734166879, aside=(-0.11049349607705886, 0.0),
    roll=-0.5, seed=0,
)  # fmt: skip
def test_thing_fills_its_share_at_its_place_through_any_lens(
    lens: str,
    share: float,
    azimuth: float,
    elevation: float,
    aside: tuple[float, float],
    roll: float,
    seed: int,
) -> None:
    """A cloud of points in any direction: longer side of its box, image of its centre, bearing."""
    k = LENSES[lens]
    # The corners of the fisheye's image are outside its field. Half of a panorama's width is 180
    # degrees, which nothing spans around the horizon that is seen from outside.
    share *= {"fisheye": 0.5, "panorama": 0.8}.get(lens, 1.0)
    rng = np.random.default_rng(seed)
    size_m = rng.uniform(0.02, 0.2, 3)
    center_m = rng.uniform(-1.0, 1.0, 3)
    points_m = center_m + rng.uniform(-0.5, 0.5, (60, 3)) * size_m
    level = math.cos(elevation)
    toward = (level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation))
    at_px = ((0.5 + aside[0]) * k.width_px, (0.5 + aside[1]) * k.height_px)
    thing = Thing(tuple(center_m), points_m)

    pose = frame(thing, Framing(share, toward, at_px, roll), k)

    assert pose is not None
    T_camera_world = pose.inverse()
    seen = seen_px(T_camera_world.apply(points_m), k)
    assert np.ptp(seen, axis=0).max() == pytest.approx(
        share * max(k.width_px, k.height_px), rel=1e-4
    )
    assert seen_px(T_camera_world.apply(center_m[None]), k)[0] == pytest.approx(at_px, abs=0.01)
    away = np.subtract(pose.translation_m, center_m)
    assert away / np.linalg.norm(away) == pytest.approx(toward, abs=1e-6)


def test_lenses_that_focus_on_nothing_nearer_keep_their_distance() -> None:
    """A brick of 6 cm fills 0.8 from 7 cm only; small shares are met as before."""
    bricks = replace(SCENE, bodies=SCENE.bodies[:2])
    for number in range(8):
        camera = framed(bricks, number, fills=Constant(0.8), nearest_m=0.4)
        away_m = math.dist(
            camera.T_world_camera.translation_m, SCENE.bodies[1].T_world_body.translation_m
        )
        freely = framed(bricks, number, fills=Constant(0.02), nearest_m=0.4)

        assert away_m == pytest.approx(0.4, abs=1e-6)
        assert share_of(SCENE.bodies[1], freely) == pytest.approx(0.02, rel=1e-4)


@pytest.mark.parametrize("roll_deg", [-8.0, 0.0, 5.0])
def test_camera_stays_level_beside_the_thing(roll_deg: float) -> None:
    """Its X axis leans by the roll alone, wherever in the image the object is."""
    thing = Thing((0.0, 0.0, 0.0), np.array([[-0.1, 0.0, -0.1], [0.1, 0.0, 0.1]]))
    for at_px in ((320.0, 240.0), (120.0, 60.0), (600.0, 400.0)):
        framing = Framing(0.2, (0.0, -0.8, 0.6), at_px, math.radians(roll_deg))
        pose = frame(thing, framing, LENSES["pinhole"])

        assert pose is not None
        right = pose.rotate(np.array([1.0, 0.0, 0.0]))
        down = pose.rotate(np.array([0.0, 1.0, 0.0]))
        assert math.degrees(math.atan2(-right[2], -down[2])) == pytest.approx(roll_deg, abs=1e-4)


@pytest.mark.parametrize("lens", LENSES)
def test_one_object_of_the_group_has_the_drawn_size(lens: str) -> None:
    """Placed by the randomizer among others; poses are rounded to a micrometre."""
    scene = replace(SCENE, cameras=(replace(SCENE.cameras[0], intrinsics=LENSES[lens]),))
    for number in range(6):
        camera = framed(scene, number, fills=Constant(0.15))
        shares = [share_of(body, camera) for body in SCENE.bodies[1:]]

        assert min(abs(share / 0.15 - 1.0) for share in shares) < 1e-3


def test_silhouette_of_a_round_thing_counts_not_its_box() -> None:
    """A sphere: its bounding box would be up to 1.7 times as large in the image."""
    ball = np.random.default_rng(0).normal(size=(20_000, 3))
    ball *= 0.1 / np.linalg.norm(ball, axis=1, keepdims=True)
    pose = frame(Thing((0.0, 0.0, 0.0), ball), Framing(0.5, (0.0, 0.0, 1.0), (320.0, 240.0), 0.3),
                 LENSES["pinhole"])  # fmt: skip

    # 2 f tan(asin(r / d)) = 0.5 W by hand.
    tangent = 0.25 * 640 / LENSES["pinhole"].fx_px
    assert pose is not None
    assert pose.translation_m[2] == pytest.approx(0.1 / math.sin(math.atan(tangent)), rel=2e-3)


def test_drawn_shares_are_distributed_as_declared_whatever_is_in_the_way() -> None:
    """Kolmogorov-Smirnov: 200 log-uniform draws of the ball's share, among table and others."""
    alone = replace(SCENE, groups=(replace(GROUP, name="others"),),
                    bodies=(*SCENE.bodies[:3], replace(SCENE.bodies[3], group="ball")))  # fmt: skip
    scene = replace(alone, groups=(ObjectGroup("ball", ("table",), ("ball",), 1, "drop"),))
    ball = scene.bodies[3]
    low, high = 0.06, 0.6
    shares = np.sort([
        share_of(ball, framed(scene, number, aim=Constant("ball"), fills=LogUniform(low, high),
                              elevation_deg=Uniform(-20.0, 70.0)))
        for number in range(200)
    ])  # fmt: skip
    expected = np.log(shares / low) / math.log(high / low)

    gap = np.abs(expected - (np.arange(200) + 0.5) / 200).max() + 0.5 / 200
    assert gap < 1.63 / math.sqrt(200), "the critical value at 1 %"


def test_camera_keeps_its_elevation_room_and_clearance() -> None:
    """Seen from the object's centre; never in a body or beyond a wall."""
    for number in range(40):
        camera = framed(number=number, fills=LogUniform(0.04, 0.9),
                        elevation_deg=Uniform(20.0, 50.0), clearance_m=0.08)  # fmt: skip
        eye = np.array(camera.T_world_camera.translation_m)

        assert (eye >= SCENE.interior_m[0]).all()
        assert (eye <= SCENE.interior_m[1]).all()
        rises = []
        for body in SCENE.bodies:
            box = corners_of(body)
            outside = np.maximum(box.min(axis=0) - eye, eye - box.max(axis=0)).max()
            assert outside >= 0.08 - 2e-6
            away = eye - 0.5 * (box.min(axis=0) + box.max(axis=0))
            rises.append(math.degrees(math.atan2(away[2], math.hypot(*away[:2]))))
        assert any(20.0 - 1e-3 <= rise <= 50.0 + 1e-3 for rise in rises[1:])


@pytest.mark.parametrize(("off_center", "gap"), [(0.0, 0.5), (1.0, 0.0), (-0.5, 0.25)])
def test_thing_lies_as_far_from_the_middle_as_was_drawn(off_center: float, gap: float) -> None:
    """A square of the object's size has this share of the free space on its nearer side."""
    camera = framed(off_center=Constant(off_center))
    centers = [box_of(b)[0] for b in SCENE.bodies[1:]]
    seen = LENSES["pinhole"].project(camera.T_world_camera.inverse().apply(np.array(centers)))

    side = 0.3 * 640
    wanted = [gap * (size - side) + 0.5 * side for size in (640, 480)]
    expected = wanted if off_center < 0.0 else np.subtract((640, 480), wanted)
    assert np.abs(seen - expected).max(axis=1).min() < 0.05


@pytest.mark.parametrize(("aim", "high_m"), [("table", 0.74), ("", 0.86)])
def test_surface_and_scene_can_be_framed(aim: str, high_m: float) -> None:
    """The middle of the table's top, and of the scene's focus, in the middle of the image."""
    camera = framed(aim=Constant(aim), off_center=Constant(0.0), fills=Constant(0.8))
    middle = camera.T_world_camera.inverse().apply(np.array([0.0, 0.0, high_m]))

    assert LENSES["pinhole"].project(middle) == pytest.approx((320.0, 240.0), abs=0.01)


def test_aims_can_be_mixed_and_need_no_share() -> None:
    """A distance in metres, from the centre of the table's top or of one of the objects."""
    centers = [box_of(b)[0] for b in SCENE.bodies[1:]]
    counts = {"table": 0, "clutter": 0}
    for number in range(40):
        orbit = CameraPose(name="orbit", aim=Choice(("table", "clutter")), jitter_m=Constant(0.0),
                           distance_m=Constant(1.0))  # fmt: skip
        camera = orbit(SCENE, FakeAssets(), rng_of("orbit", number, index=number)).cameras[0]
        eye = np.array(camera.T_world_camera.translation_m)
        to_table = abs(float(np.linalg.norm(eye - (0.0, 0.0, 0.74))) - 1.0) < 1e-5
        to_object = min(abs(float(np.linalg.norm(eye - c)) - 1.0) for c in centers) < 1e-5

        assert to_table != to_object
        counts["table" if to_table else "clutter"] += 1
    assert min(counts.values()) > 8


def test_small_shares_are_tried_only_where_the_drawn_one_has_no_place() -> None:
    """A share of .9 or .2: with more room around objects, only places at .55 or .2 are free."""
    either = Choice({0.9: 1.0, 0.2: 1e-9})
    sides = {}
    for clearance_m in (0.0, 0.25, 0.4):
        camera = framed(fills=either, off_center=Constant(0.0), clearance_m=clearance_m)
        T = camera.T_world_camera.inverse()
        corners = [LENSES["pinhole"].project(T.apply(corners_of(b))) for b in SCENE.bodies[1:]]
        ahead = [c for c in corners if np.isfinite(c).all()]
        sides[clearance_m] = [float(np.ptp(c, axis=0).max()) / 640 for c in ahead]
    assert min(abs(side - 0.9) for side in sides[0.0]) < 0.02
    assert min(abs(side - 0.55) for side in sides[0.25]) < 0.02
    assert min(abs(side - 0.2) for side in sides[0.4]) < 0.02


WIDE = replace(SCENE.cameras[0], intrinsics=LENSES["panorama"])


@pytest.mark.parametrize(("scene", "fills", "reason"), [
    (replace(SCENE, bodies=SCENE.bodies[:1]), 0.3, "no object of the group 'clutter'"),
    (SCENE, 0.001, "no free place from which camera 'color' frames an object"),
    (replace(SCENE, cameras=(WIDE,)), 3.0, "the lens of camera 'color' cannot show an object"),
])  # fmt: skip
def test_empty_group_and_unreachable_share_are_rejected_with_a_reason(
    scene: Scene, fills: float, reason: str
) -> None:
    """Another draw may succeed: each reason is counted by its text."""
    with pytest.raises(LayoutRejected) as refused:
        framed(scene, fills=Constant(fills))
    assert reason in refused.value.rejection.reason
    assert "randomizers.close" in refused.value.rejection.remedy


@pytest.mark.parametrize(("given", "fact"), [
    ({"fills": Constant(0.001)}, "smallest object fills about 0.003.*larger room"),
    ({"fills": Uniform(0.9, 1.0), "clearance_m": 0.8}, "largest object fills about.*smaller"),
    ({"fills": Constant(0.2), "aim": Constant("cluter")}, "named 'cluter'.*mean 'clutter'"),
    ({"fills": Constant(0.2), "camera": "colour"}, "no camera 'colour'.*mean 'color'"),
])  # fmt: skip
def test_impossible_framing_is_refused_before_a_run(given: dict[str, object], fact: str) -> None:
    """Names, and shares that no place in the room gives to any object of the group."""
    pose = CameraPose(name="close", **{"aim": Constant("clutter"), **given})  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match=fact):
        pose.check(SCENE, FakeAssets())


@pytest.mark.parametrize(
    "given", [{"aim": Constant("clutter"), "fills": LogUniform(0.001, 4.0)}, {}]
)
def test_possible_framing_passes_the_check(given: dict[str, object]) -> None:
    """Part of the range may be out of reach: such draws are rejected one by one."""
    CameraPose(name="a", **given).check(SCENE, FakeAssets())  # type: ignore[arg-type]


def test_infinite_share_stands_for_points_without_an_image() -> None:
    points = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])

    assert long_side_share(points, LENSES["pinhole"]) == math.inf
    assert Normal(0.0, 0.35, clip=(-1.0, 1.0)) == CameraPose(name="close").off_center
