"""Conflict zones: where lanes cross, diverge and merge, and where crosswalks cross them."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from gen_data.core.lane_geometry import LaneLine
from gen_data.core.se3 import Array, Vec3
from gen_data.traffic.lane_routes import LaneGraph

_STEP_M = 0.5
_SAME_M = 0.5
"""Lanes whose ends are nearer than this start or end together."""


@dataclass(frozen=True, slots=True)
class Overlap:
    """Two lanes that vehicles cannot use side by side.

    Attributes:
        kind: ``part``: they start together; ``meet``: they end together; ``cross``.
        own_m, other_m: Stations between which they are too close.
    """

    kind: Literal["part", "meet", "cross"]
    own_m: tuple[float, float]
    other_m: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Zone:
    """Intersection of a lane and a crosswalk.

    Attributes:
        enter_m, leave_m: Stations on the driving lane.
        at_m: Station on the crosswalk.
        width_m: Width of the driving lane.
    """

    crosswalk: str
    enter_m: float
    leave_m: float
    at_m: float
    width_m: float


def find_overlaps(
    graph: LaneGraph, widths_m: Mapping[str, float], spare_m: float = 0.4
) -> dict[tuple[str, str], Overlap]:
    """Find all pairs of overlapping lanes across junctions, in both orders.

    Args:
        graph: Graph of the driving lanes.
        widths_m: Width of the widest vehicle on each used lane; others are ignored.
        spare_m: Smallest distance between vehicles.
    """
    names = [name for name in sorted(widths_m) if graph.lines[name].lane.junction]
    sampled = {name: _sample(graph.lines[name]) for name in names}
    found: dict[tuple[str, str], Overlap] = {}
    for k, one in enumerate(names):
        for other in names[k + 1 :]:
            apart_m = 0.5 * (widths_m[one] + widths_m[other]) + spare_m
            overlap = _find_overlap(sampled[one], sampled[other], apart_m)
            if overlap is not None:
                found[one, other] = overlap
                found[other, one] = Overlap(overlap.kind, overlap.other_m, overlap.own_m)
    return found


def crosswalk_zones(
    graph: LaneGraph, used: Iterable[str], crosswalks: LaneGraph
) -> dict[str, tuple[Zone, ...]]:
    """Find the crosswalks on each used driving lane, in order."""
    made: dict[str, tuple[Zone, ...]] = {}
    for name in sorted(used):
        line = graph.lines[name]
        found = [
            zone
            for walk in sorted(crosswalks.lines)
            if (zone := _find_zone(line, crosswalks.lines[walk])) is not None
        ]
        if found:
            made[name] = tuple(sorted(found, key=lambda zone: zone.enter_m))
    return made


def heading(points: tuple[Vec3, ...], k: int) -> tuple[float, float]:
    """Unit direction of a lane at its first (0) or last (-1) point."""
    (x0, y0, _), (x1, y1, _) = (points[0], points[1]) if k == 0 else (points[-2], points[-1])
    length = math.hypot(x1 - x0, y1 - y0)
    return (x1 - x0) / length, (y1 - y0) / length


def _sample(line: LaneLine) -> tuple[Array, Array]:
    """Sample a lane: even stations [k] and points [k, 2]."""
    count = max(2, math.ceil(line.length_m / _STEP_M) + 1)
    at = np.linspace(0.0, line.length_m, count)
    points = np.asarray(line.lane.center_m)
    return at, np.stack([np.interp(at, line.at_m, points[:, k]) for k in range(2)], axis=1)


def _find_overlap(
    one: tuple[Array, Array], other: tuple[Array, Array], apart_m: float
) -> Overlap | None:
    (at_a, a), (at_b, b) = one, other
    if (a.min(axis=0) - apart_m > b.max(axis=0)).any():
        return None
    if (b.min(axis=0) - apart_m > a.max(axis=0)).any():
        return None
    delta = a[:, None] - b[None]
    near = delta[..., 0] * delta[..., 0] + delta[..., 1] * delta[..., 1] < apart_m * apart_m
    if not near.any():
        return None
    starts = math.dist(a[0], b[0]) < _SAME_M
    ends = math.dist(a[-1], b[-1]) < _SAME_M
    on_a, on_b = np.flatnonzero(near.any(axis=1)), np.flatnonzero(near.any(axis=0))
    return Overlap(
        "part" if starts else "meet" if ends else "cross",
        (float(at_a[on_a[0]]), float(at_a[on_a[-1]])),
        (float(at_b[on_b[0]]), float(at_b[on_b[-1]])),
    )


def _find_zone(line: LaneLine, crosswalk: LaneLine) -> Zone | None:
    """Intersection of a driving lane and a crosswalk's centre line; None without one."""
    lane = crosswalk.lane
    if abs(lane.center_m[0][2] - line.lane.center_m[0][2]) > 3.0:
        return None
    at_a, a = _sample(line)
    at_b, b = _sample(crosswalk)
    delta = a[:, None] - b[None]
    squared = delta[..., 0] * delta[..., 0] + delta[..., 1] * delta[..., 1]
    k, j = np.unravel_index(int(np.argmin(squared)), squared.shape)
    if squared[k, j] > _SAME_M * _SAME_M:
        return None
    half = 0.5 * lane.width_m
    at = float(at_a[k])
    return Zone(lane.name, at - half, at + half, float(at_b[j]), line.lane.width_m)
