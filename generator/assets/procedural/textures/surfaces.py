"""Surfaces: wood, with its grain across the image; stone; textiles, leather, cardboard; metal."""

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
    color,
    colors_in_turn,
    draw_color,
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
    ground = draw_color(PALETTES["cements"], 0.06, rng)
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
    base = draw_color(PALETTES["plasters"], 0.04, rng)
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
    shade = 1 + 0.13 * grit + 0.1 * fbm((5, 5), 3, rng)
    albedo = tints.astype(np.float32)[number] * shade[..., None]
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
    albedo = mix_colors(grout_image, albedo, face)
    return texture(albedo, 1.0 - 0.6 * face, 2.0 * face + 0.6 * pillow)


def _folded_noise(cells: tuple[int, int], rng: VariantRng) -> Float32:
    """Noise bent by noise: its zero lines wander like veins."""
    y, x = rows_and_columns()
    bend = 0.9 * fbm(cells, 4, rng, 0.55)
    down, across = cells
    phase = 2 * np.pi * (down * 0.5 * (2 * y) + across * x)
    wave = np.sin(phase + 3.0 * bend + 1.5 * fbm(cells, 3, rng))
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
    relief = (256.0 / yarns * 0.5 * height).astype(np.float32)
    return texture(albedo.astype(np.float32), None, relief)


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


def brushed_metal(seed: int) -> TextureData:
    """Brushed sheet, strokes across the image; 0.3 m per repeat."""
    rng = variant_rng("brushed_metal", seed)
    strokes = np.zeros((SIZE_PX, SIZE_PX), dtype=np.float32)
    for cells, weight in (((256, 2), 0.6), ((128, 4), 0.5), ((512, 8), 0.5), ((64, 1), 0.3)):
        strokes += weight * perlin(cells, rng)
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
