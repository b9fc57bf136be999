"""Wood: one board, and the planks of a floor. The grain runs across the image."""

from __future__ import annotations

import numpy as np

from gen_data.generator.assets.procedural.noise import (
    SIZE_PX,
    fbm,
    perlin,
    rows_and_columns,
    smoothstep,
    uniform,
)
from gen_data.generator.assets.procedural.textures.texture_images import (
    colors_in_turn,
    mix_colors,
    texture,
)
from gen_data.generator.assets.procedural.variant_rng import VariantRng, variant_rng
from gen_data.generator.core.asset_types import Float32, TextureData


def wood_grain(seed: int) -> TextureData:
    """One board; 0.4 m per repeat."""
    rng = variant_rng("wood_grain", seed)
    rings, fibre = _grain(rng)
    light, dark = colors_in_turn("timber", seed)
    albedo = mix_colors(light, dark, 0.75 * rings + 0.35 * fibre)
    return texture(albedo, 0.85 + 0.15 * fibre, -0.8 * fibre - 0.3 * rings)


def wood_planks(seed: int) -> TextureData:
    """Boards laid side by side, ends staggered; 1.2 m per repeat."""
    rng = variant_rng("wood_planks", seed)
    rings, fibre = _grain(rng)
    light, dark = colors_in_turn("timber", seed)
    rows = rng.choose((4, 6, 8, 8, 10))
    per_row = rng.choose((1, 2, 2, 3))
    y, x = rows_and_columns()
    row = np.floor(y * rows).astype(np.int64) + np.zeros_like(x, dtype=np.int64)
    along = (x + uniform(rows, rng).astype(np.float32)[row]) * per_row
    plank = row * per_row + np.floor(along).astype(np.int64) % per_row
    shift = (uniform((2, rows * per_row), rng) * SIZE_PX).astype(np.int64)
    at = (
        (np.arange(SIZE_PX)[:, None] + shift[0][plank]) % SIZE_PX,
        (np.arange(SIZE_PX)[None, :] + shift[1][plank]) % SIZE_PX,
    )
    rings, fibre = rings[at], fibre[at]
    tone = (uniform(rows * per_row, rng).astype(np.float32) - 0.5)[plank]
    albedo = mix_colors(light, dark, 0.6 * rings + 0.3 * fibre + 0.35 * tone)
    albedo *= (1.0 + rng.between(0.05, 0.2) * tone)[..., None]
    side = np.abs(y * rows - np.round(y * rows)) * SIZE_PX / rows
    end = np.abs(along - np.round(along)) * SIZE_PX / per_row
    width = rng.between(1.0, 2.2)
    gap = 1 - smoothstep(0.3 * width, width, np.minimum(side, end))
    albedo = mix_colors(albedo, 0.25 * dark, 0.85 * gap)
    rough = 0.8 + 0.15 * fibre + 0.2 * gap
    return texture(albedo, rough, -0.5 * fibre - 2.0 * gap)


def _grain(rng: VariantRng) -> tuple[Float32, Float32]:
    """Growth rings and fibres, both in about [0, 1]."""
    y, _ = rows_and_columns()
    count = rng.choose((6, 9, 12, 16))
    # Quarter-sawn boards have straight lines, flat-sawn ones wander.
    bend = rng.between(0.4, 2.2)
    phase = count * y + bend * fbm((3, 1), 2, rng) + 0.1 * fbm((40, 4), 2, rng)
    ring = phase - np.floor(phase)
    # Early wood is wide and pale, late wood a thin dark line that ends abruptly.
    rings = ring ** np.float32(rng.between(1.2, 3.0)) * (1 - smoothstep(0.93, 1.0, ring))
    streaks = np.abs(perlin((128, 4), rng)) + 0.5 * np.abs(perlin((256, 8), rng))
    pores = smoothstep(0.5, 0.85, perlin((170, 17), rng) + 0.25 * rings)
    rings = rings * (0.6 + 0.4 * smoothstep(-0.5, 0.5, fbm((4, 2), 2, rng)))
    tone = 0.22 * fbm((7, 2), 3, rng)
    fibre: Float32 = np.clip(0.45 * streaks + 0.6 * pores, 0.0, 1.0)
    return np.clip(rings + tone, 0.0, 1.0), fibre
