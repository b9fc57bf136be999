"""Fixed exposure of cameras."""

from dataclasses import replace
from typing import Literal

from gen_data.config import distributions as dist
from gen_data.core import interfaces, streams
from gen_data.core.scene import Scene
from gen_data.randomizers.base import RandomizerBase


class Exposure(RandomizerBase):
    """Draws a fixed exposure for every camera, in place of automatic metering.

    Attributes:
        ev100: Exposure value at ISO 100: about 7 in a lit room; each step up halves the exposure.
    """

    type: Literal["exposure"] = "exposure"
    stage: Literal["scene", "view"] = "view"
    ev100: dist.Scalar = dist.Uniform(6.0, 8.5)

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with drawn exposures."""
        del assets
        cameras = tuple(replace(c, ev100=round(self.ev100.draw(rng), 4)) for c in scene.cameras)
        return replace(scene, cameras=cameras)
