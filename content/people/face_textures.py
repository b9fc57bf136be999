"""Textures of faces and eyes.

A face is drawn on a light ground; the material's colour is the skin colour. Its features have the
positions of the template body's, in the coordinates of ``head_layout`` [m].
"""

from collections.abc import Sequence

import numpy as np

from gen_data.config.data_files import load_table
from gen_data.content.people import head_layout, person
from gen_data.content.procedural.textures.texture_images import color, mix_colors, texture
from gen_data.core.asset_types import Float32, TextureData
from gen_data.core.noise import fbm, perlin, smoothstep
from gen_data.core.variant_rng import VariantRng, variant_rng

FACES = load_table(__package__, "faces", person.FaceKind)
EYES = load_table(__package__, "eye_colors", str)
"""Colours of the iris, sRGB; a cell of the texture each."""

_ASIDE_M, _Z_M = head_layout.face_texels()
# Edges of the lids of the template body, in order: distance from the middle line, height [mm].
_UPPER_LID = ((18.5, 727.2), (19.4, 727.9), (22.9, 729.3), (24.9, 730.9), (28.6, 732.3),
              (32.6, 733.0), (36.2, 732.9), (40.0, 732.2), (43.1, 731.2),
              (46.5, 728.9))  # fmt: skip
_LOWER_LID = ((19.0, 726.7), (22.9, 726.0), (25.9, 725.0), (28.9, 724.4), (32.0, 724.2),
              (35.7, 724.3), (39.6, 725.2), (41.9, 725.9), (46.0, 728.0))  # fmt: skip
_CREASE = ((20.0, 731.5), (25.0, 735.8), (31.0, 738.3), (37.0, 738.3), (43.0, 736.0), (48.0, 732.0))
_BAG = ((22.0, 720.0), (27.0, 715.5), (34.0, 714.0), (41.0, 717.0))
_BROW = ((12.0, 751.0), (20.0, 753.0), (32.0, 755.5), (42.0, 755.8), (51.0, 752.0), (57.0, 748.0))
_BROW_HALF = ((10.0, 0.5), (14.0, 4.2), (30.0, 3.6), (45.0, 2.4), (57.0, 0.6))
_MOUTH = ((0.0, 661.8), (6.0, 661.2), (14.0, 661.8), (21.0, 661.9), (26.0, 662.2))
_LIP_TOP = ((0.0, 671.6), (4.0, 673.2), (9.0, 671.8), (16.0, 668.4), (26.0, 662.5))
_LIP_BOTTOM = ((0.0, 650.3), (7.0, 650.6), (14.0, 653.0), (20.0, 657.2), (26.0, 661.9))
_NOSTRIL_WING = ((13.0, 680.5), (16.5, 683.0), (18.0, 687.5), (17.0, 693.5))
_NASOLABIAL = ((18.5, 689.0), (24.0, 680.0), (29.0, 669.0), (31.0, 658.0))
_HAIRLINE = ((0.0, 797.0), (40.0, 795.0), (75.0, 783.0), (88.0, 765.0), (96.0, 742.0),
             (112.0, 742.0), (128.0, 700.0), (150.0, 670.0), (361.0, 652.0))  # fmt: skip

Course = Sequence[tuple[float, float]]


def face(seed: int) -> TextureData:
    """The face of a row of ``faces.yaml``, in turn."""
    kind = list(FACES.values())[seed % len(FACES)]
    rng = variant_rng("face", seed)
    pores, blotches = _noise((90, 70), 2, rng), _noise((7, 6), 4, rng)
    hairs = _noise((40, 150), 1, rng)
    height = 0.35 * pores + 0.35 * blotches
    skin = np.ones((head_layout.HEIGHT_PX, head_layout.WIDTH_PX, 3), np.float32) * 0.93
    skin *= (1.0 + 0.025 * pores)[..., None]
    skin = _redden(skin, 0.045 * blotches + _flush())
    freckles = smoothstep(0.42, 0.62, _noise((110, 95), 1, rng)) * _spot(0.035, 0.7, 0.045, 0.03)
    skin *= (1.0 - kind.freckles * 0.22 * freckles)[..., None]
    lines, depth = _age_lines(kind.age, rng)
    skin *= (1.0 - 0.3 * lines - _hollows())[..., None]
    skin = _lips(skin, kind.lips)
    hair, stubble = _beard(kind.beard, hairs)
    skin = mix_colors(skin, np.array([0.52, 0.54, 0.58], np.float32), stubble)
    skin *= (1.0 - 0.66 * hair)[..., None]
    brows = kind.brows * _brows(hairs)
    skin *= (1.0 - brows)[..., None]
    skin *= (1.0 - 0.42 * _roots(hairs))[..., None]
    skin *= (1.0 - _dark_lines(kind))[..., None]
    height = height - 1.6 * depth + 0.8 * (brows + hair) * hairs
    return texture(skin.astype(np.float32), None, height.astype(np.float32))


def eyes(seed: int) -> TextureData:
    """Eyeballs seen from ahead, a cell for each colour of the iris; ``seed`` has no effect."""
    rng = variant_rng("eyes", seed)
    cell = head_layout.WIDTH_PX // head_layout.EYE_COLUMNS
    at = ((np.arange(cell) + 0.5) / cell - 0.5) * head_layout.EYE_CELL_M
    y, z = at.astype(np.float32)[None, :], -at.astype(np.float32)[:, None]
    away, turn = np.hypot(y, z), np.arctan2(z, y)
    codes = list(EYES.values())
    image = np.zeros((head_layout.HEIGHT_PX, head_layout.WIDTH_PX, 3), np.float32)
    for k in range(head_layout.EYE_COLUMNS * head_layout.EYE_ROWS):
        fibres = perlin((16, 4), rng, cell)
        rays = 1.0 + 0.25 * fibres + 0.1 * np.sin(40 * turn)
        iris = color(codes[k % len(codes)]) * rays[..., None]
        white = np.ones((cell, cell, 3), np.float32) * color("#dcd6d0")
        white = _redden(white, 0.1 * smoothstep(0.008, 0.014, np.abs(y)) + 0 * z)
        eye = mix_colors(white, iris, smoothstep(0.0063, 0.0057, away))
        eye *= (1.0 - 0.6 * np.exp(-(((away - 0.0059) / 0.0006) ** 2)))[..., None]
        eye *= (1.0 - 0.93 * smoothstep(0.0026, 0.0021, away))[..., None]
        # The upper lid and its lashes shade the eye.
        eye *= (1.0 - 0.42 * smoothstep(0.0, 0.0045, z + 0 * y))[..., None]
        row, column = divmod(k, head_layout.EYE_COLUMNS)
        top = head_layout.HEIGHT_PX - (row + 1) * cell
        image[top : top + cell, column * cell : (column + 1) * cell] = eye
    return texture(image)


def _noise(cells: tuple[int, int], octaves: int, rng: VariantRng) -> Float32:
    """Noise for the face's field: cells across and along."""
    field: Float32 = fbm(cells, octaves, rng)[:: head_layout.WIDTH_PX // head_layout.HEIGHT_PX]
    return field


def _spot(aside_m: float, z_m: float, half_aside_m: float, half_z_m: float) -> Float32:
    """A soft spot of height 1."""
    away = ((_ASIDE_M - aside_m) / half_aside_m) ** 2 + ((_Z_M - z_m) / half_z_m) ** 2
    spot: Float32 = np.exp(-away).astype(np.float32)
    return spot


def _course(points_mm: Course) -> Float32:
    """Height [m] of a course at each distance from the middle line; NaN beyond its ends."""
    aside, z = (np.array(column) / 1000.0 for column in zip(*points_mm, strict=True))
    heights = np.interp(_ASIDE_M[:, 0], aside, z, left=np.nan, right=np.nan)
    found: Float32 = heights.astype(np.float32)[:, None]
    return found


def _stroke(points_mm: Course, half_m: float) -> Float32:
    """A soft line along a course."""
    away = np.abs(_Z_M - _course(points_mm)) / half_m
    ends = np.array([points_mm[0][0], points_mm[-1][0]]) / 1000.0
    faded = smoothstep(0.0, 0.003, _ASIDE_M - ends[0] + 0.003 * (ends[0] == 0.0))
    faded = faded * smoothstep(0.0, 0.004, ends[1] - _ASIDE_M)
    line: Float32 = np.nan_to_num(np.exp(-(away**2)) * faded).astype(np.float32)
    return line


def _redden(image: Float32, amount: Float32) -> Float32:
    """Less green and blue: blood under the skin."""
    tint = np.array([0.15, 1.0, 0.9], np.float32)
    red: Float32 = (image * (1.0 - np.clip(amount, -0.2, 0.4)[..., None] * tint)).astype(np.float32)
    return red


def _flush() -> Float32:
    """Redness of cheeks, nose, chin and ears."""
    cheeks = 0.11 * _spot(0.05, 0.69, 0.025, 0.022)
    nose = 0.12 * _spot(0.0, 0.69, 0.016, 0.012)
    chin = 0.05 * _spot(0.0, 0.635, 0.02, 0.012)
    ears = 0.12 * _spot(0.16, 0.715, 0.025, 0.035)
    flush: Float32 = cheeks + nose + chin + ears
    return flush


def _hollows() -> Float32:
    """Shade of the eye sockets, at the sides of the nose, under the lower lip and the chin."""
    sockets = 0.07 * _spot(0.024, 0.735, 0.014, 0.013) + 0.08 * _spot(0.033, 0.72, 0.02, 0.008)
    wings = 0.3 * _stroke(_NOSTRIL_WING, 0.0016)
    lip = 0.13 * _spot(0.0, 0.6465, 0.014, 0.0035)
    hollows: Float32 = sockets + wings + lip
    return hollows


def _lips(skin: Float32, strength: float) -> Float32:
    top, bottom, middle = (_course(c) for c in (_LIP_TOP, _LIP_BOTTOM, _MOUTH))
    inside = smoothstep(0.0008, -0.0008, _Z_M - top) * smoothstep(-0.0008, 0.0008, _Z_M - bottom)
    inside = np.nan_to_num(inside)
    shade = np.where(np.nan_to_num(middle) < _Z_M, 0.82, 1.0).astype(np.float32)
    tint = np.array([0.97, 0.72, 0.73], np.float32) ** (0.55 + 0.8 * strength)
    return mix_colors(skin, skin * tint * shade[..., None], 0.85 * inside)


def _brows(hairs: Float32) -> Float32:
    """Cover of the brows in [0, 1]: single hairs at their edges."""
    aside, half = (np.array(column) / 1000.0 for column in zip(*_BROW_HALF, strict=True))
    width = np.interp(_ASIDE_M, aside, half)
    away = np.nan_to_num(np.abs(_Z_M - _course(_BROW)) / width, nan=9.0)
    ragged = smoothstep(1.25, 0.45, away + 0.55 * hairs)
    brows: Float32 = (ragged * (0.72 + 0.5 * hairs)).clip(0.0, 1.0).astype(np.float32)
    return brows


def _beard(strength: float, hairs: Float32) -> tuple[Float32, Float32]:
    """Cover of beard hair, and of shadow under the skin."""
    jaw = smoothstep(0.672, 0.655, _Z_M + 0.25 * (0.1 - np.minimum(_ASIDE_M, 0.1)))
    whiskers = smoothstep(0.082, 0.092, _ASIDE_M) * smoothstep(0.74, 0.71, _Z_M)
    lip = smoothstep(0.031, 0.024, _ASIDE_M) * smoothstep(0.683, 0.678, _Z_M)
    area = np.maximum(np.maximum(jaw, whiskers), lip) * smoothstep(0.15, 0.1, _ASIDE_M)
    area = area * smoothstep(0.58, 0.625, _Z_M)
    mouth = smoothstep(-0.001, 0.001, _Z_M - np.nan_to_num(_course(_LIP_BOTTOM), nan=1.0))
    mouth = mouth * smoothstep(0.0015, 0.0, _Z_M - np.nan_to_num(_course(_LIP_TOP), nan=0.0))
    area = area * (1.0 - mouth)
    full = smoothstep(0.4, 0.6, np.float32(strength)) * smoothstep(0.15, 0.55, area + 0.25 * hairs)
    shadow = min(strength, 0.4) * area * (1.0 + 0.6 * hairs)
    return np.asarray(full * (0.75 + 0.5 * hairs), np.float32), np.asarray(shadow, np.float32)


def _roots(hairs: Float32) -> Float32:
    """Cover of hair roots in [0, 1]: the hairline has no edge."""
    inside = _Z_M - _course(_HAIRLINE)
    cover = smoothstep(-0.009, 0.006, inside + 0.006 * hairs)
    roots: Float32 = np.nan_to_num(cover).astype(np.float32)
    return roots


def _dark_lines(kind: person.FaceKind) -> Float32:
    """Darkness of lashes, lid creases, nostrils and the line between the lips."""
    upper, lower = _stroke(_UPPER_LID, 0.0012), _stroke(_LOWER_LID, 0.0007)
    lashes = kind.lashes * np.maximum(upper, 0.5 * lower)
    crease = 0.4 * _stroke(_CREASE, 0.0011)
    nostrils = 0.75 * np.minimum(1.0, 1.6 * _spot(0.0075, 0.6832, 0.0042, 0.0022))
    mouth = 0.6 * _stroke(_MOUTH, 0.001)
    return np.asarray(np.clip(lashes + crease + nostrils + mouth, 0.0, 0.93), np.float32)


def _age_lines(age: float, rng: VariantRng) -> tuple[Float32, Float32]:
    """Darkness and depth of folds: at the mouth, under the eyes, on the forehead."""
    bend = 0.002 * _noise((5, 9), 1, rng)
    folds = 1.0 * _stroke(_NASOLABIAL, 0.0022) + 0.7 * _stroke(_BAG, 0.0018)
    forehead = np.exp(-((((_Z_M + bend - 0.765) % 0.0095 - 0.00475) / 0.0013) ** 2))
    forehead = forehead * smoothstep(0.048, 0.03, _ASIDE_M) * smoothstep(0.76, 0.766, _Z_M)
    forehead = forehead * smoothstep(0.79, 0.782, _Z_M)
    fan = np.abs(np.sin(9.0 * np.arctan2(_Z_M - 0.728, _ASIDE_M - 0.046)))
    crow = smoothstep(0.3, 0.0, fan) * _spot(0.058, 0.727, 0.008, 0.011)
    lines = (0.25 + 0.75 * age) * folds + age * (0.8 * forehead + 0.9 * crow)
    return np.asarray(0.6 * lines, np.float32), np.asarray(age * lines, np.float32)
