"""Bends of roads in plan: arcs between clothoids, by the guidelines of road design.

Sources: FGSV, RASt 06 (town roads of 50 and 70 km/h: smallest radii 80 and 190 m, parameters of
clothoids 50 and 90 m, slope towards the outside from 250 and 700 m) and RAA 2008 (motorways EKA 2:
470 m, 160 m, 4000 m), both by bauformeln.de; RAL 2012: A^2 = R L, R / 3 <= A <= R; all three: cross
slopes from 2.5 to 6 %.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from itertools import pairwise

import numpy as np

from gen_data.roads.reference_line import Arc, Curve, Placed, ReferenceLine, Spiral

Bend = tuple[float, float, float, float]
"""Start of a bend [m], lengths of each of its two clothoids and of its arc [m], and its curvature
[1/m], positive to the left."""

RADIUS_MIN_M = 10.0
"""Smallest radius of built-up streets (RASt 06)."""
STRAIGHT_M = 12.0
"""Straight length at both ends of a road with bends: junctions meet on straights, and the relief is
level there."""
RULES = ((50.0, 80.0, 50.0, 250.0), (70.0, 190.0, 90.0, 700.0), (100.0, 470.0, 160.0, 4000.0))
"""From a speed on [km/h]: smallest radius, smallest parameter of a clothoid, and radius from which
on the slope may fall outwards [m]."""
BANKED_FROM_KM_H = 60.0
"""Streets with kerbs keep the cross slope of their straights."""
BANK_MIN, BANK_MAX = 0.025, 0.06
_SHORTEST_M = 0.1


def unpack(bends: Sequence[float]) -> Iterator[Bend]:
    """The bends in a row of numbers, as ids of assets have them."""
    columns = (bends[k::4] for k in range(4))
    yield from zip(*columns, strict=True)


def spiral_m(radius_m: float, speed_m_s: float) -> float:
    """Length of the clothoid between a straight and an arc: the shortest one of the guidelines."""
    rule = _rule(speed_m_s)
    parameter = max(radius_m / 3.0, min(rule[2] if rule else 0.0, radius_m))
    return parameter * parameter / radius_m


def bank(radius_m: float, speed_m_s: float) -> float:
    """Cross slope in an arc, towards its inside; 0 for slow streets and large radii.

    It falls with a power of the radius from 6 % at the smallest one to 2.5 %, as the straight lines
    of the guidelines' diagrams with logarithmic axes do.
    """
    rule = _rule(speed_m_s)
    if rule is None or 3.6 * speed_m_s < BANKED_FROM_KM_H or radius_m >= rule[3]:
        return 0.0
    share = math.log(max(radius_m / rule[1], 1.0)) / math.log(rule[3] / rule[1])
    return float(BANK_MAX * (BANK_MIN / BANK_MAX) ** share)


def _rule(speed_m_s: float) -> tuple[float, float, float, float] | None:
    return next((r for r in reversed(RULES) if 3.6 * speed_m_s >= r[0] - 0.5), None)


def lay_out(
    length_m: float, bends: Sequence[tuple[float, float]], speed_m_s: float
) -> tuple[float, ...]:
    """Places of bends along a road: each in the middle of an equal share of its length.

    Args:
        length_m: Length of the road.
        bends: Radius [m], positive to the left, and turn [rad] of each. Where its share of the road
            is too short, a bend turns less, and then has shorter clothoids or is left out.
        speed_m_s: Usual speed.

    Returns:
        The numbers of ``Bend``, one bend after the other.
    """
    share_m = max(length_m - 2.0 * STRAIGHT_M, 0.0) / max(len(bends), 1)
    row: list[float] = []
    for number, (signed_m, turn) in enumerate(bends):
        radius_m = abs(signed_m)
        # Both clothoids together turn by their length over the radius.
        spiral = min(spiral_m(radius_m, speed_m_s), 0.5 * share_m, abs(turn) * radius_m)
        if spiral < _SHORTEST_M:
            continue
        arc = min(abs(turn) * radius_m - spiral, share_m - 2.0 * spiral)
        middle = STRAIGHT_M + (number + 0.5) * share_m
        at = middle - spiral - 0.5 * arc
        row += [round(at, 3), round(spiral, 3), round(arc, 3), round(1.0 / signed_m, 9)]
    return tuple(row)


@lru_cache(maxsize=256)
def bent_line(length_m: float, curvature_per_m: float, bends: tuple[float, ...]) -> ReferenceLine:
    """A line from the origin along +X whose curvature is a constant plus the bends' curvature."""
    knots = [(0.0, curvature_per_m)]
    for start, spiral, arc, curvature in unpack(bends):
        ends = (start, start + spiral, start + spiral + arc, start + 2.0 * spiral + arc)
        changes = (0.0, curvature, curvature, 0.0)
        knots += [(s, curvature_per_m + k) for s, k in zip(ends, changes, strict=True)]
    knots.append((length_m, curvature_per_m))
    return ReferenceLine(tuple(_placed(knots)))


def _placed(knots: Iterable[tuple[float, float]]) -> Iterator[Placed]:
    """Curves with linear curvature between knots: arc lengths, and curvatures there."""
    at = (0.0, 0.0, 0.0)
    for (start, one), (end, other) in pairwise(knots):
        if end - start < 1e-6:
            continue
        curve: Curve = Arc(end - start, one) if one == other else Spiral(end - start, one, other)
        placed = Placed(start, *at, curve)
        yield placed
        x, y, turn = (float(v) for v in curve.local(np.array([curve.length_m]))[0])
        c, s = math.cos(at[2]), math.sin(at[2])
        at = (at[0] + c * x - s * y, at[1] + s * x + c * y, at[2] + turn)


def curvature_range(
    curvature_per_m: float, bends: Sequence[float], start_m: float, end_m: float
) -> tuple[float, float]:
    """Bounds of the curvature of such a line between two arc lengths; bends count as a whole."""
    found = [curvature_per_m]
    for start, spiral, arc, curvature in unpack(bends):
        if start < end_m and start_m < start + 2.0 * spiral + arc:
            found.append(curvature_per_m + curvature)
    return min(found), max(found)
