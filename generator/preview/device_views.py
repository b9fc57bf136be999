"""Views of radars and event cameras."""

from __future__ import annotations

import cv2
import numpy as np

from gen_data.generator.core.capture import Measurements
from gen_data.generator.core.scene import Scene
from gen_data.generator.preview.overlay import Image
from gen_data.generator.preview.palette import color_shares
from gen_data.generator.preview.point_cloud_views import (
    empty_view,
    outline_things,
    pixels_from_above,
)

FAST_M_S = 15.0
"""Radial speed at which colours saturate."""
DOT_PX = 6
GREY = 40
BRIGHTER, DARKER = (90, 170, 255), (255, 90, 70)


def radar_view(table: Measurements, scene: Scene, aspect: float) -> Image:
    """Draw detections from above, the radar's X axis to the right, uint8 [h, w, 3], with boxes.

    Green is static, blue approaches, red recedes. The size of a dot shows its signal strength.

    Args:
        table: Rows of a radar.
        scene: Scene of the annotated instances to outline.
        aspect: Width over height.
    """
    image = empty_view(aspect)
    outline_things(image, scene, table.device.T_world_device)
    rows = table.rows
    flat_m = rows["range_m"] * np.cos(rows["elevation_rad"])
    azimuth = rows["azimuth_rad"]
    place = np.stack([flat_m * np.cos(azimuth), flat_m * np.sin(azimuth)], axis=-1)
    columns, lines = pixels_from_above(place, image)
    colors = color_shares(0.5 + 0.5 * rows["velocity_compensated_m_s"] / FAST_M_S)
    sizes = np.clip(np.rint(rows["snr_db"] / 30.0 * DOT_PX), 2, DOT_PX).astype(int)
    for x, y, color, size in zip(columns, lines, colors, sizes, strict=True):
        dot = (int(color[0]), int(color[1]), int(color[2]))
        cv2.circle(image, (int(x), int(y)), int(size), dot, cv2.FILLED, cv2.LINE_AA)
    return image


def event_view(table: Measurements) -> Image:
    """Draw all events of a reading, uint8 [h, w, 3], cropped to their extent.

    Blue is brighter, red is darker; the last event of a pixel counts.
    """
    rows = table.rows
    shape = (int(rows["y_px"].max(initial=7)) + 1, int(rows["x_px"].max(initial=7)) + 1)
    image: Image = np.full((*shape, 3), GREY, np.uint8)
    for sign, color in ((1, BRIGHTER), (-1, DARKER)):
        last = _last_polarity(rows, shape) == sign
        image[last] = color
    return image


def _last_polarity(rows: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Polarity of the last event of every pixel, int8 [h, w]; 0 = none."""
    last: np.ndarray = np.zeros(shape, np.int8)
    # Rows are in order of time, and assignment keeps the last of several values per pixel.
    last[rows["y_px"], rows["x_px"]] = rows["polarity"]
    return last
