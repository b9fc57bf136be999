"""Roads: carriageway, markings, kerbs, sidewalks, verges, traces of use; zebra crossings."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from gen_data.assets.family import Solid, check_option
from gen_data.content.procedural.patches import Array, Patch
from gen_data.content.procedural.surface_shapes import block
from gen_data.content.roads import road_materials
from gen_data.content.roads.deck import PAINT_LIFT_M, Deck, common_rows, surface
from gen_data.content.roads.markings import ZEBRA_BAR_M, bay_lines, paint_stripe, stripes
from gen_data.content.roads.painted_signs import ARROW_M, arrow, bicycle, hatching
from gen_data.content.roads.road_wear import gutters, lane_tiles, wear_patches
from gen_data.core.variant_rng import VariantRng, variant_rng
from gen_data.roads.alignment import unpack
from gen_data.roads.cross_section import (
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
    markings: str = "dashed",
    edge_lines: str = "none",
    dash_m: tuple[float, float] = (3.0, 6.0),
    line_m: float = 0.12,
    apron_m: float = APRON_M,
    rails: tuple[float, float] = (0.0, 0.0),
    arrows: tuple[float, float] = (0.0, 0.0),
    tram: float = 0.0,
    **others: Any,
) -> Solid:
    """A road from the origin along +X; slots as in ``street_materials``.

    Args:
        markings: Line in the middle: ``solid``, ``dashed``, ``double`` or ``none``.
        edge_lines: ``solid`` or ``none``.
        dash_m: Length of dashes and of the gaps between them.
        line_m: Width of narrow lines.
        apron_m: Width of the land along it; 0 = none.
        rails: Guard rails, left and right: 0 = none, 1 = along the road, 2 = outside of bends.
        arrows: Whether lanes that lead to its start and to its end have arrows.
        tram: Whether the lanes next to the middle have the rails of a tramway.
        others: Fields of ``StreetLook`` and of ``RoadShape``.
    """
    look, shape = road_materials.split_look(others)
    profile = RoadShape(**shape)
    deck = make_deck(profile, look)
    rng = variant_rng("road", look.seed)
    paved = look.carriageway not in road_materials.UNPAVED
    patches = list(_carriageway(deck, profile, look))
    for side in (1, -1):
        patches += _beside(deck, profile, side, apron_m)
    for stripe in stripes(profile, markings, edge_lines, dash_m, line_m) if paved else ():
        patches += paint_stripe(deck, stripe, profile.length_m)
    if paved:
        patches += [*wear_patches(deck, profile, look.wear, rng), *_covers(deck, profile, rng)]
        patches += _signs(deck, profile, arrows, markings)
        patches += _turn_lane_paint(deck, profile, line_m) if any(profile.turn_m) else ()
    patches += gutters(deck, profile, look)
    patches += _median_ends(deck, profile)
    if tram:
        patches += _tram_tracks(deck, profile)
    for side in (1, -1):
        for strip in strips(profile, side) if paved else ():
            if strip.kind == "parking":
                patches += bay_lines(deck, strip, profile)
        for span in _railed(profile, side, rails[0 if side > 0 else 1]):
            patches += _guard_rail(deck, profile, side, span)
    return road_materials.make_street_solid(patches, look, _hulls(deck, profile))


def make_deck(profile: RoadShape, look: road_materials.StreetLook) -> Deck:
    """The surface of a road with the ruts that traffic has worn into it."""
    t = np.array(sorted({round(v, 6) for v in _columns(profile)}))
    z = height_m(profile, t)
    for side in (1, -1):
        for strip in strips(profile, side):
            if strip.kind == "driving":
                for track in (strip.middle_m - _TRACK_M, strip.middle_m + _TRACK_M):
                    z = z - look.wear * _RUT_M * np.exp(-(((t - track) / _RUT_WIDTH_M) ** 2))
    return Deck(profile.line(), t, z, common_rows(profile), road_materials.number_slots(look))


def _columns(profile: RoadShape) -> Iterator[float]:
    yield 0.0
    for side in (1, -1):
        for strip in strips(profile, side):
            count = 10 if strip.kind == "driving" else 1
            for k in range(count + 1):
                yield side * (strip.inner_m + strip.width_m * k / count)
            if strip.kind == "kerb":
                yield side * (strip.inner_m + _BATTER_M)


def _carriageway(
    deck: Deck, profile: RoadShape, look: road_materials.StreetLook
) -> Iterator[Patch]:
    whole = (0.0, profile.length_m)
    if any(profile.turn_m):
        yield from _turn_lanes(deck, profile)
    for side in (1, -1):
        for strip in strips(profile, side):
            if strip.kind == "kerb" or (strip.kind == "median" and any(profile.turn_m)):
                continue
            t0, t1 = sorted((side * strip.inner_m, side * strip.outer_m))
            t = tuple(deck.t_m[(deck.t_m >= t0 - 1e-6) & (deck.t_m <= t1 + 1e-6)])
            if strip.kind == "driving":
                rng = variant_rng(f"road/{side}/{strip.number}", look.seed)
                for span, slot in lane_tiles(profile.length_m, look.wear, rng):
                    yield deck.lane(span, t, slot)
            else:
                slot = road_materials.SLOT_OF[strip.kind]
                coated = strip.kind == "bicycle" and look.coating != "none"
                yield deck.ribbon(whole, t, "coating" if coated else slot)


def _turn_lanes(deck: Deck, profile: RoadShape) -> Iterator[Patch]:
    """The median as driven surface, with lanes for those who turn across at its ends."""
    half = 0.5 * profile.median_m
    t = tuple(deck.t_m[np.abs(deck.t_m) <= half + 1e-6])
    start, end = profile.turn_m
    for low, high, _ in profile.turn_spans():
        yield deck.lane((low, high), t, "lane")
    if profile.length_m - end > start:
        yield deck.ribbon((start, profile.length_m - end), t, "asphalt")


def _turn_lane_paint(deck: Deck, profile: RoadShape, line_m: float) -> Iterator[Patch]:
    """Lines and arrows of the lanes in the median, and the blocked area between them."""
    half, sign = 0.5 * profile.median_m, 1.0 if profile.traffic == "right" else -1.0
    word = "left" if profile.traffic == "right" else "right"
    for low, high, is_forward in profile.turn_spans():
        # Solid towards oncoming traffic, broken towards the lane that it leaves.
        oncoming = sign * half if is_forward else -sign * half
        yield deck.ribbon((low, high), _about(oncoming, line_m), "marking", PAINT_LIFT_M)
        for s in np.arange(low, high - 1.0, 6.0):
            span = (float(s), min(float(s) + 3.0, high))
            yield deck.ribbon(span, _about(-oncoming, line_m), "marking", PAINT_LIFT_M)
        for before in (6.0, 20.0):
            at = high - before - ARROW_M if is_forward else low + before + ARROW_M
            if low < at < high:
                yield from deck.paint(arrow(word), (at, 0.0), not is_forward)
    start, end = profile.turn_m
    free = profile.length_m - end - start
    if free > 2.0:
        bars = hatching(free, 2.0 * half - 0.3, 0.5)
        yield from deck.paint(bars, (start, 0.0))
        for edge in (-half, half):
            span = (start, profile.length_m - end)
            yield deck.ribbon(span, _about(edge, line_m), "marking", PAINT_LIFT_M)


def _about(t_m: float, width_m: float) -> tuple[float, float]:
    """Edges of a line."""
    return (t_m - 0.5 * width_m, t_m + 0.5 * width_m)


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
    """Face and top of a row of kerb stones; kerbs of a median face outwards."""
    away = np.array([0.0, _BATTER_M, _BATTER_M + 0.015, KERB_WIDTH_M])
    z0, top = sorted((strip.inner_z_m, strip.outer_z_m))
    heights = np.array([z0, top - 0.015, top, top])
    if strip.inner_z_m > strip.outer_z_m:
        across, heights = strip.outer_m - away[::-1], heights[::-1]
    else:
        across = strip.inner_m + away
    return _beyond(deck, profile.length_m, strip.side, across, heights, "kerb")


def _median_ends(deck: Deck, profile: RoadShape) -> Iterator[Patch]:
    """Upright faces that close a kerbed median at both ends of the road."""
    if profile.median_kerb_m <= 0.0 or profile.median_m <= 2.0 * KERB_WIDTH_M:
        return
    half = 0.5 * profile.median_m
    z = float(np.interp(half, deck.t_m, deck.z_m))
    for s, turn in ((0.0, 1.0), (profile.length_m, -1.0)):
        t = turn * np.array([half, -half])
        flat = deck.line.points(np.full(2, s), t)
        points = np.array(
            [[[*flat[k], low] for k in (0, 1)] for low in (z - 0.05, z + profile.median_kerb_m)]
        )
        plan = np.array([[[v, low] for v in t] for low in (0.0, profile.median_kerb_m)])
        yield surface(points, plan, "kerb", deck.slots["kerb"])


def _beyond(
    deck: Deck, length_m: float, side: int, across_m: Array, z_m: Array, slot: str
) -> Patch:
    """A profile along the road; distances rise outwards, heights are the profile's own."""
    if side < 0:
        across_m, z_m = across_m[::-1], z_m[::-1]
    s, t = np.meshgrid(deck.rows(0.0, length_m), side * across_m, indexing="ij")
    points = deck.at(s, t)
    points[..., 2] = z_m
    # Texture coordinates follow the profile's arc length: no stretching on the face of a kerb.
    along = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(t[0]), np.diff(z_m)))])
    plan = np.stack([s, t[0, 0] + np.broadcast_to(along, s.shape)], axis=2)
    return surface(points, plan, slot, deck.slots[slot])


def _signs(
    deck: Deck, profile: RoadShape, arrows: tuple[float, float], markings: str
) -> Iterator[Patch]:
    """Arrows on lanes that lead to an end, and bicycles on bicycle lanes."""
    for side in (1, -1):
        row = strips(profile, side)
        forward = profile.forward(side)
        lanes = [strip for strip in row if strip.kind == "driving"]
        if arrows[1 if forward else 0]:
            apart = profile.turn_m[1 if forward else 0] > 0.0
            words = _turns(len(lanes), profile.traffic, apart=apart)
            for strip, word in zip(lanes, words, strict=True):
                for before in (8.0, 28.0):
                    at = profile.length_m - before - ARROW_M if forward else before + ARROW_M
                    if 0.0 < at < profile.length_m and before + ARROW_M < profile.length_m:
                        yield from deck.paint(arrow(word), (at, strip.middle_m), not forward)
        for strip in row if markings != "none" else ():
            if strip.kind == "bicycle":
                for s in np.arange(6.0, profile.length_m - 6.0, 25.0):
                    yield from deck.paint(bicycle(), (float(s), strip.middle_m), not forward)


def _turns(count: int, traffic: str, *, apart: bool) -> list[str]:
    """Arrow of each lane from the middle outwards, as ``junction_lanes`` connects them.

    ``apart`` = traffic that turns across has a separate lane.
    """
    across, aside = ("left", "right") if traffic == "right" else ("right", "left")
    if count < 2:
        return ["straight"] * count
    inner = "straight" if apart else f"straight_{across}"
    return [inner, *["straight"] * (count - 2), f"straight_{aside}"]


def _tram_tracks(deck: Deck, profile: RoadShape) -> Iterator[Patch]:
    """Grooved rails, flush with the surface, in the lanes next to the middle; gauge 1435 mm.

    Head 56 mm, groove 42 mm: rail 60R2 of EN 14811.
    """
    whole = (0.0, profile.length_m)
    for side in (1, -1):
        lanes = [strip for strip in strips(profile, side) if strip.kind == "driving"]
        for middle in (lane.middle_m for lane in lanes[:1]):
            for way in (1.0, -1.0):
                # The groove lies inside the gauge, with a narrow lip on its other side.
                face = middle + way * 0.5 * 1.435
                bands = (
                    ("rail", 0.0, 0.056), ("groove", -0.042, 0.0), ("rail", -0.056, -0.042),
                    ("tar", 0.056, 0.08), ("tar", -0.08, -0.056),
                )  # fmt: skip
                for slot, low, high in bands:
                    t0, t1 = sorted((face + way * low, face + way * high))
                    yield deck.ribbon(whole, deck.columns_between(t0, t1), slot, 0.0035)


def _covers(deck: Deck, profile: RoadShape, rng: VariantRng) -> Iterator[Patch]:
    """Covers in the lanes and on sidewalks, and drains in the gutters of roads with kerbs."""
    if profile.kerb_m <= 0.0:
        return
    for side in (1, -1):
        row = strips(profile, side)
        driving = [strip for strip in row if strip.kind == "driving"]
        s = rng.between(6.0, 30.0)
        while driving and s < profile.length_m - 1.0:
            t = driving[0].middle_m + rng.between(-0.5, 0.5)
            yield deck.disc(s, t, 0.40, "tar", 0.0022)
            yield deck.disc(s, t, 0.3125, rng.choose(("manhole", "manhole", "manhole_b")), 0.003)
            # Caps of valves stand in groups near manholes.
            for _ in range(rng.choose((0, 0, 1, 2))):
                beside = (s + rng.between(0.9, 3.0), t + rng.between(-0.6, 0.6))
                yield deck.disc(*beside, 0.09, "manhole_b", 0.003, 12)
            s += rng.between(28.0, 55.0)
        s = rng.between(4.0, 12.0)
        gutter = profile.carriageway_m(side)
        kerbed = any(strip.kind == "kerb" and strip.inner_m >= gutter - 1e-6 for strip in row)
        while kerbed and s < profile.length_m - 1.0:
            t0, t1 = sorted((side * (gutter - 0.34), side * (gutter - 0.02)))
            yield deck.ribbon((s, s + 0.5), (t0, t1), "drain", 0.004)
            s += rng.between(18.0, 30.0)
        for walk in (strip for strip in row if strip.kind == "sidewalk" and strip.width_m > 1.2):
            s = rng.between(5.0, 35.0)
            while s < profile.length_m - 2.0:
                t0, t1 = sorted((walk.middle_m - 0.3, walk.middle_m + 0.3))
                yield deck.ribbon((s, s + rng.choose((0.6, 1.2))), (t0, t1), "hatch", 0.002)
                s += rng.between(25.0, 60.0)


def _railed(profile: RoadShape, side: int, rails: float) -> Iterator[tuple[float, float]]:
    """Spans of the road with a guard rail on one side."""
    if rails == 1.0:
        yield (0.0, profile.length_m)
    for start, spiral, arc, curvature in unpack(profile.bends) if rails == 2.0 else ():
        if side * curvature < 0.0:
            yield (start, start + 2.0 * spiral + arc)


def _guard_rail(
    deck: Deck, profile: RoadShape, side: int, span_m: tuple[float, float]
) -> Iterator[Patch]:
    """A W-beam 0.75 m high on posts every 4 m, half a metre beyond the carriageway.

    The usual size of EN 1317 systems such as ESP 4.0.
    """
    t = side * (profile.carriageway_m(side) + 0.5)
    base = float(np.interp(t, deck.t_m, deck.z_m))
    depths = np.array([0.0, 0.08, 0.08, 0.0, 0.08, 0.08, 0.0]) - 0.08
    heights = base + 0.44 + np.array([0.0, 0.05, 0.11, 0.155, 0.2, 0.26, 0.31])
    s = deck.rows(*span_m)
    flat = [deck.line.points(s, np.full(len(s), t + side * d)) for d in depths]
    points = np.stack(
        [np.column_stack([f, np.full(len(s), z)]) for f, z in zip(flat, heights, strict=True)],
        axis=1,
    )
    yield surface(points, np.zeros((*points.shape[:2], 2)), "steel", deck.slots["steel"])
    for station in np.arange(span_m[0] + 1.0, span_m[1], 4.0):
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
    lying = [(s, side) for side in (1, -1) for s in strips(profile, side) if s.kind != "kerb"]
    across = np.array([[side * strip.inner_m, side * strip.outer_m] for strip, side in lying])
    s, t = np.broadcast_arrays(stations[:, None, None], across)
    tops = deck.at(s, t)
    # A point in the gutter would take the kerb's height from the other side.
    tops[..., 2] = [[strip.inner_z_m, strip.outer_z_m] for strip, _ in lying]
    slabs = np.stack([tops[:-1], tops[1:]], axis=2).reshape(-1, 4, 3)
    return list(np.concatenate([slabs, slabs - np.array([0.0, 0.0, 0.3])], axis=1))


def crosswalk(
    *, station_m: float = 20.0, width_m: float = 4.0, style: str = "zebra", **others: Any
) -> Solid:
    """Bars across a road, in the road's frame, over asphalt that hides its other lines.

    Args:
        station_m: Its middle, along the road.
        width_m: Width along the road, the length of its bars.
        style: ``zebra``, or ``ladder`` with lines at both ends of the bars.
        others: Fields of ``StreetLook`` and of ``RoadShape``, as for the road.
    """
    check_option("crosswalk", "style", style, ("zebra", "ladder"))
    look, shape = road_materials.split_look(others)
    profile = RoadShape(**shape)
    deck = make_deck(profile, look)
    low, high = -profile.carriageway_m(-1), profile.carriageway_m(1)
    span = (station_m - 0.5 * width_m, station_m + 0.5 * width_m)
    patches = list(_cover_lines(deck, profile, span))
    count = int((high - low - 1.5 * ZEBRA_BAR_M) // (2.0 * ZEBRA_BAR_M)) + 1
    first = 0.5 * (low + high) - (count - 0.5) * ZEBRA_BAR_M
    for k in range(count):
        t0 = first + 2.0 * k * ZEBRA_BAR_M
        t1 = t0 + ZEBRA_BAR_M
        bar = deck.columns_between(t0, t1)
        patches.append(deck.ribbon(span, bar, "marking", PAINT_LIFT_M + 0.002))
    if style == "ladder":
        across = deck.columns_between(low + 0.2, high - 0.2)
        for line in ((span[0] - 0.3, span[0]), (span[1], span[1] + 0.3)):
            patches.append(deck.ribbon(line, across, "marking", PAINT_LIFT_M + 0.002))
    s, t = np.meshgrid(span, [low, high], indexing="ij")
    top = deck.at(s, t).reshape(-1, 3)
    hull = np.concatenate([top, top - np.array([0.0, 0.0, 0.02])])
    return road_materials.make_street_solid(patches, look, [hull])


def _cover_lines(deck: Deck, profile: RoadShape, span_m: tuple[float, float]) -> Iterator[Patch]:
    """The carriageway's own surface over its lines, up to the gutters."""
    lift = PAINT_LIFT_M + 0.0008
    for side in (1, -1):
        edge = profile.carriageway_m(side) - 0.36
        for strip in strips(profile, side):
            inner, outer = min(strip.inner_m, edge), min(strip.outer_m, edge)
            if strip.kind not in ("driving", "bicycle", "shoulder", "parking") or outer <= inner:
                continue
            t = deck.columns_between(*sorted((side * inner, side * outer)))
            if strip.kind == "driving":
                yield deck.lane(span_m, t, "lane", lift)
            else:
                yield deck.ribbon(span_m, t, "asphalt", lift)
