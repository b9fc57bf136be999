"""Lens flare: ghosts by reflections between the surfaces of a lens."""

from __future__ import annotations

import math

import cv2
import numpy as np

from gen_data.generator.core.asset_types import Float32

_GHOSTS = (
    (-0.35, 0.02, (0.5, 1.0, 0.6)),
    (-0.8, 0.05, (1.0, 0.5, 0.5)),
    (0.5, 0.03, (0.5, 0.6, 1.0)),
)
"""Ghosts: position of the spot scaled about the image's centre, radius over width, tint."""


def add_flare(image: Float32, share: float, white: float) -> Float32:
    """Add ghosts of light far beyond white, on a line through the centre of the image.

    Args:
        image: Linear, float32 [h, w, 3].
        share: Share of the light beyond white that returns as ghosts.
        white: The value that saturates the sensor.
    """
    beyond = np.maximum(image - 4.0 * white, 0.0)
    if not beyond.any():
        return image
    height, width = image.shape[:2]
    out = image.copy()
    for place, radius, tint in _GHOSTS:
        shift = np.array(
            [
                [place, 0.0, (1.0 - place) * 0.5 * (width - 1)],
                [0.0, place, (1.0 - place) * 0.5 * (height - 1)],
            ]
        )
        # Shrinking averages the light of the pixels that it merges.
        ghost = cv2.warpAffine(beyond, shift, (width, height), flags=cv2.INTER_AREA)
        ghost = _gaussian(ghost, radius * width)
        out += share * place * place * ghost * np.asarray(tint, np.float32)
    return np.asarray(out, np.float32)


def _gaussian(image: Float32, sigma_px: float) -> Float32:
    """Blur an image by a wide Gaussian at reduced resolution, which suffices for smooth images."""
    halvings = max(0, int(math.log2(max(sigma_px, 1.0) / 2.0)))
    small = image
    for _ in range(halvings):
        small = cv2.resize(small, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    small = cv2.GaussianBlur(small, (0, 0), sigma_px / 2**halvings, borderType=cv2.BORDER_REPLICATE)
    size = (image.shape[1], image.shape[0])
    return np.asarray(cv2.resize(small, size, interpolation=cv2.INTER_LINEAR), np.float32)
