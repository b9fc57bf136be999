"""Camera intrinsics: a lens, its focal lengths and principal point, and the size of the image.

Image coordinates are continuous: pixel ``i`` covers ``[i, i + 1)`` and its centre is ``i + 0.5``,
so a centred principal point is ``W / 2``. KITTI, nuScenes and OpenCV put pixel centres at integers:
their exporters subtract 0.5 from ``cx_px`` and ``cy_px``.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.core.bounded_cache import ByteCache
from gen_data.core.lens import PINHOLE, Lens
from gen_data.core.se3 import Array

_ROWS_AT_ONCE = 64


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """A camera's inner geometry; values in pixels.

    A point of the lens's plane (see ``gen_data.core.lens``) is in the image at
    ``(fx_px * x + cx_px, fy_px * y + cy_px)``.
    """

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    lens: Lens = PINHOLE

    @classmethod
    def from_hfov(
        cls, width_px: int, height_px: int, hfov_rad: float, lens: Lens = PINHOLE
    ) -> "Intrinsics":
        """Square pixels, centred principal point, horizontal field of view ``hfov_rad``.

        Raises:
            ValueError: the lens's field is narrower.
        """
        # tan() differs in its last bit between processors: keep it on a decimal grid.
        focal_px = round(0.5 * width_px / lens.radius(0.5 * hfov_rad), 6)
        return cls(width_px, height_px, focal_px, focal_px, 0.5 * width_px, 0.5 * height_px, lens)

    @property
    def straight(self) -> bool:
        """Whether it is a pinhole: straight edges have straight images."""
        return self.lens.model == "pinhole"

    def matrix(self) -> Array:
        """Calibration matrix K, shape [3, 3], for image coordinates with centres at i + 0.5.

        With another lens than a pinhole it maps points of the lens's plane, not directions.
        """
        return np.array(
            [[self.fx_px, 0.0, self.cx_px], [0.0, self.fy_px, self.cy_px], [0.0, 0.0, 1.0]]
        )

    def project(self, p_camera_m: Array) -> Array:
        """Image coordinates [px], shape [..., 2], of points in the camera frame, shape [..., 3].

        NaN for points without an image: for a pinhole, points with z <= 0; for any other lens,
        points outside the field of view.
        """
        p = np.asarray(p_camera_m, dtype=np.float64)
        if not self.straight:
            return self.lens.project(p) * (self.fx_px, self.fy_px) + (self.cx_px, self.cy_px)
        z = np.where(p[..., 2] > 0, p[..., 2], np.nan)
        u = self.fx_px * p[..., 0] / z + self.cx_px
        v = self.fy_px * p[..., 1] / z + self.cy_px
        return np.stack([u, v], axis=-1)

    def rays(self, points_px: Array) -> Array:
        """Unit directions in the camera frame, shape [..., 3], of image points, shape [..., 2].

        The inverse of ``project`` to less than 1e-6 px; NaN for points outside the lens's field.
        """
        points = np.asarray(points_px, dtype=np.float64) - (self.cx_px, self.cy_px)
        return self.lens.unproject(points / (self.fx_px, self.fy_px))

    def pixel_rays(self) -> Array:
        """Unit directions through all pixel centres, shape [height, width, 3]; NaN for none.

        The array is cached and read-only.
        """
        return _pixel_rays(self)

    def unproject(self, z_depth_m: NDArray[np.floating]) -> Array:
        """Points of a z-depth image in the camera frame [m], [height, width, 3]; NaN without depth.

        ``z_depth_m`` is the distance along the optical axis, [height, width]; inf = nothing.
        """
        z = np.where(np.isfinite(z_depth_m), z_depth_m, np.nan).astype(np.float64)
        if not self.straight:
            rays = self.pixel_rays()
            ahead = np.where(rays[..., 2] > 0, rays[..., 2], np.nan)
            return rays * (z / ahead)[..., None]
        u = np.arange(self.width_px) + 0.5
        v = np.arange(self.height_px) + 0.5
        x = (u[None, :] - self.cx_px) / self.fx_px * z
        y = (v[:, None] - self.cy_px) / self.fy_px * z
        return np.stack([x, y, z], axis=-1)

    def folds_over(self) -> bool:
        """Whether the lens's polynomial folds over inside the image, which makes it invalid.

        Black corners outside a field that ends before the fold are valid.
        """
        if not self.lens.coefficients:
            return False
        u, v = np.arange(self.width_px + 1.0), np.arange(self.height_px + 1.0)
        rows = [np.stack(np.broadcast_arrays(u, end), -1) for end in (0.0, v[-1])]
        columns = [np.stack(np.broadcast_arrays(end, v), -1) for end in (0.0, u[-1])]
        dark = np.isnan(self.rays(np.concatenate(rows + columns))).any()
        return bool(dark) and self.lens.folds


_RAY_FIELDS: ByteCache[Array] = ByteCache(32 << 20)
"""Rays of cameras that do not change; cameras whose lens is drawn displace one another."""


def _pixel_rays(intrinsics: Intrinsics) -> Array:
    return _RAY_FIELDS.get(repr(intrinsics), lambda: _compute_pixel_rays(intrinsics))


def _compute_pixel_rays(intrinsics: Intrinsics) -> Array:
    rays = np.zeros((intrinsics.height_px, intrinsics.width_px, 3))
    u = np.arange(intrinsics.width_px) + 0.5
    for first in range(0, intrinsics.height_px, _ROWS_AT_ONCE):
        v = np.arange(first, min(first + _ROWS_AT_ONCE, intrinsics.height_px)) + 0.5
        rays[first : first + len(v)] = intrinsics.rays(np.stack(np.meshgrid(u, v), axis=-1))
    rays.flags.writeable = False
    return rays
