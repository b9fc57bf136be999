"""Signals are obeyed, junctions are shared, people are let over."""

from dataclasses import replace

import numpy as np
import pytest

from gen_data.traffic.lane_routes import LaneGraph, project_on_lane
from gen_data.traffic.pedestrian_paths import draw_path, make_walk_network
from gen_data.traffic.pedestrians import Pedestrian
from gen_data.traffic.signal_cycles import AMBER_S, Approach, Cycle
from gen_data.traffic.simulation import SimulatedMotion, first_overlap, simulate
from gen_data.traffic.vehicles import Vehicles, make_vehicles
from tests.traffic.roads import NO_BOXES, car, crossing, driven, fronts_m, lane, rng_of

LINE_M = 140.0
"""Station at which the lanes into the crossing end."""


def boxes(made: Vehicles, motion: SimulatedMotion) -> tuple[np.ndarray, np.ndarray]:
    """Centres and directions over time, and half extents."""
    middle = 0.5 * (made.front_m - made.rear_m)
    centres = motion.axle_m[..., :2] + middle[:, None] * motion.ahead
    half = np.stack([0.5 * (made.front_m + made.rear_m), np.full(len(middle), 0.95)], axis=1)
    return np.concatenate([centres, motion.ahead], axis=2), half


def test_cycle_gives_green_to_one_axis_at_a_time() -> None:
    """Over two cycles: never two axes with green or amber; every axis sees all four states."""
    cycle = Cycle(2, green_s=10.0, all_red_s=2.0, offset_s=4.0)
    seen: dict[int, set[str]] = {0: set(), 1: set()}
    for k in range(600):
        states = [cycle.state(axis, 0.1 * k) for axis in (0, 1)]
        assert sum(state in ("green", "yellow") for state in states) <= 1
        for axis, state in enumerate(states):
            seen[axis].add(state)

    assert cycle.length_s == 30.0
    assert seen[0] == seen[1] == {"red", "red_yellow", "yellow", "green"}


def test_switches_are_where_the_state_changes() -> None:
    """Just before and just after each of them the state differs; between them it does not."""
    cycle = Cycle(2, 11.0, 2.0, offset_s=7.3)
    for axis in (0, 1):
        switches = cycle.switches_s(axis, 60.0)
        changes = [
            k
            for k in range(1, 6000)
            if cycle.state(axis, 0.01 * k) != cycle.state(axis, 0.01 * k - 0.01)
        ]
        assert [round(0.01 * k, 2) for k in changes] == pytest.approx(switches, abs=0.011)


def test_a_red_light_is_obeyed_and_a_green_one_is_used() -> None:
    """Red for ten seconds: the car stands before the line; then it goes."""
    red_first = Approach(Cycle(2, green_s=7.0, all_red_s=2.0), axis=1)
    made, motion = driven(
        crossing(), ("west", 60.0), approaches={"west": red_first}, duration_s=25.0
    )
    front = fronts_m(made, motion)[:, 0]
    times = 0.05 * np.arange(len(front))
    red = np.array([red_first.state(float(t)) in ("red", "red_yellow") for t in times])

    assert red[:200].all()
    assert (front[:200] < LINE_M).all()
    assert front[200] > LINE_M - 3.0
    assert front[-1] > LINE_M + 20.0
    crossed = int(np.argmax(front > LINE_M))
    assert red_first.state(times[crossed]) == "green"


@pytest.mark.parametrize("at_m", [60.0, 75.0, 90.0, 105.0, 120.0])
def test_nobody_passes_a_red_light(at_m: float) -> None:
    """Green turns to amber after 2 s: whoever passes does so before it is red."""
    approach = Approach(Cycle(2, green_s=20.0, all_red_s=2.0, offset_s=18.0), axis=0)
    made, motion = driven(crossing(), ("west", at_m), approaches={"west": approach}, duration_s=12)
    front = fronts_m(made, motion)[:, 0]
    crossed = np.flatnonzero(front > LINE_M)

    if len(crossed):
        assert 0.05 * crossed[0] < 2.0 + AMBER_S
    assert motion.acceleration_m_s2.min() > -6.0


@pytest.mark.parametrize("ahead_m", [-18.0, -6.0, 0.0, 6.0, 18.0])
def test_in_a_junction_without_lights_two_never_meet(ahead_m: float) -> None:
    """Whoever comes first, and with a tie from the right, goes first; both get across."""
    made, motion = driven(crossing(), ("west", 90.0 + ahead_m), ("south", 90.0), duration_s=25.0)
    moving, half = boxes(made, motion)
    fronts = fronts_m(made, motion)

    assert first_overlap(moving, half, np.zeros((0, 4)), np.zeros((0, 2))) is None
    assert (fronts[-1] > LINE_M + 20.0).all()
    entered = [int(np.argmax(fronts[:, k] > LINE_M)) for k in (0, 1)]
    if ahead_m >= 18.0:
        assert entered[0] < entered[1]
    if ahead_m <= 0.0:
        assert entered[1] < entered[0]


def test_columns_from_both_sides_get_across_without_touching() -> None:
    """Eight cars, five metres apart: a minute later all have crossed."""
    cars = [(road, 30.0 + 10.0 * k) for road in ("west", "south") for k in range(4)]
    made, motion = driven(crossing(), *cars, duration_s=60.0)
    moving, half = boxes(made, motion)

    assert first_overlap(moving, half, np.zeros((0, 4)), np.zeros((0, 2))) is None
    assert (fronts_m(made, motion)[-1] > LINE_M + 20.0).all()


def zebra() -> list:
    """A road with a crosswalk over it at 100 m, and sidewalks at its sides."""
    return [
        lane("road", (0.0, 0.0), (250.0, 0.0)),
        lane("zebra", (100.0, -3.5), (100.0, 3.5), kind="crosswalk", width_m=4.0),
        lane("near", (0.0, -5.0), (250.0, -5.0), kind="sidewalk", width_m=2.5),
        lane("far", (250.0, 5.0), (0.0, 5.0), kind="sidewalk", width_m=2.5),
    ]


def pedestrian(start: str = "near", at_m: float = 96.0) -> Pedestrian:
    """Somebody who comes to the crosswalk and takes it."""
    lanes = zebra()
    walks = make_walk_network(
        LaneGraph.of(lanes, "sidewalk"), LaneGraph.of(lanes, "crosswalk"), NO_BOXES
    )
    path = draw_path(walks, start, at_m, True, 40.0, 1.0, rng_of())
    x, y, _ = path.points_m[0]
    return Pedestrian("person", (float(x), float(y)), (1.0, 0.0), 1.4, path)


@pytest.mark.parametrize("at_m", [20.0, 45.0, 60.0, 75.0, 85.0])
def test_people_are_let_over_and_never_run_into(at_m: float) -> None:
    """One car that comes from nearer and nearer: both get on, and never at the same place."""
    made, motion = driven(zebra(), ("road", at_m), walkers=[pedestrian()], duration_s=20.0)
    moving, half = boxes(made, motion)
    person = np.concatenate([motion.feet_m[..., :2], motion.look], axis=2)
    both = np.concatenate([moving, person], axis=1)
    extents = np.concatenate([half, [[0.25, 0.25]]])

    assert first_overlap(both, extents, np.zeros((0, 4)), np.zeros((0, 2))) is None
    assert motion.feet_m[-1, 0, 1] > 3.5
    assert fronts_m(made, motion)[-1, 0] > 110.0
    assert motion.acceleration_m_s2.min() > -6.0


def test_a_car_that_can_stop_waits_for_who_is_on_the_crosswalk() -> None:
    """The person does not wait; the car stands before the zebra and goes on behind them."""
    made, motion = driven(zebra(), ("road", 15.0), walkers=[pedestrian()], duration_s=15.0)
    on = np.abs(motion.feet_m[:, 0, 1]) < 1.75
    front = fronts_m(made, motion)[::2, 0]

    assert motion.pace_m_s[:160].min() > 1.0
    assert on.any()
    assert (front[on] < 98.0).all()
    assert front[-1] > 102.0


def test_people_wait_at_the_kerb_while_their_light_is_red() -> None:
    """Cars have green for 12 s, then red: nobody is on the road before."""
    approach = Approach(Cycle(2, green_s=12.0), axis=0)
    _, motion = driven(
        zebra(), ("road", 200.0), walkers=[pedestrian()], duration_s=30.0,
        approaches={"zebra": approach},
    )  # fmt: skip
    on = np.flatnonzero(np.abs(motion.feet_m[:, 0, 1]) < 3.4)

    assert 0.1 * on[0] > 12.0 + AMBER_S
    assert all(approach.state(0.1 * float(k)) == "red" for k in on)
    assert motion.feet_m[-1, 0, 1] > 3.5


def test_people_walk_around_each_other_and_around_things() -> None:
    """Two who meet and a post between them: nobody is nearer than a body, both arrive."""
    lanes = [lane("walk", (0.0, 0.0), (60.0, 0.0), kind="sidewalk", width_m=3.0)]
    post = np.array([[15.0, 0.8, 0.2, 0.2, 1.0, 0.0]])
    walks = make_walk_network(
        LaneGraph.of(lanes, "sidewalk"), LaneGraph.of(lanes, "crosswalk"), post
    )
    there = draw_path(walks, "walk", 5.0, True, 25.0, 0.0, rng_of())
    back = draw_path(walks, "walk", 25.0, False, 24.0, 0.0, rng_of())
    people = [
        Pedestrian("a", (5.0, 0.0), (1.0, 0.0), 1.4, there),
        Pedestrian("b", (25.0, 0.0), (-1.0, 0.0), 1.2, back),
    ]
    motion = simulate(None, people, post, {}, 14.0)
    apart = np.hypot(*(motion.feet_m[:, 0, :2] - motion.feet_m[:, 1, :2]).T)
    beside = np.maximum(np.abs(motion.feet_m[..., :2] - post[0, :2]) - 0.2, 0.0)

    assert apart.min() > 0.55
    assert np.hypot(beside[..., 0], beside[..., 1]).min() > 0.3
    assert motion.feet_m[-1, 0, 0] > 20.0
    assert motion.feet_m[-1, 1, 0] < 12.0


def test_a_car_stops_before_what_stands_on_its_lane() -> None:
    """A box of one metre at 100 m; one beside the lane at 60 m is passed."""
    boxes_ = np.array([[100.0, 0.5, 0.5, 0.5, 1.0, 0.0], [60.0, 2.0, 0.5, 0.5, 1.0, 0.0]])
    made, motion = driven(zebra()[:1], ("road", 20.0), obstacles=boxes_, duration_s=20.0)
    front = fronts_m(made, motion)[:, 0]

    assert 95.0 < front[-1] < 99.0
    assert motion.speed_m_s[-1, 0] == 0.0


def test_cyclists_keep_to_the_side_of_their_lane() -> None:
    """At the same distance from the middle after 40 m and around a bend; cars go to the middle."""
    turns = np.linspace(0.0, 0.5 * np.pi, 15)[1:]
    bend = [(40.0 + 30.0 * np.sin(t), 30.0 - 30.0 * np.cos(t)) for t in turns]
    lanes = [lane("way", (0.0, 0.0), (40.0, 0.0), *bend, (70.0, 150.0))]
    graph = LaneGraph.of(lanes, "driving", "bicycle")
    beside = replace(car(graph, "cyclist", "way", 5.0), xy_m=(5.0, -1.2))
    keeps, drifts = replace(beside, left_m=-1.2), beside
    made = make_vehicles([keeps, drifts], graph, LaneGraph.of([], "crosswalk"), NO_BOXES, 90.0)

    for k, expected in ((0, -1.2), (1, 0.0)):
        ends = made.courses.xy_m[k, [60, 160]]
        lefts = [project_on_lane(graph.lines["way"], *end).left_m for end in ends.tolist()]
        assert lefts == pytest.approx([expected] * 2, abs=0.12)


def test_nothing_teleports() -> None:
    """From knot to knot nobody goes farther than their speed allows."""
    made, motion = driven(
        [*crossing(), *zebra()[2:]], ("west", 60.0), ("south", 70.0), walkers=[pedestrian()]
    )
    steps = np.linalg.norm(np.diff(motion.axle_m, axis=0), axis=2)
    paces = np.linalg.norm(np.diff(motion.feet_m, axis=0), axis=2)

    assert steps.max() < 0.1 * 15.0
    assert paces.max() < 0.1 * 1.6
    assert len(made.vehicles) == 2
