"""The scale of a depth image: a bar of its greys with metres."""

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.preview.overlay import Image
from gen_data.preview.palette import color_depth, depth_ends

HEIGHT_PX, FONT_SIZE = 13, 0.38
"""Of the bar, and of OpenCV's letters in it, times the unit."""
_FONT = cv2.FONT_HERSHEY_SIMPLEX


def scale_labels(z_depth_m: NDArray[np.floating]) -> tuple[str, str]:
    """Least and greatest depth of the greys, such as ``0.8 m`` and ``12 m``; empty for nothing."""
    if not np.isfinite(z_depth_m).any():
        return "", ""
    near, far = (f"{end:.{1 if end < 9.95 else 0}f} m" for end in depth_ends(z_depth_m))
    return near, far


def draw_depth_scale(image: Image, z_depth_m: NDArray[np.floating], unit: float) -> None:
    """Draw the scale at the lower edge, in place: near on the left, far on the right.

    Args:
        image: The image of ``color_depth``, uint8 [h, w, 3]; one lower than two scales has none.
        z_depth_m: Its depth [h, w], infinite for nothing.
        unit: Factor on height and letters.
    """
    height = round(HEIGHT_PX * unit)
    near, far = scale_labels(z_depth_m)
    if image.shape[0] < 2 * height or not near:
        return
    bar = image[-height:]
    bar[:] = color_depth(np.linspace(*depth_ends(z_depth_m), bar.shape[1])[None])
    size, pen = FONT_SIZE * unit, max(1, round(unit))
    (width, _), _ = cv2.getTextSize(far, _FONT, size, pen)
    base = image.shape[0] - round(3 * unit)
    for text, x, grey in ((near, 3, 0), (far, image.shape[1] - width - 3, 255)):
        cv2.putText(image, text, (x, base), _FONT, size, (grey,) * 3, pen, cv2.LINE_AA)
