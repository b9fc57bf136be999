"""Parts of a petrol station besides the canopy, and a fountain for squares.

Sizes: assumed from pictures, 20 %. Frame: metres, Z up, front +X, origin on the ground.
"""

import math

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import (
    painted_material,
    patterned_material,
    printed_material,
)
from gen_data.content.procedural.patches import Patch
from gen_data.content.procedural.surface_shapes import ball, block, cone, lathe
from gen_data.content.scenery.basic_shapes import facing_rectangle, make_solid
from gen_data.content.scenery.clutter_shapes import worn_paint
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng, in_turn

BRANDS = ("#1f5fa8 #e9e9e4", "#d9a520 #b3261e", "#2f7a3a #e0c020", "#b3261e #e9e9e4")
FOUNTAINS = ("bowl", "column", "jet", "bowl")


def petrol_shop(rng: VariantRng) -> Solid:
    """The shop of a petrol station: a flat box with a glass front to +X and a coloured fascia.

    Slots: walls, frames, panes, fascia, stripe, posters, base.
    """
    x = 0.5 * rng.between(6.5, 9.0, "depth_m")
    half = 0.5 * rng.between(10.0, 15.0, "width_m")
    high = rng.between(3.6, 4.2, "height_m")
    parts = [
        block((-x, -half, 0.0), (x, half, high - 0.8), 0.0, 0),
        block((-x - 0.15, -half - 0.15, high - 0.8), (x + 0.9, half + 0.15, high), 0.02, 3),
        block((x + 0.88, -half - 0.16, high - 0.3), (x + 0.92, half + 0.16, high - 0.15), 0.0, 4),
        block((-x - 0.02, -half - 0.02, 0.0), (x + 0.02, half + 0.02, 0.25), 0.0, 6),
    ]
    bays = 7
    width = 1.6 * half / bays
    for k in range(bays):
        a = -0.8 * half + k * width
        foot = 0.05 if k == bays // 2 else 0.35
        pane = (a + 0.05, a + width - 0.05), (foot, high - 1.15)
        parts.append(facing_rectangle(x + 0.03, *pane, 2))
        parts.append(block((x, a - 0.04, 0.25), (x + 0.06, a + 0.04, high - 0.95), 0.0, 1))
        if k != bays // 2 and rng.chance(0.45):
            middle = a + 0.5 * width
            low = rng.between(0.5, 1.0)
            parts.append(facing_rectangle(x + 0.04, (middle - 0.35, middle + 0.35),
                                          (low, low + 1.0), 5))  # fmt: skip
    wide = 0.8 * half + 0.1
    parts.append(block((x, -wide, high - 1.05), (x + 0.08, wide, high - 0.95), 0.0, 1))
    first, second = in_turn(BRANDS, rng.seed).split()
    materials = (
        patterned_material("texture/concrete?seed=1", 3.0, 0.85, (0.9, 0.89, 0.86)),
        painted_material("#3b3d3f", 0.4),
        Material((0.05, 0.055, 0.06), roughness=0.08, role="window"),
        worn_paint((first,), 0.4, rng),
        worn_paint((second,), 0.4, rng),
        printed_material(f"texture/poster?seed={rng.seed % 12}", 0.5),
        painted_material("#55585a", 0.8),
    )
    return make_solid(parts, materials, [hulls.box((-x, -half, 0.0), (x, half, high))])


def price_sign(rng: VariantRng) -> Solid:
    """The pylon sign of a petrol station: an emblem over rows of prices, readable from +X and -X.

    Slots: body, stripe, display, digits, base.
    """
    high = rng.between(5.0, 7.5, "height_m")
    half = 0.5 * rng.between(1.5, 1.9, "width_m")
    thick = 0.16
    parts = [
        block((-0.3, -half - 0.1, 0.0), (0.3, half + 0.1, 0.25), 0.02, 4),
        block((-thick, -half, 0.25), (thick, half, high), 0.02, 0),
        block((-thick - 0.01, -half - 0.01, high - 1.65),
              (thick + 0.01, half + 0.01, high - 1.5), 0.0, 1),
    ]  # fmt: skip
    emblem = cone((0.45 * half, 0.0), (0.45 * half, 2.0 * thick + 0.04), 20, 1)
    parts.append(emblem.rotated("y", 0.5 * math.pi).moved(-thick - 0.02, 0.0, high - 0.8))
    for row in range(4):
        top = high - 1.9 - 0.62 * row
        for way in (1.0, -1.0):
            face = facing_rectangle(thick + 0.006, (-0.1, half - 0.1), (top - 0.48, top), 2)
            digits = [
                facing_rectangle(thick + 0.012, (y, y + 0.1), (top - 0.42, top - 0.06), 3)
                for y in np.linspace(0.0, half - 0.3, 4).tolist()
            ]
            name = facing_rectangle(
                thick + 0.006, (-half + 0.15, -0.25), (top - 0.36, top - 0.12), 3
            )
            for part in (face, *digits, name):
                parts.append(part if way > 0.0 else part.rotated("z", math.pi))
    first, second = in_turn(BRANDS, rng.seed).split()
    materials = (
        worn_paint((first,), 0.4, rng),
        worn_paint((second,), 0.4, rng),
        painted_material("#101214", 0.3),
        painted_material("#e6e2d4", 0.4),
        patterned_material("texture/concrete?seed=3", 1.8, 0.9),
    )
    hull = hulls.box((-thick, -half, 0.0), (thick, half, high))
    return make_solid(parts, materials, [hull])


def fountain(rng: VariantRng) -> Solid:
    """A fountain of stone: a basin with a bowl, a column with spouts, or a low jet.

    Slots: stone, water, steel.
    """
    kind = rng.turn(FOUNTAINS, "kind")
    radius, rim = rng.between(1.6, 2.8, "radius_m"), rng.between(0.45, 0.6, "rim_m")
    sides = rng.choose((8, 24, 24), "sides")
    profile = [(radius + 0.25, 0.0), (radius + 0.25, 0.12), (radius, 0.14), (radius, rim - 0.08),
               (radius + 0.08, rim - 0.06), (radius + 0.08, rim), (radius - 0.24, rim),
               (radius - 0.24, rim - 0.16)]  # fmt: skip
    surface = [(radius - 0.24, rim - 0.16), (0.0, rim - 0.16)]
    parts = [lathe(profile, sides), lathe(surface, sides, 1)]
    if kind == "bowl":
        z = rim + rng.between(0.7, 1.0)
        bowl = [(0.22, 0.0), (0.16, 0.3), (0.18, z - 0.15), (0.9, z + 0.15), (0.95, z + 0.22),
                (0.86, z + 0.2)]  # fmt: skip
        parts += [lathe(bowl, 18), lathe([(0.86, z + 0.19), (0.0, z + 0.2)], 18, 1)]
        parts.append(cone((0.1, z + 0.1), (0.05, z + 0.65), 10))
    elif kind == "column":
        high = rng.between(2.2, 3.2, "height_m")
        parts.append(block((-0.3, -0.3, 0.0), (0.3, 0.3, high - 0.5), 0.04))
        parts.append(block((-0.4, -0.4, high - 0.5), (0.4, 0.4, high - 0.35), 0.03))
        knob = ball(lambda d: 0.3 * d, 8, 12).moved(z=high - 0.1)
        parts += [knob, *(_spout(k) for k in range(4))]
    else:
        parts += [cone((0.18, 0.0), (0.06, rim + 0.25), 10, 2)]
        parts.append(cone((0.05, rim + 0.2), (0.02, rim + rng.between(0.9, 1.6)), 6, 1))
    stone = patterned_material("texture/ashlar?seed=1", 1.6, 0.85, rng.choose(((0.75, 0.7, 0.62),
        (0.62, 0.6, 0.58), (0.8, 0.66, 0.55))))  # fmt: skip
    water = Material((0.1, 0.16, 0.16), roughness=0.06, specular=0.6)
    hull = hulls.frustum((radius + 0.1, 0.0), (radius + 0.1, rim), 16)
    return make_solid(parts, (stone, water, painted_material("#8d9091", 0.35)), [hull])


def _spout(number: int) -> Patch:
    """A short pipe on one side of the column."""
    pipe = cone((0.03, 0.25), (0.025, 0.55), 8, 2).rotated("y", 0.5 * math.pi)
    return pipe.rotated("z", 0.5 * math.pi * number).moved(z=1.1)
