"""Street lamps and lit windows at night."""

import math
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np

from gen_data.config import distributions as dist
from gen_data.core import asset_types, colorimetry, interfaces
from gen_data.core.photometry import flux_to_intensity_cd
from gen_data.core.scene import Body, Light, Scene
from gen_data.core.se3 import Vec3
from gen_data.core.streams import Rng
from gen_data.randomizers import color_space, daylight
from gen_data.randomizers.base import RandomizerBase, body_materials, scale_emission, set_emission

_WHITE_K = 3400.0
_EVEN = 0.5
"""Share of a lamp's cone in which it is uniform: luminaires have no sharp edge on facades."""
LAMP, WINDOW = "lamp", "window"
"""Roles of material slots, and the keypoint of a lamp's light."""


class StreetLights(RandomizerBase):
    """Switches on street lamps and windows in the dark.

    Street lamps are bodies whose assets have keypoints named ``lamp``; their material slots of
    role ``lamp`` emit light. Slots of role ``window`` are lit per body.

    Attributes:
        when: dark: only while the sun is below the horizon; list time_of_day or weather before
            this randomizer. always: also by day.
        flux_lm: Luminous flux of one lamp.
        temperature_k: Colour temperature of all lamps of a scene: 2300 sodium, 3000 to 4000 LED.
        cone_deg: Half angle at which a lamp's light has faded; it does so from half of it on.
        broken: Whether a lamp is dark.
        lamp_luminance_cd_m2: Luminance of a lamp's emitting surface.
        windows: Whether windows of a body are lit; its texture defines which.
        window_luminance_cd_m2: Luminance of lit windows.
        window_temperature_k: Colour temperature of lit windows.
    """

    type: Literal["street_lights"] = "street_lights"
    when: Literal["dark", "always"] = "dark"
    flux_lm: dist.Positive = dist.Uniform(4000.0, 10_000.0)
    temperature_k: color_space.Temperature = dist.Choice({2300.0: 2.0, 3000.0: 3.0, 4000.0: 2.0})
    cone_deg: Annotated[dist.Scalar, dist.Bounds(10, 88)] = dist.Uniform(76.0, 86.0)
    broken: dist.Flag = dist.Probability(0.03)
    lamp_luminance_cd_m2: dist.Positive = dist.LogUniform(8000.0, 30_000.0)
    windows: dist.Flag = dist.Probability(0.85)
    window_luminance_cd_m2: dist.Positive = dist.LogUniform(2.0, 20.0)
    window_temperature_k: color_space.Temperature = dist.Uniform(2400.0, 4500.0)

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: Rng) -> Scene:
        """Return the scene with its lamps on; the same scene by day."""
        if self.when == "dark" and not daylight.is_dark(scene):
            return scene
        color = white_balanced_color(self.temperature_k.draw(rng))
        flux_lm, cone_rad = self.flux_lm.draw(rng), math.radians(self.cone_deg.draw(rng))
        glow = scale_emission(color, self.lamp_luminance_cd_m2.draw(rng))
        lights, bodies = list(scene.lights), []
        for body in scene.bodies:
            roles = {material.role for material in body_materials(body, assets)}
            lamps = [k for k in assets.keypoints(body.asset) if k.name == LAMP]
            if lamps and not self.broken.draw(rng):
                lights += (
                    _make_lamp(f"{self.name}/{body.name}/{n}", body, lamp, flux_lm, color, cone_rad)
                    for n, lamp in enumerate(lamps)
                )
                body = set_emission(body, assets, {LAMP: glow})  # noqa: PLW2901
            if WINDOW in roles and self.windows.draw(rng):
                body = set_emission(body, assets, {WINDOW: self._draw_window(rng)})  # noqa: PLW2901
            bodies.append(body)
        return replace(scene, bodies=tuple(bodies), lights=tuple(lights))

    def _draw_window(self, rng: Rng) -> Vec3:
        color = white_balanced_color(self.window_temperature_k.draw(rng))
        return scale_emission(color, self.window_luminance_cd_m2.draw(rng))


def white_balanced_color(temperature_k: float) -> Vec3:
    """Linear RGB of a lamp, luminance 1, with the white balance halfway adapted to street light.

    Images are balanced for daylight, but cameras partly adapt to the light of sodium lamps.
    """
    lamp = color_space.temperature_to_linear(temperature_k)
    white = color_space.temperature_to_linear(_WHITE_K)
    rgb = [part / reference**0.5 for part, reference in zip(lamp, white, strict=True)]
    relative = float(colorimetry.luminance(np.array(rgb)))
    red, green, blue = (round(part / relative, 6) for part in rgb)
    return (red, green, blue)


def spot_intensity_cd(flux_lm: float, cone_rad: float) -> float:
    """Luminous intensity of a spot with a flux and the half angle of its cone."""
    return flux_to_intensity_cd(Light("", "spot", cone_rad=cone_rad, even=_EVEN), flux_lm)


def _make_lamp(
    name: str, body: Body, lamp: asset_types.Keypoint, flux_lm: float, color: Vec3, cone_rad: float
) -> Light:
    at_body = body.scale * np.asarray(lamp.position_m)
    x, y, z = (float(value) for value in body.T_world_body.apply(at_body))
    return Light(
        name,
        "spot",
        # Just below the glass: the lamp's housing must not shade its own light.
        position_m=(round(x, 6), round(y, 6), round(z - 0.05, 6)),
        direction=(0.0, 0.0, -1.0),
        color=color,
        intensity_cd=round(spot_intensity_cd(flux_lm, cone_rad), 3),
        radius_m=0.12,
        cone_rad=round(cone_rad, 6),
        even=_EVEN,
    )
