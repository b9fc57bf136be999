"""Textures of objects and furniture."""

from typing import Any, Literal

from pydantic import Field

from gen_data.config import distributions as dist
from gen_data.core import interfaces, streams
from gen_data.core.scene import Scene
from gen_data.randomizers.base import SurfaceRandomizer, choose, find_textures


class Textures(SurfaceRandomizer):
    """Covers each target with a drawn texture; printed materials are unchanged.

    Attributes:
        textures: Families or tags of textures, such as wood, marble, fabric.
        probability: Probability that a target is covered.
        scale_m: Size of one repeat of the texture.
        slots: Indices of the material slots to cover, from 0; empty = all.
    """

    type: Literal["textures"] = "textures"
    textures: tuple[str, ...] = Field(min_length=1, examples=[["wood", "marble"]])
    probability: dist.Chance = dist.Probability(1.0)
    scale_m: dist.Positive = dist.Uniform(0.15, 0.6)
    slots: tuple[int, ...] = ()

    def possible_textures(self, assets: interfaces.AssetIndex) -> tuple[str, ...]:
        """Ids of the textures to draw from."""
        return self._find_options(assets)

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with one texture per target."""
        options = self._find_options(assets)

        def draw() -> dict[str, Any] | None:
            if not self.probability.draw(rng):
                return None
            texture, scale_m = choose(options, rng), round(self.scale_m.draw(rng), 4)
            white = (1.0, 1.0, 1.0)
            return {"base_color": white, "texture": texture, "texture_scale_m": scale_m}

        return self.change_targets(scene, assets, draw, self.slots)

    def _find_options(self, assets: interfaces.AssetIndex) -> tuple[str, ...]:
        return find_textures(assets, self.textures, f"randomizers.{self.name}.textures")
