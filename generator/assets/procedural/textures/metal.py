"""Metal surfaces: brushed, and painted with wear."""

from __future__ import annotations

import numpy as np

from gen_data.generator.assets.procedural.material_presets import PALETTES
from gen_data.generator.assets.procedural.noise import (
    SIZE_PX,
    fbm,
    perlin,
    rows_and_columns,
    smoothstep,
)
from gen_data.generator.assets.procedural.textures.texture_images import (
    color,
    draw_color,
    mix_colors,
    texture,
)
from gen_data.generator.assets.procedural.variant_rng import VariantRng, variant_rng
from gen_data.generator.core.asset_types import Float32, TextureData


def brushed_metal(seed: int) -> TextureData:
    """Brushed sheet, strokes across the image; 0.3 m per repeat."""
    rng = variant_rng("brushed_metal", seed)
    strokes = sum(
        (
            weight * perlin(cells, rng)
            for cells, weight in (((256, 2), 0.6), ((128, 4), 0.5), ((512, 8), 0.5), ((64, 1), 0.3))
        ),
        start=np.zeros((SIZE_PX, SIZE_PX), dtype=np.float32),
    )
    clouds = fbm((2, 3), 4, rng)
    base = draw_color(PALETTES["bare_metals"], 0.05, rng)
    shade = 1 + rng.between(0.05, 0.11) * strokes + 0.03 * clouds
    return texture(base * shade[..., None], 0.75 + 0.2 * strokes + 0.08 * clouds, 0.7 * strokes)


def painted_metal(seed: int) -> TextureData:
    """Lacquered sheet with chips, scratches and grime; 0.6 m per repeat."""
    rng = variant_rng("painted_metal", seed)
    paint = draw_color(PALETTES["metal_paints"], 0.06, rng)
    peel, grime = fbm((90, 90), 2, rng), smoothstep(0.0, 0.9, fbm((3, 3), 5, rng, 0.6))
    wear = rng.between(0.55, 0.95)
    flakes = fbm((7, 7), 6, rng, 0.62) + 0.25 * fbm((2, 2), 2, rng)
    bare = smoothstep(wear, wear + 0.05, flakes)
    rim = smoothstep(wear - 0.09, wear - 0.02, flakes) * (1 - bare)
    rust = mix_colors(color("#5b3420"), color("#8c5a36"), 0.5 + 0.5 * fbm((32, 32), 3, rng))
    steel = np.broadcast_to(color("#6f7072"), (SIZE_PX, SIZE_PX, 3))
    metal = mix_colors(steel, rust, smoothstep(-0.3, 0.6, fbm((9, 9), 4, rng)))
    scratches = _scratches(rng)
    albedo = paint * (1 + 0.015 * peel - 0.13 * grime)[..., None]
    albedo = mix_colors(
        albedo, np.minimum(paint * 1.5 + 0.12, 0.9), np.maximum(0.35 * rim, 0.5 * scratches)
    )
    albedo = mix_colors(albedo, metal, bare)
    rough = 0.55 + 0.2 * grime + 0.4 * bare + 0.15 * scratches
    return texture(albedo, rough, 0.35 * peel - 1.5 * bare - 0.5 * scratches)


def _scratches(rng: VariantRng) -> Float32:
    """Thin arcs in [0, 1], periodic."""
    y, x = rows_and_columns()
    total = np.zeros((SIZE_PX, SIZE_PX), dtype=np.float32)
    for _ in range(int(rng.between(8, 26))):
        cy, cx, turn, length, bow = (float(t) for t in rng.random(5))
        s, c = np.sin(2 * np.pi * turn), np.cos(2 * np.pi * turn)
        dy, dx = (y - cy + 0.5) % 1.0 - 0.5, (x - cx + 0.5) % 1.0 - 0.5
        along, away = c * dx + s * dy, -s * dx + c * dy
        reach = 0.05 + 0.3 * length**2
        offset = away - (bow - 0.5) * 0.6 * along**2
        line = smoothstep(1.4 / SIZE_PX, 0.4 / SIZE_PX, np.abs(offset))
        total = np.maximum(total, line * smoothstep(reach, 0.7 * reach, np.abs(along)))
    return total
