"""Colour of objects."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from generator.config.distributions import Chance, Probability, Uniform, UnitInterval
from generator.core.geometry import Material
from generator.core.interfaces import AssetIndex
from generator.core.scene import Scene
from generator.core.streams import Rng
from randomizers.base import LookRandomizer, with_materials
from randomizers.color_space import linear_of_hsv


class Colors(LookRandomizer):
    """Paints objects in a drawn colour; what is printed stays as it is.

    Attributes:
        probability: That an object is painted; 1 = every one, 0.3 = about three in ten.
        hue, saturation, value: Of the paint, as painters count them (HSV in sRGB).
    """

    type: Literal["colors"] = "colors"
    probability: Chance = Probability(1.0)
    hue: UnitInterval = Uniform(0.0, 1.0)
    saturation: UnitInterval = Uniform(0.1, 0.9)
    value: UnitInterval = Uniform(0.25, 0.95)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """One colour per object; every material slot takes it."""
        painted = []
        for body in self.chosen(scene):
            if not self.probability.draw(rng):
                continue
            color = linear_of_hsv(
                self.hue.draw(rng), self.saturation.draw(rng), self.value.draw(rng)
            )

            def paint(material: Material, color: tuple[float, float, float] = color) -> Material:
                return replace(material, base_color=color, texture="")

            painted.append(with_materials(body, assets, paint))
        return scene.with_bodies(*painted)
