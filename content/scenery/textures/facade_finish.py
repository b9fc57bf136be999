"""Surfaces of walls and roofs that carry their age: plaster, panels, boards, sheets, slates."""

import numpy as np

from gen_data.content.procedural.textures.texture_images import color, mix_colors, texture
from gen_data.core import asset_types, noise
from gen_data.core.variant_rng import VariantRng

PLASTER_WIDTH_M = 8.0
"""One repeat of ``weathered_plaster`` along a wall."""


def weathered_plaster(rng: VariantRng) -> asset_types.TextureData:
    """A whole wall from its foot to its eaves; repeats to the sides only.

    Rain leaves streaks below the eaves, splashes darken and green the foot, patches have another
    tone, and render is missing from the oldest. Age rises with the seed modulo 8.
    """
    age = (rng.seed % 8) / 7.0
    y, x = noise.rows_and_columns()
    grain, clouds = noise.fbm((96, 96), 3, rng, 0.75), noise.fbm((3, 4), 5, rng, 0.6)
    shade = 0.93 + 0.02 * grain + (0.03 + 0.05 * age) * clouds
    runs = noise.smoothstep(0.0, 0.9, noise.fbm((1, 48), 3, rng))
    reach = 0.25 + 0.35 * noise.fbm((1, 24), 2, rng)
    streaks = runs * noise.smoothstep(1.0, 0.0, y / np.maximum(reach, 0.05))
    shade = shade * (1.0 - (0.06 + 0.3 * age) * streaks)
    foot = noise.smoothstep(0.84, 1.0, y + 0.06 * noise.fbm((8, 16), 4, rng))
    shade = shade * (1.0 - (0.1 + 0.3 * age) * foot)
    albedo = shade[..., None] * np.array([1.0, 0.995, 0.985], dtype=np.float32)
    algae = foot * noise.smoothstep(-0.2, 0.6, noise.fbm((5, 9), 4, rng)) * (0.1 + 0.4 * age)
    albedo = mix_colors(albedo.astype(np.float32), color("#6f7458"), algae)
    height = 0.9 * grain
    if rng.chance(0.3 + 0.5 * age):
        # Repairs: fields of plain mortar with sharp edges.
        fields = noise.worley((9, 7), rng)
        chosen = noise.uniform(fields.count, rng) < 0.03 + 0.05 * age
        edge = fields.second - fields.nearest + 0.05 * noise.fbm((24, 24), 2, rng)
        patch = fields.of_each(chosen.astype(np.float64)) * noise.smoothstep(0.08, 0.12, edge)
        albedo = mix_colors(albedo, color(rng.choose(("#b9b4aa", "#dcd8ce"))), 0.7 * patch)
    if age > 0.6:
        gone = noise.fbm((4, 4), 6, rng, 0.6) + 0.35 * np.abs(y - 0.55)
        bare = noise.smoothstep(0.62, 0.66, gone)
        course = np.abs(np.sin(np.pi * 96.0 * y)) > 0.25
        upright = np.abs(np.sin(np.pi * (32.0 * x + 0.5 * np.floor(96.0 * y)))) > 0.12
        joints = np.where(course & upright, 1.0, 0.0).astype(np.float32)
        brick = mix_colors(color("#9a9186"), color("#8a5a48") * 0.95, joints)
        albedo = mix_colors(albedo, brick, bare)
        height = height - 3.0 * noise.blur_image(bare)
    return texture(albedo.astype(np.float32), None, height.astype(np.float32), 0.8)


def wall_boards(rng: VariantRng) -> asset_types.TextureData:
    """Painted boards; upright for odd seeds, else weatherboarding. 2 m per repeat."""
    count = rng.choose((12, 14, 16))
    y, x = noise.rows_and_columns()
    across = y * count + 0.0 * x
    board = np.floor(across).astype(np.int64)
    down = (across - board).astype(np.float32)
    tone = (0.86 + 0.12 * noise.uniform(count, rng)).astype(np.float32)[board]
    grain = noise.fbm((96, 5), 3, rng, 0.7)
    worn = noise.smoothstep(0.3, 0.9, noise.fbm((10, 4), 5, rng))
    joint = noise.smoothstep(0.9, 0.97, down)
    shade = tone * (1.0 + 0.05 * grain) * (1.0 - 0.6 * joint) * (1.0 - 0.15 * worn)
    height = 5.0 * down * (1.0 - joint) + 0.6 * grain
    if rng.seed % 2:
        shade, height = shade.T, height.T
    albedo = shade[..., None] * np.array([1.0, 0.99, 0.97])
    return texture(albedo.astype(np.float32), None, height.astype(np.float32), 0.7)


def profiled_sheet(rng: VariantRng) -> asset_types.TextureData:
    """Trapezoidal or standing-seam sheet, ribs upright, with streaks of rain. 2 m per repeat."""
    count = rng.choose((4, 8, 10, 16))
    y, x = noise.rows_and_columns()
    along = x * count + 0.0 * y
    part = np.abs(along - np.floor(along) - 0.5).astype(np.float32) * 2.0
    width = 0.5 if count > 4 else 0.92
    rib = noise.smoothstep(width, width + 0.08, part)
    runs = noise.smoothstep(0.1, 0.9, noise.fbm((2, 40), 4, rng))
    rust = noise.smoothstep(0.55, 0.9, noise.fbm((5, 20), 5, rng)) * rng.between(0.0, 0.6)
    shade = (0.92 + 0.05 * noise.fbm((3, 3), 4, rng)) * (1.0 - 0.12 * runs)
    shade = shade * (1.0 - 0.12 * noise.blur_image(rib, 2))
    albedo = mix_colors(
        np.repeat(shade[..., None], 3, axis=2).astype(np.float32), color("#8a6248"), rust
    )
    return texture(albedo.astype(np.float32), None, 6.0 * noise.blur_image(rib, 2), 1.0)


def slates(rng: VariantRng) -> asset_types.TextureData:
    """Slates or bitumen shingles, the eaves below; 1.8 m per repeat."""
    courses, per_course = rng.choose(((9, 6), (10, 8), (12, 8)))
    y, x = noise.rows_and_columns()
    row = np.floor(y * courses).astype(np.int64)
    along = x * per_course + 0.5 * (row % 2)
    column = np.floor(along).astype(np.int64) % per_course
    down = (y * courses - row + 0.0 * x).astype(np.float32)
    side = np.abs(along - np.round(along)).astype(np.float32)
    tone = 0.72 + 0.26 * noise.uniform(courses * per_course, rng)
    shade = tone.astype(np.float32)[row * per_course + column]
    shade = shade * (1 + 0.06 * noise.fbm((40, 40), 3, rng) + 0.05 * noise.fbm((4, 4), 4, rng))
    shade = shade * (1 - 0.4 * noise.smoothstep(0.9, 1.0, down))
    shade = shade * (1 - 0.35 * noise.smoothstep(0.03, 0.0, side))
    moss = 0.35 * noise.smoothstep(0.5, 1.0, noise.fbm((6, 6), 5, rng))
    albedo = shade[..., None] * np.array([0.99, 1.0, 1.02])
    albedo = mix_colors(albedo.astype(np.float32), color("#6b6f4e"), moss)
    return texture(albedo.astype(np.float32), None, (4.0 * down).astype(np.float32), 0.6)
