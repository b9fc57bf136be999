"""Routes over lane graphs."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np

from gen_data.core import errors, lane_geometry, scene, se3, streams

STATION_M = 0.5
"""Distance between stations."""


@dataclass(frozen=True, eq=False)
class LaneGraph:
    """Graph of the lanes of one kind, or of several.

    Attributes:
        names: Names of the lanes, sorted, lanes across junctions last.
        segments: Segments of all centre lines [k, 6]: start, vector, station, number of the lane.
    """

    lines: Mapping[str, lane_geometry.LaneLine]
    predecessors: Mapping[str, tuple[str, ...]]
    names: tuple[str, ...]
    segments: se3.Array

    @classmethod
    def of(cls, lanes: Iterable[scene.Lane], *kinds: str) -> "LaneGraph":
        """Build the graph of all lanes of some kinds."""
        lines = {lane.name: lane_geometry.LaneLine(lane) for lane in lanes if lane.kind in kinds}
        before: dict[str, list[str]] = {}
        for name, line in lines.items():
            for after in line.lane.successors:
                before.setdefault(after, []).append(name)
        names = sorted(lines, key=lambda name: (lines[name].lane.junction, name))
        pieces = [_segments(lines[name], k) for k, name in enumerate(names)]
        return cls(
            lines,
            {name: tuple(sorted(found)) for name, found in before.items()},
            tuple(names),
            np.concatenate(pieces) if pieces else np.zeros((0, 6)),
        )

    def successors(self, name: str) -> tuple[str, ...]:
        """Lanes that start at the end of one."""
        return tuple(n for n in self.lines[name].lane.successors if n in self.lines)

    def nearest(self, x_m: float, y_m: float) -> "LanePosition | None":
        """Nearest lane position to a point; None if there is no lane."""
        if not len(self.segments):
            return None
        k, at_m, left_m, away_m = _nearest(self.segments, x_m, y_m)
        return LanePosition(self.names[k], at_m, left_m, away_m)


@dataclass(frozen=True, slots=True)
class LanePosition:
    """Position of a point relative to a lane.

    Attributes:
        at_m: Station.
        left_m: Offset to the left of the lane's centre line.
        away_m: Distance from the centre line.
    """

    lane: str
    at_m: float
    left_m: float
    away_m: float


@dataclass(frozen=True, slots=True)
class Route:
    """Lanes in the order of travel.

    Attributes:
        lanes: Names of the lanes.
        starts_m: Station at the start of each lane; 0 at the first.
        end_m: Station at the end of the last one.
        dead_end: Whether the network ends there.
    """

    lanes: tuple[str, ...]
    starts_m: tuple[float, ...]
    end_m: float
    dead_end: bool


def project_on_lane(line: lane_geometry.LaneLine, x_m: float, y_m: float) -> LanePosition:
    """Nearest position on one lane to a point."""
    _, at_m, left_m, away_m = _nearest(_segments(line, 0), x_m, y_m)
    return LanePosition(line.lane.name, at_m, left_m, away_m)


def _segments(line: lane_geometry.LaneLine, number: int) -> se3.Array:
    points = np.asarray(line.lane.center_m)[:, :2]
    at = np.asarray(line.at_m[:-1])
    return np.column_stack([points[:-1], np.diff(points, axis=0), at, np.full(len(at), number)])


def _nearest(segments: se3.Array, x_m: float, y_m: float) -> tuple[int, float, float, float]:
    """Number of the nearest lane, station, offset to its left, and distance."""
    x, y, sx, sy, at, number = segments.T
    dx, dy = x_m - x, y_m - y
    squared = sx * sx + sy * sy
    share = np.clip((dx * sx + dy * sy) / squared, 0.0, 1.0)
    ox, oy = dx - share * sx, dy - share * sy
    # Rounding to micrometres makes the first of equally near lanes win.
    k = int(np.argmin(np.round(np.sqrt(ox * ox + oy * oy), 6)))
    span = math.sqrt(float(squared[k]))
    left = float(sx[k] * dy[k] - sy[k] * dx[k]) / span
    away = math.sqrt(float(ox[k] * ox[k] + oy[k] * oy[k]))
    return int(number[k]), float(at[k] + share[k] * span), left, away


def draw_route(graph: LaneGraph, given: Sequence[str], length_m: float, rng: streams.Rng) -> Route:
    """Extend the given lanes by drawn ones to a length, or to the end of the network."""
    lanes = list(given)
    ends = list(accumulate(graph.lines[name].length_m for name in lanes))
    ways = graph.successors(lanes[-1])
    while ends[-1] < length_m and ways:
        lanes.append(ways[int(rng.integers(len(ways)))])
        ends.append(ends[-1] + graph.lines[lanes[-1]].length_m)
        ways = graph.successors(lanes[-1])
    return Route(tuple(lanes), (0.0, *ends[:-1]), ends[-1], dead_end=not ways)


def points_at(graph: LaneGraph, route: Route, stations_m: se3.Array) -> se3.Array:
    """Points [k, 3] of a route at stations [k]; beyond its ends it is straight."""
    lines = [graph.lines[name] for name in route.lanes]
    joined = np.concatenate(
        [np.asarray(line.lane.center_m)[k > 0 :] for k, line in enumerate(lines)]
    )
    at = np.concatenate(
        [
            start + np.asarray(line.at_m)[k > 0 :]
            for k, (line, start) in enumerate(zip(lines, route.starts_m, strict=True))
        ]
    )
    points = np.stack([np.interp(stations_m, at, joined[:, k]) for k in range(3)], axis=1)
    for end, inner, beyond in (
        (0, 1, np.minimum(stations_m - at[0], 0.0)),
        (-1, -2, np.maximum(stations_m - at[-1], 0.0)),
    ):
        way = (joined[end] - joined[inner]) / (at[end] - at[inner])
        points[:, :2] += beyond[:, None] * way[:2]
    return points


def lanes_through_point(
    graph: LaneGraph, stops: Sequence[str | tuple[float, float]], where: str
) -> tuple[str, ...]:
    """Find the lanes through stops, in order, with the fewest lanes between two of them.

    Args:
        graph: Graph of the driving lanes.
        stops: Names of lanes, or points ``(x, y)`` [m] on lanes.
        where: Path of the stops in error texts.

    Raises:
        ConfigError: a stop is on no lane, or cannot be reached from the previous one.
    """
    names = [_find_lane(graph, stop, f"{where}[{k}]") for k, stop in enumerate(stops)]
    lanes = [names[0]]
    for k, (one, other) in enumerate(pairwise(names), 1):
        if one == other:
            continue
        way = _shortest_path(graph, one, other)
        if not way:
            after = ", ".join(graph.successors(one)) or "none: the network ends there"
            raise errors.ConfigError(
                f"{where}[{k}]: the route leaves the lanes: none lead from '{one}' to '{other}'; "
                f"after '{one}' comes {after}"
            )
        lanes += way
    return tuple(lanes)


def _find_lane(graph: LaneGraph, stop: str | tuple[float, float], where: str) -> str:
    if isinstance(stop, str):
        if stop not in graph.lines:
            known = sorted(graph.lines)
            raise errors.ConfigError(
                f"{where}: there is no driving lane '{stop}'; expected one of {', '.join(known)}"
                f"{errors.did_you_mean(stop, known)}"
            )
        return stop
    place = graph.nearest(*stop)
    if place is None:
        raise errors.ConfigError(f"{where}: the scene has no driving lanes")
    if place.away_m > graph.lines[place.lane].half_width_m(place.at_m):
        raise errors.ConfigError(
            f"{where}: the route leaves the road: ({stop[0]:g}, {stop[1]:g}) is "
            f"{place.away_m:.1f} m from the middle of the nearest driving lane, '{place.lane}'; "
            "expected a point on a lane"
        )
    return place.lane


def _shortest_path(graph: LaneGraph, start: str, goal: str) -> list[str]:
    """Fewest lanes after one up to another (breadth-first search); empty = unreachable."""
    came: dict[str, str] = {start: ""}
    row = [start]
    while row:
        found: list[str] = []
        for name in row:
            for after in graph.successors(name):
                if after not in came:
                    came[after] = name
                    found.append(after)
        if goal in came:
            way = [goal]
            while came[way[0]] != start:
                way.insert(0, came[way[0]])
            return way
        row = found
    return []
