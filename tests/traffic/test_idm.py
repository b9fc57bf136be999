"""The Intelligent Driver Model against its closed forms."""

import math

import numpy as np
import pytest

from gen_data.traffic.idm import Drivers, equilibrium_speed, free_acceleration, interaction
from gen_data.traffic.lane_routes import LaneGraph
from gen_data.traffic.simulation import simulate
from gen_data.traffic.vehicles import make_vehicles
from tests.traffic.roads import NO_BOXES, car, driven, fronts_m, lane


def equal_drivers(
    n: int,
    headway_s: float = 1.2,
    standstill_m: float = 2.0,
    acceleration_m_s2: float = 1.5,
    braking_m_s2: float = 2.0,
) -> Drivers:
    """Drivers with equal parameters."""
    values = (headway_s, standstill_m, acceleration_m_s2, braking_m_s2)
    return Drivers(*(np.full(n, value) for value in values))


def test_free_road_acceleration_is_the_models() -> None:
    """A (1 - (v / v0)^4): all at standstill, 15/16 at half the speed, none at full speed."""
    drivers = equal_drivers(3, acceleration_m_s2=1.6)
    free = free_acceleration(drivers, np.array([0.0, 7.0, 14.0]), np.full(3, 14.0))

    assert free.tolist() == pytest.approx([1.6, 1.5, 0.0])


def test_nobody_accelerates_in_the_equilibrium_gap() -> None:
    """(s0 + v T) / sqrt(1 - (v / v0)^4), Treiber, Hennecke, Helbing 2000, equation 6."""
    drivers = equal_drivers(1, headway_s=1.5, standstill_m=2.0)
    v, v0 = 10.0, 14.0
    gap = (2.0 + v * 1.5) / math.sqrt(1.0 - (v / v0) ** 4)
    speed, leader = np.array([v]), np.array([v])
    net = free_acceleration(drivers, speed, np.array([v0])) - interaction(
        drivers, speed, np.array([gap]), leader
    )

    assert net[0] == pytest.approx(0.0, abs=1e-12)


def test_braking_for_a_standing_obstacle_is_kinematic() -> None:
    """Far faster than the equilibrium, deceleration tends to (v^2 / 2 s)^2 / b."""
    drivers = equal_drivers(1, headway_s=0.0, standstill_m=0.0, braking_m_s2=2.0)
    taken = interaction(drivers, np.array([20.0]), np.array([50.0]), np.array([0.0]))

    assert taken[0] == pytest.approx((20.0**2 / (2 * 50.0)) ** 2 / 2.0)


def test_speed_that_suits_a_gap_is_never_too_high() -> None:
    """At it, the model does not brake harder than easing off."""
    drivers = equal_drivers(4)
    gaps = np.array([1.0, 5.0, 20.0, np.inf])
    speeds = equilibrium_speed(drivers, gaps, np.full(4, 14.0))

    assert speeds[0] == 0.0
    assert speeds[3] == 14.0
    assert speeds[1] == pytest.approx((5.0 - 2.0) / 1.2)


def test_a_car_settles_in_the_equilibrium_gap_behind_a_slow_one() -> None:
    """A minute behind a leader at 8 m/s: the closed form again, now after 1200 steps."""
    graph = LaneGraph.of([lane("long", (0.0, 0.0), (2000.0, 0.0))], "driving")
    slow, eager = (
        car(graph, "slow", "long", 50.0, speed_max_m_s=8.0),
        car(graph, "eager", "long", 5.0),
    )
    made = make_vehicles([slow, eager], graph, LaneGraph.of([], "crosswalk"), NO_BOXES, 700.0)
    motion = simulate(made, [], NO_BOXES, {}, 60.0)
    gap = motion.station_m[-1, 0] - slow.rear_m - motion.station_m[-1, 1] - eager.front_m
    v = motion.speed_m_s[-1, 0]

    assert v == pytest.approx(8.0, abs=0.05)
    assert motion.speed_m_s[-1, 1] == pytest.approx(v, abs=0.02)
    assert gap == pytest.approx((2.0 + 1.2 * v) / math.sqrt(1.0 - (v / 13.9) ** 4), rel=0.02)


def test_a_free_car_reaches_the_usual_speed_and_keeps_it() -> None:
    """It starts at it, and nothing makes it brake."""
    _, motion = driven([lane("long", (0.0, 0.0), (3000.0, 0.0))], ("long", 5.0), duration_s=10.0)

    assert motion.speed_m_s[:, 0] == pytest.approx(13.9, abs=0.05)


def test_a_car_stops_where_the_network_ends() -> None:
    """Before the end of the last lane, gently, and for good."""
    made, motion = driven([lane("short", (0.0, 0.0), (80.0, 0.0))], ("short", 5.0), duration_s=20.0)
    front = fronts_m(made, motion)[:, 0]

    assert front.max() < 80.0
    assert front[-1] > 76.0
    assert motion.speed_m_s[-1, 0] == 0.0
    assert motion.acceleration_m_s2.min() > -4.0
