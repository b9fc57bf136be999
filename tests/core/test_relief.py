"""Relief of the ground: profiles of roads by hand, and their blend into the land."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gen_data.core.relief import CELL_M, Relief, RoadProfile

NOTHING = (0.0, 1.0, 0.0)
CREST = RoadProfile(
    x_m=0.0, y_m=0.0, yaw_rad=0.0, curvature_per_m=0.0, length_m=200.0, half_width_m=10.0,
    left=0.1, right=-0.05, start_m=1.0, grade=0.06, curves=(40.0, 80.0, -0.1, *NOTHING, *NOTHING),
)  # fmt: skip


def test_profile_is_the_straight_grade_then_a_parabola_then_the_other_grade() -> None:
    """A crest from +6 % to -4 % from 40 m to 120 m: z = g s - (0.1 / (2 * 80)) (s - 40)^2."""
    s = np.array([0.0, 30.0, 40.0, 80.0, 120.0, 160.0])
    by_hand = [1.0, 1.0 + 1.8, 1.0 + 2.4, 1.0 + 4.8 - 1.0, 1.0 + 7.2 - 4.0, 1.0 + 3.2 - 1.6]
    np.testing.assert_allclose(CREST.height(s), by_hand, atol=1e-12)
    assert CREST.slope(0.0) == 0.06
    assert CREST.slope(80.0) == pytest.approx(0.01)
    assert CREST.slope(160.0) == pytest.approx(-0.04)


def test_ground_of_a_road_is_its_profile_and_level_across() -> None:
    """Between the lines of its grid, the ground is below a parabola by at most a chord's sagitta.

    Cells that reach beyond 10 m from the middle are not level: places up to 7.9 m are in others.
    """
    s = np.linspace(2.0, 198.0, 400)
    sagitta_m = CELL_M**2 / 8.0 * 0.1 / 80.0
    for t in (-7.9, -3.0, 0.0, 7.9):
        off = CREST.height(s) - Relief((CREST,)).height(np.column_stack([s, np.full(400, t)]))
        assert off.max() <= sagitta_m + 1e-4
        assert off.min() >= -1e-4


LONG = replace(CREST, length_m=2000.0, half_width_m=20.0, left=0.0, right=0.0, grade=0.02,
               curves=(100.0, 300.0, -0.1, 600.0, 300.0, 0.05, *NOTHING))  # fmt: skip


@pytest.mark.parametrize(
    ("roads", "cell_m", "below_mm"),
    [((LONG,), 8.0, 2.7), ((LONG, replace(CREST, y_m=400.0)), 4.0, 0.7),
     ((replace(LONG, curvature_per_m=0.0019),), 8.0, 5.4),
     ((replace(LONG, bends=(9.0, 30.0, 30.0, 0.003, 0.0)),), 4.0, 1.4),
     ((replace(LONG, curves=(100.0, 299.0, -0.1, *NOTHING * 2)),), 4.0, 0.7)],
)  # fmt: skip
def test_gentle_roads_have_wider_cells(
    roads: tuple[RoadProfile, ...], cell_m: float, below_mm: float
) -> None:
    """R = 3000 m: a chord of 8 m is 2.7 mm below the crest, a diagonal 5.4 mm; one road decides."""
    ground = Relief(roads)
    assert ground.cell_m == cell_m
    s = np.linspace(100.0, 400.0, 900)
    places = roads[0].line()
    at = np.linspace(0.0, roads[0].length_m, len(places))
    x, y = (np.interp(s, at, places[:, k]) for k in (0, 1))
    off_mm = 1e3 * (roads[0].height(s) - ground.height(np.column_stack([x, y])))
    assert off_mm.max() <= below_mm + 0.1


def test_land_rises_on_one_side_and_falls_on_the_other() -> None:
    """Beyond 25 m from the road's edge, by 0.1 a metre to the left and -0.05 to the right."""
    ground = Relief((CREST,))
    left = ground.height(np.array([[20.0, 40.0], [20.0, 44.0]]))
    right = ground.height(np.array([[20.0, -40.0], [20.0, -44.0]]))
    # From 35 m to 80 m off the middle the slope fades to level: 1 - (t - 35) / 45 of it is left.
    at_38, at_42 = 1.0 - 7.0 / 45.0, 1.0 - 9.0 / 45.0
    assert 0.4 * at_42 - 0.01 < left[1] - left[0] < 0.4 * at_38 + 0.01
    assert -0.2 * at_38 - 0.01 < right[1] - right[0] < -0.2 * at_42 + 0.01


@pytest.mark.parametrize("curvature", [0.005, -0.005, 0.0])
def test_profile_follows_the_bend_of_its_road(curvature: float) -> None:
    """On the points of an arc, found by summing small steps, the height is the profile's."""
    steps = 40_000
    ds = 200.0 / steps
    heading = 0.7 + curvature * ds * (np.arange(steps) + 0.5)
    points = np.column_stack([
        3.0 + np.concatenate([[0.0], np.cumsum(np.cos(heading) * ds)]),
        -2.0 + np.concatenate([[0.0], np.cumsum(np.sin(heading) * ds)]),
    ])  # fmt: skip
    road = RoadProfile(
        3.0, -2.0, 0.7, curvature, 200.0, 10.0, 0.1, 0.1, 0.0, 0.05, (*NOTHING, *NOTHING, *NOTHING)
    )
    s = ds * np.arange(steps + 1)
    inside = slice(1000, -1000, 500)
    np.testing.assert_allclose(Relief((road,)).height(points[inside]), 0.05 * s[inside], atol=0.012)


S_CURVE = (10.0, 30.0, 30.0, 0.005, 0.05, 100.0, 30.0, 30.0, -0.005, 0.04)
"""Two bends of R = 200 m: 30 m of clothoid, 30 m of arc, 30 m of clothoid; banks of 5 and 4 %."""


@pytest.mark.parametrize("left_m", [0.0, 6.0, -6.0])
def test_roads_follow_clothoids_and_slope_down_to_the_inside_of_arcs(left_m: float) -> None:
    """Next to a line found by summing small steps: grade times arc length, and bank times distance.

    Cells of 4 m bend the ground where clothoids begin: 6 m next to it, the grade changes by 1 %.
    """
    steps = 40_000
    ds = 200.0 / steps
    s = ds * (np.arange(steps) + 0.5)
    knots = [10, 40, 70, 100, 100, 130, 160, 190]
    curvature = np.interp(s, knots, [0, 0.005, 0.005, 0, 0, -0.005, -0.005, 0])
    slope = np.interp(s, knots, [0, -0.05, -0.05, 0, 0, 0.04, 0.04, 0])
    heading = 0.7 + np.cumsum(curvature) * ds
    way = np.column_stack([np.cos(heading), np.sin(heading)])
    places = np.cumsum(way, axis=0) * ds + left_m * np.column_stack([-way[:, 1], way[:, 0]])
    road = RoadProfile(0.0, 0.0, 0.7, 0.0, 200.0, 14.0, 0.1, -0.1, 2.0, 0.05, NOTHING * 3, S_CURVE)
    relief = Relief((road,))
    inside = slice(1000, -1000, 200)
    expected = 2.0 + 0.05 * s + slope * left_m
    np.testing.assert_allclose(relief.height(places[inside]), expected[inside], atol=0.015)
    assert Relief.of(relief.numbers()) == relief


def test_land_inside_a_bend_has_no_step_where_both_legs_are_equally_near() -> None:
    """A turn of 150 degrees on a grade of 10 %: legs differ by 10 m in height, cells by a slope."""
    turn = (60.0, 10.0, 121.0, 0.02, 0.0)
    road = RoadProfile(0.0, 0.0, 0.0, 0.0, 300.0, 12.0, 0.0, 0.0, 0.0, 0.1, NOTHING * 3, turn)
    x, y = np.meshgrid(np.arange(60.0, 120.0, CELL_M), np.arange(10.0, 90.0, CELL_M))
    ground = Relief((road,)).height(np.column_stack([x.ravel(), y.ravel()])).reshape(x.shape)
    for axis in (0, 1):
        assert np.abs(np.diff(ground, axis=axis)).max() < 0.5 * CELL_M


def test_two_roads_keep_their_own_heights_where_they_do_not_meet() -> None:
    """On a road, another one 30 m away changes the height by less than a millimetre."""
    other = RoadProfile(
        -40.0, 60.0, 0.0, 0.0, 300.0, 8.0, 0.0, 0.0, 9.0, 0.0, (*NOTHING, *NOTHING, *NOTHING)
    )
    place = np.array([[100.0, 4.0], [60.0, -7.0]])
    both, alone = Relief((CREST, other)).height(place), Relief((CREST,)).height(place)
    np.testing.assert_allclose(both, alone, atol=1e-3)


def test_numbers_of_a_relief_make_the_same_relief() -> None:
    """Asset ids hold them."""
    relief = Relief((CREST, CREST))
    assert Relief.of(relief.numbers()) == relief
    with pytest.raises(ValueError, match="51 numbers are not a relief"):
        Relief.of((*relief.numbers(), *(0.0,) * (51 - len(relief.numbers()))))
