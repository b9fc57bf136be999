"""Traces of age and use on a road: worn tiles, patches, trenches, seams, gutters, broken edges."""

import math
from collections.abc import Iterator

import numpy as np

from gen_data.content.procedural.patches import Patch
from gen_data.content.roads.deck import PAINT_LIFT_M, Deck
from gen_data.content.roads.lane_textures import TILE_M
from gen_data.content.roads.markings import NARROW_M, Stripe, paint_stripe
from gen_data.content.roads.road_materials import UNPAVED, StreetLook
from gen_data.core.variant_rng import VariantRng, variant_rng
from gen_data.roads.cross_section import RoadShape, strips

GUTTER_M, SETTS_M = 0.5, 0.32
"""Width of the dirt along a kerb, and of a gutter of two rows of setts (usual sizes; assumed)."""

Span = tuple[float, float]


def lane_tiles(length_m: float, wear: float, rng: VariantRng) -> list[tuple[Span, str]]:
    """Spans of a lane with the slot of each; neighbours with the same slot are joined.

    A worn lane has cracked and stained tiles, and often a repaved stretch.
    """
    count = math.ceil(length_m / TILE_M - 1e-9)
    slots = []
    for _ in range(count):
        slot = "lane_stains" if rng.chance(0.2 * min(1.0, 4.0 * wear)) else "lane"
        if rng.chance(0.85 * wear):
            slot = "lane_alligator" if rng.chance(0.15 + 0.35 * wear) else "lane_cracks"
        slots.append(slot)
    if rng.chance(min(0.7, 1.5 * wear)) and count > 3:
        start, tiles = int(rng.between(0, count - 1)), int(rng.between(1, 4.99))
        slots[start : start + tiles] = ["lane_new"] * len(slots[start : start + tiles])
    spans: list[tuple[Span, str]] = []
    for k, slot in enumerate(slots):
        end = min((k + 1) * TILE_M, length_m)
        if spans and spans[-1][1] == slot:
            spans[-1] = ((spans[-1][0][0], end), slot)
        else:
            spans.append(((k * TILE_M, end), slot))
    return spans


def wear_patches(deck: Deck, profile: RoadShape, wear: float, rng: VariantRng) -> Iterator[Patch]:
    """Mended patches, trenches of pipes and cables, sealed cracks, seams and removed lines."""
    for _ in range(round(wear * profile.length_m / 18.0)):
        yield from _mend(deck, profile, (0.8, 5.0), (0.6, 1.6), rng)
    for _ in range(round(wear * profile.length_m / 110.0 + rng.between(0.0, 0.6))):
        yield from _mend(deck, profile, (9.0, 40.0), (0.5, 0.9), rng)
    low, high = _choose_carriageway(profile, rng)
    if high - low > 3.0 and rng.chance(1.6 * wear):
        s = rng.between(3.0, max(3.1, profile.length_m - 4.0))
        if s + 0.8 < profile.length_m:
            yield from _patch(deck, (s, s + rng.between(0.5, 0.75)), (low + 0.02, high - 0.02), 0.0)
    for _ in range(round(wear * profile.length_m / 7.0)):
        low, high = _choose_carriageway(profile, rng)
        if high - low > 1.5:
            yield _crack(deck, profile.length_m, low, high, rng)
    yield from _seams(deck, profile, wear, rng)
    two_way = profile.lanes_on(1) and profile.lanes_on(-1) and profile.median_m <= 0.0
    if wear > 0.25 and rng.chance(wear) and two_way:
        # The middle was elsewhere once: its line is ground off, its trace is left.
        t = rng.choose((-1.0, 1.0)) * rng.between(0.3, 0.9)
        for patch in paint_stripe(deck, Stripe(t, NARROW_M, 3.0, 6.0), profile.length_m):
            yield patch.painted(deck.slots["ghost"]).moved(z=0.0012 - PAINT_LIFT_M)


def _choose_carriageway(profile: RoadShape, rng: VariantRng) -> Span:
    """Edges of the carriageway; of one of both, where a median separates them."""
    if profile.median_m <= 0.0:
        return (-profile.carriageway_m(-1), profile.carriageway_m(1))
    side = rng.choose([side for side in (1, -1) if profile.lanes_on(side)])
    low, high = sorted((side * 0.5 * profile.median_m, side * profile.carriageway_m(side)))
    return (low, high)


def _mend(
    deck: Deck, profile: RoadShape, lengths: Span, widths: Span, rng: VariantRng
) -> Iterator[Patch]:
    """A rectangle of new asphalt somewhere on the carriageway, if it fits."""
    low, high = _choose_carriageway(profile, rng)
    length, width = rng.between(*lengths), rng.between(*widths)
    s = rng.between(0.3, max(0.4, profile.length_m - length - 0.3))
    t = rng.between(low + 0.1, high - width - 0.1)
    if s + length <= profile.length_m and high - low >= width + 0.3:
        yield from _patch(deck, (s, s + length), (t, t + width), 0.025)


def _patch(deck: Deck, s_m: Span, t_m: Span, seam_m: float) -> Iterator[Patch]:
    """New asphalt within a seam of bitumen."""
    seam = max(seam_m, 0.02)
    inner = (t_m[0] + seam_m, t_m[1] - seam_m)
    yield deck.ribbon(s_m, deck.columns_between(*t_m), "tar", 0.0012)
    yield deck.ribbon(
        (s_m[0] + seam, s_m[1] - seam), deck.columns_between(*inner), "asphalt_new", 0.0018
    )


def _crack(deck: Deck, length_m: float, low: float, high: float, rng: VariantRng) -> Patch:
    """A sealed crack: across the road, or wandering along it."""
    count = 14
    steps = np.array([rng.between(-1.0, 1.0) for _ in range(count)])
    if rng.chance(0.45):
        t = np.linspace(low + 0.1, low + 0.1 + (high - low - 0.2) * rng.between(0.3, 1.0), count)
        s = rng.between(1.0, max(1.1, length_m - 1.0)) + 0.12 * np.cumsum(steps)
    else:
        reach = min(rng.between(2.0, 10.0), 0.8 * length_m)
        s = rng.between(0.2, length_m - reach - 0.1) + np.linspace(0.0, reach, count)
        t = rng.between(low + 0.6, high - 0.6) + 0.1 * np.cumsum(steps)
    s, t = np.clip(s, 0.05, length_m - 0.05), np.clip(t, low + 0.05, high - 0.05)
    return deck.path(s, t, rng.between(0.015, 0.05), "tar", 0.002)


def _seams(deck: Deck, profile: RoadShape, wear: float, rng: VariantRng) -> Iterator[Patch]:
    """Sealed joints between the runs of the paver: along lane borders, seldom across."""
    for side in (1, -1):
        for strip in strips(profile, side):
            if strip.kind != "driving" or not rng.chance(0.25 + 0.6 * wear):
                continue
            start = rng.between(0.0, 0.6) * profile.length_m
            end = min(profile.length_m - 0.05, start + rng.between(0.2, 0.7) * profile.length_m)
            s = np.linspace(start + 0.05, end, max(3, int((end - start) / 2.0)))
            t0 = side * strip.outer_m - 0.12 * side
            wander = np.array([rng.between(-0.02, 0.02) for _ in s])
            yield deck.path(s, t0 + wander, rng.between(0.02, 0.06), "tar", 0.0016)


def gutters(deck: Deck, profile: RoadShape, look: StreetLook) -> Iterator[Patch]:
    """Dirt or setts along the kerbs; ragged edges where the carriageway has none."""
    whole = (0.0, profile.length_m)
    for side in (1, -1):
        edge = profile.carriageway_m(side)
        row = strips(profile, side)
        kerbed = any(strip.kind == "kerb" and strip.inner_m >= edge - 1e-6 for strip in row)
        if kerbed and look.carriageway == "asphalt":
            if look.seed % 3 == 1:
                t = sorted((side * (edge - SETTS_M), side * edge))
                yield deck.ribbon(whole, deck.columns_between(*t), "setts", 0.0008)
            else:
                inner = side * (edge - GUTTER_M)
                yield deck.edge(whole, inner, side * edge, "gutter", 0.0008)
        elif not kerbed and (look.wear > 0.2 or look.carriageway in UNPAVED):
            yield _crumbled(deck, profile, look, side)


def _crumbled(deck: Deck, profile: RoadShape, look: StreetLook, side: int) -> Patch:
    """Land that has grown over the edge of the carriageway, or shows where it has broken off."""
    rng = variant_rng(f"road/edge/{side}", look.seed)
    steps = np.linspace(0.0, profile.length_m, int(profile.length_m / 0.7) + 2)
    s = np.unique(np.concatenate([steps, deck.rows(0.0, profile.length_m)]))
    reach = 0.35 if look.carriageway in UNPAVED else 0.16 * look.wear
    edge, depth, inner = profile.carriageway_m(side), 0.4 * reach, []
    for _ in s:
        depth = min(reach, max(0.0, depth + rng.between(-0.45, 0.45) * reach))
        inner.append(edge - 0.01 - depth)
    t = np.stack([side * np.array(inner), np.full(len(s), side * (edge + 0.02))], axis=1)
    columns = t if side > 0 else t[:, ::-1]
    return deck.sheet(np.stack([s, s], axis=1), columns, "ground", 0.005)
