"""Everybody on the road through time."""

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
"""Poses are kept at every second step."""
_PER_KNOT = round(KNOT_S / STEP_S)


@dataclass(frozen=True, eq=False, slots=True)
class SimulatedMotion:
    """What n vehicles and p people do; arrays over t knots, or t' steps where it says so.

    Attributes:
        axle_m: Middles of rear axles on the ground [t, n, 3].
        ahead: Directions of vehicles [t, n, 2].
        rise: Height of the front axle's ground over the rear's [t, n].
        station_m: Of rear axles on routes [t', n].
        speed_m_s, acceleration_m_s2: Of vehicles [t', n].
        feet_m: Where people are [t, p, 3].
        look: Directions of people [t, p, 2].
        walked_m: Distances [t', p].
        pace_m_s: Speeds of people [t', p].
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

    @property
    def knots(self) -> int:
        """How many there are."""
        return len(self.feet_m)


def simulate(
    fleet: Vehicles | None,
    walkers: Sequence[Pedestrian],
    obstacles: Array,
    approaches: Mapping[str, Approach],
    duration_s: float,
) -> SimulatedMotion:
    """What happens from time 0 to the first knot at or after ``duration_s``.

    Args:
        fleet: The vehicles; None = there are none.
        walkers: The people.
        obstacles: Boxes of what stands [b, 6]: centre, half extents, cosine and sine.
        approaches: Signals by the lanes into junctions and by the crosswalks that obey them.
        duration_s: How long.
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
    return _motion(fleet, cars, people)


def _always(crosswalk: str) -> bool:
    del crosswalk
    return True


def _motion(
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
        axle, ahead, rise = (
            np.zeros((*none[kept].shape, 3)),
            np.zeros((*none[kept].shape, 2)),
            none[kept],
        )
    else:
        station, speed, acceleration = (np.stack(column) for column in zip(*cars, strict=True))
        axle, ahead, rise = _poses(fleet, station[kept])
    return SimulatedMotion(
        axle, ahead, rise, station, speed, acceleration, feet, look[kept], walked, pace
    )


def _poses(fleet: Vehicles, station_m: Array) -> tuple[Array, Array, Array]:
    """Rear axles [t, n, 3], directions [t, n, 2] and rises [t, n] of vehicles at stations."""
    along = (station_m - fleet.first_m) / STATION_M
    xy, ahead = fleet.courses.poses(along)
    low, high = _interpolate(fleet.height_m, along)
    return np.concatenate([xy, low[..., None]], axis=2), ahead, high - low


def _interpolate(values: Array, along: Array) -> tuple[Array, Array]:
    """Two values per station [n, m, 2], between stations [t, n]."""
    k: NDArray[np.int64] = np.clip(along.astype(np.int64), 0, values.shape[1] - 2)
    f = np.clip(along - k, 0.0, 1.0)[..., None]
    rows = np.arange(len(values))
    mixed = (1.0 - f) * values[rows, k] + f * values[rows, k + 1]
    return mixed[..., 0], mixed[..., 1]
