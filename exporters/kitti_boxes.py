"""Boxes that rotate about a camera's y axis only, and the laser points in them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gen_data.core.boxes import OrientedBox
from gen_data.core.se3 import Array, Vec3

BORDER_M = 0.029
"""Tolerance of the tests for points in boxes: 3 cm, less rounding."""
_ENDS = np.array([(i, j, k) for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (0.0, -1.0)])
"""Corners in units of length, width and height."""


@dataclass(frozen=True, slots=True)
class UprightBox:
    """A box whose height is along the camera's y axis, as in KITTI labels.

    Attributes:
        size_hwl_m: Extent along y, along the box's z, along the box's x.
        bottom_m: Centre of the face with the largest y, camera frame.
        heading_rad: Rotation about +y of the box's x axis; 0 = along the camera's x.
    """

    size_hwl_m: Vec3
    bottom_m: Vec3
    heading_rad: float

    def corners(self) -> Array:
        """The eight corners in the camera frame [m], shape [8, 3]."""
        height, width, length = self.size_hwl_m
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        along, across = _ENDS[:, 0] * length, _ENDS[:, 1] * width
        ends = np.stack([along * c + across * s, _ENDS[:, 2] * height, across * c - along * s], -1)
        return np.asarray(self.bottom_m) + ends

    def depths_m(self, points_m: Array) -> Array:
        """Distance of points [n, 3], camera frame, to the nearest face [m]; negative outside."""
        height, width, length = self.size_hwl_m
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        x, y, z = (points_m - self.bottom_m).T
        along, across = c * x - s * z, s * x + c * z
        sides = (0.5 * length - np.abs(along), 0.5 * width - np.abs(across))
        depths: Array = np.minimum.reduce([*sides, -y, height + y])
        return depths


@lru_cache(1024)
def upright_box(box: OrientedBox) -> UprightBox:
    """Compute the smallest upright box, with the heading of the object's x axis, around a box.

    If that axis is vertical, the heading is the y axis's minus a quarter turn.
    """
    corners = box.corners()
    rotation = box.T_frame_box.rotation()
    x, z = float(rotation[0, 0]), float(rotation[2, 0])
    if x * x + z * z < 1e-12:
        x, z = float(rotation[2, 1]), -float(rotation[0, 1])
    norm = math.sqrt(x * x + z * z)
    x, z = x / norm, z / norm
    along = corners[:, 0] * x + corners[:, 2] * z
    across = corners[:, 2] * x - corners[:, 0] * z
    middle_along = 0.5 * float(along.min() + along.max())
    middle_across = 0.5 * float(across.min() + across.max())
    return UprightBox(
        size_hwl_m=(float(np.ptp(corners[:, 1])), float(np.ptp(across)), float(np.ptp(along))),
        bottom_m=(
            middle_along * x - middle_across * z,
            float(corners[:, 1].max()),
            middle_along * z + middle_across * x,
        ),
        heading_rad=math.atan2(-z, x),
    )


def members_in_box(
    ids: NDArray[np.int64], p_camera: Array, boxes: Mapping[int, UprightBox]
) -> NDArray[np.int64]:
    """Assign each point to the instance of the box that contains it; 0 = none.

    An instance loses its points more than ``BORDER_M`` outside its box, and gains points at least
    as deep inside that belong to no other box. Instances without a box keep their points.

    Args:
        ids: Instance that reflected each point [n].
        p_camera: Points in the camera frame [n, 3].
        boxes: Boxes by instance.
    """
    members: NDArray[np.int64] = ids.copy()
    for instance_id, box in boxes.items():
        (mine,) = np.nonzero(ids == instance_id)
        members[mine[box.depths_m(p_camera[mine]) < -BORDER_M]] = 0
    boxed = np.zeros(1 + max([0, *boxes, int(ids.max(initial=0))]), np.bool_)
    boxed[list(boxes)] = True
    free = np.flatnonzero(~boxed[members])
    # Test coordinate by coordinate: the first one rejects most points.
    x, y, z = (p_camera[:, k].take(free) for k in range(3))
    for instance_id, box in boxes.items():
        reach_m, (x0, y0, z0) = math.hypot(*box.size_hwl_m), box.bottom_m
        near = np.flatnonzero(np.abs(x - x0) < reach_m)
        near = near[(np.abs(y[near] - y0) < reach_m) & (np.abs(z[near] - z0) < reach_m)]
        at = free[near]
        members[at[box.depths_m(p_camera[at]) > BORDER_M]] = instance_id
    return members
