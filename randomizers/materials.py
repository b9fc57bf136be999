"""Reflection and transmission of object surfaces."""

from typing import Annotated, Any, Literal

from gen_data.config import distributions as dist
from gen_data.core import interfaces, streams
from gen_data.core.scene import Scene
from gen_data.randomizers.base import SurfaceRandomizer


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
        clear: Whether the object transmits light; its colour then is a tint, and it is not a metal.
        transmission: Fraction of the light that is transmitted.
        ior: Index of refraction.
        solid: Whether the object refracts as a solid; otherwise its walls are thin panes.
    """

    type: Literal["materials"] = "materials"
    probability: dist.Chance = dist.Probability(1.0)
    roughness: dist.UnitInterval = dist.Uniform(0.15, 0.9)
    metallic: dist.Flag = dist.Probability(0.1)
    specular: dist.UnitInterval = dist.Uniform(0.3, 0.7)
    coated: dist.Flag = dist.Constant(False)
    coat: dist.UnitInterval = dist.Constant(1.0)
    coat_roughness: dist.UnitInterval = dist.Uniform(0.0, 0.15)
    clear: dist.Flag = dist.Constant(False)
    transmission: dist.UnitInterval = dist.Constant(1.0)
    ior: Annotated[dist.Scalar, dist.Bounds(1, 3)] = dist.Constant(1.5)
    solid: dist.Flag = dist.Constant(False)

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with one finish per object, in every material slot."""
        return self.change_targets(scene, assets, lambda: self._draw_changes(rng))

    def _draw_changes(self, rng: streams.Rng) -> dict[str, Any] | None:
        """Draw the changed fields of a material; no draw for a coat or glass that is not wanted."""
        if not self.probability.draw(rng):
            return None
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
