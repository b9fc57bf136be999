"""Reflection and transmission of object surfaces."""

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
from gen_data.randomizers.base import SurfaceRandomizer, set_materials


class Materials(SurfaceRandomizer):
    """Draws the finish of objects: roughness, metal, and optionally clear coat or transparency.

    Attributes:
        probability: Probability that an object is changed.
        roughness: Roughness: 0 mirror, 1 chalk.
        metallic: Whether the object is metal.
        specular: Reflectance of a dielectric; 0.5 is 4 % at normal incidence.
        coated: Whether to set a clear coat; otherwise the material keeps its own.
        coat: Weight of the clear coat.
        coat_roughness: Roughness of the clear coat.
        clear: Whether the object transmits light; its colour then is a tint, and it is no metal.
        transmission: Fraction of the light that is transmitted.
        ior: Index of refraction.
        solid: Whether the object refracts as a solid; otherwise its walls are thin panes.
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
        """Return the scene with one finish per object, in every material slot."""
        finished = []
        for body in self.find_targets(scene):
            if not self.probability.draw(rng):
                continue
            changes = self._draw_changes(rng)

            def finish(material: Material, changes: dict[str, Any] = changes) -> Material:
                return replace(material, **changes)

            finished.append(set_materials(body, assets, finish))
        return scene.with_bodies(*finished)

    def _draw_changes(self, rng: Rng) -> dict[str, Any]:
        """Draw the changed fields of a material; no draw for a coat or glass that is not wanted."""
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
