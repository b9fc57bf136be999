"""Fences and garden walls, in panels that line a street.

Panels run along Y and have one post, at -Y: panels of one variant join end to end. Sizes after
fence makers' catalogues (assumed, 10 %), where no source is named.
"""

import math
from collections.abc import Callable, Mapping

import numpy as np

from gen_data.assets.family import Facts, Solid, choose_option
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import painted_material, patterned_material
from gen_data.content.procedural.patches import Patch
from gen_data.content.procedural.surface_shapes import block, cone, extrude, lathe
from gen_data.content.scenery.basic_shapes import make_solid
from gen_data.content.scenery.clutter_shapes import bar, rod, wire
from gen_data.content.scenery.street_furniture import GALVANISED
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng, in_turn, variant_rng

FENCES = ("pickets", "panel", "iron", "mesh", "planks", "rail", "chain_link", "wall")
WALLS = ("brick", "stone", "rendered", "brick_railing", "rendered_railing", "gabion")
HALF_M = 1.0
"""Half the length of a panel."""
_STAINS = ((0.62, 0.5, 0.4), (0.85, 0.82, 0.78), (0.4, 0.3, 0.24), (0.5, 0.48, 0.46))
_METAL_PAINTS = ("#2f4236", "#3b3d3f", "#1f2a24", "#6b6f70")
_IRON_PAINTS = ("#1c1d1f", "#22332a", "#2b2f36")

Made = tuple[list[Patch], tuple[Material, ...], float]
"""Parts, materials and height [m] of a panel."""


def fence(seed: int, style: str) -> Solid:
    """A fence panel of 2 m; ``style`` ``any`` leaves the choice among fences to the seed."""
    kind = fence_facts(seed, style).subcategory
    if kind == "wall":
        return garden_wall(seed, "any")
    parts, materials, high = _MAKERS[kind](variant_rng(f"fence/{kind}", seed))
    return make_solid(parts, materials, [hulls.box((-0.05, -HALF_M, 0.0), (0.05, HALF_M, high))])


def fence_facts(seed: int, style: str) -> Facts:
    """Its kind. Raises AssetError for an unknown style."""
    if style == "any":
        return Facts(in_turn(FENCES[:-1], seed))
    return Facts(choose_option("fence", "style", style, FENCES, seed))


def garden_wall(seed: int, style: str) -> Solid:
    """A garden wall section of 2 m with a coping, a pier at -Y in some, railings on some."""
    kind = garden_wall_facts(seed, style).subcategory
    rng = variant_rng("garden_wall", seed)
    skin = _skin(kind, rng)
    railed = kind.endswith("railing")
    high = rng.between(0.45, 0.7, "height_m") if railed else rng.between(0.7, 1.5, "height_m")
    half, reach = 0.5 * rng.between(0.2, 0.3, "thickness_m"), 0.035
    if kind == "gabion":
        half = 0.25
    parts = [block((-half, -HALF_M, 0.0), (half, HALF_M, high - 0.06))]
    if kind == "gabion":
        parts += _basket(half, high - 0.06)
    else:
        cap = block((-half - reach, -HALF_M, high - 0.06), (half + reach, HALF_M, high), 0.012, 1)
        parts.append(cap)
    top = high
    if kind != "gabion" and (railed or rng.chance(0.5)):
        wide, tall = half + 0.07, high + (0.75 if railed else 0.2)
        pier = (-HALF_M, -HALF_M + 2.0 * wide)
        parts.append(block((-wide, pier[0], 0.0), (wide, pier[1], tall - 0.08)))
        part = block((-wide - 0.03, pier[0], tall - 0.08), (wide + 0.03, pier[1], tall), 0.015, 1)
        parts.append(part)
        top = tall
    if railed:
        parts += _railing(high, 0.6, rng)
    stone = patterned_material("texture/concrete?seed=3", 1.5, 0.9, (0.86, 0.84, 0.8))
    metal = painted_material(rng.choose(_IRON_PAINTS), 0.45)
    hull = hulls.box((-half, -HALF_M, 0.0), (half, HALF_M, min(top, high)))
    return make_solid(parts, (skin, stone, metal), [hull])


def garden_wall_facts(seed: int, style: str) -> Facts:
    """Its kind. Raises AssetError for an unknown style."""
    return Facts(choose_option("garden_wall", "style", style, WALLS, seed))


def _skin(kind: str, rng: VariantRng) -> Material:
    """Material of a garden wall."""
    if kind.startswith("brick"):
        shade = rng.choose(((0.9, 0.88, 0.86), (0.75, 0.7, 0.66), (1.0, 0.96, 0.9)))
        return patterned_material(f"texture/brick?seed={rng.choose((4, 0))}", 1.1, 0.92, shade)
    if kind == "stone":
        shade = rng.choose(((0.5, 0.48, 0.44), (0.62, 0.54, 0.42), (0.36, 0.37, 0.38)))
        return patterned_material("texture/ashlar?seed=1", 1.3, 0.93, shade)
    if kind == "gabion":
        return patterned_material("texture/ashlar?seed=2", 0.55, 0.95, (0.42, 0.41, 0.39))
    shade = rng.choose(((0.72, 0.7, 0.64), (0.66, 0.56, 0.42), (0.78, 0.78, 0.76), (0.5, 0.5, 0.5)))
    return patterned_material("texture/plaster?seed=5", 2.5, 0.92, shade)


def _basket(half: float, high: float) -> list[Patch]:
    """The wires of a gabion, 10 cm apart."""
    out, parts = half + 0.004, []
    for x in (-out, out):
        for y in np.linspace(-HALF_M, HALF_M, 21):
            parts.append(wire((x, float(y), 0.0), (x, float(y), high), 0.003, 2))
        for z in np.linspace(0.02, high, max(3, round(high / 0.1))):
            parts.append(wire((x, -HALF_M, float(z)), (x, HALF_M, float(z)), 0.003, 2))
    return parts


def _railing(foot: float, high: float, rng: VariantRng) -> list[Patch]:
    """Upright iron bars between two rails, on a wall ``foot`` high; slot 2."""
    parts = [
        block((-0.015, -HALF_M, z), (0.015, HALF_M, z + 0.012), 0.0, 2)
        for z in (foot + 0.08, foot + high - 0.06)
    ]
    pointed = rng.chance(0.6, "pointed")
    for y in np.arange(-HALF_M + 0.06, HALF_M, 0.125):
        parts.append(bar((0.0, float(y), foot), (0.0, float(y), foot + high), 0.009, 4, 2))
        if pointed:
            tip = cone((0.016, foot + high), (0.001, foot + high + 0.07), 4)
            parts.append(tip.moved(y=float(y)).painted(2))
    return parts


def _wood(rng: VariantRng, scale_m: float = 1.2) -> Material:
    return patterned_material("texture/wood_grain?seed=5", scale_m, 0.8, rng.choose(_STAINS))


def _pickets(rng: VariantRng) -> Made:
    """Upright pickets with pointed, round or flat tops on two rails."""
    high, wide = rng.between(0.8, 1.2, "height_m"), rng.between(0.07, 0.1, "board_m")
    count = round(2.0 * HALF_M / (wide + rng.between(0.03, 0.07)))
    pitch, half = 2.0 * HALF_M / count, 0.5 * wide
    kind = rng.choose(("point", "point", "round", "flat"), "kind")
    top = {"point": [(high, 0.0)], "flat": []}.get(
        kind, [(high - half * (1 - math.sin(t)), half * math.cos(t)) for t in (0.7, 1.57, 2.44)]
    )
    shoulder = high - half if kind != "flat" else high
    outline = np.array([(0.05, -half), (0.05, half), (shoulder, half), *top, (shoulder, -half)])
    # The outline's first axis becomes Z, its second -Y; the thickness runs along X.
    picket = extrude(outline, 0.02).rotated("y", -0.5 * math.pi).moved(0.05)
    parts = [picket.moved(y=-HALF_M + (k + 0.5) * pitch) for k in range(count)]
    parts += [block((-0.01, -HALF_M, z), (0.03, HALF_M, z + 0.07)) for z in (0.2, shoulder - 0.25)]
    parts.append(block((-0.1, -HALF_M, 0.0), (-0.01, -HALF_M + 0.09, high - 0.03), 0.006))
    white = painted_material("#e9e7e0", 0.6)
    return parts, (white if rng.chance(0.4) else _wood(rng),), high


def _panel(rng: VariantRng) -> Made:
    """A closed privacy screen between posts; boards upright or across, trellis on some."""
    high, trellis = rng.between(1.5, 1.8, "height_m"), rng.chance(0.4, "trellis")
    top = high - (0.32 if trellis else 0.0)
    boards = round((top - 0.06) / 0.14)
    pitch = (top - 0.06) / boards
    parts = []
    for k in range(boards):
        low = 0.06 + k * pitch
        out = 0.012 * (k % 2)
        parts.append(
            block((-0.012 + out, -HALF_M + 0.09, low), (0.012 + out, HALF_M, low + pitch - 0.004))
        )
    if trellis:
        step = 0.12
        for y in np.arange(-HALF_M + 0.12, HALF_M, step):
            parts.append(bar((0.0, float(y), top), (0.0, float(y), high), 0.011))
        parts += [
            bar((0.0, -HALF_M + 0.09, z), (0.0, HALF_M, z), 0.014)
            for z in (top + 0.1, top + 0.2, high - 0.01)
        ]
    parts.append(block((-0.045, -HALF_M, 0.0), (0.045, -HALF_M + 0.09, high + 0.06), 0.008, 1))
    tint = rng.choose(_STAINS)
    wood = patterned_material("texture/wood_planks?seed=2", 1.4, 0.8, tint)
    post = rng.choose((wood, painted_material("#6f7173", 0.6), GALVANISED))
    return parts, (wood, post), high


def _planks(rng: VariantRng) -> Made:
    """Boards across with gaps, on an inner post."""
    rows = rng.choose((3, 4, 5), "rows")
    wide = rng.between(0.1, 0.15, "board_m")
    gap = rng.between(0.05, 0.12, "gap_m")
    foot = rng.between(0.06, 0.15, "foot_m")
    parts = []
    for k in range(rows):
        z = foot + k * (wide + gap)
        parts.append(block((0.0, -HALF_M, z), (0.024, HALF_M, z + wide)))
    high = foot + rows * (wide + gap) - gap
    parts += [
        block((-0.09, y, 0.0), (0.0, y + 0.09, high + 0.02), 0.006) for y in (-HALF_M, -0.045)
    ]
    return parts, (_wood(rng, 1.6),), high


def _rail(rng: VariantRng) -> Made:
    """Posts with two or three rails: round or split wood, or steel tubes."""
    high, steel = rng.between(0.9, 1.2, "height_m"), rng.chance(0.4, "steel")
    count = rng.choose((2, 3), "count")
    r = 0.024 if steel else rng.between(0.045, 0.06, "radius_m")
    y = -HALF_M + r + 0.02
    post = cone((1.15 * r, 0.0), (1.1 * r, high), 8).moved(y=y)
    levels = [high - 0.06 - k * (high - 0.2) / count for k in range(count)]
    sag = 0.0 if steel else 0.02
    parts = [post]
    for z in levels:
        bend = rng.between(-sag, sag)
        path = [(0.0, -HALF_M, z), (0.0, 0.0, z + bend), (0.0, HALF_M, z)]
        parts.append(rod(path, 0.8 * r, 7))
    bark = patterned_material("texture/wood_grain?seed=2", 1.1, 0.9, rng.choose(_STAINS))
    finish = GALVANISED if rng.chance(0.6) else painted_material("#c8362a", 0.5)
    return parts, (finish if steel else bark,), high


def _iron(rng: VariantRng) -> Made:
    """Wrought or cast iron: bars with tips, rings between the rails, on a kerb in some."""
    high, foot = rng.between(1.0, 1.6, "height_m"), rng.choose((0.0, 0.0, 0.18, 0.3), "foot_m")
    parts = []
    if foot:
        parts.append(block((-0.1, -HALF_M, 0.0), (0.1, HALF_M, foot), 0.012, 1))
    low, top = foot + 0.1, high - 0.12
    rails = [low, top] + ([top - 0.13] if rng.chance(0.6) else [])
    parts += [block((-0.016, -HALF_M, z), (0.016, HALF_M, z + 0.014)) for z in rails]
    pitch = 2.0 * HALF_M / 16
    tip = lathe([(0.0, 0.0), (0.022, 0.03), (0.0, 0.1)], 5)
    for k in range(16):
        y = -HALF_M + (k + 0.5) * pitch
        parts.append(bar((0.0, y, foot), (0.0, y, high - 0.06), 0.0095))
        parts.append(tip.moved(0.0, y, high - 0.08))
        if len(rails) == 3:
            turn = np.linspace(0.0, 2.0 * math.pi, 8).tolist()
            z, r = top - 0.058, 0.5 * 0.11
            ring = [(0.0, y + 0.5 * pitch + r * math.cos(t), z + r * math.sin(t)) for t in turn]
            if k < 15:
                parts.append(rod(ring, 0.005, 3))
    parts.append(block((-0.03, -HALF_M, 0.0), (0.03, -HALF_M + 0.06, high), 0.005))
    parts.append(lathe([(0.0, 0.0), (0.03, 0.04), (0.0, 0.09)], 8).moved(0.0, -HALF_M + 0.03, high))
    stone = patterned_material("texture/concrete?seed=3", 1.5, 0.9, (0.8, 0.78, 0.74))
    return parts, (painted_material(rng.choose(_IRON_PAINTS), 0.45), stone), high


def _mesh(rng: VariantRng) -> Made:
    """Double-rod panels: uprights of 6 mm every 50 mm, pairs of 8 mm rods every 200 mm."""
    high = rng.choose((0.83, 1.03, 1.23, 1.63), "height_m")
    parts = [
        wire((0.0, float(y), 0.03), (0.0, float(y), high), 0.0035)
        for y in np.arange(-HALF_M + 0.075, HALF_M, 0.05)
    ]
    for z in np.arange(0.05, high, 0.2):
        for x in (-0.008, 0.008):
            parts.append(wire((x, -HALF_M, float(z)), (x, HALF_M, float(z)), 0.0045))
    parts.append(block((-0.05, -HALF_M, 0.0), (-0.01, -HALF_M + 0.06, high + 0.05), 0.004))
    cap = block((-0.052, -HALF_M, high + 0.05), (-0.008, -HALF_M + 0.062, high + 0.06))
    parts.append(cap)
    paint = painted_material(rng.choose(_METAL_PAINTS), 0.5)
    return parts, (GALVANISED if rng.chance(0.2) else paint,), high


def _chain_link(rng: VariantRng) -> Made:
    """Woven diamonds of 70 mm between tubular posts, and tension wires."""
    high, pitch = rng.choose((1.0, 1.25, 1.5), "height_m"), 0.085
    parts = []
    for lean in (1.0, -1.0):
        x = 0.0015 * lean
        for c in np.arange(-HALF_M - high, HALF_M, pitch):
            # The wire y = c + z, cut to the panel.
            z0, z1 = max(0.03, -HALF_M - float(c)), min(high, HALF_M - float(c))
            if z1 - z0 < 0.02:
                continue
            ends = [(x, lean * (float(c) + z), z) for z in (z0, z1)]
            parts.append(wire(ends[0], ends[1], 0.0018))
    parts += [wire((0.0, -HALF_M, z), (0.0, HALF_M, z), 0.003) for z in (0.03, 0.5 * high, high)]
    post = cone((0.024, 0.0), (0.024, high + 0.06), 10).moved(-0.026, -HALF_M + 0.024)
    parts.append(post.painted(1))
    net = GALVANISED if rng.chance(0.4) else painted_material("#2f4a38", 0.5)
    tube = GALVANISED if rng.chance(0.4) else painted_material("#2f4a38", 0.5)
    return parts, (net, tube), high


_MAKERS: Mapping[str, Callable[[VariantRng], Made]] = {
    "pickets": _pickets,
    "panel": _panel,
    "iron": _iron,
    "mesh": _mesh,
    "planks": _planks,
    "rail": _rail,
    "chain_link": _chain_link,
}
