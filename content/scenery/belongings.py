"""Belongings that people take along: prams, suitcases, shopping bags.

Sizes: assumed from makers' catalogues, 10 %.
"""

import math

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import (
    draw_linear,
    painted_material,
    patterned_material,
    plastic_material,
    printed_material,
)
from gen_data.content.procedural.patches import Patch, join_patches
from gen_data.content.procedural.surface_shapes import block, circle, cone, grid, lathe, rounded_box
from gen_data.content.scenery.basic_shapes import facing_rectangle, make_solid
from gen_data.content.scenery.clutter_shapes import (
    Rectangle,
    bar,
    hopper,
    on_ground,
    rod,
    worn_steel,
)
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng

PRAMS = ("carrycot", "buggy", "carrycot", "buggy")
SUITCASES = ("hard", "soft", "duffel", "hard", "backpack")
_FABRICS = ("#23262b", "#2f3e5c", "#5d6b70", "#7a2f3a", "#3f5b45", "#9a8f7d", "#b9b4aa", "#c2743a")


def pram(rng: VariantRng) -> Solid:
    """A pram or buggy without a child, pushed towards +X by a handle at -X.

    Slots: frame, fabric, tyre, trim.
    """
    kind = rng.turn(PRAMS, "kind")
    r, wide = (0.14, 0.27) if kind == "carrycot" else (0.1, 0.23)
    front, rear, grip = 0.36, -0.34, rng.between(0.98, 1.06, "grip_scale")
    parts: list[Patch] = []
    for y in (-wide, wide):
        for x, size in ((front, 0.8 * r), (rear, r)):
            parts += [part.moved(x, y, size) for part in _wheel(size)]
        parts.append(rod([(front, y, 0.8 * r), (-0.1, y, 0.55), (-0.48, y, grip)], 0.013, 6))
        parts.append(rod([(rear, y, r), (0.12, y, 0.52)], 0.012, 6))
    piece = rod([(-0.48, -wide, grip), (-0.52, 0.0, grip + 0.02), (-0.48, wide, grip)], 0.017, 6, 3)
    parts.append(piece)
    parts.append(bar((rear, -wide, r), (rear, wide, r), 0.01, 5))
    basket = Rectangle(-0.28, 0.2, -wide + 0.06, wide - 0.06)
    parts.append(hopper(basket, Rectangle(-0.32, 0.24, -wide + 0.03, wide - 0.03), (0.16, 0.3), 3))
    y = wide - 0.03
    if kind == "carrycot":
        low = Rectangle(-0.34, 0.34, -y + 0.05, y - 0.05)
        parts.append(hopper(low, Rectangle(-0.42, 0.42, -y, y), (0.5, 0.74), 1))
        cover = rounded_box((0.48, 2 * y, 0.07), 0.03, 1).moved(0.18, 0.0, 0.75)
        parts += [cover.painted(1), _hood(0.72, (-0.18, 0.32), y, 0.95 * math.pi)]
    else:
        parts.append(block((-0.1, -y, 0.42), (0.22, y, 0.47), 0.02, 1))
        rest = block((-0.02, -y, 0.0), (0.02, y, 0.55), 0.02, 1).rotated("y", -0.38)
        parts += [rest.moved(-0.1, 0.0, 0.45), block((0.2, -y, 0.28), (0.24, y, 0.45), 0.015, 1)]
        parts.append(block((0.24, -y, 0.24), (0.4, y, 0.28), 0.0, 3))
        parts += [_hood(0.9, (-0.24, 0.24), y, 0.7 * math.pi)]
        parts.append(bar((0.2, -y, 0.66), (0.2, y, 0.66), 0.014, 6, 3))
    fabric = patterned_material("texture/fabric?seed=2", 0.15, 0.9, draw_linear(_FABRICS, 0.1, rng))
    materials = (
        rng.choose((worn_steel(rng), painted_material("#1d1e20", 0.4))),
        fabric,
        painted_material("#1a1a1b", 0.8),
        painted_material("#26272a", 0.7),
    )
    shells = [hulls.box((-0.4, -wide, 0.0), (0.4, wide, 0.75))]
    return make_solid(on_ground(parts), materials, shells)


def _wheel(radius: float) -> list[Patch]:
    """A wheel about the origin, its axle along Y."""
    ring = circle(0.018, 5) + np.array([radius - 0.018, 0.0])
    tyre = lathe([*map(tuple, ring.tolist()), tuple(ring[0].tolist())], 14, 2)
    disc = cone((radius - 0.03, -0.008), (radius - 0.03, 0.008), 10, 3)
    return [part.rotated("x", 0.5 * math.pi) for part in (tyre, disc)]


def _hood(z: float, arc: tuple[float, float], y: float, span_rad: float) -> Patch:
    """A folding hood: a quarter of a drum about an axis along Y; ``arc`` is its x and radius."""
    x, r = arc
    turn = np.linspace(math.pi - 0.1, math.pi - 0.1 - 0.62 * span_rad, 7)
    across = np.array([-1.0, -0.96, -0.6, 0.0, 0.6, 0.96, 1.0])
    reach = np.array([0.0, 0.8, 0.97, 1.0, 0.97, 0.8, 0.0])
    points = np.zeros((7, 7, 3))
    points[..., 0] = x + r * np.cos(turn)[:, None] * reach[None, :]
    points[..., 1] = y * across[None, :]
    points[..., 2] = z + r * np.sin(turn)[:, None] * reach[None, :]
    outer = grid(points, slot=1)
    return join_patches([outer.flipped(), outer.moved(z=-0.012)])


def suitcase(rng: VariantRng) -> Solid:
    """Luggage that stands on the ground: a trolley case, a holdall or a backpack.

    Slots: shell, trim, wheels, second fabric.
    """
    kind = rng.turn(SUITCASES, "kind")
    if kind in {"hard", "soft"}:
        parts, high = _trolley(kind == "hard", rng)
    elif kind == "duffel":
        parts, high = _holdall(rng)
    else:
        parts, high = _backpack(rng)
    fabric = patterned_material("texture/fabric?seed=4", 0.12, 0.9, draw_linear(_FABRICS, 0.1, rng))
    materials = (
        plastic_material(rng) if kind == "hard" else fabric,
        painted_material(rng.choose(("#1d1e20", "#8d9091")), 0.5),
        painted_material("#151516", 0.7),
        Material(draw_linear(_FABRICS, 0.1, rng), 0.9),
    )
    shells = [hulls.box((-0.1, -0.15, 0.0), (0.1, 0.15, 0.9 * high))]
    return make_solid(on_ground(parts), materials, shells)


def _trolley(hard: bool, rng: VariantRng) -> tuple[list[Patch], float]:
    """A case on four wheels with ribs or pockets and a drawn-out handle on some."""
    high, wide, deep = rng.choose(((0.5, 0.36, 0.22), (0.62, 0.43, 0.26), (0.7, 0.48, 0.3)))
    foot = 0.05
    parts = [rounded_box((deep, wide, high), 0.05 if hard else 0.03, 2).moved(z=foot + 0.5 * high)]
    if hard:
        for y in np.linspace(-0.36 * wide, 0.36 * wide, 5).tolist():
            rib = block((-0.5 * deep - 0.006, y - 0.014, foot + 0.06),
                        (0.5 * deep + 0.006, y + 0.014, foot + high - 0.06), 0.005)  # fmt: skip
            parts.append(rib)
        parts.append(block((-0.012, -0.5 * wide - 0.002, foot + 0.01),
                           (0.012, 0.5 * wide + 0.002, foot + high + 0.002), 0.0, 1))  # fmt: skip
    else:
        for low, top in ((0.08, 0.5), (0.55, 0.9)):
            pocket = block((0.5 * deep - 0.01, -0.4 * wide, foot + low * high),
                           (0.5 * deep + 0.03, 0.4 * wide, foot + top * high), 0.02, 3)  # fmt: skip
            parts.append(pocket)
    for x in (-0.4 * deep, 0.4 * deep):
        for y in (-0.38 * wide, 0.38 * wide):
            tyre = cone((0.026, -0.012), (0.026, 0.012), 8, 2).rotated("x", 0.5 * math.pi)
            parts.append(tyre.moved(x, y, 0.026))
    top = foot + high
    drawn = top + (0.42 if rng.chance(0.6) else 0.03)
    x, y = -0.3 * deep, 0.26 * wide
    path = [(x, -y, top - 0.02), (x, -y, drawn), (x, y, drawn), (x, y, top - 0.02)]
    parts.append(rod(path, 0.011, 5, 1))
    grip = [
        (0.05, -0.08, top),
        (0.05, -0.06, top + 0.035),
        (0.05, 0.06, top + 0.035),
        (0.05, 0.08, top),
    ]
    parts.append(rod(grip, 0.011, 5, 1))
    return parts, top


def _holdall(rng: VariantRng) -> tuple[list[Patch], float]:
    half, r = 0.5 * rng.between(0.5, 0.66, "width_m"), rng.between(0.14, 0.17, "radius_m")
    profile = [(0.0, -half), (0.8 * r, -half), (r, -0.85 * half), (r, 0.85 * half), (0.8 * r, half),
               (0.0, half)]  # fmt: skip
    body = lathe(profile, 16).rotated("x", 0.5 * math.pi).scaled(1.0, 1.0, 0.9).moved(z=0.9 * r)
    parts = [body]
    for y in (-0.4 * half, 0.4 * half):
        band = lathe([(1.01 * r, -0.02), (1.01 * r, 0.02)], 16, 3).rotated("x", 0.5 * math.pi)
        parts.append(band.scaled(1.0, 1.0, 0.9).moved(0.0, y, 0.9 * r))
    for x in (-0.05, 0.05):
        loop = [(x, -0.4 * half, 1.75 * r), (x, -0.25 * half, 1.8 * r + 0.12),
                (x, 0.25 * half, 1.8 * r + 0.12), (x, 0.4 * half, 1.75 * r)]  # fmt: skip
        parts.append(rod(loop, 0.011, 5, 3))
    return parts, 1.8 * r


def _backpack(rng: VariantRng) -> tuple[list[Patch], float]:
    high, wide, deep = rng.between(0.48, 0.6, "height_m"), 0.32, 0.2
    foot = Rectangle.about(0, 0, deep, wide)
    neck = Rectangle.about(-0.02, 0, 0.75 * deep, 0.86 * wide)
    lid = rounded_box((0.85 * deep, 0.95 * wide, 0.1), 0.04, 2).moved(-0.02, 0.0, high - 0.04)
    pocket = rounded_box((0.1, 0.75 * wide, 0.42 * high), 0.04, 2)
    pocket = pocket.moved(0.5 * deep, 0.0, 0.28 * high)
    parts = [hopper(foot, neck, (0.0, high - 0.06)), lid.painted(3), pocket.painted(3)]
    for y in (-0.25 * wide, 0.25 * wide):
        strap = [
            (-0.07, y, high - 0.06),
            (-0.16, y, 0.75 * high),
            (-0.15, y, 0.4 * high),
            (-0.1, y, 0.08),
        ]
        parts.append(rod(strap, 0.018, 5, 1))
    return parts, high


def shopping_bags(rng: VariantRng) -> Solid:
    """One to four bags side by side: printed paper with cord handles, carrier bags, a full tote.

    Slots: first and second paper, print, cords, goods.
    """
    count = rng.turn((1, 2, 3, 4), "count")
    parts, at = [], 0.0
    for k in range(count):
        d, w, h = rng.between(0.1, 0.17), rng.between(0.2, 0.36), rng.between(0.26, 0.44)
        bag = join_patches(_paper_bag((d, w, h), k % 2, rng))
        at += 0.5 * w + (0.04 if k else 0.0)
        parts.append(bag.rotated("z", rng.between(-0.25, 0.25)).moved(rng.between(-0.08, 0.08), at))
        at += 0.5 * w
    low, high = join_patches(parts).bounds_m()
    x, y = (-0.5 * float(low[k] + high[k]) for k in (0, 1))
    parts = [part.moved(x, y, -float(low[2])) for part in parts]
    plain = patterned_material("texture/cardboard?seed=1", 0.8, 0.9)
    colors = ("#f2f0ea", "#b3261e", "#22406f", "#1a1b1d", "#2f6f4a", "#d9a520", "#e8a0b4")
    materials = (
        rng.choose((plain, Material(draw_linear(colors, 0.05, rng), 0.7))),
        Material(draw_linear(colors, 0.05, rng), 0.5),
        printed_material(f"texture/poster?seed={rng.seed % 12}", 0.5),
        painted_material(rng.choose(("#1a1b1d", "#c9b48a")), 0.8),
        painted_material(rng.choose(("#3f6a2f", "#d9a05a", "#b8261e")), 0.6),
    )
    hull = hulls.box(
        (-0.07, 0.9 * (float(low[1]) + y), 0.0), (0.07, 0.9 * (float(high[1]) + y), 0.25)
    )
    return make_solid(parts, materials, [hull])


def _paper_bag(size: tuple[float, float, float], slot: int, rng: VariantRng) -> list[Patch]:
    """A bag with a print in front, cords, and goods that look out of it."""
    d, w, h = size
    foot, mouth = Rectangle.about(0, 0, d, w), Rectangle.about(0, 0, 0.75 * d, 1.02 * w)
    parts = [hopper(foot, mouth, (0.0, h), slot, open_above=True)]
    parts.append(block((-0.35 * d, -0.45 * w, h - 0.05), (0.35 * d, 0.45 * w, h - 0.03), 0.0, 4))
    slope = 0.125 * d / h
    low, high = 0.25 * h, min(0.8 * h, 0.25 * h + 0.7 * w)
    face = facing_rectangle(0.0, (-0.25 * w, 0.25 * w), (0.0, high - low), 2)
    face = face.rotated("y", -math.atan(slope))
    parts.append(face.moved(0.5 * d - slope * low + 0.002, 0.0, low))
    for x in (-0.3 * d, 0.3 * d):
        cord = [
            (x, -0.2 * w, h - 0.01),
            (x, -0.12 * w, h + 0.1),
            (x, 0.12 * w, h + 0.1),
            (x, 0.2 * w, h - 0.01),
        ]
        parts.append(rod(cord, 0.004, 4, 3))
    if rng.chance(0.4):
        goods = rounded_box((0.5 * d, 0.3 * w, 0.14), 0.02, 1).painted(4)
        parts.append(goods.moved(0.0, rng.between(-0.2, 0.2) * w, h + 0.01))
    return parts
