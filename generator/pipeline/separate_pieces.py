"""Pieces: assets that fall as one body and are several objects to an annotator.

A family with such assets, as hands of bananas, declares ``pieces``: a function of the parameters of
an asset that returns the id of each piece and its origin in the frame of the whole [m].
"""

from collections.abc import Iterator
from dataclasses import replace

from gen_data.assets.asset_ids import parse_asset_id
from gen_data.assets.families import declared
from gen_data.core.members import free_instance_ids
from gen_data.core.scene import Body, Instance, Scene
from gen_data.core.se3 import SE3, Vec3

Pieces = tuple[tuple[str, Vec3], ...]


def separate_pieces(scene: Scene) -> Scene:
    """The settled scene with a body and an instance for every piece; the first keeps name and id.

    Bodies that move, or that a robot may take, stay whole.
    """
    taken = {track.body for track in scene.tracks}
    for arm in scene.articulations:
        for goal in (*((arm.goal,) if arm.goal else ()), *arm.task):
            taken |= {goal.grasped_object, *goal.objects}
    whole = {b.name: pieces for b in scene.bodies if b.name not in taken if (pieces := _of(b))}
    if not whole:
        return scene
    count = sum(len(pieces) - 1 for pieces in whole.values())
    ids = iter(free_instance_ids(scene, count))
    owners = {instance.instance_id: instance for instance in scene.instances}
    bodies: list[Body] = []
    added: list[Instance] = []
    changed: dict[int, Instance] = {}
    for body in scene.bodies:
        pieces = whole.get(body.name, ())
        bodies += _separate(body, pieces) if pieces else [body]
        if not pieces or body.instance_id not in owners:
            continue
        owner = owners[body.instance_id]
        changed[owner.instance_id] = replace(owner, asset=pieces[0][0])
        for k in range(1, len(pieces)):
            number = next(ids)
            one = bodies[len(bodies) - len(pieces) + k]
            bodies[len(bodies) - len(pieces) + k] = replace(one, instance_id=number)
            added.append(replace(owner, instance_id=number, name=one.name, asset=one.asset))
    kept = [changed.get(instance.instance_id, instance) for instance in scene.instances]
    return replace(scene, bodies=tuple(bodies), instances=(*kept, *added))


def _of(body: Body) -> Pieces:
    find = declared(body.asset, "pieces", None)
    found: Pieces = () if find is None else find(**parse_asset_id(body.asset).parameters)
    return found


def _separate(body: Body, pieces: Pieces) -> Iterator[Body]:
    for k, (asset, (x, y, z)) in enumerate(pieces):
        offset = SE3((body.scale * x, body.scale * y, body.scale * z))
        yield replace(
            body,
            name=f"{body.name}/{k}" if k else body.name,
            asset=asset,
            T_world_body=(body.T_world_body @ offset).rounded(),
            mass_kg=round(body.mass_kg / len(pieces), 6),
        )
