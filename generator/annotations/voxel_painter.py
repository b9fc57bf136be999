"""Values of the voxels that contain points, in parts that fit into a processor's cache."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.annotations.voxel_box import VoxelBox, VoxelMap

_Slots = NDArray[np.int16] | None

BLOCK = 128
"""Points of a block, whose bounds tell whether it can reach into the box."""
BUFFER = 8192
"""Points whose voxels are found at once: some 0.3 MB, as fit into the cache of a core."""
CELLS_PER_SIDE = 8
"""Cells along the sides of the cubes in which unordered points are listed."""


@dataclass(frozen=True, eq=False, slots=True)
class PointBlocks:
    """Points in an order, in blocks with bounds; the last point fills up the last block.

    Attributes:
        xyz_m: Coordinates, float32 [3, k, b].
        slots: Number of each point's ink, int16 [k, b]; None = 0.
        middle_m: Middle of each block's bounds, float32 [3, k].
        half_m: Half of their sides, float32 [3, k].
    """

    xyz_m: NDArray[np.float32]
    slots: NDArray[np.int16] | None
    middle_m: NDArray[np.float32]
    half_m: NDArray[np.float32]

    @classmethod
    def of(
        cls, points_m: NDArray[np.floating], slots: NDArray[np.integer] | None, cell_m: float
    ) -> "PointBlocks":
        """Blocks of points [n, 3] with slots [n], which lie in cells of a lattice.

        Points of a single slot are reordered by their place, for compact blocks.
        """
        count = len(points_m)
        if count > BLOCK and (slots is None or (slots == slots[0]).all()):
            cubes = np.floor(points_m / (CELLS_PER_SIDE * cell_m)).T
            points_m = points_m[np.lexsort(cubes[::-1])]
        size = min(count, BLOCK) or 1
        filled = np.minimum(np.arange(-(-count // size) * size), count - 1)
        xyz_m = np.ascontiguousarray(points_m[filled].T, np.float32).reshape(3, -1, size)
        low, high = xyz_m.min(axis=2), xyz_m.max(axis=2)
        chosen = None if slots is None else slots[filled].astype(np.int16).reshape(-1, size)
        return cls(xyz_m, chosen, 0.5 * (low + high), 0.5 * (high - low))

    def parts(self, onto: VoxelMap) -> "Iterator[tuple[NDArray[np.float32], _Slots]]":
        """Coordinates [3, n] and slots [n] of points in blocks that may reach into the box."""
        _, blocks, size = self.xyz_m.shape
        if blocks <= 1:
            if blocks:
                yield self.xyz_m[:, 0], None if self.slots is None else self.slots[0]
            return
        near = np.flatnonzero(onto.may_contain(self.middle_m, self.half_m))
        for first in range(0, len(near), BUFFER // size):
            some = near[first : first + BUFFER // size]
            slots = None if self.slots is None else self.slots.take(some, axis=0).reshape(-1)
            yield self.xyz_m.take(some, axis=1).reshape(3, -1), slots


class VoxelPainter:
    """Writes values into the voxels that contain points; later points overwrite earlier ones.

    Attributes:
        values: Value of each voxel, uint32 [x, y, z]; complete after ``flush``.
        marks: Voxels of all points while ``marking`` is set, bool [x, y, z].
        marking: Whether points are marked; to be changed after ``flush``.
    """

    def __init__(self, box: VoxelBox) -> None:
        self._box = box
        # One more voxel takes the points outside the box.
        self._values: NDArray[np.uint32] = np.zeros(box.count + 1, np.uint32)
        self._marks: NDArray[np.bool_] = np.zeros(box.count + 1, np.bool_)
        self.values: NDArray[np.uint32] = self._values[:-1].reshape(box.shape)
        self.marks: NDArray[np.bool_] = self._marks[:-1].reshape(box.shape)
        self.marking = False
        self._place, self._product = (np.zeros((3, BUFFER), np.float32) for _ in range(2))
        self._ink = np.zeros(BUFFER, np.uint32)
        self._filled = 0

    def paint(self, points: PointBlocks, onto: VoxelMap, inks: NDArray[np.uint32]) -> None:
        """Write into the voxels of points the inks of their slots."""
        is_plain = bool((inks == inks[0]).all())
        for xyz_m, slots in points.parts(onto):
            count = xyz_m.shape[1]
            if self._filled + count > BUFFER:
                self.flush()
            here = slice(self._filled, self._filled + count)
            self._filled += count
            onto.places(xyz_m, self._place[:, here], self._product[:, here])
            self._ink[here] = inks[0] if slots is None or is_plain else inks[slots]

    def flush(self) -> None:
        """Write the values of all points so far."""
        if not self._filled:
            return
        number = self._box.numbers(self._place[:, : self._filled])
        self._values[number] = self._ink[: self._filled]
        if self.marking:
            self._marks[number] = True
        self._filled = 0
