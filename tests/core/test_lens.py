"""Lens models against OpenCV, and where OpenCV leaves off: folds, fields, points behind."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.serialization import from_plain, to_plain
from tests import opencv

KITTI = Lens(
    "brown_conrady", (-0.3691481, 0.1968681, 1.353473e-3, 5.677587e-4, -0.06770705, 0.0, 0.0, 0.0)
)
TUM_VI = Lens(
    "kannala_brandt",
    (0.0034823894022493434, 0.0007150348452162257, -0.0020532361418706202, 0.00020293673591811182),
)
GLOBE = Intrinsics.from_hfov(360, 180, 2.0 * math.pi, Lens("equirectangular"))
SMALL = st.floats(-0.05, 0.05)


def camera_of(
    lens: Lens, size_px: tuple[int, int] = (640, 480), focal_px: float = 600.0
) -> Intrinsics:
    width, height = size_px
    return Intrinsics(width, height, focal_px, 1.02 * focal_px, 0.52 * width, 0.47 * height, lens)


def assert_is_opencvs(camera: Intrinsics) -> None:
    """Every pixel's ray goes where OpenCV has its origin."""
    rays = camera.pixel_rays()
    shown = np.isfinite(rays[..., 0])
    v, u = np.nonzero(shown)
    ahead = rays[shown][:, 2] > 0.02

    there = opencv.places(camera, 7.0 * rays[shown][ahead])

    centres = np.stack([u + 0.5, v + 0.5], axis=-1)
    np.testing.assert_allclose(there, centres[ahead], atol=1e-6)
    np.testing.assert_allclose(camera.project(3.0 * rays[shown]), centres, atol=1e-6)
    np.testing.assert_allclose((rays[shown] ** 2).sum(axis=1), 1.0, rtol=1e-12)


@pytest.mark.parametrize("lens", [KITTI, TUM_VI], ids=["KITTI", "TUM VI"])
def test_known_lenses_are_those_of_opencv(lens: Lens) -> None:
    """All pixels of the image, in both directions, to a millionth of a pixel."""
    assert not camera_of(lens).folds_over()
    assert_is_opencvs(camera_of(lens))


@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    st.floats(-0.35, 0.35), st.floats(-0.1, 0.1), st.tuples(*[st.floats(-0.01, 0.01)] * 2),
    st.tuples(*[SMALL] * 4),
)  # fmt: skip
def test_any_brown_conrady_lens_is_that_of_opencv(
    k1: float, k2: float, tangential: tuple[float, float], others: tuple[float, ...]
) -> None:
    """The rational model with tangential terms; where it folds over, visible pixels are right."""
    lens = Lens("brown_conrady", (k1, k2, *tangential, *others))

    assert_is_opencvs(camera_of(lens, (64, 48), 40.0))


@pytest.mark.slow
@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.floats(-0.1, 0.1), SMALL, SMALL, SMALL, st.floats(60.0, 400.0))
def test_any_fisheye_is_opencvs(
    k1: float, k2: float, k3: float, k4: float, focal_px: float
) -> None:
    """From a moderate angle of view to one of more than a half sphere."""
    lens = Lens("kannala_brandt", (k1, k2, k3, k4))

    assert_is_opencvs(Intrinsics(512, 400, focal_px, 1.02 * focal_px, 250.0, 210.0, lens))


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    st.sampled_from([KITTI, TUM_VI, Lens("equirectangular")]), st.floats(-0.6, 0.6),
    st.floats(-0.5, 0.5),
)  # fmt: skip
def test_rays_are_the_inverse_of_project(lens: Lens, x: float, y: float) -> None:
    """Anywhere in the image, not only at centres."""
    camera = camera_of(lens)
    place = np.array([camera.cx_px + x * 600.0, camera.cy_px + y * 600.0])

    np.testing.assert_allclose(camera.project(camera.rays(place)), place, atol=1e-6)


def test_a_fisheye_shows_what_lies_behind_it() -> None:
    """An equidistant lens puts 120 degrees off the axis at that angle times the focal length."""
    camera = Intrinsics(512, 512, 100.0, 100.0, 256.0, 256.0, Lens("kannala_brandt", (0.0,) * 4))
    angle = math.radians(120.0)

    place = camera.project(np.array([math.sin(angle), 0.0, math.cos(angle)]))

    np.testing.assert_allclose(place, [256.0 + 100.0 * angle, 256.0])
    np.testing.assert_allclose(camera.project(np.array([0.0, 0.0, 2.0])), [256.0, 256.0])


def test_what_is_outside_the_field_has_no_image() -> None:
    """NaN: beyond the field's end, behind a lens that looks ahead, and at the camera itself."""
    narrow = Intrinsics(
        64, 64, 20.0, 20.0, 32.0, 32.0, Lens("kannala_brandt", (0.0,) * 4, math.radians(50.0))
    )
    beyond = np.array([math.sin(math.radians(51.0)), 0.0, math.cos(math.radians(51.0))])

    assert np.isnan(narrow.project(beyond)).all()
    assert np.isfinite(narrow.project(beyond - np.array([0.03, 0.0, 0.0]))).all()
    assert np.isnan(camera_of(KITTI).project(np.array([0.1, 0.0, -1.0]))).all()
    assert np.isnan(GLOBE.project(np.zeros(3))).all()
    assert np.isnan(narrow.rays(np.array([32.0 + 20.0 * math.radians(51.0), 32.0]))).all()


def test_a_panorama_is_the_whole_sphere() -> None:
    """One degree per pixel: ahead in the middle, right at three quarters, behind at the ends."""
    rays = GLOBE.pixel_rays()

    assert np.isfinite(rays).all()
    ways = np.array([[0.0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, 1, 1], [0, -1, 0]])
    places = [[180.0, 90.0], [270.0, 90.0], [90.0, 90.0], [180.0, 135.0], [180.0, 0.0]]
    np.testing.assert_allclose(GLOBE.project(ways), places, atol=1e-5)
    # Solid angles of the pixels sum to a whole sphere's.
    latitude = (np.arange(180) - 89.5) * math.pi / 180.0
    area = (2.0 * math.pi / 360.0) * (math.pi / 180.0) * np.cos(latitude).sum() * 360.0
    assert area == pytest.approx(4.0 * math.pi, rel=1e-4)
    np.testing.assert_allclose(np.abs(rays.mean(axis=(0, 1))), 0.0, atol=1e-7)


def test_a_polynomial_that_turns_back_folds_over_unless_the_field_ends_before() -> None:
    """Up to r = sqrt(2 / 3), r - r^3 / 2 rises to 0.5443: 217.7 px at a focal length of 400."""
    lens = Lens("brown_conrady", (-0.5, *[0.0] * 7))
    edge = math.sqrt(2.0 / 3.0)
    inside = Intrinsics(2 * 217, 20, 400.0, 400.0, 217.0, 10.0, lens)
    outside = Intrinsics(2 * 219, 20, 400.0, 400.0, 219.0, 10.0, lens)

    assert not inside.folds_over()
    assert outside.folds_over()
    assert np.isfinite(inside.project(np.array([edge - 1e-4, 0.0, 1.0]))).all()
    assert np.isnan(inside.project(np.array([edge + 1e-4, 0.0, 1.0]))).all()

    k = (-0.2, 0.0, 0.0, 0.0)
    whole = Intrinsics(512, 512, 200.0, 200.0, 256.0, 256.0, Lens("kannala_brandt", k))
    ended = Intrinsics(512, 512, 200.0, 200.0, 256.0, 256.0, Lens("kannala_brandt", k, 1.2))

    assert whole.folds_over()
    assert not ended.folds_over()
    assert np.isnan(ended.pixel_rays()[0, 0]).all()


@pytest.mark.parametrize(
    ("lens", "hfov_deg"),
    [(KITTI, 80.0), (TUM_VI, 190.0), (Lens("equirectangular"), 120.0), (Lens(), 60.0)],
)
def test_the_field_of_view_spans_the_edges_of_any_image(lens: Lens, hfov_deg: float) -> None:
    """Rays through the middle of both sides; tangential terms are left out of it."""
    camera = Intrinsics.from_hfov(300, 200, math.radians(hfov_deg), lens)

    sides = camera.rays(np.array([[0.0, 100.0], [300.0, 100.0]]))

    angles = np.degrees(np.arctan2(sides[:, 0], sides[:, 2]))
    np.testing.assert_allclose(angles, [-0.5 * hfov_deg, 0.5 * hfov_deg], atol=0.1)


def test_depth_images_of_bent_views_become_points() -> None:
    """Each at its depth, and back at its pixel's centre."""
    camera = camera_of(KITTI, (64, 48))

    points = camera.unproject(np.full((48, 64), 2.5))

    np.testing.assert_allclose(points[..., 2], 2.5)
    np.testing.assert_allclose(camera.project(points)[10, 20], [20.5, 10.5], atol=1e-6)


@pytest.mark.parametrize("values", [(0.1,), (0.0,) * 9])
def test_coefficients_are_counted(values: tuple[float, ...]) -> None:
    """All of them are given, by their places."""
    with pytest.raises(ValueError, match="has 8 coefficients k1 k2 p1 p2 k3 k4 k5 k6"):
        Lens("brown_conrady", values)


def test_too_wide_a_field_is_refused() -> None:
    with pytest.raises(ValueError, match="nothing at 100 degrees from its axis"):
        Intrinsics.from_hfov(64, 48, math.radians(200.0), KITTI)
    with pytest.raises(ValueError, match="nothing at 90 degrees"):
        Intrinsics.from_hfov(64, 48, math.radians(180.0))


def test_lenses_survive_being_written() -> None:
    camera = camera_of(TUM_VI)

    assert from_plain(Intrinsics, to_plain(camera)) == camera
