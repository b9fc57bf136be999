"""Colours as numbers: linear RGB with the primaries of Rec. 709 and white D65, which are sRGB's.

Sources: ITU-R BT.709-6, 2015 (luminance); IEC 61966-2-1:1999, the standard of sRGB (transfer
function; both matrices with the four digits that it prints, which undo one another to within 1e-3).
"""

from collections.abc import Sequence
from typing import Any, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from gen_data.core.se3 import Array

Real = TypeVar("Real", bound=np.floating[Any])

REC709_LUMINANCE: Array = np.array([0.2126, 0.7152, 0.0722])
"""Luminances of the primaries, in units of white's."""

MIDDLE_GREY = 0.18
"""Reflectance of a grey card, to which cameras meter, relative to the white that saturates."""

XYZ_FROM_REC709: Array = np.array(
    [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
)
"""CIE 1931 XYZ (white D65, Y 1) of linear RGB: ``xyz = XYZ_FROM_REC709 @ rgb``."""

REC709_FROM_XYZ: Array = np.array(
    [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
)
"""Linear RGB of CIE 1931 XYZ (white D65, Y 1): ``rgb = REC709_FROM_XYZ @ xyz``."""

REC709_CHROMATICITIES: Array = np.array([0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290])
"""CIE 1931 x and y of red, green, blue and white."""

_CONES_FROM_XYZ: Array = np.array(
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]
)
"""Bradford's matrix: Lam, doctoral thesis, University of Bradford, 1985."""

for _constant in (
    REC709_CHROMATICITIES,
    _CONES_FROM_XYZ,
    REC709_LUMINANCE,
    XYZ_FROM_REC709,
    REC709_FROM_XYZ,
):
    _constant.setflags(write=False)

_RED, _GREEN, _BLUE = (float(weight) for weight in REC709_LUMINANCE)
# The two pieces of sRGB's transfer function meet here: linear, and encoded.
_KNEE_LINEAR, _KNEE_ENCODED = 0.0031308, 0.04045


def luminance(rgb: NDArray[Real]) -> NDArray[Real]:
    """Luminance [...] of linear RGB [..., 3], of its type (float32 or float64) and in its unit."""
    # Channel by channel: three times as fast as a reduction over a short last axis, and, unlike a
    # matrix product, added up in the same order on every processor.
    total: NDArray[Real] = rgb[..., 0] * _RED + rgb[..., 1] * _GREEN + rgb[..., 2] * _BLUE
    return total


def rec709_from_primaries(chromaticities: Sequence[float]) -> Array:
    """Matrix [3, 3] from linear RGB of other primaries to Rec. 709, white to white.

    Args:
        chromaticities: CIE 1931 x and y of red, green, blue and white.

    Sources: SMPTE RP 177:1993 (primaries); ICC.1:2022, annex E (adaptation by Bradford's matrix).
    """
    columns, white = _primaries(chromaticities)
    own_columns, own_white = _primaries(REC709_CHROMATICITIES)
    gains = (_CONES_FROM_XYZ @ own_white) / (_CONES_FROM_XYZ @ white)
    adapted = np.linalg.solve(_CONES_FROM_XYZ, gains[:, None] * (_CONES_FROM_XYZ @ columns))
    matrix: Array = np.linalg.solve(own_columns, adapted)
    return matrix


def _primaries(chromaticities: Sequence[float] | Array) -> tuple[Array, Array]:
    """XYZ of full red, green and blue as columns [3, 3], and of white [3], whose Y is 1."""
    x, y = np.reshape(np.asarray(chromaticities, np.float64), (4, 2)).T
    xyz = np.stack([x, y, 1.0 - x - y])
    white = xyz[:, 3] / xyz[1, 3]
    return xyz[:, :3] * np.linalg.solve(xyz[:, :3], white), white


def srgb_encode(linear: NDArray[Real]) -> NDArray[Real]:
    """The encoded values of linear ones, both in [0, 1]; shape and type stay."""
    # Clamped, because the power is evaluated below the knee too, where it is not used.
    power = 1.055 * np.maximum(linear, _KNEE_LINEAR) ** (1.0 / 2.4) - 0.055
    encoded: NDArray[Real] = np.where(linear <= _KNEE_LINEAR, 12.92 * linear, power)
    return encoded


@overload
def srgb_decode(encoded: float) -> float: ...
@overload
def srgb_decode(encoded: NDArray[Real]) -> NDArray[Real]: ...
def srgb_decode(encoded: float | NDArray[Real]) -> float | NDArray[Real]:
    """The linear values of encoded ones, both in [0, 1]; shape and type stay."""
    if isinstance(encoded, float):
        # By the C library: numpy's pow() of arrays depends on the processor in its last bit, and
        # single colours are recorded with all their digits.
        return encoded / 12.92 if encoded <= _KNEE_ENCODED else ((encoded + 0.055) / 1.055) ** 2.4
    power = ((np.maximum(encoded, 0.0) + 0.055) / 1.055) ** 2.4
    linear: NDArray[Real] = np.where(encoded <= _KNEE_ENCODED, encoded / 12.92, power)
    return linear


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
