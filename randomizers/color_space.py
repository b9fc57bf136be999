"""Conversion of HSV colours and colour temperatures to linear RGB."""

from __future__ import annotations

import colorsys
from typing import Annotated

import numpy as np

from gen_data.generator.config import distributions as dist
from gen_data.generator.core.colorimetry import REC709_FROM_XYZ, luminance, srgb_decode
from gen_data.generator.core.se3 import Vec3

Temperature = Annotated[dist.Scalar, dist.Bounds(1667, 25_000)]
"""Colour temperature [K] within the range of ``temperature_to_chromaticity``."""


def hsv_to_linear(hue: float, saturation: float, value: float) -> Vec3:
    """Convert hue, saturation and value in sRGB, each in [0, 1], to linear RGB."""
    red, green, blue = colorsys.hsv_to_rgb(hue % 1.0, saturation, value)
    return (round(srgb_decode(red), 6), round(srgb_decode(green), 6), round(srgb_decode(blue), 6))


def temperature_to_chromaticity(kelvin: float) -> tuple[float, float]:
    """CIE 1931 x, y of a black body between 1667 K and 25000 K.

    Source: Kim et al., "Design of advanced color temperature control system for HDTV
    applications", J. Korean Physical Society 41(6), 2002: cubic fits to the Planckian locus.
    """
    t = 1e3 / kelvin
    if kelvin <= 4000.0:
        x = -0.2661239 * t**3 - 0.2343589 * t**2 + 0.8776956 * t + 0.179910
    else:
        x = -3.0258469 * t**3 + 2.1070379 * t**2 + 0.2226347 * t + 0.240390
    if kelvin <= 2222.0:
        y = -1.1063814 * x**3 - 1.34811020 * x**2 + 2.18555832 * x - 0.20219683
    elif kelvin <= 4000.0:
        y = -0.9549476 * x**3 - 1.37418593 * x**2 + 2.09137015 * x - 0.16748867
    else:
        y = 3.0817580 * x**3 - 5.87338670 * x**2 + 3.75112997 * x - 0.37001483
    return x, y


def temperature_to_linear(kelvin: float) -> Vec3:
    """Linear sRGB with luminance 1 of a black body; negative components are clipped to 0."""
    x, y = temperature_to_chromaticity(kelvin)
    big_x, big_z = x / y, (1.0 - x - y) / y
    rgb = np.maximum((REC709_FROM_XYZ * (big_x, 1.0, big_z)).sum(axis=1), 0.0)
    red, green, blue = (round(float(part / luminance(rgb)), 6) for part in rgb)
    return (red, green, blue)
