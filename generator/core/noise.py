"""Periodic noise on a square image, which repeats without a seam.

Perlin, "Improving noise", SIGGRAPH 2002; Worley, "A cellular texture basis function", SIGGRAPH
1996; both on a torus. ``cells`` are lattice cells per image as (down, across).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from gen_data.core.asset_types import Float32
from gen_data.core.streams import Rng

SIZE_PX = 512
_STRIP_PX = 64

Cells = tuple[int, int]
_Reals = TypeVar("_Reals", Float32, NDArray[np.float64])


@dataclass(frozen=True, eq=False, slots=True)
class Worley:
    """Distances to scattered points, in cells, and which point is nearest.

    Attributes:
        nearest: float32 [n, n], distance to the nearest point.
        second: float32 [n, n], distance to the second nearest.
        number: int64 [n, n], number of the nearest point.
        count: Number of points.
    """

    nearest: Float32
    second: Float32
    number: NDArray[np.int64]
    count: int

    def of_each(self, values: NDArray[np.floating[Any]]) -> Float32:
        """A value per point, shape [count, ...], as an image."""
        image: Float32 = values.astype(np.float32)[self.number]
        return image


def uniform(count: int | tuple[int, ...], rng: Rng) -> NDArray[np.float64]:
    """Uniform numbers in [0, 1)."""
    drawn: NDArray[np.float64] = rng.random(count)
    return drawn


def perlin(cells: Cells, rng: Rng, size_px: int = SIZE_PX) -> Float32:
    """Gradient noise in about [-1, 1], shape [size, size]."""
    down, across = cells
    angle = 2.0 * math.pi * uniform((down, across), rng)
    gy, gx = np.sin(angle).astype(np.float32), np.cos(angle).astype(np.float32)
    iy, fy = _lattice(down, size_px)
    ix, fx = _lattice(across, size_px)
    sy, sx = _fade(fy)[:, None], _fade(fx)[None, :]
    # Columns of the lattice first: whole rows are gathered ten times as fast.
    sides = [
        (gy.take(column, axis=1), gx.take(column, axis=1) * away_x)
        for column, away_x in ((ix, fx), ((ix + 1) % across, fx - np.float32(1.0)))
    ]
    noise = np.zeros((size_px, size_px), np.float32)
    # In strips, whose intermediate arrays stay in the processor's caches.
    for strip in (slice(k, k + _STRIP_PX) for k in range(0, size_px, _STRIP_PX)):

        def edge(dy: int, strip: slice = strip) -> Float32:
            row, away_y = (iy[strip] + dy) % down, (fy[strip] - dy)[:, None]
            left, right = (_ramp_along(*side, row, away_y) for side in sides)
            return _mix(left, right, sx)

        noise[strip] = _mix(edge(0), edge(1), sy[strip])
    noise *= np.float32(1.6)
    return noise


def quick_perlin(cells: Cells, rng: Rng, size_px: int = SIZE_PX) -> Float32:
    """``perlin`` up to rounding, in a third of the time: for images that are made in each scene."""
    down, across = cells
    angle = (2.0 * math.pi * uniform((down, across), rng)).astype(np.float32)
    gy, gx = np.sin(angle), np.cos(angle)
    iy, fy = _lattice(down, size_px)
    ix, fx = _lattice(across, size_px)
    sy, sx = _fade(fy), _fade(fx)
    # Below a row of the lattice, noise is linear: a slope and an offset for each column.
    left, right = ix, (ix + 1) % across
    slope = gy.take(left, axis=1) * (1 - sx) + gy.take(right, axis=1) * sx
    offset = gx.take(left, axis=1) * (fx * (1 - sx)) + gx.take(right, axis=1) * ((fx - 1) * sx)
    above, below = iy, (iy + 1) % down
    parts = (
        (slope, above, fy * (1 - sy)),
        (offset, above, 1 - sy),
        (slope, below, (fy - 1) * sy),
        (offset, below, sy),
    )
    noise = np.zeros((size_px, size_px), np.float32)
    for strip in (slice(k, k + _STRIP_PX) for k in range(0, size_px, _STRIP_PX)):
        for table, row, share in parts:
            part = table.take(row[strip], axis=0)
            part *= np.float32(1.6) * share[strip, None]
            noise[strip] += part
    return noise


def _ramp_along(gy: Float32, ramp_x: Float32, row: NDArray[np.int64], away_y: Float32) -> Float32:
    ramp: Float32 = gy.take(row, axis=0)
    ramp *= away_y
    ramp += ramp_x.take(row, axis=0)
    return ramp


def _mix(first: Float32, second: Float32, share: Float32) -> Float32:
    """``first * (1 - share) + second * share``; uses both up."""
    first *= 1 - share
    second *= share
    first += second
    return first


def fbm(
    cells: Cells,
    octaves: int,
    rng: Rng,
    gain: float = 0.5,
    size_px: int = SIZE_PX,
    octave: Callable[[Cells, Rng, int], Float32] = perlin,
) -> Float32:
    """Perlin octaves of doubling frequency, in about [-1, 1], made by ``octave``."""
    total = np.zeros((size_px, size_px), dtype=np.float32)
    weight, weights = 1.0, 0.0
    down, across = cells
    for _ in range(octaves):
        if max(down, across) > size_px:
            break
        total += np.float32(weight) * octave((down, across), rng, size_px)
        weights += weight
        weight, down, across = weight * gain, 2 * down, 2 * across
    noise: Float32 = total / np.float32(math.sqrt(weights))
    return noise


def worley(cells: Cells, rng: Rng, jitter: float = 1.0, size_px: int = SIZE_PX) -> Worley:
    """Cellular noise with one point per lattice cell."""
    down, across = cells
    place = 0.5 + jitter * (uniform((2, down, across), rng) - 0.5)
    py, px = place.astype(np.float32)
    iy, fy = _lattice(down, size_px)
    ix, fx = _lattice(across, size_px)
    nearest = np.full((size_px, size_px), 9.0, dtype=np.float32)
    second = nearest.copy()
    number = np.zeros((size_px, size_px), dtype=np.int64)
    # Columns first, and in strips, as above.
    columns = [(ix + dx) % across for dx in (-1, 0, 1)]
    sides = [
        (py.take(column, axis=1), px.take(column, axis=1) + (dx - fx), column)
        for dx, column in zip((-1, 0, 1), columns, strict=True)
    ]
    for strip in (slice(k, k + _STRIP_PX) for k in range(0, size_px, _STRIP_PX)):
        closest, next_one = nearest[strip], second[strip]
        for dy in (-1, 0, 1):
            row, away_y = (iy[strip] + dy) % down, (dy - fy[strip])[:, None]
            for y, away_x, column in sides:
                away = np.square(y.take(row, axis=0) + away_y)
                away += np.square(away_x.take(row, axis=0))
                point = row[:, None] * across + column[None, :]
                np.copyto(number[strip], point, where=away < closest)
                np.minimum(next_one, np.maximum(closest, away), out=next_one)
                np.minimum(closest, away, out=closest)
    return Worley(np.sqrt(nearest), np.sqrt(second), number, down * across)


def warp_image(image: Float32, dy_px: Float32, dx_px: Float32) -> Float32:
    """The image sampled (nearest pixel, wrapping) at displaced places."""
    rows, columns = image.shape[:2]
    y = (np.arange(rows)[:, None] + np.round(dy_px).astype(np.int64)) % rows
    x = (np.arange(columns)[None, :] + np.round(dx_px).astype(np.int64)) % columns
    sampled: Float32 = image[y, x]
    return sampled


def blur_image(image: Float32, passes: int = 1) -> Float32:
    """A [1 2 1] / 4 blur in both directions, wrapping, repeated."""
    for _ in range(passes):
        for axis in (0, 1):
            image = 0.5 * image + 0.25 * (np.roll(image, 1, axis) + np.roll(image, -1, axis))
    return image


def smoothstep(low: float, high: float, x: _Reals) -> _Reals:
    """0 below ``low``, 1 above ``high``, smooth between; reversed bounds reverse it."""
    t = np.clip((x - np.float32(low)) / np.float32(high - low), 0.0, 1.0)
    step: _Reals = t * t * (3 - 2 * t)
    return step


def rows_and_columns(size_px: int = SIZE_PX) -> tuple[Float32, Float32]:
    """Pixel centres in [0, 1): a column of y (down) and a row of x."""
    centres = ((np.arange(size_px) + 0.5) / size_px).astype(np.float32)
    return centres[:, None], centres[None, :]


def _lattice(cells: int, size_px: int) -> tuple[NDArray[np.int64], Float32]:
    position = (np.arange(size_px) + 0.5) * cells / size_px
    index = np.floor(position).astype(np.int64)
    return index, (position - index).astype(np.float32)


def _fade(t: Float32) -> Float32:
    faded: Float32 = t * t * t * (t * (t * 6 - 15) + 10)
    return faded
