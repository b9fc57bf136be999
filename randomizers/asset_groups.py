"""Draws of assets for the object groups of a template."""

from collections.abc import Iterable
from typing import Annotated

from pydantic import Field

from gen_data.core import errors, streams
from gen_data.core.bounded_cache import ObjectCache
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Body, ObjectGroup, Scene
from gen_data.core.streams import pick_by_weight
from gen_data.randomizers.base import RandomizerBase, check_known, choose

CategoryWeights = tuple[tuple[float, tuple[str, ...]], ...]
"""Weight and asset ids of every category with a weight above 0."""
_GROUPS = 256
_members: ObjectCache[ObjectCache[dict[str, tuple[str, ...]]]] = ObjectCache(1)
"""Ids of the latest groups by category, of the latest library: most scenes have the same groups."""


class GroupRandomizer(RandomizerBase):
    """Base of randomizers that draw the members of an object group.

    Attributes:
        group: Name of the template's object group; empty = the randomizer's own name.
        weights: Relative frequency by category; 1 if not listed.
    """

    group: str = ""
    weights: dict[str, Annotated[float, Field(ge=0)]] = Field({})

    def check(self, scene: Scene, assets: AssetIndex) -> None:
        """Raise ConfigError if the group or a category of the weights is unknown."""
        self.find_group(scene, assets)

    def find_group(self, scene: Scene, assets: AssetIndex) -> tuple[ObjectGroup, CategoryWeights]:
        """Find the group and weigh the categories of its assets: none if its element is absent.

        Raises:
            ConfigError: the group or a category of the weights is unknown, or every weight is 0.
        """
        field, name = f"randomizers.{self.name}", self.group or self.name
        groups = {group.name: group for group in scene.groups}
        check_known(name, groups, f"{field}.group: the template has no object group")
        listed = groups[name].assets
        known = _members.get(assets, lambda: ObjectCache(_GROUPS))
        members = known.get(listed, lambda: _by_category(listed, assets))
        if not members:
            return groups[name], ()
        for category in self.weights:
            check_known(category, sorted(members), f"{field}.weights: the group has no category")
        weighted = ((self.weights.get(key, 1.0), members[key]) for key in sorted(members))
        kept = tuple((weight, ids) for weight, ids in weighted if weight > 0.0)
        if not kept:
            raise errors.ConfigError(f"{field}.weights: every weight is 0; expected one above 0")
        return groups[name], kept


def _by_category(asset_ids: tuple[str, ...], assets: AssetIndex) -> dict[str, tuple[str, ...]]:
    members: dict[str, list[str]] = {}
    for asset_id in asset_ids:
        members.setdefault(assets.get(asset_id).category, []).append(asset_id)
    return {category: tuple(ids) for category, ids in members.items()}


def draw_kinds(weights: CategoryWeights, count: int, rng: streams.Rng) -> CategoryWeights:
    """The weights of some categories, drawn one by one in proportion to them; 0 = all."""
    if not 0 < count < len(weights):
        return weights
    left, kept = list(weights), []
    for _ in range(count):
        kept.append(left.pop(pick_by_weight([w for w, _ in left], float(rng.uniform()))))
    return tuple(kept)


def draw_asset(weights: CategoryWeights, rng: streams.Rng) -> str:
    """Draw a category in proportion to its weight, then one of its assets uniformly."""
    index = pick_by_weight([weight for weight, _ in weights], float(rng.uniform()))
    return choose(weights[index][1], rng)


def free_number(members: Iterable[Body]) -> int:
    """The first number that no member's name ends with, nor any larger one."""
    return max((int(body.name.rpartition("/")[2]) for body in members), default=-1) + 1
