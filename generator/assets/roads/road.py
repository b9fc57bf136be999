"""Roads: carriageway, markings, kerbs, sidewalks, verges, traces of use; zebra crossings."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from gen_data.generator.assets.procedural.family import Solid
from gen_data.generator.assets.procedural.patches import Array, Patch, make_solid_in_place
from gen_data.generator.assets.procedural.surface_shapes import block
from gen_data.generator.assets.procedural.variant_rng import VariantRng, variant_rng
from gen_data.generator.assets.roads.deck import PAINT_LIFT_M, Deck, surface
from gen_data.generator.assets.roads.markings import ZEBRA_BAR_M, bay_lines, paint_stripe, stripes
from gen_data.generator.assets.roads.road_materials import SLOT_OF, street_materials
from gen_data.generator.roads.cross_section import (
    APRON_DROPS,
    APRON_FALL_M,
    APRON_M,
    APRON_STEPS,
    KERB_WIDTH_M,
    RoadShape,
    Strip,
    height_m,
    strips,
)

_RUT_M, _RUT_WIDTH_M, _TRACK_M = 0.008, 0.35, 0.85
_BATTER_M = 0.02
"""Kerb faces lean back by this much."""


def road(  # noqa: PLR0913 - a family's parameters are its function's
    *,
    seed: int = 0,
    markings: str = "dashed",
    edge_lines: str = "none",
    dash_m: tuple[float, float] = (3.0, 6.0),
    line_m: float = 0.12,
    wear: float = 0.3,
    paving: str = "paving",
    ground: str = "grass",
    apron_m: float = APRON_M,
    rails: tuple[float, float] = (0.0, 0.0),
    **shape: Any,
) -> Solid:
    """A road from the origin along +X; slots are those of ``street_materials``.

    Args:
        seed: Of patches, cracks and covers.
        markings: Line in the middle: ``solid``, ``dashed``, ``double`` or ``none``.
        edge_lines: ``solid`` or ``none``.
        dash_m: Length of dashes and of the gaps between them.
        line_m: Width of narrow lines.
        wear: 0 freshly laid to 1 worn out.
        paving: What sidewalks are covered with, a word of ``GROUNDS``.
        ground: What the land beside is covered with, a word of ``GROUNDS``.
        apron_m: Width of that land on each side; 0 = none.
        rails: Whether there are guard rails, left and right.
        shape: Fields of ``RoadShape``.
    """
    profile = RoadShape(**shape)
    deck = make_deck(profile, seed, wear, paving, ground)
    rng = variant_rng("road", seed)
    patches = list(_carriageway(deck, profile))
    for side in (1, -1):
        patches += _beside(deck, profile, side, apron_m)
    for stripe in stripes(profile, markings, edge_lines, dash_m, line_m):
        patches += paint_stripe(deck, stripe, profile.length_m)
    patches += [*_wear(deck, profile, wear, rng), *_covers(deck, profile, rng)]
    for side in (1, -1):
        for strip in strips(profile, side):
            if strip.kind == "parking":
                patches += bay_lines(deck, strip, profile.length_m)
        if rails[0 if side > 0 else 1]:
            patches += _guard_rail(deck, profile, side)
    materials = tuple(street_materials(seed, wear, paving, ground).values())
    return make_solid_in_place(patches, materials, _hulls(deck, profile))


def make_deck(profile: RoadShape, seed: int, wear: float, paving: str, ground: str) -> Deck:
    """The surface of a road with the ruts that traffic has worn into it."""
    t = np.array(sorted({round(v, 6) for v in _columns(profile)}))
    z = height_m(profile, t)
    for side in (1, -1):
        for strip in strips(profile, side):
            if strip.kind == "driving":
                for track in (strip.middle_m - _TRACK_M, strip.middle_m + _TRACK_M):
                    z = z - wear * _RUT_M * np.exp(-(((t - track) / _RUT_WIDTH_M) ** 2))
    slots = {name: k for k, name in enumerate(street_materials(seed, wear, paving, ground))}
    return Deck(profile.line(), t, z, abs(profile.curvature_per_m), slots)


def _columns(profile: RoadShape) -> Iterator[float]:
    yield 0.0
    for side in (1, -1):
        for strip in strips(profile, side):
            count = 10 if strip.kind == "driving" else 1
            for k in range(count + 1):
                yield side * (strip.inner_m + strip.width_m * k / count)
            if strip.kind == "kerb":
                yield side * (strip.inner_m + _BATTER_M)


def _carriageway(deck: Deck, profile: RoadShape) -> Iterator[Patch]:
    for side in (1, -1):
        for strip in strips(profile, side):
            if strip.kind != "kerb":
                t0, t1 = sorted((side * strip.inner_m, side * strip.outer_m))
                t = deck.t_m[(deck.t_m >= t0 - 1e-6) & (deck.t_m <= t1 + 1e-6)]
                yield deck.ribbon((0.0, profile.length_m), tuple(t), SLOT_OF[strip.kind])


def _beside(deck: Deck, profile: RoadShape, side: int, apron_m: float) -> Iterator[Patch]:
    """Kerb stones, and the land that slopes away from the road's outer edge."""
    row = strips(profile, side)
    for strip in row:
        if strip.kind == "kerb":
            yield _kerb(deck, profile, strip)
    if apron_m > 0.0 and not (row == () and profile.median_m > 0.0):
        edge = row[-1].outer_m if row else 0.0
        z = float(np.interp(side * edge, deck.t_m, deck.z_m))
        across = edge + apron_m * np.array(APRON_STEPS)
        heights = z - np.array(APRON_DROPS) * (z + APRON_FALL_M)
        yield _beyond(deck, profile.length_m, side, across, heights, "ground")


def _kerb(deck: Deck, profile: RoadShape, strip: Strip) -> Patch:
    """Face and top of a row of kerb stones."""
    across = strip.inner_m + np.array([0.0, _BATTER_M, _BATTER_M + 0.015, KERB_WIDTH_M])
    z0, top = strip.inner_z_m, strip.outer_z_m
    heights = np.array([z0, top - 0.015, top, top])
    return _beyond(deck, profile.length_m, strip.side, across, heights, "kerb")


def _beyond(
    deck: Deck, length_m: float, side: int, across_m: Array, z_m: Array, slot: str
) -> Patch:
    """A profile along the road; distances rise outwards, heights are the profile's own."""
    if side < 0:
        across_m, z_m = across_m[::-1], z_m[::-1]
    s, t = np.meshgrid(deck.rows(0.0, length_m), side * across_m, indexing="ij")
    points = deck.at(s, t)
    points[..., 2] = z_m
    # The texture follows the profile's own length, so that it is not stretched on a kerb's face.
    along = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(t[0]), np.diff(z_m)))])
    plan = np.stack([s, t[0, 0] + np.broadcast_to(along, s.shape)], axis=2)
    return surface(points, plan, slot, deck.slots[slot])


def _wear(deck: Deck, profile: RoadShape, wear: float, rng: VariantRng) -> Iterator[Patch]:
    """Mended patches and sealed cracks."""
    low, high = -profile.carriageway_m(-1), profile.carriageway_m(1)
    for _ in range(round(wear * profile.length_m / 18.0)):
        length, width = rng.between(0.8, 5.0), rng.between(0.6, 1.6)
        s = rng.between(0.3, max(0.4, profile.length_m - length - 0.3))
        t = rng.between(low + 0.1, high - width - 0.1)
        if s + length > profile.length_m or high - low < width + 0.3:
            continue
        seam = 0.025
        across, inner = (t, t + width), (t + seam, t + width - seam)
        yield deck.ribbon((s, s + length), deck.columns_between(*across), "tar", 0.0012)
        yield deck.ribbon(
            (s + seam, s + length - seam), deck.columns_between(*inner), "asphalt_new", 0.0018
        )
    for _ in range(round(wear * profile.length_m / 4.5)):
        yield _crack(deck, profile.length_m, low, high, rng)


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


def _covers(deck: Deck, profile: RoadShape, rng: VariantRng) -> Iterator[Patch]:
    """Manhole covers in the lanes, and drains in the gutters of roads with kerbs."""
    if profile.kerb_m <= 0.0:
        return
    for side in (1, -1):
        row = strips(profile, side)
        driving = [strip for strip in row if strip.kind == "driving"]
        s = rng.between(6.0, 30.0)
        while driving and s < profile.length_m - 1.0:
            t = driving[0].middle_m + rng.between(-0.5, 0.5)
            yield deck.disc(s, t, 0.40, "tar", 0.0022)
            yield deck.disc(s, t, 0.3125, "manhole", 0.003)
            s += rng.between(28.0, 55.0)
        s = rng.between(4.0, 12.0)
        while any(strip.kind == "kerb" for strip in row) and s < profile.length_m - 1.0:
            gutter = profile.carriageway_m(side)
            t0, t1 = sorted((side * (gutter - 0.34), side * (gutter - 0.02)))
            yield deck.ribbon((s, s + 0.5), (t0, t1), "drain", 0.004)
            s += rng.between(18.0, 30.0)


def _guard_rail(deck: Deck, profile: RoadShape, side: int) -> Iterator[Patch]:
    """A W-beam 0.75 m high on posts every 4 m, half a metre beyond the carriageway.

    The usual size of EN 1317 systems such as ESP 4.0.
    """
    t = side * (profile.carriageway_m(side) + 0.5)
    base = float(np.interp(t, deck.t_m, deck.z_m))
    depths = np.array([0.0, 0.08, 0.08, 0.0, 0.08, 0.08, 0.0]) - 0.08
    heights = base + 0.44 + np.array([0.0, 0.05, 0.11, 0.155, 0.2, 0.26, 0.31])
    s = deck.rows(0.0, profile.length_m)
    flat = [deck.line.points(s, np.full(len(s), t + side * d)) for d in depths]
    points = np.stack(
        [np.column_stack([f, np.full(len(s), z)]) for f, z in zip(flat, heights, strict=True)],
        axis=1,
    )
    yield surface(points, np.zeros((*points.shape[:2], 2)), "steel", deck.slots["steel"])
    for station in np.arange(1.0, profile.length_m, 4.0):
        heading = deck.line.poses(np.array([station]))[0, 2]
        post = block((-0.03, -0.05, base - 0.1), (0.03, 0.05, base + 0.74), 0.0, 0)
        foot = deck.line.points(np.array([station]), np.array([t + side * 0.06]))[0]
        yield (
            post.rotated("z", float(heading))
            .moved(float(foot[0]), float(foot[1]))
            .painted(deck.slots["steel"])
        )


def _hulls(deck: Deck, profile: RoadShape) -> list[Array]:
    """Collision slabs of at most 20 m under every strip."""
    stations = np.linspace(0.0, profile.length_m, max(2, int(np.ceil(profile.length_m / 20.0)) + 1))
    hulls = []
    for s0, s1 in pairwise(stations):
        for side in (1, -1):
            row = [strip for strip in strips(profile, side) if strip.kind != "kerb"]
            for strip in row:
                s, t = np.meshgrid(
                    [s0, s1], [side * strip.inner_m, side * strip.outer_m], indexing="ij"
                )
                top = deck.at(s, t).reshape(-1, 3)
                # A point in the gutter would take the kerb's height from the other side.
                top[:, 2] = np.tile([strip.inner_z_m, strip.outer_z_m], 2)
                hulls.append(np.concatenate([top, top - np.array([0.0, 0.0, 0.3])]))
    return hulls


def crosswalk(
    *, seed: int = 0, wear: float = 0.3, station_m: float = 20.0, width_m: float = 4.0, **shape: Any
) -> Solid:
    """Bars across a road, in the road's frame, over asphalt that hides its other lines.

    Args:
        seed: Of textures; the road's own.
        wear: 0 freshly painted to 1 worn out; the road's own.
        station_m: Its middle, along the road.
        width_m: Along the road, the length of its bars.
        shape: Fields of ``RoadShape``.
    """
    profile = RoadShape(**shape)
    deck = make_deck(profile, seed, wear, "paving", "grass")
    low, high = -profile.carriageway_m(-1), profile.carriageway_m(1)
    span = (station_m - 0.5 * width_m, station_m + 0.5 * width_m)
    columns = deck.t_m[(deck.t_m > low + 0.4) & (deck.t_m < high - 0.4)]
    inner = (low + 0.36, *(float(t) for t in columns), high - 0.36)
    patches = [deck.ribbon(span, inner, "asphalt", PAINT_LIFT_M + 0.0008)]
    count = int((high - low - 1.5 * ZEBRA_BAR_M) // (2.0 * ZEBRA_BAR_M)) + 1
    first = 0.5 * (low + high) - (count - 0.5) * ZEBRA_BAR_M
    for k in range(count):
        t0 = first + 2.0 * k * ZEBRA_BAR_M
        t1 = t0 + ZEBRA_BAR_M
        bar = deck.columns_between(t0, t1)
        patches.append(deck.ribbon(span, bar, "marking", PAINT_LIFT_M + 0.002))
    s, t = np.meshgrid(span, [low, high], indexing="ij")
    top = deck.at(s, t).reshape(-1, 3)
    hull = np.concatenate([top, top - np.array([0.0, 0.0, 0.02])])
    materials = tuple(street_materials(seed, wear, "paving", "grass").values())
    return make_solid_in_place(patches, materials, [hull])
