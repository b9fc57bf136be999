"""Polygons of masks, judged by the rasteriser of pycocotools."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from pycocotools import mask as coco_mask

from gen_data.exporters.mask_polygons import join_polygons, mask_polygons
from gen_data.generator.core.sample import MaskPx

# pycocotools' decoder predates numpy 2's __array__(copy=...).
pytestmark = pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")

masks = arrays(bool, st.tuples(st.integers(1, 12), st.integers(1, 12)))


def drawn(polygons: list[NDArray[np.int64]], height: int, width: int) -> NDArray[np.bool_]:
    """Union of polygons as pycocotools draws them."""
    flat = [polygon.ravel().astype(float).tolist() for polygon in polygons]
    if not flat:
        return np.zeros((height, width), bool)
    rles = coco_mask.frPyObjects(flat, height, width)
    return coco_mask.decode(coco_mask.merge(rles)).astype(bool)


def area(polygon: NDArray[np.int64]) -> float:
    """Signed area; positive = clockwise in an image."""
    x, y = polygon.T
    return 0.5 * float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())


@settings(deadline=None)
@given(masks)
def test_polygons_cover_exactly_the_pixels(pixels: NDArray[np.bool_]) -> None:
    """With any number of parts, holes, islands in holes, and pixels that touch at corners."""
    polygons = mask_polygons(MaskPx(3, 5, pixels))

    picture = np.zeros((5 + pixels.shape[0] + 2, 3 + pixels.shape[1] + 4), bool)
    picture[5 : 5 + pixels.shape[0], 3 : 3 + pixels.shape[1]] = pixels
    np.testing.assert_array_equal(drawn(polygons, *picture.shape), picture)
    assert sum(map(area, polygons)) == pixels.sum()
    assert all(area(polygon) > 0 for polygon in polygons)


@settings(deadline=None)
@given(masks)
def test_edges_run_along_the_edges_of_pixels(pixels: NDArray[np.bool_]) -> None:
    """Every edge is horizontal or vertical and has a length."""
    for polygon in mask_polygons(MaskPx(0, 0, pixels)):
        edges = np.roll(polygon, -1, axis=0) - polygon
        assert ((edges != 0).sum(axis=1) == 1).all()


@settings(deadline=None)
@given(masks.filter(lambda pixels: bool(pixels.any())))
def test_a_joined_polygon_covers_the_same_pixels(pixels: NDArray[np.bool_]) -> None:
    """The connecting lines have no area."""
    polygons = mask_polygons(MaskPx(0, 0, pixels))

    joined = join_polygons(polygons)

    assert area(joined) == pixels.sum()


def test_a_rectangle_has_its_four_corners() -> None:
    """From the upper left corner, clockwise; COCO's box is 20 wide and 10 high."""
    (polygon,) = mask_polygons(MaskPx(10, 5, np.ones((10, 20), bool)))

    assert polygon.tolist() == [[10, 5], [30, 5], [30, 15], [10, 15]]


def test_a_hole_is_reached_along_one_line() -> None:
    """A ring of one pixel's width: eight corners, and the line from the outer to the inner."""
    pixels = np.ones((3, 3), bool)
    pixels[1, 1] = False

    (polygon,) = mask_polygons(MaskPx(0, 0, pixels))

    assert polygon.tolist() == [
        [0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [2, 2], [2, 1], [2, 0], [3, 0], [3, 3], [0, 3],
    ]  # fmt: skip


def test_nothing_has_no_polygon() -> None:
    """An empty mask has an empty list, which cannot be joined."""
    assert mask_polygons(MaskPx(0, 0, np.zeros((0, 0), bool))) == []
    with pytest.raises(ValueError, match="no polygon"):
        join_polygons([])
