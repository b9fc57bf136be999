"""Places along lanes, against the circle that a lane follows."""

import math

import pytest

from gen_data.core.lane_geometry import LaneLine, pose_on_lane
from gen_data.core.scene import Lane
from gen_data.core.se3 import SE3

RADIUS_M = 50.0


def bend() -> LaneLine:
    """A quarter of a circle to the left around (0, 50), from the origin, climbing 2 m."""
    angles = [0.5 * math.pi * k / 80 for k in range(81)]
    center = tuple(
        (RADIUS_M * math.sin(a), RADIUS_M * (1.0 - math.cos(a)), 2.0 * a / (0.5 * math.pi))
        for a in angles
    )
    return LaneLine(Lane("bend", "driving", center, 3.5))


def test_length_is_that_of_the_arc() -> None:
    """Chords of 1 m on a radius of 50 m are short by 2e-5 of their length."""
    arc_m = math.hypot(0.5 * math.pi * RADIUS_M, 2.0)
    assert bend().length_m == pytest.approx(arc_m, rel=1e-4)


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("left_m", [-1.5, 0.0, 2.0])
def test_pose_lies_on_the_parallel_arc_and_looks_along_it(share: float, left_m: float) -> None:
    """To the left is nearer to the centre of the circle."""
    line = bend()
    pose = line.pose(share * line.length_m, left_m)
    x, y, z = pose.translation_m
    angle = share * 0.5 * math.pi

    assert math.hypot(x, y - RADIUS_M) == pytest.approx(RADIUS_M - left_m, abs=0.01)
    assert z == pytest.approx(2.0 * share, abs=1e-6)
    ahead = pose.rotation()[:, 0]
    assert math.atan2(ahead[1], ahead[0]) == pytest.approx(angle, abs=0.02)


def test_what_stands_on_a_lane_has_its_middle_there_and_its_lowest_point_on_the_ground() -> None:
    """Bounds 4 x 2 x 1.5 m whose origin is at the rear axle and 0.3 m up."""
    lane = Lane("lane", "driving", ((0.0, 0.0, 0.1), (100.0, 0.0, 0.1)), 3.5)
    bounds_m = ((-1.0, -1.0, -0.3), (3.0, 1.0, 1.2))
    place = LaneLine(lane).pose(20.0)

    pose = pose_on_lane(place, lane, bounds_m, "along")
    turned = pose_on_lane(place, lane, bounds_m, "left")

    assert pose.translation_m == pytest.approx((19.0, 0.0, 0.4))
    assert (turned @ SE3((1.0, 0.0, -0.3))).translation_m == pytest.approx((20.0, 0.0, 0.1))
    assert turned.rotation()[:, 0] == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)


def test_fronts_of_houses_stand_on_their_line() -> None:
    """A house of 10 m depth faces the street on the lane's left."""
    lane = Lane("fronts", "frontage", ((0.0, 0.0, 0.0), (100.0, 0.0, 0.0)), 1.0)
    bounds_m = ((-10.0, -6.0, 0.0), (0.5, 6.0, 9.0))
    pose = pose_on_lane(LaneLine(lane).pose(50.0), lane, bounds_m, "left")

    front = pose @ SE3((0.5, 0.0, 0.0))
    assert front.translation_m == pytest.approx((50.0, 0.0, 0.0), abs=1e-9)
