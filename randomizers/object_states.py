"""States of objects: doors, drawers and lids that are open, screens and taps that are on."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Literal

import numpy as np

from gen_data.assets.asset_ids import AssetId
from gen_data.config import distributions as dist
from gen_data.core.asset_types import RobotModel
from gen_data.core.boxes import overlap_of
from gen_data.core.interfaces import AssetIndex
from gen_data.core.keypoint_names import DRAIN, TAP
from gen_data.core.kinematics import link_poses, position_limits, positions_of
from gen_data.core.scene import Body, Instance, Scene
from gen_data.core.se3 import SE3, Vec3
from gen_data.core.streams import Rng
from gen_data.randomizers import base, free_space
from gen_data.rooms.bodies import JOINTS, LEADS_OUT, Joint, keypoint_m, part_pose

SCREEN = "screen"
"""Role of slots that show images."""
_PICTURES = 12
_STEPS = (1.0, 0.6, 0.3)
"""Shares of the drawn opening that are tried where something is in the way."""


class ObjectStates(base.RandomizerBase):
    """Opens doors, drawers and lids as far as nothing is in their way, and switches devices on.

    Labels carry ``open``, from 0 to 1, ``joint``: the turn [rad] or way [m] of the part, and
    ``state``: on or off, of screens and taps. Doors that lead out of all rooms stay closed.

    Jointed objects of a user (element ``prop``) move, too. Labels carry, for a joint ``j``,
    ``open_j`` from 0 to 1, its position ``joint_j`` [rad or m], ``joint_j_type``, its limits
    ``joint_j_limits``, and its axis in the frame of the object, ``joint_j_axis``.

    Attributes:
        is_open: Whether a part is open at all.
        opening: Share of the joint's range, if it is.
        is_on: Whether a screen is on.
        luminance_cd_m2: Luminance of screens that are on.
        runs: Whether water runs from a tap.
    """

    type: Literal["object_states"] = "object_states"
    is_open: dist.Flag = dist.Probability(0.35)
    opening: dist.UnitInterval = dist.Uniform(0.1, 1.0)
    is_on: dist.Flag = dist.Probability(0.6)
    luminance_cd_m2: dist.NonNegative = dist.LogUniform(40.0, 200.0)
    runs: dist.Flag = dist.Probability(0.2)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene with states drawn and stated by the instances' attributes."""
        attributes: dict[int, list[tuple[str, str]]] = {}
        facts = {i.instance_id: dict(i.attributes) for i in scene.instances}
        for part, piece, joint in _find_parts(scene):
            is_open, opening = self.is_open.draw(rng), self.opening.draw(rng)
            is_open = is_open and LEADS_OUT not in facts[part.instance_id]
            moved, share = _open(scene, assets, part, piece, joint, opening if is_open else 0.0)
            scene = scene.with_bodies(moved)
            way = f"{share * joint.limit:.4g}"
            attributes.setdefault(part.instance_id, []).extend(
                [("joint", way), ("open", f"{share:.3g}")]
            )
        for thing in _jointed_things(scene, assets):
            moved_bodies, stated = self._move(scene, assets, thing, rng)
            scene = scene.with_bodies(*moved_bodies)
            attributes.setdefault(thing.instance_id, []).extend(stated)
        changed = []
        streams = []
        for body in scene.bodies:
            mouth_m = keypoint_m(assets, body.asset, TAP) if body.instance_id else None
            if mouth_m is not None:
                runs = self.runs.draw(rng)
                if runs:
                    streams.append(_stream(body, mouth_m, assets))
                state = ("state", "on" if runs else "off")
                attributes.setdefault(body.instance_id, []).append(state)
            slots = base.body_materials(body, assets)
            if not any(m.role == SCREEN for m in slots):
                continue
            is_on, luminance = self.is_on.draw(rng), self.luminance_cd_m2.draw(rng)
            picture = f"texture/outdoor_view?seed={int(rng.random() * _PICTURES)}"
            glow = round(luminance, 2)
            if is_on:
                lit = tuple(
                    replace(m, emission_cd_m2=(glow, glow, glow), texture=picture)
                    if m.role == SCREEN
                    else m
                    for m in slots
                )
                changed.append(replace(body, materials=lit))
            state = ("state", "on" if is_on else "off")
            attributes.setdefault(body.instance_id, []).append(state)
        scene = scene.with_bodies(*changed)
        scene = replace(scene, bodies=(*scene.bodies, *streams))
        return base.add_attributes(scene, attributes)

    def _move(
        self, scene: Scene, assets: AssetIndex, thing: Instance, rng: Rng
    ) -> tuple[tuple[Body, ...], list[tuple[str, str]]]:
        """The bodies of an object with its joints drawn, and the labels of each joint.

        A joint opens from its home position towards its farther limit.
        """
        model = assets.robot(thing.asset)
        home = {j.name: q for j, q in zip(model.movable, model.home, strict=True)}
        own = {b.name: b for b in scene.bodies if b.instance_id == thing.instance_id}
        T_world_base = _base_pose(thing, model, own)
        stated: list[tuple[str, str]] = []
        positions = {name: home[name] for name in home}
        for joint in model.movable:
            if joint.mimic:
                continue
            is_open, opening = self.is_open.draw(rng), self.opening.draw(rng)
            low, high = position_limits(joint, model)
            start = home[joint.name]
            limit = high if high - start >= start - low else low
            for step in (*_STEPS, 0.0):
                share = round(opening * step, 3) if is_open else 0.0
                positions[joint.name] = round(start + share * (limit - start), 6)
                tried = _placed(thing, model, T_world_base, positions, own)
                if share == 0.0 or all(
                    _is_free(scene, assets, body, next(iter(own.values())), body.T_world_body)
                    for body in tried
                    if body != own[body.name]
                ):
                    break
            own = {body.name: body for body in _placed(thing, model, T_world_base, positions, own)}
            stated.append((f"open_{joint.name}", f"{share:.3g}"))
        poses = link_poses(model, SE3(), positions_of(model.joints, positions))
        values = zip(model.movable, positions_of(model.joints, positions), strict=True)
        for joint, value in values:
            name = f"joint_{joint.name}"
            axis = poses[joint.child].rotate(np.array(joint.axis))
            stated += [
                (name, f"{value:.4g}"),
                (f"{name}_type", joint.kind),
                (f"{name}_limits", f"{joint.lower:.4g} {joint.upper:.4g}"),
                (f"{name}_axis", " ".join(f"{v + 0.0:.4g}" for v in np.round(axis, 6))),
            ]
        return tuple(own.values()), stated


def _jointed_things(scene: Scene, assets: AssetIndex) -> Iterator[Instance]:
    """Yield the instances that are made of links, but no robots that goals move."""
    robots = {a.instance_id for a in scene.articulations}
    for thing in scene.instances:
        jointed = thing.parts and thing.instance_id not in robots and thing.asset
        if jointed and assets.get(thing.asset).kind == "robot":
            yield thing


def _base_pose(thing: Instance, model: RobotModel, own: Mapping[str, Body]) -> SE3:
    """``T_world_base`` of an object in its home position."""
    poses = link_poses(model, SE3(), model.home)
    name, body = next(iter(own.items()))
    link = name.removeprefix(f"{thing.name}/")
    return body.T_world_body @ poses[link].inverse()


def _placed(
    thing: Instance,
    model: RobotModel,
    T_world_base: SE3,
    positions: Mapping[str, float],
    own: Mapping[str, Body],
) -> tuple[Body, ...]:
    """The bodies of an object at joint positions [rad or m]."""
    poses = link_poses(model, T_world_base, positions_of(model.joints, positions))
    return tuple(
        replace(body, T_world_body=poses[name.removeprefix(f"{thing.name}/")].rounded())
        for name, body in own.items()
    )


def _stream(piece: Body, mouth_m: Vec3, assets: AssetIndex) -> Body:
    """The water that falls from a tap of a piece; it belongs to the piece's instance."""
    drain_m = keypoint_m(assets, piece.asset, DRAIN)
    assert drain_m is not None, f"{piece.asset} has no keypoint {DRAIN}"
    asset = str(AssetId("tap_stream", {"length_m": round(mouth_m[2] - drain_m[2], 4)}))
    pose = (piece.T_world_body @ SE3(mouth_m)).rounded()
    number, group = piece.instance_id, piece.group
    return Body(f"{piece.name}/water", asset, pose, instance_id=number, group=group, collides=False)


def _find_parts(scene: Scene) -> Iterator[tuple[Body, Body, Joint]]:
    bodies = {body.name: body for body in scene.bodies}
    for body in scene.bodies:
        piece, _, part = body.name.rpartition("/")
        if part in JOINTS and piece in bodies and bodies[piece].instance_id == body.instance_id:
            yield body, bodies[piece], JOINTS[part]


def _open(
    scene: Scene, assets: AssetIndex, part: Body, piece: Body, joint: Joint, share: float
) -> tuple[Body, float]:
    """The part at the largest opening tried that is free; its share of the joint's range."""
    at_m = keypoint_m(assets, piece.asset, joint.keypoint)
    assert at_m is not None, f"{piece.asset} has no keypoint {joint.keypoint}"
    for step in _STEPS:
        opening = round(share * step, 3)
        pose = part_pose(piece.T_world_body, at_m, joint, opening * joint.limit)
        if opening == 0.0 or joint.axis == "y" or _is_free(scene, assets, part, piece, pose):
            return replace(part, T_world_body=pose), opening
    closed = part_pose(piece.T_world_body, at_m, joint, 0.0)
    return replace(part, T_world_body=closed), 0.0


def _is_free(scene: Scene, assets: AssetIndex, part: Body, piece: Body, pose: SE3) -> bool:
    """Whether a part there overlaps nothing but its own piece, the piece's wall, and the floor."""
    frame = free_space.Footprint.of(piece.T_world_body, assets.bounds_m(piece.asset)).rectangle
    own = free_space.Footprint.of(pose, assets.bounds_m(part.asset)).rectangle
    low, high = _heights_m(pose, assets.bounds_m(part.asset))
    x, y, _ = pose.translation_m
    for body in scene.bodies:
        if body.instance_id in (0, part.instance_id):
            continue
        bx, by, _ = body.T_world_body.translation_m
        if math.hypot(bx - x, by - y) > 6.0:
            continue
        bounds = assets.bounds_m(body.asset)
        other_low, other_high = _heights_m(body.T_world_body, bounds)
        if other_low > high - 0.002 or other_high < low + 0.025:
            continue
        there = free_space.Footprint.of(body.T_world_body, bounds, body.scale).rectangle
        if overlap_of(own, there) and not ("/wall_" in body.name and overlap_of(frame, there)):
            return False
    return True


def _heights_m(pose: SE3, bounds_m: tuple[Vec3, Vec3]) -> tuple[float, float]:
    z = pose.translation_m[2]
    return z + bounds_m[0][2], z + bounds_m[1][2]
