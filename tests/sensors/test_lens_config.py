"""Lenses as configurations name them."""

import math
from typing import Any

import numpy as np
import pytest

from gen_data.core.capture import Channel
from gen_data.core.lens import COEFFICIENTS
from gen_data.core.scene import Camera, Region, Scene
from gen_data.core.streams import Streams
from gen_data.sensors.camera.lens_models import CALIBRATIONS
from gen_data.sensors.camera.rgb_camera import RgbCamera
from tests.sensors.recorder import Recorder


def camera(**given: Any) -> Camera:
    return RgbCamera.model_validate({"name": "eye", **given}).mount(Scene("t")).camera("eye")


def test_a_camera_is_a_pinhole_unless_a_lens_with_its_coefficients_is_given() -> None:
    """By OpenCV's names, in OpenCV's order; those not given are 0."""
    assert camera().intrinsics == camera(lens={"model": "pinhole"}).intrinsics
    assert camera().intrinsics.straight

    lens = camera(lens={"model": "brown_conrady", "k1": -0.2, "p2": 0.001, "k6": 0.01}).intrinsics

    assert COEFFICIENTS["brown_conrady"] == ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
    assert lens.lens.coefficients == (-0.2, 0.0, 0.0, 0.001, 0.0, 0.0, 0.0, 0.01)


@pytest.mark.parametrize(("lens", "hfov_deg"), [
    ({"model": "brown_conrady", "k1": -0.1, "k2": 0.02}, 80.0),
    ({"model": "kannala_brandt", "k1": 0.01}, 185.0),
    ({"model": "equirectangular"}, 360.0),
])  # fmt: skip
def test_the_field_of_view_is_that_of_the_lens(lens: dict[str, Any], hfov_deg: float) -> None:
    """From the left edge of the image to the right one, at its middle row."""
    k = camera(lens=lens, hfov_deg=hfov_deg, size_px=(600, 300)).intrinsics

    sides = k.rays(np.array([[1e-3, 150.0], [600.0 - 1e-3, 150.0]]))

    left, right = np.degrees(np.arctan2(sides[:, 0], sides[:, 2]))
    assert right - left == pytest.approx(hfov_deg, abs=0.01)


def test_the_end_of_a_field_is_given_as_a_full_angle() -> None:
    """Half of it on either side of the axis."""
    k = camera(lens={"model": "kannala_brandt", "field_deg": 180}, hfov_deg=200).intrinsics

    assert k.lens.half_field_rad == pytest.approx(0.5 * math.pi)
    assert np.isnan(k.pixel_rays()[240, 0]).all()


@pytest.mark.parametrize("name", sorted(CALIBRATIONS))
def test_published_cameras_have_their_own_numbers(name: str) -> None:
    """At their own size: focal lengths as printed, the principal point half a pixel off."""
    known = CALIBRATIONS[name]
    k = camera(lens={"model": "calibrated", "camera": name}, size_px=known.size_px).intrinsics

    assert (k.fx_px, k.fy_px) == pytest.approx((known.fx_px, known.fy_px))
    assert (k.cx_px - 0.5, k.cy_px - 0.5) == pytest.approx((known.cx_px, known.cy_px))
    assert k.lens == known.lens
    assert not k.folds_over()


def test_a_published_camera_is_scaled_to_the_width_and_cut_to_the_height() -> None:
    """KITTI's at half its size, 100 of 256 rows: the rays of the rows that stay do not change."""
    lens = {"model": "calibrated", "camera": "kitti_raw_02"}
    whole = camera(lens=lens, size_px=(1392, 512)).intrinsics
    small = camera(lens=lens, size_px=(696, 100)).intrinsics

    places = np.array([[10.0, 0.0], [350.0, 60.0], [690.0, 100.0]])
    there = 2.0 * (places + np.array([0.0, 78.0]))
    np.testing.assert_allclose(small.rays(places), whole.rays(there), atol=1e-8)


@pytest.mark.parametrize("given", [
    {"hfov_deg": 30}, {"hfov_deg": 90}, {"lens": {"model": "kannala_brandt"}, "hfov_deg": 150},
    {"lens": {"model": "kannala_brandt", "field_deg": 60}, "hfov_deg": 120},
    {"lens": {"model": "equirectangular"}, "hfov_deg": 360},
])  # fmt: skip
def test_a_camera_is_mounted_with_the_whole_focus_in_view(given: dict[str, Any]) -> None:
    """However wide: all of the region is in the image, its centre in the middle."""
    focus = Region((0.5, -0.2, 0.75), (1.2, 0.8, 0.4))
    sensor = RgbCamera.model_validate({"name": "eye", "size_px": (640, 480), **given})

    found = sensor.mount(Scene("t", focus=focus)).camera("eye")

    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    corners = np.asarray(focus.center_m) + 0.5 * signs * np.asarray(focus.size_m)
    image = found.intrinsics.project(found.T_world_camera.inverse().apply(corners))
    assert ((image > 0) & (image < [640, 480])).all()
    centre = found.T_world_camera.inverse().apply(np.asarray(focus.center_m))
    np.testing.assert_allclose(found.intrinsics.project(centre), [320, 240], atol=0.01)


@pytest.mark.parametrize(
    ("lens", "depth"), [("pinhole", Channel.Z_DEPTH), ("kannala_brandt", Channel.RANGE)]
)
def test_photographs_are_focused_along_the_axis_or_at_a_distance(lens: str, depth: Channel) -> None:
    """Points at the side of a fisheye have no depth along its axis."""
    sensor = RgbCamera.model_validate({
        "name": "eye", "size_px": (32, 24), "lens": {"model": lens}, "channels": ("rgb",),
        "image_pipeline": {"focus": {"pixel_um": 3.0}},
    })  # fmt: skip
    renderer, rng = Recorder(), Streams(seed=0, scene=0).rng("eye")

    reading = sensor.capture(sensor.mount(Scene("t")), renderer, frozenset(), rng)

    assert renderer.asked == {Channel.RADIANCE, depth}
    assert reading.channels[Channel.RGB].shape == (24, 32, 3)
    assert set(reading.channels) == {Channel.RGB}
