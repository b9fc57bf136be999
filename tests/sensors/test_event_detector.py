"""Events of an ego car, against arithmetic."""

import math
from typing import Any

import numpy as np
import pytest

from gen_data.core.errors import SampleError
from gen_data.core.scene import Body, Instance, Lane, Rig, Scene
from gen_data.core.se3 import SE3
from gen_data.sensors.events.event_detector import LIGHT_STATES, OCCURRENCES, EventDetector
from gen_data.sensors.events.obb_queries import find_obstacles, gap_ahead_m, is_touching
from tests.sensors.streetcar import (
    PERSON_M,
    WALL_M,
    moved,
    reading,
    readings,
    straight,
    thing,
    track_of,
    world,
)

Things = list[tuple[Body, Instance]]
LIGHT_M = ((-0.05, -0.14, 0.0), (0.35, 0.14, 3.2))


def of_kind(rows: np.ndarray, kind: str) -> np.ndarray:
    return rows[rows["occurrence"] == OCCURRENCES.index(kind)]


def standing(others: Things) -> Scene:
    return world(straight((0.0, 0.0), (0.0, 0.0)), others)


def lane(y_m: float, length_m: float = 60.0, name: str = "lane") -> Lane:
    points = tuple((x, y_m, 0.0) for x in np.arange(0.0, length_m + 1.0, 2.0))
    return Lane(name, "driving", points, 3.5)


WALL = thing(7, "wall", "building", SE3((12.0 + 2.2 + 0.1, 0.0, 0.0)), WALL_M)
COMING = track_of("other", straight((20.0, 0.0), (-5.0, 0.0)))


@pytest.mark.parametrize(
    ("others", "tracks", "expected"),
    [
        # At 10 m/s, 12 m of free way; 15.6 m between bumpers at 15 m/s; 2 cm between the sides.
        ([WALL], [], (1.2, 7, 10.0)),
        ([thing(2, "other", "car", SE3((20.0, 0.0, 0.0)))], [COMING], (1.04, 2, 15.0)),
        ([thing(2, "parked", "car", SE3((8.0, 1.82, 0.0)))], [], None),
    ],
    ids=["when the bumper arrives", "with the speed between two that move", "not by passing by"],
)
def test_collision_is_noticed_once(others: Things, tracks: list, expected: Any) -> None:
    scene = world(others=others, tracks=tracks)
    rows = of_kind(readings(EventDetector(events=("collision",)), scene, 20), "collision")
    found = [(row["time_s"], row["instance_id"], row["value"]) for row in rows]

    time_s, number, speed = expected or (0.0, 0, 0.0)
    row = (pytest.approx(time_s, abs=0.0101), number, pytest.approx(speed, abs=1e-4))
    assert found == ([row] if expected else [])


def test_crown_of_a_tree_is_no_wall() -> None:
    """One collides with its stem."""
    crown = ((-4.0, -4.0, 0.0), (4.0, 4.0, 9.0))
    aside, ahead = (thing(5, "tree", "tree", SE3((9.0, y, 0.0)), crown) for y in (2.0, 0.0))

    assert len(of_kind(readings(EventDetector(), world(others=[aside]), 20), "collision")) == 0
    assert len(of_kind(readings(EventDetector(), world(others=[ahead]), 20), "collision")) == 1


CUBE_M = ((-1.0, -1.0, 0.0), (1.0, 1.0, 1.5))
REACH_M = 2.2 + math.sqrt(2.0)
"""Half of the car and sqrt(2) half edges of a cube turned by 45 degrees."""


@pytest.mark.parametrize(("pose", "box_m", "touching"), [
    (SE3.about_z(math.pi / 4, (REACH_M + 0.01, 0.0, 0.0)), CUBE_M, False),
    (SE3.about_z(math.pi / 4, (REACH_M - 0.01, 0.0, 0.0)), CUBE_M, True),
    (SE3((0.0, 0.0, 1.51)), ((-9, -9, 0), (9, 9, 1)), False),
], ids=["a corner before", "a corner inside", "a bridge above"])  # fmt: skip
def test_boxes_touch_exactly_where_they_reach(pose: SE3, box_m: Any, touching: bool) -> None:
    own, its = find_obstacles(standing([thing(2, "other", "building", pose, box_m)]))

    assert is_touching(own, its, 0.0) is touching


def test_changing_lanes_crosses_one_line() -> None:
    """At 1 m/s to the left, half a lane minus half the car's width away: after 0.85 s."""
    scene = world(straight((10.0, 0.0), (10.0, 1.0)), lanes=[lane(0.0), lane(3.5, name="left")])
    rows = of_kind(readings(EventDetector(), scene, 31), "lane_invasion")

    assert len(rows) == 1
    assert (rows[0]["time_s"], rows[0]["value"]) == (pytest.approx(1.75 - 0.9, abs=0.0101), 1.0)


def test_lines_of_junctions_do_not_count() -> None:
    junction = moved(
        world(straight((10.0, 0.0), (10.0, -1.0))),
        lanes=(Lane("x", "driving", ((0.0, 0.0, 0.0), (60.0, 0.0, 0.0)), 3.5, junction=True),),
    )
    road = moved(junction, lanes=(lane(0.0),))

    assert len(of_kind(readings(EventDetector(), junction, 31), "lane_invasion")) == 0
    assert of_kind(readings(EventDetector(), road, 31), "lane_invasion")["value"].tolist() == [-1.0]


def test_obstacle_is_the_nearest_thing_in_the_way() -> None:
    """A person in the car's path, nearer than the wall; one aside does not count."""
    others = [
        thing(2, "beside", "person", SE3((6.0, 1.3, 0.0)), PERSON_M),
        thing(3, "ahead", "person", SE3((9.0, 0.9, 0.0)), PERSON_M),
        thing(4, "wall", "building", SE3((15.0, 0.0, 0.0)), WALL_M),
    ]
    rows = of_kind(reading(EventDetector(), world(others=others), 2).rows, "obstacle")

    assert rows["instance_id"].tolist() == [3]
    assert rows[0]["value"] == pytest.approx(9.0 - 2.0 - 0.25 - 2.2, abs=1e-5)


def test_obstacle_that_only_reaches_into_the_way_counts_from_where_it_does() -> None:
    """A beam across at 45 degrees enters the car's strip nearer than its middle."""
    beam = ((-10.0, -0.001, 0.0), (10.0, 0.001, 2.0))
    crossing = thing(2, "beam", "building", SE3.about_z(math.pi / 4, (12.0, 0.0, 0.0)), beam)
    own, its = find_obstacles(standing([crossing]))

    assert gap_ahead_m(own, its, 0.0) == pytest.approx(12.0 - 0.9 - 2.2, abs=5e-3)


@pytest.mark.parametrize(("reach_m", "count"), [(30.0, 0), (40.0, 1)])
def test_far_obstacles_are_not_reported(reach_m: float, count: int) -> None:
    wall = thing(4, "wall", "building", SE3((40.0, 0.0, 0.0)), WALL_M)
    rows = reading(EventDetector(obstacle_m=reach_m), world(others=[wall]), 0).rows

    assert len(of_kind(rows, "obstacle")) == count


def test_what_lies_flat_on_the_road_is_no_obstacle() -> None:
    """A manhole cover of 2 cm."""
    cover = thing(4, "cover", "building", SE3((8.0, 0.0, 0.0)), ((-0.4, -0.4, 0), (0.4, 0.4, 0.02)))

    assert len(readings(EventDetector(), world(others=[cover]), 12)) == 0


def test_proximity_is_the_distance_to_the_nearest_box() -> None:
    """Of a device 1 m up and 2 m ahead: straight to the face of a wall."""
    wall = thing(4, "wall", "building", SE3((5.0, 0.0, 0.0)), WALL_M)
    sensor = EventDetector(events=("proximity",), offset_m=(2.0, 0.0, 1.0))
    rows = reading(sensor, world(others=[wall]), 0).rows

    assert rows["instance_id"].tolist() == [4]
    assert rows[0]["value"] == pytest.approx(2.9, abs=1e-6)


def before_light(state: str) -> Scene:
    """Our light faces the car, its line 40 m ahead; a green one faces the oncoming traffic."""
    facing = SE3.about_z(math.pi, (60.6, -3.0, 0.0))
    ours = thing(5, "ours", "traffic_light", facing, LIGHT_M, state=state)
    theirs = thing(6, "theirs", "traffic_light", SE3((60.0, 3.0, 0.0)), LIGHT_M, state="green")
    return world(straight((20.0, 0.0), (10.0, 0.0)), [ours, theirs], lanes=[lane(0.0)])


@pytest.mark.parametrize("state", ["red", "yellow", "green", "red_yellow"])
def test_light_at_the_end_of_the_lane_is_told(state: str) -> None:
    rows = reading(EventDetector(light_m=40.5), before_light(state), 0).rows
    rows = of_kind(rows, "traffic_light")

    assert rows["instance_id"].tolist() == [5]
    assert LIGHT_STATES[int(rows[0]["value"])] == state


@pytest.mark.parametrize(("step", "count"), [(0, 0), (12, 1)])
def test_light_far_ahead_does_not_matter_yet(step: int, count: int) -> None:
    """40 m and, after 1.2 s, 28 m before its line."""
    rows = reading(EventDetector(light_m=30.0), before_light("red"), step).rows

    assert len(of_kind(rows, "traffic_light")) == count


def test_slow_watcher_reports_all_since_its_last_reading() -> None:
    """At 2 Hz in steps of 0.1 s: a collision at 1.2 s is told at 1.5 s."""
    rows = reading(EventDetector(rate_hz=2.0), world(others=[WALL]), 15).rows

    assert of_kind(rows, "collision")["time_s"].tolist() == pytest.approx([1.2], abs=0.0101)


def test_a_carrier_without_a_box_is_named() -> None:
    scene = world()
    bare = moved(scene, bodies=(*scene.bodies, Body("mast", "mast?")), rigs=(Rig("ego", "mast"),))
    with pytest.raises(SampleError, match="'mast', which carries rig 'ego', has no box"):
        reading(EventDetector(), bare, 0)
