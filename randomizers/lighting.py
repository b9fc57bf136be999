"""Lights aimed at the scene's focus: lamps, panels and suns."""

import math
from dataclasses import replace
from typing import Annotated, Literal

from pydantic import Field, model_validator

from gen_data.config import distributions as dist
from gen_data.core import errors, photometry
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import LIGHT_KINDS, PANEL_KINDS, Light, LightKind, Scene
from gen_data.core.se3 import Vec3
from gen_data.core.streams import Rng
from gen_data.randomizers.base import RandomizerBase
from gen_data.randomizers.color_space import Temperature, temperature_to_linear
from gen_data.randomizers.free_space import is_in_the_open, is_inside

TRIES = 24
COUNT_MAX = 64
"""Shading time grows with every light."""
MARGIN_M = 0.05
"""Smallest distance of a lamp from any body."""


class Lighting(RandomizerBase):
    """Replaces the lights by drawn ones, each aimed at the scene's focus.

    Attributes:
        count: Number of lights.
        kind: sphere, spot or sun; rectangle or disk: a panel facing the focus, such as a softbox.
        illuminance_lux: Illuminance from all lights together, on a surface at the focus that faces
            them.
        luminous_flux_lm: Flux of all lights together, instead of an illuminance; not for suns.
        distance_m: Distance from the focus; shortened to stay inside the room.
        elevation_deg: Angle above the horizon, seen from the focus.
        azimuth_deg: Angle around the vertical, seen from the focus.
        temperature_k: Colour temperature: 2700 warm white, 6500 daylight.
        radius_m: Radius of a sphere or disk: the larger, the softer the shadows.
        width_m: Longer side of a rectangle.
        panel_aspect: Ratio of a rectangle's shorter side to its longer side.
        visible: Whether panels appear in images, as housings with a bright front.
        cone_deg: Half angle of a spot.
        angular_radius_deg: Angular radius of the sun's disc.
        keep_existing: Whether to keep the lights already in the scene.
    """

    type: Literal["lighting"] = "lighting"
    count: Annotated[dist.Count, dist.Bounds(0, COUNT_MAX)] = dist.UniformInteger(1, 3)
    kind: Annotated[dist.Name, dist.OneOf(LIGHT_KINDS)] = dist.Constant("sphere")
    illuminance_lux: dist.NonNegative = dist.LogUniform(250.0, 1200.0)
    luminous_flux_lm: dist.NonNegative | None = Field(None)
    distance_m: dist.Positive = dist.Uniform(1.0, 1.9)
    elevation_deg: Annotated[dist.Scalar, dist.Bounds(-90, 90)] = dist.Uniform(35.0, 80.0)
    azimuth_deg: dist.Scalar = dist.Uniform(0.0, 360.0)
    temperature_k: Temperature = dist.Uniform(2700.0, 6500.0)
    radius_m: dist.NonNegative = dist.Uniform(0.02, 0.12)
    width_m: dist.Positive = dist.Uniform(0.4, 1.0)
    panel_aspect: dist.UnitInterval = dist.Uniform(0.5, 1.0)
    visible: bool = False
    cone_deg: Annotated[dist.Scalar, dist.Bounds(1, 90)] = dist.Uniform(20.0, 40.0)
    angular_radius_deg: Annotated[dist.Scalar, dist.Bounds(0, 20)] = dist.Constant(0.27)
    keep_existing: bool = False

    @model_validator(mode="after")
    def _has_one_strength(self) -> "Lighting":
        if self.luminous_flux_lm is not None and "illuminance_lux" in self.model_fields_set:
            raise ValueError("illuminance_lux and luminous_flux_lm exclude each other")
        low = self.panel_aspect.support()[0]
        if low <= 0.0:
            raise ValueError("panel_aspect must be above 0")
        return self

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene with its lights replaced; the total is split unevenly between them."""
        count = self.count.draw(rng)
        shares = [0.3 + float(rng.uniform()) for _ in range(count)]
        strength = self.illuminance_lux if self.luminous_flux_lm is None else self.luminous_flux_lm
        total = strength.draw(rng)
        scene = scene if self.keep_existing else photometry.remove_lights(scene)
        for k, share in enumerate(shares):
            light = self._draw_light(
                scene, assets, rng, f"{self.name}/{k}", total * share / sum(shares)
            )
            if self.visible and light.kind in PANEL_KINDS:
                materials = assets.materials(photometry.fixture_asset(light))
                scene, light = photometry.add_fixture(scene, light, materials)
            scene = replace(scene, lights=(*scene.lights, light))
        return scene

    def _draw_light(
        self, scene: Scene, assets: AssetIndex, rng: Rng, name: str, strength: float
    ) -> Light:
        light = Light(name, self._draw_kind(rng))
        light = replace(light, color=temperature_to_linear(self.temperature_k.draw(rng)))
        if light.kind == "sun":
            up = self._draw_direction(rng)
            return replace(
                light,
                direction=_round_vector((-up[0], -up[1], -up[2])),
                illuminance_lux=round(strength, 4),
                angular_radius_rad=round(math.radians(self.angular_radius_deg.draw(rng)), 6),
            )
        light, reach_m = self._draw_size(light, rng)
        position = self._draw_position(scene, assets, rng, reach_m + MARGIN_M)
        light = _aim(light, position, scene.focus.center_m)
        if light.kind not in PANEL_KINDS:
            light = replace(light, cone_rad=round(math.radians(self.cone_deg.draw(rng)), 6))
        return self._set_intensity(light, strength, math.dist(position, scene.focus.center_m))

    def _draw_size(self, light: Light, rng: Rng) -> tuple[Light, float]:
        """Draw a light's size; also return its largest extent from the centre [m]."""
        if light.kind != "rectangle":
            radius_m = round(self.radius_m.draw(rng), 4)
            return replace(light, radius_m=radius_m), radius_m
        longer_m = self.width_m.draw(rng)
        sides_m = round(longer_m, 4), round(longer_m * self.panel_aspect.draw(rng), 4)
        return replace(light, size_m=sides_m), 0.5 * math.hypot(*sides_m)

    def _draw_kind(self, rng: Rng) -> LightKind:
        drawn = self.kind.draw(rng)
        kind = next(known for known in LIGHT_KINDS if known == drawn)
        if kind == "sun" and self.luminous_flux_lm is not None:
            raise errors.ConfigError(
                f"randomizers.{self.name}.luminous_flux_lm: a sun has no flux; give an "
                "illuminance_lux or another kind"
            )
        return kind

    def _set_intensity(self, light: Light, strength: float, distance_m: float) -> Light:
        """Return the light with its share of the illuminance at the focus or of the flux."""
        if self.luminous_flux_lm is None:
            intensity_cd = photometry.illuminance_to_intensity_cd(light, strength, distance_m)
        else:
            intensity_cd = photometry.flux_to_intensity_cd(light, strength)
        return replace(light, intensity_cd=round(intensity_cd, 4))

    def _draw_direction(self, rng: Rng) -> Vec3:
        elevation = math.radians(self.elevation_deg.draw(rng))
        azimuth = math.radians(self.azimuth_deg.draw(rng))
        level = math.cos(elevation)
        return (level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation))

    def _draw_position(self, scene: Scene, assets: AssetIndex, rng: Rng, margin_m: float) -> Vec3:
        x, y, z = scene.focus.center_m
        for _ in range(TRIES):
            dx, dy, dz = self._draw_direction(rng)
            distance_m = self.distance_m.draw(rng)
            for shortened in (1.0, 0.85, 0.7, 0.55):
                d = shortened * distance_m
                position = _round_vector((x + d * dx, y + d * dy, z + d * dz))
                if is_inside(position, *scene.interior_m):
                    if is_in_the_open(position, scene, assets, margin_m):
                        return position
                    break
        remedy = "other distance_m, elevation_deg or azimuth_deg"
        raise self.reject("no free place for a light", remedy)


def _aim(light: Light, position_m: Vec3, target_m: Vec3) -> Light:
    """Return the light at a position, aimed at a target; rectangles have a level side."""
    away = [p - t for p, t in zip(position_m, target_m, strict=True)]
    distance_m = math.sqrt(away[0] ** 2 + away[1] ** 2 + away[2] ** 2)
    direction = _round_vector((-away[0] / distance_m, -away[1] / distance_m, -away[2] / distance_m))
    side = photometry.level_side(direction) if light.kind == "rectangle" else light.side
    return replace(light, position_m=position_m, direction=direction, side=side)


def _round_vector(vector: Vec3) -> Vec3:
    return (round(vector[0], 6), round(vector[1], 6), round(vector[2], 6))
