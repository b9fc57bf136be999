"""Lanes of a street as roads of OpenDRIVE: reference lines, lanes by number, heights and links.

Lanes of one road that run side by side share a reference line, the border between the directions.
All others, such as ways through a junction and bays, are roads with one lane to the right of their
line.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from gen_data.core.scene import Lane, LaneKind
from gen_data.core.se3 import Array

TYPES: Mapping[LaneKind, str] = {
    "driving": "driving", "bicycle": "biking", "parking": "parking", "sidewalk": "sidewalk",
}  # fmt: skip
"""Lane types of the standard by kind; lanes of other kinds are places for objects."""
TOLERANCE_M, SQUARE = 1e-3, 2e-4
"""Lanes side by side are at one distance within this, and square to the line within this."""
STRAIGHT_RAD = 1e-7
NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)


@dataclass(frozen=True, eq=False, slots=True)
class Strip:
    """A strip along a road; borders are distances to the left of the reference line.

    Attributes:
        lane: Its lane; None = the ground between two lanes.
        forward: Whether the lane runs along the reference line.
        low_m, high_m: Right and left border.
        z_low_m, z_high_m: Heights of its borders at each point [n].
    """

    lane: Lane | None
    forward: bool
    low_m: float
    high_m: float
    z_low_m: Array
    z_high_m: Array


@dataclass(frozen=True, eq=False, slots=True)
class Geometry:
    """A piece of a reference line from a point on.

    Attributes:
        u, v: Coefficients of a cubic in its frame, by the share of its length; empty = straight.
    """

    s_m: float
    x_m: float
    y_m: float
    heading_rad: float
    length_m: float
    u: tuple[float, ...] = ()
    v: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class RoadPlan:
    """One road.

    Attributes:
        number: Id in the file.
        name: Name of the element that its lanes belong to.
        junction: Whether it leads through a junction.
        line_m: Points of the reference line [n, 2].
        headings_rad: Its direction at the points [n].
        left, right: Strips on both sides, from the reference line outwards.
        left_hand: Whether its traffic keeps left.
    """

    number: int
    name: str
    junction: bool
    line_m: Array
    headings_rad: Array
    left: tuple[Strip, ...]
    right: tuple[Strip, ...]
    left_hand: bool
    geometry: tuple[Geometry, ...] = field(init=False)
    s_m: Array = field(init=False)

    def __post_init__(self) -> None:
        """Fit the curves."""
        pieces, s_m = _fit(self.line_m, self.headings_rad)
        object.__setattr__(self, "geometry", pieces)
        object.__setattr__(self, "s_m", s_m)

    @property
    def z_m(self) -> Array:
        """Heights of the reference line [n]."""
        return self.right[0].z_high_m if self.right else self.left[0].z_low_m

    def numbered(self) -> Iterator[tuple[int, Strip]]:
        """Strips by lane number: positive to the left."""
        yield from enumerate(self.left, 1)
        yield from ((-k, strip) for k, strip in enumerate(self.right, 1))

    def border_m(self, t_m: float) -> Array:
        """Points [n, 2] at a distance to the left of the line."""
        normals = np.stack([-np.sin(self.headings_rad), np.cos(self.headings_rad)], axis=1)
        return np.asarray(self.line_m + t_m * normals)


def plan_roads(lanes: Iterable[Lane]) -> tuple[RoadPlan, ...]:
    """Roads of all lanes that the format has types for, numbered from 1."""
    known = [lane for lane in lanes if lane.kind in TYPES and len(lane.center_m) > 1]
    plans: list[RoadPlan] = []
    for road in dict.fromkeys(lane.road for lane in known):
        waiting = _with_corners([lane for lane in known if lane.road == road])
        waiting.sort(key=lambda lane: lane.kind != "driving")
        while waiting:
            plan, used = _plan(len(plans) + 1, waiting)
            plans.append(plan)
            waiting = [lane for lane in waiting if lane.name not in used]
    return tuple(plans)


def _with_corners(lanes: list[Lane]) -> list[Lane]:
    """Lanes of one element; sidewalks around the corners of a junction belong to it."""
    driving = [lane.junction for lane in lanes if lane.kind == "driving"]
    return [replace(lane, junction=True) for lane in lanes] if driving and all(driving) else lanes


@dataclass(frozen=True, eq=False, slots=True)
class _Beside:
    """A lane next to the base of a road: points along the base, and where they are."""

    lane: Lane
    forward: bool
    points_m: Array
    left_m: float


def _plan(number: int, waiting: Sequence[Lane]) -> tuple[RoadPlan, set[str]]:
    """The road of the first lane and of the ones next to it, and the names of these lanes."""
    base = waiting[0]
    center = np.asarray(base.center_m)
    normals = _normals(center)
    own = _Beside(base, True, center, 0.0)
    row = [own]
    if base.kind == "driving" and not base.junction:
        row += [b for lane in waiting[1:] if (b := _beside(lane, center, normals)) is not None]
    if len(row) > 1:
        low, high = min(row, key=lambda b: b.left_m), max(row, key=lambda b: b.left_m)
        across = (high.points_m - low.points_m)[:, :2]
        normals = across / np.linalg.norm(across, axis=1, keepdims=True)
    left_hand = _keeps_left(row)
    inner_m = _reference_m(row, left_hand)
    side = [b for b in row if _is_on_its_side(b, inner_m, left_hand)] or [own]
    right = _strips([b for b in side if b.left_m < inner_m], inner_m, -1)
    left = _strips([b for b in side if b.left_m > inner_m], inner_m, 1)
    line = center[:, :2] + inner_m * normals
    headings = np.unwrap(np.arctan2(-normals[:, 0], normals[:, 1]))
    plan = RoadPlan(number, base.road, base.junction, line, headings, left, right, left_hand)
    used = {strip.lane.name for _, strip in plan.numbered() if strip.lane is not None}
    return plan, used


def _normals(center: Array) -> Array:
    """Unit vectors [n, 2] to the left of a line; at its ends, its turn goes on."""
    inner = np.unwrap(np.arctan2(*np.diff(center[:, :2], axis=0).T[::-1]))
    turn = np.diff(inner, prepend=inner[:1], append=inner[-1:])
    if len(inner) > 1:
        turn[[0, -1]] = turn[[1, -2]]
    headings = np.concatenate([inner - 0.5 * turn[:-1], inner[-1:] + 0.5 * turn[-1:]])
    return np.stack([-np.sin(headings), np.cos(headings)], axis=1)


def _beside(lane: Lane, center: Array, normals: Array) -> _Beside | None:
    """The lane if it runs along a line, at one distance."""
    if lane.junction or len(lane.center_m) != len(center):
        return None
    for forward in (True, False):
        points = np.asarray(lane.center_m)[:: 1 if forward else -1]
        offset = (points - center)[:, :2]
        away_m = np.linalg.norm(offset, axis=1)
        left_m = (offset * normals).sum(axis=1)
        even = np.ptp(away_m) < TOLERANCE_M and away_m.min() > TOLERANCE_M
        if even and (np.abs(left_m) > (1.0 - SQUARE) * away_m).all():
            return _Beside(lane, forward, points, float(np.copysign(away_m.mean(), left_m[0])))
    return None


def _keeps_left(row: Sequence[_Beside]) -> bool:
    """Whether oncoming driving lanes are to the right."""
    ways: dict[bool, list[float]] = {True: [], False: []}
    for one in row:
        if one.lane.kind == "driving":
            ways[one.forward].append(one.left_m)
    return bool(ways[True] and ways[False]) and max(ways[False]) < min(ways[True])


def _reference_m(row: Sequence[_Beside], left_hand: bool) -> float:
    """Distance of the reference line from the base: the inner border of the forward lanes."""
    kind = row[0].lane.kind
    ends = [
        b.left_m + (-0.5 if left_hand else 0.5) * b.lane.width_m
        for b in row
        if b.forward and b.lane.kind == kind
    ]
    return min(ends) if left_hand else max(ends)


def _is_on_its_side(one: _Beside, inner_m: float, left_hand: bool) -> bool:
    """Whether a lane runs the way that lanes on its side do."""
    is_right = one.left_m < inner_m
    if one.lane.kind in ("sidewalk", "parking"):
        return one.forward == is_right
    return one.forward == (is_right != left_hand)


def _strips(row: Sequence[_Beside], inner_m: float, side: int) -> tuple[Strip, ...]:
    """Strips of one side (1 left, -1 right) from the reference line outwards."""
    made: list[Strip] = []
    edge_m = 0.0
    for one in sorted(row, key=lambda b: side * b.left_m):
        width_m, middle_m = one.lane.width_m, side * (one.left_m - inner_m)
        low, high = middle_m - 0.5 * width_m, middle_m + 0.5 * width_m
        if low < edge_m - TOLERANCE_M:
            continue
        bank = np.asarray(one.lane.banks[:: 1 if one.forward else -1] or one.lane.bank)
        rise = 0.5 * width_m * (bank if one.forward else -bank)
        z_low, z_high = one.points_m[:, 2] - rise, one.points_m[:, 2] + rise
        strip = _strip(one, side, low, high, (z_low, z_high))
        if low > edge_m + TOLERANCE_M:
            made.append(_gap(made[-1] if made else None, strip, side, edge_m))
        else:
            strip = _strip(one, side, edge_m, high, (z_low, z_high))
        made.append(strip)
        edge_m = high
    return tuple(made)


def _strip(one: _Beside, side: int, near_m: float, far_m: float, z: tuple[Array, Array]) -> Strip:
    low_m, high_m = (near_m, far_m) if side > 0 else (-far_m, -near_m)
    return Strip(one.lane, one.forward, low_m, high_m, *z)


def _gap(before: Strip | None, after: Strip, side: int, edge_m: float) -> Strip:
    """The ground between two strips, or between the reference line and the first one."""
    if side > 0:
        inner = after.z_low_m if before is None else before.z_high_m
        return Strip(None, True, edge_m, after.low_m, inner, after.z_low_m)
    inner = after.z_high_m if before is None else before.z_low_m
    return Strip(None, True, after.high_m, -edge_m, after.z_high_m, inner)


def _fit(line: Array, headings: Array) -> tuple[tuple[Geometry, ...], Array]:
    """Curves through points in given directions, and the arc lengths of the points."""
    pieces: list[Geometry] = []
    s_m = [0.0]
    for k in range(len(line) - 1):
        start, step = line[k], line[k + 1] - line[k]
        chord_m, direction = math.hypot(*step), math.atan2(step[1], step[0])
        before, after = (math.remainder(headings[k + i] - direction, math.tau) for i in (0, 1))
        here = s_m[-1], float(start[0]), float(start[1])
        if max(abs(before), abs(after)) < STRAIGHT_RAD:
            last = pieces[-1] if pieces else None
            if last and not last.u and abs(last.heading_rad - direction) < STRAIGHT_RAD:
                pieces[-1] = Geometry(
                    last.s_m, last.x_m, last.y_m, last.heading_rad, s_m[-1] + chord_m - last.s_m
                )
            else:
                pieces.append(Geometry(*here, direction, chord_m))
            s_m.append(s_m[-1] + chord_m)
            continue
        u, v, length_m = _hermite(chord_m, before, after)
        pieces.append(Geometry(*here, direction + before, length_m, u, v))
        s_m.append(s_m[-1] + length_m)
    return tuple(pieces), np.array(s_m)


def _hermite(
    chord_m: float, before: float, after: float
) -> tuple[tuple[float, ...], tuple[float, ...], float]:
    """A cubic over a chord, by directions against it, in the frame of its start; its length."""
    turn = after - before
    speed_m = chord_m * (0.5 * turn / math.sin(0.5 * turn) if abs(turn) > 1e-9 else 1.0)
    x, y = chord_m * math.cos(before), -chord_m * math.sin(before)
    du, dv = speed_m * math.cos(turn), speed_m * math.sin(turn)
    u = (0.0, speed_m, 3.0 * x - 2.0 * speed_m - du, speed_m + du - 2.0 * x)
    v = (0.0, 0.0, 3.0 * y - dv, dv - 2.0 * y)
    p = 0.5 * (NODES + 1.0)
    rates = (c[1] + 2.0 * c[2] * p + 3.0 * c[3] * p * p for c in (u, v))
    return u, v, float(0.5 * (WEIGHTS * np.hypot(*rates)).sum())
