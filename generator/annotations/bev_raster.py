"""Geometry on the ground as triangles in the world, and their rasterisation on a horizontal grid.

A cell is covered if its centre is, as for label pixels of images.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gen_data.core.interfaces import AssetLibrary
from gen_data.core.lane_geometry import border_line
from gen_data.core.scene import Body, Lane
from gen_data.core.se3 import SE3, Array
from gen_data.roads.carriageway import NOTHING

Float32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Grid:
    """A square of cells; row 0 is farthest along X, column 0 farthest along Y.

    Attributes:
        T_world_grid: Frame of the grid, its origin in the square's middle, Z up.
        cell_m: Side of a cell.
        count: Cells along each side.
    """

    T_world_grid: SE3
    cell_m: float
    count: int

    def cells(self, p_world: Array) -> Array:
        """Continuous (row, column) and height [m] of points, [..., 3]; centres are at .5."""
        p = self.T_world_grid.inverse().apply(p_world)
        middle = 0.5 * self.count
        return np.stack(
            [middle - p[..., 0] / self.cell_m, middle - p[..., 1] / self.cell_m, p[..., 2]], axis=-1
        )


def heights_m(grid: Grid, triangles_m: Array) -> Float32:
    """Height of the highest of triangles [n, 3, 3] (world) at every cell above the grid's origin.

    float32 [count, count]; -inf = none.
    """
    high = np.full((grid.count, grid.count), -np.inf, np.float32)
    corners = _near(grid, triangles_m)
    row, first, last, owner = raster_spans(corners, (grid.count, grid.count))
    counts = last - first
    rows = np.repeat(row, counts)
    offsets = np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)
    columns = np.repeat(first, counts) + offsets
    slope = plane_slopes(corners)[np.repeat(owner, counts)]
    origin = corners[np.repeat(owner, counts), 0]
    z = origin[:, 2] + slope[:, 0] * (rows + 0.5 - origin[:, 0])
    z += slope[:, 1] * (columns + 0.5 - origin[:, 1])
    np.maximum.at(high.reshape(-1), rows * grid.count + columns, z.astype(np.float32))
    return high


def covered_cells(grid: Grid, triangles_m: Array) -> NDArray[np.bool_]:
    """Whether a cell's centre is covered by a triangle of [n, 3, 3], world; [count, count]."""
    row, first, last, _ = raster_spans(_near(grid, triangles_m), (grid.count, grid.count))
    # Difference array along rows; one more column for spans that end after the last cell.
    steps = np.zeros((grid.count, grid.count + 1), np.int32)
    np.add.at(steps, (row, first), 1)
    np.add.at(steps, (row, last), -1)
    return np.asarray(np.cumsum(steps, axis=1)[:, :-1] > 0)


def _near(grid: Grid, triangles_m: Array) -> Array:
    """The triangles that may overlap the grid, as (row, column, height) [n, 3, 3]."""
    corners = grid.cells(triangles_m)
    low, high = corners[..., :2].min(axis=1), corners[..., :2].max(axis=1)
    return np.asarray(corners[((high > 0.0) & (low < grid.count)).all(axis=1)])


def raster_spans(
    corners: Array, shape: tuple[int, int]
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Spans of cells whose centres are covered by triangles, as (row, column, height) [n, 3, 3].

    Row, first column, column after the last, index of the triangle, each [m]; ``shape`` is the
    number of rows and columns.
    """
    count_rows, count = shape
    top = np.maximum(np.ceil(corners[..., 0].min(axis=1) - 0.5), 0).astype(np.intp)
    bottom = np.minimum(np.floor(corners[..., 0].max(axis=1) - 0.5), count_rows - 1).astype(np.intp)
    rows_of = np.maximum(bottom - top + 1, 0)
    owner = np.repeat(np.arange(len(corners)), rows_of)
    row = np.arange(len(owner)) - np.repeat(np.cumsum(rows_of) - rows_of, rows_of) + top[owner]
    left, right = np.full(len(row), np.inf), np.full(len(row), -np.inf)
    for k in range(3):
        a, b = corners[owner, k], corners[owner, (k + 1) % 3]
        rise = b[:, 0] - a[:, 0]
        share = np.divide(row + 0.5 - a[:, 0], rise, out=np.full(len(row), -1.0), where=rise != 0.0)
        crossing = a[:, 1] + share * (b[:, 1] - a[:, 1])
        crosses = (share >= 0.0) & (share <= 1.0)
        left = np.where(crosses, np.minimum(left, crossing), left)
        right = np.where(crosses, np.maximum(right, crossing), right)
    kept = left <= right
    row, owner, left, right = row[kept], owner[kept], left[kept], right[kept]
    first = np.clip(np.ceil(left - 0.5), 0, count).astype(np.intp)
    last = np.clip(np.floor(right - 0.5) + 1, 0, count).astype(np.intp)
    some = last > first
    return row[some], first[some], last[some], owner[some]


def plane_slopes(corners: Array) -> Array:
    """Slope of every triangle along rows and columns, per cell, [n, 2]; 0 for vertical ones."""
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    flat = np.abs(area) > 1e-12
    inverse = np.divide(1.0, area, out=np.zeros_like(area), where=flat)
    along_rows = (u[:, 2] * v[:, 1] - v[:, 2] * u[:, 1]) * inverse
    along_columns = (v[:, 2] * u[:, 0] - u[:, 2] * v[:, 0]) * inverse
    return np.stack([along_rows, along_columns], axis=1)


LOW_M = 2.0
"""Geometry higher than this above the ground, as crowns of trees, does not occupy it."""
DIRECTIONS = 48
"""Directions that sample the outline of a footprint."""


def strips(lanes: Iterable[Lane]) -> Array:
    """Triangles [n, 3, 3] of the areas of lanes."""
    parts = []
    for lane in lanes:
        left, right = (np.asarray(border_line(lane, side)) for side in ("left", "right"))
        parts.append(ribbon(left, right))
    return np.concatenate([NOTHING, *parts])


def ribbon(left: Array, right: Array) -> Array:
    """Triangles [2 (n - 1), 3, 3] between two lines of n points."""
    one = np.stack([left[:-1], right[:-1], right[1:]], axis=1)
    other = np.stack([left[:-1], right[1:], left[1:]], axis=1)
    return np.concatenate([one, other])


def footprints(bodies: Iterable[Body], assets: AssetLibrary) -> Array:
    """Triangles [n, 3, 3] of the ground occupied by bodies: convex outlines of their lowest 2 m."""
    parts = []
    for body in bodies:
        outline = body.T_world_body.apply(low_outline(body.asset, body.scale, assets))
        if len(outline) >= 3:
            first = np.broadcast_to(outline[0], outline[2:].shape)
            parts.append(np.stack([first, outline[1:-1], outline[2:]], axis=1))
    return np.concatenate([NOTHING, *parts])


@lru_cache(maxsize=4096)
def low_outline(asset: str, scale: float, assets: AssetLibrary) -> Array:
    """The convex outline [n, 3], counter-clockwise, of the lowest 2 m of an asset, at its foot."""
    vertices = assets.mesh(asset).vertices_m.astype(np.float64) * scale
    foot_m = vertices[:, 2].min()
    low = vertices[vertices[:, 2] < foot_m + LOW_M]
    angles = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    towards = np.stack([np.cos(angles), np.sin(angles)])
    # einsum keeps one order of summation, on which ties between vertices depend.
    along = np.einsum("ij,jk->ik", low[:, :2], towards, optimize=False)
    corners = along.argmax(axis=0)
    outline = low[corners[np.diff(corners, append=corners[0] - 1) != 0]]
    return np.column_stack([outline[:, :2], np.full(len(outline), foot_m)])
