"""Mineral surfaces: marble, terrazzo, concrete, plaster, brick, tiles."""

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


def marble(seed: int) -> TextureData:
    """Polished marble; 0.8 m per repeat."""
    rng = variant_rng("marble", seed)
    ground, vein_color = colors_in_turn("marbles", seed)
    clouds = fbm((3, 3), 5, rng)
    veins = np.zeros_like(clouds)
    for cells, width, weight in (((2, 2), 0.06, 1.0), ((4, 3), 0.045, 0.6), ((8, 8), 0.03, 0.35)):
        ridge = np.abs(_folded_noise(cells, rng))
        presence = smoothstep(-0.25, 0.5, fbm((2, 2), 2, rng))
        thickness = width * rng.between(0.6, 1.6)
        veins = np.maximum(veins, weight * presence / (1 + (ridge / thickness) ** 2))
    albedo = mix_colors(ground, vein_color, 0.28 * smoothstep(-0.3, 0.9, clouds) + 0.75 * veins)
    return texture(albedo + 0.012 * fbm((64, 64), 2, rng)[..., None], 0.9 + 0.1 * veins)


def terrazzo(seed: int) -> TextureData:
    """Stone chips in cement, ground flat; 0.6 m per repeat."""
    rng = variant_rng("terrazzo", seed)
    ground = draw_color(
        ("#d9d5cc", "#c5c3be", "#e7e2d6", "#6d6e70", "#b8a999", "#dadfdd"), 0.06, rng
    )
    palette = [color(rng.choose(PALETTES["chips"])) for _ in range(rng.choose((2, 3, 4)))]
    albedo = ground + 0.02 * fbm((16, 16), 4, rng)[..., None]
    chips_everywhere = np.zeros((SIZE_PX, SIZE_PX), dtype=np.float32)
    for cells, share in ((9, 0.75), (18, 0.7), (36, 0.5), (70, 0.35)):
        points = worley((cells, cells), rng)
        kept = uniform(points.count, rng) < share * rng.between(0.6, 1.0)
        size = 0.12 + 0.2 * uniform(points.count, rng)
        inside = smoothstep(0.0, 0.08, points.second - points.nearest - points.of_each(size))
        chip = inside * points.of_each(kept.astype(np.float64)) * (1 - chips_everywhere)
        which = (uniform(points.count, rng) * len(palette)).astype(np.int64)
        tints = np.stack(palette)[which] * (0.85 + 0.3 * uniform((points.count, 1), rng))
        albedo = mix_colors(albedo, points.of_each(tints), chip)
        chips_everywhere = np.maximum(chips_everywhere, chip)
    return texture(albedo, 1.0 - 0.25 * chips_everywhere)


def concrete(seed: int) -> TextureData:
    """Cast or screeded concrete with pores and stains; 2 m per repeat."""
    rng = variant_rng("concrete", seed)
    base = draw_color(("#9a9a97", "#aaa8a2", "#8a8b8c", "#b7b3aa", "#7c7d7e"), 0.08, rng)
    clouds, fine = fbm((3, 3), 6, rng, 0.6), fbm((48, 48), 4, rng, 0.7)
    stains = smoothstep(0.1, 0.8, fbm((2, 2), 5, rng, 0.6))
    pores = _pores(40, 0.32, 0.2, rng) + _pores(90, 0.3, 0.12, rng)
    shade = 1 + rng.between(0.05, 0.12) * clouds + 0.05 * fine - rng.between(0.02, 0.14) * stains
    albedo = base * shade[..., None]
    albedo = albedo * (1 - 0.45 * np.clip(pores, 0, 1))[..., None]
    return texture(albedo, 0.9 - 0.12 * stains, 0.5 * fine + 0.8 * clouds - 2.0 * pores)


def plaster(seed: int) -> TextureData:
    """Painted wall plaster, smooth to rough-cast; 1.5 m per repeat."""
    rng = variant_rng("plaster", seed)
    codes = (
        "#efece4",
        "#f3f1ec",
        "#e8e2d4",
        "#dfe3e2",
        "#e9d9c3",
        "#d6c7b0",
        "#cfd8d3",
        "#e7cfc4",
        "#b9c4cb",
        "#d8d4cd",
    )
    base = draw_color(codes, 0.04, rng)
    grain = fbm((40, 40), 4, rng, 0.75)
    strokes = fbm((6, 9), 5, rng, 0.6)
    rough = rng.between(0.15, 1.0)
    shade = 1 + 0.02 * strokes + 0.035 * rough * grain
    return texture(base * shade[..., None], None, rough * 1.6 * grain + 1.2 * strokes)


def brick(seed: int) -> TextureData:
    """A wall in running bond; 1 m per repeat."""
    rng = variant_rng("brick", seed)
    courses, per_course = rng.choose(((12, 4), (14, 5), (10, 4)))
    edge, number = _courses(courses, per_course, 0.5, rng)
    joint = rng.between(2.5, 4.5)
    wobble = 1.2 * fbm((24, 24), 3, rng)
    face = smoothstep(joint, joint + 2.0, edge + wobble)
    bricks = courses * per_course
    base = draw_color(PALETTES["bricks"], 0.08, rng)
    other = draw_color(PALETTES["bricks"], 0.08, rng)
    pick_other = (uniform(bricks, rng) < rng.between(0.0, 0.35)).astype(np.float64)
    tone = 0.72 + 0.33 * uniform(bricks, rng)
    tints = (base + (other - base) * pick_other[:, None]) * tone[:, None]
    grit = fbm((48, 48), 4, rng, 0.7)
    albedo = (
        tints.astype(np.float32)[number] * (1 + 0.13 * grit + 0.1 * fbm((5, 5), 3, rng))[..., None]
    )
    mortar = draw_color(("#b9b2a6", "#cfcabf", "#8d8a85", "#d9d3c5"), 0.06, rng)
    mortar_image = mortar * (1 + 0.08 * fbm((64, 64), 3, rng))[..., None]
    height = 4.0 * face + 0.8 * grit + (uniform(bricks, rng).astype(np.float32)[number]) * face
    return texture(mix_colors(mortar_image, albedo, face), 0.95 - 0.1 * face, blur_image(height))


def tiles(seed: int) -> TextureData:
    """Ceramic tiles with grout: square, subway or checkered; 1 m per repeat."""
    rng = variant_rng("tiles", seed)
    kind = rng.choose(("square", "square", "subway", "checkered"))
    courses, per_course = {"square": (4, 4), "subway": (10, 5), "checkered": (6, 6)}[kind]
    if kind == "square":
        courses = per_course = rng.choose((3, 4, 5, 8))
    edge, number = _courses(courses, per_course, 0.5 if kind == "subway" else 0.0, rng)
    joint = rng.between(1.5, 3.0)
    face = smoothstep(joint, joint + 1.5, edge)
    first, second = (draw_color(PALETTES["tiles"], 0.05, rng) for _ in range(2))
    odd = (number // per_course + number % per_course) % 2 if kind == "checkered" else 0 * number
    tone = (0.96 + 0.08 * uniform(courses * per_course, rng)).astype(np.float32)[number]
    albedo = mix_colors(np.broadcast_to(first, (*odd.shape, 3)), second, odd.astype(np.float32))
    if rng.chance(0.5):
        albedo = albedo * (1 + rng.between(0.02, 0.07) * fbm((6, 6), 5, rng, 0.6))[..., None]
    albedo = albedo * tone[..., None]
    grout = draw_color(("#cfcbc3", "#9b9994", "#e6e3dc", "#6b6a68"), 0.05, rng)
    grout_image = grout * (1 + 0.06 * perlin((64, 64), rng))[..., None]
    pillow = smoothstep(joint, joint + 9.0, edge)
    return texture(
        mix_colors(grout_image, albedo, face), 1.0 - 0.6 * face, 2.0 * face + 0.6 * pillow
    )


def _folded_noise(cells: tuple[int, int], rng: VariantRng) -> Float32:
    """Noise bent by noise: its zero lines wander like veins."""
    y, x = rows_and_columns()
    bend = 0.9 * fbm(cells, 4, rng, 0.55)
    down, across = cells
    wave = np.sin(
        2 * np.pi * (down * 0.5 * (2 * y) + across * x) + 3.0 * bend + 1.5 * fbm(cells, 3, rng)
    )
    folded: Float32 = (wave + 0.35 * fbm((12, 12), 4, rng)).astype(np.float32)
    return folded


def _pores(cells: int, radius: float, share: float, rng: VariantRng) -> Float32:
    """Round holes of varied size in a part of the cells, in [0, 1]."""
    points = worley((cells, cells), rng, 0.7)
    size = radius * (0.3 + 0.7 * uniform(points.count, rng))
    size *= uniform(points.count, rng) < share
    pores: Float32 = smoothstep(0.0, 0.12, points.of_each(size) - points.nearest)
    return pores


def _courses(
    courses: int, per_course: int, offset: float, rng: VariantRng
) -> tuple[Float32, np.ndarray[tuple[int, ...], np.dtype[np.int64]]]:
    """Distance to the nearest joint [px] and number of the brick, for rows of equal bricks."""
    y, x = rows_and_columns()
    row = np.floor(y * courses).astype(np.int64)
    shift = (offset * (row % 2)).astype(np.float32)
    if courses % 2 and offset > 0:
        # An odd number of courses would repeat with two equal ones: shift each by chance.
        shift = uniform(courses, rng).astype(np.float32)[row]
    along = x * per_course + shift
    column = np.floor(along).astype(np.int64) % per_course
    side = np.abs(along - np.round(along)) * SIZE_PX / per_course
    bed = np.abs(y * courses - np.round(y * courses)) * SIZE_PX / courses
    return np.minimum(side, bed), row * per_course + column
