"""Conversion of photometric quantities of lights: luminous flux, intensity, illuminance."""

from __future__ import annotations

import math
from dataclasses import replace

from gen_data.generator.core.scene import Light


def flux_to_intensity_cd(light: Light, flux_lm: float) -> float:
    """Luminous intensity [cd] of a light with a luminous flux.

    A sphere emits in all directions, a panel into its front half space by Lambert's law, a spot
    into its cone: uniformly up to ``even`` of its half angle, then fading to 0 by a smooth step
    that is symmetric in the cosine, so that half of the solid angle in between counts.

    Raises:
        ValueError: a sun has no flux.
    """
    match light.kind:
        case "sun":
            raise ValueError("a sun has an illuminance, not a flux")
        case "sphere":
            return flux_lm / (4.0 * math.pi)
        case "spot":
            inner, outer = (1.0 - math.cos(share * light.cone_rad) for share in (light.even, 1.0))
            return flux_lm / (math.pi * (inner + outer))
        case "rectangle" | "disk":
            return flux_lm / math.pi


def illuminance_to_intensity_cd(light: Light, lux: float, distance_m: float) -> float:
    """Luminous intensity [cd] that causes an illuminance at a distance on the light's axis.

    The surface faces the light's centre, from which the distance counts; panels face the surface.
    Sources: the inverse square law; for panels, Howell, "A catalog of radiation heat transfer
    configuration factors", 1982 (a disk and a rectangle before a parallel element).
    """
    squared_m2 = distance_m * distance_m
    match light.kind:
        case "disk":
            return lux * (squared_m2 + light.radius_m * light.radius_m)
        case "rectangle":
            a, b = (0.5 * side_m for side_m in light.size_m)
            long, across = math.sqrt(squared_m2 + a * a), math.sqrt(squared_m2 + b * b)
            over_b, over_a = math.atan(b / long), math.atan(a / across)
            per_luminance = 2.0 * (a / long * over_b + b / across * over_a)
            return lux * 4.0 * a * b / per_luminance
        case "sphere" | "spot" | "sun":
            return lux * squared_m2


def luminance_cd_m2(light: Light) -> float:
    """Luminance of a panel's front [cd/m^2].

    Raises:
        ValueError: the light is not a panel.
    """
    match light.kind:
        case "rectangle":
            return light.intensity_cd / (light.size_m[0] * light.size_m[1])
        case "disk":
            return light.intensity_cd / (math.pi * light.radius_m * light.radius_m)
        case "sphere" | "spot" | "sun":
            raise ValueError(f"a light of kind {light.kind} is no panel")


def scale_to_flux(light: Light, flux_lm: float) -> Light:
    """The light with the intensity of a luminous flux."""
    return replace(light, intensity_cd=round(flux_to_intensity_cd(light, flux_lm), 4))
