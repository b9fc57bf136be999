"""Veiling glare: the lens scatters a share of all light around its source."""

from __future__ import annotations

import numpy as np

from gen_data.generator.core.asset_types import Float32
from gen_data.generator.sensors.camera.pyramid import bilinear, blur, enlarge, halve

# Scales of the blurs, in halvings of the image: a narrow core and a wide skirt approximate the
# point spread of eyes and cameras, which falls with the square of the angle.
_LEVELS = (2, 4, 6)
FACTOR = 2 ** _LEVELS[0]
_ROWS_AT_ONCE = 32


def add_glare(image: Float32, share: float) -> Float32:
    """Scatter a share of an image's light; the total is preserved.

    Source of the sum of blurs: Spencer et al., "Physically-based glare effects for digital images",
    SIGGRAPH 1995.

    Args:
        image: Linear, float32 [h, w, 3].
        share: Of the light; 0.02 suits a clean lens, 0.1 a dirty one.
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
