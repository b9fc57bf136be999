"""Simulation of all vehicles and pedestrians."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.se3 import Array
from gen_data.generator.traffic.lane_routes import STATION_M
from gen_data.generator.traffic.pedestrians import Pedestrian, Pedestrians
from gen_data.generator.traffic.signal_cycles import Approach
from gen_data.generator.traffic.vehicle_model import VehicleModel
from gen_data.generator.traffic.vehicles import Vehicles

STEP_S = 0.05
KNOT_S = 0.1
"""Interval of the poses: every second step."""
_PER_KNOT = round(KNOT_S / STEP_S)


@dataclass(frozen=True, eq=False, slots=True)
class SimulatedMotion:
    """Motion of n vehicles and p pedestrians, at t knots or t' steps.

    Attributes:
        axle_m: Middles of the rear axles on the ground [t, n, 3].
        ahead: Directions of vehicles [t, n, 2].
        rise: Height of the ground at the front axle above that at the rear axle [t, n].
        station_m: Stations of rear axles on their routes [t', n].
        speed_m_s, acceleration_m_s2: Motion of vehicles along their routes [t', n].
        feet_m: Positions of pedestrians on the ground [t, p, 3].
        look: Directions of pedestrians [t, p, 2].
        walked_m: Distances walked [t', p].
        pace_m_s: Speeds of pedestrians [t', p].
    """

    axle_m: Array
    ahead: Array
    rise: Array
    station_m: Array
    speed_m_s: Array
    acceleration_m_s2: Array
    feet_m: Array
    look: Array
    walked_m: Array
    pace_m_s: Array


def simulate(
    fleet: Vehicles | None,
    walkers: Sequence[Pedestrian],
    obstacles: Array,
    approaches: Mapping[str, Approach],
    duration_s: float,
) -> SimulatedMotion:
    """Simulate from time 0 to the first knot at or after ``duration_s``.

    Args:
        fleet: Vehicles; None = none.
        walkers: Pedestrians.
        obstacles: Boxes of obstacles [b, 6]: centre, half extents, cosine and sine of the yaw.
        approaches: Signals by the names of lanes into junctions and of crosswalks.
        duration_s: Simulated time.
    """
    steps = _PER_KNOT * math.ceil(duration_s / KNOT_S - 1e-9)
    driving = VehicleModel(fleet, approaches) if fleet is not None else None
    walking = Pedestrians(walkers, approaches, obstacles)
    if driving is not None:
        driving.settle(walking.crossers())
    cars: list[tuple[Array, Array, Array]] = []
    people: list[tuple[Array, ...]] = []
    for k in range(steps + 1):
        if driving is not None:
            state = (driving.station_m, driving.speed_m_s, driving.acceleration_m_s2)
            cars.append(state)
        people.append((walking.xy_m, walking.height_m, walking.ahead, walking.walked_m,
                       walking.speed_m_s))  # fmt: skip
        if k == steps:
            break
        time_s = k * STEP_S
        walking.step(time_s, STEP_S, driving.lets_pass if driving is not None else _always)
        if driving is not None:
            driving.step(time_s, STEP_S, walking.crossers())
    return _collect_motion(fleet, cars, people)


def _always(crosswalk: str) -> bool:
    del crosswalk
    return True


def _collect_motion(
    fleet: Vehicles | None,
    cars: Sequence[tuple[Array, Array, Array]],
    people: Sequence[tuple[Array, ...]],
) -> SimulatedMotion:
    xy, z, look, walked, pace = (np.stack(column) for column in zip(*people, strict=True))
    kept = slice(None, None, _PER_KNOT)
    feet = np.concatenate([xy[kept], z[kept, :, None]], axis=2)
    if fleet is None:
        none = np.zeros((len(people), 0))
        station = speed = acceleration = none
        knots, rise = len(none[kept]), none[kept]
        axle, ahead = np.zeros((knots, 0, 3)), np.zeros((knots, 0, 2))
    else:
        station, speed, acceleration = (np.stack(column) for column in zip(*cars, strict=True))
        axle, ahead, rise = _vehicle_poses(fleet, station[kept])
    return SimulatedMotion(
        axle, ahead, rise, station, speed, acceleration, feet, look[kept], walked, pace
    )


def _vehicle_poses(fleet: Vehicles, station_m: Array) -> tuple[Array, Array, Array]:
    """Compute rear axles [t, n, 3], directions [t, n, 2] and rises [t, n] at stations [t, n]."""
    along = (station_m - fleet.first_m) / STATION_M
    xy, ahead = fleet.courses.poses(along)
    low, high = _interpolate(fleet.height_m, along)
    return np.concatenate([xy, low[..., None]], axis=2), ahead, high - low


def _interpolate(values: Array, along: Array) -> tuple[Array, Array]:
    """Interpolate two values per station [n, m, 2] at stations [t, n]."""
    k: NDArray[np.int64] = np.clip(along.astype(np.int64), 0, values.shape[1] - 2)
    f = np.clip(along - k, 0.0, 1.0)[..., None]
    rows = np.arange(len(values))
    mixed = (1.0 - f) * values[rows, k] + f * values[rows, k + 1]
    return mixed[..., 0], mixed[..., 1]
