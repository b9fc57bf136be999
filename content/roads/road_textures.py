"""Ground surfaces from above, and road paint. Every image tiles.

Grounds have 1024 pixels: 6 mm each at their usual repeat of 5 to 7 m.
"""

import numpy as np

from gen_data.content.procedural.textures.texture_images import (
    color,
    draw_color,
    mix_colors,
    texture,
)
from gen_data.content.roads.lane_textures import asphalt_color
from gen_data.core.asset_types import Float32, TextureData
from gen_data.core.noise import blur_image, fbm, rows_and_columns, smoothstep, uniform, worley
from gen_data.core.variant_rng import VariantRng

GROUND_PX = 1024
_N = GROUND_PX


def asphalt(rng: VariantRng, wear: float = 0.3, age_years: float = 6.0) -> TextureData:
    """Dense asphalt: stones of up to 11 mm in bitumen, which wears off them; 6 m per repeat.

    Args:
        rng: All that is drawn, also the stone.
        wear: 0 even; 1 stony and stained.
        age_years: Since it was laid: from dark to grey.
    """
    stones = worley((340, 340), rng, size_px=_N)
    tone = stones.of_each(uniform(stones.count, rng) - 0.5)
    grain = (uniform((_N, _N), rng) - 0.5).astype(np.float32)
    clouds = fbm((5, 5), 5, rng, 0.55, _N)
    shade = 1.0 + (0.24 + 0.3 * wear) * tone + 0.26 * grain + (0.03 + 0.035 * wear) * clouds
    oil = smoothstep(0.45, 1.1, fbm((9, 9), 4, rng, 0.6, _N)) * np.float32(0.1 * wear)
    pale = smoothstep(0.4, 1.0, fbm((7, 7), 4, rng, 0.6, _N)) * np.float32(0.07 * wear)
    albedo = asphalt_color(rng.seed, age_years) * (shade * (1.0 - oil + pale))[..., None]
    height = 0.35 * tone + 0.35 * blur_image(grain)
    return texture(albedo.astype(np.float32), 0.97 - 0.5 * oil, height.astype(np.float32), 0.8)


def paving(rng: VariantRng) -> TextureData:
    """Concrete slabs or blocks in straight or running bond; 3 m per repeat."""
    rows, columns, shift = rng.choose(((10, 10, 0.0), (10, 5, 0.5), (15, 15, 0.5), (6, 6, 0.0)))
    edge, number = _bond(rows, columns, shift)
    joint = rng.between(1.2, 2.2)
    face = smoothstep(joint, joint + 1.6, edge + 0.5 * fbm((60, 60), 3, rng, size_px=_N))
    count = rows * columns
    base = draw_color(("#8f8d88", "#9b9890", "#868482", "#a39a8c", "#94867a"), 0.04, rng)
    tone = (1.0 + 0.1 * (uniform(count, rng) - 0.5) * 2.0).astype(np.float32)[number]
    grit = (uniform((_N, _N), rng) - 0.5).astype(np.float32)
    dirt = smoothstep(0.1, 1.0, fbm((6, 6), 5, rng, 0.6, _N))
    slab = base * (tone * (1.0 + 0.1 * grit) * (1.0 - 0.12 * dirt))[..., None]
    joints = color("#55524a") * (1.0 + 0.25 * fbm((90, 90), 3, rng, size_px=_N))[..., None]
    height = 1.4 * face + 0.2 * grit
    return texture(mix_colors(joints.astype(np.float32), slab.astype(np.float32), face),
                   0.98 - 0.06 * face, blur_image(height).astype(np.float32))  # fmt: skip


def cobbles(rng: VariantRng) -> TextureData:
    """Small sett paving in rows; 2.4 m per repeat."""
    rows = rng.choose((24, 26))
    points = worley((rows, rows), rng, jitter=0.38, size_px=_N)
    gap = points.second - points.nearest
    face = smoothstep(0.06, 0.2, gap + 0.03 * fbm((80, 80), 3, rng, size_px=_N))
    base = draw_color(("#77756f", "#827a70", "#6b6c6f", "#8a7d72"), 0.04, rng)
    tone = points.of_each(0.82 + 0.36 * uniform(points.count, rng))
    grit = (uniform((_N, _N), rng) - 0.5).astype(np.float32)
    stone = base * (tone * (1.0 + 0.12 * grit))[..., None]
    sand = color("#5a5449") * (1.0 + 0.2 * grit)[..., None]
    height = 6.0 * np.sqrt(np.clip(gap, 0.0, 1.0)) * face
    return texture(mix_colors(sand.astype(np.float32), stone.astype(np.float32), face),
                   0.95 - 0.15 * face, blur_image(height, 2).astype(np.float32))  # fmt: skip


def grass(rng: VariantRng) -> TextureData:
    """A mown lawn from above: green, straw and bare earth in patches; 5 m per repeat."""
    green, deep, straw = color("#717a48"), color("#566034"), color("#9a9064")
    patches = fbm((7, 7), 6, rng, 0.62, _N)
    albedo = mix_colors(green, deep, smoothstep(-0.5, 0.8, patches))
    dry = smoothstep(0.15, 1.1, fbm((9, 9), 6, rng, 0.66, _N) + rng.between(-0.15, 0.25))
    albedo = mix_colors(albedo, straw, 0.75 * dry)
    bare = smoothstep(0.75, 1.3, fbm((11, 11), 5, rng, 0.65, _N))
    albedo = mix_colors(albedo, color("#6b5a45"), 0.7 * bare)
    # Blades: fine streaks in both directions, dark between them.
    blades = fbm((256, 90), 2, rng, size_px=_N) + fbm((90, 256), 2, rng, size_px=_N)
    speck = (uniform((_N, _N), rng) - 0.5).astype(np.float32)
    shade = 1.0 + 0.17 * blades + 0.3 * speck
    clover = worley((70, 70), rng, size_px=_N)
    leafy = clover.of_each((uniform(clover.count, rng) < 0.06).astype(np.float64))
    albedo = mix_colors(
        albedo, color("#5d7a3c"), 0.5 * leafy * smoothstep(0.5, 0.2, clover.nearest)
    )
    return texture((albedo * shade[..., None]).astype(np.float32), None,
                   (1.1 * blades + speck).astype(np.float32), 0.8)  # fmt: skip


def gravel(rng: VariantRng) -> TextureData:
    """Crushed stone of two sizes; 3 m per repeat."""
    base = draw_color(("#8d8578", "#7c7a76", "#998d7a"), 0.05, rng)
    albedo = np.broadcast_to(base * np.float32(0.7), (_N, _N, 3)).astype(np.float32)
    height = np.zeros((_N, _N), dtype=np.float32)
    for cells, share in ((220, 1.0), (110, 0.45)):
        points = worley((cells, cells), rng, size_px=_N)
        kept = points.of_each((uniform(points.count, rng) < share).astype(np.float64))
        inside = smoothstep(0.03, 0.16, points.second - points.nearest) * kept
        tone = points.of_each(0.7 + 0.55 * uniform(points.count, rng))
        albedo = mix_colors(albedo, (base * tone[..., None]).astype(np.float32), inside)
        height = np.maximum(height, inside * (2.0 - points.nearest))
    clouds = 1.0 + 0.05 * fbm((6, 6), 4, rng, size_px=_N)
    return texture((albedo * clouds[..., None]).astype(np.float32), None, blur_image(height))


def earth(rng: VariantRng) -> TextureData:
    """Bare soil with pebbles and dry grass; 5 m per repeat."""
    base = draw_color(("#7a6650", "#6e5b47", "#86745c"), 0.05, rng)
    clouds = fbm((6, 6), 7, rng, 0.65, _N)
    pebbles = worley((120, 120), rng, size_px=_N)
    here = pebbles.of_each((uniform(pebbles.count, rng) < 0.12).astype(np.float64))
    stone = here * smoothstep(0.4, 0.25, pebbles.nearest)
    speck = (uniform((_N, _N), rng) - 0.5).astype(np.float32)
    soil = base * (1.0 + 0.14 * clouds + 0.18 * speck)[..., None]
    albedo = mix_colors(soil.astype(np.float32), color("#989082"), 0.8 * stone)
    weeds = smoothstep(0.5, 1.2, fbm((12, 12), 5, rng, 0.65, _N))
    albedo = mix_colors(albedo, color("#66683f"), 0.6 * weeds)
    return texture(albedo, None, (1.5 * clouds + 2.0 * stone + speck).astype(np.float32), 0.8)


def road_paint(rng: VariantRng, wear: float = 0.3, age_years: float = 6.0) -> TextureData:
    """White marking: glass beads in paint, dirtied and worn down to the road; 2 m per repeat.

    Args:
        rng: All draws, including the stone of the asphalt below.
        wear: 0 fresh to 1 barely visible in places; 1.6: only traces.
        age_years: Age of the asphalt below.
    """
    grain = (uniform((512, 512), rng) - 0.5).astype(np.float32)
    dirt = smoothstep(-0.6, 1.0, fbm((6, 6), 5, rng, 0.6)) * np.float32(
        min(0.08 + 0.16 * wear, 0.3)
    )
    paint = color("#d6d5cf") * (1.0 - dirt + 0.05 * grain)[..., None]
    bare = asphalt_color(rng.seed, age_years) * (1.03 + 0.35 * grain)[..., None]
    flaking = fbm((14, 14), 6, rng, 0.7) + 0.9 * grain
    limit = 1.75 - 1.5 * wear
    gone = smoothstep(limit, limit + 0.25, flaking)
    return texture(
        mix_colors(paint.astype(np.float32), bare.astype(np.float32), gone), 0.9 + 0.1 * gone
    )


def _bond(rows: int, columns: int, shift: float) -> tuple[Float32, np.ndarray]:
    """Distance to the nearest joint [px] and number of each slab, rows shifted in turn."""
    y, x = (v * np.float32(n) for v, n in zip(rows_and_columns(_N), (rows, columns), strict=True))
    row = np.floor(y)
    along = (x + shift * (row % 2.0)) % columns
    column = np.floor(along)
    from_row = np.minimum(y - row, row + 1.0 - y) * (_N / rows)
    from_column = np.minimum(along - column, column + 1.0 - along) * (_N / columns)
    edge = np.minimum(np.broadcast_to(from_row, from_column.shape), from_column)
    number = (row * columns + column).astype(np.int64)
    return edge.astype(np.float32), number
