"""Members of object groups: adding them to a scene, removing them, and their instance ids."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Body, Instance, Motion, ObjectGroup, Scene
from gen_data.core.se3 import SE3


@dataclass(frozen=True, slots=True)
class Member:
    """A member of a group, before it has a name and an instance id.

    Attributes:
        asset: Mesh asset id.
        scale: Uniform factor on the mesh.
        collides: Whether it collides in physics.
    """

    asset: str
    T_world_body: SE3
    scale: float = 1.0
    motion: Motion = "static"
    collides: bool = True
    mass_kg: float = 0.0


def add_members(
    scene: Scene, group: ObjectGroup, members: Sequence[Member], assets: AssetIndex, first: int = 0
) -> Scene:
    """The scene with a body ``group/k`` and an instance for every member; k is from ``first``."""
    ids = free_instance_ids(scene, len(members))
    bodies = []
    instances = []
    for number, (member, instance_id) in enumerate(zip(members, ids, strict=True), first):
        body = Body(
            name=f"{group.name}/{number}",
            asset=member.asset,
            T_world_body=member.T_world_body,
            scale=member.scale,
            instance_id=instance_id,
            group=group.name,
            motion=member.motion,
            collides=member.collides,
            mass_kg=member.mass_kg,
        )
        category = assets.get(member.asset).category
        bodies.append(body)
        instances.append(
            Instance(instance_id, body.name, category, 0, member.asset, annotated=group.annotated)
        )
    return replace(scene, bodies=(*scene.bodies, *bodies), instances=(*scene.instances, *instances))


def change_assets(scene: Scene, assets: Mapping[str, str]) -> Scene:
    """The scene with other assets on members, by name, and on their instances."""
    changed = [replace(b, asset=assets[b.name]) for b in scene.bodies if b.name in assets]
    by_id = {body.instance_id: body.asset for body in changed}
    instances = tuple(
        replace(i, asset=by_id[i.instance_id]) if i.instance_id in by_id else i
        for i in scene.instances
    )
    return replace(scene.with_bodies(*changed), instances=instances)


def remove_members(scene: Scene, group: str) -> Scene:
    """The scene without the members of the group of that name."""
    removed = {body.instance_id for body in scene.bodies if body.group == group}
    return replace(
        scene,
        bodies=tuple(body for body in scene.bodies if body.group != group),
        instances=tuple(i for i in scene.instances if i.instance_id not in removed),
    )


def free_instance_ids(scene: Scene, count: int) -> list[int]:
    """The smallest instance ids that nothing in the scene has, in ascending order."""
    taken = {instance.instance_id for instance in scene.instances}
    return [k for k in range(1, len(taken) + count + 1) if k not in taken][:count]
