"""Parts of furniture: boards, cushions, legs and rods, and the materials they are made of."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import material_presets as presets
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.patches import Patch, make_solid_in_place
from gen_data.core.asset_types import Material
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng, in_turn

Box = tuple[Vec3, Vec3]
Measures = Mapping[str, Any]
"""Sizes [m], counts and choices of a family by name, as ``families.yaml`` lists them: a value,
``[low, high]`` to draw between, ``{turn: [...]}``, or ``{by: name, value: measure, ...}`` after an
earlier one."""
LACQUERS = (
    *("#f1f0ec", "#f1f0ec", "#eceae5", "#e6e4de", "#d9d7d1", "#b7b6b2", "#8b8c8c", "#3b3d3f"),
    *("#b9c2bd", "#66737a", "#939d8d"),
)
"""Lacquers of furniture, sRGB: seven in ten are white or grey."""
GRAIN_M = 0.5
"""Length across the grain of a repeat of ``texture/wood_grain``."""
HOUSEHOLD = (
    "#f2f0ea", "#e6e2d8", "#d9d2c3", "#b8b5ad", "#2b2d30", "#5b6670", "#7d8a86", "#3f5d73",
    "#8a5a4a", "#c7b299", "#a3b1a6", "#6e7f5f", "#b98a3e", "#9c3d33",
)  # fmt: skip
"""Plastics in homes and offices, sRGB: most are pale, grey or dull."""
TOOLS = (
    *("#2b2d30", "#3b4046", "#c9a227", "#a3261d", "#1f4e79", "#2f6f4f", "#d9641e", "#8d9093"),
    "#d9d6cf",
)
"""Plastics and paints of tools and containers, sRGB."""
_WOODS = 18
_FABRICS = 16
_STEEL_SHEETS = (7, 13, 14)
"""Seeds of ``texture/brushed_metal`` that are neutral and bright."""


def drawn(rng: VariantRng, measures: Measures) -> dict[str, Any]:
    """The measures of a variant by name; draws are taken in the order of the row."""
    made: dict[str, Any] = {}
    for name, given in measures.items():
        if isinstance(given, list):
            low, high = given
            made[name] = rng.between(low, high, name)
        elif isinstance(given, Mapping):
            by = given.get("by")
            made[name] = given[made[by]] if by else rng.turn(tuple(given["turn"]), name)
        else:
            made[name] = given
    return made


def board(low: Vec3, high: Vec3, slot: int = 0, radius_m: float = 0.002) -> Patch:
    """A board whose grain runs along its longest side."""
    return shapes.map_along_grain(shapes.block(low, high, radius_m, slot), GRAIN_M)


def cushion(low: Vec3, high: Vec3, slot: int = 0, radius_m: float = 0.05) -> Patch:
    """An upholstered block with round edges."""
    size = tuple(b - a for a, b in zip(low, high, strict=True))
    middle = [0.5 * (a + b) for a, b in zip(low, high, strict=True)]
    radius = min(radius_m, 0.49 * min(size))
    return shapes.rounded_box((size[0], size[1], size[2]), radius, 3).moved(*middle).painted(slot)


def rod(a: Vec3, b: Vec3, radius_m: float, slot: int = 0, sides: int = 10) -> Patch:
    """A round bar between two points."""
    path = np.array([a, b], dtype=np.float64)
    up = (1.0, 0.0, 0.0) if abs(b[2] - a[2]) > abs(b[0] - a[0]) else (0.0, 0.0, 1.0)
    if abs(b[1] - a[1]) > max(abs(b[0] - a[0]), abs(b[2] - a[2])):
        up = (0.0, 0.0, 1.0)
    return shapes.sweep(path, shapes.circle(radius_m, sides), up=up, slot=slot)


def disc(
    x: float, y: float, z0: float, z1: float, radius_m: float, slot: int = 0, sides: int = 24
) -> Patch:
    """An upright cylinder with slightly rounded edges, its grain straight across."""
    r = min(0.004, 0.3 * (z1 - z0), 0.3 * radius_m)
    profile = [
        (0.0, z0),
        (radius_m - r, z0),
        (radius_m, z0 + r),
        (radius_m, z1 - r),
        (radius_m - r, z1),
        (0.0, z1),
    ]
    return shapes.map_along_grain(shapes.lathe(profile, sides, slot).moved(x, y), GRAIN_M)


def four_legs(
    depth_m: float, width_m: float, top_m: float, side_m: float, slot: int, inset_m: float = 0.03
) -> list[Patch]:
    """Square legs under a rectangle about the origin."""
    x, y, h = 0.5 * depth_m - inset_m, 0.5 * width_m - inset_m, 0.5 * side_m
    return [board(*post, slot) for post in posts(x, y, top_m, h)]


def posts(x_m: float, y_m: float, top_m: float, half_m: float) -> list[Box]:
    """Posts from the floor with a square section of twice ``half_m``, see ``at_corners``."""
    return [
        ((x - half_m, y - half_m, 0.0), (x + half_m, y + half_m, top_m))
        for x, y in shapes.at_corners(x_m, y_m)
    ]


def handle(x: float, y: float, z: float, length_m: float, slot: int, upright: bool) -> list[Patch]:
    """A bar handle before a front at ``x``, about (y, z)."""
    half = 0.5 * length_m
    dy, dz = (0.0, half) if upright else (half, 0.0)
    bar = shapes.block(
        (x + 0.022, y - dy - 0.005, z - dz - 0.005),
        (x + 0.032, y + dy + 0.005, z + dz + 0.005),
        0.002,
        slot,
    )
    feet = [
        shapes.block(
            (x, y + s * 0.8 * dy - 0.004, z + s * 0.8 * dz - 0.004),
            (x + 0.024, y + s * 0.8 * dy + 0.004, z + s * 0.8 * dz + 0.004),
            0.0,
            slot,
        )
        for s in (-1, 1)
    ]
    return [bar, *feet]


def solid(patches: Sequence[Patch], materials: Sequence[Material], boxes: Sequence[Box]) -> Solid:
    """An object in its own frame, with boxes for collisions."""
    return make_solid_in_place(patches, materials, [hulls.box(*b) for b in boxes])


def wood(rng: VariantRng, roughness: float = 0.45) -> Material:
    """Oiled or varnished wood."""
    texture = f"texture/wood_grain?seed={int(rng.between(0, _WOODS))}"
    return presets.patterned_material(texture, 0.0, roughness)


def lacquer(rng: VariantRng, roughness: float = 0.35) -> Material:
    """A lacquered front."""
    return presets.painted_material(rng.choose(LACQUERS), roughness)


def front(rng: VariantRng) -> Material:
    """Wood or lacquer."""
    return wood(rng) if rng.chance(0.55) else lacquer(rng)


def upholstery(rng: VariantRng) -> Material:
    """Fabric or leather."""
    if rng.chance(0.25):
        return presets.patterned_material(
            f"texture/leather?seed={int(rng.between(0, 16))}", 0.2, 0.55
        )
    texture = f"texture/fabric?seed={int(rng.between(0, _FABRICS))}"
    return presets.patterned_material(texture, 0.15, 0.95)


def cloth(rng: VariantRng) -> Material:
    """Plain cloth."""
    return Material(presets.draw_linear(presets.PALETTES["cloth"], 0.08, rng), 0.95)


def brushed_steel(seed: int) -> Material:
    """Sheet of stainless steel as on kitchen appliances, brushed along Y."""
    texture = f"texture/brushed_metal?seed={in_turn(_STEEL_SHEETS, seed)}"
    return replace(presets.patterned_material(texture, 0.15, 0.42), metallic=1.0)


def ceramic(roughness: float = 0.12) -> Material:
    """White sanitary ware."""
    return presets.painted_material("#f1f0ec", roughness)
