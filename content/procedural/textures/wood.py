"""Wood: veneer and boards, floors of planks and blocks; the grain runs across the image.

Growth rings are cones about the pith. A face of a board cuts them in hyperbolas: the cathedrals of
flat-sawn boards, whose pith is under the face, and the straight lines of quarter-sawn ones, whose
pith is at its side (Hoadley, "Understanding wood", 2000). Rings of timber from temperate climates
are 1 to 5 mm wide.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.content.procedural.textures.texture_images import colors_in_turn, mix_colors, texture
from gen_data.core.asset_types import Float32, TextureData
from gen_data.core.noise import SIZE_PX, fbm, perlin, rows_and_columns, smoothstep, uniform
from gen_data.core.variant_rng import VariantRng

Numbers = NDArray[np.int64]

_VENEER_M, _FLOOR_M = 0.5, 1.6
_HERRINGBONE = frozenset({9, 14})
"""Seeds of floors laid in herringbone: oak and ash."""
_MEAN_RING = 0.2
"""Mean darkness of a ring."""


@dataclass(frozen=True, slots=True)
class _Laid:
    """Layout of boards.

    Attributes:
        number: Number of the board, int64, [n, n] or a column [n, 1].
        count: Number of boards.
        across_mm: Distance from the board's middle line, in the same shape.
        along: Position along the board, [n, n] or a row [1, n]; its integer part is ignored.
        joint_px: Distance to the nearest joint.
        length_px: Length of a board.
    """

    number: Numbers
    count: int
    across_mm: Float32
    along: Float32
    joint_px: Float32
    length_px: float = SIZE_PX


def wood_grain(rng: VariantRng) -> TextureData:
    """Veneer or a glued panel; 0.5 m per repeat across the grain, up to twice that along it."""
    light, dark = colors_in_turn("timber", rng.seed)
    staves = rng.choose((2, 3, 4, 4, 5))
    y, x = rows_and_columns()
    number = np.floor(y * staves).astype(np.int64)
    across_mm = (y * staves - number - 0.5) * np.float32(1000 * _VENEER_M / staves)
    joint_px = np.abs(y * staves - np.round(y * staves)) * np.float32(SIZE_PX / staves)
    laid = _Laid(number, staves, across_mm, x, joint_px)
    rings, fibre = _rings(laid, 1000 * _VENEER_M / SIZE_PX, rng), _fibre(rng)
    # Leaves of one veneer are alike, staves of glued panels are not.
    spread = rng.choose((0.05, 0.05, 0.3))
    tone = spread * (uniform(staves, rng).astype(np.float32) - 0.5)[number]
    figure = rng.between(0.6, 1.1) * rings + 0.22 * fibre + tone
    albedo = mix_colors(light, dark, figure + 0.16 * fbm((8, 1), 3, rng))
    return texture(albedo, 0.88 + 0.12 * fibre, -0.3 * fibre)


def wood_planks(rng: VariantRng) -> TextureData:
    """A floor of planks with staggered ends, or of blocks in herringbone; 1.6 m per repeat.

    Parquet and planks are 70 to 200 mm wide and 0.4 to 2 m long: usual sizes in shops.
    """
    light, dark = colors_in_turn("timber", rng.seed)
    laid = _herringbone(5, 2) if rng.seed in _HERRINGBONE else _staggered(rng)
    texel_mm = 1000 * _FLOOR_M / SIZE_PX
    rings = _rings(laid, texel_mm, rng)
    fibre = _cut_boards(_fibre(rng) + 0.6 * fbm((24, 2), 2, rng), laid, texel_mm, rng)
    tone = uniform(laid.count, rng).astype(np.float32)[laid.number] - 0.5
    figure = rng.between(0.7, 1.2) * rings + 0.3 * fibre + rng.between(0.1, 0.4) * tone
    albedo = mix_colors(light, dark, figure)
    albedo *= (1.0 + rng.between(0.03, 0.12) * tone)[..., None]
    # Joints are tight, or have a groove of 2 mm between bevels.
    width_mm = rng.choose((0.5, 0.7, 1.0, 2.0))
    joint = np.maximum(0.0, 1.0 - laid.joint_px) * np.float32(min(1.0, width_mm / texel_mm))
    albedo *= (1.0 - 0.75 * joint)[..., None]
    return texture(albedo, 0.85 + 0.1 * fibre + 0.1 * joint, -0.15 * fibre - joint)


def _staggered(rng: VariantRng) -> _Laid:
    """Rows of planks, each shifted by chance."""
    rows = rng.choose((8, 9, 10, 12, 14, 20))
    per_row = rng.choose((1, 1, 2, 2, 3))
    y, x = rows_and_columns()
    row = np.floor(y * rows).astype(np.int64)
    along = (x + uniform(rows, rng).astype(np.float32)[row]) * np.float32(per_row)
    place = np.floor(along)
    number = row * per_row + place.astype(np.int64) % per_row
    across_mm = (y * rows - row - 0.5) * np.float32(1000 * _FLOOR_M / rows)
    side = np.abs(y * rows - np.round(y * rows)) * np.float32(SIZE_PX / rows)
    end = np.abs(along - np.round(along)) * np.float32(SIZE_PX / per_row)
    return _Laid(
        number,
        rows * per_row,
        across_mm + np.zeros_like(x),
        along - place,
        np.minimum(side, end),
        SIZE_PX / per_row,
    )


def _herringbone(ratio: int, periods: int) -> _Laid:
    """Blocks at 45 degrees, so many times as long as wide; the pattern's periods per image.

    Squares (i, j) of a block's width, with ``k = i - j`` modulo twice the ratio: squares with ``k <
    ratio`` belong to a block along i, the others to one along j.
    """
    cells = 2 * ratio * periods
    y, x = rows_and_columns()
    i, j = 0.5 * cells * (x + y), 0.5 * cells * (x - y)
    column, row = np.floor(i).astype(np.int64), np.floor(j).astype(np.int64)
    k = (column - row) % (2 * ratio)
    level = k < ratio
    first_column = np.where(level, column - k, column)
    first_row = np.where(level, row, row + k + 1 - 2 * ratio)
    along = np.where(level, i - first_column, j - first_row)
    across = np.where(level, j - row, i - column)
    block = (first_column + first_row) % cells * cells + (first_column - first_row) % cells
    names, number = np.unique(block, return_inverse=True)
    side_px = SIZE_PX * np.sqrt(2.0) / cells
    joint = np.minimum(np.minimum(across, 1 - across), np.minimum(along, ratio - along))
    return _Laid(
        number.reshape(block.shape),
        len(names),
        ((across - 0.5) * (1000 * _FLOOR_M / SIZE_PX) * side_px).astype(np.float32),
        (along / ratio).astype(np.float32),
        (joint * side_px).astype(np.float32),
        ratio * side_px,
    )


def _cut_boards(image: Float32, laid: _Laid, texel_mm: float, rng: VariantRng) -> Float32:
    """An image of grain cut into boards, each from another place of it."""
    shift = (uniform((2, laid.count), rng) * SIZE_PX).astype(np.int64)[:, laid.number]
    row = (laid.across_mm * np.float32(1.0 / texel_mm)).astype(np.int64) + shift[0]
    column = (laid.along * np.float32(laid.length_px)).astype(np.int64) + shift[1]
    grain: Float32 = image.ravel()[row % SIZE_PX * SIZE_PX + column % SIZE_PX]
    return grain


def _rings(laid: _Laid, texel_mm: float, rng: VariantRng) -> Float32:
    """Darkness of the growth rings, in [0, 1]."""
    half_mm = float(np.abs(laid.across_mm).max())
    flat = uniform(laid.count, rng) < rng.choose((0.1, 0.5, 0.9))
    draw, side = uniform((4, laid.count), rng), uniform(laid.count, rng) < 0.5
    heart_mm = np.where(flat, 0.5 * draw[0], 1.5 + 3.0 * draw[0]) * half_mm * np.where(side, 1, -1)
    depth_mm = np.where(flat, 10.0 + 80.0 * draw[1], 40.0)
    ring_mm = 2.0 + 2.5 * draw[2]
    # Trees taper: a face cuts three to eight rings per metre.
    length_m = 0.001 * texel_mm * laid.length_px
    peaks = np.where(flat, np.ceil((3.0 + 5.0 * draw[3]) * length_m), 1.0)

    def of_each(values: NDArray[np.float64]) -> Float32:
        image: Float32 = values.astype(np.float32)[laid.number]
        return image

    x, width, cut = laid.across_mm - of_each(heart_mm), of_each(ring_mm), of_each(peaks)
    away = np.sqrt(x * x + of_each(depth_mm**2))
    wander = 1.2 * fbm((6, 3), 2, rng) + 0.12 * perlin((48, 6), rng)
    phase = away / width + cut * laid.along + wander
    ring = np.floor(phase)
    part = phase - ring
    # Late wood is a thin dark line that ends abruptly.
    late = part * part * (1 - smoothstep(0.85, 1.0, part))
    strength = (0.5 + uniform(64, rng)).astype(np.float32)
    late *= strength[np.mod(ring, cut).astype(np.int64)]
    # Rings of few texels show as their mean.
    shown = smoothstep(2.5, 6.0, width * away / (np.maximum(np.abs(x), 1.0) * texel_mm))
    rings: Float32 = _MEAN_RING + (late - _MEAN_RING) * shown
    return rings


def _fibre(rng: VariantRng) -> Float32:
    """Streaks and pores along the grain, in [0, 1]."""
    streaks = np.abs(perlin((128, 4), rng)) + 0.5 * np.abs(perlin((256, 8), rng))
    pores = smoothstep(0.5, 0.85, perlin((200, 17), rng))
    fibre: Float32 = np.clip(0.5 * streaks + 0.6 * pores, 0.0, 1.0)
    return fibre
