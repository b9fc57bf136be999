"""Result type of mesh readers, and conversions that formats share."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from gen_data.generator.assets.triangle_soup import TriangleSoup
from gen_data.generator.core.colorimetry import srgb_decode
from gen_data.generator.core.errors import AssetError
from gen_data.generator.core.se3 import Vec3

MAX_FACES = 5_000_000
EVEN = 3.0
"""Image channels with a smaller standard deviation [1/255] count as uniform."""


@dataclass(frozen=True, eq=False)
class MeshSource:
    """Content of a mesh file.

    Attributes:
        soup: Its triangles. ``Material.texture`` is an image's path relative to the folder, or a
            key of ``images``.
        images: ``{key: encoded image}`` of images inside the file itself.
        up: Axis that the file states as up, ``x``, ``y`` or ``z``; empty = it states none.
    """

    soup: TriangleSoup
    images: Mapping[str, bytes] = field(default_factory=dict)
    up: str = ""


def check_face_count(count: int, place: str) -> None:
    """Raise AssetError if a file has more than ``MAX_FACES`` triangles."""
    if count > MAX_FACES:
        raise AssetError(f"{place}: {count} triangles, at most {MAX_FACES}; decimate it")


def fraction(value: object, name: str) -> float:
    """Parse a number in [0, 1]. Raises ValueError with its name if it is out of range."""
    number = _parse_number(value, name)
    # Exporters round: tolerate values slightly outside.
    if not -1e-4 <= number <= 1.0 + 1e-4:
        raise ValueError(f"{name} is {number:g}, not in [0, 1]")
    return min(max(number, 0.0), 1.0)


def clamp_min(low: float, value: object, name: str) -> float:
    """Parse a finite number of at least ``low``. Raises ValueError with its name otherwise."""
    number = _parse_number(value, name)
    if not low - 1e-6 <= number < math.inf:
        raise ValueError(f"{name} is {number:g}, not a number of at least {low:g}")
    return max(number, low)


def _parse_number(value: object, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise ValueError(f"{name} is not a number")
    return float(value)


def srgb_to_linear(color: Vec3) -> Vec3:
    """Convert sRGB in [0, 1] to linear RGB (IEC 61966-2-1)."""
    red, green, blue = (_linear(min(max(c, 0.0), 1.0)) for c in color)
    return (red, green, blue)


def shininess_to_roughness(exponent: float) -> float:
    """Perceptual roughness of a Blinn-Phong exponent.

    Source: Walter et al., "Microfacet models for refraction through rough surfaces", EGSR 2007:
    alpha = sqrt(2 / (n + 2)); perceptual roughness is the root of alpha (Burley 2012).
    """
    return round(math.pow(2.0 / (max(exponent, 0.0) + 2.0), 0.25), 4)


def _linear(c: float) -> float:
    # Rounded, because pow() may differ in the last bit between C libraries.
    return round(srgb_decode(float(c)), 6)
