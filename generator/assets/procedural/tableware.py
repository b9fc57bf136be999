"""Mugs, cups, bowls, plates and drinking glasses: bodies of revolution, hollow in physics too."""

from __future__ import annotations

import math

import numpy as np

from gen_data.generator.assets.procedural import collision_hulls as hulls
from gen_data.generator.assets.procedural import surface_shapes as shapes
from gen_data.generator.assets.procedural.family import Solid
from gen_data.generator.assets.procedural.material_presets import (
    GLAZES,
    ceramic_material,
    draw_linear,
    lighten,
    plastic_material,
)
from gen_data.generator.assets.procedural.patches import Array, Patch, make_centred_solid, unit
from gen_data.generator.assets.procedural.variant_rng import VariantRng, variant_rng
from gen_data.generator.core.asset_types import Material
from gen_data.generator.core.se3 import Vec3

# Transmittance of one wall, RGB; soda-lime glass is slightly green.
_TINTS: tuple[Vec3, ...] = ((0.97, 0.98, 0.97), (0.97, 0.98, 0.97), (0.97, 0.98, 0.97),
                            (0.86, 0.93, 0.95), (0.86, 0.95, 0.88), (0.95, 0.88, 0.72))  # fmt: skip


def mug(seed: int) -> Solid:
    """A mug with its handle towards +X. Slots: outside, inside, handle."""
    rng = variant_rng("mug", seed)
    height, top = rng.between(0.085, 0.108), rng.between(0.037, 0.044)
    bottom = top * rng.choose((1.0, 1.0, 0.94, 0.84))
    wall = rng.between(0.0035, 0.0048)
    bulge = rng.choose((0.0, 0.0, 0.0, 0.004))
    profile = _cup_profile(top, bottom, height, wall, bulge)
    path = _handle_path(top, bottom, height, wall, bulge, rng)
    across = rng.between(0.0045, 0.006), rng.between(0.0065, 0.0095)
    section = shapes.circle(1.0, 12) * np.array(across)
    handle = shapes.sweep(path, section, scale=_flare_factors(len(path)), slot=2)
    outside = ceramic_material(rng)
    inside = Material(lighten(outside.base_color, rng.between(0.5, 0.95)), outside.roughness)
    grip = inside if rng.chance(0.15) else outside
    low, high = (bottom - wall, bottom, wall), (top - wall, top, height)
    rings = hulls.ring(low, high, 14)
    if bulge > 0:
        middle = 0.5 * (top + bottom) + bulge
        waist = (middle - wall, middle, 0.5 * height)
        rings = [*hulls.ring(low, waist, 8), *hulls.ring(waist, high, 9)]
    base = hulls.frustum((bottom, 0.0), (bottom, wall + 0.001))
    grip_hulls = hulls.tube(path[[0, 4, 9, 13, 18, 22]], 0.8 * across[1])
    patches, parts = [*_lathe_two_sided(profile, 32), handle], [base, *rings, *grip_hulls]
    return make_centred_solid(patches, (outside, inside, grip), parts)


def cup(seed: int) -> Solid:
    """A tumbler of opaque plastic. Slots: outside, inside."""
    rng = variant_rng("cup", seed)
    height, top = rng.between(0.08, 0.13), rng.between(0.034, 0.042)
    bottom, wall = top * rng.between(0.72, 0.9), rng.between(0.0018, 0.0028)
    profile = _cup_profile(top, bottom, height, wall, 0.0)
    outside = plastic_material(rng)
    inside = outside if rng.chance(0.6) else plastic_material(rng, ("#f0f0ec", "#e8e4da"))
    walls = hulls.ring((bottom - wall, bottom, wall), (top - wall, top, height), 14)
    base = hulls.frustum((bottom, 0.0), (bottom, wall + 0.001))
    return make_centred_solid(_lathe_two_sided(profile, 32), (outside, inside), [base, *walls])


def bowl(seed: int) -> Solid:
    """A bowl on a foot ring. Slots: outside, inside."""
    rng = variant_rng("bowl", seed)
    radius = rng.between(0.06, 0.125)
    height = radius * rng.between(0.75, 1.0) * (0.85 if radius > 0.1 else 1.0)
    foot, lift = radius * rng.between(0.45, 0.55), rng.between(0.004, 0.009)
    wall, fullness = rng.between(0.003, 0.005), rng.between(0.55, 0.85)
    outer = _bowl_curve(foot, radius, lift, height, fullness)
    inner = _offset(outer, wall)
    below = [(0.0, 0.6 * lift), (foot - 0.005, 0.6 * lift), (foot - 0.004, 0.0), (foot, 0.0)]
    rim = height + 0.5 * wall
    within = [*inner[::-1].tolist(), (0.0, float(inner[0, 1]))]
    profile = [*below, *outer.tolist(), (radius - 0.5 * wall, rim), *within]
    outside = ceramic_material(rng)
    inside = outside if rng.chance(0.5) else ceramic_material(rng, GLAZES[:3])
    # The floor lies about as high as the wall's outside after a fifth of its curve.
    levels = []
    for i, z in ((2, float(outer[2, 1])), (5, float(outer[5, 1])), (9, rim)):
        levels.append((float(np.interp(z, inner[:, 1], inner[:, 0])), float(outer[i, 0]), z))
    parts = [
        hulls.frustum((foot, 0.0), (levels[0][1], levels[0][2])),
        *hulls.ring(levels[0], levels[1], 9),
        *hulls.ring(levels[1], levels[2], 14),
    ]
    return make_centred_solid(_lathe_two_sided(profile, 40), (outside, inside), parts)


def plate(seed: int) -> Solid:
    """A flat plate with a raised rim. Slots: outside, inside."""
    rng = variant_rng("plate", seed)
    radius = rng.choose((0.085, 0.105, 0.13, 0.14)) * rng.between(0.97, 1.03)
    rise, wall = rng.between(0.016, 0.026), rng.between(0.0035, 0.005)
    well, foot = radius * rng.between(0.6, 0.72), radius * rng.between(0.5, 0.58)
    step = rise * rng.between(0.45, 0.7)
    bend, floor = well + 0.35 * (radius - well), 0.002 + wall
    upper = shapes.fillet(
        [(radius, rise), (bend, step + 0.002), (well, floor), (0.0, floor)], 0.014, 3
    )
    under = [(0.0, 0.002), (foot - 0.004, 0.002), (foot - 0.003, 0.0), (foot, 0.0),
             (foot + 0.002, 0.002), (well, 0.0025), (bend, step + 0.002 - wall),
             (radius, rise - 0.8 * wall)]  # fmt: skip
    lower = shapes.fillet(under, [0.0] * 5 + [0.012, 0.012, 0.0], 3)
    edge = radius + 0.4 * wall
    profile = [*lower, (edge, rise - 0.4 * wall), *upper]
    outside = ceramic_material(rng, GLAZES[:5] + GLAZES[:3] + GLAZES)
    inside = outside
    if not rng.chance(0.7):
        inside = Material(draw_linear(GLAZES, 0.08, rng), outside.roughness)
    rim = [(well - 0.004, 0.0015), (well - 0.004, floor), (bend, step + 0.002), (edge, rise),
           (edge, rise - 0.8 * wall)]  # fmt: skip
    walls = hulls.wedges(rim, 20)
    base = hulls.frustum((foot, 0.0), (well, floor), 24)
    return make_centred_solid(_lathe_two_sided(profile, 48), (outside, inside), [base, *walls])


def tumbler(seed: int) -> Solid:
    """A drinking glass with a thick bottom. Slots: glass."""
    rng = variant_rng("tumbler", seed)
    height, top = rng.between(0.085, 0.145), rng.between(0.03, 0.042)
    bottom, wall = top * rng.between(0.74, 0.98), rng.between(0.0016, 0.0026)
    floor = rng.between(0.006, 0.013)
    inner = bottom - wall + (top - bottom) * floor / height
    rim = 0.45 * wall
    outer = [(0.0, 0.001), (0.75 * bottom, 0.001), (0.85 * bottom, 0.0), (bottom, 0.0)]
    within = [(top, height), (top - wall, height), (inner, floor), (0.0, floor)]
    profile = shapes.fillet([*outer, *within], [0.0, 0.0, 0.0, 0.003, rim, rim, 0.005, 0.0], 4)
    base = hulls.frustum((bottom, 0.0), (bottom + (top - bottom) * floor / height, floor))
    walls = hulls.ring((inner, bottom, floor), (top - wall, top, height), 14)
    return make_centred_solid([shapes.lathe(profile, 48)], (_glass(rng),), [base, *walls])


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
    profile = shapes.fillet([*below, *outer, *inner], [*rounded, *within], 2)
    top, middle = (rim - wall, rim, height), (belly - wall, belly, wide)
    floor = (0.5 * belly, 0.62 * belly, low + 0.008)
    parts = [
        hulls.frustum((foot, 0.0), (foot, 0.003)),
        *hulls.stack([(stem, 0.003), (stem, low - 0.008), floor[1:]]),
        *hulls.ring(floor, middle, 10),
        *hulls.ring(middle, top, 10),
    ]
    return make_centred_solid([shapes.lathe(profile, 32)], (_glass(rng),), parts)


def _lathe_two_sided(profile: list[shapes.Point2], segments: int) -> list[Patch]:
    """The profile turned about Z: slot 0 up to the highest point, slot 1 from there inward."""
    k = max(range(len(profile)), key=lambda i: profile[i][1])
    return [shapes.lathe(profile[: k + 1], segments, 0), shapes.lathe(profile[k:], segments, 1)]


def _cup_profile(
    top: float, bottom: float, height: float, wall: float, bulge: float
) -> list[shapes.Point2]:
    """Closed profile of a beaker: foot, outer wall, rounded rim, inner wall."""
    middle, rim = 0.5 * (top + bottom) + bulge, 0.45 * wall
    rounded = [(0.0, 0.0015, 0.0), (0.78 * bottom, 0.0015, 0.0), (0.8 * bottom, 0.0, 0.0),
               (bottom, 0.0, 0.007), (middle, 0.5 * height, 0.12), (top, height, rim),
               (top - wall, height, rim), (middle - wall, 0.5 * height, 0.12),
               (bottom - wall, wall, 0.006), (0.0, wall, 0.0)]  # fmt: skip
    if bulge <= 0:
        del rounded[7], rounded[4]
    return shapes.fillet([(r, z) for r, z, _ in rounded], [radius for _, _, radius in rounded], 4)


def _handle_path(
    top: float, bottom: float, height: float, wall: float, bulge: float, rng: VariantRng
) -> Array:
    """Centre line of a handle in the plane y = 0; its ends are inside the wall."""
    high, low = height * rng.between(0.78, 0.86), height * rng.between(0.16, 0.26)
    reach = rng.between(0.026, 0.036)

    def wall_at(z: float) -> float:
        t = z / height
        bow = bulge * (1.0 - abs(2.0 * t - 1.0))
        return bottom + (top - bottom) * t + bow - 0.5 * wall

    belly, square = rng.between(-0.25, 0.0), rng.between(0.45, 0.75)
    turn = np.linspace(0.5 * math.pi, -0.5 * math.pi, 181)
    # A superellipse: it leaves the wall level and bulges less below where belly is negative.
    out = np.maximum(np.cos(turn), 0.0) ** square * (1.0 + 0.5 * belly * (1.0 - np.sin(turn)))
    z = low + (high - low) * 0.5 * (1.0 + np.sin(turn))
    x = np.array([wall_at(float(h)) for h in z]) + reach * out
    x[[0, -1]] = wall_at(high), wall_at(low)
    return shapes.space_evenly(np.stack([x, np.zeros_like(x), z], axis=1), 23)


def _flare_factors(count: int) -> Array:
    """Section factors along a handle: wider where it joins the body."""
    t = np.abs(np.linspace(-1.0, 1.0, count))
    return 1.0 + 0.35 * t**6


def _bowl_curve(foot: float, radius: float, lift: float, height: float, fullness: float) -> Array:
    """Outer wall from foot to rim, a superellipse arc: shape [10, 2]."""
    t = np.linspace(0.0, 0.5 * math.pi, 10)
    r = foot + (radius - foot) * np.sin(t) ** fullness
    z = lift + (height - lift) * (1.0 - np.cos(t))
    return np.stack([r, z], axis=1)


def _offset(curve: Array, distance: float) -> Array:
    """The curve moved to its left (inward, upward)."""
    step = unit(np.gradient(curve, axis=0))
    moved: Array = curve + distance * np.stack([-step[:, 1], step[:, 0]], axis=1)
    return moved


def _glass(rng: VariantRng) -> Material:
    return Material(rng.choose(_TINTS), roughness=0.04, transmission=1.0, ior=1.52, thin=False)
