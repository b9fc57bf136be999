"""Rectified images and labels, against OpenCV and against a ray cast of the pinhole."""

from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest
from scipy.ndimage import maximum_filter, minimum_filter

from gen_data.annotations.annotate import Thresholds
from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.exporters.base import Rectify
from gen_data.pipeline.rectification import Rectification, rectified_intrinsics, rectified_truth
from tests.exporters import conftest
from tests.exporters.bent import LENSES, bent_samples, opencv_maps, opencv_matrix


def rectified(source: Intrinsics, **fields: Any) -> Rectification:
    return Rectification(source, rectified_intrinsics(source, Rectify(**fields)))


@pytest.fixture(params=sorted(LENSES))
def bent(request: pytest.FixtureRequest) -> Rectification:
    return rectified(LENSES[request.param])


def test_maps_and_pictures_are_opencvs_and_show_what_the_original_has(bent: Rectification) -> None:
    """OpenCV's maps are float32 and count from the centre of the first pixel."""
    own = np.moveaxis(bent._inside, -1, 0) - 0.5
    np.testing.assert_allclose(own, opencv_maps(bent.source, bent.target), atol=2e-5)
    u, v = opencv_maps(bent.source, bent.target)
    assert (u.min() > -1e-3, v.min() > -1e-3) == (True, True)
    assert (u.max() < 159 + 1e-3, v.max() < 119 + 1e-3) == (True, True)
    k = bent.target
    wider = replace(k, fx_px=0.99 * k.fx_px, fy_px=0.99 * k.fy_px)
    u, v = opencv_maps(bent.source, wider)
    assert u.min() < 0 or v.min() < 0 or u.max() > 159 or v.max() > 119
    # OpenCV's weights are multiples of 1/32: on a photograph of small contrast, one grey level.
    rng = np.random.default_rng(0)
    image = cv2.GaussianBlur(rng.integers(0, 256, (120, 160, 3), np.uint8), (0, 0), 3.0)
    maps = opencv_maps(bent.source, bent.target)
    theirs = cv2.remap(image, *maps, cv2.INTER_LINEAR)
    ours = bent.image(Channel.RGB, image)
    assert ours.dtype == np.uint8
    assert np.abs(ours.astype(int) - theirs).max() <= 1


def test_the_default_pinhole_and_its_points_are_opencvs_without_empty_pixels() -> None:
    """``alpha=0`` with a centred principal point, whose rectangle is a little too narrow."""
    source = LENSES["brown_conrady"]
    bent = rectified(source)
    target = bent.target
    K, _ = cv2.getOptimalNewCameraMatrix(
        opencv_matrix(source),
        np.array(source.lens.coefficients),
        (160, 120),
        0.0,
        centerPrincipalPoint=True,
    )
    np.testing.assert_allclose(opencv_matrix(target), K, rtol=2e-3)
    assert target.fx_px / target.fy_px == pytest.approx(118.0 / 117.0)
    # Keypoints: ``cv2.undistortPoints`` with the new matrix.
    points = np.array([[20.3, 30.8], [80.0, 60.0], [150.1, 100.9]])
    theirs = cv2.undistortPoints(
        (points - 0.5).reshape(-1, 1, 2),
        opencv_matrix(source),
        np.array(source.lens.coefficients),
        R=np.eye(3),
        P=opencv_matrix(target),
        criteria=(cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 100, 1e-12),
    )
    np.testing.assert_allclose(bent.points(points) - 0.5, theirs[:, 0], atol=1e-6)


@pytest.mark.parametrize("model", sorted(LENSES))
def test_label_images_are_those_of_a_pinhole_except_at_silhouettes(world: Any, model: str) -> None:
    """Against a ray cast of the pinhole; the half pixel of the nearest one changes nothing else."""
    (sample,) = bent_samples(world, model, 1)
    reading = sample.capture.readings["color"]
    bent = rectified(reading.camera.intrinsics)
    pinhole = conftest.ray_cast(sample.scene, replace(reading.camera, intrinsics=bent.target))
    cast = pinhole.channels[Channel.INSTANCE]
    ids = bent.image(Channel.INSTANCE, reading.channels[Channel.INSTANCE])
    inner = minimum_filter(cast, 3) == maximum_filter(cast, 3)
    np.testing.assert_array_equal(ids[inner], cast[inner])
    assert set(np.unique(ids)) == set(np.unique(cast))
    depth = bent.image(Channel.Z_DEPTH, reading.channels[Channel.Z_DEPTH])
    true = pinhole.channels[Channel.Z_DEPTH]
    # A surface's slope over at most half a pixel.
    things = inner & (cast > 0)
    assert np.median(np.abs(depth[things] / true[things] - 1.0)) < 2e-3
    away_m = bent.image(Channel.RANGE, reading.channels[Channel.RANGE])
    length = np.linalg.norm(bent.target.pixel_rays() / bent.target.pixel_rays()[..., 2:], axis=-1)
    seen = np.isfinite(depth)
    np.testing.assert_array_equal(np.isfinite(away_m), seen)
    np.testing.assert_allclose(away_m[seen], (depth * length)[seen], rtol=1e-5)


@pytest.mark.parametrize("model", sorted(LENSES))
def test_annotations_are_those_of_the_rectified_masks(world: Any, model: str) -> None:
    """Boxes are tight around them; keypoints, shares and poses agree with the pinhole's own."""
    (sample,) = bent_samples(world, model, 1)
    reading, truth = sample.capture.readings["color"], sample.truth["color"]
    bent = rectified(reading.camera.intrinsics)
    again = rectified_truth(truth, sample.scene, bent, Thresholds())
    camera = replace(reading.camera, intrinsics=bent.target)
    cast = conftest.ray_cast(sample.scene, camera)
    other = conftest.annotated(sample.scene, {"color": cast}, Thresholds())["color"]
    ids = bent.image(Channel.INSTANCE, reading.channels[Channel.INSTANCE])
    assert again.camera == camera
    assert [t.instance for t in again.objects] == [t.instance for t in other.objects]
    for mine, theirs in zip(again.objects, other.objects, strict=True):
        rows, columns = np.nonzero(ids == mine.instance.instance_id)
        assert mine.visible_px == len(rows)
        assert mine.box is not None
        assert (mine.box.x_min, mine.box.y_min) == (columns.min(), rows.min())
        assert (mine.box.x_max, mine.box.y_max) == (columns.max() + 1, rows.max() + 1)
        assert mine.mask is not None
        assert mine.mask.pixels.sum() == len(rows)
        assert mine.T_camera_object == theirs.T_camera_object
        assert mine.box3d_camera == theirs.box3d_camera
        for name in ("visible_fraction", "occlusion", "truncation"):
            assert getattr(mine, name) == pytest.approx(getattr(theirs, name), abs=0.06), name
        for corner, true in zip(mine.oriented_box, theirs.oriented_box, strict=True):
            np.testing.assert_allclose(corner, true, atol=2.5)
        for point, true in zip(mine.keypoints, theirs.keypoints, strict=True):
            np.testing.assert_allclose(point.image_px, true.image_px, atol=1e-6)
            assert (point.visibility > 0) == (true.visibility > 0)


@pytest.mark.parametrize("amodal", [True, False])
def test_shares_of_objects_that_only_the_rectified_image_cuts(world: Any, amodal: bool) -> None:
    """A field of 32 degrees cuts objects that the original shows whole.

    Without amodal masks this holds for objects that nothing hides.
    """
    (sample,) = bent_samples(world, "brown_conrady", 1)
    truth = sample.truth["color"]
    if not amodal:
        objects = tuple(replace(t, amodal_mask=None) for t in truth.objects)
        truth = replace(truth, objects=objects)
    bent = rectified(truth.camera.intrinsics, hfov_deg=32.0)
    again = rectified_truth(truth, sample.scene, bent, Thresholds())
    camera = replace(truth.camera, intrinsics=bent.target)
    cast = {"color": conftest.ray_cast(sample.scene, camera)}
    other = conftest.annotated(sample.scene, cast, Thresholds())["color"]
    assert [t.instance for t in again.objects] == [t.instance for t in other.objects]
    cut = 0
    for mine, theirs in zip(again.objects, other.objects, strict=True):
        cut += 0.05 < theirs.truncation < 0.95
        first = {t.instance: t for t in truth.objects}[mine.instance]
        box = first.amodal_box
        if not amodal and first.occlusion > 0.0:
            continue
        if min(box.x_min, box.y_min) > 0 and box.x_max < 160 and box.y_max < 120:
            # Of 71 to 300 original pixels: half a pixel along the edge.
            assert mine.truncation == pytest.approx(theirs.truncation, abs=0.06)
            assert mine.visible_fraction == pytest.approx(theirs.visible_fraction, abs=0.06)
            assert mine.amodal_box.width_px == pytest.approx(theirs.amodal_box.width_px, abs=3)
    assert cut > 0


def test_a_panorama_needs_a_stated_field() -> None:
    """Also a fisheye that sees sideways; the rest of it is the view of a pinhole at K'."""
    for lens in (Lens("equirectangular"), Lens("kannala_brandt", (0.0, 0.0, 0.0, 0.0))):
        source = Intrinsics.from_hfov(160, 120, np.radians(200.0), lens)
        with pytest.raises(ConfigError, match="wider than 150 degrees; expected rectify: "):
            rectified_intrinsics(source, Rectify())
        target = rectified_intrinsics(source, Rectify(hfov_deg=90.0))
        assert target == Intrinsics(160, 120, 80.0, 80.0, 80.0, 60.0)


def test_the_focal_length_can_be_kept() -> None:
    """Beyond the original there is nothing: black, and no label."""
    source = replace(LENSES["brown_conrady"], lens=Lens("brown_conrady", (0.5, *[0.0] * 7)))
    bent = rectified(source, keep_focal=True)
    assert bent.target == Intrinsics(160, 120, 118.0, 117.0, 81.5, 58.7)
    u, v = opencv_maps(source, bent.target)
    outside = (u < -0.5) | (u >= 159.5) | (v < -0.5) | (v >= 119.5)
    assert 0 < outside.sum() < outside.size
    white = np.full((120, 160, 3), 255, np.uint8)
    np.testing.assert_array_equal(bent.image(Channel.RGB, white)[..., 0] == 0, outside)
    depth = np.ones((120, 160), np.float32)
    np.testing.assert_array_equal(np.isinf(bent.image(Channel.Z_DEPTH, depth)), outside)
