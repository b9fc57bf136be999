"""Drinking glasses: bodies of revolution of solid glass, hollow in physics too."""

from __future__ import annotations

from gen_data.generator.assets.procedural import collision_hulls as hulls
from gen_data.generator.assets.procedural.family import Solid
from gen_data.generator.assets.procedural.patches import make_centred_solid
from gen_data.generator.assets.procedural.surface_shapes import fillet, lathe
from gen_data.generator.assets.procedural.variant_rng import VariantRng, variant_rng
from gen_data.generator.core.asset_types import Material
from gen_data.generator.core.se3 import Vec3

# Transmittance of one wall, RGB; soda-lime glass is slightly green.
_TINTS: tuple[Vec3, ...] = ((0.97, 0.98, 0.97), (0.97, 0.98, 0.97), (0.97, 0.98, 0.97),
                            (0.86, 0.93, 0.95), (0.86, 0.95, 0.88), (0.95, 0.88, 0.72))  # fmt: skip


def tumbler(seed: int) -> Solid:
    """A drinking glass with a thick bottom. Slots: glass."""
    rng = variant_rng("tumbler", seed)
    height, top = rng.between(0.085, 0.145), rng.between(0.03, 0.042)
    bottom, wall = top * rng.between(0.74, 0.98), rng.between(0.0016, 0.0026)
    floor = rng.between(0.006, 0.013)
    inner = bottom - wall + (top - bottom) * floor / height
    profile = fillet(
        [(0.0, 0.001), (0.75 * bottom, 0.001), (0.85 * bottom, 0.0), (bottom, 0.0),
         (top, height), (top - wall, height), (inner, floor), (0.0, floor)],
        [0.0, 0.0, 0.0, 0.003, 0.45 * wall, 0.45 * wall, 0.005, 0.0],
        4,
    )  # fmt: skip
    base = hulls.frustum((bottom, 0.0), (bottom + (top - bottom) * floor / height, floor))
    walls = hulls.ring((inner, bottom, floor), (top - wall, top, height), 14)
    return make_centred_solid([lathe(profile, 48)], (_glass(rng),), [base, *walls])


def wine_glass(seed: int) -> Solid:
    """A goblet on a stem. Slots: glass."""
    rng = variant_rng("wine_glass", seed)
    foot, stem = rng.between(0.032, 0.038), rng.between(0.0035, 0.0045)
    height, belly = rng.between(0.17, 0.22), rng.between(0.034, 0.044)
    rim, wall = belly * rng.between(0.72, 0.9), rng.between(0.0012, 0.0018)
    low = height * rng.between(0.38, 0.48)
    wide = low + (height - low) * rng.between(0.38, 0.5)
    outer = [(stem, low - 0.008), (0.62 * belly, low + 0.008), (belly, wide), (rim, height)]
    inner = [(rim - wall, height), (belly - wall, wide), (0.55 * belly, low + 0.009),
             (0.0, low + 0.004)]  # fmt: skip
    below = [(0.0, 0.0015), (0.8 * foot, 0.0015), (foot, 0.0), (foot, 0.002), (stem, 0.008)]
    rounded = [0.0, 0.0, 0.0004, 0.0004, 0.012, 0.02, 0.03, 0.05]
    within = [0.45 * wall, 0.45 * wall, 0.05, 0.025, 0.0]
    profile = fillet([*below, *outer, *inner], [*rounded, *within], 2)
    levels = [_ring_section(rim, wall, height), _ring_section(belly, wall, wide)]
    floor = (0.5 * belly, 0.62 * belly, low + 0.008)
    parts = [
        hulls.frustum((foot, 0.0), (foot, 0.003)),
        hulls.frustum((stem, 0.003), (stem, low - 0.008)),
        hulls.frustum((stem, low - 0.008), (0.62 * belly, low + 0.008)),
        *hulls.ring(floor, levels[1], 10),
        *hulls.ring(levels[1], levels[0], 10),
    ]
    return make_centred_solid([lathe(profile, 32)], (_glass(rng),), parts)


def _ring_section(radius: float, wall: float, z: float) -> tuple[float, float, float]:
    return (radius - wall, radius, z)


def _glass(rng: VariantRng) -> Material:
    return Material(rng.choose(_TINTS), roughness=0.04, transmission=1.0, ior=1.52, thin=False)
