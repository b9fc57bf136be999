"""A box of voxels in a frame."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.core.se3 import SE3, Array, Vec3

MARGIN_VOXELS, ROUNDING = 0.05, 1e-6
"""Margin around the box within which points count as possibly inside, and its share of places, for
the rounding of 32-bit numbers."""


def turned(row: Sequence[Array] | Array, xyz: Sequence[Array] | Array) -> Array:
    """Coordinate of vectors [3, n] along a row of a rotation, [n].

    In the order in which NumPy's ``einsum`` adds, for the same bytes as with ``SE3``.
    """
    return np.asarray((row[0] * xyz[0] + row[2] * xyz[2]) + row[1] * xyz[1])


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
    def count(self) -> int:
        """Number of voxels."""
        return math.prod(self.shape)

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

    def map_from(self, T_frame_points: SE3, scale: float = 1.0) -> "VoxelMap":
        """Map of points that are scaled, then in the frame at ``T_frame_points``."""
        rows = (scale / self.voxel_m * T_frame_points.rotation()).astype(np.float32)
        shift = np.subtract(T_frame_points.translation_m, self.low_m) / self.voxel_m
        return VoxelMap(rows[..., None], shift.astype(np.float32)[:, None], self.shape)

    def numbers(self, place: NDArray[np.float32]) -> NDArray[np.intp]:
        """Numbers of the voxels at places [3, n]; ``count`` for places outside."""
        outside = (place < 0.0) | (place >= np.array(self.shape, np.float32)[:, None])
        number = self.ravel(place.astype(np.int32))
        number[outside[0] | outside[1] | outside[2]] = self.count
        return number

    def ravel(self, voxels: NDArray[np.int32]) -> NDArray[np.intp]:
        """Numbers of voxels [3, n] in order of X, Y, Z; overwrites the indices along X."""
        x, y, z = voxels
        _, ny, nz = self.shape
        x *= ny
        x += y
        x *= nz
        x += z
        return np.asarray(x, np.intp)


@dataclass(frozen=True, eq=False, slots=True)
class VoxelMap:
    """Map from coordinates of points [m] to coordinates in a box, in voxels from its lowest corner.

    Attributes:
        rows: Linear part, float32 [3, 3, 1].
        start: Place of the origin, float32 [3, 1].
        shape: Voxels of the box along X, Y and Z.
    """

    rows: NDArray[np.float32]
    start: NDArray[np.float32]
    shape: tuple[int, int, int]

    def places(
        self,
        xyz_m: NDArray[np.float32],
        out: NDArray[np.float32] | None = None,
        scratch: NDArray[np.float32] | None = None,
    ) -> NDArray[np.float32]:
        """Places of points [3, n], written to ``out`` [3, n]; ``scratch`` is overwritten too."""
        out = np.multiply(self.rows[:, 0], xyz_m[0], out=out)
        for axis in (1, 2):
            out += np.multiply(self.rows[:, axis], xyz_m[axis], out=scratch)
        out += self.start
        return out

    def may_contain(
        self, middle_m: NDArray[np.float32], half_m: NDArray[np.float32]
    ) -> NDArray[np.bool_]:
        """Whether bounds [3, k] of points may overlap the box, bool [k]."""
        rows = self.rows[..., 0]
        middle = rows @ middle_m + self.start
        size = np.abs(rows) @ (np.abs(middle_m) + half_m) + np.abs(self.start)
        reach = np.abs(rows) @ half_m + MARGIN_VOXELS + ROUNDING * size
        top = np.array(self.shape, np.float32)[:, None]
        return np.asarray(((middle + reach >= 0.0) & (middle - reach <= top)).all(axis=0))
