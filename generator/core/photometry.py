"""Photometry of lights: flux, intensity, illuminance; panels and the visible fixtures they have."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gen_data.core.asset_types import Material
from gen_data.core.scene import PANEL_KINDS, Body, Light, Scene
from gen_data.core.se3 import SE3, Vec3


def flux_to_intensity_cd(light: Light, flux_lm: float) -> float:
    """Luminous intensity [cd] of a light with a luminous flux.

    A sphere emits in all directions, a panel into its front half space by Lambert's law, a spot
    into its cone: uniformly up to ``even`` of its half angle, then fading to 0 by a smooth step
    that is symmetric in the cosine, so half of the solid angle in between counts.

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
    """Luminance of a panel's front [cd/m^2]. Raises ValueError if the light is not a panel."""
    match light.kind:
        case "rectangle":
            return light.intensity_cd / (light.size_m[0] * light.size_m[1])
        case "disk":
            return light.intensity_cd / (math.pi * light.radius_m * light.radius_m)
        case "sphere" | "spot" | "sun":
            raise ValueError(f"a light of kind {light.kind} is not a panel")


def scale_to_flux(light: Light, flux_lm: float) -> Light:
    """The light with the intensity of a luminous flux."""
    return replace(light, intensity_cd=round(flux_to_intensity_cd(light, flux_lm), 4))


GAP_M = 1e-3
"""Distance of a panel in front of its fixture, to keep the fixture from shadowing it."""
LAMP = "lamp"
"""Role of the emissive slots of a fixture."""


def level_side(direction: Vec3) -> Vec3:
    """The horizontal unit vector perpendicular to a direction; X for vertical directions."""
    x, y, _ = direction
    level = math.hypot(x, y)
    if level < 1e-6:
        return (1.0, 0.0, 0.0)
    return (round(-y / level, 6), round(x / level, 6), 0.0)


def fixture_asset(light: Light) -> str:
    """Asset id of a panel's fixture."""
    if light.kind == "disk":
        diameter_m = round(2.0 * light.radius_m, 6)
        return f"light_panel?shape=disk&size_m={diameter_m:g},{diameter_m:g}"
    return f"light_panel?size_m={light.size_m[0]:g},{light.size_m[1]:g}"


def add_fixture(scene: Scene, light: Light, materials: Sequence[Material]) -> tuple[Scene, Light]:
    """Add the fixture of a panel to a scene; return the scene and the panel attached to it.

    The fixture is background: it has no instance and does not collide. ``materials`` are materials
    of
    ``fixture_asset(light)``; slots with the role ``lamp`` become emissive.
    """
    z = -np.asarray(light.direction, dtype=np.float64)
    x = np.asarray(light.side if light.kind == "rectangle" else level_side(light.direction))
    x = x - z * float((x * z).sum())
    x = x / math.sqrt(float((x * x).sum()))
    rotation = np.stack([x, np.cross(z, x), z], axis=1)
    position = np.asarray(light.position_m) + GAP_M * z
    red, green, blue = (round(c * luminance_cd_m2(light), 4) for c in light.color)
    emissive = tuple(
        replace(m, emission_cd_m2=(red, green, blue)) if m.role == LAMP else m for m in materials
    )
    pose = SE3.from_rotation(rotation, position).rounded()
    body = Body(light.name, fixture_asset(light), pose, collides=False, materials=emissive)
    return replace(scene, bodies=(*scene.bodies, body)), replace(light, body=light.name)


def remove_lights(scene: Scene) -> Scene:
    """The scene without lights and fixtures."""
    fixtures = {light.body for light in scene.lights if light.kind in PANEL_KINDS and light.body}
    bodies = tuple(b for b in scene.bodies if b.name not in fixtures or b.instance_id)
    return replace(scene, lights=(), bodies=bodies)
