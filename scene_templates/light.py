"""A lamp."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from pydantic import Field

from generator.core.interfaces import AssetIndex
from generator.core.scene import Light, Scene
from scene_templates.element import Element


class LightElement(Element):
    """A ball of light at a fixed place; the ``lighting`` randomizer replaces all lights.

    Attributes:
        position_m: Its centre in the world.
        intensity_cd: Luminous intensity; 1 cd lights a surface at 1 m with 1 lx.
        radius_m: Its radius: the larger, the softer its shadows.
    """

    type: Literal["light"] = "light"
    position_m: tuple[float, float, float] = (0.5, -0.8, 2.2)
    intensity_cd: float = Field(800.0, ge=0)
    radius_m: float = Field(0.08, ge=0)

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """One more light."""
        del assets
        light = Light(
            self.name,
            "sphere",
            position_m=self.position_m,
            intensity_cd=self.intensity_cd,
            radius_m=self.radius_m,
        )
        return replace(scene, lights=(*scene.lights, light))
