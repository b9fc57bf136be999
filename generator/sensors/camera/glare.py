"""Veiling glare: the lens scatters a share of all light around its source.

Image pyramids use only sums and products, which all processors round alike, so that results do not
depend on the machine.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.asset_types import Float32


def halve(image: Float32, times: int) -> Float32:
    """Average squares of ``2 ** times`` pixels; edges are replicated."""
    for _ in range(times):
        image = np.pad(image, ((0, image.shape[0] % 2), (0, image.shape[1] % 2), (0, 0)), "edge")
        rows = image[0::2] + image[1::2]
        image = np.float32(0.25) * (rows[:, 0::2] + rows[:, 1::2])
    return image


def blur(image: Float32) -> Float32:
    """Convolve with [1 2 1] / 4 in both directions; edges are replicated."""
    for axis in (0, 1):
        n = image.shape[axis]
        at = np.arange(n)
        before = image.take(np.maximum(at - 1, 0), axis)
        after = image.take(np.minimum(at + 1, n - 1), axis)
        image = np.float32(0.5) * image + np.float32(0.25) * (before + after)
    return image


def enlarge(image: Float32, height: int, width: int, factor: int) -> Float32:
    """Enlarge an image bilinearly, aligned by pixel centres, to [height, width, 3]."""
    for axis, size in ((0, height), (1, width)):
        first, after, part = bilinear(size, factor, image.shape[axis])
        part = part[:, None, None] if axis == 0 else part[None, :, None]
        image = image.take(first, axis) * (1 - part) + image.take(after, axis) * part
    return image


def bilinear(
    size: int, factor: int, coarse: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], Float32]:
    """Indices and weights of bilinear interpolation in a coarser image, along one axis.

    For ``size`` pixels, ``factor`` per pixel of the ``coarse`` ones: index of the coarse pixel
    before, of the one after, and weight of the latter; [size] each.
    """
    place = np.clip((np.arange(size) + 0.5) / factor - 0.5, 0.0, coarse - 1.0)
    first = np.minimum(place.astype(np.int64), max(coarse - 2, 0))
    after = np.minimum(first + 1, coarse - 1)
    return first, after, (place - first).astype(np.float32)


# Scales of the blurs, in halvings of the image: a narrow core and a wide skirt approximate the
# point spread of eyes and cameras, which falls with the square of the angle.
_LEVELS = (2, 4, 6)
FACTOR = 2 ** _LEVELS[0]
_ROWS_AT_ONCE = 32


def add_glare(image: Float32, share: float) -> Float32:
    """Scatter a share of a linear image's light, float32 [h, w, 3]; the total is preserved.

    A share of 0.02 suits a clean lens, 0.1 a dirty one. Source of the sum of blurs: Spencer et al.,
    "Physically-based glare effects for digital images", SIGGRAPH 1995.
    """
    height, width = image.shape[:2]
    coarse = scatter(image) * np.float32(share / len(_LEVELS))
    veil = _widen(coarse, width)
    first, after, part = bilinear(height, FACTOR, len(veil))
    out: Float32 = image * np.float32(1.0 - share)
    # In bands that fit into the processor's cache.
    for top in range(0, height, _ROWS_AT_ONCE):
        rows = slice(top, top + _ROWS_AT_ONCE)
        weight = part[rows, None, None]
        band = veil[first[rows]]
        band *= 1 - weight
        out[rows] += band
        band = veil[after[rows]]
        band *= weight
        out[rows] += band
    return out


def scatter(image: Float32) -> Float32:
    """Sum of blurs of an image, each of its brightness, at ``1 / FACTOR`` of its resolution."""
    blurs = []
    for level, before in zip(_LEVELS, (0, *_LEVELS), strict=False):
        image = halve(image, level - before)
        blurs.append(blur(blur(image)))
    # From coarse to fine: only the running sum is enlarged.
    total = blurs[-1]
    for k in range(len(_LEVELS) - 2, -1, -1):
        height, width = blurs[k].shape[:2]
        total = blurs[k] + enlarge(total, height, width, 2 ** (_LEVELS[k + 1] - _LEVELS[k]))
    return total


def _widen(image: Float32, width: int) -> Float32:
    """Enlarge the columns of an image by ``FACTOR`` to ``width``."""
    first, after, part = bilinear(width, FACTOR, image.shape[1])
    weight = part[None, :, None]
    return image.take(first, 1) * (1 - weight) + image.take(after, 1) * weight
