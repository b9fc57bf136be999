"""Lanes, vehicles and people on relief: as high above their ground as in the same scene without it.

Rays of Embree that fall onto the meshes of a scene find its ground. Reference lines are found by
summing small steps of the curvature that a road's id states.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.assemble.config import Config, load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.assets.asset_ids import parse_asset_id
from gen_data.core.lane_geometry import SIDES, LaneLine, border_line
from gen_data.core.scene import Instance, Lane, Scene
from gen_data.core.scene_time import scene_at
from gen_data.core.se3 import Vec3, turns_of
from tests.street_ground import Street, wheels_m
from tests.streets import HILLS, STRAIGHT, thin_street

pytestmark = pytest.mark.slow

Array = NDArray[np.float64]

GRADE = 0.08
SLOPE = ("randomizers.relief.grade=0.08", "randomizers.relief.side_slope=0")
GENTLE = ("randomizers.relief.grade={uniform: [-0.08, 0.08]}", "shared.landmark=none")
BENDS = (
    "shared.district=residential", "shared.junction=none", "shared.course=s_left",
    "shared.course_on=right", "shared.radius=40", "shared.turn=50", "randomizers.parked.count=8",
    "randomizers.traffic.count=12", "randomizers.people.count=12", *GENTLE,
)  # fmt: skip
ALONG = "randomizers.traffic.yaw_deg=0"
SMALL = ("sensors.color.size_px=[64, 32]", "shared.weather=CloudyNoon")
LOT = (
    "shared.course=right", "shared.fill=0.5", "randomizers.people.count=0",
    "randomizers.relief.grade={uniform: [-0.015, 0.015]}", *SMALL,
)  # fmt: skip


class Ground(NamedTuple):
    """A configuration with relief.

    Attributes:
        config: Its name.
        given: Overrides, relief included.
        without: Randomizers left out; None stands for the scenery of a thin street.
        lanes: ``(road, kinds of lanes, smallest number)``; an empty road stands for all.
        wheel_m: Difference of heights at wheels at most [m]: planes of the ground meet below cars.
        vehicles: Number of vehicles at least.
    """

    config: str
    given: tuple[str, ...]
    without: tuple[str, ...] | None = None
    lanes: tuple[tuple[str, tuple[str, ...], int], ...] = ()
    wheel_m: float = 0.015
    vehicles: int = 3


GROUNDS = {
    "slope": Ground("street.yaml", (*STRAIGHT, *SLOPE), wheel_m=0.002, vehicles=8),
    "hills": Ground("street.yaml", (*STRAIGHT, *HILLS), None,
                    (("", ("driving", "sidewalk"), 6),), vehicles=8),
    "town": Ground("street.yaml", (*BENDS, ALONG), None, (("", ("driving",), 2),)),
    "country": Ground(
        "street.yaml", ("shared.district=country_road", "shared.junction=none",
                        "shared.course=left", "shared.radius=250", "shared.turn=35", *GENTLE),
        None, (("", ("driving",), 2),), vehicles=0,
    ),
    "highway": Ground(
        "highway.yaml", ("shared.course=left", "shared.radius=900", "shared.turn=20",
                         "shared.land=woods", "shared.lanes=2", "shared.city=none",
                         "randomizers.traffic.count=12", *SMALL, "randomizers.relief.grade=0.03"),
        ("trees", "signs"), (("motorway", ("driving", "parking"), 4),),
    ),
    "lot": Ground("parking.yaml", LOT, ("buildings", "lamps", "street_lights"),
                  (("lot", ("driving", "parking"), 38),)),
    "bent lot": Ground("parking.yaml", (*LOT, "shared.bend=0.02", "shared.aisles=2"),
                       ("buildings", "lamps", "street_lights"),
                       (("lot", ("driving", "parking"), 70),)),
    "crossing": Ground(
        "street.yaml", ("shared.junction=x", "shared.course_side=left", "shared.radius=40",
                        "shared.turn=35", "shared.median=none", "shared.landmark=none",
                        "randomizers.relief.grade=0.06", SMALL[0]),
        None, tuple((road, ("driving", "parking"), 2) for road in ("left", "right")),
    ),
}  # fmt: skip


@cache
def street(name: str, level: bool = False) -> Street:
    """The scene on its ground, or the same one on level ground."""
    row = GROUNDS[name]
    given = tuple(value for value in row.given if not level or "relief" not in value)
    relief = ("relief",) if level else ()
    config: Config
    if row.without is None:
        config = thin_street(row.config, *given, without=relief)
    else:
        config = load_config(row.config, overrides=given, without=(*row.without, *relief))
    with open_pipeline(config) as pipeline:
        return Street.first(pipeline)


def gaps_m(on: Street, line: Sequence[Sequence[float]] | Array) -> Array:
    """Heights of 60 places along a polyline above the drawn ground."""
    points = np.array(line)
    at = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points[:, :2], axis=0).T))])
    s = np.linspace(0.02, 0.98, 60) * at[-1]
    places = np.column_stack([np.interp(s, at, points[:, k]) for k in range(3)])
    return places[:, 2] - on.ground_m(places)


def lines_of(lane: Lane) -> list[Sequence[Vec3]]:
    return [lane.center_m, *(border_line(lane, side) for side in SIDES)]


@pytest.mark.parametrize("name", [name for name, row in GROUNDS.items() if row.lanes])
def test_lanes_lie_on_the_drawn_ground(name: str) -> None:
    """Middles and borders, as high as on level ground within the 6 mm that straight pieces take.

    At borders a cross slope of 5 % left out would be 80 mm.
    """
    here, level, row = street(name), street(name, level=True), GROUNDS[name]
    assert here.scene.relief is not None
    flat = {lane.name: lane for lane in level.scene.lanes}
    for road, kinds, least in row.lanes:
        lanes = [n for n in here.scene.lanes if n.kind in kinds and road in ("", n.road)]
        assert len(lanes) >= least
        for lane in lanes:
            for line, below in zip(lines_of(lane), lines_of(flat[lane.name]), strict=True):
                apart = gaps_m(here, line) - gaps_m(level, below)
                assert np.abs(apart).max() < 0.006, lane.name
    assert sum(bool(lane.banks) for lane in here.scene.lanes) >= (2 if name == "country" else 0)


@pytest.mark.parametrize("name", GROUNDS)
def test_wheels_stand_on_the_ground(name: str) -> None:
    here, level, row = street(name), street(name, level=True), GROUNDS[name]
    before = {car.name: car for car in level.vehicles()}
    cars = here.vehicles()
    assert len(cars) >= row.vehicles
    assert {car.name for car in cars} == set(before)
    for car in cars:
        wheels, flat = wheels_m(car), wheels_m(before[car.name])
        assert wheels is not None and flat is not None
        gap_m, flat_gap_m = wheels[:, 2] - here.ground_m(wheels), flat[:, 2] - level.ground_m(flat)
        np.testing.assert_allclose(gap_m, flat_gap_m, atol=row.wheel_m)


@pytest.mark.parametrize(("name", "apart_m"), [("hills", 0.025), ("town", 0.02)])
def test_people_stand_upright_on_the_ground(name: str, apart_m: float) -> None:
    """As high above the ground at their middle as on level ground."""

    def people(on: Street) -> dict[str, Instance]:
        return {i.name: i for i in on.scene.instances if i.category == "person"}

    here, level = street(name), street(name, level=True)
    before = people(level)
    assert len(people(here)) >= 3
    for person in people(here).values():
        poses = (person.T_world_instance, before[person.name].T_world_instance)
        places = [np.array([pose.translation_m]) for pose in poses]
        gaps = [p[0, 2] - on.ground_m(p)[0] for p, on in zip(places, (here, level), strict=True)]
        assert gaps[0] == pytest.approx(gaps[1], abs=apart_m)
        assert turns_of(poses[0])[1:] == turns_of(poses[1])[1:]


@pytest.mark.parametrize(("given", "wheel_m", "roll_deg", "least"), [
    ((*STRAIGHT, *HILLS), 0.03, 0.5, 14), ((*BENDS, SMALL[0]), 0.025, 1.0, 30),
], ids=["hills", "bends"])  # fmt: skip
def test_traffic_stays_in_its_lane_and_on_the_ground(
    given: tuple[str, ...], wheel_m: float, roll_deg: float, least: int
) -> None:
    """At nine instants: rear axles within .6 m of the middle of a lane; ruts are 5 mm deep."""
    config = thin_street("street_sequence.yaml", *given, "steps_per_scene=1")
    with open_pipeline(config) as pipeline:
        on = Street.first(pipeline)
    middles = [np.array(lane.center_m) for lane in on.scene.lanes if lane.kind == "driving"]
    dense = np.concatenate(
        [line[:-1] + k / 20 * np.diff(line, axis=0) for line in middles for k in range(20)]
    )
    tracks = {track.body for track in on.scene.tracks}
    heights, rolled = [], []
    for time_s in np.linspace(0.0, 4.0, 9):
        for car in scene_at(on.scene, float(time_s)).instances:
            wheels = wheels_m(car)
            if wheels is None or car.name not in tracks:
                continue
            assert np.abs(wheels[:, 2] - on.ground_m(wheels)).max() < wheel_m
            rear = wheels[np.argsort(car.T_world_instance.inverse().apply(wheels)[:, 0])[:2]]
            assert np.hypot(*(dense[:, :2] - rear.mean(axis=0)[:2]).T).min() < 0.6
            rolled.append(car.T_world_instance.rotate(np.array([0.0, 1.0, 0.0]))[2])
            heights.append(float(wheels[0, 2]))
    assert len(heights) >= least
    assert np.ptp(heights) > 0.2
    assert np.ptp(rolled) > math.sin(math.radians(roll_deg))


def places_on_lanes(scene: Scene) -> Array:
    """Places on the carriageways and pavements of a level street, [n, 3]."""
    rng = np.random.default_rng(0)
    lines = [LaneLine(lane) for lane in scene.lanes if lane.kind in ("driving", "sidewalk")]
    poses = [
        line.pose(float(at), float(0.4 * line.lane.width_m * side))
        for line in lines
        for at, side in zip(
            rng.uniform(1.0, line.length_m - 1.0, 60), rng.uniform(-1, 1, 60), strict=True
        )
    ]
    return np.array([pose.translation_m for pose in poses])


def test_carriageways_and_pavements_rise_with_the_grade() -> None:
    """The main road starts at x = -150 m: at x it is 0.08 (x + 150) higher than a level one."""
    level = street("slope", level=True)
    places = places_on_lanes(level.scene)
    places = places[places[:, 0] < -1.0]
    rise_m = street("slope").ground_m(places) - level.ground_m(places)
    assert len(places) > 150
    np.testing.assert_allclose(rise_m, GRADE * (places[:, 0] + 150.0), atol=0.001)


def test_ground_of_hills_is_the_level_ground_raised_by_the_relief() -> None:
    """Rays meet all layers, paint, asphalt and kerbs, as far apart as on level ground."""
    hills, level = street("hills"), street("hills", level=True)
    assert hills.scene.relief is not None
    places = places_on_lanes(level.scene)
    rise_m = hills.ground_m(places) - level.ground_m(places)
    np.testing.assert_allclose(rise_m, hills.scene.relief.height(places), atol=0.001)
    assert np.ptp(rise_m) > 2.0


def test_cars_pitch_with_the_grade() -> None:
    """Up axes of all cars on the slope are its normal: (-0.08, 0, 1) / |...|."""
    normal = np.array([-GRADE, 0.0, 1.0]) / math.hypot(GRADE, 1.0)
    poses = [car.T_world_instance for car in street("slope").vehicles()]
    poses = [pose for pose in poses if -140.0 < pose.translation_m[0] < -5.0]
    assert len(poses) >= 4
    for pose in poses:
        np.testing.assert_allclose(pose.rotate(np.array([0.0, 0.0, 1.0])), normal, atol=1e-5)


def test_view_of_a_dash_camera_pitches_with_its_car() -> None:
    """The axis of the camera climbs by atan(0.08) more than on level ground, along +X."""
    ahead, before = (
        street("slope", level).scene.cameras[0].T_world_camera.rotate(np.array([0.0, 0.0, 1.0]))
        for level in (False, True)
    )
    turned = math.asin(ahead[2]) - math.asin(before[2])
    uphill = math.copysign(1.0, before[0])
    assert turned == pytest.approx(uphill * math.atan(GRADE), abs=0.003)


def main_line(scene: Scene) -> Array:
    """Points and headings [n, 3] of the main road's reference line, 5 cm apart."""
    body = next(b for b in scene.bodies if b.name == "main")
    given = parse_asset_id(body.asset).parameters
    length_m, bends = given["length_m"], given["bends"]
    assert isinstance(length_m, int | float)
    assert isinstance(bends, tuple)
    step = 0.05
    s = step * (np.arange(round(length_m / step)) + 0.5)
    curvature = np.zeros(len(s))
    for start, spiral, arc, at_most in zip(*(bends[k::4] for k in range(4)), strict=True):
        ends = np.cumsum([start, spiral, arc, spiral])
        curvature += np.interp(s, ends, [0.0, at_most, at_most, 0.0])
    heading = step * (np.cumsum(curvature) - 0.5 * curvature)
    xy = step * np.cumsum(np.column_stack([np.cos(heading), np.sin(heading)]), axis=0)
    return np.column_stack([xy + body.T_world_body.translation_m[:2], heading])


def left_of(line: Array, places: Array) -> tuple[Array, Array]:
    """Distances to the left of a line, and its headings, at the points nearest to places."""
    delta = places[:, None, :2] - line[None, :, :2]
    k = (delta * delta).sum(axis=2).argmin(axis=1)
    heading = line[k, 2]
    across = np.column_stack([-np.sin(heading), np.cos(heading)])
    left: Array = (delta[np.arange(len(k)), k] * across).sum(axis=1)
    return left, heading


def test_country_roads_slope_down_to_the_inside_of_bends() -> None:
    """R = 250 m at 90 km/h: 6 % (2.5 / 6)^x, x = ln(250 / 190) / ln(700 / 190), is 4.98 %."""
    line = main_line(street("country").scene)
    middle = line[len(line) // 2]
    across = 3.0 * np.array([-math.sin(middle[2]), math.cos(middle[2])])
    left, right = street("country").ground_m([middle[:2] + across, middle[:2] - across])
    assert (right - left) / 6.0 == pytest.approx(0.0498, abs=0.002)


def test_motorways_climb_and_slope_down_to_the_inside_of_bends() -> None:
    """3 % up all of 600 m, less in vertical curves.

    R = 900 m at 119 km/h: 6 % (2.5 / 6)^x with x = ln(900 / 470) / ln(4000 / 470): 4.60 %.
    """
    highway = street("highway")
    lanes = {lane.name: lane for lane in highway.scene.lanes}
    ahead, back = (LaneLine(lanes[f"motorway/{word}0"]) for word in ("forward", "backward"))
    right = ahead.pose(0.5 * ahead.length_m).translation_m
    left = back.pose(0.5 * back.length_m).translation_m
    low, high = highway.ground_m([left, right])
    assert (high - low) / math.dist(left[:2], right[:2]) == pytest.approx(0.0460, abs=0.002)
    assert 12.0 < np.ptp([point[2] for lane in lanes.values() for point in lane.center_m]) < 18.5


@pytest.mark.parametrize("name", ["lot", "bent lot"])
def test_car_parks_are_no_steeper_than_people_build_them(name: str) -> None:
    lanes = [lane for lane in street(name).scene.lanes if lane.road == "lot"]
    assert 0.02 < np.ptp([point[2] for lane in lanes for point in lane.center_m]) < 3.0


def test_cars_head_along_the_bend() -> None:
    """Headings are tangents within 1.5 degrees: lanes are chords of 2 m, at R = 40 m of 2.9."""
    line = main_line(street("town").scene)
    turned = 0
    for car in street("town").vehicles():
        place = np.array([car.T_world_instance.translation_m])
        left, heading = left_of(line, place)
        if not car.name.startswith("traffic") or abs(left[0]) > 4.0:
            continue
        ahead = car.T_world_instance.rotate(np.array([1.0, 0.0, 0.0]))
        off = math.remainder(math.atan2(ahead[1], ahead[0]) - heading[0], math.pi)
        if (place - line[-1])[0, :2] @ [np.cos(line[-1, 2]), np.sin(line[-1, 2])] < -5.0:
            assert abs(off) < math.radians(1.5)
            turned += abs(heading[0]) > 0.1
    assert turned >= 2


@pytest.mark.parametrize("road", ["left", "right"])
def test_side_roads_bend(road: str) -> None:
    """By 35 degrees in plan, or by as many as 46 m allow."""
    lane = next(n for n in street("crossing").scene.lanes if n.name == f"{road}/forward0")
    steps = np.diff(np.array(lane.center_m)[:, :2], axis=0)
    turned = math.atan2(steps[-1, 1], steps[-1, 0]) - math.atan2(steps[0, 1], steps[0, 0])
    assert math.degrees(math.remainder(turned, math.tau)) == pytest.approx(35.0, abs=1.0)
