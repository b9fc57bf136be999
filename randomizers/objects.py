"""Which objects there are, how many, and where."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal

from pydantic import Field

from generator.config.distributions import Constant, Count, Flag, Positive, Probability
from generator.config.distributions import UniformInteger as Whole
from generator.core.errors import ConfigError, did_you_mean
from generator.core.interfaces import AssetIndex
from generator.core.scene import Body, Instance, ObjectGroup, Scene
from generator.core.streams import Rng
from randomizers.base import RandomizerBase, pick
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
    every: Literal["scene"] = "scene"
    group: str = ""
    count: Count = Whole(4, 10)
    scale: Positive = Constant(1.0)
    upright: Flag = Probability(0.6)
    weights: dict[str, Annotated[float, Field(ge=0)]] = Field({})

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """The scene with the group's objects exchanged."""
        group = self._group(scene)
        scene = _without(scene, group.name)
        count = self.count.draw(rng)
        categories = self._weighted(group, assets)
        chosen = [assets.get(_drawn(categories, rng)) for _ in range(count)]
        scales = [round(self.scale.draw(rng), 4) for _ in range(count)]
        upright = [self.upright.draw(rng) for _ in range(count)]
        items = [
            Item(half_extents_m(*assets.bounds_m(asset.asset_id), scale), asset.stackable)
            for asset, scale in zip(chosen, scales, strict=True)
        ]
        poses = layout(group, items, floors_of(scene, group, assets), rng, upright)
        ids = _free_ids(scene, count)
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

    def _group(self, scene: Scene) -> ObjectGroup:
        name = self.group or self.name
        for group in scene.groups:
            if group.name == name:
                return group
        known = [group.name for group in scene.groups]
        raise ConfigError(
            f"randomizers.{self.name}.group: the template has no object group '{name}'; expected "
            f"one of {', '.join(known)}{did_you_mean(name, known)}"
        )

    def _weighted(
        self, group: ObjectGroup, assets: AssetIndex
    ) -> list[tuple[float, tuple[str, ...]]]:
        """Weight and assets of every category that may be drawn.

        Raises:
            ConfigError: a weight is given to a category that the group lacks, or none is left.
        """
        field = f"randomizers.{self.name}.weights"
        members: dict[str, list[str]] = {}
        for asset_id in group.assets:
            members.setdefault(assets.get(asset_id).category, []).append(asset_id)
        for name in self.weights:
            if name not in members:
                raise ConfigError(
                    f"{field}: the group has no category '{name}'; expected one of "
                    f"{', '.join(sorted(members))}{did_you_mean(name, sorted(members))}"
                )
        weighted = [(self.weights.get(name, 1.0), tuple(members[name])) for name in sorted(members)]
        kept = [(weight, ids) for weight, ids in weighted if weight > 0.0]
        if not kept:
            raise ConfigError(f"{field}: every weight is 0; expected one above 0")
        return kept


def _drawn(categories: list[tuple[float, tuple[str, ...]]], rng: Rng) -> str:
    """An asset of a category that is drawn in proportion to its weight."""
    draw = float(rng.uniform()) * sum(weight for weight, _ in categories)
    for weight, ids in categories:
        draw -= weight
        if draw < 0.0:
            return pick(ids, rng)
    return pick(categories[-1][1], rng)


def _without(scene: Scene, group: str) -> Scene:
    """The scene without the objects of a group."""
    gone = {body.instance_id for body in scene.bodies if body.group == group}
    return replace(
        scene,
        bodies=tuple(body for body in scene.bodies if body.group != group),
        instances=tuple(i for i in scene.instances if i.instance_id not in gone),
    )


def _free_ids(scene: Scene, count: int) -> list[int]:
    """The smallest instance ids that nothing has."""
    taken = {instance.instance_id for instance in scene.instances}
    return [k for k in range(1, len(taken) + count + 1) if k not in taken][:count]
