"""Textures of objects and furniture."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Literal

from pydantic import Field

from gen_data.config import distributions as dist
from gen_data.core import interfaces, streams
from gen_data.core.asset_words import check_categories
from gen_data.core.scene import Scene
from gen_data.randomizers.base import SurfaceRandomizer, body_materials, choose, find_textures


class Textures(SurfaceRandomizer):
    """Covers each target with a drawn texture; printed materials are unchanged.

    With ``prints`` it is the other way round: pictures, such as yours, replace the prints of mugs,
    cups, boxes and labels, and follow the object's texture coordinates.

    Attributes:
        textures: Families or tags of textures, such as wood, marble, fabric.
        probability: Probability that a target is covered.
        scale_m: Size of one repeat of the texture.
        slots: Indices of the material slots to cover, from 0; empty = all.
        prints: Whether to replace the images of printed materials, instead of other materials.
        categories: Categories of the objects whose prints are replaced; empty = all.
    """

    type: Literal["textures"] = "textures"
    textures: tuple[str, ...] = Field(min_length=1, examples=[["wood", "marble"]])
    probability: dist.Chance = dist.Probability(1.0)
    scale_m: dist.Positive = dist.Uniform(0.15, 0.6)
    slots: tuple[int, ...] = ()
    prints: bool = False
    categories: tuple[str, ...] = ()

    def check(self, scene: Scene, assets: interfaces.AssetIndex) -> None:
        """See ``SurfaceRandomizer.check``; categories are checked, too."""
        super().check(scene, assets)
        check_categories(self.categories, assets, f"randomizers.{self.name}.categories")

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

        if self.prints:
            return self._print(scene, assets, draw)
        return self.change_targets(scene, assets, draw, self.slots)

    def _print(
        self,
        scene: Scene,
        assets: interfaces.AssetIndex,
        draw: Callable[[], Mapping[str, Any] | None],
    ) -> Scene:
        """The scene with a drawn image on the prints of every target."""
        changed = []
        for body in self.find_targets(scene, assets):
            if self.categories and assets.get(body.asset).category not in self.categories:
                continue
            fields = draw()
            if fields is None:
                continue
            materials = tuple(
                replace(m, **{**fields, "texture_scale_m": 0.0})
                if m.printed and m.texture and not m.role and (not self.slots or k in self.slots)
                else m
                for k, m in enumerate(body_materials(body, assets))
            )
            changed.append(replace(body, materials=materials))
        return scene.with_bodies(*changed)

    def _find_options(self, assets: interfaces.AssetIndex) -> tuple[str, ...]:
        return find_textures(assets, self.textures, f"randomizers.{self.name}.textures")
