"""Conversion of HSV colours and colour temperatures to linear RGB."""

import colorsys
from typing import Annotated

import numpy as np

from gen_data.config import distributions as dist
from gen_data.core import colorimetry, se3

Temperature = Annotated[dist.Scalar, dist.Bounds(1667, 25_000)]
"""Colour temperature [K] within the range of ``temperature_to_chromaticity``."""


def hsv_to_linear(hue: float, saturation: float, value: float) -> se3.Vec3:
    """Convert hue, saturation and value in sRGB, each in [0, 1], to linear RGB."""
    red, green, blue = colorsys.hsv_to_rgb(hue % 1.0, saturation, value)
    return (
        round(colorimetry.srgb_decode(red), 6),
        round(colorimetry.srgb_decode(green), 6),
        round(colorimetry.srgb_decode(blue), 6),
    )


def temperature_to_linear(kelvin: float) -> se3.Vec3:
    """Linear sRGB with luminance 1 of a black body; negative components are clipped to 0."""
    x, y = colorimetry.temperature_to_chromaticity(kelvin)
    big_x, big_z = x / y, (1.0 - x - y) / y
    rgb = np.maximum((colorimetry.REC709_FROM_XYZ * (big_x, 1.0, big_z)).sum(axis=1), 0.0)
    red, green, blue = (round(float(part / colorimetry.luminance(rgb)), 6) for part in rgb)
    return (red, green, blue)
