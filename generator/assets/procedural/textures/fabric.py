"""Soft surfaces: woven fabric, carpet, leather, cardboard."""

from __future__ import annotations

import numpy as np

from gen_data.generator.assets.procedural.material_presets import PALETTES
from gen_data.generator.assets.procedural.noise import (
    SIZE_PX,
    blur_image,
    fbm,
    perlin,
    rows_and_columns,
    smoothstep,
    uniform,
    warp_image,
    worley,
)
from gen_data.generator.assets.procedural.textures.texture_images import (
    draw_color,
    mix_colors,
    texture,
)
from gen_data.generator.assets.procedural.variant_rng import VariantRng, variant_rng
from gen_data.generator.core.asset_types import Float32, TextureData


def fabric(seed: int) -> TextureData:
    """Plain or twill weave, plain-coloured, striped or checked; 0.15 m per repeat."""
    rng = variant_rng("fabric", seed)
    yarns = rng.choose((32, 64, 64))
    twill = rng.chance(0.4)
    y, x = rows_and_columns()
    wave_y, wave_x = 0.5 * fbm((8, 8), 2, rng) / yarns, 0.5 * fbm((8, 8), 2, rng) / yarns
    v, u = (y + wave_y) * yarns, (x + wave_x) * yarns
    weft, warp = (np.floor(t).astype(np.int64) % yarns for t in (v, u))
    over = (warp + weft) % 4 < 2 if twill else (warp + weft) % 2 == 0
    across_u, across_v = np.abs(u - np.floor(u) - 0.5), np.abs(v - np.floor(v) - 0.5)
    round_warp, round_weft = 1 - 3.2 * across_u**2, 1 - 3.2 * across_v**2
    arch = np.where(over, 1 - 0.9 * across_v**2, 1 - 0.9 * across_u**2)
    height = np.where(over, round_warp, round_weft) * arch
    warp_colors, weft_colors = _yarn_colors(yarns, rng)
    thread = np.where(over[..., None], warp_colors[warp], weft_colors[weft])
    fuzz = 0.06 * fbm((64, 64), 3, rng, 0.7)
    albedo = thread * (0.62 + 0.42 * height + fuzz)[..., None]
    return texture(
        albedo.astype(np.float32), None, (256.0 / yarns * 0.5 * height).astype(np.float32)
    )


def carpet(seed: int) -> TextureData:
    """Cut or looped pile; 0.5 m per repeat."""
    rng = variant_rng("carpet", seed)
    cells = rng.choose((64, 96, 128))
    tufts = worley((cells, cells), rng, 0.9)
    base, fleck = (draw_color(PALETTES["carpets"], 0.06, rng) for _ in range(2))
    spread = rng.between(0.1, 0.4)
    tone = tufts.of_each(1 + spread * (uniform(tufts.count, rng) - 0.5))
    flecked = tufts.of_each((uniform(tufts.count, rng) < rng.choose((0.0, 0.0, 0.15, 0.4))) * 0.7)
    lying = fbm((3, 3), 4, rng)
    depth = smoothstep(0.95, 0.15, tufts.nearest)
    albedo = mix_colors(np.broadcast_to(base, (SIZE_PX, SIZE_PX, 3)), fleck, flecked)
    albedo = albedo * (tone * (0.55 + 0.45 * depth) * (1 + 0.06 * lying))[..., None]
    return texture(albedo, None, 2.5 * depth + 0.5 * tone)


def leather(seed: int) -> TextureData:
    """Grained leather; 0.2 m per repeat."""
    rng = variant_rng("leather", seed)
    cells = rng.choose((28, 40, 56))
    grain = worley((cells, cells), rng, 0.95)
    bend = 6.0 * fbm((8, 8), 3, rng)
    crease = warp_image(grain.second - grain.nearest, bend, np.roll(bend, 171, axis=1))
    pebble = blur_image(smoothstep(0.02, 0.3, crease))
    base = draw_color(PALETTES["hides"], 0.08, rng)
    worn = 0.08 * fbm((3, 3), 4, rng) + 0.03 * fbm((64, 64), 2, rng)
    albedo = base * (0.72 + 0.28 * pebble + worn)[..., None]
    return texture(albedo, 0.95 - 0.25 * pebble, 2.2 * pebble + 0.3 * fbm((64, 64), 2, rng))


def cardboard(seed: int) -> TextureData:
    """Brown corrugated board; 0.5 m per repeat."""
    rng = variant_rng("cardboard", seed)
    base = draw_color(("#b08a5e", "#a67f55", "#bd9a6d", "#c7a57b", "#9c774e"), 0.05, rng)
    _, x = rows_and_columns()
    flutes = np.sin(2 * np.pi * rng.choose((64, 80)) * x) + 0 * x.T
    clouds, fine = fbm((4, 4), 4, rng), fbm((128, 128), 2, rng)
    fibres = np.abs(perlin((40, 170), rng)) + np.abs(perlin((170, 40), rng))
    specks = smoothstep(0.62, 0.8, perlin((120, 120), rng))
    shade = 1 + 0.012 * flutes + 0.04 * clouds + 0.03 * fine + 0.05 * (fibres - 0.5)
    albedo = base * shade[..., None] * (1 - 0.18 * specks)[..., None]
    return texture(albedo.astype(np.float32), None, (0.5 * flutes + 0.6 * fine).astype(np.float32))


def _yarn_colors(yarns: int, rng: VariantRng) -> tuple[Float32, Float32]:
    """Colour of each warp and each weft yarn, shape [yarns, 3]."""
    first, second = (draw_color(PALETTES["cloth"], 0.06, rng) for _ in range(2))
    kind = rng.choose(("plain", "plain", "melange", "stripes", "check"))
    band = rng.choose((yarns // 4, yarns // 8))
    number = np.arange(yarns)
    banded = (number // band % 2 == 0).astype(np.float32)[:, None]
    striped = (first * (1 - banded) + second * banded).astype(np.float32)
    plain = np.broadcast_to(first, (yarns, 3)).astype(np.float32)
    tone = (1 + 0.08 * (uniform((yarns, 1), rng) - 0.5)).astype(np.float32)
    if kind == "melange":
        return plain * tone, np.broadcast_to(second, (yarns, 3)) * tone
    warp = striped if kind in ("stripes", "check") else plain
    weft = striped if kind == "check" else plain
    return warp * tone, weft * tone
