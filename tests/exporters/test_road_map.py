"""Areas of meshes in plan."""

import numpy as np
import pytest
import shapely

from gen_data.exporters.road_map import plan_area


def test_area_in_plan_is_the_union_of_triangles_that_overlap_and_meet_anywhere() -> None:
    """Random rectangles of whole cells of 4 m2, each of two triangles: the cells that any covers.

    Their corners lie on sides and inside of others, and sides run along others in part.
    """
    rng = np.random.default_rng(3)
    for _ in range(20):
        covered = np.zeros((16, 16), np.bool_)
        triangles = []
        for _ in range(30):
            (x0, x1), (y0, y1) = (np.sort(rng.choice(17, 2, replace=False)) for _ in range(2))
            x1, y1 = min(x1, x0 + 4), min(y1, y0 + 4)
            covered[x0:x1, y0:y1] = True
            ring = ((x0, y0), (x1, y0), (x1, y1), (x0, y1))
            a, b, c, d = ((2.0 * x, 2.0 * y, 7.0) for x, y in ring)
            triangles += [(a, b, c), (c, d, a)]
        area = plan_area(np.array(triangles))
        assert area.is_valid and area.area == 4.0 * covered.sum()
        x, y = np.meshgrid(*[2.0 * np.arange(16) + 1.0] * 2, indexing="ij")
        np.testing.assert_array_equal(shapely.contains_xy(area, x, y), covered)


def test_holes_of_less_than_a_square_metre_are_filled() -> None:
    """A frame of 4 m around covers of 0.8 m, and around a hole of 1.2 m."""
    for hole_m, area_m2 in ((0.8, 16.0), (1.2, 16.0 - 1.44)):
        outer, inner = (
            0.5 * size * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) for size in (4.0, hole_m)
        )
        corners = np.concatenate([outer, inner])
        sides = ((k, (k + 1) % 4) for k in range(4))
        faces = [face for k, n in sides for face in ((k, n, 4 + n), (k, 4 + n, 4 + k))]
        triangles = np.concatenate([corners, np.zeros((8, 1))], axis=1)[np.array(faces)]
        assert plan_area(triangles).area == pytest.approx(area_m2, rel=1e-12)
