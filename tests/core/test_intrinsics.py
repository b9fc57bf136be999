"""The pinhole camera and its half-pixel convention."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gen_data.core.intrinsics import Intrinsics

VGA = Intrinsics(640, 480, 500.0, 510.0, 320.0, 240.0)


def test_the_centre_of_the_first_pixel_is_at_one_half() -> None:
    """Pixel ``i`` covers ``[i, i + 1)``."""
    points = Intrinsics(4, 2, 2.0, 2.0, 2.0, 1.0).unproject(np.ones((2, 4)))

    # By hand: x = (u - cx) / fx with u = 0.5, 1.5, 2.5, 3.5.
    np.testing.assert_allclose(points[0, :, 0], [-0.75, -0.25, 0.25, 0.75])
    np.testing.assert_allclose(points[:, 0, 1], [-0.25, 0.25])
    np.testing.assert_allclose(points[..., 2], 1.0)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    st.integers(1, 12), st.integers(1, 12), st.floats(1, 2000), st.floats(1, 2000),
    st.floats(0.01, 50),
)  # fmt: skip
def test_projecting_what_was_unprojected_gives_pixel_centres(
    width: int, height: int, fx: float, fy: float, z: float
) -> None:
    """Project after unproject is the identity on the pixel grid."""
    camera = Intrinsics(width, height, fx, fy, 0.4 * width, 0.7 * height)

    pixels = camera.project(camera.unproject(np.full((height, width), z)))

    u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    np.testing.assert_allclose(pixels, np.stack([u, v], axis=-1), rtol=1e-9, atol=1e-9)


def test_projection_is_that_of_the_calibration_matrix() -> None:
    """Homogeneous image coordinates ``K p``."""
    p_camera = np.array([[0.1, -0.2, 1.0], [1.0, 2.0, 4.0]])

    homogeneous = p_camera @ VGA.matrix().T

    np.testing.assert_allclose(VGA.project(p_camera), homogeneous[:, :2] / homogeneous[:, 2:])


def test_what_lies_behind_has_no_image_and_what_saw_nothing_no_point() -> None:
    pixels = VGA.project(np.array([[0.0, 0, 1], [0, 0, 0], [0, 0, -1]]))

    assert np.isfinite(pixels[0]).all()
    assert np.isnan(pixels[1:]).all()

    depth = np.array([[1.0, np.inf]])

    points = Intrinsics(2, 1, 1.0, 1.0, 1.0, 0.5).unproject(depth)

    assert np.isfinite(points[0, 0]).all()
    assert np.isnan(points[0, 1]).all()


@pytest.mark.parametrize(("width", "height", "hfov_deg"), [(640, 480, 60), (1, 1, 90), (37, 5, 1)])
def test_the_field_of_view_spans_the_image_edges(width: int, height: int, hfov_deg: float) -> None:
    """From the left edge of the first pixel to the right edge of the last."""
    camera = Intrinsics.from_hfov(width, height, math.radians(hfov_deg))

    angle = 2 * math.atan(0.5 * width / camera.fx_px)

    assert math.degrees(angle) == pytest.approx(hfov_deg, rel=1e-6)
    assert (camera.cx_px, camera.cy_px) == (width / 2, height / 2)
    assert (camera.fx_px, camera.fx_px) == (camera.fy_px, round(camera.fx_px, 6))
