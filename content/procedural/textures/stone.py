"""Floors and walls: natural and cast stone, plaster and paint, brick, tiles."""

import numpy as np

from gen_data.content.procedural.material_presets import PALETTES
from gen_data.content.procedural.textures.texture_images import (
    color,
    colors_in_turn,
    draw_color,
    mix_colors,
    texture,
)
from gen_data.core.asset_types import Float32, TextureData
from gen_data.core.noise import (
    SIZE_PX,
    blur_image,
    fbm,
    rows_and_columns,
    smoothstep,
    uniform,
    worley,
)
from gen_data.core.variant_rng import VariantRng, in_turn

_UNJOINTED = 4
"""The first seeds of concrete, used for small castings, have no joints."""


def marble(rng: VariantRng) -> TextureData:
    """Polished marble; 0.8 m per repeat."""
    ground, vein_color = colors_in_turn("marbles", rng.seed)
    strength = rng.between(0.3, 0.65)
    clouds = fbm((3, 3), 5, rng)
    veins = np.zeros_like(clouds)
    for cells, width, weight in (((2, 2), 0.06, 1.0), ((4, 3), 0.045, 0.6), ((8, 8), 0.03, 0.35)):
        ridge = np.abs(_folded_noise(cells, rng))
        presence = smoothstep(-0.25, 0.5, fbm((2, 2), 2, rng))
        thickness = width * rng.between(0.6, 1.6)
        veins = np.maximum(veins, weight * presence / (1 + (ridge / thickness) ** 2))
    albedo = mix_colors(ground, vein_color, 0.25 * smoothstep(-0.3, 0.9, clouds) + strength * veins)
    return texture(albedo + 0.012 * fbm((64, 64), 2, rng)[..., None], 0.9 + 0.1 * veins)


def terrazzo(rng: VariantRng) -> TextureData:
    """Stone chips of 3 to 16 mm in cement, ground flat; 0.6 m per repeat.

    Sizes of the trade's chips No. 1 to 4 (NTMA; from memory).
    """
    ground = draw_color(PALETTES["cements"], 0.04, rng)
    palette = [color(rng.choose(PALETTES["chips"])) for _ in range(rng.choose((2, 3, 4)))]
    # Chips of most floors are near the tone of their ground.
    contrast = rng.choose((0.35, 0.5, 0.5, 0.8))
    albedo = ground + 0.012 * fbm((16, 16), 4, rng)[..., None]
    chips_everywhere = np.zeros((SIZE_PX, SIZE_PX), dtype=np.float32)
    for cells, share in rng.choose((((28, 0.5), (50, 0.6), (90, 0.5)), ((50, 0.7), (90, 0.5)))):
        points = worley((cells, cells), rng)
        kept = uniform(points.count, rng) < share * rng.between(0.6, 1.0)
        size = 0.12 + 0.2 * uniform(points.count, rng)
        inside = smoothstep(0.0, 0.12, points.second - points.nearest - points.of_each(size))
        chip = inside * points.of_each(kept.astype(np.float64)) * (1 - chips_everywhere)
        which = (uniform(points.count, rng) * len(palette)).astype(np.int64)
        tints = np.stack(palette)[which] * (0.9 + 0.2 * uniform((points.count, 1), rng))
        albedo = mix_colors(albedo, points.of_each(tints), contrast * chip)
        chips_everywhere = np.maximum(chips_everywhere, chip)
    return texture(albedo, 1.0 - 0.15 * chips_everywhere)


def granite(rng: VariantRng) -> TextureData:
    """Polished granite with grains of 1 to 5 mm, or quartz agglomerate; 0.4 m per repeat."""
    ground, other, dark = colors_in_turn("granites", rng.seed)
    # Agglomerates are nearly plain.
    strength = rng.choose((0.25, 0.7, 1.0))
    grains, mica = worley((110, 110), rng), worley((150, 150), rng)
    kind = grains.of_each(uniform(grains.count, rng))
    crowding = 0.12 * fbm((6, 6), 3, rng)
    feldspar = smoothstep(0.5, 0.75, kind + crowding)
    specks = mica.of_each((uniform(mica.count, rng) < 0.14).astype(np.float64))
    specks = specks * smoothstep(0.75, 0.45, mica.nearest)
    color = np.broadcast_to(ground, (SIZE_PX, SIZE_PX, 3))
    albedo = mix_colors(color, other, strength * 0.8 * feldspar)
    albedo = mix_colors(albedo, dark, strength * 0.8 * specks)
    return texture(albedo + 0.012 * (kind - 0.5)[..., None], 0.95 + 0.05 * specks)


def concrete(rng: VariantRng) -> TextureData:
    """Cast concrete: clouds, few bug holes, joints of the formwork; 2 m per repeat.

    Tones of fair-faced concrete vary by a few percent, pores of 2 to 15 mm cover 0.3 to 1.2 % of it
    (DBV and VDZ, "Sichtbeton", classes P4 to P1; from memory), most of them below 6 mm; a texel is
    4 mm. Grey cement is nearly neutral.
    """
    base = color(in_turn(PALETTES["concretes"], rng.seed))
    clouds, fine = fbm((3, 3), 5, rng, 0.55), fbm((64, 64), 3, rng, 0.7)
    # Fresh concrete runs down its formwork.
    streaks = fbm((2, 24), 3, rng)
    holes = _pores(48, 0.12, 0.1, rng) + _pores(90, 0.16, 0.06, rng)
    joint = _formwork(rng) if rng.seed >= _UNJOINTED else np.zeros_like(clouds)
    shade = 1 + rng.between(0.03, 0.07) * clouds + 0.02 * fine + rng.between(0.0, 0.02) * streaks
    shade *= 1 - 0.25 * np.clip(holes, 0, 1) - 0.13 * joint
    height = 0.12 * fine - 0.5 * holes - 0.4 * joint
    return texture(base * shade[..., None], 0.92 + 0.03 * clouds, height)


def _formwork(rng: VariantRng) -> Float32:
    """Fine joints between panels of formwork, and the plugs of their ties, in [0, 1]."""
    panels_down, panels_across = rng.choose(((1, 1), (2, 1), (1, 2), (8, 1)))
    y, x = rows_and_columns()
    down = np.abs(y * panels_down - np.round(y * panels_down)) * (SIZE_PX / panels_down)
    across = np.abs(x * panels_across - np.round(x * panels_across)) * (SIZE_PX / panels_across)
    joint = smoothstep(1.2, 0.4, np.minimum(down, across)).astype(np.float32)
    if panels_down > 2:
        # Boards leave a faint seam only.
        return 0.35 * joint
    apart_y = np.abs(y * 2 - np.floor(y * 2) - 0.5) * (SIZE_PX / 2)
    apart_x = np.abs(x * 2 - np.floor(x * 2) - 0.5) * (SIZE_PX / 2)
    rim = np.abs(np.sqrt(apart_x**2 + apart_y**2) - 3.0)
    ties: Float32 = np.maximum(joint, 0.7 * smoothstep(1.2, 0.3, rim)).astype(np.float32)
    return ties


def screed(rng: VariantRng) -> TextureData:
    """A floor of floated concrete: soft mottling, hairline cracks; 2.5 m per repeat."""
    base = color(in_turn(PALETTES["concretes"], rng.seed))
    clouds, mottling = fbm((2, 2), 5, rng, 0.6), fbm((12, 12), 4, rng, 0.6)
    stains = smoothstep(0.25, 0.9, fbm((4, 4), 5, rng, 0.55))
    cells = worley((2, 2), rng, 0.9)
    bend = 0.02 * fbm((12, 12), 4, rng, 0.65)
    edge = np.abs(cells.second - cells.nearest + bend)
    crack = smoothstep(0.008, 0.002, edge) * smoothstep(-0.2, 0.3, fbm((2, 2), 2, rng))
    crack *= rng.choose((0.0, 0.06, 0.1))
    shade = 1 + rng.between(0.03, 0.07) * clouds + rng.between(0.015, 0.035) * mottling
    shade -= rng.between(0.0, 0.08) * stains + crack
    rough = 0.92 + 0.08 * mottling - 0.12 * stains
    return texture(base * shade[..., None], rough, 0.08 * mottling - crack)


def plaster(rng: VariantRng) -> TextureData:
    """Painted wall plaster, floated smooth to sanded; 1.5 m per repeat."""
    base = draw_color(PALETTES["plasters"], 0.03, rng)
    grain = fbm((128, 128), 2, rng, 0.8)
    strokes = fbm((6, 9), 5, rng, 0.6)
    rough = rng.between(0.1, 0.6)
    shade = 1 + 0.012 * strokes + 0.03 * rough * grain
    return texture(base * shade[..., None], None, 0.25 * rough * grain + 0.15 * strokes)


def paint(rng: VariantRng) -> TextureData:
    """White wall paint, for any tint: the stipple of a roller, or woodchip; 1.2 m per repeat.

    Rollers leave waves of 1 to 3 mm, 0.1 mm high; chips of woodchip paper are 2 to 8 mm long.
    """
    stipple, wide = fbm((160, 160), 2, rng, 0.7), fbm((3, 3), 5, rng, 0.6)
    shade = 0.96 + rng.between(0.006, 0.012) * wide + 0.009 * stipple
    height = rng.between(0.03, 0.1) * stipple + rng.between(0.05, 0.15) * fbm((10, 10), 3, rng)
    if rng.seed % 8 == 7:
        chips = worley((110, 90), rng)
        raised = chips.of_each((uniform(chips.count, rng) < 0.35).astype(np.float64))
        height += 0.45 * blur_image(raised * smoothstep(0.7, 0.2, chips.nearest))
    albedo = np.broadcast_to(np.float32(1.0), (SIZE_PX, SIZE_PX, 3)) * shade[..., None]
    return texture(albedo.astype(np.float32), 0.97 + 0.03 * stipple, height)


def brick(rng: VariantRng) -> TextureData:
    """A wall in running bond; 1 m per repeat."""
    courses, per_course = rng.choose(((12, 4), (14, 5), (10, 4)))
    edge, number = _courses(courses, per_course, 0.5, rng)
    joint = rng.between(2.5, 4.5)
    wobble = 1.2 * fbm((24, 24), 3, rng)
    face = smoothstep(joint, joint + 2.0, edge + wobble)
    bricks = courses * per_course
    base = draw_color(PALETTES["bricks"], 0.08, rng)
    other = draw_color(PALETTES["bricks"], 0.08, rng)
    pick_other = (uniform(bricks, rng) < rng.between(0.0, 0.35)).astype(np.float64)
    tone = 0.8 + 0.17 * uniform(bricks, rng)
    tints = (base + (other - base) * pick_other[:, None]) * tone[:, None]
    grit = fbm((48, 48), 4, rng, 0.7)
    shade = 1 + 0.1 * grit + 0.08 * fbm((5, 5), 3, rng)
    albedo = tints.astype(np.float32)[number] * shade[..., None]
    mortar = draw_color(("#b9b2a6", "#cfcabf", "#8d8a85", "#d9d3c5"), 0.06, rng)
    mortar_image = mortar * (1 + 0.08 * fbm((64, 64), 3, rng))[..., None]
    height = 4.0 * face + 0.8 * grit + (uniform(bricks, rng).astype(np.float32)[number]) * face
    return texture(mix_colors(mortar_image, albedo, face), 0.95 - 0.1 * face, blur_image(height))


_WALL_TILES_CM = ((10, 10), (7.5, 15), (15, 15), (20, 20), (30, 60), (20, 40), (7.5, 15), (30, 30))
_FLOOR_TILES_CM = ((30, 30), (60, 60), (30, 60), (20, 20), (60, 60), (40, 40), (30, 60), (15, 15))


def tiles(rng: VariantRng) -> TextureData:
    """Wall tiles with grout, most of them white and glossy; 1.2 m per repeat."""
    tall, wide = in_turn(_WALL_TILES_CM, rng.seed)
    glossy = tall < 25 or rng.chance(0.5)
    return _tiled(rng, tall, wide, "wall_tiles", rng.seed, 0.22 if glossy else 0.45)


def floor_tiles(rng: VariantRng) -> TextureData:
    """Floor tiles with grout, plain or like stone, some checkered; 1.2 m per repeat."""
    tall, wide = in_turn(_FLOOR_TILES_CM, rng.seed)
    return _tiled(rng, tall, wide, "floor_tiles", rng.seed, rng.between(0.35, 0.6))


def _tiled(
    rng: VariantRng, tall_cm: float, wide_cm: float, palette: str, seed: int, gloss: float
) -> TextureData:
    """Tiles of one size and palette; ``gloss`` is the roughness of their faces.

    Joints are 2 to 5 mm wide (DIN 18157-1 allows 1 to 8 mm; from memory), in the tone of the tiles
    or a little darker; a texel is 2.3 mm.
    """
    courses, per_course = round(120 / tall_cm), round(120 / wide_cm)
    bond = rng.choose((0.0, 0.5)) if wide_cm == 2 * tall_cm and courses % 2 == 0 else 0.0
    edge, number = _courses(courses, per_course, bond, rng)
    joint = rng.between(0.5, 1.0)
    face = smoothstep(joint - 0.4, joint + 0.8, edge)
    ground, other = colors_in_turn(palette, 7 * seed)
    spread = rng.choose((0.01, 0.02, 0.05))
    count = courses * per_course
    tone = (1 + spread * (uniform(count, rng) - 0.5)).astype(np.float32)[number]
    albedo = np.broadcast_to(ground, (SIZE_PX, SIZE_PX, 3)).astype(np.float32)
    if max(tall_cm, wide_cm) >= 30 and rng.chance(0.6):
        clouds = fbm((4, 4), 5, rng, 0.6)
        veins = 1 / (1 + (np.abs(_folded_noise((3, 3), rng)) / 0.08) ** 2)
        albedo = mix_colors(albedo, other, 0.25 * smoothstep(-0.6, 0.9, clouds) + 0.2 * veins)
    elif palette == "floor_tiles" and courses == per_course and courses % 2 == 0:
        odd = (number // per_course + number % per_course) % 2
        albedo = mix_colors(albedo, other, rng.choose((0.0, 0.0, 0.9)) * odd)
    albedo = albedo * tone[..., None] + 0.006 * fbm((24, 24), 2, rng)[..., None]
    # Grout is paler than dark tiles and darker than white ones.
    grout = mix_colors(np.array(albedo), color("#a9a59c"), np.full(edge.shape, 0.6))
    grout *= np.float32(rng.choose((0.92, 0.92, 0.8)))
    # Tiles are tilted a little against the plane: each reflects another place.
    tilt = ((uniform((2, count), rng) - 0.5) * 0.02).astype(np.float32)[:, number]
    y, x = rows_and_columns()
    height = SIZE_PX * (
        tilt[0] * (y - np.round(y * courses) / courses)
        + tilt[1] * (x - np.round(x * per_course) / per_course)
    )
    height = 0.35 * smoothstep(joint, joint + 2.5, edge) + height * face
    return texture(mix_colors(grout, albedo, face), 0.95 - (0.95 - gloss) * face, height)


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
