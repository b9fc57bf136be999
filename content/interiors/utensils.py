"""Containers, tools and transport equipment of workshops, stores and cupboards; assumed sizes."""

import math
from itertools import pairwise

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.interiors.parts import (
    TOOLS,
    Box,
    board,
    cushion,
    disc,
    handle,
    posts,
    rod,
    solid,
    wood,
)
from gen_data.content.procedural import material_presets as presets
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.patches import Patch
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng, variant_rng

_DARK = presets.painted_material("#1d1e20", 0.5)
_STEEL = presets.metal_material(presets.STEEL, 0.35)


def _plastic(rng: VariantRng) -> Material:
    return Material(presets.draw_linear(TOOLS, 0.1, rng), 0.4)


def toolbox(rng: VariantRng) -> Solid:
    """A toolbox with a handle. Slots: body, dark."""
    x = 0.5 * rng.between(0.18, 0.24, "depth_m")
    y = 0.5 * rng.between(0.4, 0.54, "width_m")
    h = rng.between(0.17, 0.23, "height_m")
    body: Box = ((-x, -y, 0.0), (x, y, h))
    patches = [
        shapes.block((-x, -y, 0.0), (x, y, 0.68 * h), 0.008),
        shapes.block((-x - 0.005, -y - 0.005, 0.69 * h), (x + 0.005, y + 0.005, h), 0.02, 1),
        rod((0.0, -0.4 * y, h), (0.0, -0.4 * y, h + 0.04), 0.008, 1),
        rod((0.0, 0.4 * y, h), (0.0, 0.4 * y, h + 0.04), 0.008, 1),
        rod((0.0, -0.42 * y, h + 0.04), (0.0, 0.42 * y, h + 0.04), 0.012, 1),
    ]
    for sy in (-1, 1):
        low, high = (x, sy * 0.6 * y - 0.02, 0.55 * h), (x + 0.012, sy * 0.6 * y + 0.02, 0.8 * h)
        patches.append(shapes.block(low, high, 0.003, 1))
    return solid(patches, [_plastic(rng), _DARK], [body])


def jerry_can(rng: VariantRng) -> Solid:
    """A canister with a grip. Slots: body, cap."""
    x, y, h = 0.08, 0.5 * rng.between(0.24, 0.34, "width_m"), rng.between(0.3, 0.42, "height_m")
    patches = [cushion((-x, -y, 0.0), (x, y, 0.82 * h), 0, 0.03)]
    patches.append(rod((0.0, -0.1 * y, h - 0.02), (0.0, 0.75 * y, h - 0.02), 0.016, 0))
    for share in (-0.1, 0.75):
        patches.append(rod((0.0, share * y, 0.78 * h), (0.0, share * y, h - 0.01), 0.016, 0))
    patches.append(disc(0.0, -0.65 * y, 0.8 * h, 0.94 * h, 0.026, 1))
    return solid(patches, [_plastic(rng), _DARK], [((-x, -y, 0.0), (x, y, h))])


def paint_can(rng: VariantRng) -> Solid:
    """A tin of paint, some open. Slots: tin, paint."""
    r, h = rng.between(0.055, 0.1, "radius_m"), rng.between(0.11, 0.2, "height_m")
    inner = h - 0.02 if rng.chance(0.4) else h - 0.004
    wall = [(0.0, 0.0), (r, 0.0), (r, h), (r - 0.008, h), (r - 0.008, inner), (0.0, inner)]
    label = shapes.lathe([(r + 0.0005, 0.2 * h), (r + 0.0005, 0.8 * h)], 40, 1)
    looks = [presets.metal_material(presets.STAINLESS, 0.35), _plastic(rng)]
    return solid([shapes.lathe(wall, 40), label], looks, [((-r, -r, 0.0), (r, r, h))])


def crate(seed: int = 0) -> Solid:
    """An open crate of slats. Slot: wood."""
    rng = variant_rng("crate", seed)
    x = 0.5 * rng.between(0.28, 0.4, "depth_m")
    y = 0.5 * rng.between(0.4, 0.6, "width_m")
    h = rng.between(0.18, 0.3, "height_m")
    boxes: list[Box] = [((-x, -y, 0.0), (x, y, 0.014))]
    rows = max(2, round(h / 0.1))
    for k in range(rows):
        a, b = k * h / rows + 0.006, (k + 1) * h / rows - 0.012
        boxes += [((sx * x - 0.007, -y, a), (sx * x + 0.007, y, b)) for sx in (-1, 1)]
        boxes += [((-x, sy * y - 0.007, a), (x, sy * y + 0.007, b)) for sy in (-1, 1)]
    boxes += posts(x - 0.02, y - 0.02, h, 0.012)
    return solid([board(*b) for b in boxes], [wood(rng, 0.8)], boxes)


def barrel(rng: VariantRng) -> Solid:
    """A drum of 30 to 200 litres with beads. Slot: body."""
    r, h = rng.between(0.17, 0.29, "radius_m"), rng.between(0.5, 0.88, "height_m")
    profile = [(0.0, 0.0), (r, 0.0)]
    for share in (0.33, 0.66):
        z = share * h
        profile += [(r, z - 0.02), (r + 0.012, z), (r, z + 0.02)]
    profile += [(r, h), (r - 0.012, h), (r - 0.012, h - 0.015), (0.0, h - 0.015)]
    patches = [shapes.lathe(profile, 44), disc(0.6 * r, 0.0, h - 0.016, h + 0.002, 0.03)]
    paint = rng.choose(("#1f4e8c", "#2c6e49", "#8a2f26", "#d9b23c", "#3b4046"))
    return solid(patches, [presets.painted_material(paint, 0.4)], [((-r, -r, 0.0), (r, r, h))])


def vacuum_cleaner(rng: VariantRng) -> Solid:
    """A vacuum cleaner with its hose and tube. Slots: body, dark, steel."""
    patches: list[Patch] = [cushion((-0.2, -0.13, 0.03), (0.18, 0.13, 0.23), 0, 0.08)]
    for sy in (-1, 1):
        patches.append(rod((-0.1, sy * 0.12, 0.09), (-0.1, sy * 0.15, 0.09), 0.09, 1, 28))
    path = [(0.17, 0.0, 0.15), (0.32, 0.06, 0.28), (0.38, 0.16, 0.18), (0.36, 0.22, 0.5)]
    path += [(0.34, 0.22, 0.95)]
    patches += [rod(a, b, 0.02, 1, 14) for a, b in pairwise(path)]
    patches.append(rod((0.34, 0.22, 0.05), (0.34, 0.22, 0.95), 0.016, 2, 14))
    patches.append(cushion((0.29, 0.08, 0.0), (0.39, 0.36, 0.05), 1, 0.02))
    boxes: list[Box] = [
        ((-0.2, -0.15, 0.0), (0.18, 0.15, 0.23)),
        ((0.29, 0.08, 0.0), (0.4, 0.36, 0.95)),
    ]
    return solid(patches, [_plastic(rng), _DARK, _STEEL], boxes)


def iron(rng: VariantRng) -> Solid:
    """A steam iron. Slots: body, sole."""
    outline = [(0.14, 0.0), (0.06, 0.052), (-0.11, 0.058), (-0.11, -0.058), (0.06, -0.052)]
    points = np.array(outline)
    patches = [
        shapes.extrude(points, 0.01, 0.002, slot=1),
        shapes.extrude(0.92 * points, 0.05, 0.008).moved(z=0.01),
        rod((-0.09, 0.0, 0.05), (-0.09, 0.0, 0.125), 0.018),
        rod((0.04, 0.0, 0.05), (0.02, 0.0, 0.125), 0.016),
        rod((-0.1, 0.0, 0.125), (0.03, 0.0, 0.125), 0.018),
    ]
    looks = [_plastic(rng), presets.metal_material(presets.STAINLESS, 0.2)]
    return solid(patches, looks, [((-0.11, -0.058, 0.0), (0.14, 0.058, 0.14))])


def globe(rng: VariantRng) -> Solid:
    """A globe on a stand. Slots: sea, stand."""
    r = rng.between(0.09, 0.15, "radius_m")
    z = r + 0.07
    ball = shapes.ball(lambda d: r * d, 20, 32).moved(0.0, 0.0, z)
    patches = [
        ball,
        disc(0, 0, 0.0, 0.015, 0.7 * r, 1, 32),
        rod((0, 0, 0.01), (0, 0, 0.07), 0.008, 1),
    ]
    for k in range(10):
        a, b = (0.5 * math.pi * (k + s) / 5 - 0.5 * math.pi for s in (0, 1))
        start = (0.0, 1.06 * r * math.cos(a), z + 1.06 * r * math.sin(a))
        end = (0.0, 1.06 * r * math.cos(b), z + 1.06 * r * math.sin(b))
        patches.append(rod(start, end, 0.004, 1, 8))
    sea = Material(presets.draw_linear(("#3f6f9f", "#c9b487", "#7aa0b8"), 0.1, rng), 0.3)
    return solid(patches, [sea, wood(rng)], [((-r, -r, 0.0), (r, r, z + r))])


def umbrella_stand(rng: VariantRng) -> Solid:
    """A stand with closed umbrellas. Slots: stand, cloth, grip."""
    r, h = rng.between(0.1, 0.13, "radius_m"), rng.between(0.42, 0.55, "height_m")
    wall = [(0.0, 0.0), (r, 0.0), (r, h), (r - 0.005, h), (r - 0.005, 0.01), (0.0, 0.01)]
    patches = [shapes.lathe(wall, 36)]
    for k in range(int(rng.between(1, 4))):
        c, s = math.cos(2.0 * k), math.sin(2.0 * k)
        foot, tip = (0.05 * c, 0.05 * s, 0.02), (0.8 * r * c, 0.8 * r * s, h + 0.22)
        patches.append(rod(foot, tip, 0.026, 1, 12))
        patches.append(rod(tip, (1.05 * tip[0], 1.05 * tip[1], h + 0.36), 0.012, 2))
    return solid(patches, [_STEEL, _plastic(rng), wood(rng)], [((-r, -r, 0.0), (r, r, h + 0.3))])


def hand_truck(rng: VariantRng) -> Solid:
    """A hand truck that stands upright. Slots: frame, dark."""
    h, w = rng.between(1.05, 1.25, "height_m"), 0.2
    patches: list[Patch] = [shapes.block((0.0, -w, 0.0), (0.26, w, 0.012), 0.002)]
    for sy in (-1, 1):
        patches.append(rod((0.0, sy * w, 0.0), (-0.04, sy * w, h), 0.016))
        patches.append(rod((-0.09, sy * w, 0.12), (-0.09, sy * (w + 0.06), 0.12), 0.12, 1, 28))
    for k in range(5):
        z = 0.15 + 0.2 * k
        patches.append(rod((-0.03, -w, z), (-0.03, w, z), 0.011))
    patches.append(rod((-0.04, -w - 0.02, h), (-0.04, w + 0.02, h), 0.02, 1))
    paint = presets.painted_material(rng.choose(("#a3261d", "#1f4e8c", "#2c2f33")), 0.35)
    return solid(patches, [paint, _DARK], [((-0.2, -w - 0.06, 0.0), (0.26, w + 0.06, h))])


def vise(rng: VariantRng) -> Solid:
    """A bench vise. Slots: body, steel."""
    boxes: list[Box] = [
        ((-0.09, -0.07, 0.0), (0.05, 0.07, 0.03)),
        ((-0.08, -0.05, 0.03), (0.0, 0.05, 0.15)),
        ((0.04, -0.05, 0.05), (0.1, 0.05, 0.15)),
    ]
    patches = [shapes.block(*b, 0.008) for b in boxes]
    patches.append(rod((-0.05, 0.0, 0.07), (0.2, 0.0, 0.07), 0.016, 1))
    patches.append(rod((0.19, -0.09, 0.07), (0.19, 0.09, 0.07), 0.006, 1))
    for x in (0.0, 0.034):
        patches.append(shapes.block((x, -0.05, 0.12), (x + 0.006, 0.05, 0.15), 0.0, 1))
    paint = presets.painted_material(rng.choose(("#2f5d7c", "#3d7a4c", "#3b4046")), 0.4)
    return solid(patches, [paint, _STEEL], boxes)


def first_aid_box(rng: VariantRng) -> Solid:
    """A first-aid box. Slots: body, cross."""
    x, y, h = 0.05, 0.5 * rng.between(0.22, 0.28, "width_m"), rng.between(0.17, 0.22, "height_m")
    z = 0.5 * h
    patches = [
        shapes.block((-x, -y, 0.0), (x, y, h), 0.012),
        shapes.block((x, -0.05, z - 0.016), (x + 0.001, 0.05, z + 0.016), 0.0, 1),
        shapes.block((x, -0.016, z - 0.05), (x + 0.001, 0.016, z + 0.05), 0.0, 1),
        *handle(x, 0.0, h - 0.015, 0.08, 1, upright=False),
    ]
    green = rng.chance(0.5)
    paints = ("#1f7a4d", "#f3f3f0") if green else ("#f3f3f0", "#b01218")
    looks = [presets.painted_material(paints[0], 0.4), presets.painted_material(paints[1], 0.4)]
    return solid(patches, looks, [((-x, -y, 0.0), (x, y, h))])
