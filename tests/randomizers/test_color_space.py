"""Colours that people name, against tables."""

import pytest

from gen_data.core.colorimetry import temperature_to_chromaticity
from gen_data.randomizers.color_space import hsv_to_linear, temperature_to_linear

PLANCKIAN_XY = {
    2000: (0.5267, 0.4133), 2856: (0.4476, 0.4075), 3000: (0.4369, 0.4041), 4000: (0.3805, 0.3768),
    5000: (0.3451, 0.3516), 6500: (0.3135, 0.3237), 10000: (0.2807, 0.2884),
}  # fmt: skip
"""CIE 1931 chromaticities of a black body: Wyszecki and Stiles, "Color science", 1982; 2856 K is
illuminant A of CIE 15."""

XYZ_OF_SRGB = (
    (0.4124564, 0.3575761, 0.1804375),
    (0.2126729, 0.7151522, 0.0721750),
    (0.0193339, 0.1191920, 0.9503041),
)
"""Linear sRGB to XYZ, white D65 (Lindbloom, "RGB working space information")."""


@pytest.mark.parametrize("kelvin", PLANCKIAN_XY)
def test_chromaticity_is_that_of_the_tables(kelvin: int) -> None:
    """Within 0.001 in x and y: less than a just noticeable difference."""
    assert temperature_to_chromaticity(kelvin) == pytest.approx(PLANCKIAN_XY[kelvin], abs=1e-3)


@pytest.mark.parametrize("kelvin", [k for k in PLANCKIAN_XY if k > 2000])
def test_linear_rgb_has_the_chromaticity_and_luminance_one(kelvin: int) -> None:
    """Back through the matrix of sRGB."""
    rgb = temperature_to_linear(kelvin)
    big_x, big_y, big_z = (sum(a * v for a, v in zip(row, rgb, strict=True)) for row in XYZ_OF_SRGB)

    assert big_y == pytest.approx(1.0, abs=1e-3)
    xy = (big_x / (big_x + big_y + big_z), big_y / (big_x + big_y + big_z))
    assert xy == pytest.approx(PLANCKIAN_XY[kelvin], abs=1.5e-3)


def test_candles_are_red_skies_blue_and_hues_turn_through_the_primaries() -> None:
    """No channel is negative where the gamut ends; no saturation is grey."""
    candle, sky = temperature_to_linear(1700.0), temperature_to_linear(12000.0)

    assert candle[0] > candle[1] > candle[2] >= 0.0
    assert sky[2] > sky[1] > sky[0] > 0.0

    assert hsv_to_linear(0.0, 1.0, 1.0) == (1.0, 0.0, 0.0)
    assert hsv_to_linear(1 / 3, 1.0, 1.0) == pytest.approx((0.0, 1.0, 0.0), abs=1e-6)
    assert hsv_to_linear(2 / 3, 1.0, 1.0) == pytest.approx((0.0, 0.0, 1.0), abs=1e-6)
    assert hsv_to_linear(0.7, 0.0, 0.5) == pytest.approx((0.21404,) * 3, abs=1e-5)
