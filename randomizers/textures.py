"""Textures of objects and furniture."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from pydantic import Field

from gen_data.generator.config.distributions import Chance, Positive, Probability, Uniform
from gen_data.generator.core.asset_types import Material
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import Scene
from gen_data.generator.core.streams import Rng
from gen_data.randomizers.base import LookRandomizer, choose, find_textures, set_materials


class Textures(LookRandomizer):
    """Covers its targets with drawn textures; what is printed stays as it is.

    Attributes:
        textures: Families or tags of textures: wood, marble, fabric.
        probability: That a target is covered; 1 = every one, 0.3 = about three in ten.
        scale_m: Length of one repeat of the texture.
        slots: Numbers of the material slots to cover; empty = all.
    """

    type: Literal["textures"] = "textures"
    textures: tuple[str, ...] = Field(min_length=1)
    probability: Chance = Probability(1.0)
    scale_m: Positive = Uniform(0.15, 0.6)
    slots: tuple[int, ...] = ()

    def check(self, scene: Scene, assets: AssetIndex) -> None:
        """Raises ConfigError if there is no texture of a name."""
        del scene
        self._options(assets)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """One texture per body."""
        options = self._options(assets)
        covered = []
        for body in self.chosen(scene):
            if not self.probability.draw(rng):
                continue
            texture, scale_m = choose(options, rng), round(self.scale_m.draw(rng), 4)

            def cover(
                material: Material, texture: str = texture, scale_m: float = scale_m
            ) -> Material:
                return replace(
                    material, base_color=(1.0, 1.0, 1.0), texture=texture, texture_scale_m=scale_m
                )

            changed = set_materials(body, assets, cover)
            if self.slots:
                before = body.materials or assets.materials(body.asset)
                mixed = tuple(
                    new if slot in self.slots else old
                    for slot, (new, old) in enumerate(zip(changed.materials, before, strict=True))
                )
                changed = replace(changed, materials=mixed)
            covered.append(changed)
        return scene.with_bodies(*covered)

    def _options(self, assets: AssetIndex) -> tuple[str, ...]:
        """Ids of the textures it draws from."""
        return find_textures(assets, self.textures, f"randomizers.{self.name}.textures")
