"""Light that lenses scatter and drops that bend it."""

import math

import cv2
import numpy as np
import pytest

from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Camera, Weather
from gen_data.core.se3 import SE3
from gen_data.core.streams import Streams
from gen_data.sensors.camera.lens_drops import lens_drops, refract_in_drops
from gen_data.sensors.camera.optics import FACTOR, add_glare, scatter

CAMERA = Camera("front", SE3(), Intrinsics(960, 640, 800.0, 800.0, 480.0, 320.0))


def test_drops_hide_their_share_of_the_lens_and_rain_in_the_air_nothing() -> None:
    shares = []
    for seed in range(60):
        drops = lens_drops(Weather(lens_drops=0.05, seed=seed), CAMERA)
        area = 0.9 * math.pi * float((drops[:, 2] ** 2).sum())
        shares.append(1.0 - math.exp(-area / (960 * 640)))

    assert np.mean(shares) == pytest.approx(0.05, rel=0.15)

    assert len(lens_drops(Weather(rain_mm_h=20.0), CAMERA)) == 0


def test_a_drop_shows_the_scene_upside_down() -> None:
    """White above black: within a drop of 20 px, black above white; around it nothing changes."""
    image = np.zeros((200, 300, 3), np.float32)
    image[:100] = 1.0

    seen = refract_in_drops(image, np.array([[150.0, 100.0, 20.0, 7.0]]))

    assert seen[90, 150, 0] < 0.3
    assert seen[110, 150, 0] > 0.7
    y, x = np.mgrid[0:200, 0:300]
    beside = np.hypot(x + 0.5 - 150.0, y + 0.5 - 100.0) > 1.4 * 20.0
    assert np.array_equal(seen[beside], image[beside])
    assert 0.0 <= seen.min() <= seen.max() <= 1.0


def test_drops_at_the_rim_of_small_images_are_cut_off() -> None:
    """Centres on corners, radii larger than the image."""
    image = np.full((5, 9, 3), 2.0, np.float32)
    seen = refract_in_drops(image, np.array([[0.0, 0.0, 4.0, 1.0], [9.0, 5.0, 30.0, 2.0]]))

    assert np.isfinite(seen).all()
    assert seen.max() <= 2.0 + 1e-5


def test_glare_moves_light_makes_none_and_leaves_its_input() -> None:
    """A bright point far from the edges keeps its sum; its neighbourhood gets some of it."""
    image = np.zeros((512, 512, 3), np.float32)
    image[250, 260] = 1000.0
    given = image.copy()
    veil = add_glare(image, 1.0)

    assert veil.sum(dtype=np.float64) == pytest.approx(image.sum(dtype=np.float64), rel=1e-3)
    assert veil[250, 260, 0] > veil[250, 300, 0] > 0.0
    assert veil.min() >= 0.0
    assert np.array_equal(image, given)


def test_glare_is_enlarged_bilinearly() -> None:
    """As OpenCV does it, in images of any size, and mixed with light that arrives straight."""
    for height, width in ((64, 96), (50, 67), (3, 9)):
        rng = Streams(seed=1, scene=0).rng("image")
        image = rng.uniform(0.0, 9.0, (height, width, 3)).astype(np.float32)
        coarse = scatter(image) / 3.0
        size = (coarse.shape[1] * FACTOR, coarse.shape[0] * FACTOR)
        veil = cv2.resize(coarse, size, interpolation=cv2.INTER_LINEAR)[:height, :width]

        np.testing.assert_allclose(add_glare(image, 0.25), 0.75 * image + 0.25 * veil, rtol=1e-4)
