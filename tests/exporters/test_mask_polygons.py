"""Polygons of masks, judged by the rasteriser of pycocotools."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from pycocotools import mask as coco_mask

from gen_data.core.sample import MaskPx
from gen_data.exporters.mask_polygons import drawable_polygons, join_polygons, mask_polygons

masks = arrays(bool, st.tuples(st.integers(1, 12), st.integers(1, 12)))


def drawn(polygons: list[NDArray[np.int64]], height: int, width: int) -> NDArray[np.bool_]:
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
    """With any number of parts, holes, islands in holes, and pixels that touch at corners.

    Every edge runs along edges of pixels; lines that join polygons have no area; drawable ones lie
    inside the edges, also at borders of the image.
    """
    polygons = mask_polygons(MaskPx(3, 5, pixels))
    picture = np.zeros((5 + pixels.shape[0] + 2, 3 + pixels.shape[1] + 4), bool)
    picture[5 : 5 + pixels.shape[0], 3 : 3 + pixels.shape[1]] = pixels
    np.testing.assert_array_equal(drawn(polygons, *picture.shape), picture)
    assert sum(map(area, polygons)) == pixels.sum()
    assert all(area(polygon) > 0 for polygon in polygons)
    for polygon in polygons:
        edges = np.roll(polygon, -1, axis=0) - polygon
        assert ((edges != 0).sum(axis=1) == 1).all()
    assert not polygons or area(join_polygons(polygons)) == pixels.sum()
    inside = drawable_polygons(MaskPx(0, 0, pixels))
    np.testing.assert_array_equal(drawn(inside, *pixels.shape), pixels)


def drawn_by_opencv(polygons: list[NDArray[np.float64]], h: int, w: int) -> NDArray[np.bool_]:
    """Union as Ultralytics, supervision and CVAT draw polygons: vertices cut to whole numbers."""
    picture = np.zeros((h, w), np.uint8)
    for polygon in polygons:
        cv2.fillPoly(picture, [polygon.astype(np.int32)], 1)
    return picture.astype(bool)


def drawn_by_pillow(polygons: list[NDArray[np.float64]], h: int, w: int) -> NDArray[np.bool_]:
    picture = Image.new("1", (w, h))
    for polygon in polygons:
        ImageDraw.Draw(picture).polygon(polygon.astype(int).ravel().tolist(), fill=1)
    return np.array(picture, bool)


@pytest.mark.parametrize("draw", [drawn_by_opencv, drawn_by_pillow])
@settings(deadline=None)
@given(widths=st.lists(st.tuples(st.integers(0, 9), st.integers(2, 9)), min_size=2, max_size=12))
def test_other_rasterisers_draw_exactly_the_mask(
    draw: Callable[..., NDArray[np.bool_]], widths: list[tuple[int, int]]
) -> None:
    """Which include the last pixel of an edge; along the edges of pixels they draw one too many."""
    pixels = np.zeros((2 * len(widths), 20), bool)
    for row, (first, width) in enumerate(widths):
        pixels[2 * row : 2 * row + 2, first : first + width] = True
    (solid, *_) = cv2.connectedComponents(pixels.astype(np.uint8), connectivity=4)
    polygons = drawable_polygons(MaskPx(0, 0, pixels))
    assert len(polygons) == solid - 1
    np.testing.assert_array_equal(draw(polygons, *pixels.shape), pixels)


def test_vertices_of_drawable_polygons_lie_inside_edges_also_when_joined() -> None:
    """By 0.02 px: pycocotools, OpenCV and PIL draw 100 pixels; edge to edge, the last two 121."""
    pixels = MaskPx(0, 0, np.ones((10, 10), bool))
    (polygon,), (exact,) = drawable_polygons(pixels), mask_polygons(pixels)
    assert polygon.tolist() == [[0.02, 0.02], [9.98, 0.02], [9.98, 9.98], [0.02, 9.98]]
    for draw in (drawn, drawn_by_opencv, drawn_by_pillow):
        assert draw([polygon], 12, 12).sum() == 100
    assert [d([exact], 12, 12).sum() for d in (drawn_by_opencv, drawn_by_pillow)] == [121, 121]
    # Parts and holes; OpenCV also draws the pixels of the lines that join parts.
    pixels = np.ones((9, 9), bool)
    pixels[3:6, 3:6] = pixels[:, 7] = False
    joined = join_polygons(drawable_polygons(MaskPx(0, 0, pixels)))
    np.testing.assert_array_equal(drawn([joined], 9, 9), pixels)
    # Four vertices are 4 px from the part's first one; a search tree finds another of them.
    far = [[x, 20] for x in range(-20, 21, 2)]
    near = [[0, 4], [-4, 0], [0, -4], [4, 0]]
    part = np.array([[0, 0], [1, 0], [1, 1]])
    joined = join_polygons([np.array(far + near), part])
    assert joined.tolist() == [*far, [0, 4], [1, 1], [0, 0], [1, 0], [1, 1], [0, 4], *near[1:]]


def test_a_rectangle_has_four_corners_a_hole_one_line_to_it_and_nothing_no_polygon() -> None:
    """From the upper left corner, clockwise; COCO's box is 20 wide and 10 high."""
    (polygon,) = mask_polygons(MaskPx(10, 5, np.ones((10, 20), bool)))
    assert polygon.tolist() == [[10, 5], [30, 5], [30, 15], [10, 15]]
    # A ring of one pixel's width: eight corners, and the line from the outer to the inner.
    pixels = np.ones((3, 3), bool)
    pixels[1, 1] = False
    (polygon,) = mask_polygons(MaskPx(0, 0, pixels))
    assert polygon.tolist() == [
        [0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [2, 2], [2, 1], [2, 0], [3, 0], [3, 3], [0, 3],
    ]  # fmt: skip
    assert mask_polygons(MaskPx(0, 0, np.zeros((0, 0), bool))) == []
    with pytest.raises(ValueError, match="no polygon"):
        join_polygons([])
