"""Which objects there are, how many, and where."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from gen_data.generator.config.distributions import (
    Bounds,
    Constant,
    Count,
    Flag,
    Probability,
    Scalar,
    UniformInteger,
)
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.members import Member, add_members, remove_members
from gen_data.generator.core.scene import ObjectGroup, Scene
from gen_data.generator.core.streams import Rng
from gen_data.randomizers.asset_groups import CategoryWeights, draw_asset, find_group, make_wheel
from gen_data.randomizers.base import RandomizerBase
from gen_data.randomizers.placement import Item, find_floors, half_extents_m, lay_out

COUNT_MAX = 500
"""As many as the template's ``objects`` element may have."""


class Objects(RandomizerBase):
    """Draws the objects of a group anew: how many, which, how large, and where they start.

    Categories are drawn first and then one of the category's assets, so that a category with many
    variants is not more frequent.

    Attributes:
        group: Name of the template's object group; empty = the randomizer's own name.
        count: How many objects.
        scale: Factor on an object's size.
        upright: Whether an object starts standing; else it is turned any way (drop only).
        weights: How often a category is drawn compared with the others, 1 if not listed.
    """

    type: Literal["objects"] = "objects"
    stage: Literal["scene"] = "scene"
    group: str = ""
    count: Annotated[Count, Bounds(0, COUNT_MAX)] = UniformInteger(4, 10)
    scale: Annotated[Scalar, Bounds(0.001, 1000.0)] = Constant(1.0)
    upright: Flag = Probability(0.6)
    weights: dict[str, Annotated[float, Field(ge=0)]] = Field({})

    def check(self, scene: Scene, assets: AssetIndex) -> None:
        """Raises ConfigError if there is no such group, or it lacks a category of the weights."""
        self._find_group(scene, assets)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """The scene with the group's objects exchanged."""
        group, wheel = self._find_group(scene, assets)
        scene = remove_members(scene, group.name)
        count = self.count.draw(rng)
        chosen = [assets.get(draw_asset(wheel, rng)) for _ in range(count)]
        scales = [round(self.scale.draw(rng), 4) for _ in range(count)]
        upright = [self.upright.draw(rng) for _ in range(count)]
        items = [
            Item(half_extents_m(*assets.bounds_m(asset.asset_id), scale), asset.stackable)
            for asset, scale in zip(chosen, scales, strict=True)
        ]
        poses = lay_out(group, items, find_floors(scene, group, assets), rng, upright)
        members = [
            Member(
                asset.asset_id,
                pose.rounded(),
                scale,
                motion="dynamic",
                mass_kg=round(asset.mass_kg * scale**3, 6),
            )
            for asset, scale, pose in zip(chosen, scales, poses, strict=True)
        ]
        return add_members(scene, group, members, assets)

    def _find_group(self, scene: Scene, assets: AssetIndex) -> tuple[ObjectGroup, CategoryWeights]:
        """The group, and the weighted categories of its assets."""
        field = f"randomizers.{self.name}"
        group = find_group(scene, self.group or self.name, f"{field}.group")
        return group, make_wheel(group, assets, self.weights, f"{field}.weights")
