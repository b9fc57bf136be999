"""From a URDF and its entry to a RobotModel."""

from __future__ import annotations

from generator.assets.catalogue import RobotEntry
from generator.assets.urdf import Urdf
from generator.core.errors import AssetError, did_you_mean
from generator.core.geometry import Gripper, Joint, RobotModel
from generator.core.se3 import SE3


def robot_model(robot_id: str, urdf: Urdf, entry: RobotEntry, place: str) -> RobotModel:
    """Kinematics of a robot; link ``l`` looks and collides as asset ``<robot id>/l``.

    Raises:
        AssetError: if the entry names joints or links that the URDF lacks, or a position beyond
            its joint's limits.
    """
    _check_names(urdf, entry, place)
    return RobotModel(
        links=tuple(urdf.links),
        joints=urdf.joints,
        visuals={n: f"{robot_id}/{n}" for n, link in urdf.links.items() if link.visuals},
        collisions={n: f"{robot_id}/{n}" for n, link in urdf.links.items() if link.collisions},
        home=tuple(_home(joint, entry, place) for joint in urdf.joints if joint.movable),
        gripper=_gripper(entry),
        no_collide=frozenset(_may_touch(urdf, entry)),
    )


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


def _home(joint: Joint, entry: RobotEntry, place: str) -> float:
    default = 0.0 if joint.lower <= 0.0 <= joint.upper else 0.5 * (joint.lower + joint.upper)
    position = entry.home.get(joint.name, default)
    if not joint.lower <= position <= joint.upper:
        raise AssetError(
            f"{place}: home position {position} of joint '{joint.name}' is not within "
            f"[{joint.lower}, {joint.upper}]; correct the entry '{entry.id}' of the asset index"
        )
    return position


def _gripper(entry: RobotEntry) -> Gripper | None:
    if entry.gripper is None:
        return None
    return Gripper(
        link=entry.gripper.link,
        T_link_grasp=SE3((0.0, 0.0, entry.gripper.grasp_offset_m)),
        finger_joints=entry.gripper.finger_joints,
        stroke_m=entry.gripper.stroke_m,
    )


def _may_touch(urdf: Urdf, entry: RobotEntry) -> set[tuple[str, str]]:
    """Links of one rigid piece, links of pieces that a joint connects, fingers, and the entry's."""
    piece = {next(iter(urdf.links)): 0}
    connected: set[tuple[int, int]] = set()
    for joint in urdf.joints:
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
    finger_joints = entry.gripper.finger_joints if entry.gripper else ()
    fingers = [joint.child for joint in urdf.joints if joint.name in finger_joints]
    pairs |= {(a, b) for k, a in enumerate(fingers) for b in fingers[k + 1 :]}
    return pairs | set(entry.touching)
