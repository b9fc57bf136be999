"""Objects of a group: which, how many, and where."""

from typing import Annotated, Literal

from gen_data.config import distributions as dist
from gen_data.core import interfaces, streams
from gen_data.core.members import Member, add_members, remove_members
from gen_data.core.scene import Scene
from gen_data.randomizers.asset_groups import GroupRandomizer, draw_asset, draw_kinds
from gen_data.randomizers.placement import Item, find_floors, half_extents_m, lay_out, outline_m

COUNT_MAX = 500
"""Largest count of the template's ``objects`` element."""


class Objects(GroupRandomizer):
    """Replaces the objects of a group by drawn ones: their number, assets, sizes and start poses.

    The category is drawn first and then one of its assets: a category with many variants
    is not more frequent.

    Attributes:
        count: Number of objects.
        kinds: Number of categories that they are drawn from, as in a bowl of apples; 0 = all.
        scale: Factor on an object's size.
        upright: Whether an object starts upright; otherwise at any rotation
            (placements drop and pile).
    """

    type: Literal["objects"] = "objects"
    stage: Literal["scene"] = "scene"
    count: Annotated[dist.Count, dist.Bounds(0, COUNT_MAX)] = dist.UniformInteger(4, 10)
    kinds: Annotated[dist.Count, dist.Bounds(0, COUNT_MAX)] = dist.Constant(0)
    scale: Annotated[dist.Scalar, dist.Bounds(0.001, 1000.0)] = dist.Constant(1.0)
    upright: dist.Flag = dist.Probability(0.6)

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with the group's objects replaced."""
        group, weights = self.find_group(scene, assets)
        if not weights:
            return scene
        scene = remove_members(scene, group.name)
        count = self.count.draw(rng)
        weights = draw_kinds(weights, self.kinds.draw(rng), rng)
        chosen = [assets.get(draw_asset(weights, rng)) for _ in range(count)]
        scales = [round(self.scale.draw(rng), 4) for _ in range(count)]
        upright = [self.upright.draw(rng) for _ in range(count)]
        hangs = group.placement == "hang"
        outlined = group.placement == "row"
        items = [
            Item(
                half_extents_m(*assets.bounds_m(asset.asset_id), scale),
                asset.stackable,
                outline_m(asset.asset_id, scale, assets) if outlined else None,
            )
            for asset, scale in zip(chosen, scales, strict=True)
        ]
        poses = lay_out(group, items, find_floors(scene, group, assets), rng, upright)
        members = [
            Member(
                asset.asset_id,
                pose.rounded(),
                scale,
                motion="static" if hangs else "dynamic",
                mass_kg=0.0 if hangs else round(asset.mass_kg * scale**3, 6),
            )
            for asset, scale, pose in zip(chosen, scales, poses, strict=True)
        ]
        return add_members(scene, group, members, assets)
