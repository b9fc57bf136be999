"""Noise reduction in cameras, against the statistics of photons."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.core import asset_types, colorimetry
from gen_data.sensors.camera import denoising, exposure
from tests.sensors.camera.photographs import EYE, made, photo

WHITE_E, READ_NOISE_E = 200.0, 3.0


def noisy(image: asset_types.Float32) -> asset_types.Float32:
    rng = np.random.default_rng(5)
    electrons = rng.poisson(image * WHITE_E) + READ_NOISE_E * rng.standard_normal(image.shape)
    return (electrons / WHITE_E).astype(np.float32)


def grey(level: float) -> asset_types.Float32:
    return np.full((96, 96, 3), level, np.float32)


@pytest.mark.parametrize("level", [0.05, 0.2, 0.6])
def test_grain_of_an_even_surface_falls_and_its_mean_stays(level: float) -> None:
    """A window of 81 pixels leaves at most half of luma's noise; the mean stays within 2 %."""
    before = noisy(grey(level))
    after = denoising.denoise(before, WHITE_E, READ_NOISE_E, 1.0)

    assert np.std(colorimetry.luminance(after)) < 0.5 * np.std(colorimetry.luminance(before))
    assert after.mean() == pytest.approx(level, rel=0.02, abs=0.002)


def test_strong_filtering_is_the_mean_of_the_window() -> None:
    """The variance of white noise falls to 1/81: the mean of 9 x 9 independent pixels."""
    before = colorimetry.luminance(noisy(grey(0.3)))
    after = colorimetry.luminance(denoising.denoise(noisy(grey(0.3)), WHITE_E, READ_NOISE_E, 4.0))

    inner = np.s_[12:-12, 12:-12]
    assert np.var(after[inner]) == pytest.approx(np.var(before) / 81.0, rel=0.35)


def test_colour_blotches_fall_more_than_grain() -> None:
    """Of red minus green is left a smaller share than of luma."""
    before = noisy(grey(0.2))
    after = denoising.denoise(before, WHITE_E, READ_NOISE_E, 0.6)

    def left(of: asset_types.Float32, made: asset_types.Float32) -> float:
        return float(np.std(made) / np.std(of))

    chroma = left(before[..., 0] - before[..., 1], after[..., 0] - after[..., 1])
    assert chroma < left(colorimetry.luminance(before), colorimetry.luminance(after))


def test_edges_stay() -> None:
    """Three pixels from a strong edge, both sides have their own values."""
    image = grey(0.1)
    image[:, 48:] = 0.6
    after = denoising.denoise(noisy(image), WHITE_E, READ_NOISE_E, 1.0)

    assert after[:, 42:46].mean() == pytest.approx(0.1, rel=0.1)
    assert after[:, 50:54].mean() == pytest.approx(0.6, rel=0.1)


def picture(ev100: float, strength: float) -> NDArray[np.uint8]:
    """A grey wall at middle grey, by a small sensor with automatic exposure down to ISO 6400."""
    pipeline = made(
        image_sensor={"full_well_e": 10_000, "read_noise_e": 2},
        exposure_control={"f_number": 1.8, "time_s": [1e-5, 1 / 30], "iso": [50, 6400]},
        denoise=strength,
    )
    wall = np.full((48, 64, 3), 0.18 * 1.2 * 2.0**ev100)
    return photo(wall, pipeline, replace(EYE, ev100=ev100)).rgb


def test_the_stage_changes_dim_pictures_alone() -> None:
    """At 14 EV and ISO 50 the picture keeps its bytes; at 1 EV and ISO 3000 its noise falls."""
    assert (picture(14.0, 1.0) == picture(14.0, 0.0)).all()

    raw, filtered = picture(1.0, 0.0), picture(1.0, 1.0)
    assert filtered.std() < 0.5 * raw.std()
    assert filtered.mean() == pytest.approx(raw.mean(), rel=0.03)

    assert not denoising.is_noisy(12_000.0)
    assert denoising.is_noisy(150.0)


@pytest.mark.parametrize(("ev100", "stops"), [(0.0, 2.27), (2.0, 1.19), (5.0, 0.0), (14.0, 0.0)])
def test_dim_scenes_stay_dark(ev100: float, stops: float) -> None:
    """Krawczyk's key of the luminance at middle grey, over that at 5 EV, in stops."""
    assert exposure.dimming_ev(ev100) == pytest.approx(stops, abs=0.01)
