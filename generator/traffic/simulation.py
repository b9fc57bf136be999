"""Simulation of all vehicles and pedestrians: their motion, trajectories and first overlap."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.core import boxes, motion
from gen_data.core.se3 import SE3, Array, Vec3
from gen_data.traffic import lane_routes, pedestrians, signal_cycles, vehicle_model, vehicles

STEP_S = 0.05
KNOT_S = 0.1
"""Interval of the poses: every second step."""
_PER_KNOT = round(KNOT_S / STEP_S)
STILL_M = 0.002
"""Displacement up to which a body counts as static."""


@dataclass(frozen=True, eq=False, slots=True)
class SimulatedMotion:
    """Motion of n vehicles and p pedestrians, at t knots or t' steps.

    Attributes:
        axle_m: Middles of the rear axles on the ground [t, n, 3].
        ahead: Directions of vehicles [t, n, 2].
        rise: Height of the ground at the front axle above that at the rear axle [t, n].
        bank: Rise of the lane to its left per metre [t, n].
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
    bank: Array
    station_m: Array
    speed_m_s: Array
    acceleration_m_s2: Array
    feet_m: Array
    look: Array
    walked_m: Array
    pace_m_s: Array


def simulate(
    fleet: vehicles.Vehicles | None,
    walkers: Sequence[pedestrians.Pedestrian],
    obstacles: Array,
    approaches: Mapping[str, signal_cycles.Approach],
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
    driving = vehicle_model.VehicleModel(fleet, approaches) if fleet is not None else None
    walking = pedestrians.Pedestrians(walkers, approaches, obstacles)
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
    fleet: vehicles.Vehicles | None,
    cars: Sequence[tuple[Array, Array, Array]],
    people: Sequence[tuple[Array, ...]],
) -> SimulatedMotion:
    xy, z, look, walked, pace = (np.stack(column) for column in zip(*people, strict=True))
    kept = slice(None, None, _PER_KNOT)
    feet = np.concatenate([xy[kept], z[kept, :, None]], axis=2)
    if fleet is None:
        none = np.zeros((len(people), 0))
        station = speed = acceleration = none
        knots, rise, bank = len(none[kept]), none[kept], none[kept]
        axle, ahead = np.zeros((knots, 0, 3)), np.zeros((knots, 0, 2))
    else:
        station, speed, acceleration = (np.stack(column) for column in zip(*cars, strict=True))
        axle, ahead, rise, bank = _vehicle_poses(fleet, station[kept])
    return SimulatedMotion(
        axle, ahead, rise, bank, station, speed, acceleration, feet, look[kept], walked, pace
    )


def _vehicle_poses(fleet: vehicles.Vehicles, station_m: Array) -> tuple[Array, Array, Array, Array]:
    """Compute rear axles [t, n, 3], directions [t, n, 2], rises and banks at stations [t, n]."""
    along = (station_m - fleet.first_m) / lane_routes.STATION_M
    xy, ahead = fleet.courses.poses(along)
    low, high, bank = _interpolate(np.dstack([fleet.height_m, fleet.bank]), along)
    return np.concatenate([xy, low[..., None]], axis=2), ahead, high - low, bank


def _interpolate(values: Array, along: Array) -> Array:
    """Interpolate k values per station [n, m, k] at stations [t, n]: [k, t, n]."""
    k: NDArray[np.int64] = np.clip(along.astype(np.int64), 0, values.shape[1] - 2)
    f = np.clip(along - k, 0.0, 1.0)[..., None]
    rows = np.arange(len(values))
    mixed: Array = (1.0 - f) * values[rows, k] + f * values[rows, k + 1]
    return np.moveaxis(mixed, -1, 0)


def first_overlap(
    moving: Array, half_m: Array, standing: Array, standing_half_m: Array
) -> tuple[int, int, int] | None:
    """Find the first overlap of two boxes, at least one of them moving; None = no overlap.

    Args:
        moving: Centres and directions of n boxes [t, n, 4]: x, y, cosine, sine.
        half_m: Their half extents [n, 2].
        standing: Centres and directions of m static boxes [m, 4].
        standing_half_m: Their half extents [m, 2].

    Returns:
        Index of the instant, number of the moving box, and number of the other one: below n a
        moving box, from n on a static one.
    """
    others = np.concatenate([half_m, standing_half_m])
    reach = np.sqrt(others[:, 0] * others[:, 0] + others[:, 1] * others[:, 1])
    still = np.broadcast_to(standing, (len(moving), *standing.shape))
    every = np.concatenate([moving, still], axis=1)
    found: tuple[int, int, int] | None = None
    for i, j in _near_pairs(moving, every, reach):
        d = every[:, j, :2] - moving[:, i, :2]
        near = np.flatnonzero(
            d[:, 0] * d[:, 0] + d[:, 1] * d[:, 1] < (reach[i] + reach[j]) * (reach[i] + reach[j])
        )
        hit = boxes.rectangles_overlap(moving[near, i], half_m[i], every[near, j], others[j])
        if hit.any():
            first = int(near[int(np.argmax(hit))])
            if found is None or first < found[0]:
                found = (first, i, j)
    return found


def _near_pairs(moving: Array, every: Array, reach_m: Array) -> list[tuple[int, int]]:
    """Pairs with a moving box whose paths come close, by the bounding boxes of the paths."""
    n = moving.shape[1]
    low = every[..., :2].min(axis=0) - reach_m[:, None]
    high = every[..., :2].max(axis=0) + reach_m[:, None]
    apart = (low[:n, None] > high[None]) | (high[:n, None] < low[None])
    near = ~apart.any(axis=2)
    rows, columns = np.nonzero(near)
    return [(int(i), int(j)) for i, j in zip(rows, columns, strict=True) if j > i or j >= n]


def make_upright_trajectories(
    names: Sequence[str],
    ground_m: Array,
    ahead: Array,
    climb: Array,
    offsets_m: Sequence[Vec3],
    roll: Array | None = None,
) -> list[motion.Trajectory | None]:
    """Make trajectories of bodies on the ground; None for bodies that never move.

    Args:
        names: Names of the bodies [n].
        ground_m: Points of support on the ground [t, n, 3].
        ahead: Horizontal directions, unit [t, n, 2].
        climb: Sines of the upward pitch angles [t, n].
        offsets_m: Origin of each body [n], in a frame at that point with X ahead and Z up.
        roll: Sines of the roll angles to the right [t, n]; None = no roll.
    """
    roll = np.zeros_like(climb) if roll is None else roll
    quaternions = _rolled(_quaternions(ahead, climb), roll)
    level = np.sqrt(1.0 - climb * climb)[..., None]
    c, s = ahead[..., :1], ahead[..., 1:]
    rise = climb[..., None]
    x, y, z = np.asarray(offsets_m).reshape(-1, 3).T[:, None, :, None]
    sine, cosine = roll[..., None], np.sqrt(1.0 - roll * roll)[..., None]
    y, z = y * cosine - z * sine, y * sine + z * cosine
    origin = ground_m + np.concatenate(
        [
            x * c * level - y * s - z * c * rise,
            x * s * level + y * c - z * s * rise,
            x * rise + z * level,
        ],
        axis=2,
    )
    origin, quaternions = np.round(origin, 6) + 0.0, np.round(quaternions, 8) + 0.0
    tracks: list[motion.Trajectory | None] = []
    for k, name in enumerate(names):
        moved = np.abs(origin[:, k] - origin[0, k]).max() > STILL_M
        knots = tuple(
            SE3((a, b, d), (e, f, g, h))
            for (a, b, d), (e, f, g, h) in zip(
                origin[:, k].tolist(), quaternions[:, k].tolist(), strict=True
            )
        )
        tracks.append(motion.Trajectory(name, KNOT_S, knots) if moved else None)
    return tracks


def _quaternions(ahead: Array, climb: Array) -> Array:
    """Unit quaternions [..., 4] of a yaw, then a pitch upwards, without trigonometric functions."""
    c, s = ahead[..., 0], ahead[..., 1]
    w, z = _half_angle(c, s)
    up_w, up_y = _half_angle(np.sqrt(1.0 - climb * climb), -climb)
    return np.stack([w * up_w, -z * up_y, w * up_y, z * up_w], axis=-1)


def _rolled(quaternions: Array, roll: Array) -> Array:
    """Quaternions [..., 4] after a roll about their own X axis, given by its sine."""
    c, s = _half_angle(np.sqrt(1.0 - roll * roll), roll)
    w, x, y, z = np.moveaxis(quaternions, -1, 0)
    return np.stack([w * c - x * s, w * s + x * c, y * c + z * s, z * c - y * s], axis=-1)


def _half_angle(c: Array, s: Array) -> tuple[Array, Array]:
    """Cosine (not negative) and sine of half an angle."""
    # Divide by the larger of the two roots: the other one may vanish.
    cosine, sine = np.sqrt(np.maximum(0.5 + 0.5 * c, 0.0)), np.sqrt(np.maximum(0.5 - 0.5 * c, 0.0))
    forward = c >= 0.0
    half_c = np.where(forward, cosine, 0.5 * np.abs(s) / np.maximum(sine, 0.5))
    half_s = np.where(forward, 0.5 * s / np.maximum(cosine, 0.5), np.where(s < 0.0, -sine, sine))
    return half_c, half_s
