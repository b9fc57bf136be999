"""Tables for importance sampling of environments."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.asset_types import Float32
from gen_data.generator.core.colorimetry import luminance
from gen_data.generator.core.se3 import Array

_HEIGHT_MAX = 512


def sky_shares(image: Float32, *, whole: bool) -> tuple[float, Float32, Float32]:
    """Cumulative distribution of light over an equirectangular image, for bilinear lookup.

    Args:
        image: Radiance, [h, 2h, 3].
        whole: Whether to sample all light, or only the excess over the mean: BSDF sampling finds
            the rest as well. Source: Karlik et al., "MIS compensation", SIGGRAPH Asia 2019, section
            5.

    Returns:
        Share of the light that is sampled; its cumulative distribution over rows, [rows + 1]; and
        over the columns of each row, [rows, columns + 1]. Images of more than 512 rows are reduced
        to that. If ``whole``, the density is positive wherever there is light.
    """
    light = _mean_of_texels(np.maximum(luminance(image.astype(np.float64)), 0.0))
    if len(light) > _HEIGHT_MAX:
        size = (2 * _HEIGHT_MAX, _HEIGHT_MAX)
        light = np.asarray(cv2.resize(light, size, interpolation=cv2.INTER_AREA), np.float64)
    edges = np.cos(np.pi * np.arange(len(light) + 1) / len(light))
    areas = (edges[:-1] - edges[1:])[:, None]
    taken = light * areas
    if not whole:
        mean = float(taken.sum()) / (float(areas.sum()) * light.shape[1])
        taken = np.maximum(light - mean, 0.0) * areas
    part = float(taken.sum()) / max(float((light * areas).sum()), 1e-300)
    # An even sky leaves rounding errors only.
    part = part if part > 1e-6 else 0.0
    return part, _cumulate(taken.sum(axis=1)), _cumulate(taken)


def _mean_of_texels(values: Array) -> Array:
    """Means of the bilinear interpolation over each texel; columns wrap around."""
    beside = np.roll(values, 1, axis=1) + np.roll(values, -1, axis=1)
    values = 0.75 * values + 0.125 * beside
    padded = np.pad(values, ((1, 1), (0, 0)), "edge")
    mean: Array = 0.75 * values + 0.125 * (padded[:-2] + padded[2:])
    return mean


def _cumulate(light: Array) -> NDArray[np.float32]:
    """Cumulative shares at each edge along the last axis; uniform where there is no light."""
    total = light.sum(axis=-1, keepdims=True)
    share = np.where(total > 0.0, light / np.maximum(total, 1e-300), 1.0 / light.shape[-1])
    sums = np.cumsum(share, axis=-1)
    first = np.zeros((*light.shape[:-1], 1))
    return np.concatenate([first, np.minimum(sums / sums[..., -1:], 1.0)], axis=-1).astype(
        np.float32
    )
