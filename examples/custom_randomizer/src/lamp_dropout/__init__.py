"""A third-party randomizer: switches lamps off."""

from dataclasses import replace
from typing import Literal

from gen_data.config.distributions import Chance, Probability
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Scene
from gen_data.core.streams import Rng
from gen_data.randomizers.base import RandomizerBase


class LampDropout(RandomizerBase):
    """Switches each lamp off with a probability; the first one stays on.

    Attributes:
        probability: How likely a lamp is off.
    """

    type: Literal["lamp_dropout"] = "lamp_dropout"
    probability: Chance = Probability(0.5)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene without the lamps that were drawn."""
        del assets
        kept = tuple(lamp for lamp in scene.lights[1:] if not self.probability.draw(rng))
        return replace(scene, lights=scene.lights[:1] + kept)
