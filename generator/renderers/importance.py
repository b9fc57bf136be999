"""Where the light of an environment comes from, as tables to draw directions from."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from generator.core.geometry import Float32
from generator.core.se3 import Array

_HEIGHT_MAX = 512
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def sky_shares(image: Float32) -> tuple[Float32, Float32]:
    """Cumulated light of an equirectangular image, looked up bilinearly.

    Args:
        image: Radiance, [h, 2h, 3].

    Returns:
        Shares of the light above the upper edge of each row, [rows + 1], and in each row of its
        light left of each column's edge, [rows, columns + 1]. Images of more than 512 rows have
        theirs taken together. Wherever there is light, there is a share.
    """
    luminance = np.einsum("hwc,c->hw", image.astype(np.float64), _LUMINANCE, optimize=False)
    light = _mean_of_texels(np.maximum(luminance, 0.0))
    if len(light) > _HEIGHT_MAX:
        size = (2 * _HEIGHT_MAX, _HEIGHT_MAX)
        light = np.asarray(cv2.resize(light, size, interpolation=cv2.INTER_AREA), np.float64)
    edges = np.cos(np.pi * np.arange(len(light) + 1) / len(light))
    light = light * (edges[:-1] - edges[1:])[:, None]
    if not light.any():
        light = np.ones_like(light)
    return _cumulated(light.sum(axis=1)), _cumulated(light)


def _mean_of_texels(values: Array) -> Array:
    """Means of the bilinear interpolation over each texel; columns go around."""
    beside = np.roll(values, 1, axis=1) + np.roll(values, -1, axis=1)
    values = 0.75 * values + 0.125 * beside
    padded = np.pad(values, ((1, 1), (0, 0)), "edge")
    mean: Array = 0.75 * values + 0.125 * (padded[:-2] + padded[2:])
    return mean


def _cumulated(light: Array) -> NDArray[np.float32]:
    """Shares before each edge along the last axis; even where there is no light."""
    total = light.sum(axis=-1, keepdims=True)
    share = np.where(total > 0.0, light / np.maximum(total, 1e-300), 1.0 / light.shape[-1])
    sums = np.cumsum(share, axis=-1)
    first = np.zeros((*light.shape[:-1], 1))
    return np.concatenate([first, np.minimum(sums / sums[..., -1:], 1.0)], axis=-1).astype(
        np.float32
    )
