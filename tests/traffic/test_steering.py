"""Pure pursuit with a kinematic bicycle: geometry that does not depend on speed."""

import math

import numpy as np
import pytest

from gen_data.traffic.lane_routes import STATION_M
from gen_data.traffic.simulation import make_upright_trajectories
from gen_data.traffic.steering import follow_lines, normalize, rotate_small


def circle(radius_m: float, count: int) -> np.ndarray:
    """Points of a left turn, a station apart, from the origin along X."""
    angles = STATION_M * np.arange(count) / radius_m
    return radius_m * np.stack([np.sin(angles), 1.0 - np.cos(angles)], axis=1)


def test_a_vehicle_on_an_arc_stays_on_it() -> None:
    """The circle through the axle and the goal is the arc itself: to a centimetre over 30 m."""
    line = circle(12.0, 90)[None]
    courses = follow_lines(
        line, np.zeros((1, 2)), np.array([[1.0, 0.0]]), np.full((1, 61), 8), np.array([0.3])
    )
    radii = np.hypot(courses.xy_m[0, :, 0], courses.xy_m[0, :, 1] - 12.0)

    assert radii == pytest.approx(12.0, abs=0.01)
    assert courses.curvature_per_m[0] == pytest.approx(1.0 / 12.0, rel=0.01)


def test_a_vehicle_beside_its_line_comes_back_to_it() -> None:
    """One metre off to the left, it ends on the line, pointing along it, without crossing far."""
    line = np.stack([STATION_M * np.arange(120.0), np.zeros(120)], axis=1)[None]
    courses = follow_lines(
        line, np.array([[0.0, 1.0]]), np.array([[1.0, 0.0]]), np.full((1, 100), 12), np.array([0.3])
    )
    y = courses.xy_m[0, :, 1]

    assert y[0] == 1.0
    assert abs(y[-1]) < 0.01
    assert y.min() > -0.1
    assert courses.ahead[0, -1] == pytest.approx([1.0, 0.0], abs=1e-3)


def test_nobody_steers_sharper_than_they_can() -> None:
    """A corner of 90 degrees is cut, at the smallest radius."""
    corner = np.concatenate(
        [
            np.stack([STATION_M * np.arange(40.0), np.zeros(40)], axis=1),
            np.stack([np.full(60, 20.0), STATION_M * np.arange(60.0)], axis=1),
        ]
    )[None]
    courses = follow_lines(
        corner, np.zeros((1, 2)), np.array([[1.0, 0.0]]), np.full((1, 80), 8), np.array([0.2])
    )

    assert np.abs(courses.curvature_per_m).max() == pytest.approx(0.2)


def test_axles_move_where_they_point() -> None:
    """No side slip: the way from station to station is along the mean of both directions."""
    line = circle(15.0, 80)[None]
    courses = follow_lines(
        line, np.array([[0.0, 0.5]]), np.array([[1.0, 0.0]]), np.full((1, 60), 8), np.array([0.3])
    )
    way = normalize(np.diff(courses.xy_m[0], axis=0))
    mean = normalize(courses.ahead[0, 1:] + courses.ahead[0, :-1])

    assert (np.sum(way * mean, axis=1) > 0.9999).all()


def test_small_turns_keep_lengths() -> None:
    """The rational turn is a rotation: by 0.1 rad to a thousandth."""
    vectors = rotate_small(np.array([[3.0, 4.0]]), np.array([0.1]))

    assert np.hypot(*vectors[0]) == pytest.approx(5.0, abs=1e-12)
    assert math.atan2(vectors[0, 1], vectors[0, 0]) == pytest.approx(
        math.atan2(4.0, 3.0) + 0.1, abs=1e-4
    )


@pytest.mark.parametrize("yaw_deg", [0.0, 45.0, 90.0, 179.0, 180.0, -91.0, -179.5])
def test_tracks_point_where_the_vehicle_does(yaw_deg: float) -> None:
    """Yaw from a direction, pitch from a slope; the offset is carried by both."""
    yaw = math.radians(yaw_deg)
    ahead = np.array([[[math.cos(yaw), math.sin(yaw)]]] * 2)
    ground = np.array([[[0.0, 0.0, 0.0]], [[5.0, 0.0, 0.0]]])
    (track,) = make_upright_trajectories(
        ["car"], ground, ahead, np.full((2, 1), 0.1), [(1.0, 0.0, 0.0)]
    )

    assert track is not None
    x_axis = track.knots[0].rotation()[:, 0]
    level = math.sqrt(1.0 - 0.01)
    assert x_axis == pytest.approx([level * math.cos(yaw), level * math.sin(yaw), 0.1], abs=1e-6)
    assert track.knots[0].translation_m == pytest.approx(tuple(x_axis), abs=1e-5)
    assert track.knots[0].rotation()[2, 2] == pytest.approx(level, abs=1e-6)


def test_what_stands_has_no_track() -> None:
    """Still for all time."""
    ground, ahead = np.zeros((5, 1, 3)), np.tile([1.0, 0.0], (5, 1, 1))

    assert make_upright_trajectories(
        ["car"], ground, ahead, np.zeros((5, 1)), [(0.0, 0.0, 0.0)]
    ) == [None]
