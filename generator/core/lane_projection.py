"""Borders of lanes in the image of a camera."""

import numpy as np

from gen_data.core.lane_geometry import LaneBorder
from gen_data.core.rolling_shutter_projection import project_rolling_shutter
from gen_data.core.scene import Camera, Scene
from gen_data.core.se3 import Array

FINE_M = 0.1
"""Borders are sampled at this step."""


def project_border(scene: Scene, camera: Camera, border: LaneBorder) -> tuple[Array, Array]:
    """Points of a border, ``FINE_M`` apart or less, as a camera sees them at the scene's instant.

    Returns:
        Points in the camera frame [m], [n, 3], each at the instant of the row that shows it, and
        their image coordinates [px], [n, 2]; NaN for points outside the lens's field.
    """
    p_world = resample_line(np.asarray(border.points_m), FINE_M)
    if camera.shutter.rolls:
        return project_rolling_shutter(scene, camera, p_world)
    p_camera = camera.T_world_camera.inverse().apply(p_world)
    return p_camera, camera.intrinsics.project(p_camera)


def resample_line(line_m: Array, step_m: float) -> Array:
    """Points [n, 3] along a line at equal distances of at most a step, including both ends."""
    lengths = np.sqrt((np.diff(line_m, axis=0) ** 2).sum(axis=1))
    at_m = np.concatenate([[0.0], np.cumsum(lengths)])
    even = np.linspace(0.0, at_m[-1], int(at_m[-1] / step_m) + 2)
    return np.stack([np.interp(even, at_m, line_m[:, k]) for k in range(3)], axis=1)
