"""From a URDF and its entry to a RobotModel."""

from __future__ import annotations

from dataclasses import replace

from gen_data.generator.assets.folder_index import RobotEntry
from gen_data.generator.assets.urdf import Urdf
from gen_data.generator.core.asset_types import Gripper, Joint, RobotModel
from gen_data.generator.core.errors import AssetError, did_you_mean
from gen_data.generator.core.kinematics import POSITION_DECIMALS, finger_links, positions_of
from gen_data.generator.core.se3 import SE3

_SLACK = 10.0**-POSITION_DECIMALS
"""Positions that differ by less are the same [rad or m]."""


def robot_model(robot_id: str, urdf: Urdf, entry: RobotEntry, place: str) -> RobotModel:
    """Kinematics of a robot; link ``l`` looks and collides as asset ``<robot id>/l``.

    Raises:
        AssetError: if the entry names joints or links that the URDF lacks, or a position beyond
            its joint's limits.
    """
    _check_names(urdf, entry, place)
    robot = RobotModel(
        links=tuple(urdf.links),
        joints=urdf.joints,
        visuals={n: f"{robot_id}/{n}" for n, link in urdf.links.items() if link.visuals},
        collisions={n: f"{robot_id}/{n}" for n, link in urdf.links.items() if link.collisions},
        home=_home(urdf, entry, place),
        gripper=_gripper(entry),
        no_collide=frozenset(),
    )
    return replace(robot, no_collide=frozenset(_touching_pairs(robot) | set(entry.touching)))


def _check_names(urdf: Urdf, entry: RobotEntry, place: str) -> None:
    joints = [joint.name for joint in urdf.joints if joint.movable]
    links = list(urdf.links)
    gripper = entry.gripper
    named_joints = [*entry.home, *(gripper.finger_joints if gripper else ())]
    named_links = [*(link for pair in entry.touching for link in pair)]
    named_links += [gripper.link] if gripper else []
    for names, known, what in (
        (named_joints, joints, "movable joint"),
        (named_links, links, "link"),
    ):
        for name in names:
            if name not in known:
                raise AssetError(
                    f"{place}: it has no {what} '{name}'{did_you_mean(name, known)}; "
                    f"correct the entry '{entry.id}' of the asset index"
                )


def _home(urdf: Urdf, entry: RobotEntry, place: str) -> tuple[float, ...]:
    """A position per movable joint; joints that mimic others follow them.

    Raises:
        AssetError: if a position is beyond its joint's limits, or the entry gives a position to a
            joint that follows another and is elsewhere then.
    """
    movable = [joint for joint in urdf.joints if joint.movable]
    given = {j.name: entry.home.get(j.name, _default_position(j)) for j in movable if not j.mimic}
    positions = positions_of(urdf.joints, given)
    for joint, position in zip(movable, positions, strict=True):
        correct = f"correct the entry '{entry.id}' of the asset index"
        if not joint.lower - _SLACK <= position <= joint.upper + _SLACK:
            raise AssetError(
                f"{place}: home position {position} of joint '{joint.name}' is not within "
                f"[{joint.lower}, {joint.upper}]; {correct}"
            )
        if abs(entry.home.get(joint.name, position) - position) > _SLACK:
            raise AssetError(
                f"{place}: home position {entry.home[joint.name]} of joint '{joint.name}', which "
                f"mimics '{joint.mimic}' and is at {position:g} then; {correct}"
            )
    return positions


def _default_position(joint: Joint) -> float:
    return 0.0 if joint.lower <= 0.0 <= joint.upper else 0.5 * (joint.lower + joint.upper)


def _gripper(entry: RobotEntry) -> Gripper | None:
    if entry.gripper is None:
        return None
    return Gripper(
        link=entry.gripper.link,
        T_link_grasp=SE3((0.0, 0.0, entry.gripper.grasp_offset_m)),
        finger_joints=entry.gripper.finger_joints,
        stroke_m=entry.gripper.stroke_m,
        open_at=entry.gripper.open_at,
    )


def _touching_pairs(robot: RobotModel) -> set[tuple[str, str]]:
    """Pairs of links in one rigid piece, in pieces that a joint connects, and in the fingers."""
    piece = {robot.links[0]: 0}
    connected: set[tuple[int, int]] = set()
    for joint in robot.joints:
        above = piece[joint.parent]
        piece[joint.child] = len(piece) if joint.movable else above
        connected |= {(above, piece[joint.child]), (piece[joint.child], above)}
    names = list(piece)
    pairs = {
        (a, b)
        for k, a in enumerate(names)
        for b in names[k + 1 :]
        if piece[a] == piece[b] or (piece[a], piece[b]) in connected
    }
    # The bars of a linkage overlap where pins join them.
    fingers = finger_links(robot)
    return pairs | {(a, b) for k, a in enumerate(fingers) for b in fingers[k + 1 :]}
