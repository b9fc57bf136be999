"""Noise reduction in cameras, against the statistics of photons."""

from __future__ import annotations

import numpy as np
import pytest

from gen_data.generator.core.asset_types import Float32
from gen_data.generator.core.colorimetry import luminance
from gen_data.generator.sensors.camera.denoising import denoise, is_noisy
from gen_data.generator.sensors.camera.exposure import dimming_ev

WHITE_E, READ_NOISE_E = 200.0, 3.0


def noisy(image: Float32) -> Float32:
    """Poisson photons and normal read noise."""
    rng = np.random.default_rng(5)
    electrons = rng.poisson(image * WHITE_E) + READ_NOISE_E * rng.standard_normal(image.shape)
    return (electrons / WHITE_E).astype(np.float32)


def grey(level: float) -> Float32:
    """An even image."""
    return np.full((96, 96, 3), level, np.float32)


@pytest.mark.parametrize("level", [0.05, 0.2, 0.6])
def test_grain_of_an_even_surface_falls_and_its_mean_stays(level: float) -> None:
    """A window of 169 pixels leaves at most half of luma's noise; the mean stays within 2 %."""
    before = noisy(grey(level))
    after = denoise(before, WHITE_E, READ_NOISE_E, 1.0)

    assert np.std(luminance(after)) < 0.5 * np.std(luminance(before))
    assert after.mean() == pytest.approx(level, rel=0.02, abs=0.002)


def test_colour_blotches_fall_more_than_grain() -> None:
    """Of red minus green is left a smaller share than of luma."""
    before = noisy(grey(0.2))
    after = denoise(before, WHITE_E, READ_NOISE_E, 0.6)

    def left(of: Float32, made: Float32) -> float:
        return float(np.std(made) / np.std(of))

    chroma = left(before[..., 0] - before[..., 1], after[..., 0] - after[..., 1])
    assert chroma < left(luminance(before), luminance(after))


def test_edges_stay() -> None:
    """Three pixels beside a strong edge, both sides have their own values."""
    image = grey(0.1)
    image[:, 48:] = 0.6
    after = denoise(noisy(image), WHITE_E, READ_NOISE_E, 1.0)

    assert after[:, 42:46].mean() == pytest.approx(0.1, rel=0.1)
    assert after[:, 50:54].mean() == pytest.approx(0.6, rel=0.1)


def test_days_are_left_alone() -> None:
    """The signal-to-noise ratio of middle grey, the root of its electrons, is 46 and 5."""
    assert not is_noisy(12_000.0)
    assert is_noisy(150.0)


@pytest.mark.parametrize(("ev100", "stops"), [(0.0, 2.27), (2.0, 1.19), (5.0, 0.0), (14.0, 0.0)])
def test_dim_scenes_stay_dark(ev100: float, stops: float) -> None:
    """Krawczyk's key of the luminance at middle grey, over that at 5 EV, in stops."""
    assert dimming_ev(ev100) == pytest.approx(stops, abs=0.01)
