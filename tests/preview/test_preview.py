"""What is drawn lies where the labels say."""

from __future__ import annotations

import numpy as np
import pytest

from generator.core.boxes import OrientedBox
from generator.core.errors import ConfigError
from generator.core.intrinsics import Intrinsics
from generator.core.se3 import SE3
from generator.preview.overlay import BOX_EDGES, draw_box3d
from generator.preview.palette import color_of, colored_depth, colored_ids
from generator.preview.sheet import GAP_PX, arranged


def test_box_edges_join_corners_that_differ_in_one_axis() -> None:
    """Twelve edges of a cuboid, none twice."""
    corners = OrientedBox(SE3(), (2.0, 2.0, 2.0)).corners()
    differing = [int((corners[a] != corners[b]).sum()) for a, b in BOX_EDGES]

    assert differing == [1] * 12
    assert len({frozenset(edge) for edge in BOX_EDGES}) == 12


def test_box_is_drawn_at_its_projection() -> None:
    """The front face of a 2 m cube centred 4 m ahead spans f * 1 / 3 pixels to each side."""
    intrinsics = Intrinsics(120, 120, 60.0, 60.0, 60.0, 60.0)
    image = np.zeros((120, 120, 3), np.uint8)

    draw_box3d(image, OrientedBox(SE3((0.0, 0.0, 4.0)), (2.0, 2.0, 2.0)), intrinsics, (255, 0, 0))

    rows, columns = np.nonzero(image[..., 0] > 128)
    assert (rows.min(), rows.max()) == (40, 80)
    assert (columns.min(), columns.max()) == (40, 80)


def test_box_behind_the_camera_leaves_no_trace() -> None:
    """What is behind is not mirrored into the image."""
    intrinsics = Intrinsics(64, 64, 60.0, 60.0, 32.0, 32.0)
    image = np.zeros((64, 64, 3), np.uint8)

    draw_box3d(image, OrientedBox(SE3((0.0, 0.0, -3.0)), (1.0, 1.0, 1.0)), intrinsics, (9, 9, 9))

    assert not image.any()


def test_neighbouring_ids_look_different_and_nothing_is_black() -> None:
    """At least 60 grey levels in some channel between consecutive ids."""
    colors = np.array([color_of(i) for i in range(1, 200)], int)

    assert color_of(0) == (0, 0, 0)
    assert (np.abs(np.diff(colors, axis=0)).max(axis=1) >= 60).all()
    ids = np.array([[0, 3], [7, 3]], np.uint16)
    assert tuple(colored_ids(ids)[0, 1]) == color_of(3)


def test_depth_is_bright_when_near_and_black_when_nothing() -> None:
    """Infinite depth is black; the nearest pixel is the brightest."""
    shown = colored_depth(np.array([[1.0, 2.0], [3.0, np.inf]]))[..., 0]

    assert shown[1, 1] == 0
    assert shown[0, 0] > shown[0, 1] > shown[1, 0] > 0


def test_sheet_places_tiles_row_by_row() -> None:
    """Five tiles in columns of three: the fifth is second in the second row."""
    images = [np.full((10, 20, 3), 50 * k, np.uint8) for k in range(1, 6)]

    sheet = arranged(images, columns=3)

    assert sheet.shape == (2 * (10 + GAP_PX) + GAP_PX, 3 * (20 + GAP_PX) + GAP_PX, 3)
    assert (sheet[GAP_PX * 2 + 10 + 5, GAP_PX * 2 + 20 + 5] == 250).all()


def test_sheet_of_nothing_is_refused() -> None:
    """No tile, no picture."""
    with pytest.raises(ConfigError):
        arranged([], columns=3)
