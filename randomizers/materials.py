"""How surfaces reflect."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, Literal

from gen_data.generator.config.distributions import (
    Bounds,
    Chance,
    Constant,
    Flag,
    Probability,
    Scalar,
    Uniform,
    UnitInterval,
)
from gen_data.generator.core.asset_types import Material
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import Scene
from gen_data.generator.core.streams import Rng
from gen_data.randomizers.base import LookRandomizer, set_materials


class Materials(LookRandomizer):
    """Draws roughness, metallic and specular of objects, and makes some coated or clear.

    Attributes:
        probability: That an object is changed; 1 = every one, 0.3 = about three in ten.
        roughness: 0 is a mirror, 1 is chalk.
        metallic: Whether the object is of metal.
        specular: Reflectance of what is no metal; 0.5 is 4 % at normal incidence.
        coated: Whether it gets a clear coat; one that it has stays otherwise.
        coat: Weight of that coat.
        coat_roughness: Of that coat.
        clear: Whether light goes through it: then it is no metal, and its colour is a tint.
        transmission: Share of the light that goes through.
        ior: Its refractive index.
        solid: Whether it refracts; else its walls are thin panes.
    """

    type: Literal["materials"] = "materials"
    probability: Chance = Probability(1.0)
    roughness: UnitInterval = Uniform(0.15, 0.9)
    metallic: Flag = Probability(0.1)
    specular: UnitInterval = Uniform(0.3, 0.7)
    coated: Flag = Constant(False)
    coat: UnitInterval = Constant(1.0)
    coat_roughness: UnitInterval = Uniform(0.0, 0.15)
    clear: Flag = Constant(False)
    transmission: UnitInterval = Constant(1.0)
    ior: Annotated[Scalar, Bounds(1, 3)] = Constant(1.5)
    solid: Flag = Constant(False)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """One finish per object; every material slot takes it."""
        finished = []
        for body in self.chosen(scene):
            if not self.probability.draw(rng):
                continue
            changes = self._draw_changes(rng)

            def finish(material: Material, changes: dict[str, Any] = changes) -> Material:
                return replace(material, **changes)

            finished.append(set_materials(body, assets, finish))
        return scene.with_bodies(*finished)

    def _draw_changes(self, rng: Rng) -> dict[str, Any]:
        """The fields of a material that change. What is not asked for draws nothing."""
        changes: dict[str, Any] = {
            "roughness": round(self.roughness.draw(rng), 4),
            "metallic": float(self.metallic.draw(rng)),
            "specular": round(self.specular.draw(rng), 4),
        }
        if self.coated.draw(rng):
            changes["coat"] = round(self.coat.draw(rng), 4)
            changes["coat_roughness"] = round(self.coat_roughness.draw(rng), 4)
        if self.clear.draw(rng):
            changes["metallic"] = 0.0
            changes["transmission"] = round(self.transmission.draw(rng), 4)
            changes["ior"] = round(self.ior.draw(rng), 4)
            changes["thin"] = not self.solid.draw(rng)
        return changes
