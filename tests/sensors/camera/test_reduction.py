"""Images that are reduced from a larger photograph: against the mean of that photograph."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gen_data.core.asset_types import Material
from gen_data.core.capture import Channel
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Body, Camera, Scene
from gen_data.core.se3 import SE3
from gen_data.core.streams import Streams
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.settings import RenderSettings
from gen_data.sensors.camera.image_pipeline import ImagePipeline, capture_photograph
from gen_data.sensors.camera.image_sensor import ImageSensor, expose, expose_colors
from tests.renderers.fake_library import DARK, FakeLibrary, box_mesh
from tests.sensors.camera.photographs import EYE, made, photo

SIDE = 4
SENSOR = ImageSensor(full_well_e=1000.0, prnu=0.02, dsnu_e=4.0, bits=10)


def rng(name: str = "noise") -> Any:
    return Streams(seed=8, scene=0).rng(name)


def block_means(image: np.ndarray, side: int = SIDE) -> np.ndarray:
    """Means over squares of pixels, [h / side, w / side, ...]."""
    h, w = image.shape[0] // side, image.shape[1] // side
    return image.reshape(h, side, w, side, *image.shape[2:]).mean(axis=(1, 3))


@pytest.mark.parametrize("level", [0.1, 0.3, 0.8])
def test_noise_is_that_of_the_mean_of_so_many_photosites(level: float) -> None:
    """EMVA 1288: electrons, variances and fixed patterns of 16 pixels add up."""
    light = np.full((512, 512), level, np.float32)

    many = block_means(expose(light, 2.0, 0.01, SENSOR, rng()))
    one = expose(light[::SIDE, ::SIDE], 2.0, 0.01, SENSOR, rng("other"), SIDE**2)

    assert one.mean() == pytest.approx(many.mean(), abs=3e-4)
    # Standard deviations of 16,384 numbers: their own error is 0.6 percent.
    assert one.std() == pytest.approx(many.std(), rel=0.04)


def test_colours_have_the_photosites_behind_their_filters() -> None:
    """Of four, one is red, two are green, one is blue: noise is as the inverse root."""
    sensor = SENSOR.model_copy(update={"prnu": 0.0, "dsnu_e": 0.0})
    light = np.full((256, 256, 3), 0.5, np.float32)

    red, green, blue = (
        expose_colors(light, 1.0, 0.01, sensor, rng(), 64.0).std(axis=(0, 1)).tolist()
    )

    assert red / green == pytest.approx(2.0**0.5, rel=0.03)
    assert blue / green == pytest.approx(2.0**0.5, rel=0.03)


def pipeline(**given: Any) -> ImagePipeline:
    """A camera with every stage that lengths in pixels matter to."""
    stages = {
        "blur_px": 1.2, "chromatic_aberration_px": 2.0, "image_sensor": {"full_well_e": 20000},
        "focus": {"distance_m": 1.0, "pixel_um": 30}, "tone": "knee", "white_balance": 0.5,
    }  # fmt: skip
    return made(**{**stages, **given})


def test_a_reduced_photograph_is_the_mean_of_the_larger_one() -> None:
    """Same lens, focus, sensor and tone; radiance that varies over many pixels."""
    large = Intrinsics.from_hfov(64 * SIDE, 48 * SIDE, 1.0)
    small = Intrinsics.from_hfov(64, 48, 1.0)
    y, x = np.mgrid[: large.height_px, : large.width_px] / large.width_px
    waves = np.stack([np.sin(9 * x + k) * np.cos(7 * y - k) for k in range(3)], axis=-1)
    radiance = (100.0 * 2.0 ** (1.5 * waves)).astype(np.float32)
    depth_m = np.where(x < 0.5, 1.0, 4.0)

    def shown(image: np.ndarray, depth: np.ndarray, lens: Intrinsics, **given: Any) -> np.ndarray:
        camera = replace(EYE, intrinsics=lens)
        rgb = photo(image, pipeline(**given), camera, depth_m=depth, stream=rng()).rgb
        return rgb.astype(np.float64)

    expected = block_means(shown(radiance, depth_m, large))
    reduced = shown(block_means(radiance), depth_m[::SIDE, ::SIDE], small, reduction=SIDE)
    whole = shown(block_means(radiance), depth_m[::SIDE, ::SIDE], small)

    inner = np.s_[4:-4, 4:-4]
    error = np.abs(reduced - expected)[inner]
    assert error.mean() < 1.0
    assert error.mean() < 0.5 * np.abs(whole - expected)[inner].mean()


WINDOW_CD_M2, WALL_CD_M2 = 3000.0, 20.0


def emitting(luminance_cd_m2: float) -> Material:
    return Material((0.0, 0.0, 0.0), 1.0, specular=0.0, emission_cd_m2=(luminance_cd_m2,) * 3)


def window_in_a_wall() -> tuple[Scene, FakeLibrary]:
    """A bright square, turned by 10 degrees, on a dim one that fills the view."""
    bright = Body(
        "window", "box", SE3.about_z(np.radians(10.0), (0.0, 0.0, 2.0)), 0.8,
        materials=(emitting(WINDOW_CD_M2),),
    )  # fmt: skip
    dim = Body("wall", "box", SE3((0.0, 0.0, 10.0)), 8.0, materials=(emitting(WALL_CD_M2),))
    return Scene("t", (dim, bright), environment=DARK), FakeLibrary({"box": box_mesh()})


def looking_along_z(width_px: int, height_px: int) -> Camera:
    return replace(EYE, intrinsics=Intrinsics.from_hfov(width_px, height_px, 1.0))


def test_edges_of_what_saturates_are_those_of_the_reduced_photograph() -> None:
    """Of a window ten times as bright as white, a pixel that is half wall is not white."""
    scene, library = window_in_a_wall()
    renderer = WarpRenderer(library, "cpu", RenderSettings(antialias=8))
    rgb = frozenset({Channel.RGB})

    def shown(camera: Camera, **given: Any) -> np.ndarray:
        settings = ImagePipeline.model_validate({"tone": "srgb", **given})
        reading = capture_photograph(scene, renderer, camera, rgb, settings, rng())
        return reading.channels[Channel.RGB].astype(np.float64)

    expected = block_means(shown(looking_along_z(80 * 8, 60 * 8)), 8)
    reduced = shown(looking_along_z(80, 60), reduction=8.0)
    plain = shown(looking_along_z(80, 60))

    partly = (expected > expected.min() + 5.0) & (expected < 250.0)
    assert partly.sum() > 100
    error, of_plain = (np.abs(p - expected)[partly].mean() for p in (reduced, plain))
    assert error < 25.0
    assert error < 0.4 * of_plain
