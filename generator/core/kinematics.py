"""Where a robot's links are: forward kinematics, and the bodies that show them.

Only ``+ - * / sqrt`` and the C library's sine and cosine, on plain floats.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from generator.core.geometry import Joint, RobotModel
from generator.core.scene import Articulation, Body
from generator.core.se3 import SE3

POSITION_DECIMALS = 6
"""Joint positions leave physics on this decimal grid [rad or m]."""


def link_poses(robot: RobotModel, T_world_base: SE3, positions: Sequence[float]) -> dict[str, SE3]:
    """``T_world_link`` of every link.

    Args:
        robot: The kinematic tree.
        T_world_base: Pose of the root link.
        positions: One per movable joint, in the model's order [rad or m].
    """
    if len(positions) != len(robot.movable):
        raise ValueError(f"{len(robot.movable)} joint positions needed, got {len(positions)}")
    poses = {robot.links[0]: T_world_base}
    remaining = iter(positions)
    for joint in robot.joints:
        pose = poses[joint.parent] @ joint.T_parent_joint
        poses[joint.child] = pose @ joint_motion(joint, next(remaining)) if joint.movable else pose
    return poses


def joint_motion(joint: Joint, position: float) -> SE3:
    """Pose of the child link in the joint frame at a position [rad or m]."""
    x, y, z = joint.axis
    if joint.kind == "prismatic":
        return SE3((x * position, y * position, z * position))
    s = math.sin(0.5 * position)
    return SE3(quaternion_wxyz=(math.cos(0.5 * position), x * s, y * s, z * s))


def link_bodies(
    articulation: Articulation, robot: RobotModel, parts: tuple[str, ...]
) -> tuple[Body, ...]:
    """The bodies that show a robot at ``articulation.joint_positions``, one per visible link.

    Args:
        articulation: Where the robot stands and how its joints are.
        robot: Its model.
        parts: ``Instance.parts`` of the robot; a link that is not listed has part id 0.
    """
    poses = link_poses(robot, articulation.T_world_base, articulation.joint_positions)
    part_ids = {link: k for k, link in enumerate(parts, 1)}
    return tuple(
        Body(
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


def rounded_positions(positions: Sequence[float]) -> tuple[float, ...]:
    """Joint positions on the decimal grid that collision checks and labels share."""
    return tuple(round(value, POSITION_DECIMALS) + 0.0 for value in positions)


def is_arm_joint(joint: Joint, robot: RobotModel) -> bool:
    """Whether a goal gives a position for it: no finger, follows nobody."""
    fingers = robot.gripper.finger_joints if robot.gripper else ()
    return joint.movable and not joint.mimic and joint.name not in fingers


def all_positions(
    robot: RobotModel, arm_positions: Sequence[float], opening: float
) -> tuple[float, ...]:
    """Positions of all movable joints.

    Args:
        robot: Its model.
        arm_positions: One per arm joint, in order [rad or m].
        opening: Of the gripper, in [0, 1].
    """
    fingers = robot.gripper.finger_joints if robot.gripper else ()
    remaining = iter(arm_positions)
    positions: dict[str, float] = {}
    for joint in robot.movable:
        if joint.name in fingers:
            positions[joint.name] = joint.lower + opening * (joint.upper - joint.lower)
        elif is_arm_joint(joint, robot):
            positions[joint.name] = next(remaining)
    for joint in robot.movable:
        if joint.name not in positions:
            positions[joint.name] = positions.get(joint.mimic, 0.0)
    return rounded_positions([positions[joint.name] for joint in robot.movable])


def within_limits(robot: RobotModel, positions: Sequence[float]) -> bool:
    """Whether every joint is inside its limits, to within the rounding of positions."""
    slack = 10.0**-POSITION_DECIMALS
    return all(
        joint.kind == "continuous" or joint.lower - slack <= position <= joint.upper + slack
        for joint, position in zip(robot.movable, positions, strict=True)
    )


def rigid_group(robot: RobotModel, link: str) -> frozenset[str]:
    """The link and all others that no joint motion can move against it."""
    root_of: dict[str, str] = {robot.links[0]: robot.links[0]}
    for joint in robot.joints:
        root_of[joint.child] = joint.child if joint.movable else root_of[joint.parent]
    return frozenset(name for name, root in root_of.items() if root == root_of[link])


def finger_links(robot: RobotModel) -> tuple[str, ...]:
    """Links that move with the gripper's joints, in order; empty without a gripper."""
    moving: dict[str, None] = {}
    fingers = robot.gripper.finger_joints if robot.gripper else ()
    for joint in robot.joints:
        if joint.name in fingers or joint.parent in moving:
            moving[joint.child] = None
    return tuple(moving)
