"""Forward kinematics of robots, and the bodies of their links.

Uses only ``+ - * / sqrt`` and the C library's sine and cosine, on plain floats.
"""

import math
from collections.abc import Mapping, Sequence

from gen_data.core import errors, scene
from gen_data.core.asset_types import Gripper, Joint, RobotModel
from gen_data.core.se3 import SE3

POSITION_DECIMALS = 6
"""Decimals of joint positions [rad or m] that physics returns."""


def link_poses(robot: RobotModel, T_world_base: SE3, positions: Sequence[float]) -> dict[str, SE3]:
    """``T_world_link`` of every link; one position [rad or m] per movable joint, in their order."""
    if len(positions) != len(robot.movable):
        raise ValueError(f"{len(robot.movable)} joint positions needed, got {len(positions)}")
    poses = {robot.links[0]: T_world_base}
    remaining = iter(positions)
    for joint in robot.joints:
        pose = poses[joint.parent] @ joint.T_parent_joint
        poses[joint.child] = (
            pose @ joint_transform(joint, next(remaining)) if joint.movable else pose
        )
    return poses


def joint_transform(joint: Joint, position: float) -> SE3:
    """Pose of the child link in the joint frame at a position [rad or m]."""
    x, y, z = joint.axis
    if joint.kind == "prismatic":
        return SE3((x * position, y * position, z * position))
    s = math.sin(0.5 * position)
    return SE3(quaternion_wxyz=(math.cos(0.5 * position), x * s, y * s, z * s))


def make_link_bodies(
    articulation: scene.Articulation, robot: RobotModel, parts: tuple[str, ...]
) -> tuple[scene.Body, ...]:
    """The bodies of a robot's visible links at ``articulation.joint_positions``.

    ``parts`` are ``Instance.parts`` of the robot; a link that is not listed has part id 0.
    """
    poses = link_poses(robot, articulation.T_world_base, articulation.joint_positions)
    part_ids = {link: k for k, link in enumerate(parts, 1)}
    return tuple(
        scene.Body(
            name=f"{articulation.name}/{link}",
            asset=robot.visuals[link],
            T_world_body=poses[link].rounded(),
            instance_id=articulation.instance_id,
            part_id=part_ids.get(link, 0),
            motion="kinematic",
            collides=False,
        )
        for link in robot.links
        if link in robot.visuals
    )


def round_positions(positions: Sequence[float]) -> tuple[float, ...]:
    """Round joint positions; collision checks and labels use the same values."""
    return tuple(round(value, POSITION_DECIMALS) + 0.0 for value in positions)


def is_arm_joint(joint: Joint, robot: RobotModel) -> bool:
    """Whether goals set a joint's position: it is neither a finger nor mimics another joint."""
    return joint.movable and not joint.mimic and joint.name not in _finger_names(robot)


def arm_joints(robot: RobotModel) -> list[Joint]:
    """The joints whose positions goals set, in order."""
    return [joint for joint in robot.movable if is_arm_joint(joint, robot)]


def leader_of(joint: Joint, joints: Sequence[Joint]) -> tuple[Joint, float, float]:
    """The joint, of all ``joints`` of its robot, that determines a joint's position by ``mimic``.

    Returns:
        Leader, multiplier and offset: ``position = multiplier * leader's position + offset``
        [rad or m]. A joint without ``mimic`` is its own leader, with 1 and 0.

    Raises:
        ValueError: a mimicked joint does not exist or is fixed, or joints mimic one another in a
            circle.
    """
    named = {other.name: other for other in joints} if joint.mimic else {}
    leader, multiplier, offset = joint, 1.0, 0.0
    for _ in joints:
        if not leader.mimic:
            return leader, multiplier, offset
        followed = named.get(leader.mimic)
        if followed is None:
            near = errors.did_you_mean(leader.mimic, named)
            raise ValueError(
                f"joint '{leader.name}' mimics '{leader.mimic}', which does not exist{near}"
            )
        if not followed.movable:
            raise ValueError(f"joint '{leader.name}' mimics '{followed.name}', which is fixed")
        offset += multiplier * leader.mimic_offset
        multiplier *= leader.mimic_multiplier
        leader = followed
    raise ValueError(f"joint '{joint.name}' mimics itself through '{joint.mimic}'")


def position_limits(joint: Joint, robot: RobotModel) -> tuple[float, float]:
    """Lowest and highest position [rad or m] that keep a joint and its followers within limits.

    Followers mimic it; the joint itself must not mimic another. Lowest > highest if no position
    satisfies all. A continuous joint that no other mimics has -pi and pi.
    """
    low, high = (-math.pi, math.pi) if joint.kind == "continuous" else (joint.lower, joint.upper)
    for other in robot.movable:
        if other.mimic and other.kind != "continuous":
            leader, multiplier, offset = leader_of(other, robot.joints)
            if leader == joint and multiplier != 0.0:
                ends = ((other.lower - offset) / multiplier, (other.upper - offset) / multiplier)
                low, high = max(low, min(ends)), min(high, max(ends))
    return low, high


def positions_of(joints: Sequence[Joint], given: Mapping[str, float]) -> tuple[float, ...]:
    """Positions of all movable joints in order, including joints that mimic others.

    ``given`` has the position [rad or m] of every movable joint without ``mimic``, by name.
    """
    positions = []
    for joint in (j for j in joints if j.movable):
        leader, multiplier, offset = leader_of(joint, joints)
        positions.append(multiplier * given[leader.name] + offset)
    return tuple(positions)


def finger_position(joint: Joint, gripper: Gripper, opening: float) -> float:
    """Position of a finger joint [rad or m] at an opening of its gripper in [0, 1]."""
    share = opening if gripper.open_at == "upper" else 1.0 - opening
    return joint.lower + share * (joint.upper - joint.lower)


def gripper_opening(robot: RobotModel, positions: Sequence[float]) -> float:
    """Opening of the gripper in [0, 1]; 0 without one. Positions as for ``link_poses``."""
    for joint, position in zip(robot.movable, positions, strict=True):
        if (
            robot.gripper
            and joint.name in robot.gripper.finger_joints
            and joint.upper > joint.lower
        ):
            share = (position - joint.lower) / (joint.upper - joint.lower)
            return share if robot.gripper.open_at == "upper" else 1.0 - share
    return 0.0


def all_positions(
    robot: RobotModel, arm_positions: Sequence[float], opening: float
) -> tuple[float, ...]:
    """Positions of all movable joints.

    ``arm_positions`` are positions of the arm joints, in order [rad or m]; ``opening`` of the
    gripper is in [0, 1].
    """
    remaining = iter(arm_positions)
    given: dict[str, float] = {}
    for joint in robot.movable:
        if is_arm_joint(joint, robot):
            given[joint.name] = next(remaining)
        elif robot.gripper and not joint.mimic:
            given[joint.name] = finger_position(joint, robot.gripper, opening)
    return round_positions(positions_of(robot.joints, given))


def is_within_limits(robot: RobotModel, positions: Sequence[float]) -> bool:
    """Whether every joint is inside its limits, to within the rounding of positions."""
    slack = 10.0**-POSITION_DECIMALS
    return all(
        joint.kind == "continuous" or joint.lower - slack <= position <= joint.upper + slack
        for joint, position in zip(robot.movable, positions, strict=True)
    )


def rigid_group(robot: RobotModel, link: str) -> frozenset[str]:
    """The link and all links that are rigidly connected to it."""
    root_of: dict[str, str] = {robot.links[0]: robot.links[0]}
    for joint in robot.joints:
        root_of[joint.child] = joint.child if joint.movable else root_of[joint.parent]
    return frozenset(name for name, root in root_of.items() if root == root_of[link])


def finger_links(robot: RobotModel) -> tuple[str, ...]:
    """Links moved by the gripper's joints, in order; empty without a gripper."""
    moving: dict[str, None] = {}
    fingers = _finger_names(robot)
    for joint in robot.joints:
        driven = joint.movable and leader_of(joint, robot.joints)[0].name in fingers
        if driven or joint.name in fingers or joint.parent in moving:
            moving[joint.child] = None
    return tuple(moving)


def _finger_names(robot: RobotModel) -> tuple[str, ...]:
    """Names of the joints that open the gripper; empty without one."""
    return robot.gripper.finger_joints if robot.gripper else ()
