"""Mass, friction and restitution of dynamic objects."""

from dataclasses import replace
from typing import Literal

from gen_data.config import distributions as dist
from gen_data.core import interfaces, streams
from gen_data.core.scene import Body, Scene
from gen_data.randomizers.base import RandomizerBase


class PhysicsProperties(RandomizerBase):
    """Draws mass, friction and restitution of every dynamic object, which affect its resting pose.

    Attributes:
        mass_factor: Factor on the asset's mass.
        friction: Coefficient of Coulomb friction.
        restitution: Coefficient of restitution: ratio of the speeds after and before a bounce.
    """

    type: Literal["physics_properties"] = "physics_properties"
    stage: Literal["scene"] = "scene"
    mass_factor: dist.Positive = dist.LogUniform(0.7, 1.4)
    friction: dist.NonNegative = dist.Uniform(0.4, 0.9)
    restitution: dist.UnitInterval = dist.Uniform(0.0, 0.1)

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with drawn properties on every dynamic body."""
        del assets
        dynamic = [body for body in scene.bodies if body.motion == "dynamic"]
        return scene.with_bodies(*(self._draw_properties(body, rng) for body in dynamic))

    def _draw_properties(self, body: Body, rng: streams.Rng) -> Body:
        return replace(
            body,
            mass_kg=round(body.mass_kg * self.mass_factor.draw(rng), 6),
            friction=round(self.friction.draw(rng), 4),
            restitution=round(self.restitution.draw(rng), 4),
        )
