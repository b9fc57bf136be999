"""Toy blocks, balls, candles and vases."""

from __future__ import annotations

import numpy as np

from generator.assets.procedural import hulls
from generator.assets.procedural.draw import between, chance, pick, rng_of
from generator.assets.procedural.family import Solid
from generator.assets.procedural.materials import (
    GLAZES,
    PLASTICS,
    WOODS,
    ceramic,
    jittered,
    linear,
    plastic,
)
from generator.assets.procedural.mesh import Patch, centred
from generator.assets.procedural.shapes import ball as sphere
from generator.assets.procedural.shapes import fillet, lathe, rounded_box, spline
from generator.core.geometry import Material

_SHAPES = ((0.04, 0.04, 0.04), (0.03, 0.06, 0.03), (0.03, 0.09, 0.03), (0.05, 0.05, 0.025),
           (0.06, 0.06, 0.03), (0.025, 0.075, 0.015))


def block(seed: int) -> Solid:
    """A wooden or plastic building block. Slot: body."""
    rng = rng_of("block", seed)
    x, y, z = (side * between(0.95, 1.05, rng) for side in _SHAPES[seed % len(_SHAPES)])
    bare = chance(0.25, rng)
    paint = Material(jittered(linear(pick(WOODS, rng)), 0.08, rng), 0.6) if bare else plastic(rng, PLASTICS[:8])
    body = rounded_box((x, y, z), 0.0025, 2)
    return centred([body], (paint,), [hulls.box((-x / 2, -y / 2, -z / 2), (x / 2, y / 2, z / 2))])


def ball(seed: int) -> Solid:
    """A tennis, rubber or striped beach ball. Slots: first and second colour."""
    rng = rng_of("ball", seed)
    kind = ("tennis", "rubber", "striped")[seed % 3]
    radius = {"tennis": 0.0334, "rubber": between(0.02, 0.035, rng), "striped": between(0.05, 0.09, rng)}[kind]
    body = sphere(lambda d: radius * d, 20, 36)
    tint, band = plastic(rng), plastic(rng, ("#f0f0ec", *PLASTICS))
    if kind == "tennis":
        tint = Material(jittered(linear("#c8d936"), 0.06, rng), 0.9)
        band = Material(linear("#eef0e2"), 0.8)
    slots = _seams(body, kind)
    return centred([Patch(body.corners_m, body.uvs, slots)], (tint, band), [hulls.extreme(body.corners_m)])


def candle(seed: int) -> Solid:
    """A pillar candle with a wick. Slots: wax, wick."""
    rng = rng_of("candle", seed)
    radius, height = between(0.022, 0.04, rng), between(0.05, 0.15, rng)
    wax = fillet([(0.0, 0.0), (radius, 0.0), (radius, height), (0.75 * radius, height - 0.003),
                  (0.0, height - 0.006)], [0.0, 0.002, 0.003, 0.004, 0.0], 3)
    wick = lathe([(0.0, height - 0.008), (0.001, height - 0.008), (0.001, height + 0.007), (0.0, height + 0.0075)], 8, 1)
    colors = ("#f1e8d2", "#e9dcc0", "#a83a34", "#3f5a4a", "#d9a441", "#7d8fa3", "#c58b8b")
    material = Material(jittered(linear(pick(colors, rng)), 0.05, rng), between(0.4, 0.6, rng))
    return centred([lathe(wax, 32), wick], (material, Material((0.02, 0.02, 0.02), 0.9)),
                   [hulls.frustum((radius, 0.0), (radius, height)),
                    hulls.frustum((0.001, height), (0.001, height + 0.0075), 6)])


def vase(seed: int) -> Solid:
    """A ceramic vase, hollow to look at. Slots: outside, inside."""
    rng = rng_of("vase", seed)
    height, belly = between(0.15, 0.27, rng), between(0.04, 0.06, rng)
    foot, neck = belly * between(0.55, 0.75, rng), belly * between(0.3, 0.6, rng)
    mouth, widest = neck * between(1.1, 1.6, rng), between(0.3, 0.55, rng)
    curve = spline([(foot, 0.004), (belly, widest * height), (0.5 * (belly + neck), 0.5 * (widest + 0.8) * height),
                    (neck, 0.82 * height), (mouth, height)], 26)
    wall = 0.004
    inner = [(float(r) - wall, float(z)) for r, z in curve[::-1] if z > 0.02]
    outer = [(float(r), float(z)) for r, z in curve]
    profile = [(0.0, 0.001), (foot - 0.004, 0.001), (foot - 0.003, 0.0), (foot, 0.0), *outer]
    outside = ceramic(rng, GLAZES)
    inside = Material(outside.base_color, 0.4)
    stages = [(foot, 0.0), *(outer[i] for i in (5, 9, 13, 17, 21, 25))]
    return centred(
        [lathe(profile, 36), lathe([outer[-1], (mouth - 0.5 * wall, height + 0.0015), *inner, (0.0, 0.018)], 36, 1)],
        (outside, inside), hulls.stack(stages),
    )


def _seams(body: Patch, kind: str) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    """Slot per triangle: six gores, a tennis ball's curved seam, or one colour."""
    d = body.corners_m.mean(axis=1)
    d = d / np.sqrt((d**2).sum(axis=1, keepdims=True))
    turn = np.arctan2(d[:, 1], d[:, 0])
    if kind == "striped":
        # Nudged, so that no triangle's centre lies on a border.
        return (np.floor(turn / (np.pi / 3) + 1e-6).astype(np.int64) % 2).astype(np.int64)
    if kind == "tennis":
        return (np.abs(d[:, 2] - 0.55 * np.cos(2 * turn)) < 0.07).astype(np.int64)
    return np.zeros(len(d), dtype=np.int64)
