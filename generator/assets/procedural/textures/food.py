"""Skins of fruit. They follow the fruit's UVs: u around, v from the lower to the upper end."""

from __future__ import annotations

import numpy as np

from gen_data.generator.assets.procedural.noise import (
    SIZE_PX,
    fbm,
    perlin,
    rows_and_columns,
    smoothstep,
    uniform,
    worley,
)
from gen_data.generator.assets.procedural.textures.texture_images import (
    color,
    colors_in_turn,
    draw_color,
    mix_colors,
    texture,
)
from gen_data.generator.assets.procedural.variant_rng import VariantRng, variant_rng
from gen_data.generator.core.asset_types import Float32, TextureData


def apple_skin(seed: int) -> TextureData:
    """Streaks from stalk to blossom over a paler ground, with pores."""
    rng = variant_rng("apple_skin", seed)
    ground, blush = colors_in_turn("apples", seed)
    y, _ = rows_and_columns()
    streaks = 0.6 * fbm((2, 40), 3, rng) + 0.3 * fbm((6, 90), 2, rng)
    patches = fbm((2, 2), 3, rng) + rng.between(-0.2, 0.4)
    cover = smoothstep(-0.5, 0.6, patches + 0.6 * streaks)
    albedo = mix_colors(ground, blush, cover)
    hollow = smoothstep(0.12, 0.02, y) + smoothstep(0.9, 1.0, y)
    albedo = mix_colors(albedo, color("#9a8f4a"), 0.7 * hollow * (0.7 + 0.3 * streaks))
    albedo = mix_colors(albedo, np.minimum(ground + 0.12, 0.95), 0.6 * _dots(40, 0.16, rng))
    return texture(albedo * (1 + 0.03 * fbm((24, 24), 3, rng))[..., None])


def citrus_peel(seed: int) -> TextureData:
    """Dimpled by oil glands. Seeds below 1000 are oranges, others lemons."""
    rng = variant_rng("citrus_peel", seed)
    codes = (
        ("#e8791a", "#f08c1e", "#e06a12", "#eb9a2a")
        if seed < 1000
        else ("#f0cf2c", "#f4da45", "#e6c21f")
    )
    base = draw_color(codes, 0.05, rng)
    glands = worley((48, 72), rng, 0.9)
    dimple = smoothstep(0.5, 0.1, glands.nearest)
    shade = 1 + 0.05 * fbm((3, 3), 4, rng) - 0.07 * dimple
    y, _ = rows_and_columns()
    ends = smoothstep(0.1, 0.0, y) + smoothstep(0.94, 1.0, y)
    albedo = mix_colors(base * shade[..., None], color("#a9a23a"), 0.45 * ends)
    return texture(albedo, None, -1.3 * dimple)


def banana_peel(seed: int) -> TextureData:
    """Yellow, greener towards the ends, dark tips and ripening spots."""
    rng = variant_rng("banana_peel", seed)
    ripe = rng.between(0.0, 1.0)
    base = mix_colors(
        color("#d3c83c"), color("#ecc22c"), np.full((SIZE_PX, SIZE_PX), ripe, dtype=np.float32)
    )
    y, _ = rows_and_columns()
    wander = 0.02 * fbm((4, 6), 3, rng)
    ends = smoothstep(0.22, 0.05, y + wander) + smoothstep(0.8, 0.95, y + wander)
    albedo = mix_colors(base, color("#a9b23e"), ends * (0.75 - 0.4 * ripe))
    lines = smoothstep(0.55, 0.8, perlin((4, 70), rng)) * 0.12
    spots = _dots(24, 0.3, rng) * smoothstep(0.3, 1.0, np.float32(ripe) + fbm((3, 3), 2, rng))
    bruise = smoothstep(0.75, 1.1, fbm((5, 5), 4, rng) + 0.3 * np.float32(ripe))
    albedo = mix_colors(
        albedo, color("#6b4a1f"), np.clip(0.85 * spots + lines + 0.5 * bruise, 0, 1)
    )
    tips = smoothstep(0.028, 0.012, y + 0.5 * wander) + smoothstep(0.965, 0.985, y + 0.5 * wander)
    return texture(mix_colors(albedo, color("#3f3119"), 0.95 * tips))


def pear_skin(seed: int) -> TextureData:
    """Green to yellow or brown, freckled with lenticels."""
    rng = variant_rng("pear_skin", seed)
    codes = ("#b5b83a", "#c7b548", "#96a03a", "#9c7a45", "#b8bd58")
    base, blush = (
        draw_color(codes, 0.05, rng),
        color(rng.choose(("#b0583a", "#a88a3a", "#8f9a3a"))),
    )
    albedo = mix_colors(base, blush, 0.7 * smoothstep(0.0, 0.9, fbm((2, 2), 4, rng)))
    albedo = mix_colors(albedo, color("#6f5a2c"), 0.55 * _dots(56, 0.25, rng))
    y, _ = rows_and_columns()
    russet = (
        smoothstep(0.12, 0.0, y)
        + smoothstep(0.88, 1.0, y)
        + smoothstep(0.5, 1.2, fbm((6, 6), 4, rng))
    )
    return texture(mix_colors(albedo, color("#8a6a3a"), 0.6 * russet))


def _dots(cells: int, radius: float, rng: VariantRng) -> Float32:
    """Scattered specks of varied size in [0, 1]."""
    points = worley((cells, cells), rng)
    size = radius * uniform(points.count, rng) ** 2
    dots: Float32 = smoothstep(0.05, -0.05, points.nearest - points.of_each(size) - 0.02)
    return dots
