"""Visibility of keypoints in images drawn by hand: one camera at the origin that looks along +Z."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gen_data.annotations.annotate import Thresholds, annotate_objects
from gen_data.annotations.keypoints import Keypoints
from gen_data.core.asset_types import Keypoint
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.sample import KeypointTruth
from gen_data.core.scene import Camera, Instance, Scene
from gen_data.core.se3 import IDENTITY, SE3
from gen_data.core.skeletons import PERSON, VEHICLE, find_skeleton

W, H = 20, 12
CAMERA = Camera("color", IDENTITY, Intrinsics(W, H, 10.0, 10.0, 10.0, 6.0))
PANEL, SCREEN = 1, 2


def seen(
    *points: Keypoint,
    T_world_instance: SE3 = IDENTITY,
    screen_m: float = 1.0,
    normal: tuple[float, float, float] = (0.0, 0.0, -1.0),
) -> tuple[KeypointTruth, ...]:
    """Keypoints of a panel 2 m ahead that fills columns 5 to 15 and rows 2 to 10.

    A screen ``screen_m`` ahead covers its columns from 12 on; the wall is 5 m away.
    """
    ids = np.zeros((H, W), np.uint16)
    ids[2:10, 5:15] = PANEL
    ids[2:10, 12:15] = SCREEN
    depth_m = np.array([5.0, 2.0, screen_m], np.float32)[ids]
    panel = Instance(
        PANEL, "panel", "panel", 1, "panel", T_world_instance=T_world_instance, keypoints=points
    )
    normals = np.full((H, W, 3), normal, np.float32)
    range_m = depth_m / CAMERA.intrinsics.pixel_rays()[..., 2]
    channels = {Channel.INSTANCE: ids, Channel.RANGE: range_m, Channel.NORMALS: normals}
    reading = SensorReading("color", CAMERA, channels)
    scene = Scene("panel", instances=(panel,))
    (truth,) = annotate_objects(scene, reading, [Keypoints()], Thresholds()).objects
    assert truth.keypoints is not None
    return truth.keypoints


def test_a_point_on_the_surface_is_visible_at_its_projection() -> None:
    """(0.3, -0.2, 2) m with a focal length of 10 px: 1.5 px right of, 1 px above (10, 6)."""
    (point,) = seen(Keypoint("tip", (0.3, -0.2, 2.0)))

    assert point == KeypointTruth("tip", (0.3, -0.2, 2.0), (11.5, 5.0), 2)


def test_positions_follow_the_instance() -> None:
    """A quarter turn about Z: the point's x becomes y, then the instance is moved."""
    turned = SE3.about_z(np.pi / 2, (-0.2, -0.3, 2.0))

    (point,) = seen(Keypoint("tip", (0.4, 0.0, 0.0)), T_world_instance=turned)

    assert point.position_m == pytest.approx((-0.2, 0.1, 2.0))
    assert point.image_px == pytest.approx((9.0, 6.5))


SLANT = np.array([-0.9, 0.7, 2.0])
OBLIQUE = {"normal": (0.75**0.5, 0.0, -0.5)}
GRAZING = {"normal": (1.0, 0.0, 0.0)}
FAR_SCREEN = {"screen_m": 3.0}


@pytest.mark.parametrize(
    ("place_m", "changes", "expected"),
    [
        # On the optical axis: deeper than 5 cm in the object it is hidden by the object.
        ((0, 0, 1.9), {}, 2), ((0, 0, 2.04), {}, 2), ((0, 0, 2.06), {}, 1), ((0, 0, 3.0), {}, 1),
        # On a slant: the panel's normal is the optical axis, however the ray comes.
        (1.024 * SLANT, {}, 2), (1.026 * SLANT, {}, 1),
        # At 60 degrees 9 cm along the ray are 4.5 cm across; grazing rays go three radii deep.
        ((0, 0, 2.09), OBLIQUE, 2), ((0, 0, 2.11), OBLIQUE, 1),
        ((0, 0, 2.14), GRAZING, 2), ((0, 0, 2.16), GRAZING, 1),
        # Behind the screen; also at its border, where a neighbour shows the panel.
        ((0.7, 0, 2.0), {}, 1), ((0.41, 0, 2.0), {}, 1), ((0.39, 0, 2.0), {}, 2),
        # The screen is 3 m away: the ray misses the panel by one pixel, or by two.
        ((0.41, 0, 2.0), FAR_SCREEN, 2), ((0.61, 0, 2.0), FAR_SCREEN, 1),
        # One pixel off the panel's left and upper edge, and two.
        ((-1.01, 0, 2.0), {}, 2), ((-1.21, 0, 2.0), {}, 1),
        ((0, -0.81, 2.0), {}, 2), ((0, -1.1, 2.0), {}, 1),
        # The very corner of the image belongs to it.
        ((-2.0, -1.2, 2.0), {}, 1),
    ],
)  # fmt: skip
def test_a_point_is_visible_near_the_surface_and_hidden_behind_and_off_the_object(
    place_m: Any, changes: dict[str, Any], expected: int
) -> None:
    """A point of radius 5 cm."""
    (point,) = seen(Keypoint("tip", tuple(map(float, place_m)), 0.05), **changes)
    assert point.visibility == expected


@pytest.mark.parametrize(
    "place_m", [(-2.01, 0.0, 2.0), (2.0, 0.0, 2.0), (0.0, 1.2, 2.0), (0.0, 0.0, -2.0), (0, 0, 0)]
)
def test_a_point_outside_the_image_or_behind_is_at_zero(
    place_m: tuple[float, float, float],
) -> None:
    """The image covers [0, 20) x [0, 12); its camera position is known all the same."""
    (point,) = seen(Keypoint("tip", place_m))

    assert (point.image_px, point.visibility) == ((0.0, 0.0), 0)
    assert point.position_m == place_m


def test_points_keep_the_instances_order() -> None:
    names = ["b", "a", "c"]

    assert [p.name for p in seen(*(Keypoint(n, (0.0, 0.0, 2.0)) for n in names))] == names


def test_the_persons_skeleton_is_cocos() -> None:
    """Bones as person_keypoints_val2017.json lists them, from 1."""
    official = [
        [16, 14], [14, 12], [17, 15], [15, 13], [12, 13], [6, 12], [7, 13], [6, 7], [6, 8],
        [7, 9], [8, 10], [9, 11], [2, 3], [1, 2], [1, 3], [2, 4], [3, 5], [4, 6], [5, 7],
    ]  # fmt: skip

    assert [[a + 1, b + 1] for a, b in PERSON.bones] == official


def test_a_skeleton_is_found_by_any_of_its_names() -> None:
    """And unknown names are a skeleton without bones, in their own order."""
    assert find_skeleton(["headlight_left", "wheel_rear_left"]) is VEHICLE
    assert find_skeleton(["right_knee"]) is PERSON
    assert find_skeleton(["lid", "handle", "lid"]).names == ("lid", "handle")
    assert find_skeleton(["lid"]).bones == ()
    assert len(find_skeleton([*PERSON.names, "wheel_front"]).names) == 21


def test_a_fisheye_sees_points_beside_and_behind_it() -> None:
    """A ball of keypoints at 100 degrees from the axis: in the image, at the angle's place."""
    lens = Lens("kannala_brandt", (0.0,) * 4)
    camera = replace(CAMERA, intrinsics=Intrinsics(200, 40, 50.0, 50.0, 100.0, 20.0, lens))
    angle = math.radians(100.0)
    place = (2.0 * math.sin(angle), 0.0, 2.0 * math.cos(angle))
    thing = Instance(1, "thing", "thing", 1, "thing", keypoints=(Keypoint("tip", place, 0.05),))
    channels = {
        Channel.INSTANCE: np.ones((40, 200), np.uint16),
        Channel.RANGE: np.full((40, 200), 2.0, np.float32),
        Channel.NORMALS: np.asarray(-camera.intrinsics.pixel_rays(), np.float32),
    }
    scene = Scene("test", instances=(thing,))

    (truth,) = annotate_objects(
        scene, SensorReading("color", camera, channels), [Keypoints()], Thresholds()
    ).objects

    assert truth.keypoints is not None
    (point,) = truth.keypoints
    assert (point.visibility, point.image_px) == (2, pytest.approx((100.0 + 50.0 * angle, 20.0)))
