"""Object groups of a template, and the assets that randomizers draw for them."""

from __future__ import annotations

from collections.abc import Mapping

from gen_data.generator.core.errors import ConfigError, did_you_mean
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import ObjectGroup, Scene
from gen_data.generator.core.streams import Rng
from gen_data.randomizers.base import choose

CategoryWeights = tuple[tuple[float, tuple[str, ...]], ...]
"""Weight and assets of every category that may be drawn."""


def find_group(scene: Scene, name: str, field: str) -> ObjectGroup:
    """The object group of that name. Raises ConfigError if there is none."""
    for group in scene.groups:
        if group.name == name:
            return group
    known = [group.name for group in scene.groups]
    raise ConfigError(
        f"{field}: the template has no object group '{name}'; expected one of "
        f"{', '.join(known)}{did_you_mean(name, known)}"
    )


def make_wheel(
    group: ObjectGroup, assets: AssetIndex, weights: Mapping[str, float], field: str
) -> CategoryWeights:
    """The weighted categories of a group, and the assets of each.

    Args:
        group: Whose assets.
        assets: The library.
        weights: By category; 1 if not listed.
        field: What messages call the weights.

    Raises:
        ConfigError: a weight is given to a category that the group lacks, or none is left.
    """
    members: dict[str, list[str]] = {}
    for asset_id in group.assets:
        members.setdefault(assets.get(asset_id).category, []).append(asset_id)
    for name in weights:
        if name not in members:
            raise ConfigError(
                f"{field}: the group has no category '{name}'; expected one of "
                f"{', '.join(sorted(members))}{did_you_mean(name, sorted(members))}"
            )
    weighted = ((weights.get(name, 1.0), tuple(members[name])) for name in sorted(members))
    kept = tuple((weight, ids) for weight, ids in weighted if weight > 0.0)
    if not kept:
        raise ConfigError(f"{field}: every weight is 0; expected one above 0")
    return kept


def draw_asset(wheel: CategoryWeights, rng: Rng) -> str:
    """An asset of a category that is drawn in proportion to its weight."""
    draw = float(rng.uniform()) * sum(weight for weight, _ in wheel)
    for weight, ids in wheel:
        draw -= weight
        if draw < 0.0:
            return choose(ids, rng)
    return choose(wheel[-1][1], rng)
