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
_FONT, _FONT_SIZE = cv2.FONT_HERSHEY_SIMPLEX, 0.6
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
    _write_horizon(image, plate, width)
    if plate.ground_px:
        for name, ends in axes_px(plate).items():
            _draw_arrow(image, name, ends, width)
    return np.asarray(image, np.uint8)


def axes_px(plate: plates.Plate) -> dict[str, se3.Array]:
    """Arrows on the ground from its middle, ahead and to the right of the camera: start and end.

    A table may stand turned against them; the horizon alone shows the roll of a camera.
    """
    corners = plates.ground_points(plate, np.array(plate.ground_px))
    middle = np.array([*corners.mean(axis=0), 0.0])
    ahead = plate.T_world_camera.rotation()[:, 2] * (1.0, 1.0, 0.0)
    ahead /= max(float(np.linalg.norm(ahead)), 1e-9)
    right = np.array([ahead[1], -ahead[0], 0.0])
    reach_m = 0.15 * float((corners.max(axis=0) - corners.min(axis=0)).min())
    return {
        name: _project(plate, np.stack([middle, middle + reach_m * direction]))
        for name, direction in (("ahead", ahead), ("right", right))
    }


def _draw_arrow(image: Image, name: str, ends_px: se3.Array, width: int) -> None:
    if not np.isfinite(ends_px).all():
        return
    start, end = (tuple(np.clip(p, -1e4, 1e4).round().astype(int).tolist()) for p in ends_px)
    for color, pen in ((_OUTLINE, width + 2), (_CORNERS, width)):
        cv2.arrowedLine(image, start, end, color, pen, cv2.LINE_AA, tipLength=0.2)
    _write(image, name, (end[0] + 4 * width, end[1] - 3 * width), _CORNERS, width)


def _write_horizon(image: Image, plate: plates.Plate, width: int) -> None:
    """Name the horizon, and its roll, below it on the left; not where it is outside the image."""
    (x, left), (end, right) = plates.horizon_px(plate)
    roll_deg = math.degrees(plates.tilt_and_roll(plate)[1])
    text = f"horizon, roll {roll_deg:.1f} deg"
    (length, height), _ = cv2.getTextSize(text, _FONT, _FONT_SIZE * width, width)
    lowest = max(left, left + (right - left) * length / (end - x))
    row = lowest + height + 4 * width
    if height < row < image.shape[0]:
        _write(image, text, (4 * width, round(row)), _HORIZON, width)


def _write(
    image: Image, text: str, at: tuple[int, int], color: tuple[int, int, int], width: int
) -> None:
    """Write a text with an outline; its lower left corner is at a pixel, or as near as it fits."""
    size = _FONT_SIZE * width
    (length, _), _ = cv2.getTextSize(text, _FONT, size, width)
    place = max(0, min(at[0], image.shape[1] - length)), at[1]
    for shade, pen in ((_OUTLINE, 4 * width), (color, width)):
        cv2.putText(image, text, place, _FONT, size, shade, pen, cv2.LINE_AA)


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
