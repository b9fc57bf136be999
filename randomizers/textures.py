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
from gen_data.randomizers.base import (
    SurfaceRandomizer,
    body_materials,
    choose,
    find_texture_files,
    find_textures,
    set_materials,
)


class Textures(SurfaceRandomizer):
    """Covers each target with a drawn texture; printed materials are unchanged.

    Attributes:
        textures: Families or tags of textures, such as wood, marble, fabric.
        probability: Probability that a target is covered.
        scale_m: Size of one repeat of the texture.
        slots: Indices of the material slots to cover, from 0; empty = all.
    """

    type: Literal["textures"] = "textures"
    textures: tuple[str, ...] = Field(min_length=1)
    probability: Chance = Probability(1.0)
    scale_m: Positive = Uniform(0.15, 0.6)
    slots: tuple[int, ...] = ()

    def possible_assets(self, assets: AssetIndex) -> tuple[str, ...]:
        """Ids of the texture files to draw from."""
        return find_texture_files(assets, self._find_options(assets))

    def check(self, scene: Scene, assets: AssetIndex) -> None:
        """Raise ConfigError if a name matches no texture."""
        del scene
        self._find_options(assets)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene with one texture per target."""
        options = self._find_options(assets)
        covered = []
        for body in self.find_targets(scene):
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
                before = body_materials(body, assets)
                mixed = tuple(
                    new if slot in self.slots else old
                    for slot, (new, old) in enumerate(zip(changed.materials, before, strict=True))
                )
                changed = replace(changed, materials=mixed)
            covered.append(changed)
        return scene.with_bodies(*covered)

    def _find_options(self, assets: AssetIndex) -> tuple[str, ...]:
        """Ids of the textures to draw from."""
        return find_textures(assets, self.textures, f"randomizers.{self.name}.textures")
