"""Scissors, lying flat along X with the tips at +X."""

import math
from dataclasses import replace

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.material_presets import STAINLESS, metal_material, plastic_material
from gen_data.content.procedural.patches import Array, Patch, join_patches, make_centred_solid
from gen_data.core.variant_rng import VariantRng

_PLASTICS = ("#e0641a", "#1d1d1f", "#1d1d1f", "#c3121f", "#1f6fb5", "#2e8a4e", "#6a6f73", "#d14f78")


def scissors(rng: VariantRng) -> Solid:
    """A pair of scissors, shut or open. Slots: blades, handles, screw."""
    # Nail to tailor's scissors: 110 to 240 mm (assumed, within 10 %).
    size = rng.choose((0.55, 0.75, 0.9, 1.0, 1.0, 1.15)) * rng.between(0.95, 1.05)
    spread = rng.choose((0.0, 0.0, 0.05, 0.25, 0.45)) * rng.between(0.7, 1.2)
    blade = _blade(size * rng.between(0.92, 1.1), rng.between(0.85, 1.2, "width_scale"), rng)
    all_metal = rng.chance(0.2, "all_metal")
    patches, parts = [], []
    for side in (1.0, -1.0):
        # Loops of thumb and fingers differ.
        long = size * (rng.between(0.019, 0.024) if side > 0 else rng.between(0.02, 0.036))
        handle = _handle(long, size, rng.between(0.0034, 0.005) * (0.6 if all_metal else 1.0))
        angle = side * (0.5 * spread + 0.02)
        for piece in (blade, handle):
            placed = _mirrored(piece, side).rotated("z", angle).moved(z=side * 0.0008)
            patches.append(placed)
            parts.append(hulls.extreme(placed.corners_m))
    screw = shapes.cone((0.0032 * size**0.5, -0.0026), (0.0032 * size**0.5, 0.0026), 16, 2)
    steel = metal_material(STAINLESS, rng.between(0.18, 0.32))
    grip = steel if all_metal else replace(plastic_material(rng, _PLASTICS), roughness=0.45)
    return make_centred_solid([*patches, screw], (steel, grip, steel), parts)


def _blade(size: float, width: float, rng: VariantRng) -> Patch:
    """The upper half's blade and shank, from the loop at -X to the tip at +X."""
    tip = rng.choose((0.0, 0.001, 0.003), "tip_m")
    w = 0.0075 * width
    edge = [(-0.045, -0.0075), (-0.02, -0.006), (0.0, -0.8 * w), (0.05, -0.0025), (0.098, -0.0005)]
    spine = [(0.1, tip), (0.075, 0.65 * w), (0.03, 1.1 * w), (0.0, w), (-0.02, 0.0015),
             (-0.045, -0.001)]  # fmt: skip
    outline = size * np.array([*edge, *spine])
    return shapes.extrude(outline, 0.0015, 0.0003).moved(z=-0.00075)


def _handle(long: float, size: float, thick: float) -> Patch:
    """A loop and the neck that holds the shank; slot 1."""
    turn = np.linspace(0.0, 2.0 * math.pi, 29)
    centre = np.array([-0.05 * size - long, -0.0165 * size])
    loop = np.stack(
        [centre[0] + long * np.cos(turn), centre[1] + 0.0145 * size * np.sin(turn), 0.0 * turn],
        axis=1,
    )
    section = shapes.circle(1.0, 10) * np.array([1.15 * thick, thick])
    ring = shapes.sweep(loop, section)
    neck = np.array([(-0.056 * size, -0.012 * size, 0.0), (-0.042 * size, -0.0068 * size, 0.0),
                     (-0.022 * size, -0.0035 * size, 0.0)])  # fmt: skip
    bar = shapes.sweep(shapes.space_evenly(neck, 5), section, scale=np.linspace(1.0, 0.8, 5))
    return join_patches([ring, bar]).painted(1)


def _mirrored(patch: Patch, side: float) -> Patch:
    """The patch, or its image in the plane y = 0 where ``side`` is negative."""
    if side > 0:
        return patch
    corners: Array = patch.corners_m * np.array([1.0, -1.0, 1.0])
    return replace(patch, corners_m=corners).flipped()
