"""Fruit: spheres pressed, pulled and bent into shape, with stalks."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from gen_data.generator.assets.procedural import collision_hulls as hulls
from gen_data.generator.assets.procedural import surface_shapes as shapes
from gen_data.generator.assets.procedural.family import Solid
from gen_data.generator.assets.procedural.material_presets import hex_to_linear, printed_material
from gen_data.generator.assets.procedural.patches import Array, Patch, make_centred_solid
from gen_data.generator.assets.procedural.variant_rng import VariantRng, variant_rng
from gen_data.generator.core.asset_types import Material

_STALK = Material(hex_to_linear("#5a4329"), 0.8)


def apple(seed: int) -> Solid:
    """An apple with dimples and a stalk. Slots: skin, stalk."""
    rng = variant_rng("apple", seed)
    radius, slim = rng.between(0.034, 0.042), rng.between(0.9, 1.02)
    lumps = _lumps(5, 0.025, rng)
    pinch = rng.between(0.28, 0.36)

    def shape(d: Array) -> Array:
        z = d[..., 2]
        dent = pinch * np.exp(-((1 - np.abs(z)) / 0.09)) * np.where(z > 0, 1.0, 0.7)
        taper = 1.0 + 0.07 * z
        r = radius * (1 - dent + lumps(d) * (1 - z**2)) * taper
        return np.stack([r * d[..., 0], r * d[..., 1], slim * r * z], axis=2)

    dip = radius * slim * (1 - pinch) * 1.07
    skin = printed_material(f"texture/apple_skin?seed={seed}", rng.between(0.25, 0.4))
    stalk = _stalk((0.0, 0.0, dip - 0.002), rng.between(0.012, 0.02), 0.0013, rng)
    body = shapes.ball(shape, 22, 28)
    parts = [hulls.extreme(body.corners_m), hulls.extreme(stalk.corners_m, 16)]
    return make_centred_solid([body, stalk.painted(1)], (skin, _STALK), parts)


def orange(seed: int) -> Solid:
    """An orange with the scar of its stalk. Slots: peel, stalk."""
    rng = variant_rng("orange", seed)
    radius, flat = rng.between(0.034, 0.042), rng.between(0.93, 1.0)
    lumps = _lumps(4, 0.012, rng)

    def shape(d: Array) -> Array:
        z = d[..., 2]
        dent = 0.05 * np.exp(-((1 - np.abs(z)) / 0.02))
        r = radius * (1 - dent + lumps(d))
        return np.stack([r * d[..., 0], r * d[..., 1], flat * r * z], axis=2)

    peel = printed_material(f"texture/citrus_peel?seed={seed}", rng.between(0.4, 0.55))
    body = shapes.ball(shape, 24, 36)
    button = shapes.ball(lambda d: 0.0035 * d * np.array([1.0, 1.0, 0.4]), 6, 10).painted(1)
    button = button.moved(z=radius * flat * 0.955)
    green = Material(hex_to_linear("#6d7a3a"), 0.8)
    return make_centred_solid([body, button], (peel, green), [hulls.extreme(body.corners_m)])


def lemon(seed: int) -> Solid:
    """A lemon lying along X, pointed at one end. Slot: peel."""
    rng = variant_rng("lemon", seed)
    radius, long = rng.between(0.025, 0.03), rng.between(1.25, 1.45)
    lumps = _lumps(5, 0.025, rng)

    def shape(d: Array) -> Array:
        z = d[..., 2]
        tip = 0.22 * np.exp(-((1 - z) / 0.05)) + 0.12 * np.exp(-((1 + z) / 0.04))
        r = radius * (1 + lumps(d) * (1 - z**2))
        x = radius * long * (z + tip * np.sign(z))
        return np.stack([x, r * d[..., 1], -r * d[..., 0]], axis=2)

    peel = printed_material(f"texture/citrus_peel?seed={seed + 1000}", rng.between(0.35, 0.5))
    body = shapes.ball(shape, 24, 24)
    return make_centred_solid([body], (peel,), [hulls.extreme(body.corners_m)])


def pear(seed: int) -> Solid:
    """A pear standing upright. Slots: skin, stalk."""
    rng = variant_rng("pear", seed)
    radius, height = rng.between(0.03, 0.036), rng.between(0.085, 0.105)
    neck, lean = rng.between(0.42, 0.52), rng.between(-0.006, 0.006)
    lumps = _lumps(4, 0.03, rng)

    def shape(d: Array) -> Array:
        z = d[..., 2]
        t = 0.5 + 0.5 * z
        body = 1.0 - (1.0 - neck) * t**1.5 * (1.0 + 0.35 * np.sin(math.pi * t))
        flank = np.sqrt(np.maximum(1 - z**2, 0.0)) ** 0.85
        unit = d[..., :2] / np.maximum(np.sqrt(1 - z**2), 1e-9)[..., None]
        r = radius * flank * body * (1 + lumps(d)) * 1.12
        dent = 0.1 * np.exp(-((1 + z) / 0.06))
        up = 0.5 * height * (z + dent)
        return np.stack([r * unit[..., 0] + lean * t**2, r * unit[..., 1], up], axis=2)

    skin = printed_material(f"texture/pear_skin?seed={seed}", rng.between(0.35, 0.5))
    body = shapes.ball(shape, 24, 24)
    stalk = _stalk((lean, 0.0, 0.5 * height - 0.002), rng.between(0.014, 0.022), 0.0014, rng)
    points = body.corners_m.reshape(-1, 3)
    lower, upper = points[points[:, 2] < 0.12 * height], points[points[:, 2] > 0.02 * height]
    parts = [*map(hulls.extreme, (lower, upper)), hulls.extreme(stalk.corners_m, 16)]
    return make_centred_solid([body, stalk.painted(1)], (skin, _STALK), parts)


def banana(seed: int) -> Solid:
    """A banana lying on its side, bent in the plane of the ground. Slot: peel."""
    rng = variant_rng("banana", seed)
    length, thick = rng.between(0.17, 0.21), rng.between(0.0165, 0.0195)
    bend = rng.between(0.9, 1.35)
    arc = np.linspace(-0.5 * bend, 0.5 * bend, 25)
    radius = length / bend
    path = np.stack([radius * np.sin(arc), radius * (1 - np.cos(arc)), np.zeros_like(arc)], axis=1)
    # Five blunt edges; the stem end is long and thin, the blossom end short.
    at = (0, 0.04, 0.1, 0.18, 0.32, 0.5, 0.72, 0.88, 0.95, 0.985, 1.0)
    widths = (0.3, 0.26, 0.3, 0.62, 0.92, 1.0, 0.97, 0.78, 0.5, 0.3, 0.24)
    girth = np.interp(np.linspace(0.0, 1.0, 25), at, widths)
    turn = 2 * math.pi * np.arange(20) / 20
    edge = 1.0 + 0.045 * np.cos(5 * turn) + 0.008 * np.cos(10 * turn)
    section = thick * edge[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    skin = shapes.sweep(path, section, scale=_smooth(girth))
    peel = printed_material(f"texture/banana_peel?seed={seed}", rng.between(0.4, 0.55))
    parts = []
    for a, b in ((0, 4), (4, 9), (9, 15), (15, 20), (20, 24)):
        ring = np.concatenate([_ring_points(skin, path, i) for i in (a, (a + b) // 2, b)])
        parts.append(hulls.extreme(ring))
    return make_centred_solid([skin], (peel,), parts)


def _ring_points(skin: Patch, path: Array, i: int) -> Array:
    """Points of the skin nearest to one point of the centre line."""
    points = np.unique(np.round(skin.corners_m.reshape(-1, 3), 9), axis=0)
    nearest = ((points[:, None, :] - path[None, :, :]) ** 2).sum(axis=2).argmin(axis=1)
    return np.array(points[nearest == i])


def _smooth(values: Array) -> Array:
    padded = np.concatenate([values[:1], values, values[-1:]])
    smooth: Array = 0.25 * padded[:-2] + 0.5 * padded[1:-1] + 0.25 * padded[2:]
    return smooth


def _lumps(count: int, size: float, rng: VariantRng) -> Callable[[Array], Array]:
    """A low-frequency swelling over directions: a sum of cosines."""
    axes = rng.random((count, 3)) - 0.5
    phases = 2 * math.pi * rng.random(count)

    def lumps(d: Array) -> Array:
        total = np.zeros(d.shape[:2])
        for axis, phase in zip(axes, phases, strict=True):
            total += np.cos(6.0 * (d * axis).sum(axis=2) + phase)
        return size * total / count

    return lumps


def _stalk(foot: tuple[float, float, float], length: float, thick: float, rng: VariantRng) -> Patch:
    """A bent, tapering twig."""
    x, y, z = foot
    lean = rng.between(-0.4, 0.4) * length
    bend = shapes.spline([(x, y, z), (x, y, z + 0.5 * length), (x + lean, y, z + length)], 24)
    path, scale = shapes.space_evenly(bend, 6), np.array([1.3, 1, 0.9, 0.9, 1.1, 1.5])
    return shapes.sweep(path, shapes.circle(thick, 8), up=(1.0, 0.0, 0.0), scale=scale)
