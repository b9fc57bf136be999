"""Surfaces of the background: floors, walls, ground and studio backdrops."""

from dataclasses import replace
from typing import Literal

from pydantic import Field

from gen_data.assets.families import declared
from gen_data.config import distributions as dist
from gen_data.core import asset_types, plates, streams
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Body, Scene
from gen_data.randomizers import base
from gen_data.randomizers.color_space import hsv_to_linear

PAINT_ROUGHNESS = 0.85


class Backdrop(base.RandomizerBase):
    """Draws the surfaces of the background: floor and walls of a room, ground, or a backdrop.

    Attributes:
        floor: Families or tags of textures for floors and ground.
        floor_scale_m: Size of one texture repeat on the floor.
        walls: Families or tags of textures for unpainted walls.
        wall_scale_m: Size of one texture repeat on the walls.
        painted: Whether walls are painted instead of textured.
        hue, saturation, value: Colour of the paint (HSV in sRGB), also of studio backdrops.
    """

    type: Literal["backdrop"] = "backdrop"
    floor: tuple[str, ...] = Field(("floor",), min_length=1)
    floor_scale_m: dist.Positive = dist.Uniform(0.8, 2.0)
    walls: tuple[str, ...] = Field(("wall",), min_length=1)
    wall_scale_m: dist.Positive = dist.Uniform(0.8, 2.0)
    painted: dist.Flag = dist.Probability(0.6)
    hue: dist.UnitInterval = dist.Uniform(0.0, 1.0)
    saturation: dist.UnitInterval = dist.Uniform(0.0, 0.35)
    value: dist.UnitInterval = dist.Uniform(0.55, 0.95)

    def possible_textures(self, assets: AssetIndex) -> tuple[str, ...]:
        """Ids of the textures to draw from."""
        floors, walls = self._find_options(assets)
        return tuple(sorted({*floors, *walls}))

    def __call__(self, scene: Scene, assets: AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with new materials on every background body."""
        floors, walls = self._find_options(assets)
        background = [b for b in scene.bodies if b.instance_id == 0 and not plates.is_catcher(b)]
        return scene.with_bodies(
            *(self._redecorate(b, assets, floors, walls, rng) for b in background)
        )

    def _find_options(self, assets: AssetIndex) -> tuple[tuple[str, ...], tuple[str, ...]]:
        field = f"randomizers.{self.name}"
        return (
            base.find_textures(assets, self.floor, f"{field}.floor"),
            base.find_textures(assets, self.walls, f"{field}.walls"),
        )

    def _redecorate(
        self,
        body: Body,
        assets: AssetIndex,
        floors: tuple[str, ...],
        walls: tuple[str, ...],
        rng: streams.Rng,
    ) -> Body:
        ground = _textured_material(base.choose(floors, rng), self.floor_scale_m.draw(rng))
        textured = _textured_material(base.choose(walls, rng), self.wall_scale_m.draw(rng))
        color = hsv_to_linear(self.hue.draw(rng), self.saturation.draw(rng), self.value.draw(rng))
        paint = asset_types.Material(base_color=color, roughness=PAINT_ROUGHNESS)
        wall = paint if self.painted.draw(rng) else textured
        looks = {"floor": ground, "ground": ground, "paper": paint, "walls": wall}
        slots = declared(body.asset, "slots", ())
        materials = list(base.body_materials(body, assets))
        for number, slot in enumerate(slots[: len(materials)]):
            materials[number] = looks.get(slot, materials[number])
        return replace(body, materials=tuple(materials))


def _textured_material(texture: str, scale_m: float) -> asset_types.Material:
    white = (1.0, 1.0, 1.0)
    return asset_types.Material(
        base_color=white, roughness=1.0, texture=texture, texture_scale_m=round(scale_m, 4)
    )
