"""Lane markings as the German RMS-1 (FGSV, 1993) draws them; much of Europe is alike.

Narrow lines are 0.12 m wide (0.15 m on motorways), broad ones 0.25 m; dashes are 3 m with gaps of
6 m in towns, 4 m and 8 m on country roads, 6 m and 12 m on motorways. A stop line is 0.50 m wide,
the bars of a zebra crossing 0.50 m with gaps of 0.50 m.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gen_data.content.procedural.patches import Patch
from gen_data.content.roads.deck import PAINT_LIFT_M, Deck
from gen_data.roads.cross_section import RoadShape, Strip, bay_borders, side_index, strips

NARROW_M, BROAD_M = 0.12, 0.25
STOP_LINE_M, ZEBRA_BAR_M = 0.5, 0.5
BAY_M = 5.7
"""Length of a bay for parking along the kerb (assumed, 5.2 to 5.8 m)."""


@dataclass(frozen=True, slots=True)
class Stripe:
    """A line along the road.

    Attributes:
        t_m: Its middle.
        dash_m, gap_m: Lengths; a gap of 0 is a solid line.
        slot: Material: ``center`` between the directions, else ``marking``.
    """

    t_m: float
    width_m: float
    dash_m: float = 0.0
    gap_m: float = 0.0
    slot: str = "marking"


def stripes(
    shape: RoadShape, center: str, edge: str, dash_m: tuple[float, float], width_m: float
) -> list[Stripe]:
    """Every line of a road."""
    made: list[Stripe] = []
    if shape.lanes_on(1) and shape.lanes_on(-1) and shape.median_m == 0.0:
        made += _center(center, dash_m, width_m)
    for side in (1, -1):
        row = strips(shape, side)
        driving = [strip for strip in row if strip.kind == "driving"]
        if center != "none":
            made += [Stripe(side * strip.outer_m, width_m, *dash_m) for strip in driving[:-1]]
        if edge != "none":
            made += _edges(row, driving, width_m, shape.kerb_m > 0.0)
            made += [
                Stripe(side * strip.inner_m, BROAD_M) for strip in row if strip.kind == "bicycle"
            ]
        made += [Stripe(side * strip.inner_m, NARROW_M) for strip in row if strip.kind == "parking"]
    return made


def paint_stripe(deck: Deck, stripe: Stripe, length_m: float) -> list[Patch]:
    """The patches of a line from end to end of a road."""
    half = 0.5 * stripe.width_m
    across = (stripe.t_m - half, stripe.t_m + half)
    if stripe.gap_m == 0.0:
        return [deck.ribbon((0.0, length_m), across, stripe.slot, PAINT_LIFT_M)]
    patches, s = [], 0.5 * stripe.gap_m
    while s + 0.3 * stripe.dash_m < length_m:
        end = min(s + stripe.dash_m, length_m)
        patches.append(deck.ribbon((s, end), across, stripe.slot, PAINT_LIFT_M))
        s += stripe.dash_m + stripe.gap_m
    return patches


def bay_lines(deck: Deck, strip: Strip, shape: RoadShape) -> Iterator[Patch]:
    """Lines between the bays of a parking strip: across it, or at the angle of the bays."""
    if shape.bay_angle_deg[side_index(strip.side)] > 0.0:
        for near, far in bay_borders(shape, strip):
            line = (np.array(far) - np.array(near)) * 0.97
            normal = 0.5 * NARROW_M * np.array([-line[1], line[0]]) / math.hypot(*line)
            corners = np.stack([-normal, line - normal, line + normal, normal])
            yield from deck.paint([corners], near)
        return
    count = int(shape.length_m // BAY_M)
    t0, t1 = sorted((strip.side * strip.inner_m, strip.side * (strip.outer_m - 0.05)))
    start = 0.5 * (shape.length_m - count * BAY_M)
    for k in range(count + 1):
        s = start + k * BAY_M - 0.5 * NARROW_M
        if s >= 0.0 and s + NARROW_M <= shape.length_m:
            yield deck.ribbon((s, s + NARROW_M), (t0, t1), "marking", PAINT_LIFT_M)


def _center(word: str, dash_m: tuple[float, float], width_m: float) -> list[Stripe]:
    if word == "none":
        return []
    if word == "double":
        return [Stripe(t, width_m, slot="center") for t in (-width_m, width_m)]
    dashes = dash_m if word == "dashed" else (0.0, 0.0)
    return [Stripe(0.0, width_m, *dashes, slot="center")]


def _edges(
    row: tuple[Strip, ...], driving: list[Strip], width_m: float, kerbs: bool
) -> list[Stripe]:
    """Edge lines: inside the outermost lane, or between it and the adjacent strip."""
    if not driving:
        return []
    outer, beyond = driving[-1], [s.kind for s in row if s.inner_m >= driving[-1].outer_m]
    if beyond and beyond[0] in ("bicycle", "parking"):
        return []
    inset = 0.25 if not beyond or beyond[0] != "shoulder" else 0.0
    broad = BROAD_M if "shoulder" in beyond and not kerbs else width_m
    made = [Stripe(outer.side * (outer.outer_m - inset), broad)]
    if row[0].kind == "median":
        made.append(Stripe(outer.side * (driving[0].inner_m + 0.5 * broad), broad))
    return made
