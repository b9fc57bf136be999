"""Textures of garments: folds, seams, washing, patterns and prints.

Plain cloth is light grey, and the material has the garment's colour; patterned and printed cloth
has its own colours. Folds are drawn where cloth is compressed or pulled: below the armpits, at
waist, elbows, crotch and knees, and above the shoes. ``garment_layout`` maps them to bodies.
"""

import numpy as np

from gen_data.config.data_files import load_table
from gen_data.content.people.garment_layout import (
    BACK_M,
    FRONT_M,
    LIMB_M,
    LIMB_WIDTH_M,
    SHOULDER_ROW_M,
    TILE_M,
    TOP_Z_M,
    TRUNK_RADIUS_M,
    texel_places,
)
from gen_data.content.procedural.textures import artwork
from gen_data.content.procedural.textures.texture_images import (
    color,
    draw_color,
    mix_colors,
    texture,
)
from gen_data.core.asset_types import Float32, TextureData
from gen_data.core.noise import SIZE_PX, fbm, perlin, smoothstep, warp_image
from gen_data.core.variant_rng import VariantRng, in_turn, variant_rng

_INKS = load_table(__package__, "garment_inks", tuple[str, ...])
_PX_PER_M = SIZE_PX / TILE_M
_ROW_M, _COLUMN_M = texel_places(SIZE_PX)
_Z_M = TOP_Z_M - _ROW_M
_LIMB = ((_COLUMN_M >= LIMB_M) & (_COLUMN_M < LIMB_M + LIMB_WIDTH_M)).astype(np.float32)
_TRUNK = 1 - _LIMB
_TURN = np.clip((_COLUMN_M - LIMB_M) / LIMB_WIDTH_M, 0.0, 1.0)
"""Around a limb: 0 = its front or outer side, 1 = the opposite side."""
_FROM_FRONT_M, _FROM_BACK_M = np.abs(_COLUMN_M - FRONT_M), np.abs(_COLUMN_M - BACK_M)
_ASIDE_M = np.minimum(_FROM_FRONT_M, _FROM_BACK_M)
_IS_FRONT = _FROM_FRONT_M < _FROM_BACK_M
_HALF_M = 0.5 * np.pi * TRUNK_RADIUS_M
_CLOTH = 0.88
"""Grey of smooth plain cloth; valleys of folds are darker, ridges lighter."""


def jersey(rng: VariantRng) -> TextureData:
    """Plain T-shirts and pullovers, softly folded."""
    return _shaded(_plain(), _top_folds(rng, rng.between(0.7, 1.1)))


def jacket_cloth(rng: VariantRng) -> TextureData:
    """Jackets and coats: stiff folds, a zip or buttons, pockets, hems, cuffs."""
    folds = _top_folds(rng, rng.between(1.0, 1.5))
    pocket_z = rng.between(0.07, 0.13)
    at_pocket = (np.abs(_FROM_FRONT_M - 0.13) < 0.05) & _IS_FRONT
    lines = 0.7 * _line(_Z_M + 0.5 * (_FROM_FRONT_M - 0.13), pocket_z, 0.005) * at_pocket
    lines = lines + 0.4 * _TRUNK * _line(_Z_M, -0.03, 0.005) + 0.35 * _line(_ASIDE_M, 0.19, 0.004)
    # Sleeves end half a metre below the shoulder; a strip or a seam lies above their hem.
    lines = lines + 0.5 * _LIMB * _line(_ROW_M, SHOULDER_ROW_M + 0.44, 0.004)
    if rng.seed % 3 == 1:
        buttons = _buttons()
        lines = lines + 0.6 * _line(_COLUMN_M - FRONT_M, 0.03, 0.004)
        albedo = _plain() * (1 - 0.5 * np.clip(lines, 0, 1))[..., None]
        albedo = mix_colors(albedo, color("#2b2724"), buttons)
        return _shaded(albedo, folds - lines + 2.0 * buttons)
    flap = _line(_FROM_FRONT_M, 0.026, 0.004)
    teeth = _line(_FROM_FRONT_M, 0.0, 0.007)
    notches = 0.5 + 0.5 * np.sin(2.0 * np.pi * _ROW_M / 0.008)
    lines = lines + 0.8 * teeth + (0.6 * flap if rng.seed % 3 == 2 else 0.0)
    albedo = _plain() * (1 - 0.55 * np.clip(lines, 0, 1))[..., None]
    albedo = mix_colors(albedo, color("#9a9a9c"), 0.8 * _line(_FROM_FRONT_M, 0.0, 0.004) * notches)
    return _shaded(albedo, folds - lines + 1.0 * teeth * notches)


def _buttons() -> Float32:
    pitch_m, radius_m = 0.105, 0.011
    down = np.abs((_Z_M - 0.3) / pitch_m - np.rint((_Z_M - 0.3) / pitch_m)) * pitch_m
    away = np.hypot(_COLUMN_M - FRONT_M, down)
    return np.asarray(
        smoothstep(radius_m, 0.7 * radius_m, away) * _band(_Z_M, -0.3, 0.5), np.float32
    )


def quilted(rng: VariantRng) -> TextureData:
    """Down jackets: level chambers with puckered seams."""
    chamber_m = rng.choose((0.055, 0.075, 0.1))
    wobble = 0.004 * fbm((6, 10), 2, rng)
    across = (_ROW_M + wobble) / chamber_m
    bulge = np.sqrt(np.abs(np.sin(np.pi * across)))
    puckers = (1 - bulge) * perlin((16, 90), rng)
    zipper = _line(_FROM_FRONT_M, 0.0, 0.01)
    height = 0.1 * chamber_m * _PX_PER_M * bulge + 1.6 * puckers + 0.8 * fbm((9, 9), 2, rng)
    albedo = _plain() * (1 - 0.5 * zipper)[..., None]
    return _shaded(albedo, (height - zipper).astype(np.float32), 0.09)


def denim(rng: VariantRng) -> TextureData:
    """Jeans: pale thighs and knees, whiskers at the hips, twin seams, pockets; some are torn."""
    folds = _leg_folds(rng, 1.1)
    wash = in_turn((0.0, 0.35, 0.6, 0.85), rng.seed)
    thigh = np.exp(-(((_Z_M + 0.27) / 0.17) ** 2)) * np.exp(-((_TURN / 0.33) ** 2)) * _LIMB
    seat = _TRUNK * (1 - _IS_FRONT) * np.exp(-(((_Z_M - 0.02) / 0.07) ** 2))
    worn = wash * (0.85 * thigh + 0.5 * seat + 0.25 * smoothstep(0.2, 1.6, folds))
    grain = 0.06 * perlin((256, 128), rng) + 0.05 * fbm((24, 24), 3, rng)
    seams = _LIMB * (_line(_TURN * LIMB_WIDTH_M, 0.5 * LIMB_WIDTH_M, 0.004))
    seams = seams + _TRUNK * (_line(_Z_M, 0.105, 0.004) + 0.8 * _pockets())
    cloth = 0.55 * (1.0 + grain) * (1 - 0.35 * np.clip(seams, 0, 1))
    albedo = mix_colors(_rgb(cloth), color("#e6eaf0"), 0.75 * worn * (1 + 2.0 * grain))
    belt = _TRUNK * _band(_Z_M, 0.1, 0.14) * rng.choose((0.0, 0.9))
    albedo = mix_colors(albedo, color("#2a2422"), belt)
    return _shaded(albedo, folds - 0.8 * seams, 0.1)


def trouser_cloth(rng: VariantRng) -> TextureData:
    """Chinos, or with even seeds suit trousers with a crease."""
    folds = _leg_folds(rng, 0.75)
    seams = _LIMB * _line(_TURN * LIMB_WIDTH_M, 0.5 * LIMB_WIDTH_M, 0.004)
    seams = seams + 0.7 * _TRUNK * (_line(_Z_M, 0.105, 0.004) + _pockets())
    crease = _LIMB * (np.exp(-_TURN / 0.03) + np.exp(-(1 - _TURN) / 0.03))
    belt = _TRUNK * _band(_Z_M, 0.1, 0.14)
    albedo = _plain() * (1 - 0.3 * np.clip(seams, 0, 1) - 0.7 * belt)[..., None]
    height = folds - 0.7 * seams + (2.0 if rng.seed % 2 == 0 else 0.0) * crease
    return _shaded(albedo, height.astype(np.float32))


def skirt_cloth(rng: VariantRng) -> TextureData:
    """Skirts that hang in long folds; every other one is pleated."""
    hang = perlin((2, 30), rng) + 0.5 * perlin((4, 64), rng)
    if rng.seed % 2:
        pleat = _COLUMN_M / 0.035
        hang = 1.8 * (pleat - np.floor(pleat)) + 0.3 * hang
    fullness = smoothstep(0.15, -0.25, _Z_M)
    height = 2.2 * fullness * hang + 0.4 * _top_folds(rng, 0.8)
    return _shaded(_plain(), height)


def striped_jersey(rng: VariantRng) -> TextureData:
    """Level stripes: sailor's shirts, rugby shirts, single bands across the chest."""
    ground, ink = _pair("stripes", rng.seed)
    period_m = rng.choose((0.022, 0.035, 0.06, 0.1))
    share = rng.choose((0.3, 0.5, 0.5))
    down = np.where(_LIMB > 0, _ROW_M + 0.42, _ROW_M) / period_m
    inked = smoothstep(0.46, 0.54, 0.5 + 0.5 * (share - (down - np.floor(down))) / 0.12)
    if rng.seed % 4 == 3:
        inked = _TRUNK * _band(_Z_M, 0.3, 0.4) + _LIMB * _band(_ROW_M, 0.18, 0.28)
    albedo = mix_colors(_filled(ground), ink, inked.astype(np.float32))
    return _shaded(albedo, _top_folds(rng, rng.between(0.7, 1.1)))


def checked_shirt(rng: VariantRng) -> TextureData:
    """Checks and tartans in two or three colours."""
    ground, ink = _pair("checks", rng.seed)
    period_m = rng.choose((0.02, 0.05, 0.08))
    width = rng.choose((0.5, 0.35))
    upright, level = (
        _inside(t / period_m, width) for t in (_COLUMN_M + 0 * _ROW_M, _ROW_M + 0 * _COLUMN_M)
    )
    albedo = mix_colors(_filled(ground), ink, 0.5 * (upright + level))
    if rng.chance(0.6):
        thin = draw_color(_INKS["threads"], 0.03, rng)
        threads = [
            _inside(t / period_m + 0.25, 0.07)
            for t in (_COLUMN_M + 0 * _ROW_M, _ROW_M + 0 * _COLUMN_M)
        ]
        albedo = mix_colors(albedo, thin, 0.7 * np.maximum(*threads))
    buttons = _line(_FROM_FRONT_M, 0.0, 0.004)
    return _shaded(albedo, _top_folds(rng, 1.0) - buttons)


def patterned_cloth(rng: VariantRng) -> TextureData:
    """Dots, flowers and camouflage."""
    ground, ink = _pair("patterns", rng.seed)
    cells = rng.choose((14, 24, 36))
    blots = fbm((cells, cells), rng.choose((1, 2)), rng)
    albedo = mix_colors(_filled(ground), ink, smoothstep(0.22, 0.3, blots))
    more = draw_color(_INKS["threads"], 0.05, rng)
    albedo = mix_colors(albedo, more, smoothstep(0.42, 0.48, np.roll(blots, 137, axis=1)))
    return _shaded(albedo, _top_folds(rng, 0.9))


def printed_jersey(seed: int) -> TextureData:
    """T-shirts and hoodies with lettering or a picture on the chest, some also on the back."""
    rng = variant_rng("printed_jersey", seed)
    ground, ink = _pair("prints", seed)
    albedo = _print(_filled(ground), FRONT_M, ink, rng)
    if rng.chance(0.3):
        albedo = _print(albedo, BACK_M, ink, rng)
    return _shaded(albedo, _top_folds(rng, rng.between(0.7, 1.1)))


def hi_vis(seed: int) -> TextureData:
    """Warning clothes: two silver bands around, one over each shoulder, one on each sleeve.

    Bands are 5 cm wide as EN ISO 20471 demands of class 2.
    """
    rng = variant_rng("hi_vis", seed)
    ground = color(in_turn(_INKS["hi_vis"], seed))
    bands = _TRUNK * (_band(_Z_M, 0.1, 0.15) + _band(_Z_M, 0.22, 0.27))
    bands = bands + _TRUNK * _band(_ASIDE_M, 0.085, 0.135) * (_Z_M > 0.27)
    bands = bands + _LIMB * (_band(_ROW_M, 0.3, 0.35) + _band(_ROW_M, 0.42, 0.47))
    albedo = mix_colors(_filled(ground), color("#b9bdc1"), np.clip(bands, 0, 1))
    return _shaded(albedo, _top_folds(rng, 1.1))


def hair_strands(rng: VariantRng) -> TextureData:
    """Strands from above to below, in locks, or curls; a light grey. 0.25 m per repeat."""
    if rng.seed % 2:
        bend, sway = 9.0 * perlin((9, 9), rng), 9.0 * perlin((9, 9), rng)
        curls = np.abs(warp_image(perlin((26, 26), rng), bend, sway))
        height = (2.6 * curls - 0.6 + 0.5 * perlin((60, 60), rng)).astype(np.float32)
        return texture(_rgb(0.76 + 0.24 * height), None, 2.2 * height)
    bend = 7.0 * perlin((4, 6), rng)
    strands = 0.6 * perlin((4, 128), rng) + 0.4 * perlin((6, 220), rng)
    locks = perlin((3, 26), rng) + 0.6 * perlin((3, 11), rng)
    height = warp_image((strands + 1.2 * locks).astype(np.float32), 0.0 * bend, bend)
    return texture(_rgb(0.78 + 0.26 * height), None, 1.5 * height)


def skin_relief(rng: VariantRng) -> TextureData:
    """Skin: blotches of blood, pores, a few freckles. 0.3 m per repeat."""
    blotches, pores = fbm((6, 6), 4, rng), fbm((70, 70), 2, rng)
    freckles = smoothstep(0.5, 0.8, fbm((60, 60), 1, rng))
    warm = np.array([1.0, 0.965, 0.955], np.float32)
    shade = 0.95 + 0.025 * pores - 0.07 * freckles
    albedo = shade[..., None] * (1 - (1 - warm) * (1.2 * np.clip(blotches, -1, 1))[..., None])
    return texture(albedo.astype(np.float32), None, 0.35 * pores + 0.5 * blotches)


def _top_folds(rng: VariantRng, strength: float) -> Float32:
    """Height of the folds of a top [px]."""
    level, steep = _ridges((20, 5), rng), _ridges((13, 7), rng)
    # From the armpits cloth is pulled towards the middle and down.
    pulled = warp_image(steep, 0.9 * _ASIDE_M * _PX_PER_M + 0 * _ROW_M, 0 * _ROW_M)
    slack = np.exp(-(((_Z_M - 0.09) / 0.09) ** 2)) * (0.5 + 0.5 * smoothstep(0.05, 0.2, _ASIDE_M))
    armpit = np.exp(-(((_Z_M - 0.34) / 0.12) ** 2)) * smoothstep(0.05, 0.19, _ASIDE_M)
    drape = fbm((5, 9), 3, rng)
    trunk = 2.2 * slack * level + 2.6 * armpit * pulled + 1.1 * drape + 0.8 * pulled
    along = _ROW_M - SHOULDER_ROW_M
    elbow = np.exp(-(((along - 0.23) / 0.07) ** 2)) + smoothstep(0.36, 0.46, along)
    rings = _ridges((34, 6), rng)
    sleeve = (2.0 * elbow + 0.5) * rings + 0.8 * drape
    folds: Float32 = (strength * (_TRUNK * trunk + _LIMB * sleeve)).astype(np.float32)
    return folds


def _leg_folds(rng: VariantRng, strength: float) -> Float32:
    """Height of the folds of trousers [px]."""
    rings, whiskers = _ridges((30, 5), rng), _ridges((16, 6), rng)
    knee = np.exp(-(((_Z_M + 0.37) / 0.06) ** 2)) * (0.4 + 0.6 * _TURN)
    shoe = smoothstep(-0.6, -0.72, _Z_M)
    crotch = np.exp(-(((_Z_M + 0.07) / 0.07) ** 2))
    drape = fbm((6, 9), 3, rng)
    leg = (2.2 * knee + 2.4 * shoe) * rings + 1.8 * crotch * whiskers + 1.0 * drape
    hips = 1.6 * smoothstep(0.05, -0.05, _Z_M) * whiskers + 0.7 * drape
    folds: Float32 = (strength * (_LIMB * leg + _TRUNK * hips)).astype(np.float32)
    return folds


def _ridges(cells: tuple[int, int], rng: VariantRng) -> Float32:
    """Narrow ridges and wide valleys in about [0, 1], longer across than down."""
    bend = 9.0 * fbm((5, 5), 2, rng)
    noise = warp_image(perlin(cells, rng), bend, np.roll(bend, 91, axis=0))
    ridges: Float32 = ((1.0 - np.minimum(1.0, 1.6 * np.abs(noise))) ** 2).astype(np.float32)
    return ridges


def _pockets() -> Float32:
    front = _IS_FRONT * _line(_Z_M - 0.7 * (_FROM_FRONT_M - 0.13), 0.05, 0.005)
    front = front * ((_FROM_FRONT_M > 0.1) & (_FROM_FRONT_M < 0.17))
    aside, down = np.abs(_FROM_BACK_M - 0.085), np.abs(_Z_M - 0.01)
    edge = np.maximum(aside - 0.055, down - 0.065)
    pockets: Float32 = (front + ~_IS_FRONT * _line(edge, 0.0, 0.004)).astype(np.float32)
    return pockets


def _print(albedo: Float32, middle_m: float, ink: Float32, rng: VariantRng) -> Float32:
    width_m = rng.choose((0.1, 0.2, 0.26))
    height_m = width_m * rng.choose((0.3, 0.6, 1.0))
    top_m = TOP_Z_M - rng.between(0.4, 0.44)
    w, h = int(width_m * _PX_PER_M), int(height_m * _PX_PER_M)
    stamp = artwork.canvas(4 * w, 4 * h, (0, 0, 0))
    if height_m > 0.5 * width_m and rng.chance(0.7):
        draw = artwork.pen(stamp)
        for _ in range(rng.choose((3, 6, 12))):
            x, y, r = (
                4 * w * float(rng.random()),
                4 * h * float(rng.random()),
                rng.between(0.1, 0.7),
            )
            box = (x - r * w, y - r * w, x + r * w, y + r * w)
            shade = int(rng.between(90, 255))
            (draw.ellipse if rng.chance(0.5) else draw.rectangle)(box, fill=(shade,) * 3)
        artwork.text(stamp, (0.1, 0.72, 0.9, 0.95), rng.choose(_INKS["words"]), (255,) * 3, 2)
    else:
        artwork.text(stamp, (0.0, 0.05, 1.0, 0.95), rng.choose(_INKS["words"]), (255,) * 3, 3)
    cover = np.array(stamp.resize((w, h)), np.float32)[..., 0] / 255.0
    x0, y0 = int(middle_m * _PX_PER_M - 0.5 * w), int(top_m * _PX_PER_M)
    tall, wide = albedo.shape[:2]
    artwork.record(stamp, (x0 / wide, y0 / tall, (x0 + w) / wide, (y0 + h) / tall))
    printed: Float32 = albedo.copy()
    field = printed[y0 : y0 + h, x0 : x0 + w]
    printed[y0 : y0 + h, x0 : x0 + w] = mix_colors(field, ink, cover)
    return printed


def _shaded(albedo: Float32, height_px: Float32, depth: float = 0.07) -> TextureData:
    """The texture of cloth whose valleys are darker: less of the sky is seen from there."""
    height = height_px.astype(np.float32)
    low = height - sum(np.roll(height, s, a) for s in (-9, 9) for a in (0, 1)) / 4.0
    shade = 1.0 + np.clip(depth * low, -0.3, 0.12)
    return texture((albedo * shade[..., None]).astype(np.float32), None, height)


def _pair(palette: str, seed: int) -> tuple[Float32, Float32]:
    ground, ink = (color(code) for code in in_turn(_INKS[palette], seed).split())
    return ground, ink


def _plain() -> Float32:
    return np.full((SIZE_PX, SIZE_PX, 3), _CLOTH, np.float32)


def _filled(ground: Float32) -> Float32:
    image: Float32 = np.broadcast_to(ground, (SIZE_PX, SIZE_PX, 3)).copy()
    return image


def _rgb(grey: Float32) -> Float32:
    image: Float32 = np.repeat(grey[..., None], 3, axis=2).astype(np.float32)
    return image


def _inside(position: Float32, share: float) -> Float32:
    """1 in the first share of every unit, with soft edges."""
    away = np.abs(position - np.floor(position) - 0.5 * share) - 0.5 * share
    away = np.minimum(away, 1.0 - share - away)
    field: Float32 = smoothstep(0.04, -0.04, away).astype(np.float32)
    return field


def _line(position: Float32, at: float, width_m: float) -> Float32:
    """A thin line where a coordinate has a value, in [0, 1]."""
    field: Float32 = smoothstep(width_m, 0.4 * width_m, np.abs(position - at)).astype(np.float32)
    return field


def _band(position: Float32, low: float, high: float) -> Float32:
    """1 between two values of a coordinate."""
    field: Float32 = ((position >= low) & (position < high)).astype(np.float32)
    return field
