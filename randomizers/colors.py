"""Colours of objects."""

from typing import Any, Literal

from gen_data.config import distributions as dist
from gen_data.core import interfaces, streams
from gen_data.core.scene import Scene
from gen_data.randomizers import base, color_space


class Colors(base.SurfaceRandomizer):
    """Paints each object in one drawn colour; printed materials are unchanged.

    Attributes:
        probability: Probability that an object is painted.
        hue, saturation, value: Colour of the paint (HSV in sRGB).
    """

    type: Literal["colors"] = "colors"
    probability: dist.Chance = dist.Probability(1.0)
    hue: dist.UnitInterval = dist.Uniform(0.0, 1.0)
    saturation: dist.UnitInterval = dist.Uniform(0.1, 0.9)
    value: dist.UnitInterval = dist.Uniform(0.25, 0.95)

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with one colour per object, in every material slot."""

        def draw() -> dict[str, Any] | None:
            if not self.probability.draw(rng):
                return None
            hsv = (self.hue.draw(rng), self.saturation.draw(rng), self.value.draw(rng))
            return {"base_color": color_space.hsv_to_linear(*hsv), "texture": ""}

        return self.change_targets(scene, assets, draw)
