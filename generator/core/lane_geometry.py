"""Geometry of lanes: poses along the centre line, and borders."""

import math
from bisect import bisect_right
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from gen_data.core.bounded_cache import ObjectCache
from gen_data.core.scene import Lane
from gen_data.core.se3 import SE3, Array, Vec3

Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")
_ARC_LENGTHS: ObjectCache[tuple[float, ...]] = ObjectCache(1024)
"""Of the points of the latest lanes: a street has about a hundred."""
_BORDERS: ObjectCache[tuple["LaneBorder", ...]] = ObjectCache(16)
"""Of the latest streets."""
MEETING_M = 0.25
"""Borders with ends nearer to each other than this are the same."""


@dataclass(frozen=True)
class LaneLine:
    """A lane's centre line by arc length.

    Attributes:
        at_m: Arc length of each point, from 0.
    """

    lane: Lane
    at_m: tuple[float, ...] = field(init=False)

    def __post_init__(self) -> None:
        """Measure the line, cached by lane: two dozen randomizers use the same lane."""
        arc_m = _ARC_LENGTHS.get(self.lane, lambda: _arc_lengths_m(self.lane))
        object.__setattr__(self, "at_m", arc_m)

    @property
    def length_m(self) -> float:
        """Length of the lane."""
        return self.at_m[-1]

    def half_width_m(self, at_m: float) -> float:
        """Half of the lane's width at an arc length, clamped to the lane."""
        if not self.lane.widths_m:
            return 0.5 * self.lane.width_m
        return 0.5 * float(np.interp(at_m, self.at_m, self.lane.widths_m))

    def pose(self, at_m: float, left_m: float = 0.0) -> SE3:
        """``T_world_place``: on the ground, X in the direction of travel, Z up.

        It is ``left_m`` to the left of the centre line at an arc length, clamped to the lane.
        """
        points = self.lane.center_m
        k = min(max(bisect_right(self.at_m, at_m) - 1, 0), len(points) - 2)
        (ax, ay, az), (bx, by, bz) = points[k], points[k + 1]
        span_m = self.at_m[k + 1] - self.at_m[k]
        t = min(max((at_m - self.at_m[k]) / span_m, 0.0), 1.0)
        yaw = math.atan2(by - ay, bx - ax)
        x, y, z = ax + t * (bx - ax), ay + t * (by - ay), az + t * (bz - az)
        return SE3.about_z(yaw, (x - left_m * math.sin(yaw), y + left_m * math.cos(yaw), z))


def _arc_lengths_m(lane: Lane) -> tuple[float, ...]:
    points = np.asarray(lane.center_m, dtype=np.float64)
    steps = np.sqrt(np.sum(np.diff(points, axis=0) ** 2, axis=1))
    return tuple(np.concatenate([[0.0], np.cumsum(steps)]).tolist())


def pose_on_lane(
    T_world_place: SE3,
    lane: Lane,
    bounds_m: tuple[Vec3, Vec3],
    facing: Literal["along", "left"],
    turn_rad: float = 0.0,
) -> SE3:
    """``T_world_body`` of something whose lowest point stands on a place of a lane.

    Its middle is at the place, as ``LaneLine.pose`` gives it; on a ``frontage``, its front is. Its
    fronts point to ``facing`` there, turned by ``turn_rad``; its bounds include the scale.
    """
    (x0, y0, z0), (x1, y1, _) = bounds_m
    if facing == "left":
        turn_rad += 0.5 * math.pi
    anchor = x1 if lane.kind == "frontage" else 0.5 * (x0 + x1)
    return T_world_place @ SE3.about_z(turn_rad) @ SE3((-anchor, -0.5 * (y0 + y1), -z0))


@dataclass(frozen=True, slots=True)
class LaneBorder:
    """The line at one side of driving lanes, painted or not.

    Attributes:
        name: Lane and side that it belongs to: ``main/forward0:left``; further parts of a line
            that is cut where a lane has no width end in ``/1``, ``/2``, ...
        kind: ``lane``: between lanes of the same direction; ``road``: between lanes of opposite
            directions; ``edge``: the edge of the carriageway.
        points_m: World, on the ground, in the direction of travel of the lane it is named by.
    """

    name: str
    kind: Literal["lane", "road", "edge"]
    points_m: tuple[Vec3, ...]


def lane_borders(lanes: tuple[Lane, ...]) -> tuple[LaneBorder, ...]:
    """Borders of all driving lanes outside junctions, each once, in the order of the lanes."""
    return _BORDERS.get(lanes, lambda: _find_borders(lanes))


def _find_borders(lanes: tuple[Lane, ...]) -> tuple[LaneBorder, ...]:
    driving = [lane for lane in lanes if lane.kind == "driving" and not lane.junction]
    borders: list[LaneBorder] = []
    named = {lane.name: lane for lane in driving}
    alone: dict[Side, list[tuple[Vec3, Vec3]]] = {"left": [], "right": []}
    for lane in driving:
        for side in SIDES:
            if side == "right" and lane.right:
                continue
            line = border_line(lane, side)
            kind: Literal["lane", "road", "edge"] = "lane"
            if not (lane.left if side == "left" else lane.right):
                kind = "edge"
                ends = (line[-1], line[0])
                if _is_among(ends, alone[side]):
                    continue
                alone[side].append((line[0], line[-1]))
                if _is_met(lane, driving, side, ends):
                    kind = "road"
            parts = [line] if kind != "lane" else _parts_between(named.get(lane.left), lane, line)
            names = (f"{lane.name}:{side}" + (f"/{k}" if k else "") for k in range(len(parts)))
            borders += (LaneBorder(n, kind, part) for n, part in zip(names, parts, strict=True))
    return tuple(borders)


def _parts_between(
    left: Lane | None, right: Lane, line: tuple[Vec3, ...]
) -> list[tuple[Vec3, ...]]:
    """Parts of the line between two lanes, without doubles at a lane that has no width there.

    Such a lane's outer border is the edge of the next one; between two others it has none.
    """
    if left is None or not (left.widths_m or right.widths_m):
        return [line]
    gone = (half_widths_m(right) < 0.5 * MEETING_M) & (not right.right)
    if len(left.center_m) == len(line):
        gone = gone | (half_widths_m(left) < 0.5 * MEETING_M)
    steps = ~(gone[:-1] & gone[1:])
    ends = np.flatnonzero(np.diff(steps, prepend=False, append=False))
    return [line[a : b + 1] for a, b in ends.reshape(-1, 2).tolist()]


def border_line(lane: Lane, side: Side) -> tuple[Vec3, ...]:
    """The points of one side of a lane, as many as its centre line has."""
    sign = 1.0 if side == "left" else -1.0
    center = np.asarray(lane.center_m, dtype=np.float64)
    half_m = sign * half_widths_m(lane)
    points = center + half_m[:, None] * left_normals(center)
    points[:, 2] += half_m * np.asarray(lane.banks or lane.bank)
    return tuple((x, y, z) for x, y, z in (np.round(points, 6) + 0.0).tolist())


def half_widths_m(lane: Lane) -> Array:
    """Half of a lane's width at each of its points [n]."""
    return np.broadcast_to(0.5 * np.asarray(lane.widths_m or lane.width_m), len(lane.center_m))


def left_normals(line_m: Array) -> Array:
    """Level unit vectors [n, 3] to the left of a line [n, 3] at each of its points."""
    steps = np.diff(line_m[:, :2], axis=0)
    steps = steps / np.sqrt((steps * steps).sum(axis=1, keepdims=True))
    along = np.concatenate([steps[:1], steps[:-1] + steps[1:], steps[-1:]])
    along = along / np.sqrt((along * along).sum(axis=1, keepdims=True))
    return np.column_stack([-along[:, 1], along[:, 0], np.zeros(len(along))])


def _is_met(lane: Lane, driving: list[Lane], side: Side, ends: tuple[Vec3, Vec3]) -> bool:
    """Whether an oncoming lane has the same border on the same side."""
    for other in driving:
        if other.road == lane.road and not (other.left if side == "left" else other.right):
            line = border_line(other, side)
            if other.name != lane.name and _is_among((line[0], line[-1]), [ends]):
                return True
    return False


def _is_among(ends: tuple[Vec3, Vec3], others: list[tuple[Vec3, Vec3]]) -> bool:
    return any(
        math.dist(ends[0], a) < MEETING_M and math.dist(ends[1], b) < MEETING_M for a, b in others
    )
