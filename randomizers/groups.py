"""Groups of a template: which assets they draw, and how their members are exchanged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from generator.core.errors import ConfigError, did_you_mean
from generator.core.interfaces import AssetIndex
from generator.core.scene import ObjectGroup, Scene
from generator.core.streams import Rng
from randomizers.base import pick

Wheel = tuple[tuple[float, tuple[str, ...]], ...]
"""Weight and assets of every category that may be drawn."""


def group_named(scene: Scene, name: str, field: str) -> ObjectGroup:
    """The object group of that name. Raises ConfigError if there is none."""
    for group in scene.groups:
        if group.name == name:
            return group
    known = [group.name for group in scene.groups]
    raise ConfigError(
        f"{field}: the template has no object group '{name}'; expected one of "
        f"{', '.join(known)}{did_you_mean(name, known)}"
    )


def wheel_of(
    group: ObjectGroup, assets: AssetIndex, weights: Mapping[str, float], field: str
) -> Wheel:
    """What a group draws from: first a category, then one of its assets.

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


def drawn_asset(wheel: Wheel, rng: Rng) -> str:
    """An asset of a category that is drawn in proportion to its weight."""
    draw = float(rng.uniform()) * sum(weight for weight, _ in wheel)
    for weight, ids in wheel:
        draw -= weight
        if draw < 0.0:
            return pick(ids, rng)
    return pick(wheel[-1][1], rng)


def without_members(scene: Scene, group: str) -> Scene:
    """The scene without the members of a group."""
    gone = {body.instance_id for body in scene.bodies if body.group == group}
    return replace(
        scene,
        bodies=tuple(body for body in scene.bodies if body.group != group),
        instances=tuple(i for i in scene.instances if i.instance_id not in gone),
    )


def free_ids(scene: Scene, count: int) -> list[int]:
    """The smallest instance ids that nothing has."""
    taken = {instance.instance_id for instance in scene.instances}
    return [k for k in range(1, len(taken) + count + 1) if k not in taken][:count]
