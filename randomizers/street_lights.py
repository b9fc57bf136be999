"""Lamps along the street, and windows that are lit."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np

from gen_data.generator.config.distributions import (
    Bounds,
    Choice,
    Flag,
    LogUniform,
    Positive,
    Probability,
    Scalar,
    Uniform,
)
from gen_data.generator.core.asset_types import Keypoint, Material
from gen_data.generator.core.colorimetry import luminance
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.photometry import flux_to_intensity_cd
from gen_data.generator.core.scene import Body, Light, Scene
from gen_data.generator.core.se3 import Vec3
from gen_data.generator.core.streams import Rng
from gen_data.randomizers.base import RandomizerBase, body_materials
from gen_data.randomizers.color_space import temperature_to_linear
from gen_data.randomizers.daylight import is_dark

_WHITE_K = 3400.0
LAMP, WINDOW = "lamp", "window"
"""Roles of material slots, and the keypoint of a lamp's light."""


class StreetLights(RandomizerBase):
    """Switches on street lamps and windows when it is dark.

    Lamps are bodies whose assets have keypoints named ``lamp``; their slots of role ``lamp``
    glow. Slots of role ``window`` are lit by chance, body by body.

    Attributes:
        when: dark: when time_of_day or weather, listed before it, has put the sun below the
            horizon. always: by day, too.
        flux_lm: Luminous flux of one lamp.
        temperature_k: Of all lamps of a scene: 2300 sodium, 3000 to 4000 LED.
        cone_deg: Half angle of the cone in which a lamp sends its light down.
        broken: Whether a lamp stays dark.
        lamp_luminance_cd_m2: Of a lamp's glowing part.
        windows: Whether the windows of a body are lit.
        window_luminance_cd_m2: Of lit windows.
        window_temperature_k: Of the light in them.
    """

    type: Literal["street_lights"] = "street_lights"
    when: Literal["dark", "always"] = "dark"
    flux_lm: Positive = Uniform(4000.0, 10_000.0)
    temperature_k: Annotated[Scalar, Bounds(1667, 25_000)] = Choice(
        {2300.0: 2.0, 3000.0: 3.0, 4000.0: 2.0}
    )
    cone_deg: Annotated[Scalar, Bounds(10, 85)] = Uniform(62.0, 74.0)
    broken: Flag = Probability(0.03)
    lamp_luminance_cd_m2: Positive = LogUniform(8000.0, 30_000.0)
    windows: Flag = Probability(0.35)
    window_luminance_cd_m2: Positive = LogUniform(2.0, 20.0)
    window_temperature_k: Annotated[Scalar, Bounds(1667, 25_000)] = Uniform(2400.0, 4500.0)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """The scene with its lamps on; by day the scene as it is."""
        if self.when == "dark" and not is_dark(scene):
            return scene
        color = white_balanced_color(self.temperature_k.draw(rng))
        flux_lm, cone_rad = self.flux_lm.draw(rng), math.radians(self.cone_deg.draw(rng))
        glow = _times(color, self.lamp_luminance_cd_m2.draw(rng))
        lights, bodies = list(scene.lights), []
        for body in scene.bodies:
            roles = {material.role for material in body_materials(body, assets)}
            lamps = [k for k in assets.keypoints(body.asset) if k.name == LAMP]
            if lamps and not self.broken.draw(rng):
                lights += (
                    _lamp(f"{self.name}/{body.name}/{n}", body, lamp, flux_lm, color, cone_rad)
                    for n, lamp in enumerate(lamps)
                )
                body = _light_up(body, assets, LAMP, glow)  # noqa: PLW2901
            if WINDOW in roles and self.windows.draw(rng):
                body = _light_up(body, assets, WINDOW, self._window(rng))  # noqa: PLW2901
            bodies.append(body)
        return replace(scene, bodies=tuple(bodies), lights=tuple(lights))

    def _window(self, rng: Rng) -> Vec3:
        color = white_balanced_color(self.window_temperature_k.draw(rng))
        return _times(color, self.window_luminance_cd_m2.draw(rng))


def white_balanced_color(temperature_k: float) -> Vec3:
    """Colour of a lamp for a camera half adapted to a street at night, luminance 1.

    Images are balanced for daylight; no camera leaves it at that under sodium lamps.
    """
    lamp = temperature_to_linear(temperature_k)
    white = temperature_to_linear(_WHITE_K)
    rgb = [part / reference**0.5 for part, reference in zip(lamp, white, strict=True)]
    relative = float(luminance(np.array(rgb)))
    red, green, blue = (round(part / relative, 6) for part in rgb)
    return (red, green, blue)


def spot_intensity_cd(flux_lm: float, cone_rad: float) -> float:
    """Luminous intensity of a spot that sends a flux into a cone."""
    return flux_to_intensity_cd(Light("", "spot", cone_rad=cone_rad), flux_lm)


def _lamp(
    name: str, body: Body, lamp: Keypoint, flux_lm: float, color: Vec3, cone_rad: float
) -> Light:
    at_body = body.scale * np.asarray(lamp.position_m)
    x, y, z = (float(value) for value in body.T_world_body.apply(at_body))
    return Light(
        name,
        "spot",
        # Just below the glass, so that the lamp's housing does not shade its own light.
        position_m=(round(x, 6), round(y, 6), round(z - 0.05, 6)),
        direction=(0.0, 0.0, -1.0),
        color=color,
        intensity_cd=round(spot_intensity_cd(flux_lm, cone_rad), 3),
        radius_m=0.12,
        cone_rad=round(cone_rad, 6),
    )


def _light_up(body: Body, assets: AssetIndex, role: str, emission_cd_m2: Vec3) -> Body:
    """The body with every slot of that role lit."""

    def set_emission(material: Material) -> Material:
        return replace(material, emission_cd_m2=emission_cd_m2)

    slots = body_materials(body, assets)
    return replace(body, materials=tuple(set_emission(m) if m.role == role else m for m in slots))


def _times(color: Vec3, luminance_cd_m2: float) -> Vec3:
    red, green, blue = (round(part * luminance_cd_m2, 3) for part in color)
    return (red, green, blue)
