"""Demosaicing along edges: three colours at every pixel behind a Bayer pattern.

Green is interpolated along the direction in which the image changes least, with a correction by the
second derivative of the pixel's own colour (Hamilton and Adams, "Adaptive color plan interpolation
in single sensor color electronic camera", US patent 5,629,734, 1997). Differences of red and blue
from green are interpolated bilinearly and pass a median filter, which removes the false colours of
lines thinner than a pixel (Freeman, "Median filter for reconstructing missing color samples", US
patent 4,724,395, 1988).
"""

from __future__ import annotations

import cv2
import numpy as np

from gen_data.generator.core.asset_types import Float32
from gen_data.generator.sensors.camera.image_sensor import FILTERS, Pattern

_MEDIAN_PX = 5
"""Width of the median filter: false colours of a line repeat at every second pixel."""
_REACH_PX = 2
_BETWEEN = np.array(((0.25, 0.5, 0.25), (0.5, 1.0, 0.5), (0.25, 0.5, 0.25)), np.float32)
"""Bilinear interpolation of values that stand at every second row and column."""


def demosaic_along_edges(raw: Float32, pattern: Pattern) -> Float32:
    """Linear RGB, float32 [h, w, 3] from 0, of the values behind a Bayer pattern, [h, w]."""
    filters = enumerate(FILTERS[pattern])
    red_blue = [(color, divmod(k, 2)) for k, color in filters if color != 1]
    green = raw.copy()
    padded = cv2.copyMakeBorder(raw, *(_REACH_PX,) * 4, cv2.BORDER_REFLECT_101)
    for _, site in red_blue:
        _fill_green(green, padded, site)
    difference = raw - green
    image = np.repeat(green[..., None], 3, axis=2)
    for color, (y, x) in red_blue:
        sparse = np.zeros_like(raw)
        sparse[y::2, x::2] = difference[y::2, x::2]
        dense = cv2.filter2D(sparse, -1, _BETWEEN, borderType=cv2.BORDER_REFLECT_101)
        image[..., color] += cv2.medianBlur(dense, _MEDIAN_PX)
    return np.asarray(np.maximum(image, 0.0, out=image), np.float32)


def _fill_green(green: Float32, padded: Float32, site: tuple[int, int]) -> None:
    """Interpolate green at every second row and column from ``site`` on, in place."""
    here = green[site[0] :: 2, site[1] :: 2]
    height, width = here.shape

    def at(down: int, right: int) -> Float32:
        """Values so many pixels away."""
        y, x = _REACH_PX + site[0] + down, _REACH_PX + site[1] + right
        return padded[y::2, x::2][:height, :width]

    left, right, above, below = at(0, -1), at(0, 1), at(-1, 0), at(1, 0)
    bend_x = 2.0 * here - at(0, -2) - at(0, 2)
    bend_y = 2.0 * here - at(-2, 0) - at(2, 0)
    change_x = np.abs(left - right) + np.abs(bend_x)
    change_y = np.abs(above - below) + np.abs(bend_y)
    along_x = 0.5 * (left + right) + 0.25 * bend_x
    along_y = 0.5 * (above + below) + 0.25 * bend_y
    # 1 along rows, 0 along columns, a half where both change alike.
    share = np.float32(0.5) * (1.0 + np.sign(change_y - change_x))
    here[...] = np.maximum(along_y + share * (along_x - along_y), 0.0)
