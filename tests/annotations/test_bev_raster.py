"""Triangles seen from above, against points in polygons and planes."""

import numpy as np
import pytest

from gen_data.annotations.bev_raster import Grid, covered_cells, heights_m
from gen_data.core.se3 import SE3, Array
from gen_data.core.streams import Streams


def centres(grid: Grid) -> Array:
    """Where cells' centres are in the world [n, n, 3]."""
    along = (0.5 * grid.count - np.arange(grid.count) - 0.5) * grid.cell_m
    x, y = np.meshgrid(along, along, indexing="ij")
    return grid.T_world_grid.apply(np.stack([x, y, np.zeros_like(x)], axis=-1))


def inside(points: Array, triangle: Array) -> Array:
    """Whether points [..., 2] are left of all edges, or right of all; borders excluded."""
    sides = [
        (b[0] - a[0]) * (points[..., 1] - a[1]) - (b[1] - a[1]) * (points[..., 0] - a[0])
        for a, b in zip(triangle, np.roll(triangle, -1, axis=0), strict=True)
    ]
    signs = np.stack(sides)
    return (signs > 0).all(axis=0) | (signs < 0).all(axis=0)


@pytest.mark.parametrize("number", range(20))
def test_cells_are_covered_where_their_centres_are_in_a_triangle(number: int) -> None:
    """Random triangles, some of them partly outside; a turned and moved grid."""
    rng = Streams(3, number).rng("triangle")
    grid = Grid(SE3.about_z(0.7, (4.0, -2.0, 1.0)), 0.25, 40)
    triangles = rng.uniform(-8.0, 8.0, (5, 3, 3)) + np.array([4.0, -2.0, 0.0])
    points = centres(grid)[..., :2]
    expected = np.any([inside(points, triangle[:, :2]) for triangle in triangles], axis=0)

    np.testing.assert_array_equal(covered_cells(grid, triangles), expected)
    np.testing.assert_array_equal(np.isfinite(heights_m(grid, triangles)), expected)


def test_heights_are_those_of_the_highest_plane() -> None:
    """Two overlapping triangles of the planes z = 0.1 x + 0.2 y + 1 and z = 2, from z = 0.5."""
    grid = Grid(SE3((0.0, 0.0, 0.5)), 0.5, 20)
    tilted = np.array([[-4.0, -4.0], [4.0, -4.0], [0.0, 4.0]])
    tilted = np.column_stack([tilted, 0.1 * tilted[:, 0] + 0.2 * tilted[:, 1] + 1.0])
    level = np.array([[0.0, 0.0, 2.0], [4.1, 0.0, 2.0], [0.0, 4.1, 2.0]])
    points = centres(grid)
    x, y = points[..., 0], points[..., 1]
    plane = np.where(inside(points[..., :2], tilted[:, :2]), 0.1 * x + 0.2 * y + 1.0, -np.inf)
    roof = np.where(inside(points[..., :2], level[:, :2]), 2.0, -np.inf)

    found = heights_m(grid, np.stack([tilted, level]))

    np.testing.assert_allclose(found, np.maximum(plane, roof) - 0.5, atol=1e-6)


def test_nothing_covers_nothing() -> None:
    grid = Grid(SE3(), 1.0, 8)
    far = np.array([[[90.0, 90.0, 0.0], [99.0, 90.0, 0.0], [90.0, 99.0, 0.0]]])

    assert not covered_cells(grid, np.zeros((0, 3, 3))).any()
    assert not covered_cells(grid, far).any()
    assert np.isneginf(heights_m(grid, far)).all()
