"""Views of laser scans, radars and event cameras."""

from typing import Literal, get_args

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.core import asset_types, boxes, capture, se3
from gen_data.core.scene import Scene
from gen_data.exporters.label_colors import SURFACE_COLORS, UNLABELLED, id_color
from gen_data.preview.overlay import BOX_EDGES, Image
from gen_data.preview.palette import color_shares

PointColors = Literal["class", "intensity"]
"""Property that determines the colour of a point."""
PANEL_PX = 960
"""Width of a view before it is scaled to its tile."""
AHEAD_M = 50.0
"""Extent of the top view in front of and behind the scanner."""
NEAR_M, FAR_M = 2.0, 100.0
"""Limits of the colour scale of the range view."""
ROW_PX = 2
"""Height of a ring in the range view."""

FAST_M_S = 15.0
"""Radial speed at which colours saturate."""
DOT_PX = 6
GREY = 40
BRIGHTER, DARKER = (90, 170, 255), (255, 90, 70)


def point_colors(cloud: capture.PointCloud, by: PointColors = "class") -> NDArray[np.uint8]:
    """SRGB colour of each point, uint8 [n, 3].

    Args:
        cloud: Scan with the points.
        by: ``class``: colour of the category, else of the surface; ``intensity``.
    """
    points = cloud.points
    if by == "intensity":
        # Most intensities are low: the square root spreads them.
        return color_shares(np.sqrt(points["intensity"]))
    categories = points["category_id"]
    of_category = [id_color(k) for k in range(int(categories.max(initial=0)) + 1)]
    of_surface = [SURFACE_COLORS.get(name, UNLABELLED) for name in asset_types.SURFACES]
    colors: NDArray[np.uint8] = np.array(of_surface, np.uint8)[points["surface"]]
    labelled = categories > 0
    colors[labelled] = np.array(of_category, np.uint8)[categories[labelled]]
    return colors


def top_view(cloud: capture.PointCloud, scene: Scene, aspect: float) -> Image:
    """Draw a scan from above, its X axis to the right, uint8 [h, w, 3], with outlined boxes.

    Args:
        cloud: Scan to draw.
        scene: Scene of the annotated instances to outline.
        aspect: Width over height.
    """
    image = empty_view(aspect)
    shape = image.shape
    position_m = cloud.points["position_m"]
    colors = point_colors(cloud)
    column, row = pixels_from_above(position_m, image)
    inside = (column >= 0) & (column < shape[1]) & (row >= 0) & (row < shape[0])
    # Draw higher points last: they hide lower ones in a top view.
    order = np.argsort(position_m[:, 2], kind="stable")
    order = order[inside[order]]
    image[row[order], column[order]] = colors[order]
    outline_things(image, scene, cloud.lidar.T_world_lidar)
    return image


def empty_view(aspect: float) -> Image:
    """Black image for a top view, uint8 [h, w, 3]."""
    return np.zeros((max(8, round(PANEL_PX / aspect)), PANEL_PX, 3), np.uint8)


def outline_things(image: Image, scene: Scene, T_world_sensor: se3.SE3) -> None:
    """Draw the boxes of annotated instances around a sensor from above, in place."""
    T_sensor_world = T_world_sensor.inverse()
    for thing in scene.instances:
        if thing.annotated:
            _outline(image, thing.box3d.seen_from(T_sensor_world), id_color(thing.category_id))


def range_view(cloud: capture.PointCloud) -> Image:
    """Draw panoramas of range, intensity and class, one above the other.

    A row is a ring, the highest first; the middle column is straight ahead, left is left. The
    nearest of several points in a pixel wins. Near is blue, far is red.

    Returns:
        uint8 [h, w, 3]; black without a point.
    """
    position_m = cloud.points["position_m"].astype(np.float64)
    range_m = np.sqrt(np.einsum("ij,ij->i", position_m, position_m))
    turn = 0.5 - np.arctan2(position_m[:, 1], position_m[:, 0]) / (2.0 * np.pi)
    column = np.minimum((turn * PANEL_PX).astype(np.intp), PANEL_PX - 1)
    row = cloud.points["ring"].astype(np.intp)
    order = np.argsort(-range_m, kind="stable")
    share = np.log(np.maximum(range_m, 1e-6) / NEAR_M) / np.log(FAR_M / NEAR_M)
    looks = (color_shares(share), *(point_colors(cloud, by) for by in get_args(PointColors)[::-1]))
    panels = []
    for colors in looks:
        panel: Image = np.zeros((1 + int(row.max(initial=0)), PANEL_PX, 3), np.uint8)
        panel[row[order], column[order]] = colors[order]
        panels.append(np.repeat(panel, ROW_PX, axis=0))
    return np.concatenate(panels)


def pixels_from_above(
    position_m: NDArray[np.floating], image: Image
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Column and row of points; X to the right, Y up, the sensor in the middle of the image."""
    height, width = image.shape[:2]
    scale = 0.5 * width / AHEAD_M
    column = np.floor(0.5 * width + position_m[:, 0] * scale).astype(np.intp)
    row = np.floor(0.5 * height - position_m[:, 1] * scale).astype(np.intp)
    return column, row


def _outline(image: Image, box: boxes.OrientedBox, color: tuple[int, int, int]) -> None:
    column, row = pixels_from_above(box.corners(), image)
    far = max(image.shape) * 4
    if max(np.abs(column).max(), np.abs(row).max()) > far:
        return
    for a, b in BOX_EDGES:
        start, end = (int(column[a]), int(row[a])), (int(column[b]), int(row[b]))
        cv2.line(image, start, end, color, 1, cv2.LINE_AA)


def radar_view(table: capture.Measurements, scene: Scene, aspect: float) -> Image:
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


def event_view(table: capture.Measurements, scene: Scene, aspect: float) -> Image:
    """Draw all events of a reading, uint8 [h, w, 3], cropped to their extent.

    Blue is brighter, red is darker; the last event of a pixel counts.
    """
    del scene, aspect
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
