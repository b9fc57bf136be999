"""A box of voxels in a frame."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.core.se3 import SE3, Array, Vec3


@dataclass(frozen=True, slots=True)
class VoxelBox:
    """A box of voxels.

    Attributes:
        T_world_frame: Frame along whose axes the voxels are.
        low_m: Lowest corner in the frame.
        voxel_m: Side of a voxel.
        shape: Voxels along X, Y and Z.
    """

    T_world_frame: SE3
    low_m: Vec3
    voxel_m: float
    shape: tuple[int, int, int]

    @property
    def high_m(self) -> Vec3:
        """Highest corner in the frame."""
        x, y, z = (low + n * self.voxel_m for low, n in zip(self.low_m, self.shape, strict=True))
        return x, y, z

    @property
    def corners_m(self) -> Array:
        """The eight corners in the frame, [8, 3]."""
        return np.stack([self.low_m, self.high_m])[np.indices((2, 2, 2)).reshape(3, -1).T, range(3)]

    def may_contain(self, T_frame_body: SE3, low_m: Vec3, high_m: Vec3, scale: float) -> bool:
        """Whether the bounds of a scaled body in a frame overlap the box."""
        for row, t, low, high in zip(
            T_frame_body.rotation(),
            T_frame_body.translation_m,
            self.low_m,
            self.high_m,
            strict=True,
        ):
            ends = [
                (scale * r * a, scale * r * b) for r, a, b in zip(row, low_m, high_m, strict=True)
            ]
            if t + sum(map(max, ends)) < low or t + sum(map(min, ends)) > high:
                return False
        return True

    def numbers(
        self, T_frame_points: SE3, points_m: NDArray[np.floating], scale: float = 1.0
    ) -> NDArray[np.intp]:
        """Numbers of the voxels that contain points [n, 3], in order of X, Y, Z; -1 = outside.

        The points are scaled, then in the frame at ``T_frame_points``.
        """
        rows = (scale / self.voxel_m * T_frame_points.rotation()).astype(np.float32)
        shift = np.subtract(T_frame_points.translation_m, self.low_m) / self.voxel_m
        x, y, z = (np.ascontiguousarray(column, np.float32) for column in points_m.T)
        number = np.zeros(len(points_m), np.intp)
        inside = np.ones(len(points_m), np.bool_)
        for row, start, count in zip(rows, shift.astype(np.float32), self.shape, strict=True):
            place = row[0] * x + row[1] * y + row[2] * z + start
            inside &= (place >= 0.0) & (place < count)
            number *= count
            number += place.astype(np.intp)
        number[~inside] = -1
        return number
