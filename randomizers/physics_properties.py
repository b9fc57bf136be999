"""Mass and friction."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from gen_data.generator.config.distributions import (
    LogUniform,
    NonNegative,
    Positive,
    Uniform,
    UnitInterval,
)
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import Body, Scene
from gen_data.generator.core.streams import Rng
from gen_data.randomizers.base import RandomizerBase


class PhysicsProperties(RandomizerBase):
    """Draws how heavy, slippery and springy each object is, which changes how it comes to rest.

    Attributes:
        mass_factor: Factor on the asset's mass.
        friction: Coulomb coefficient.
        restitution: Share of speed that is left after a bounce.
    """

    type: Literal["physics_properties"] = "physics_properties"
    stage: Literal["scene"] = "scene"
    mass_factor: Positive = LogUniform(0.7, 1.4)
    friction: NonNegative = Uniform(0.4, 0.9)
    restitution: UnitInterval = Uniform(0.0, 0.1)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """The scene with other dynamic bodies."""
        del assets
        dynamic = [body for body in scene.bodies if body.motion == "dynamic"]
        return scene.with_bodies(*(self._draw_properties(body, rng) for body in dynamic))

    def _draw_properties(self, body: Body, rng: Rng) -> Body:
        return replace(
            body,
            mass_kg=round(body.mass_kg * self.mass_factor.draw(rng), 6),
            friction=round(self.friction.draw(rng), 4),
            restitution=round(self.restitution.draw(rng), 4),
        )
