"""A bough of a fruit tree, in the leaves of which fruit hangs."""

import math

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.furniture import check_size
from gen_data.content.procedural.material_presets import draw_linear
from gen_data.content.procedural.patches import Array, Patch, make_solid_in_place
from gen_data.core.asset_types import Material
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng, variant_rng

_HOOKS, _BETWEEN_M = 28, 0.1
"""Most places for fruit, and the least distance between them."""
_NEAR, _FAR_PER_M3 = 14, 1100
"""Leaves around a place for fruit, and elsewhere per cubic metre (assumed)."""
_FREE_M = 0.045
"""Leaves begin no nearer to the middle of a fruit."""
_GREENS = ("#3f6a2a", "#4f7a2c", "#5f8a34", "#355a26", "#6f8f3a")


def fruit_bough(size_m: Vec3 = (1.1, 0.8, 0.8), seed: int = 0) -> Solid:
    """A branching limb and its leaves, open to all sides. Slots: wood, young leaves, leaves.

    Args:
        size_m: Extents that leaves stay in, all but for their tips.
        seed: Draws its shape and colours.
    """
    size_m = check_size("fruit_bough", size_m, 0.3)
    rng, hooks = variant_rng("fruit_bough/leaves", seed), np.array(hooks_m(size_m, seed))
    limb = _limb(size_m, variant_rng("fruit_bough", seed))
    thick = np.linspace(0.02, 0.007, len(limb))
    parts = [shapes.sweep(limb, shapes.circle(1.0, 8), scale=thick)]
    for hook in hooks:
        start = limb[int(((limb - hook) ** 2).sum(axis=1).argmin())]
        stalk = hook + np.array([0.0, 0.0, 0.05])
        middle = 0.5 * (start + stalk) + np.array([0.0, 0.0, 0.06])
        path = shapes.space_evenly(shapes.spline([start, middle, stalk, hook], 16), 9)
        parts.append(shapes.sweep(path, shapes.circle(0.0022, 5)))
    feet = np.concatenate([_leaves_around(hooks, rng), _strewn(hooks, size_m, rng)])
    leaves = [_leaf(foot, limb, rng) for foot in feet]
    greens = (draw_linear(_GREENS, 0.12, rng), draw_linear(_GREENS, 0.12, rng))
    materials = [Material(draw_linear(("#5f4a34", "#7a6450"), 0.1, rng), 0.9)]
    for green in greens:
        r, g, b = green
        shine = (0.5 * r, 0.55 * g, 0.3 * b)
        materials.append(Material(green, 0.42, diffuse_transmission=shine, role="leaf"))
    bar = hulls.tube(limb[:: len(limb) // 5], 0.015)
    return make_solid_in_place([*parts, *leaves], materials, bar)


def hooks_m(size_m: Vec3 = (1.1, 0.8, 0.8), seed: int = 0) -> tuple[Vec3, ...]:
    """Where stalks of fruit end, below the limb, in the axes of the bough."""
    x, y, z = size_m
    rng = variant_rng("fruit_bough/hooks", seed)
    found: list[Vec3] = []
    for _ in range(40 * _HOOKS):
        at = (rng.between(-0.42, 0.42) * x, rng.between(-0.4, 0.4) * y, rng.between(0.22, 0.8) * z)
        inside = (at[0] / x) ** 2 + (at[1] / y) ** 2 + (at[2] / z - 0.5) ** 2 < 0.2
        if inside and all(math.dist(at, other) > _BETWEEN_M for other in found):
            found.append(at)
        if len(found) == _HOOKS:
            break
    return tuple(found)


def _limb(size_m: Vec3, rng: VariantRng) -> Array:
    """Centre line of the limb, which bends down under its fruit, [24, 3]."""
    x, y, z = size_m
    knots = [
        (share * x, rng.between(-0.12, 0.12) * y, (0.8 - 0.25 * (share + 0.5) ** 2) * z)
        for share in (-0.5, -0.2, 0.1, 0.45)
    ]
    return shapes.space_evenly(shapes.spline(knots, 40), 24)


def _leaves_around(hooks: Array, rng: VariantRng) -> Array:
    """Feet of the leaves that grow next to fruit, from above to its middle, [n, 3]."""
    count = len(hooks) * _NEAR
    turn = 2.0 * math.pi * rng.random(count)
    reach = _FREE_M + 0.04 * rng.random(count)
    lift = -0.03 + 0.08 * rng.random(count)
    away = np.stack([reach * np.cos(turn), reach * np.sin(turn), lift], axis=1)
    return np.asarray(np.repeat(hooks, _NEAR, axis=0) + away)


def _strewn(hooks: Array, size_m: Vec3, rng: VariantRng) -> Array:
    """Feet of the other leaves, clear of fruit, [n, 3]."""
    count = int(_FAR_PER_M3 * math.prod(size_m))
    at = (np.stack([rng.random(count) for _ in range(3)], axis=1) - 0.5) * np.array(size_m)
    inside = ((at / np.array(size_m)) ** 2).sum(axis=1) < 0.25
    at = at[inside] + np.array([0.0, 0.0, 0.5 * size_m[2]])
    fruit = hooks - np.array([0.0, 0.0, 0.045])
    clear = np.sqrt(((at[:, None] - fruit[None]) ** 2).sum(axis=2)).min(axis=1) > _FREE_M
    return np.asarray(at[clear])


def _leaf(foot: Array, limb: Array, rng: VariantRng) -> Patch:
    """A pointed, folded leaf that hangs outward from its foot."""
    length, wide = rng.between(0.06, 0.105), rng.between(0.34, 0.46)
    t = np.array([0.0, 0.2, 0.45, 0.75, 1.0])
    half = 0.5 * wide * np.sin(math.pi * t**0.85)
    fold, droop = rng.between(0.1, 0.35), rng.between(0.05, 0.3)
    rows = [
        [(s, side * h, fold * h * abs(side) - droop * s * s) for side in (-1, 0, 1)]
        for s, h in zip(t, half, strict=True)
    ]
    blade = shapes.grid(length * np.array(rows)).painted(1 + int(rng.between(0.0, 1.0) < 0.6))
    nearest = limb[int(((limb - foot) ** 2).sum(axis=1).argmin())]
    outward = math.atan2(foot[1] - nearest[1], foot[0] - nearest[0])
    blade = blade.rotated("x", rng.between(-0.7, 0.7)).rotated("y", rng.between(-0.3, 1.1))
    return blade.rotated("z", outward + rng.between(-1.2, 1.2)).moved(*foot.tolist())
