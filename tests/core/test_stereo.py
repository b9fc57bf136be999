"""Disparities of rectified pairs, and points that only one of their cameras sees."""

import math

import numpy as np
import pytest

from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Camera
from gen_data.core.se3 import SE3
from gen_data.core.stereo import baseline_m, disparity_px, is_seen_by_both

FOCAL_PX, BASELINE_M, WIDTH_PX = 100.0, 0.2, 160
WALL_M, BOARD_M, BOARD_FROM_M, BOARD_TO_M = 4.0, 1.0, -0.163, 0.207
LENS = Intrinsics(WIDTH_PX, 8, FOCAL_PX, FOCAL_PX, 80.0, 4.0)


def pair(T_left_right: SE3, right: Intrinsics = LENS) -> tuple[Camera, Camera]:
    left = SE3.about_z(0.7, (1.0, 2.0, 3.0))
    return Camera("l", left, LENS), Camera("r", left @ T_left_right, right)


def columns_m(eye_m: float) -> np.ndarray:
    """Depth along each column of a board before a wall, seen from ``x = eye_m``."""
    slope = (np.arange(WIDTH_PX) + 0.5 - 80.0) / FOCAL_PX
    x = eye_m + slope * BOARD_M
    return np.where((x >= BOARD_FROM_M) & (x <= BOARD_TO_M), BOARD_M, WALL_M)


def image(depths_m: np.ndarray) -> np.ndarray:
    return np.tile(depths_m, (8, 1)).astype(np.float32)


def test_disparity_is_focal_length_times_baseline_over_depth() -> None:
    """100 px at 0.2 m: 10 px at 2 m, 5 px at 4 m; nothing stays nothing."""
    depths_m = np.array([[2.0, 4.0, np.inf]], np.float32)

    assert disparity_px(depths_m, FOCAL_PX * BASELINE_M).tolist() == [[10.0, 5.0, 0.0]]

    assert baseline_m(*pair(SE3((0.54, 0.0, 0.0)))) == pytest.approx(0.54, abs=1e-9)


@pytest.mark.parametrize(("right", "why"), [
    (SE3((-0.2, 0.0, 0.0)), "to the right of"),
    (SE3((0.2, 0.01, 0.0)), "below"),
    (SE3((0.2, 0.0, 0.01)), "before the other"),
    (SE3.about_z(0.01, (0.2, 0.0, 0.0)), "do not look the same way"),
])  # fmt: skip
def test_cameras_that_are_no_rectified_pair_are_refused(right: SE3, why: str) -> None:
    """To the left, lower, farther ahead, or turned."""
    with pytest.raises(ValueError, match=why):
        baseline_m(*pair(right))


def test_cameras_of_different_lenses_are_no_pair() -> None:
    """Another focal length moves points by more than their disparity."""
    other = Intrinsics(WIDTH_PX, 8, 90.0, 90.0, 80.0, 4.0)
    with pytest.raises(ValueError, match="same pinhole"):
        baseline_m(*pair(SE3((0.2, 0.0, 0.0)), other))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_what_the_other_camera_sees_agrees_with_lines_of_sight(sign: float) -> None:
    """A point of the wall is hidden if the line to the other eye meets the board.

    Brute force over all columns. The centre of the column that a point lies in decides: lines
    within half a pixel of the board's edges may go either way, and no others.
    """
    other_m = sign * BASELINE_M
    here_m = columns_m(0.0)
    x_m = (np.arange(WIDTH_PX) + 0.5 - 80.0) / FOCAL_PX * here_m
    column = FOCAL_PX * (x_m - other_m) / here_m + 80.0
    crossing_m = other_m + (x_m - other_m) * BOARD_M / here_m
    behind = here_m == WALL_M
    met = behind & (crossing_m > BOARD_FROM_M) & (crossing_m < BOARD_TO_M)
    px_m = BOARD_M / FOCAL_PX
    near_edge = np.abs(crossing_m[:, None] - [BOARD_FROM_M, BOARD_TO_M]).min(axis=1) < 0.51 * px_m
    inside = (column >= 0) & (column < WIDTH_PX)

    focal_baseline = FOCAL_PX * other_m
    here, there = (disparity_px(image(d), focal_baseline) for d in (here_m, columns_m(other_m)))
    seen = is_seen_by_both(here, there)

    certain = ~near_edge
    assert met[certain].sum() > 5
    assert (~inside)[certain].sum() > 2
    assert (seen == (inside & ~met))[:, certain].all()


def test_a_projector_may_reach_beyond_the_image_and_nothing_is_seen_by_nobody() -> None:
    """Points next to its image are seen if asked for; column 4 has one half a pixel outside."""
    flat = np.full((2, 20), 5.0, np.float32)

    assert is_seen_by_both(flat, flat)[0].tolist() == [False] * 5 + [True] * 15
    assert is_seen_by_both(flat, flat, beyond=True).all()

    nothing = np.zeros((2, 6), np.float32)

    assert not is_seen_by_both(nothing, nothing, beyond=True).any()
    assert math.isfinite(float(disparity_px(np.full((1, 1), np.inf, np.float32), 20.0)[0, 0]))
