"""Borders of lanes in the image of a camera."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from gen_data.core.bounded_cache import ObjectCache
from gen_data.core.lane_geometry import LaneBorder
from gen_data.core.rolling_shutter_projection import project_rolling_shutter
from gen_data.core.scene import Camera, Scene
from gen_data.core.se3 import Array

FINE_M = 0.1
"""Borders are sampled at this step."""
READOUT_M = 5.0
"""No camera moves farther than this between the middle and the ends of a rolling shutter."""
_FINE: ObjectCache[Array] = ObjectCache(256)
"""Sampled points of the latest borders, world, [n, 3]: all images of a world share them."""


def project_borders(
    scene: Scene, camera: Camera, borders: Iterable[LaneBorder], far_m: float
) -> tuple[NDArray[np.intp], Array, Array]:
    """Points of borders in an image, ``FINE_M`` apart or less, up to a distance from the camera.

    Returns:
        A number per point, ascending, [n]: ``k * 2**32 + i`` for point ``i`` of border ``k``; the
        points in the camera frame [m], [n, 3], each at the instant of the row that shows it; their
        image coordinates [px], [n, 2].
    """
    lens, pose = camera.intrinsics, camera.T_world_camera
    eye, ahead = pose.translation_m, pose.rotation()[:, 2].tolist()
    has_back = camera.shutter.rolls or not lens.straight
    reach_m = far_m + READOUT_M
    places, numbers = [np.zeros((0, 3))], [np.zeros(0, np.intp)]
    for k, border in enumerate(borders):
        points = _fine_points(border)
        x, y, z = (points[:, axis] - eye[axis] for axis in range(3))
        near = x * x + y * y < reach_m**2
        if not has_back:
            near &= x * ahead[0] + y * ahead[1] + z * ahead[2] > 0.0
        rows = np.flatnonzero(near)
        places.append(points[rows])
        numbers.append(rows + (k << 32))
    p_camera, uv = _project(scene, camera, np.concatenate(places))
    u, v = uv.T
    # NaN, outside the lens's field, compares as False.
    inside = (u >= 0.0) & (v >= 0.0) & (u < lens.width_px) & (v < lens.height_px)
    inside &= (p_camera * p_camera).sum(axis=1) < far_m**2
    return np.concatenate(numbers)[inside], p_camera[inside], uv[inside]


def resample_line(line_m: Array, step_m: float) -> Array:
    """Points [n, 3] along a line at equal distances of at most a step, including both ends."""
    lengths = np.sqrt((np.diff(line_m, axis=0) ** 2).sum(axis=1))
    at_m = np.concatenate([[0.0], np.cumsum(lengths)])
    even = np.linspace(0.0, at_m[-1], int(at_m[-1] / step_m) + 2)
    return np.stack([np.interp(even, at_m, line_m[:, k]) for k in range(3)], axis=1)


def _fine_points(border: LaneBorder) -> Array:
    return _FINE.get(border, lambda: resample_line(np.asarray(border.points_m), FINE_M))


def _project(scene: Scene, camera: Camera, p_world: Array) -> tuple[Array, Array]:
    if camera.shutter.rolls:
        return project_rolling_shutter(scene, camera, p_world)
    p_camera = camera.T_world_camera.inverse().apply(p_world)
    return p_camera, camera.intrinsics.project(p_camera)
