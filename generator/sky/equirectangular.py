"""Equirectangular images of the light from all directions."""

import math

import numpy as np
from numpy.typing import NDArray

from gen_data.core import asset_types, colorimetry

Array = NDArray[np.float64]


def pixel_directions(height_px: int, rows: int | None = None) -> Array:
    """Unit vector of each pixel's centre, shape [height, 2 * height, 3], or of the first rows."""
    polar = (math.pi * (np.arange(height_px) + 0.5) / height_px)[:rows]
    turn = 2.0 * math.pi * (0.5 - (np.arange(2 * height_px) + 0.5) / (2 * height_px))
    flat = np.sin(polar)[:, None]
    directions = np.zeros((len(polar), 2 * height_px, 3))
    np.multiply(flat, np.cos(turn), out=directions[..., 0])
    np.multiply(flat, np.sin(turn), out=directions[..., 1])
    directions[..., 2] = np.cos(polar)[:, None]
    return directions


def normalize_luminance(image: Array | asset_types.Float32) -> asset_types.Float32:
    """The image scaled to mean luminance 1 by solid angle."""
    image = np.maximum(image, 0.0)
    rows = image.shape[0]
    edges = np.cos(math.pi * np.arange(rows + 1) / rows)
    weight = (edges[:-1] - edges[1:]) / 2.0
    per_row = colorimetry.luminance(image).mean(axis=1, dtype=np.float64)
    image /= float((per_row * weight).sum())
    scaled: asset_types.Float32 = image.astype(np.float32, copy=False)
    return scaled
