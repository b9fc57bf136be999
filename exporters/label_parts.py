"""Parts of labels that recordings and pictures show.

Borders of lanes, tracked points, voxels, points in mirrors, and the delivery of readings.
"""

from collections.abc import Iterator, Mapping
from itertools import groupby, pairwise

import numpy as np
from numpy.typing import NDArray

from gen_data.core import reported, se3
from gen_data.core.asset_types import SURFACES
from gen_data.core.capture import PointCloud, SensorReading
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import (
    TRACK_STATES,
    VOXEL_STATES,
    BorderTruth,
    Occupancy,
    SensorTracks,
)
from gen_data.core.scene import Scene
from gen_data.exporters.label_colors import SURFACE_COLORS, UNLABELLED, Rgb, UInt8, id_color

LIFT_M = 0.05
"""Height of trajectories above the path of a body's origin, and of lanes above the ground."""
TRACK_RADII, BORDER_RADII = (-1.5, -3.0), (-0.75, -1.5)
"""Radii of hidden and of visible points and lines; negative = in pixels of the screen."""
BORDER_COLORS: Mapping[str, Rgb] = {
    "lane": (0, 225, 255),
    "road": (255, 210, 0),
    "edge": (255, 70, 70),
}
"""By kind: between lanes of one direction, between directions, edges of the carriageway."""
HIDDEN = 0.5
"""Brightness of hidden parts."""
MIRROR_STEP_PX = 4
"""Distance of the pixels whose points in mirrors are shown in space."""

_Points = tuple[tuple[float, float], ...]


def border_color(kind: str, *, visible: bool = True) -> Rgb:
    """SRGB colour of a border; darker for a hidden part."""
    red, green, blue = BORDER_COLORS[kind]
    share = 1.0 if visible else HIDDEN
    return (round(share * red), round(share * green), round(share * blue))


def split_border(border: BorderTruth) -> Iterator[tuple[bool, _Points]]:
    """Visible and hidden parts of a border in an image, in order; they share their ends.

    A part is visible where all of its points are.
    """
    steps = zip(pairwise(border.visible), pairwise(border.points_px), strict=True)
    for seen, part in groupby(steps, key=lambda step: all(step[0])):
        ends = [points for _, points in part]
        yield seen, (ends[0][0], *(end for _, end in ends))


def inside_image(tracks: SensorTracks) -> NDArray[np.intp]:
    """Numbers of the tracked points that are inside an image, also hidden ones."""
    return np.flatnonzero(tracks.state < TRACK_STATES.index("outside"))


def track_colors(count: int) -> list[Rgb]:
    """Colours by which tracked points are known in all views."""
    return [id_color(k + 1) for k in range(count)]


def categories_of(scene: Scene) -> dict[int, int]:
    """Category ids by instance id."""
    return {i.instance_id: i.category_id for i in scene.instances}


def voxel_colors(grid: Occupancy, categories: Mapping[int, int]) -> NDArray[np.uint8]:
    """SRGB colour of every voxel by category, else by surface, uint8 [x, y, z, 3].

    ``categories`` are ids by instance id.
    """
    of_instance = np.zeros((max(categories, default=0) + 1, 3), np.uint8)
    for number, category_id in categories.items():
        of_instance[number] = id_color(category_id)
    of_surface = [SURFACE_COLORS.get(name, UNLABELLED) for name in SURFACES]
    colors: NDArray[np.uint8] = np.array(of_surface, np.uint8)[grid.surface]
    labelled = (grid.instance_id > 0) & (of_instance[grid.instance_id].any(axis=-1))
    colors[labelled] = of_instance[grid.instance_id[labelled]]
    return colors


def surface_voxels(
    grid: Occupancy, categories: Mapping[int, int]
) -> tuple[se3.Array, NDArray[np.uint8]]:
    """Centres in the frame [m], [n, 3], and colours, uint8 [n, 3], of voxels with a surface."""
    shown = grid.state == VOXEL_STATES.index("surface")
    return grid.centers_m(np.argwhere(shown)), voxel_colors(grid, categories)[shown]


def mirrored_points(
    position_m: NDArray[np.float32], colored: UInt8
) -> tuple[NDArray[np.float32], UInt8]:
    """Points that mirrors show, of every fourth pixel of every fourth row.

    Args:
        position_m: The channel ``mirrored_position`` [h, w, 3].
        colored: Its picture, uint8 [h, w, 3].

    Returns:
        Places in the world frame [m], [n, 3], and the colours of their pixels, uint8 [n, 3].
    """
    thinned = np.s_[MIRROR_STEP_PX // 2 :: MIRROR_STEP_PX, MIRROR_STEP_PX // 2 :: MIRROR_STEP_PX]
    places_m, colors = position_m[thinned], colored[thinned]
    seen = np.isfinite(places_m).all(axis=-1)
    return places_m[seen], colors[seen]


def delivery(
    info: DatasetInfo, name: str, reading: SensorReading | PointCloud
) -> tuple[int, float] | None:
    """How often an image or scan arrives, and how late [s].

    A sensor that may lose or double readings has numbers for all of them, 1 and 0.0 for most; else
    None unless the reading has a record of its delivery.
    """
    faults = {fault for sensor in info.sensors if sensor.name == name for fault in sensor.faults}
    if not {"lost", "doubled"} & faults and reported.DELIVERY not in reading.faults:
        return None
    copies = reported.copies(reading)
    late_s = reported.arrived_s(reading) - reading.time_s if copies else 0.0
    return copies, round(late_s, 9)
