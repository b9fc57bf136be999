"""Railway track on both sides of a level crossing.

Frame: along X, origin on the ground below its middle.
"""

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural import patches, surface_shapes
from gen_data.content.scenery.basic_shapes import make_solid
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import variant_rng

GAUGE_M, HEAD_M = 1.435, 0.072
"""Standard gauge, and the head of the rail 60E1: 72 mm, 172 mm high (EN 13674-1, by the tables of
makers: Rail Section Properties, EN13674-1:2011; GNEE Rail)."""
TOP_M = 0.55
"""Height of the rails' heads over the foot of the ballast."""
_BED_M, _FOOT_M, _BED_TOP_M = 1.8, 2.4, 0.47
"""Half widths of the ballast above and below, and its height: filled up as near level crossings
(assumed, 10 %)."""
_SLEEPER_M, _PITCH_M = (0.26, 2.6), 0.6
"""Width and length of a concrete sleeper, and the distance of two (usual sizes; assumed, 5 %)."""


def railway_track(seed: int, length_m: float) -> Solid:
    """A straight track on ballast; slots: ballast, sleepers, rails.

    Args:
        seed: Seed of colours.
        length_m: Length.
    """
    half = 0.5 * length_m
    y = np.array([-_FOOT_M, -_BED_M, _BED_M, _FOOT_M])
    z = np.array([0.0, _BED_TOP_M, _BED_TOP_M, 0.0])
    points = np.stack([np.column_stack([np.full(4, x), y, z]) for x in (-half, half)], axis=1)
    parts = [surface_shapes.grid(points, np.array([0.0, length_m / 3.0]), y / 3.0)]
    parts += [_sleeper(float(at)) for at in np.arange(-half + 0.3, half, _PITCH_M)]
    for way in (-1.0, 1.0):
        near = way * 0.5 * GAUGE_M
        a, b = sorted((near, near + way * HEAD_M))
        parts.append(surface_shapes.block((-half, a, TOP_M - 0.17), (half, b, TOP_M), 0.0, 2))
    rng = variant_rng("railway_track", seed)
    tone, rust = rng.between(0.5, 0.75), rng.between(0.8, 1.2, "rust")
    materials = (
        Material((tone, 0.92 * tone, 0.84 * tone), 0.97, texture=f"texture/gravel?seed={seed % 4}"),
        Material((0.3, 0.29, 0.27), roughness=0.9),
        Material((0.2 * rust, 0.15 * rust, 0.12 * rust), roughness=0.45, metallic=0.6),
    )
    slab = np.array([[a, b, c] for a in (-half, half) for b in (-_FOOT_M, _FOOT_M)
                     for c in (0.0, _BED_TOP_M)])  # fmt: skip
    return make_solid(parts, materials, [slab])


def _sleeper(at_m: float) -> patches.Patch:
    """The visible part of a sleeper: its top and its long sides."""
    a, b = at_m - 0.5 * _SLEEPER_M[0], at_m + 0.5 * _SLEEPER_M[0]
    half, low, top = 0.5 * _SLEEPER_M[1], _BED_TOP_M - 0.02, _BED_TOP_M + 0.04
    x, z = np.array([a, a, b, b]), np.array([low, top, top, low])
    rows = [np.column_stack([x, np.full(4, y), z]) for y in (-half, half)]
    return surface_shapes.grid(np.stack(rows), slot=1)
