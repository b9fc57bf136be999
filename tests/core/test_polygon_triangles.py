"""Triangles of polygons cover them, whatever their shape."""

import math

import numpy as np
import pytest
import shapely

from gen_data.core.polygon_triangles import split_polygons
from gen_data.core.se3 import SE3, Array

L = ((0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3))
ARROW = ((0, 0), (4, 2), (0, 4), (1, 2))
_TEETH = [((2 * k + 1, 5), (2 * k, 5), (2 * k, 1), (2 * k - 1, 1)) for k in range(5, -1, -1)]
COMB = ((0, 0), (11, 0), *[point for tooth in _TEETH for point in tooth][:-2])


def star(points: int) -> tuple[tuple[float, float], ...]:
    turns = [math.pi * k / points for k in range(2 * points)]
    return tuple(
        ((1 + k % 2) * math.cos(a), (1 + k % 2) * math.sin(a)) for k, a in enumerate(turns)
    )


def in_space(flat: tuple[tuple[float, float], ...], first: int, *, tilted: bool = True) -> Array:
    points = np.array([(x, y, 0.0) for x, y in (*flat[first:], *flat[:first])])
    pose = SE3((1.0, 2.0, 3.0), (0.5, 0.5, -0.5, 0.5)) if tilted else SE3()
    return pose.apply(points)


def triangles_of(points: Array) -> Array:
    numbers, polygon = split_polygons(np.array([len(points)]), points, np.arange(len(points)))
    assert (polygon == 0).all()
    return points[numbers]


@pytest.mark.parametrize("flat", [L, ARROW, star(5), star(40)], ids=["L", "arrow", "star", "sun"])
@pytest.mark.parametrize("reverse", [False, True])
def test_a_concave_polygon_is_covered_once_from_any_corner(
    flat: tuple[tuple[float, float], ...], reverse: bool
) -> None:
    """Areas of Shapely; all triangles turn as the polygon does."""
    flat = flat[::-1] if reverse else flat
    area = shapely.Polygon(flat).area
    signed = area if shapely.LinearRing(flat).is_ccw else -area
    for first in range(len(flat)):
        points = in_space(flat, first)
        found = triangles_of(points)
        crosses = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])
        normal = SE3((0.0, 0.0, 0.0), (0.5, 0.5, -0.5, 0.5)).rotate((0.0, 0.0, 1.0))
        halves = 0.5 * crosses @ np.asarray(normal)
        assert halves.sum() == pytest.approx(signed)
        assert np.abs(halves).sum() == pytest.approx(area)


def test_triangles_of_a_comb_are_inside_of_it() -> None:
    whole = shapely.Polygon(COMB)
    assert whole.is_valid
    found = triangles_of(in_space(COMB, 3, tilted=False))
    parts = [shapely.Polygon(t[:, :2]) for t in found]
    assert shapely.unary_union(parts).symmetric_difference(whole).area < 1e-9
    assert sum(part.area for part in parts) == pytest.approx(whole.area)


def test_convex_polygons_are_fans_in_their_order_and_others_keep_theirs() -> None:
    """Of a triangle, a square, an L and an edge; a bow tie that crosses itself stays a fan."""
    square = ((0, 0), (1, 0), (1, 1), (0, 1))
    tie = ((0, 0), (3, 3), (3, 0), (0, 1))
    flats = (square[:3], square, L[1:] + L[:1], square[:2], tie)
    points = np.concatenate([in_space(flat, 0) for flat in flats])
    sizes = np.array([len(flat) for flat in flats])
    numbers, polygon = split_polygons(sizes, points, np.arange(len(points)))
    assert np.bincount(polygon, minlength=5).tolist() == [1, 2, 4, 0, 2]
    assert (np.diff(polygon) >= 0).all()
    assert numbers[:3].tolist() == [[0, 1, 2], [3, 4, 5], [3, 5, 6]]
    assert numbers[-2:].tolist() == [[15, 16, 17], [15, 17, 18]]


def test_degenerate_polygons_and_undefined_points_are_fans() -> None:
    line = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 0, 0]])
    broken = np.full((4, 3), np.nan)
    for points in (line, broken):
        numbers, _ = split_polygons(np.array([4]), points, np.arange(4))
        assert numbers.tolist() == [[0, 1, 2], [0, 2, 3]]
    numbers, polygon = split_polygons(
        np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0, np.int64)
    )
    assert numbers.shape == (0, 3)
    assert len(polygon) == 0


def test_polygons_share_points_and_are_many(monkeypatch: pytest.MonkeyPatch) -> None:
    """Squares and Ls in a row, of points in any order, and of any number at a time."""
    flats = [((0, 0), (1, 0), (1, 1), (0, 1)), L[3:] + L[:3], L[1:] + L[:1], star(5)] * 5
    points = np.concatenate([in_space(flat, 0) for flat in flats])
    order = np.random.default_rng(0).permutation(len(points))
    sizes = np.array([len(flat) for flat in flats])
    whole = split_polygons(sizes, points[order], np.argsort(order))
    monkeypatch.setattr("gen_data.core.polygon_triangles._AT_ONCE", 3)
    few = split_polygons(sizes, points[order], np.argsort(order))
    np.testing.assert_array_equal(whole[0], few[0])
    np.testing.assert_array_equal(whole[1], few[1])
    found = points[whole[0]]
    crosses = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])
    areas = np.bincount(whole[1], weights=0.5 * np.sqrt((crosses**2).sum(axis=1)))
    np.testing.assert_allclose(areas, [shapely.Polygon(flat).area for flat in flats])
