"""Fields from above, and the edges of standing crops. Every image tiles; rows run up the image.

Row spacings: maize and potatoes 0.75 m, cereals 0.125 m, furrows 0.4 m, as machines have them
(assumed, 10 %). Colours are assumed, from photographs.
"""

import math

import numpy as np

from gen_data.assets.family import check_option
from gen_data.content.procedural.textures.texture_images import color, mix_colors, texture
from gen_data.core.asset_types import Float32, TextureData
from gen_data.core.noise import blur_image, fbm, rows_and_columns, smoothstep, uniform, worley
from gen_data.core.variant_rng import VariantRng, variant_rng

CROP_TILE_M, STAND_TILE_M = 6.0, 3.0
"""Length of one repeat from above, and along the edge of a standing crop."""
_ROWS = {"maize": 8, "wheat": 48, "rape": 20, "stubble": 48, "furrows": 15, "potatoes": 8,
         "seedlings": 24, "meadow": 0}  # fmt: skip
"""Number of rows per repeat by crop; 0 = sown broadcast."""
CROPS = tuple(_ROWS)
_N = 512
_GREEN = {"maize": ("#4d6a2b", "#6b8440"), "rape": ("#b9a92c", "#d6c63c"),
          "wheat": ("#a8925a", "#c4ad70"), "potatoes": ("#4a6330", "#64803f"),
          "seedlings": ("#5b7a38", "#76944c"), "stubble": ("#a8935f", "#c2ab72"),
          "meadow": ("#5f7237", "#7d8a48"), "furrows": ("#5d4b39", "#766250")}  # fmt: skip
_SOIL = "#6b5944"


def crop(seed: int, kind: str = "maize") -> TextureData:
    """A field from above; 6 m per repeat.

    Args:
        seed: Seed of all draws.
        kind: A word of ``CROPS``.

    Raises:
        AssetError: the kind is unknown.
    """
    check_option("crop", "kind", kind, CROPS)
    rng = variant_rng(f"crop/{kind}", seed)
    grain = (uniform((_N, _N), rng) - 0.5).astype(np.float32)
    clouds = fbm((3, 3), 5, rng, 0.6, _N)
    low, high = (color(code) for code in _GREEN[kind])
    ridge = _ridges(kind, rng)
    if kind == "meadow":
        return _meadow(low, high, grain, clouds, rng)
    blotches = fbm((40, 40), 4, rng, 0.65, _N)
    plants = mix_colors(low, high, 0.5 + 0.5 * blotches)
    gap = {"maize": 0.35, "potatoes": 0.25, "seedlings": 0.75, "stubble": 0.45,
           "furrows": 0.0, "rape": -0.35}.get(kind, 0.12)  # fmt: skip
    bare = smoothstep(gap + 0.25, gap - 0.25, ridge + 0.35 * blotches + 0.4 * grain)
    if kind == "furrows":
        clods = worley((150, 150), rng, size_px=_N)
        tone = clods.of_each(0.75 + 0.5 * uniform(clods.count, rng))
        albedo = plants * (tone * (0.72 + 0.4 * ridge + 0.15 * grain))[..., None]
        height = 5.0 * ridge + 2.5 * (1.0 - clods.nearest)
        return texture(albedo.astype(np.float32), None, height.astype(np.float32), 0.8)
    soil = color(_SOIL) * (0.95 + 0.25 * grain + 0.1 * clouds)[..., None]
    shade = (0.82 + 0.26 * ridge + 0.3 * grain + 0.1 * clouds)[..., None]
    albedo = mix_colors((plants * shade).astype(np.float32), soil.astype(np.float32), bare)
    height = 2.5 * ridge + 1.5 * blur_image(grain)
    return texture(albedo, None, height.astype(np.float32), 0.8)


def crop_edge(seed: int, kind: str = "maize") -> TextureData:
    """The edge of a standing crop from the side: stalks, leaves and ears; 3 m per repeat.

    The crop stands in the lower half of the image, and upside down in the upper one.

    Args:
        seed: Seed of all draws.
        kind: A word of ``CROPS``.

    Raises:
        AssetError: the kind is unknown.
    """
    check_option("crop_edge", "kind", kind, CROPS)
    rng = variant_rng(f"crop_edge/{kind}", seed)
    low, high = (color(code) for code in _GREEN[kind])
    y = np.abs(2.0 * rows_and_columns(_N)[0] - 1.0)
    stalks, leaves = fbm((4, 90), 3, rng, 0.6, _N), fbm((24, 40), 4, rng, 0.65, _N)
    grain = (uniform((_N, _N), rng) - 0.5).astype(np.float32)
    tone = 0.5 + 0.45 * stalks + 0.35 * leaves
    albedo = mix_colors(low, high, tone)
    # Little light reaches the ground between the stalks; the top has ears, tassels or flowers.
    depth = smoothstep(0.05, -0.5, stalks + 0.7 * leaves)
    down = np.broadcast_to(0.7 + 0.4 * (1.0 - y), (_N, _N))
    albedo = albedo * (down * (1.0 - 0.4 * depth) * (1.0 + 0.3 * grain))[..., None]
    top = {"maize": "#8f8a4a", "rape": "#dccb35", "wheat": "#cdb577"}.get(kind, _GREEN[kind][1])
    crown = smoothstep(0.2, 0.02, y + 0.12 * leaves)
    if kind == "rape":
        # Green below the flowers.
        stem = mix_colors(color("#4d672b"), color("#76904a"), tone)
        stem = stem * (down * (1.0 - 0.45 * depth) * (1.0 + 0.3 * grain))[..., None]
        lower = smoothstep(0.25, 0.6, y + 0.25 * leaves)
        albedo = mix_colors(albedo.astype(np.float32), stem.astype(np.float32), lower)
    albedo = mix_colors(albedo.astype(np.float32), color(top) * (0.9 + 0.3 * grain)[..., None],
                        0.7 * crown)  # fmt: skip
    return texture(albedo.astype(np.float32), None, (2.0 * stalks + leaves).astype(np.float32))


def _ridges(kind: str, rng: VariantRng) -> Float32:
    """1 on the rows, 0 between them, with rows that wander a little."""
    count = _ROWS[kind]
    x = rows_and_columns(_N)[1]
    wander = 0.012 * fbm((3, 2), 2, rng, 0.5, _N) if count < 20 else np.float32(0.0)
    wave = 0.5 - 0.5 * np.cos(2.0 * math.pi * count * (x + wander))
    ridge: Float32 = np.broadcast_to(wave, (_N, _N)).astype(np.float32)
    return ridge


def _meadow(
    low: Float32, high: Float32, grain: Float32, clouds: Float32, rng: VariantRng
) -> TextureData:
    """Long grass with seed heads and flowers in patches."""
    blades = fbm((60, 120), 3, rng, 0.7, _N)
    albedo = mix_colors(low, high, 0.5 + 0.4 * clouds + 0.2 * blades)
    dry = smoothstep(0.1, 1.1, fbm((5, 5), 5, rng, 0.65, _N))
    albedo = mix_colors(albedo, color("#a39a63"), 0.6 * dry)
    albedo = albedo * (1.0 + 0.2 * blades + 0.35 * grain)[..., None]
    for code, share in (("#e4e0cf", 0.035), ("#d8bf36", 0.05), ("#8d5f93", 0.02)):
        heads = worley((90, 90), rng, size_px=_N)
        here = heads.of_each((uniform(heads.count, rng) < share).astype(np.float64))
        grown = smoothstep(-0.3, 0.5, fbm((4, 4), 3, rng, 0.6, _N))
        dot = here * smoothstep(0.3, 0.2, heads.nearest) * grown
        albedo = mix_colors(albedo.astype(np.float32), color(code), 0.85 * dot)
    return texture(albedo.astype(np.float32), None, (1.5 * blades + grain).astype(np.float32), 0.8)
