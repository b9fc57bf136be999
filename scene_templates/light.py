"""Lights at fixed positions."""

import math
from dataclasses import replace
from typing import Literal

from pydantic import Field, model_validator

from gen_data.core import interfaces, photometry, se3
from gen_data.core.scene import PANEL_KINDS, LampKind, Light, Scene
from gen_data.scene_templates.element import Element


class LightElement(Element):
    """A light at a fixed position; the ``lighting`` randomizer replaces all lights.

    Attributes:
        kind: sphere, spot, or a one-sided panel: rectangle or disk.
        position_m: Centre in the world.
        direction: Direction of a spot or a panel; any length.
        intensity_cd: Luminous intensity, of panels along their normal; 1 cd illuminates a surface
            at 1 m with 1 lx.
        luminous_flux_lm: Total luminous flux, instead of ``intensity_cd``.
        radius_m: Radius of a sphere or disk: the larger, the softer the shadows.
        size_m: Sides of a rectangle; the first is horizontal.
        cone_deg: Half angle of a spot.
        visible: Whether a panel appears in images, as a housing with a bright front.
    """

    type: Literal["light"] = "light"
    kind: LampKind = "sphere"
    position_m: tuple[float, float, float] = (0.5, -0.8, 2.2)
    direction: tuple[float, float, float] = (0.0, 0.0, -1.0)
    intensity_cd: float = Field(800.0, ge=0)
    luminous_flux_lm: float | None = Field(None, ge=0)
    radius_m: float = Field(0.08, ge=0)
    size_m: tuple[float, float] = (0.6, 0.6)
    cone_deg: float = Field(30.0, ge=1.0, le=90.0)
    visible: bool = True

    @model_validator(mode="after")
    def _is_possible(self) -> "LightElement":
        if self.luminous_flux_lm is not None and "intensity_cd" in self.model_fields_set:
            raise ValueError("intensity_cd and luminous_flux_lm exclude each other")
        if self.kind == "disk" and self.radius_m <= 0.0:
            raise ValueError("radius_m of a disk must be above 0")
        if min(self.size_m) <= 0.0:
            raise ValueError("size_m must be above 0")
        if not any(self.direction):
            raise ValueError("direction must not be 0")
        return self

    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add the light and, if visible, its housing."""
        light = Light(
            self.name,
            self.kind,
            position_m=self.position_m,
            direction=_normalize(self.direction),
            intensity_cd=self.intensity_cd,
            radius_m=self.radius_m,
        )
        if self.kind == "spot":
            light = replace(light, cone_rad=round(math.radians(self.cone_deg), 6))
        if self.kind == "rectangle":
            light = replace(light, size_m=self.size_m, side=photometry.level_side(light.direction))
        if self.luminous_flux_lm is not None:
            light = photometry.scale_to_flux(light, self.luminous_flux_lm)
        if self.visible and self.kind in PANEL_KINDS:
            materials = assets.materials(photometry.fixture_asset(light))
            scene, light = photometry.add_fixture(scene, light, materials)
        return replace(scene, lights=(*scene.lights, light))


def _normalize(direction: se3.Vec3) -> se3.Vec3:
    length = math.sqrt(sum(v * v for v in direction))
    x, y, z = (round(v / length, 6) for v in direction)
    return (x, y, z)
