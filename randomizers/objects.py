"""Which objects there are, how many, and where."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal

from pydantic import Field

from generator.config.distributions import Constant, Count, Flag, Positive, Probability
from generator.config.distributions import UniformInteger as Whole
from generator.core.interfaces import AssetIndex
from generator.core.scene import Body, Instance, Scene
from generator.core.streams import Rng
from randomizers.base import RandomizerBase
from randomizers.groups import drawn_asset, free_ids, group_named, wheel_of, without_members
from randomizers.placing import Item, floors_of, half_extents_m, layout


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
    count: Count = Whole(4, 10)
    scale: Positive = Constant(1.0)
    upright: Flag = Probability(0.6)
    weights: dict[str, Annotated[float, Field(ge=0)]] = Field({})

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """The scene with the group's objects exchanged."""
        group = group_named(scene, self.group or self.name, f"randomizers.{self.name}.group")
        scene = without_members(scene, group.name)
        count = self.count.draw(rng)
        wheel = wheel_of(group, assets, self.weights, f"randomizers.{self.name}.weights")
        chosen = [assets.get(drawn_asset(wheel, rng)) for _ in range(count)]
        scales = [round(self.scale.draw(rng), 4) for _ in range(count)]
        upright = [self.upright.draw(rng) for _ in range(count)]
        items = [
            Item(half_extents_m(*assets.bounds_m(asset.asset_id), scale), asset.stackable)
            for asset, scale in zip(chosen, scales, strict=True)
        ]
        poses = layout(group, items, floors_of(scene, group, assets), rng, upright)
        ids = free_ids(scene, count)
        bodies = tuple(
            Body(
                name=f"{group.name}/{k}",
                asset=asset.asset_id,
                T_world_body=pose.rounded(),
                scale=scale,
                instance_id=ids[k],
                group=group.name,
                motion="dynamic",
                mass_kg=round(asset.mass_kg * scale**3, 6),
            )
            for k, (asset, scale, pose) in enumerate(zip(chosen, scales, poses, strict=True))
        )
        instances = tuple(
            Instance(
                body.instance_id,
                body.name,
                asset.category,
                0,
                asset.asset_id,
                annotated=group.annotated,
            )
            for body, asset in zip(bodies, chosen, strict=True)
        )
        return replace(scene, bodies=scene.bodies + bodies, instances=scene.instances + instances)
