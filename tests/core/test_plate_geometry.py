"""Geometry of plates: horizons, ground and images of other sizes, against projections by hand."""

import math

import numpy as np
import pytest

from gen_data.core import plates
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.se3 import SE3, look_at

SIZE_PX, FOCAL_PX, HEIGHT_M = (1200, 800), 900.0, 1.7
CORNERS_PX = ((200.0, 790.0), (1000.0, 790.0), (700.0, 480.0), (500.0, 480.0))


def plate_seen_by(pose: SE3) -> plates.Plate:
    return plates.Plate(SIZE_PX, FOCAL_PX, pose, CORNERS_PX)


def tilted(pitch_deg: float, roll_deg: float) -> SE3:
    """A camera above the origin that looks along X, upwards by a pitch."""
    eye_m = (0.0, 0.0, HEIGHT_M)
    target_m = (1.0, 0.0, HEIGHT_M + math.tan(math.radians(pitch_deg)))
    return look_at(eye_m, target_m, math.radians(roll_deg))


@pytest.mark.parametrize(("pitch_deg", "roll_deg"), [(0.0, 0.0), (-8.0, 2.0), (4.0, -3.5)])
def test_two_points_of_the_horizon_give_the_pose(pitch_deg: float, roll_deg: float) -> None:
    """Points at infinity on the ground are on the horizon; from two of them comes the pose."""
    pose = tilted(pitch_deg, roll_deg)
    plate = plate_seen_by(pose)
    far_m = np.array([[1e9, -2e8, 0.0], [1e9, 3e8, 0.0]])
    seen_px = plate.intrinsics.project(pose.inverse().apply(far_m))
    (x0, y0), (x1, y1) = plates.horizon_px(plate)
    rows = y0 + (seen_px[:, 0] - x0) / (x1 - x0) * (y1 - y0)
    np.testing.assert_allclose(rows, seen_px[:, 1], atol=1e-3)

    first, second = (tuple(point.tolist()) for point in seen_px)
    found = plates.upright_pose(
        plates.zenith_from_horizon(plate.intrinsics, first, second), HEIGHT_M
    )
    np.testing.assert_allclose(found.matrix(), pose.matrix(), atol=1e-6)


def test_ground_is_where_its_image_is() -> None:
    """Points of the ground come back from their images; those above the horizon do not."""
    plate = plate_seen_by(tilted(-5.0, 1.0))
    points_m = np.array([[6.0, -1.0], [20.0, 4.0], [250.0, 30.0]])
    seen_px = plate.intrinsics.project(
        plate.T_world_camera.inverse().apply(np.column_stack([points_m, np.zeros(3)]))
    )
    np.testing.assert_allclose(plates.ground_points(plate, seen_px), points_m, rtol=1e-6)
    assert np.isnan(plates.ground_points(plate, np.array([[600.0, 20.0]]))).all()


def test_the_rectangle_is_inside_the_ground() -> None:
    """It is a large part of a trapezoid, and all of its corners are inside."""
    plate = plate_seen_by(tilted(-5.0, 0.0))
    center, (length_m, width_m) = plates.ground_rectangle(plate)
    polygon = plates.ground_points(plate, np.array(CORNERS_PX))
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    corners = np.array(center.translation_m[:2]) + 0.49 * signs * (length_m, width_m)
    assert plates.is_inside(polygon, corners).all()
    x, y = polygon.T
    area = 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
    assert 0.4 * area < length_m * width_m < area


def test_a_ground_without_room_is_refused() -> None:
    """A sliver has no cell of the raster inside it; a corner above the horizon has no place."""
    level = tilted(0.0, 0.0)
    thin = ((0.0, 700.0), (1200.0, 500.0), (1200.0, 500.01))
    with pytest.raises(ValueError, match="no rectangle"):
        plates.ground_rectangle(plates.Plate(SIZE_PX, FOCAL_PX, level, thin))
    high = ((0.0, 700.0), (900.0, 700.0), (600.0, 390.0))
    with pytest.raises(ValueError, match="horizon"):
        plates.ground_rectangle(plates.Plate(SIZE_PX, FOCAL_PX, level, high))


@pytest.mark.parametrize("size_px", [(600, 400), (640, 480), (1242, 375), (500, 500)])
def test_cropped_images_show_the_same_directions(size_px: tuple[int, int]) -> None:
    """A pixel of the image and the pixel of the photograph under it have one ray."""
    whole = Intrinsics(*SIZE_PX, FOCAL_PX, FOCAL_PX, 600.0, 400.0)
    part, fitted = plates.crop_to(SIZE_PX, *size_px), plates.fitted_intrinsics(whole, *size_px)
    corner = np.array([[0.0, 0.0], [size_px[0], size_px[1]], [33.0, 77.0]])
    scale = np.array([part.width_px / size_px[0], part.height_px / size_px[1]])
    there = corner * scale + (part.x_px, part.y_px)
    np.testing.assert_allclose(fitted.rays(corner), whole.rays(there), atol=1e-8)
    assert part.width_px == SIZE_PX[0] or part.height_px == SIZE_PX[1]
    assert abs(scale[0] / scale[1] - 1.0) < 3e-3
