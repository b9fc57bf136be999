"""Surfaces: textiles, leather, cardboard; metal."""

import numpy as np

from gen_data.content.procedural.material_presets import PALETTES
from gen_data.content.procedural.textures.texture_images import (
    color,
    draw_color,
    mix_colors,
    texture,
)
from gen_data.core.asset_types import Float32, TextureData
from gen_data.core.noise import (
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
from gen_data.core.variant_rng import VariantRng


def fabric(rng: VariantRng) -> TextureData:
    """Plain or twill weave, plain-coloured, striped or checked; 0.15 m per repeat.

    Yarns of 1.2 mm, as in furnishing fabrics; clothes have finer ones.
    """
    yarns = rng.choose((96, 128, 128))
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
    fuzz = 0.04 * fbm((64, 64), 3, rng, 0.7)
    albedo = thread * (0.78 + 0.26 * height + fuzz)[..., None]
    relief = (64.0 / yarns * height).astype(np.float32)
    return texture(albedo.astype(np.float32), None, relief)


def carpet(rng: VariantRng) -> TextureData:
    """Cut or looped pile of one colour, some with a faint fleck; 0.5 m per repeat.

    Tufts are 3 to 5 mm apart: gauges of 1/8 to 3/16 inch.
    """
    cells = rng.choose((100, 128, 160))
    tufts = worley((cells, cells), rng, 0.9)
    base, fleck = (draw_color(PALETTES["carpets"], 0.04, rng) for _ in range(2))
    spread = rng.between(0.06, 0.16)
    tone = tufts.of_each(1 + spread * (uniform(tufts.count, rng) - 0.5))
    share = rng.choose((0.0, 0.0, 0.15, 0.35))
    flecked = tufts.of_each((uniform(tufts.count, rng) < share) * 0.3)
    lying = fbm((2, 2), 5, rng, 0.6)
    depth = smoothstep(0.95, 0.15, tufts.nearest)
    albedo = mix_colors(np.broadcast_to(base, (SIZE_PX, SIZE_PX, 3)), fleck, flecked)
    albedo = albedo * (tone * (0.74 + 0.26 * depth) * (1 + 0.05 * lying))[..., None]
    return texture(albedo, None, 0.8 * depth + 0.3 * tone)


def leather(rng: VariantRng) -> TextureData:
    """Grained leather, its pebbles 1 to 2 mm wide; 0.2 m per repeat."""
    cells = rng.choose((96, 128, 150))
    grain = worley((cells, cells), rng, 0.95)
    bend = 2.0 * fbm((16, 16), 3, rng)
    crease = warp_image(grain.second - grain.nearest, bend, np.roll(bend, 171, axis=1))
    pebble = blur_image(smoothstep(0.02, 0.3, crease))
    base = draw_color(PALETTES["hides"], 0.06, rng)
    worn = 0.05 * fbm((2, 2), 5, rng, 0.6)
    albedo = base * (0.86 + 0.14 * pebble + worn)[..., None]
    return texture(albedo, 0.95 - 0.08 * pebble, 0.45 * pebble + 0.5 * fbm((12, 12), 3, rng))


def cardboard(rng: VariantRng) -> TextureData:
    """Brown corrugated board; 0.5 m per repeat."""
    base = draw_color(("#b39470", "#a98a66", "#bc9f7b", "#c4a988", "#a2825f"), 0.04, rng)
    _, x = rows_and_columns()
    flutes = np.sin(2 * np.pi * rng.choose((64, 80)) * x) + 0 * x.T
    clouds, fine = fbm((4, 4), 4, rng), fbm((128, 128), 2, rng)
    fibres = np.abs(perlin((40, 170), rng)) + np.abs(perlin((170, 40), rng))
    specks = smoothstep(0.62, 0.8, perlin((120, 120), rng))
    shade = 1 + 0.012 * flutes + 0.04 * clouds + 0.03 * fine + 0.05 * (fibres - 0.5)
    albedo = base * shade[..., None] * (1 - 0.18 * specks)[..., None]
    return texture(albedo.astype(np.float32), None, (0.12 * flutes + 0.4 * fine).astype(np.float32))


def _yarn_colors(yarns: int, rng: VariantRng) -> tuple[Float32, Float32]:
    """Colour of each warp and each weft yarn, shape [yarns, 3]."""
    first, second = (draw_color(PALETTES["cloth"], 0.03, rng) for _ in range(2))
    kind = rng.choose(("plain", "plain", "plain", "melange", "melange", "stripes", "check"))
    # Colours of one cloth go together.
    second = (0.65 * second + 0.35 * first).astype(np.float32)
    band = rng.choose((yarns // 4, yarns // 8))
    number = np.arange(yarns)
    banded = (number // band % 2 == 0).astype(np.float32)[:, None]
    striped = (first * (1 - banded) + second * banded).astype(np.float32)
    plain = np.broadcast_to(first, (yarns, 3)).astype(np.float32)
    tone = (1 + 0.08 * (uniform((yarns, 1), rng) - 0.5)).astype(np.float32)
    if kind == "melange":
        return plain * tone, (0.5 * (plain + second) * tone).astype(np.float32)
    warp = striped if kind in ("stripes", "check") else plain
    weft = striped if kind == "check" else plain
    return warp * tone, weft * tone


def brushed_metal(rng: VariantRng) -> TextureData:
    """Brushed sheet, strokes across the image; 0.3 m per repeat."""
    strokes = np.zeros((SIZE_PX, SIZE_PX), dtype=np.float32)
    for cells, weight in (((256, 2), 0.6), ((128, 4), 0.5), ((512, 8), 0.5), ((64, 1), 0.3)):
        strokes += weight * perlin(cells, rng)
    clouds = fbm((2, 3), 4, rng)
    base = draw_color(PALETTES["bare_metals"], 0.05, rng)
    shade = 1 + rng.between(0.03, 0.06) * strokes + 0.01 * clouds
    return texture(base * shade[..., None], 0.75 + 0.1 * strokes + 0.04 * clouds, 0.1 * strokes)


def painted_metal(rng: VariantRng) -> TextureData:
    """Lacquered sheet with chips, scratches and grime; 0.6 m per repeat."""
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
    worn = np.minimum(paint * 1.5 + 0.12, 0.9)
    albedo = mix_colors(albedo, worn, np.maximum(0.35 * rim, 0.5 * scratches))
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
