"""Luminance, sRGB's transfer function and XYZ, against the standards' own numbers."""

import numpy as np
import pytest

from gen_data.core import colorimetry

D65_XYZ = (0.9505, 1.0, 1.0890)
"""White of sRGB: IEC 61966-2-1, table 1, x 0.3127 and y 0.3290."""

PRIMARIES_XY = ((0.640, 0.330), (0.300, 0.600), (0.150, 0.060))
"""ITU-R BT.709-6, item 1.3."""


def test_white_is_d65_of_luminance_one() -> None:
    """Weights add up to 1, as the middle row of the matrix to XYZ; equal parts give D65."""
    assert colorimetry.luminance(np.ones((2, 3, 3))) == pytest.approx(np.ones((2, 3)), abs=1e-15)
    assert colorimetry.XYZ_FROM_REC709[1] == pytest.approx(colorimetry.REC709_LUMINANCE, abs=0.0)
    assert colorimetry.XYZ_FROM_REC709 @ np.ones(3) == pytest.approx(D65_XYZ, abs=1e-4)
    white = colorimetry.REC709_FROM_XYZ @ D65_XYZ
    assert white == pytest.approx(np.ones(3), abs=1e-3)


@pytest.mark.parametrize("channel", range(3))
def test_primaries_have_the_chromaticities_of_the_standard(channel: int) -> None:
    """A column of the matrix is a primary."""
    xyz = colorimetry.XYZ_FROM_REC709[:, channel]

    assert xyz[:2] / xyz.sum() == pytest.approx(PRIMARIES_XY[channel], abs=2e-4)


@pytest.mark.parametrize(
    ("code", "linear"),
    # CSS Color Module Level 4 gives code 188 as about half of the light; 119 is the card of 18 %.
    [(0, 0.0), (10, 0.003035), (119, 0.1845), (188, 0.5029), (255, 1.0)],
)
def test_codes_stand_for_the_light_of_the_standard(code: int, linear: float) -> None:
    """Both ends, the linear piece, and the power."""
    decoded = colorimetry.srgb_decode(np.array([code / 255.0]))

    assert decoded == pytest.approx([linear], rel=1e-3, abs=1e-9)
    assert colorimetry.srgb_encode(decoded) * 255.0 == pytest.approx([code], abs=1e-6)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_types_are_kept_and_every_byte_survives_decoding_and_encoding(
    dtype: type[np.float32 | np.float64],
) -> None:
    """Shape [h, w, 3] gives [h, w]; each channel has its own weight."""
    codes = np.arange(256)
    again = colorimetry.srgb_encode(colorimetry.srgb_decode((codes / 255.0).astype(dtype)))

    assert again.dtype == dtype
    assert np.array_equal(np.floor(again * 255.0 + 0.5), codes)

    image = np.eye(3, dtype=dtype)[None] * np.array(100.0, dtype)

    assert colorimetry.luminance(image).dtype == dtype
    assert colorimetry.luminance(image) == pytest.approx(np.array([[21.26, 71.52, 7.22]]), rel=1e-6)


def test_a_single_value_is_decoded_as_in_an_image() -> None:
    """Code 0.5 is 21.4 % of the light; both ends and the knee stay."""
    assert colorimetry.srgb_decode(0.5) == pytest.approx(0.21404, abs=1e-5)
    assert (colorimetry.srgb_decode(0.0), colorimetry.srgb_decode(1.0)) == (0.0, 1.0)
    assert colorimetry.srgb_decode(0.04045) == pytest.approx(0.0031308, abs=1e-7)


def test_constants_cannot_be_changed() -> None:
    """They are shared by the whole program."""
    with pytest.raises(ValueError, match="read-only"):
        colorimetry.REC709_LUMINANCE[0] = 1.0
