"""Covers of balls as functions of the direction: no distortion at the poles."""

import math

import numpy as np

from gen_data.content.procedural import patches, toys
from gen_data.content.procedural.textures.texture_images import (
    color,
    draw_color,
    mix_colors,
    texture,
)
from gen_data.core.asset_types import Float32, TextureData
from gen_data.core.noise import SIZE_PX, fbm, rows_and_columns, smoothstep, worley
from gen_data.core.variant_rng import VariantRng

_BRIGHT = ("#d7261e", "#f2a71b", "#f7d423", "#2e9e4f", "#1f6fb5", "#7b3fa0", "#f0f0ec", "#12a3a3")
# Distance from the centre to the pentagons and hexagons of a truncated icosahedron of edge 1
# (Weisstein, "Truncated icosahedron", MathWorld).
_PENTAGON, _HEXAGON = 2.32744, 2.26728


def ball_cover(rng: VariantRng) -> TextureData:
    """The cover of ``toys.ball`` of the same seed."""
    kind = toys.ball_kind(rng.seed)
    if kind == "rubber":
        return texture(draw_color(_BRIGHT, 0.05, rng) * (1 + 0.02 * fbm((8, 8), 3, rng))[..., None])
    make = {"tennis": _tennis, "beach": _beach, "basket": _basket, "foot": _foot}[kind]
    return texture(make(_directions(), rng))


def _directions() -> Float32:
    """Direction of each pixel as ``surface_shapes.ball`` lays out its UVs."""
    y, x = rows_and_columns()
    polar, turn = math.pi * (0.5 - y), 2 * math.pi * (x - 0.5)
    flat = np.cos(polar)
    parts = np.broadcast_arrays(flat * np.cos(turn), flat * np.sin(turn), np.sin(polar))
    return np.stack(parts, axis=2).astype(np.float32)


def _tennis(d: Float32, rng: VariantRng) -> Float32:
    """Felt with the seam along a curve that winds around."""
    turn = np.arctan2(d[..., 1], d[..., 0])
    seam = smoothstep(0.075, 0.05, np.abs(d[..., 2] - 0.55 * np.cos(2 * turn)))
    felt = color("#c5d833") * (0.92 + 0.09 * fbm((96, 96), 2, rng))[..., None]
    return mix_colors(felt, color("#eceee0"), seam)


def _beach(d: Float32, rng: VariantRng) -> Float32:
    """Six gores in two or three colours, white caps."""
    colors = np.stack([draw_color(_BRIGHT, 0.04, rng) for _ in range(rng.choose((2, 3)))])
    gore = np.floor(np.arctan2(d[..., 1], d[..., 0]) / (math.pi / 3)).astype(np.int64) + 3
    cap = smoothstep(0.955, 0.96, np.abs(d[..., 2]))
    return mix_colors(colors[gore % len(colors)], color("#f2f2ee"), cap)


def _basket(d: Float32, rng: VariantRng) -> Float32:
    """Orange leather with black channels and pebbles."""
    x, y, z = d[..., 0], d[..., 1], d[..., 2]
    bow = np.abs(np.abs(y) - 0.62 - 0.22 * x**2)
    line = smoothstep(0.03, 0.02, np.minimum(np.minimum(np.abs(x), np.abs(z)), bow))
    pebble = worley((64, 128), rng).nearest
    tan = draw_color(("#c8682a", "#b5571f", "#d07a38"), 0.04, rng)
    leather = tan * (1.04 - 0.12 * pebble)[..., None]
    return mix_colors(leather, color("#1d1815"), line)


def _foot(d: Float32, rng: VariantRng) -> Float32:
    """Twelve dark pentagons and twenty white hexagons."""
    golden = 0.5 * (1 + math.sqrt(5))
    corners = np.array(
        [p for a in (-1, 1) for b in (-golden, golden) for p in ((0, a, b), (a, b, 0), (b, 0, a))]
    ) / math.sqrt(1 + golden**2)
    near = np.einsum("ik,jk->ij", corners, corners, optimize=False) > 0.4
    triples = [(i, j, k) for i in range(12) for j in range(i) for k in range(j)]
    close = [(i, j, k) for i, j, k in triples if near[i, j] and near[j, k] and near[i, k]]
    faces = patches.unit(np.array([corners[list(t)].sum(axis=0) for t in close]))
    heights = np.concatenate([corners / _PENTAGON, faces / _HEXAGON])
    reach = np.einsum("hwk,fk->hwf", d, heights.astype(np.float32), optimize=False)
    two = np.sort(reach, axis=2)[..., -2:]
    dark = (reach.argmax(axis=2) < 12).astype(np.float32)
    patch = draw_color(("#1b1b1d", "#1b1b1d", "#1f4f9a", "#a8242a"), 0.03, rng)
    albedo = mix_colors(np.broadcast_to(color("#efefec"), (SIZE_PX, SIZE_PX, 3)), patch, dark)
    seam = smoothstep(0.006, 0.002, two[..., 1] - two[..., 0])
    return mix_colors(albedo, color("#3a3a3c"), 0.8 * seam)
