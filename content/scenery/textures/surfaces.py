"""Surfaces of houses and plants. All are near-white: the material's colour tints them."""

import numpy as np

from gen_data.content.procedural.textures.texture_images import texture
from gen_data.core import asset_types, noise
from gen_data.core.variant_rng import VariantRng


def roof_tiles(rng: VariantRng) -> asset_types.TextureData:
    """Clay or concrete tiles, the eaves below; 1.8 m per repeat."""
    courses, per_course = (6, 8) if rng.seed % 2 == 0 else (8, 10)
    y, x = noise.rows_and_columns()
    row = np.floor(y * courses).astype(np.int64)
    down = y * courses - row
    along = x * per_course + 0.5 * (row % 2)
    column = np.floor(along).astype(np.int64) % per_course
    across = along - np.floor(along)
    # A pantile: a roll on one side, a trough on the other.
    roll = 0.5 + 0.5 * np.cos(2 * np.pi * (across - 0.25))
    joint = noise.smoothstep(0.06, 0.0, np.abs(across - 0.75))
    lip = noise.smoothstep(0.86, 1.0, down)
    tone = 0.78 + 0.2 * noise.uniform(courses * per_course, rng)
    grime = 0.06 * noise.fbm((4, 4), 5, rng) + 0.05 * noise.fbm((40, 40), 3, rng)
    shade = tone.astype(np.float32)[row * per_course + column] * (1 + grime)
    shade = shade * (1 - 0.55 * lip) * (1 - 0.3 * joint) * (0.8 + 0.2 * roll)
    height = 5.0 * roll + 5.0 * down - 3.0 * joint
    lichen = 0.1 * noise.smoothstep(0.3, 0.9, noise.fbm((7, 7), 5, rng))
    albedo = shade[..., None] * np.array([1.0, 0.98, 0.96]) + lichen[..., None]
    return texture(
        albedo.astype(np.float32), None, noise.blur_image(height.astype(np.float32)), 0.6
    )


def ashlar(rng: VariantRng) -> asset_types.TextureData:
    """Dressed stone blocks with thin joints; 2.4 m per repeat."""
    courses, per_course = 6, 4
    y, x = noise.rows_and_columns()
    row = np.floor(y * courses).astype(np.int64)
    along = x * per_course + 0.5 * (row % 2)
    column = np.floor(along).astype(np.int64) % per_course
    side = np.abs(along - np.round(along)) / per_course
    bed = np.abs(y * courses - np.round(y * courses)) / courses
    edge = 512.0 * np.minimum(side, bed)
    face = noise.smoothstep(1.0, 3.0, edge)
    tone = 0.8 + 0.18 * noise.uniform(courses * per_course, rng)
    grain = noise.fbm((60, 60), 3, rng)
    shade = tone.astype(np.float32)[row * per_course + column]
    shade = shade * (1 + 0.05 * noise.fbm((5, 5), 4, rng) + 0.06 * grain) * (0.62 + 0.38 * face)
    height = 3.0 * noise.smoothstep(0.0, 6.0, edge) + 0.5 * grain
    albedo = shade[..., None] * np.array([1.0, 0.985, 0.96])
    return texture(albedo.astype(np.float32), None, height.astype(np.float32))


def bark(rng: VariantRng) -> asset_types.TextureData:
    """Furrowed bark, the trunk upright; 0.8 m per repeat."""
    bend = 14.0 * noise.fbm((5, 4), 4, rng)
    ridge = np.abs(noise.fbm((4, 12), 4, rng, 0.55))
    furrow = noise.smoothstep(0.2, 0.02, noise.warp_image(ridge, 0 * bend, bend))
    fine = noise.fbm((16, 64), 3, rng)
    depth = rng.between(0.45, 0.65)
    shade = (0.8 + 0.1 * noise.fbm((4, 4), 4, rng) + 0.1 * fine) * (1 - depth * furrow)
    albedo = shade[..., None] * np.array([1.0, 0.97, 0.93])
    height = 1.2 * fine - 5.0 * furrow
    return texture(albedo.astype(np.float32), None, noise.blur_image(height.astype(np.float32)))


def foliage(rng: VariantRng) -> asset_types.TextureData:
    """Dense small leaves, as of a clipped hedge; 0.8 m per repeat."""
    shade = np.full((512, 512), 0.12, dtype=np.float32)
    height = np.zeros((512, 512), dtype=np.float32)
    for cells, level in ((14, 0.35), (20, 0.6), (26, 0.95)):
        points = noise.worley((cells, cells), rng)
        size = 0.28 + 0.25 * noise.uniform(points.count, rng)
        leaf = noise.smoothstep(0.0, 0.1, points.of_each(size) - points.nearest).astype(np.float32)
        tone = points.of_each(level * (0.65 + 0.5 * noise.uniform(points.count, rng)))
        shade = (shade * (1 - leaf) + leaf * tone * (1.0 - 0.5 * points.nearest)).astype(np.float32)
        height = height * (1 - leaf) + leaf * np.float32(4.0 * level)
    albedo = shade[..., None] * np.array([0.95, 1.0, 0.9])
    return texture(albedo.astype(np.float32), None, noise.blur_image(height))


def produce(rng: VariantRng) -> asset_types.TextureData:
    """Round fruit or vegetables of one size side by side in a heap; 0.56 m per repeat."""
    across = (8, 10, 7, 12)[rng.seed % 4]
    points = noise.worley((across, across), rng, 0.45)
    # A ball's height over the gap; each fruit hides a part of its neighbours.
    height = np.sqrt(np.maximum(1.0 - (points.nearest / 0.72) ** 2, 0.0)).astype(np.float32)
    tone = points.of_each(0.72 + 0.28 * noise.uniform(points.count, rng))
    ripe = points.of_each(0.12 * (noise.uniform(points.count, rng) - 0.5))
    shade = tone * (0.16 + 0.84 * noise.smoothstep(0.0, 0.75, height))
    albedo = shade[..., None] * (1.0 + ripe[..., None] * np.array([0.4, 1.0, -0.6]))
    pixels = 512.0 / across
    return texture(
        albedo.astype(np.float32),
        None,
        noise.blur_image((0.5 * pixels * height).astype(np.float32)),
    )
