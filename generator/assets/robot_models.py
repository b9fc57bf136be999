"""Robot models from a description and its index entry."""

from dataclasses import replace
from itertools import combinations

from gen_data.assets import asset_folder, robot_formats, robot_tools
from gen_data.assets.folder_index import RobotEntry
from gen_data.assets.robot_description import RobotDescription, rest_position
from gen_data.core import errors, kinematics, se3
from gen_data.core.asset_types import Gripper, RobotModel

_TOLERANCE = 10.0**-kinematics.POSITION_DECIMALS
"""Tolerance when comparing positions [rad or m]."""


def describe_robot(folder: asset_folder.Folder, entry: RobotEntry) -> RobotDescription:
    """Links and joints of a robot with its tool.

    Raises:
        AssetError: its description is malformed, or has no such flange.
    """
    arm = robot_formats.read_description(folder, entry.file)
    if entry.tool is None:
        return arm
    hand = robot_formats.read_description(folder, entry.tool.file) if entry.tool.file else None
    return robot_tools.with_tool(arm, entry.tool, str(folder.root / entry.file), hand)


def robot_model(
    robot_id: str, described: RobotDescription, entry: RobotEntry, place: str
) -> RobotModel:
    """Kinematics of a robot; asset ``<robot id>/l`` is the geometry of link ``l``.

    Raises:
        AssetError: if the entry names unknown joints or links, or a position outside its joint's
            limits.
    """
    _check_names(described, entry, place)
    robot = RobotModel(
        links=tuple(described.links),
        joints=described.joints,
        visuals={n: f"{robot_id}/{n}" for n, link in described.links.items() if link.visuals},
        collisions={n: f"{robot_id}/{n}" for n, link in described.links.items() if link.collisions},
        home=_home_positions(described, entry, place),
        gripper=_make_gripper(entry),
        no_collide=frozenset(),
        workspace_from_m=entry.workspace_from_m,
    )
    return replace(robot, no_collide=frozenset(_permanent_contacts(robot) | set(entry.touching)))


def _check_names(described: RobotDescription, entry: RobotEntry, place: str) -> None:
    joints, links = [j.name for j in described.joints if j.movable], list(described.links)
    named = [(name, joints, "movable joint") for name in entry.home]
    if entry.gripper:
        named += [(name, joints, "movable joint") for name in entry.gripper.finger_joints]
    named += [(link, links, "link") for pair in entry.touching for link in pair]
    if entry.gripper:
        named.append((entry.gripper.link, links, "link"))
    for name, known, what in named:
        if name not in known:
            raise errors.AssetError(
                f"{place}: no {what} '{name}'{errors.did_you_mean(name, known)}; "
                f"correct the entry '{entry.id}' of the asset index"
            )


def _home_positions(
    described: RobotDescription, entry: RobotEntry, place: str
) -> tuple[float, ...]:
    """Home position of every movable joint; mimic joints follow their leaders.

    Raises:
        AssetError: if a position is outside its joint's limits, or the entry gives a mimic joint a
            position that contradicts its leader's.
    """
    movable = [joint for joint in described.joints if joint.movable]
    wanted = {**{j.name: rest_position(j) for j in movable}, **described.home, **entry.home}
    given = {j.name: wanted[j.name] for j in movable if not j.mimic}
    positions = kinematics.positions_of(described.joints, given)
    for joint, position in zip(movable, positions, strict=True):
        correct = f"correct the entry '{entry.id}' of the asset index"
        if not joint.lower - _TOLERANCE <= position <= joint.upper + _TOLERANCE:
            raise errors.AssetError(
                f"{place}: home position {position} of joint '{joint.name}' is not within "
                f"[{joint.lower}, {joint.upper}]; {correct}"
            )
        if abs(entry.home.get(joint.name, position) - position) > _TOLERANCE:
            raise errors.AssetError(
                f"{place}: home position {entry.home[joint.name]} of joint '{joint.name}' "
                f"contradicts {position:g} by its leader '{joint.mimic}'; {correct}"
            )
    return positions


def _make_gripper(entry: RobotEntry) -> Gripper | None:
    gripper = entry.gripper
    if entry.tool is not None and not entry.tool.file:
        return robot_tools.tool_gripper(entry.tool)
    if gripper is None:
        return None
    grasp = se3.SE3((0.0, 0.0, gripper.grasp_offset_m))
    return Gripper(gripper.link, grasp, gripper.finger_joints, gripper.stroke_m, gripper.open_at)


def _permanent_contacts(robot: RobotModel) -> set[tuple[str, str]]:
    """Link pairs within a rigid group, within adjacent groups, and within the gripper."""
    piece = {robot.links[0]: 0}
    connected: set[tuple[int, int]] = set()
    for joint in robot.joints:
        above = piece[joint.parent]
        piece[joint.child] = len(piece) if joint.movable else above
        connected |= {(above, piece[joint.child]), (piece[joint.child], above)}
    pairs = {
        (a, b)
        for a, b in combinations(piece, 2)
        if piece[a] == piece[b] or (piece[a], piece[b]) in connected
    }
    # The bars of a finger linkage overlap at their pins.
    return pairs | set(combinations(kinematics.finger_links(robot), 2))
