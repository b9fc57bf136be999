"""Lamps and the sun."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Literal

from generator.config.distributions import (
    Bounds,
    Constant,
    Count,
    LogUniform,
    Name,
    NonNegative,
    Positive,
    Scalar,
    Uniform,
    UniformInteger,
)
from generator.core.errors import ConfigError, LayoutRejected, Rejection, did_you_mean
from generator.core.interfaces import AssetIndex
from generator.core.scene import Light, Scene
from generator.core.se3 import Vec3
from generator.core.streams import Rng
from randomizers.base import RandomizerBase
from randomizers.clearance import is_in_the_open, is_inside
from randomizers.color_space import linear_of_temperature

TRIES = 24
KINDS = ("sphere", "spot", "sun")
MARGIN_M = 0.05
"""The ball of a lamp keeps this far from bodies."""


class Lighting(RandomizerBase):
    """Draws all lights anew, each aimed at what the scene is about.

    Attributes:
        count: How many lights.
        kind: sphere, spot or sun.
        illuminance_lux: Of all lights together, on a surface at the focus that faces them.
        distance_m: From the focus; shortened where the room ends.
        elevation_deg: Height over the horizon, seen from the focus.
        azimuth_deg: Direction around the vertical, seen from the focus.
        temperature_k: Colour temperature: 2700 is warm white, 6500 daylight.
        radius_m: Of the luminous ball: the larger, the softer its shadows.
        cone_deg: Half angle of a spot.
        angular_radius_deg: Of the sun's disc.
    """

    type: Literal["lighting"] = "lighting"
    count: Count = UniformInteger(1, 3)
    kind: Name = Constant("sphere")
    illuminance_lux: NonNegative = LogUniform(250.0, 1200.0)
    distance_m: Positive = Uniform(1.0, 1.9)
    elevation_deg: Annotated[Scalar, Bounds(-90, 90)] = Uniform(35.0, 80.0)
    azimuth_deg: Scalar = Uniform(0.0, 360.0)
    temperature_k: Annotated[Scalar, Bounds(1667, 25000)] = Uniform(2700.0, 6500.0)
    radius_m: NonNegative = Uniform(0.02, 0.12)
    cone_deg: Annotated[Scalar, Bounds(1, 90)] = Uniform(20.0, 40.0)
    angular_radius_deg: Annotated[Scalar, Bounds(0, 20)] = Constant(0.27)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """The scene under other lights; they share the illuminance unevenly."""
        count = self.count.draw(rng)
        shares = [0.3 + float(rng.uniform()) for _ in range(count)]
        total_lux = self.illuminance_lux.draw(rng)
        lights = tuple(
            self._light(scene, assets, rng, f"{self.name}/{k}", total_lux * share / sum(shares))
            for k, share in enumerate(shares)
        )
        return replace(scene, lights=lights)

    def _light(self, scene: Scene, assets: AssetIndex, rng: Rng, name: str, lux: float) -> Light:
        kind = self.kind.draw(rng)
        if kind not in KINDS:
            raise ConfigError(
                f"randomizers.{self.name}.kind: unknown light '{kind}'; expected one of "
                f"{', '.join(KINDS)}{did_you_mean(kind, KINDS)}"
            )
        color = linear_of_temperature(self.temperature_k.draw(rng))
        target = scene.focus.center_m
        if kind == "sun":
            up = self._direction(rng)
            return Light(
                name,
                "sun",
                direction=_rounded((-up[0], -up[1], -up[2])),
                color=color,
                illuminance_lux=round(lux, 4),
                angular_radius_rad=round(math.radians(self.angular_radius_deg.draw(rng)), 6),
            )
        radius_m = round(self.radius_m.draw(rng), 4)
        position = self._position(scene, assets, rng, radius_m + MARGIN_M)
        away = (position[0] - target[0], position[1] - target[1], position[2] - target[2])
        squared_m2 = away[0] ** 2 + away[1] ** 2 + away[2] ** 2
        distance_m = math.sqrt(squared_m2)
        return Light(
            name,
            "spot" if kind == "spot" else "sphere",
            position_m=position,
            direction=_rounded(
                (-away[0] / distance_m, -away[1] / distance_m, -away[2] / distance_m)
            ),
            color=color,
            # Photometric inverse square law: E = I / d^2 on a surface that faces the lamp.
            intensity_cd=round(lux * squared_m2, 4),
            radius_m=radius_m,
            cone_rad=round(math.radians(self.cone_deg.draw(rng)), 6),
        )

    def _direction(self, rng: Rng) -> Vec3:
        elevation = math.radians(self.elevation_deg.draw(rng))
        azimuth = math.radians(self.azimuth_deg.draw(rng))
        level = math.cos(elevation)
        return (level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation))

    def _position(self, scene: Scene, assets: AssetIndex, rng: Rng, margin_m: float) -> Vec3:
        x, y, z = scene.focus.center_m
        for _ in range(TRIES):
            dx, dy, dz = self._direction(rng)
            distance_m = self.distance_m.draw(rng)
            for shortened in (1.0, 0.85, 0.7, 0.55):
                d = shortened * distance_m
                position = _rounded((x + d * dx, y + d * dy, z + d * dz))
                if is_inside(position, *scene.interior_m):
                    if is_in_the_open(position, scene, assets, margin_m):
                        return position
                    break
        raise LayoutRejected(
            Rejection(
                "no free place for a light",
                f"other distance_m, elevation_deg or azimuth_deg (randomizers.{self.name})",
            )
        )


def _rounded(vector: Vec3) -> Vec3:
    return (round(vector[0], 6), round(vector[1], 6), round(vector[2], 6))
