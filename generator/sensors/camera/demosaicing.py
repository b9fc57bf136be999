"""Demosaicing along edges: three colours at every pixel behind a Bayer pattern.

Green is interpolated along the direction in which the image changes least, with a correction by the
second derivative of the pixel's own colour (Hamilton and Adams, "Adaptive color plan interpolation
in single sensor color electronic camera", US patent 5,629,734, 1997). Differences of red and blue
from green are interpolated bilinearly and pass a median filter, which removes the false colours of
lines thinner than a pixel (Freeman, "Median filter for reconstructing missing color samples", US
patent 4,724,395, 1988).
"""

import cv2
import numpy as np

from gen_data.core.asset_types import Float32
from gen_data.sensors.camera.image_sensor import FILTERS, Pattern

_MEDIAN_PX = 5
"""Width of the median filter: false colours of a line repeat at every second pixel."""
_REACH_PX = 2
_ROWS_AT_ONCE = 16
_BETWEEN = np.array(((0.25, 0.5, 0.25), (0.5, 1.0, 0.5), (0.25, 0.5, 0.25)), np.float32)
"""Bilinear interpolation of values that stand at every second row and column."""


def demosaic_along_edges(raw: Float32, pattern: Pattern) -> Float32:
    """Linear RGB, float32 [h, w, 3] from 0, of the values behind a Bayer pattern, [h, w]."""
    filters = enumerate(FILTERS[pattern])
    red_blue = [(color, np.s_[k // 2 :: 2, k % 2 :: 2]) for k, color in filters if color != 1]
    green = raw.copy()
    padded = cv2.copyMakeBorder(raw, *(_REACH_PX,) * 4, cv2.BORDER_REFLECT_101)
    for _, sites in red_blue:
        _fill_green(green[sites], padded[sites[0].start :, sites[1].start :])
    channels = [green, green, green]
    for color, sites in red_blue:
        sparse = np.zeros_like(raw)
        np.subtract(raw[sites], green[sites], out=sparse[sites])
        dense = cv2.filter2D(sparse, -1, _BETWEEN, borderType=cv2.BORDER_REFLECT_101)
        channels[color] = green + cv2.medianBlur(dense, _MEDIAN_PX)
    image = cv2.merge(channels)
    return np.asarray(np.maximum(image, 0.0, out=image), np.float32)


def _fill_green(sites: Float32, padded: Float32) -> None:
    """Interpolate green at every second row and column, the ``sites``, in place.

    ``padded`` begins two rows and columns before the first site.
    """
    height, width = sites.shape
    # In bands that fit into the processor's cache.
    for top in range(0, height, _ROWS_AT_ONCE):
        n = min(_ROWS_AT_ONCE, height - top)
        around = padded[2 * top : 2 * (top + n + _REACH_PX)]
        # Neighbours of the same colour, and of green left, right, above and below.
        own, beside, above = (
            np.ascontiguousarray(around[y::2, x::2]) for y, x in ((0, 0), (2, 1), (1, 2))
        )
        rows, columns, after = np.s_[1 : n + 1], np.s_[1 : width + 1], np.s_[2 : width + 2]
        here = own[rows, columns]
        change_x, along_x = _interpolate(
            own[rows, :width], beside[:n, :width], here, beside[:n, columns], own[rows, after]
        )
        change_y, along_y = _interpolate(
            own[:n, columns], above[:n, :width], here, above[rows, :width], own[2 : n + 2, columns]
        )
        # 1 along rows, 0 along columns, a half where both change alike.
        share = np.float32(0.5) * (1.0 + np.sign(change_y - change_x))
        sites[top : top + n] = np.maximum(along_y + share * (along_x - along_y), 0.0)


def _interpolate(
    own_before: Float32, before: Float32, here: Float32, after: Float32, own_after: Float32
) -> tuple[Float32, Float32]:
    """Change along a line of five pixels, and green in its middle; [h, w] each."""
    bend = 2.0 * here - own_before - own_after
    change = np.abs(before - after) + np.abs(bend)
    return change, 0.5 * (before + after) + 0.25 * bend
