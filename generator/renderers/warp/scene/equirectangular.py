"""Geometry of equirectangular images."""

from __future__ import annotations

import numpy as np

from gen_data.generator.core.se3 import Array


def texel_directions(height: int) -> tuple[Array, Array]:
    """Unit directions [h, 2h, 3] and solid angles [h, 2h] of an equirectangular image.

    Row 0 is the zenith; column 0 is -X, the centre is +X, columns grow clockwise from above.
    """
    width = 2 * height
    edges = np.cos(np.pi * np.arange(height + 1) / height)
    polar = np.pi * (np.arange(height) + 0.5) / height
    azimuth = np.pi - 2.0 * np.pi * (np.arange(width) + 0.5) / width
    x = np.sin(polar)[:, None] * np.cos(azimuth)[None]
    y = np.sin(polar)[:, None] * np.sin(azimuth)[None]
    z = np.broadcast_to(np.cos(polar)[:, None], x.shape)
    solid = np.broadcast_to((edges[:-1] - edges[1:])[:, None] * 2.0 * np.pi / width, x.shape)
    return np.stack([x, y, z], axis=-1), solid
