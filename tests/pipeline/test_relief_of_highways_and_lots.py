"""Motorways, side roads and car parks on their relief: rays of Embree fall onto their meshes.

The same scene without relief tells how high a lane or a wheel is above level ground.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.assemble.config import Config, load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.lane_geometry import SIDES, LaneLine, border_line
from gen_data.core.scene import Lane
from gen_data.core.se3 import Vec3
from tests.street_ground import Street, wheels_m
from tests.streets import thin_street

Array = NDArray[np.float64]
Pair = tuple[Street, Street]

SMALL = ("sensors.color.size_px=[64, 32]", "shared.weather=CloudyNoon")
HIGHWAY = (
    "shared.course=left", "shared.radius=900", "shared.turn=20", "shared.land=woods",
    "shared.lanes=2", "shared.city=none", "randomizers.traffic.count=12", *SMALL,
    "randomizers.relief.grade=0.03",
)  # fmt: skip
LOT = (
    "shared.course=right", "shared.fill=0.5", "randomizers.people.count=0",
    "randomizers.relief.grade={uniform: [-0.015, 0.015]}", *SMALL,
)  # fmt: skip
BENT_LOT = (*LOT, "shared.bend=0.02", "shared.aisles=2")
SIDE = (
    "shared.junction=x", "shared.course_side=left", "shared.radius=40", "shared.turn=35",
    "shared.median=none", "shared.landmark=none", "randomizers.relief.grade=0.06", SMALL[0],
)  # fmt: skip


def _hilly_and_level(hilly: Config, level: Config) -> Pair:
    made: list[Street] = []
    for config in (hilly, level):
        with open_pipeline(config) as pipeline:
            made.append(Street.first(pipeline))
    return made[0], made[1]


def _shipped(name: str, given: tuple[str, ...], *scenery: str) -> Pair:
    return _hilly_and_level(
        load_config(name, overrides=given, without=scenery),
        load_config(
            name,
            overrides=tuple(g for g in given if "relief" not in g),
            without=(*scenery, "relief"),
        ),
    )


@pytest.fixture(scope="module")
def highway() -> Pair:
    return _shipped("highway.yaml", HIGHWAY, "trees", "signs")


@pytest.fixture(scope="module")
def lot() -> Pair:
    return _shipped("parking.yaml", LOT, "buildings", "lamps", "street_lights")


@pytest.fixture(scope="module")
def bent_lot() -> Pair:
    return _shipped("parking.yaml", BENT_LOT, "buildings", "lamps", "street_lights")


@pytest.fixture(scope="module")
def crossing() -> Pair:
    level = tuple(given for given in SIDE if "relief" not in given)
    return _hilly_and_level(
        thin_street("street.yaml", *SIDE), thin_street("street.yaml", *level, without=("relief",))
    )


def _gaps_m(street: Street, lane: Lane) -> Array:
    """Heights of 40 places on a lane's middle above the drawn ground."""
    line = LaneLine(lane)
    at = np.linspace(0.02, 0.98, 40) * line.length_m
    points = np.array([line.pose(float(s)).translation_m for s in at])
    return points[:, 2] - street.ground_m(points)


def _check_lanes(pair: Pair, road: str, least: int, apart_m: float = 0.006) -> None:
    here, level = pair
    flat = {lane.name: lane for lane in level.scene.lanes}
    lanes = [n for n in here.scene.lanes if n.kind in ("driving", "parking") and n.road == road]
    assert len(lanes) >= least
    for lane in lanes:
        np.testing.assert_allclose(
            _gaps_m(here, lane), _gaps_m(level, flat[lane.name]), atol=apart_m, err_msg=lane.name
        )


@pytest.mark.slow
def test_lanes_of_motorways_climb_with_their_ground(highway: Pair) -> None:
    """3 % up all of 600 m, less what vertical curves take."""
    _check_lanes(highway, "motorway", 4)
    heights = [point[2] for lane in highway[0].scene.lanes for point in lane.center_m]
    assert 12.0 < np.ptp(heights) < 18.5


@pytest.mark.slow
@pytest.mark.parametrize(
    ("where", "road"),
    [("highway", "motorway"), ("lot", "lot"), ("bent_lot", "lot"), ("crossing", "left")],
)
def test_borders_of_lanes_lie_on_the_ground(
    where: str, road: str, request: pytest.FixtureRequest
) -> None:
    """As high as on level ground within 15 mm, which straight pieces across planes of 4 m take."""
    here, level = request.getfixturevalue(where)
    flat = {lane.name: lane for lane in level.scene.lanes}
    heights = []
    for lane in here.scene.lanes:
        if lane.kind not in ("driving", "parking") or lane.road != road:
            continue
        for side in SIDES:
            lines = [_points_on(border_line(one, side)) for one in (lane, flat[lane.name])]
            gap_m, flat_gap_m = (
                points[:, 2] - street.ground_m(points)
                for street, points in zip((here, level), lines, strict=True)
            )
            np.testing.assert_allclose(gap_m, flat_gap_m, atol=0.015, err_msg=f"{lane.name} {side}")
            heights += lines[0][:, 2].tolist()
    assert np.ptp(heights) > 0.02


def _points_on(line: Sequence[Vec3]) -> Array:
    """40 places [40, 3] along a line in space, evenly spread in plan."""
    points = np.array(line)
    steps = np.hypot(*np.diff(points[:, :2], axis=0).T)
    at = np.concatenate([[0.0], np.cumsum(steps)])
    to = np.linspace(0.02, 0.98, 40) * at[-1]
    return np.column_stack([np.interp(to, at, points[:, k]) for k in range(3)])


@pytest.mark.slow
def test_motorways_slope_down_to_the_inside_of_bends(highway: Pair) -> None:
    """R = 900 m at 119 km/h: 6 % (2.5 / 6)^x with x = ln(900 / 470) / ln(4000 / 470): 4.60 %."""
    lanes = {lane.name: lane for lane in highway[0].scene.lanes}
    ahead, back = (LaneLine(lanes[f"motorway/{word}0"]) for word in ("forward", "backward"))
    right = ahead.pose(0.5 * ahead.length_m).translation_m
    left = back.pose(0.5 * back.length_m).translation_m
    low, high = highway[0].ground_m([left, right])
    assert (high - low) / math.dist(left[:2], right[:2]) == pytest.approx(0.0460, abs=0.002)


@pytest.mark.slow
@pytest.mark.parametrize("where", ["highway", "lot", "bent_lot", "crossing"])
def test_wheels_stand_on_the_ground(where: str, request: pytest.FixtureRequest) -> None:
    """As high as on level ground, to 15 mm, where planes of the ground meet below a car."""
    here, level = request.getfixturevalue(where)
    before = {car.name: car for car in level.vehicles()}
    cars = here.vehicles()
    assert len(cars) >= 3
    for car in cars:
        wheels, flat = wheels_m(car), wheels_m(before[car.name])
        assert wheels is not None
        assert flat is not None
        gap_m = wheels[:, 2] - here.ground_m(wheels)
        flat_gap_m = flat[:, 2] - level.ground_m(flat)
        np.testing.assert_allclose(gap_m, flat_gap_m, atol=0.015)


@pytest.mark.slow
@pytest.mark.parametrize(("where", "least"), [("lot", 38), ("bent_lot", 70)])
def test_bays_and_aisles_of_car_parks_lie_on_their_ground(
    where: str, least: int, request: pytest.FixtureRequest
) -> None:
    """Lines of bays are chords of 2.5 m across planes of 4 m: within 15 mm, as wheels are.

    Nobody lays out a lot steeper than its streets.
    """
    lot: Pair = request.getfixturevalue(where)
    _check_lanes(lot, "lot", least, apart_m=0.015)
    heights = [p[2] for lane in lot[0].scene.lanes if lane.road == "lot" for p in lane.center_m]
    assert 0.02 < np.ptp(heights) < 3.0


@pytest.mark.slow
def test_side_roads_bend_and_follow_their_ground(crossing: Pair) -> None:
    """By 35 degrees in plan, or by as many as 46 m allow; their lanes lie on the drawn surface."""
    for road in ("left", "right"):
        _check_lanes(crossing, road, 2)
        lane = next(n for n in crossing[0].scene.lanes if n.name == f"{road}/forward0")
        steps = np.diff(np.array(lane.center_m)[:, :2], axis=0)
        turned = math.atan2(steps[-1, 1], steps[-1, 0]) - math.atan2(steps[0, 1], steps[0, 0])
        assert math.degrees(math.remainder(turned, math.tau)) == pytest.approx(35.0, abs=1.0)
