"""Colours of objects."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from gen_data.generator.config.distributions import Chance, Probability, Uniform, UnitInterval
from gen_data.generator.core.asset_types import Material
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import Scene
from gen_data.generator.core.streams import Rng
from gen_data.randomizers.base import SurfaceRandomizer, set_materials
from gen_data.randomizers.color_space import hsv_to_linear


class Colors(SurfaceRandomizer):
    """Paints each object in one drawn colour; printed materials are unchanged.

    Attributes:
        probability: Probability that an object is painted.
        hue, saturation, value: Colour of the paint (HSV in sRGB).
    """

    type: Literal["colors"] = "colors"
    probability: Chance = Probability(1.0)
    hue: UnitInterval = Uniform(0.0, 1.0)
    saturation: UnitInterval = Uniform(0.1, 0.9)
    value: UnitInterval = Uniform(0.25, 0.95)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene with one colour per object, in every material slot."""
        painted = []
        for body in self.find_targets(scene):
            if not self.probability.draw(rng):
                continue
            color = hsv_to_linear(
                self.hue.draw(rng), self.saturation.draw(rng), self.value.draw(rng)
            )

            def paint(material: Material, color: tuple[float, float, float] = color) -> Material:
                return replace(material, base_color=color, texture="")

            painted.append(set_materials(body, assets, paint))
        return scene.with_bodies(*painted)
