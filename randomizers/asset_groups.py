"""Draws of assets for the object groups of a template."""

from __future__ import annotations

from collections.abc import Mapping

from gen_data.generator.core.errors import ConfigError, did_you_mean
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import ObjectGroup, Scene
from gen_data.generator.core.streams import Rng
from gen_data.randomizers.base import choose, pick_by_weight

CategoryWeights = tuple[tuple[float, tuple[str, ...]], ...]
"""Weight and asset ids of every category with a weight above 0."""


def find_weighted_group(
    scene: Scene, assets: AssetIndex, name: str, weights: Mapping[str, float], field: str
) -> tuple[ObjectGroup, CategoryWeights]:
    """Find an object group and weigh the categories of its assets.

    Args:
        scene: Scene with the groups.
        assets: Library of the groups' assets.
        name: Name of the group.
        weights: Weight by category; 1 if not listed.
        field: Path of the randomizer in error texts.

    Raises:
        ConfigError: the group or a category of the weights is unknown, or every weight is 0.
    """
    group = next((group for group in scene.groups if group.name == name), None)
    if group is None:
        known = [group.name for group in scene.groups]
        raise ConfigError(
            f"{field}.group: the template has no object group '{name}'; expected one of "
            f"{', '.join(known)}{did_you_mean(name, known)}"
        )
    members: dict[str, list[str]] = {}
    for asset_id in group.assets:
        members.setdefault(assets.get(asset_id).category, []).append(asset_id)
    for category in weights:
        if category not in members:
            raise ConfigError(
                f"{field}.weights: the group has no category '{category}'; expected one of "
                f"{', '.join(sorted(members))}{did_you_mean(category, sorted(members))}"
            )
    weighted = ((weights.get(name, 1.0), tuple(members[name])) for name in sorted(members))
    kept = tuple((weight, ids) for weight, ids in weighted if weight > 0.0)
    if not kept:
        raise ConfigError(f"{field}.weights: every weight is 0; expected one above 0")
    return group, kept


def draw_asset(weights: CategoryWeights, rng: Rng) -> str:
    """Draw a category in proportion to its weight, then one of its assets uniformly."""
    index = pick_by_weight([weight for weight, _ in weights], float(rng.uniform()))
    return choose(weights[index][1], rng)
