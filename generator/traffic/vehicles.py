"""Constant properties of simulated vehicles: courses, speed limits and conflicts."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations, takewhile

import numpy as np

from gen_data.core.boxes import rectangles_overlap
from gen_data.core.scene import Lane
from gen_data.core.se3 import Array
from gen_data.traffic import idm, steering
from gen_data.traffic.conflict_zones import Overlap, Zone, crosswalk_zones, find_overlaps, heading
from gen_data.traffic.lane_routes import STATION_M, LaneGraph, Route, points_at

LOOKAHEAD_S, LOOKAHEAD_M = 0.6, (3.0, 10.0)
"""Lookahead of the steering: a time at the vehicle's speed, within bounds."""
LATERAL_M_S2 = 2.0
"""Lateral acceleration in bends."""
EASY_M_S2 = 1.5
"""Comfortable deceleration for bends and stops that are visible early."""
CLEAR_M = 1.5
"""Distance of stopped vehicles from obstacles."""
STEERED_RAD_TAN = 0.75
"""Tangent of the largest steering angle, 37 degrees."""


@dataclass(frozen=True, slots=True)
class Vehicle:
    """One vehicle and its driver.

    Attributes:
        xy_m: Middle of the rear axle on the ground, world.
        ahead: Direction of its front, unit.
        front_m, rear_m: Distances from the rear axle to its front and rear ends.
        wheelbase_m: Distance between the axles.
        route: Its route.
        station_m: Station of the rear axle on the route.
        speed_factor: Factor on the lanes' usual speed.
        speed_max_m_s: Largest speed.
        left_m: Distance to the left of the lanes' middle that it keeps.
    """

    name: str
    xy_m: tuple[float, float]
    ahead: tuple[float, float]
    front_m: float
    rear_m: float
    width_m: float
    wheelbase_m: float
    route: Route
    station_m: float
    speed_factor: float = 1.0
    speed_max_m_s: float = 60.0
    headway_s: float = 1.2
    acceleration_m_s2: float = 1.5
    left_m: float = 0.0


@dataclass(frozen=True, slots=True)
class Entry:
    """Entry of a route into a junction's lane.

    Attributes:
        at_m, leave_m: Stations of the route at which that lane starts and ends.
        came: Previous lane.
        turn: Sine of half the turn, positive to the left; 0 = straight on.
    """

    lane: str
    came: str
    at_m: float
    leave_m: float
    turn: float


@dataclass(frozen=True, slots=True)
class RouteZone:
    """A crosswalk's zone on a route, with stations of the route."""

    zone: Zone
    enter_m: float
    leave_m: float


@dataclass(frozen=True, eq=False)
class Vehicles:
    """n vehicles; arrays [n], [n, n] or [n, m] with m stations from each start.

    Attributes:
        first_m: Station of the rear axle at time 0.
        allowed_m_s: Speed limits from lanes, bends and drivers [n, m].
        height_m: Height of the ground at the rear and the front axle [n, m, 2].
        bank: Rise of the lane to its left per metre [n, m].
        offset_m: Offset from stations of vehicle j to stations of vehicle i [n, n].
        from_m, to_m: Stations of i between which j shares i's route [n, n].
        end_m: Station of the network's end, or of the first obstacle; ``inf`` = neither.
    """

    vehicles: tuple[Vehicle, ...]
    drivers: idm.Drivers
    front_m: Array
    rear_m: Array
    first_m: Array
    courses: steering.Courses
    allowed_m_s: Array
    height_m: Array
    bank: Array
    offset_m: Array
    from_m: Array
    to_m: Array
    end_m: Array
    entries: tuple[tuple[Entry, ...], ...]
    zones: tuple[tuple[RouteZone, ...], ...]
    overlaps: Mapping[tuple[str, str], Overlap]
    headings: Mapping[str, tuple[float, float]]


def make_vehicles(
    vehicles: Sequence[Vehicle],
    graph: LaneGraph,
    crosswalks: LaneGraph,
    obstacles: Array,
    reach_m: float,
) -> Vehicles:
    """Compute courses, limits and conflicts of vehicles.

    Args:
        vehicles: At least one vehicle.
        graph: Graph of the driving lanes.
        crosswalks: Graph of the crosswalks.
        obstacles: Boxes of obstacles [b, 6]: centre, half extents, cosine and sine of the yaw.
        reach_m: Longest distance that a vehicle drives.
    """
    m = math.ceil((reach_m + 1.0) / STATION_M)
    first = np.array([v.station_m for v in vehicles])
    beyond = math.ceil(max([LOOKAHEAD_M[1], *(v.wheelbase_m for v in vehicles)]) / STATION_M) + 2
    grid: Array = STATION_M * np.arange(m + beyond, dtype=np.float64)
    lines = np.stack([_followed_line(graph, v, grid) for v in vehicles])
    limits = np.stack([_speed_limits(graph, v, grid[:m]) for v in vehicles])
    limit_braking(limits)
    lookahead = np.clip(LOOKAHEAD_S * limits, *LOOKAHEAD_M) / STATION_M
    courses = steering.follow_lines(
        lines[..., :2],
        np.array([v.xy_m for v in vehicles]),
        np.array([v.ahead for v in vehicles]),
        np.round(lookahead).astype(np.int64),
        np.array([STEERED_RAD_TAN / v.wheelbase_m for v in vehicles]),
    )
    bends = np.maximum(np.abs(courses.curvature_per_m), 1e-6)
    allowed = np.minimum(limits, np.sqrt(LATERAL_M_S2 / bends))
    limit_braking(allowed)
    widths = _widest_by_lane(vehicles)
    crossed = find_overlaps(graph, widths)
    walked = crosswalk_zones(graph, widths, crosswalks)
    offset, low, high = _shared_lanes([v.route for v in vehicles], first, crossed)
    return Vehicles(
        tuple(vehicles),
        _drivers(vehicles),
        front_m=np.array([v.front_m for v in vehicles]),
        rear_m=np.array([v.rear_m for v in vehicles]),
        first_m=first,
        courses=courses,
        allowed_m_s=allowed,
        height_m=_heights(lines[..., 2], [v.wheelbase_m for v in vehicles], m),
        bank=np.stack([_banks(graph, v, grid[:m]) for v in vehicles]),
        offset_m=offset,
        from_m=low,
        to_m=high,
        end_m=np.array([_end_m(v, courses, k, obstacles) for k, v in enumerate(vehicles)]),
        entries=tuple(_entries(graph, v.route) for v in vehicles),
        zones=tuple(_zones(v.route, walked) for v in vehicles),
        overlaps=crossed,
        headings={name: heading(graph.lines[name].lane.center_m, -1) for name in widths},
    )


def _widest_by_lane(vehicles: Sequence[Vehicle]) -> dict[str, float]:
    """Width of the widest vehicle on each lane [m]."""
    widths: dict[str, float] = {}
    for v in vehicles:
        for name in v.route.lanes:
            widths[name] = max(widths.get(name, 0.0), v.width_m)
    return widths


def _followed_line(graph: LaneGraph, vehicle: Vehicle, grid: Array) -> Array:
    """Points [m, 3] that a vehicle follows: ``left_m`` to the left of the middle of its lanes."""
    points = points_at(graph, vehicle.route, vehicle.station_m + grid)
    if vehicle.left_m:
        way = steering.normalize(np.gradient(points[:, :2], axis=0))
        points[:, :2] += vehicle.left_m * np.column_stack([-way[:, 1], way[:, 0]])
        points[:, 2] += vehicle.left_m * _banks(graph, vehicle, grid)
    return points


def limit_braking(limits: Array) -> None:
    """Lower limits [n, m] in place until comfortable braking reaches the lower ones ahead."""
    for k in range(limits.shape[1] - 2, -1, -1):
        after = limits[:, k + 1]
        reachable = np.sqrt(after * after + 2.0 * EASY_M_S2 * STATION_M)
        limits[:, k] = np.minimum(limits[:, k], reachable)


def _end_m(vehicle: Vehicle, courses: steering.Courses, k: int, obstacles: Array) -> float:
    """Station at which a vehicle's front has to stop; ``inf`` = nowhere."""
    route_m = vehicle.route.end_m if vehicle.route.dead_end else math.inf
    return min(route_m, _free_station_m(vehicle, courses, k, obstacles))


def _free_station_m(vehicle: Vehicle, courses: steering.Courses, k: int, obstacles: Array) -> float:
    """Station at which a vehicle's front has to stop for obstacles; ``inf`` = none."""
    xy, ahead = courses.xy_m[k], courses.ahead[k]
    half = np.array([0.5 * (vehicle.front_m + vehicle.rear_m), 0.5 * vehicle.width_m])
    swept = np.column_stack([xy + (half[0] - vehicle.rear_m) * ahead, ahead])
    reach = np.sqrt(half[0] * half[0] + half[1] * half[1])
    low, high = swept[:, :2].min(axis=0) - reach, swept[:, :2].max(axis=0) + reach
    size = np.sqrt(obstacles[:, 2] * obstacles[:, 2] + obstacles[:, 3] * obstacles[:, 3])
    centres = obstacles[:, :2]
    near = ((centres + size[:, None] > low) & (centres - size[:, None] < high)).all(axis=1)
    free_m = math.inf
    for box in obstacles[near]:
        delta = swept[:, :2] - box[:2]
        apart = float(reach) + math.hypot(box[2], box[3])
        beside = np.flatnonzero(delta[:, 0] * delta[:, 0] + delta[:, 1] * delta[:, 1] < apart**2)
        hit = rectangles_overlap(swept[beside], half, box[[0, 1, 4, 5]], box[2:4])
        if hit.any():
            met_m = STATION_M * float(beside[int(np.argmax(hit))]) - CLEAR_M
            free_m = min(free_m, vehicle.station_m + vehicle.front_m + met_m)
    return free_m


def _speed_limits(graph: LaneGraph, vehicle: Vehicle, grid: Array) -> Array:
    """Speed limits [m] from lanes and the driver."""
    speeds = np.array([lane.speed_m_s for lane in _lanes_along(graph, vehicle, grid)])
    return np.minimum(speeds * vehicle.speed_factor, vehicle.speed_max_m_s)


def _banks(graph: LaneGraph, vehicle: Vehicle, grid: Array) -> Array:
    """Cross slopes [m] of its lanes, as between its axles: it turns over that length."""
    banks = np.array([lane.bank for lane in _lanes_along(graph, vehicle, grid)])
    count = 1 + 2 * round(0.5 * vehicle.wheelbase_m / STATION_M)
    padded = np.pad(banks, (count // 2, count // 2), mode="edge")
    means: Array = np.mean([padded[k : k + len(banks)] for k in range(count)], axis=0)
    return means


def _lanes_along(graph: LaneGraph, vehicle: Vehicle, grid: Array) -> list[Lane]:
    """The lane at each of some distances from where it is at time 0."""
    at = np.searchsorted(vehicle.route.starts_m, vehicle.station_m + grid, side="right") - 1
    return [graph.lines[vehicle.route.lanes[k]].lane for k in np.maximum(at, 0)]


def _drivers(vehicles: Sequence[Vehicle]) -> idm.Drivers:
    n = len(vehicles)
    return idm.Drivers(
        headway_s=np.array([v.headway_s for v in vehicles]),
        standstill_m=np.full(n, 2.0),
        acceleration_m_s2=np.array([v.acceleration_m_s2 for v in vehicles]),
        braking_m_s2=np.full(n, 2.0),
    )


def _heights(line_z_m: Array, wheelbases_m: Sequence[float], m: int) -> Array:
    """Heights [n, m, 2] of lines below rear and front axles."""
    k = np.arange(line_z_m.shape[1], dtype=np.float64)
    front = [
        np.interp(k[:m] + base / STATION_M, k, z)
        for z, base in zip(line_z_m, wheelbases_m, strict=True)
    ]
    return np.stack([line_z_m[:, :m], np.stack(front)], axis=2)


def _entries(graph: LaneGraph, route: Route) -> tuple[Entry, ...]:
    ends = (*route.starts_m[1:], route.end_m)
    made = []
    for k, name in enumerate(route.lanes):
        lane = graph.lines[name].lane
        if k > 0 and lane.junction and not graph.lines[route.lanes[k - 1]].lane.junction:
            (ax, ay), (bx, by) = heading(lane.center_m, 0), heading(lane.center_m, -1)
            half = math.sqrt(max(0.0, 0.5 * (1.0 - (ax * bx + ay * by))))
            turn = half if ax * by - ay * bx >= 0.0 else -half
            made.append(Entry(name, route.lanes[k - 1], route.starts_m[k], ends[k], turn))
    return tuple(made)


def _zones(route: Route, walked: Mapping[str, tuple[Zone, ...]]) -> tuple[RouteZone, ...]:
    return tuple(
        RouteZone(zone, start + zone.enter_m, start + zone.leave_m)
        for name, start in zip(route.lanes, route.starts_m, strict=True)
        for zone in walked.get(name, ())
    )


def _shared_lanes(
    routes: Sequence[Route], first_m: Array, crossed: Mapping[tuple[str, str], Overlap]
) -> tuple[Array, Array, Array]:
    """First shared lanes of each pair: offset, start and end, [n, n] each."""
    n = len(routes)
    offset, low = np.zeros((n, n)), np.full((n, n), np.inf)
    high = np.full((n, n), -np.inf)
    for (i, own), (j, other) in permutations(enumerate(routes), 2):
        shared = _shared_lane(own, other, float(first_m[i]), crossed)
        if shared is not None:
            offset[i, j], low[i, j], high[i, j] = shared
    return offset, low, high


def _shared_lane(
    own: Route, other: Route, first_m: float, crossed: Mapping[tuple[str, str], Overlap]
) -> tuple[float, float, float] | None:
    """Offset, start and end of the first lanes that a route shares with another; None = none.

    Merging before them and parting behind them count.
    """
    ends = (*own.starts_m[1:], own.end_m)
    ahead = (k for k, name in enumerate(own.lanes) if name in other.lanes and ends[k] > first_m)
    k = next(ahead, None)
    if k is None:
        return None
    o = other.lanes.index(own.lanes[k])
    offset_m, low_m = own.starts_m[k] - other.starts_m[o], own.starts_m[k]
    if k > 0 and o > 0:
        meet = crossed.get((other.lanes[o - 1], own.lanes[k - 1]))
        if meet is not None and meet.kind == "meet":
            low_m -= other.starts_m[o] - other.starts_m[o - 1] - meet.own_m[0]
    pairs = zip(own.lanes[k:], other.lanes[o:], strict=False)
    common = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))
    k, o = k + common, o + common
    high_m = ends[k - 1]
    if k < len(own.lanes) and o < len(other.lanes):
        part = crossed.get((other.lanes[o], own.lanes[k]))
        if part is not None and part.kind == "part":
            high_m += part.own_m[1]
    return offset_m, low_m, high_m
