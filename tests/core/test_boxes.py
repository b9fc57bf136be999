"""Boxes of pixels and boxes in space."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from gen_data.core.boxes import BoxPx, OrientedBox, tight_box
from gen_data.core.se3 import SE3


def test_a_single_pixel_has_a_box_of_one_by_one_and_no_pixel_none() -> None:
    """Half-open, so width is a plain difference."""
    mask = np.zeros((7, 9), bool)
    mask[5, 3] = True

    box = tight_box(mask)

    assert box == BoxPx(3, 5, 4, 6)
    assert (box.width_px, box.height_px) == (1, 1)

    assert tight_box(np.zeros((4, 4), bool)) is None
    assert tight_box(np.zeros((0, 0), bool)) is None


@settings(max_examples=150, deadline=None, derandomize=True)
@given(
    arrays(bool, st.tuples(st.integers(1, 8), st.integers(1, 8))), st.integers(-5, 5),
    st.integers(-5, 5),
)  # fmt: skip
def test_the_tight_box_holds_all_pixels_and_no_border(mask: np.ndarray, x0: int, y0: int) -> None:
    """Checked pixel by pixel, with the mask placed anywhere in the image."""
    box = tight_box(mask, x0, y0)
    pixels = [(x0 + x, y0 + y) for y, x in np.argwhere(mask)]

    if box is None:
        assert not pixels
        return
    assert (box.x_min, box.x_max) == (min(x for x, _ in pixels), max(x for x, _ in pixels) + 1)
    assert (box.y_min, box.y_max) == (min(y for _, y in pixels), max(y for _, y in pixels) + 1)


edges = st.integers(-20, 40)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(edges, edges, st.integers(1, 30), st.integers(1, 30))
def test_clipping_keeps_exactly_the_pixels_inside_the_image(x: int, y: int, w: int, h: int) -> None:
    """By counting pixels in a 16 x 12 image."""
    box = BoxPx(x, y, x + w, y + h)
    inside = {
        (i, j) for i in range(x, x + w) for j in range(y, y + h) if 0 <= i < 16 and 0 <= j < 12
    }

    clipped = box.clipped(16, 12)

    if clipped is None:
        assert not inside
        return
    assert clipped.width_px * clipped.height_px == len(inside)
    assert (clipped.x_min, clipped.y_min) == min(inside)
    assert (clipped.x_max - 1, clipped.y_max - 1) == max(inside)


def test_corners_of_a_box_in_space() -> None:
    """X varies slowest, Z fastest; edge lengths are full."""
    box = OrientedBox(SE3((10, 20, 30)), (2.0, 4.0, 6.0))

    np.testing.assert_allclose(
        box.corners(),
        [
            [9, 18, 27], [9, 18, 33], [9, 22, 27], [9, 22, 33],
            [11, 18, 27], [11, 18, 33], [11, 22, 27], [11, 22, 33],
        ],
    )  # fmt: skip


def test_a_box_seen_from_elsewhere_is_the_same_box() -> None:
    """Corners move with the frame, the size stays."""
    box = OrientedBox(SE3.about_z(0.7, (1, 2, 3)), (2.0, 4.0, 6.0))
    T_camera_world = SE3((0.5, -1, 2), (0.5, 0.5, -0.5, 0.5))

    seen = box.seen_from(T_camera_world)

    assert seen.size_m == box.size_m
    np.testing.assert_allclose(seen.corners(), T_camera_world.apply(box.corners()), atol=1e-12)
