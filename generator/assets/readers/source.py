"""What a reader hands on, and the conversions that formats share."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from generator.assets.soup import Soup
from generator.core.se3 import Vec3

MAX_FACES = 5_000_000


@dataclass(frozen=True, eq=False)
class Source:
    """A mesh file.

    Attributes:
        soup: Its triangles. ``Material.texture`` is an image's path relative to the folder, or a
            key of ``images``.
        images: ``{key: encoded image}`` of images inside the file itself.
    """

    soup: Soup
    images: Mapping[str, bytes] = field(default_factory=dict)


def linear_of_srgb(color: Vec3) -> Vec3:
    """Linear RGB of sRGB in [0, 1] (IEC 61966-2-1)."""
    red, green, blue = (_linear(min(max(c, 0.0), 1.0)) for c in color)
    return (red, green, blue)


def roughness_of_shininess(exponent: float) -> float:
    """Perceptual roughness of a Blinn-Phong exponent.

    Source: Walter et al., "Microfacet models for refraction through rough surfaces", EGSR 2007:
    alpha = sqrt(2 / (n + 2)); perceptual roughness is the root of alpha (Burley 2012).
    """
    return round(math.pow(2.0 / (max(exponent, 0.0) + 2.0), 0.25), 4)


def _linear(c: float) -> float:
    # Rounded, because pow() may differ in the last bit between C libraries.
    linear = c / 12.92 if c <= 0.04045 else math.pow((c + 0.055) / 1.055, 2.4)
    return round(linear, 6)
