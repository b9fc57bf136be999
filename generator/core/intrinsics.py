"""Pinhole camera intrinsics.

Image coordinates are continuous: pixel ``i`` covers ``[i, i + 1)`` and its centre is ``i + 0.5``,
so a centred principal point is ``W / 2``. KITTI, nuScenes and OpenCV put pixel centres at integers:
their exporters subtract 0.5 from ``cx_px`` and ``cy_px``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.core.se3 import Array


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """A pinhole camera without distortion; all values in pixels."""

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float

    @classmethod
    def from_hfov(cls, width_px: int, height_px: int, hfov_rad: float) -> Intrinsics:
        """Square pixels, centred principal point, horizontal field of view ``hfov_rad``."""
        # tan() differs in its last bit between processors: keep it on a decimal grid.
        focal_px = round(0.5 * width_px / math.tan(0.5 * hfov_rad), 6)
        return cls(width_px, height_px, focal_px, focal_px, 0.5 * width_px, 0.5 * height_px)

    def matrix(self) -> Array:
        """Calibration matrix K, shape [3, 3], for image coordinates with centres at i + 0.5."""
        return np.array(
            [[self.fx_px, 0.0, self.cx_px], [0.0, self.fy_px, self.cy_px], [0.0, 0.0, 1.0]]
        )

    def project(self, p_camera_m: Array) -> Array:
        """Image coordinates [px], shape [..., 2], of points in the camera frame, shape [..., 3].

        Points with z <= 0 have no image and come back as NaN.
        """
        p = np.asarray(p_camera_m, dtype=np.float64)
        z = np.where(p[..., 2] > 0, p[..., 2], np.nan)
        u = self.fx_px * p[..., 0] / z + self.cx_px
        v = self.fy_px * p[..., 1] / z + self.cy_px
        return np.stack([u, v], axis=-1)

    def unproject(self, z_depth_m: NDArray[np.floating]) -> Array:
        """Points in the camera frame [m], shape [height, width, 3], of a z-depth image.

        Args:
            z_depth_m: Distance along the optical axis [m], shape [height, width]; inf = nothing.

        Returns:
            Points; rows of pixels that saw nothing are NaN.
        """
        z = np.where(np.isfinite(z_depth_m), z_depth_m, np.nan).astype(np.float64)
        u = np.arange(self.width_px) + 0.5
        v = np.arange(self.height_px) + 0.5
        x = (u[None, :] - self.cx_px) / self.fx_px * z
        y = (v[:, None] - self.cy_px) / self.fy_px * z
        return np.stack([x, y, z], axis=-1)
