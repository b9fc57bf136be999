"""Photographs with their horizon, the corners of their ground, and a grid on it."""

import math

import cv2
import numpy as np

from gen_data.core import asset_types, plates, se3
from gen_data.preview.overlay import Image

_HORIZON, _CORNERS, _GRID, _LANE = (255, 60, 60), (255, 220, 0), (0, 220, 255), (120, 255, 80)
_OUTLINE = (10, 25, 35)
"""Around all lines: they are seen on dark and on bright ground."""
_LINES_MAX = 60
"""Lines of the grid along each axis; larger grounds get a grid of several metres."""
_SMALL_M, _FINE_M = 4.0, 0.1
"""Longest edge of grounds with a grid finer than a metre, as on the top of a table; its step."""
_POINTS = 40
_SHIFT = 4
"""Fractional bits of drawn coordinates."""


def plate_overlay(plate: plates.Plate, rgb: asset_types.UInt8) -> Image:
    """The photograph, uint8 [h, w, 3], with its estimated or given geometry drawn on it."""
    image = rgb.copy()
    width = max(1, round(max(plate.size_px) / 500))
    lines = []
    if plate.ground_px:
        lines += [(line, _GRID) for line in _grid_lines(plate)]
        lines.append((np.array([*plate.ground_px, plate.ground_px[0]]), _CORNERS))
    lines += [(_project(plate, np.array(lane.center_m)), _LANE) for lane in plate.lanes]
    lines.append((np.array(plates.horizon_px(plate)), _HORIZON))
    for line, _ in lines:
        _draw(image, line, _OUTLINE, width + 2 * max(1, width // 3))
    for line, color in lines:
        _draw(image, line, color, width)
    return np.asarray(image, np.uint8)


def _grid_lines(plate: plates.Plate) -> list[se3.Array]:
    """Image points of lines on the ground, around its corners: 0.1 m, 1 m or more apart."""
    corners = plates.ground_points(plate, np.array(plate.ground_px))
    low, high = corners.min(axis=0), corners.max(axis=0)
    extent = float((high - low).max())
    step = _FINE_M if extent < _SMALL_M else max(1, math.ceil(extent / _LINES_MAX))
    lines = []
    for axis in (0, 1):
        first, end = math.floor(low[axis] / step), math.ceil(high[axis] / step)
        for k in range(first, end + 1):
            points = np.zeros((_POINTS, 3))
            points[:, axis] = k * step
            points[:, 1 - axis] = np.linspace(low[1 - axis], high[1 - axis], _POINTS)
            lines.append(_project(plate, points))
    return lines


def _project(plate: plates.Plate, points_m: se3.Array) -> se3.Array:
    """Image coordinates of points of the plate's world; NaN behind the camera."""
    return plate.intrinsics.project(plate.T_world_camera.inverse().apply(points_m))


def _draw(image: Image, points_px: se3.Array, color: tuple[int, int, int], width: int) -> None:
    shown = points_px[np.isfinite(points_px).all(axis=1)]
    # OpenCV puts pixel centres at integers, and takes 16 bits before the point.
    scaled = np.clip((shown - 0.5) * (1 << _SHIFT), -(1 << 24), 1 << 24).round().astype(np.int32)
    cv2.polylines(image, [scaled], False, color, width, cv2.LINE_AA, _SHIFT)
