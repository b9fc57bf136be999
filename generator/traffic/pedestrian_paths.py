"""Paths of pedestrians: along sidewalks, over crosswalks and around obstacles."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gen_data.core import lane_geometry, streams
from gen_data.core.se3 import Array, Vec3
from gen_data.traffic.lane_routes import LaneGraph, project_on_lane

GRID_M = 0.25
"""Distance between stations of a path."""
SHOULDER_M = 0.3
"""Half the width of a person, with a margin."""
BERTH_M, BERTH_ALONG_M = 0.42, 0.7
"""Distances of a person's centre from obstacles, sideways and lengthwise."""
JOIN_M = 12.0
"""Largest distance between the end of a crosswalk and its sidewalk."""
ASIDE = 0.35
"""Lateral displacement per length of path when people step aside."""
KERB_M = 0.3
"""Length of path over which the step at the kerb is spread."""


@dataclass(frozen=True, slots=True)
class Join:
    """Connection of a crosswalk's end to a sidewalk.

    Attributes:
        at_m: Station on the sidewalk.
        begins: Whether it is the crosswalk's start.
    """

    sidewalk: str
    at_m: float
    crosswalk: str
    begins: bool


@dataclass(frozen=True, slots=True)
class Passage:
    """A crosswalk on a path, between two stations of the path."""

    crosswalk: str
    from_m: float
    to_m: float
    forward: bool
    length_m: float


@dataclass(frozen=True, eq=False)
class Path:
    """A line with lateral bounds.

    Attributes:
        points_m: Points [k, 3], ``GRID_M`` apart.
        right_m, left_m: Smallest and largest offset to the left of the line [k].
        end_m: Station at which people stop; ``inf`` = the path is long enough.
    """

    points_m: Array
    right_m: Array
    left_m: Array
    passages: tuple[Passage, ...]
    end_m: float


@dataclass(frozen=True, eq=False)
class WalkNetwork:
    """Sidewalks and crosswalks with their connections and lateral bounds.

    Attributes:
        joins: Connections by sidewalk, in order.
        room: By lane: stations, and smallest and largest offset to the left there.
    """

    sidewalks: LaneGraph
    crosswalks: LaneGraph
    joins: Mapping[str, tuple[Join, ...]]
    room: Mapping[str, tuple[Array, Array, Array]]


def make_walk_network(sidewalks: LaneGraph, crosswalks: LaneGraph, obstacles: Array) -> WalkNetwork:
    """Build the network of sidewalks and crosswalks.

    Args:
        sidewalks: Graph of the sidewalks.
        crosswalks: Graph of the crosswalks.
        obstacles: Boxes of obstacles [b, 6]: centre, half extents, cosine and sine of the yaw.
    """
    joins: dict[str, list[Join]] = {}
    for name in sorted(crosswalks.lines):
        points = crosswalks.lines[name].lane.center_m
        for begins, end, inner in ((True, points[0], points[1]), (False, points[-1], points[-2])):
            join = _find_join(sidewalks, name, begins, end, inner)
            if join is not None:
                joins.setdefault(join.sidewalk, []).append(join)
    return WalkNetwork(
        sidewalks,
        crosswalks,
        {name: tuple(sorted(found, key=lambda j: j.at_m)) for name, found in joins.items()},
        {
            name: _lateral_bounds(line, obstacles)
            for graph in (sidewalks, crosswalks)
            for name, line in sorted(graph.lines.items())
        },
    )


def _find_join(
    sidewalks: LaneGraph, crosswalk: str, begins: bool, end: Vec3, inner: Vec3
) -> Join | None:
    span = math.dist(end[:2], inner[:2])
    x, y = (end[k] + 2.0 * (end[k] - inner[k]) / span for k in range(2))
    place = sidewalks.nearest(x, y)
    if place is None or place.away_m > JOIN_M:
        return None
    return Join(place.lane, place.at_m, crosswalk, begins)


def _lateral_bounds(line: lane_geometry.LaneLine, boxes: Array) -> tuple[Array, Array, Array]:
    """Lateral bounds on a lane: people pass obstacles on the wider side."""
    count = max(2, math.ceil(line.length_m / GRID_M) + 1)
    at = np.linspace(0.0, line.length_m, count)
    half = max(0.5 * line.lane.width_m - SHOULDER_M, 0.0)
    right, left = np.full(count, -half), np.full(count, half)
    points = np.asarray(line.lane.center_m)[:, :2]
    low, high = points.min(axis=0) - half - 2.0, points.max(axis=0) + half + 2.0
    near = ((boxes[:, :2] > low) & (boxes[:, :2] < high)).all(axis=1)
    for x, y, hx, hy, c, s in boxes[near].tolist():
        corners = [
            project_on_lane(line, x + c * a - s * b, y + s * a + c * b)
            for a in (-hx, hx)
            for b in (-hy, hy)
        ]
        starts, ends = min(p.at_m for p in corners), max(p.at_m for p in corners)
        l0, l1 = min(p.left_m for p in corners), max(p.left_m for p in corners)
        beside = (at > starts - BERTH_ALONG_M) & (at < ends + BERTH_ALONG_M)
        if max(p.away_m for p in corners) > half + 4.0:
            continue
        # Pass on the side with more room.
        if l0 + l1 > 0.0:
            left[beside] = np.minimum(left[beside], l0 - BERTH_M)
        else:
            right[beside] = np.maximum(right[beside], l1 + BERTH_M)
    return at, right, left


@dataclass
class _Line:
    points: list[Vec3]
    right: list[float]
    left: list[float]
    length_m: float = 0.0

    def add(self, point: Vec3, right_m: float, left_m: float) -> None:
        if self.points:
            step = math.dist(self.points[-1][:2], point[:2])
            if step < 1e-3:
                return
            self.length_m += step
        self.points.append(point)
        self.right.append(right_m)
        self.left.append(left_m)


def draw_path(
    walks: WalkNetwork,
    lane: str,
    at_m: float,
    forward: bool,
    length_m: float,
    crossing: float,
    rng: streams.Rng,
) -> Path:
    """Draw a path from a position on a sidewalk or crosswalk.

    Args:
        walks: Network of sidewalks and crosswalks.
        lane: Lane on which it starts.
        at_m: Station on that lane.
        forward: Whether it starts in the lane's direction.
        length_m: Wanted length; the path ends earlier where the network ends.
        crossing: Probability of taking a crosswalk.
        rng: Generator of the draws at every crosswalk and fork.
    """
    line = _Line([], [], [])
    passages: list[Passage] = []
    if lane in walks.crosswalks.lines:
        whole = walks.crosswalks.lines[lane]
        goal = whole.length_m if forward else 0.0
        _append_lane(line, walks, whole, at_m, goal)
        passages.append(Passage(lane, 0.0, line.length_m, forward, whole.length_m))
        place = _leave_crosswalk(line, walks, lane, forward, rng)
    else:
        place = (lane, at_m, forward)
    while place is not None and line.length_m < length_m:
        left_m = length_m - line.length_m
        place = _append_next(line, walks, place, left_m, crossing, passages, rng)
    return _resample_path(line, passages, length_m)


def _append_next(
    line: _Line,
    walks: WalkNetwork,
    place: tuple[str, float, bool],
    left_m: float,
    crossing: float,
    passages: list[Passage],
    rng: streams.Rng,
) -> tuple[str, float, bool] | None:
    """Append a section of sidewalk, and a crosswalk if taken; return the next position."""
    name, at_m, forward = place
    here = walks.sidewalks.lines[name]
    joins = walks.joins.get(name, ())
    for join in joins if forward else reversed(joins):
        gone = join.at_m - at_m if forward else at_m - join.at_m
        if 0.5 < gone < left_m and float(rng.uniform()) < crossing:
            _append_lane(line, walks, here, at_m, join.at_m)
            return _cross_road(line, walks, join, passages, rng)
    if left_m < (here.length_m - at_m if forward else at_m):
        _append_lane(line, walks, here, at_m, at_m + left_m if forward else at_m - left_m)
        return None
    _append_lane(line, walks, here, at_m, here.length_m if forward else 0.0)
    if forward:
        ways = walks.sidewalks.successors(name)
    else:
        ways = tuple(n for n in walks.sidewalks.predecessors.get(name, ()))
    if not ways:
        return None
    after = ways[int(rng.integers(len(ways)))]
    return after, 0.0 if forward else walks.sidewalks.lines[after].length_m, forward


def _cross_road(
    line: _Line, walks: WalkNetwork, join: Join, passages: list[Passage], rng: streams.Rng
) -> tuple[str, float, bool] | None:
    whole = walks.crosswalks.lines[join.crosswalk]
    start = 0.0 if join.begins else whole.length_m
    kerb = whole.pose(start).translation_m
    _append_kerb(line, line.points[-1], kerb)
    from_m = line.length_m
    _append_lane(line, walks, whole, start, whole.length_m - start)
    passages.append(Passage(join.crosswalk, from_m, line.length_m, join.begins, whole.length_m))
    return _leave_crosswalk(line, walks, join.crosswalk, join.begins, rng)


def _leave_crosswalk(
    line: _Line, walks: WalkNetwork, crosswalk: str, forward: bool, rng: streams.Rng
) -> tuple[str, float, bool] | None:
    """Append the path from a crosswalk's end to the sidewalk; draw one of its directions."""
    for joins in walks.joins.values():
        for join in joins:
            if join.crosswalk == crosswalk and join.begins != forward:
                place = walks.sidewalks.lines[join.sidewalk].pose(join.at_m).translation_m
                _append_kerb(line, line.points[-1], place)
                return join.sidewalk, join.at_m, bool(rng.uniform() < 0.5)
    return None


def _append_lane(
    line: _Line, walks: WalkNetwork, lane: lane_geometry.LaneLine, start_m: float, end_m: float
) -> None:
    """Append a section of a lane, backwards if it ends before it starts."""
    way = 1.0 if end_m >= start_m else -1.0
    at, right, left = walks.room[lane.lane.name]
    inner = [s for s in at.tolist() if min(start_m, end_m) < s < max(start_m, end_m)]
    for s in (start_m, *(inner if way > 0 else reversed(inner)), end_m):
        k = min(int(s / lane.length_m * (len(at) - 1) + 0.5), len(at) - 1)
        low, high = float(right[k]), float(left[k])
        if way < 0:
            low, high = -high, -low
        line.add(lane.pose(s).translation_m, low, high)


def _append_kerb(line: _Line, start: Vec3, end: Vec3) -> None:
    """Append the path between a sidewalk and the end of a crosswalk, with the step at the kerb.

    The ground between falls gently towards the kerb, to 0.7 of the sidewalk's height over the road.
    """
    span = math.dist(start[:2], end[:2])
    down = start[2] > end[2]
    road, walk = (end, start) if down else (start, end)
    top = road[2] + 0.7 * (walk[2] - road[2])
    share = min(KERB_M / max(span, 1e-6), 1.0)
    t = 1.0 - share if down else share
    x, y = (a + t * (b - a) for a, b in zip(start[:2], end[:2], strict=True))
    line.add((x, y, top), -0.5, 0.5)
    line.add(end, -0.5, 0.5)


def _resample_path(line: _Line, passages: Sequence[Passage], length_m: float) -> Path:
    """Resample the path at even stations; it ends where nobody fits."""
    points = np.array(line.points)
    if len(points) == 1:
        points = np.concatenate([points, points + np.array([0.01, 0.0, 0.0])])
        line.right, line.left = line.right * 2, line.left * 2
    steps = np.diff(points[:, :2], axis=0)
    at = np.concatenate([[0.0], np.cumsum(np.sqrt(steps[:, 0] ** 2 + steps[:, 1] ** 2))])
    end_m = min(float(at[-1]), length_m)
    grid = GRID_M * np.arange(math.ceil(length_m / GRID_M) + 8)
    right, left = np.array(line.right), np.array(line.left)
    k = np.minimum(np.searchsorted(at, grid), len(at) - 1)
    blocked = np.flatnonzero(right[k] > left[k])
    if len(blocked):
        end_m = min(end_m, max(GRID_M * float(blocked[0]) - 1.0, 0.0))
    low, high = _limit_slope(right[k]), -_limit_slope(-left[k])
    low, high = np.minimum(low, np.maximum(high, right[k])), np.maximum(high, right[k])
    return Path(
        np.stack([np.interp(grid, at, points[:, c]) for c in range(3)], axis=1),
        low,
        high,
        tuple(passages),
        end_m if end_m < length_m - 1e-6 else math.inf,
    )


def _limit_slope(least_m: Array) -> Array:
    """Limit the slope of lower bounds along a path to the slope of stepping aside."""
    eased: Array = least_m.copy()
    for k in range(1, len(eased)):
        eased[k] = max(eased[k], eased[k - 1] - ASIDE * GRID_M)
    for k in range(len(eased) - 2, -1, -1):
        eased[k] = max(eased[k], eased[k + 1] - ASIDE * GRID_M)
    return eased
