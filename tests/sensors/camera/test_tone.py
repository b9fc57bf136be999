"""Tone curves against the formulas of their sources."""

import math
from typing import get_args

import numpy as np
import pytest

from gen_data.core.streams import Streams
from gen_data.sensors.camera import isp

TONES: tuple[isp.Tone, ...] = get_args(isp.Tone)


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        # In the straight part, 0.22 to 0.532, the curve is the identity.
        (0.22, 0.22),
        (0.4, 0.4),
        (0.532, 0.532),
        # The shoulder: 1 - 0.468 exp(-(x - 0.532) / 0.468).
        (1.0, 1.0 - 0.468 * math.exp(-1.0)),
        (2.0, 1.0 - 0.468 * math.exp(-1.468 / 0.468)),
        # The toe half-way up, where it weighs half: (0.22 * 0.5^1.33 + 0.11) / 2.
        (0.11, 0.5 * (0.22 * 0.5**1.33 + 0.11)),
    ],
)
def test_filmic_is_uchimuras_curve(value: float, expected: float) -> None:
    """Uchimura 2017, worked by hand for his parameters."""
    assert float(isp.filmic(np.array(value))) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("value", "expected"),
    [(0.0, 0.0), (0.3, 0.3), (0.5, 0.5), (1.0, 1.0 - 0.5 / math.e), (2.0, 1.0 - 0.5 / math.e**3)],
)
def test_knee_is_straight_and_then_an_exponential(value: float, expected: float) -> None:
    """The identity to a half; above it half the room is left every ln(2) / 2."""
    assert float(isp.knee(np.array(value))) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("contrast", [0.5, 1.0, 1.3, 2.0])
def test_contrast_is_the_slope_at_middle_grey(contrast: float) -> None:
    """A stop above middle grey is ``contrast`` stops above it; without a curve, up to white."""
    stops = np.linspace(-2.0, 1.0, 7)
    shown = isp.display_values(0.18 * 2.0**stops, "linear", contrast=contrast)

    lit = 0.18 * 2.0 ** (contrast * stops) <= 1.0
    assert np.log2(shown[lit] / 0.18) == pytest.approx(contrast * stops[lit], abs=1e-12)
    assert shown[~lit] == pytest.approx(1.0)


@pytest.mark.parametrize("white", [1.0, 16.0, 256.0])
def test_log_is_the_mu_law(white: float) -> None:
    """Kalantari and Ramamoorthi 2017: log(1 + mu x) / log(1 + mu), x = value / white."""
    mu = 8.0 * white
    for x in (0.0, 0.01, 0.5, 1.0):
        expected = math.log(1.0 + mu * x) / math.log(1.0 + mu)
        assert float(isp.log(np.array(x * white), white)) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("value", [0.002, 0.01, 0.18, 0.5, 1.0, 3.0])
def test_srgb_is_the_standard_and_clips_at_white(value: float) -> None:
    """IEC 61966-2-1: 12.92 v below 0.0031308, else 1.055 v^(1/2.4) - 0.055; white beyond 1."""
    v = min(value, 1.0)
    expected = 12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055
    assert float(isp.display_values(np.array(value), "srgb")) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("tone", TONES)
def test_every_curve_rises_from_black_to_white_by_table_as_by_formula(tone: isp.Tone) -> None:
    """Negative noise is 0, the endless 255; over fourteen stops at most one of 255 apart."""
    values = np.concatenate([[-1.0, 0.0], np.geomspace(1e-6, 1e6, 2000), [np.inf]])
    image = np.repeat(values.astype(np.float32)[:, None, None], 3, axis=2)

    levels = isp.tone_to_bytes(image, 1.0, tone)[:, 0, 1].astype(int)

    assert (levels[0], levels[1], levels[-1]) == (0, 0, 255)
    assert (np.diff(levels) >= 0).all()

    stream = Streams(seed=3, scene=0).rng("values")
    image = (2.0 ** stream.uniform(-10.0, 4.0, (101, 64, 3))).astype(np.float32)

    table = isp.tone_to_bytes(image, 0.5, tone, white=4.0).astype(int)
    formula = isp.to_bytes(isp.display_values(0.5 * image.astype(np.float64), tone, white=4.0))

    assert np.abs(table - formula).max() <= 1
    assert (table != formula).mean() < 0.06
