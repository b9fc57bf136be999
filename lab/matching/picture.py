"""A photograph as statistics see it, and the local measures that several of them share."""

from functools import cached_property

import cv2
import numpy as np

from gen_data.core import asset_types, colorimetry, se3

SPARSE = 3
"""Statistics of levels and colours read every third pixel along both axes."""
DARK, CLIPPED = 4, 250
"""Bytes up to and from which a channel states no level: black, and saturated."""
FLOOR = 1.0 / 512.0
"""Added to linear luminance before logarithms: half the first step of eight bits at middle grey."""
BLOCK_PX = 4
"""Side of the blocks in which noise is measured."""
_MASK = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32) / 6.0
_LINEAR: asset_types.Float32 = colorimetry.srgb_decode(np.arange(256) / 255.0).astype(np.float32)


class Picture:
    """An sRGB image with the derived data for statistics, computed on demand.

    Attributes:
        rgb: uint8 [h, w, 3].
    """

    def __init__(self, rgb: asset_types.UInt8) -> None:
        self.rgb = rgb

    @cached_property
    def grey(self) -> asset_types.Float32:
        """Luma of the encoded values, 0 to 255, float32 [h, w] (ITU-R BT.601, as in JPEG)."""
        return np.asarray(cv2.cvtColor(self.rgb.astype(np.float32), cv2.COLOR_RGB2GRAY))

    @cached_property
    def linear(self) -> asset_types.Float32:
        """Sparse linear colours, 1 saturates, float32 [n, 3]."""
        return np.asarray(_LINEAR[self.rgb[::SPARSE, ::SPARSE].reshape(-1, 3)])

    @cached_property
    def log_luminance(self) -> asset_types.Float32:
        """Logarithm, base 2, of sparse linear luminance, float32 [n]."""
        return np.asarray(np.log2(colorimetry.luminance(self.linear) + np.float32(FLOOR)))

    @cached_property
    def colors(self) -> asset_types.Float32:
        """Sparse linear colours of pixels that are neither black nor clipped, float32 [m, 3]."""
        sparse = self.rgb[::SPARSE, ::SPARSE].reshape(-1, 3)
        red, green, blue = np.ascontiguousarray(sparse.T)
        top = np.maximum(np.maximum(red, green), blue)
        return np.asarray(self.linear[(top > DARK) & (top < CLIPPED)])

    @cached_property
    def noise_blocks(self) -> tuple[se3.Array, se3.Array, se3.Array]:
        """Mean grey value, variance of noise and squared gradient of blocks, float64 [blocks].

        Variances are measured with Immerkaer's mask, which is blind to slopes ("Fast noise variance
        estimation", Computer Vision and Image Understanding 64, 1996); gradients are taken from the
        smoothed image.
        """
        rough = cv2.filter2D(self.grey, cv2.CV_32F, _MASK)
        smooth = cv2.GaussianBlur(self.grey, (0, 0), 2.0)
        gradient = cv2.Laplacian(smooth, cv2.CV_32F)
        level, variance, slope = map(_block_means, (self.grey, rough * rough, gradient * gradient))
        return level, variance, slope


def _block_means(image: asset_types.Float32) -> se3.Array:
    """Means of the blocks of an image [h, w], float64 [blocks]."""
    rows, columns = (side // BLOCK_PX for side in image.shape)
    whole = image[: rows * BLOCK_PX, : columns * BLOCK_PX]
    blocks = cv2.resize(whole, (columns, rows), interpolation=cv2.INTER_AREA)
    return np.asarray(blocks.ravel(), np.float64)
