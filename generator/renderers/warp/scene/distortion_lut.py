"""Lookup tables of directions through the pixels of a camera with lens distortion."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from gen_data.core import asset_types, se3
from gen_data.core.intrinsics import Intrinsics

NODE_STRIDE_PX = 8
"""Spacing of the nodes between which directions outside the image are interpolated."""


@dataclass(frozen=True, eq=False, slots=True)
class DeviceOptics:
    """A lens on the device.

    Attributes:
        directions: As of records.View: unit direction and pixel angle, flat.
        nodes: Unit directions, [rows, columns, 3], on a canvas of three by three images, at every
            few pixel centres from the canvas's first; NaN where the lens shows nothing.
        nodes_on_device: The same with a fourth component: 1, or 0 where the lens shows nothing.
    """

    directions: wp.array
    nodes: asset_types.Float32
    nodes_on_device: wp.array
    nbytes: int


def upload_optics(intrinsics: Intrinsics, device: wp.Device) -> DeviceOptics:
    """Tables of a camera's lens, computed in double precision."""
    directions = pixel_table(intrinsics)
    nodes = canvas_nodes(intrinsics)
    shown = np.isfinite(nodes[..., 0])
    four = np.concatenate([np.where(shown[..., None], nodes, 0.0), shown[..., None]], axis=-1)
    return DeviceOptics(
        wp.array(directions.reshape(-1, 4), dtype=wp.vec4, device=device),
        nodes,
        wp.array(four.astype(np.float32), dtype=wp.vec4, device=device),
        directions.nbytes + 2 * nodes.nbytes,
    )


def pixel_table(intrinsics: Intrinsics) -> asset_types.Float32:
    """Unit directions and the angle of each pixel [rad], shape [h, w, 4].

    The optical axis and 0 where the lens shows nothing.
    """
    rays = intrinsics.pixel_rays()
    shown = np.isfinite(rays[..., 0])
    table = np.zeros((*shown.shape, 4), np.float32)
    table[..., :3] = np.where(shown[..., None], rays, (0.0, 0.0, 1.0))
    table[..., 3] = np.where(shown, _pixel_angles(rays, intrinsics), 0.0)
    return table


def canvas_nodes(intrinsics: Intrinsics) -> asset_types.Float32:
    """Directions at the nodes of the canvas; see DeviceOptics."""
    width, height = intrinsics.width_px, intrinsics.height_px
    u, v = (
        np.arange(-(-3 * size // NODE_STRIDE_PX) + 1) * NODE_STRIDE_PX - size + 0.5
        for size in (width, height)
    )
    return np.asarray(intrinsics.rays(np.stack(np.meshgrid(u, v), axis=-1)).astype(np.float32))


def _pixel_angles(rays: se3.Array, intrinsics: Intrinsics) -> se3.Array:
    """Side of the square with each pixel's solid angle [rad]."""
    across, down = (_slopes(rays, axis) for axis in (1, 0))
    area = np.cross(across, down)
    angles = np.sqrt(np.sqrt((area * area).sum(axis=-1)))
    usual = 1.0 / intrinsics.fx_px
    # Pixels of an equirectangular image shrink to nothing at the poles, but their contents do not.
    return np.asarray(np.maximum(np.nan_to_num(angles, nan=usual), 0.05 * usual))


def _slopes(rays: se3.Array, axis: int) -> se3.Array:
    """Change per pixel along an axis; NaN next to pixels that are not shown."""
    if rays.shape[axis] == 1:
        return np.full_like(rays, np.nan)
    return np.asarray(np.gradient(rays, axis=axis))
