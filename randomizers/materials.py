"""How surfaces reflect."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from generator.config.distributions import Flag, Probability, Uniform, UnitInterval
from generator.core.geometry import Material
from generator.core.interfaces import AssetIndex
from generator.core.scene import Scene
from generator.core.streams import Rng
from randomizers.base import LookRandomizer, with_materials


class Materials(LookRandomizer):
    """Draws roughness, metallic and specular of objects.

    Attributes:
        probability: Whether an object is changed at all.
        roughness: 0 is a mirror, 1 is chalk.
        metallic: Whether the object is of metal.
        specular: Reflectance of what is no metal; 0.5 is 4 % at normal incidence.
    """

    type: Literal["materials"] = "materials"
    probability: Flag = Probability(0.6)
    roughness: UnitInterval = Uniform(0.15, 0.9)
    metallic: Flag = Probability(0.1)
    specular: UnitInterval = Uniform(0.3, 0.7)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """One finish per object; every material slot takes it."""
        finished = []
        for body in self.chosen(scene):
            if not self.probability.draw(rng):
                continue
            roughness = round(self.roughness.draw(rng), 4)
            metallic = float(self.metallic.draw(rng))
            specular = round(self.specular.draw(rng), 4)

            def finish(
                material: Material,
                values: tuple[float, float, float] = (roughness, metallic, specular),
            ) -> Material:
                rough, metal, shine = values
                return replace(material, roughness=rough, metallic=metal, specular=shine)

            finished.append(with_materials(body, assets, finish))
        return scene.with_bodies(*finished)
