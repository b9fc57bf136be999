"""A photograph as statistics see it, and the local measures that several of them share."""

from __future__ import annotations

from functools import cached_property

import cv2
import numpy as np

from gen_data.generator.core.asset_types import Float32, UInt8
from gen_data.generator.core.colorimetry import luminance, srgb_decode

SPARSE = 3
"""Statistics of levels and colours read every third pixel along both axes."""
DARK, CLIPPED = 4, 250
"""Bytes up to and from which a channel states no level: black, and saturated."""
FLOOR = 1.0 / 512.0
"""Added to linear luminance before logarithms: half the first step of eight bits at middle grey."""
_LINEAR: Float32 = srgb_decode(np.arange(256) / 255.0).astype(np.float32)


class Picture:
    """An sRGB image with what statistics derive from it, computed on demand.

    Attributes:
        rgb: uint8 [h, w, 3].
    """

    def __init__(self, rgb: UInt8) -> None:
        self.rgb = rgb

    @cached_property
    def grey(self) -> Float32:
        """Luma of the encoded values, 0 to 255, float32 [h, w] (ITU-R BT.601, as in JPEG)."""
        return np.asarray(cv2.cvtColor(self.rgb.astype(np.float32), cv2.COLOR_RGB2GRAY))

    @cached_property
    def linear(self) -> Float32:
        """Sparse linear colours, 1 saturates, float32 [n, 3]."""
        return np.asarray(_LINEAR[self.rgb[::SPARSE, ::SPARSE].reshape(-1, 3)])

    @cached_property
    def log_luminance(self) -> Float32:
        """Logarithm, base 2, of sparse linear luminance, float32 [n]."""
        return np.asarray(np.log2(luminance(self.linear) + np.float32(FLOOR)))

    @cached_property
    def colors(self) -> Float32:
        """Sparse linear colours of pixels that are neither black nor clipped, float32 [m, 3]."""
        sparse = self.rgb[::SPARSE, ::SPARSE].reshape(-1, 3)
        red, green, blue = np.ascontiguousarray(sparse.T)
        top = np.maximum(np.maximum(red, green), blue)
        return np.asarray(self.linear[(top > DARK) & (top < CLIPPED)])
