"""Image pyramids: halving, blurring, enlarging of float32 [h, w, 3].

Only sums and products, which all processors round alike, so that results do not depend on the
machine.
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

    Args:
        size: Number of pixels.
        factor: Pixels per coarse pixel.
        coarse: Number of coarse pixels.

    Returns:
        Index of the coarse pixel before, of the one after, and weight of the latter; [size] each.
    """
    place = np.clip((np.arange(size) + 0.5) / factor - 0.5, 0.0, coarse - 1.0)
    first = np.minimum(place.astype(np.int64), max(coarse - 2, 0))
    after = np.minimum(first + 1, coarse - 1)
    return first, after, (place - first).astype(np.float32)
