"""Initial goals of robot arms: joint positions, a pose to reach, or an object to hold."""

import math
from dataclasses import replace
from typing import Annotated, Literal

from pydantic import Field

from gen_data.config import distributions as dist
from gen_data.core.asset_types import Joint, RobotModel
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import ArmGoal, Articulation, Body, Scene
from gen_data.core.se3 import SE3, Vec3
from gen_data.core.streams import Rng
from gen_data.randomizers import base, placement

MODES = ("joints", "reach", "hold")
GRASP_MARGIN = 0.9
"""Widest object that a gripper holds, as a fraction of its stroke."""
FLIP = SE3(quaternion_wxyz=(0.0, 1.0, 0.0, 0.0))
"""Half a turn about X: the hand points down."""


class ArmConfiguration(base.RandomizerBase):
    """Draws a goal for every arm; physics takes the first collision-free candidate.

    Attributes:
        mode: joints: a configuration within the joint limits. reach: the hand above the workspace,
            pointing down. hold: like reach, with an object between the fingers; falls back to
            reach if no object fits the gripper.
        candidates: Number of candidate goals to draw.
        range_share: Fraction of each joint's range to use, around its middle.
        tilt_deg: Tilt of the hand from straight down.
        opening: Gripper opening: 0 closed, 1 fully open.
    """

    type: Literal["arm_configuration"] = "arm_configuration"
    stage: Literal["scene"] = "scene"
    mode: Annotated[dist.Name, dist.OneOf(MODES)] = dist.Choice(
        {"joints": 1.0, "reach": 2.0, "hold": 1.0}
    )
    candidates: int = Field(24, ge=1, le=256)
    range_share: float = Field(0.9, gt=0, le=1)
    tilt_deg: dist.NonNegative = dist.Uniform(0.0, 35.0)
    opening: dist.UnitInterval = dist.Uniform(0.0, 1.0)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene with a goal for every arm."""
        arms = scene.articulations
        arms = tuple(replace(a, goal=self._draw_goal(a, scene, assets, rng)) for a in arms)
        return replace(scene, articulations=arms)

    def _draw_goal(self, arm: Articulation, scene: Scene, assets: AssetIndex, rng: Rng) -> ArmGoal:
        mode = self.mode.draw(rng)
        robot = assets.robot(arm.asset)
        opening = round(self.opening.draw(rng), 4)
        held = _draw_graspable(scene, robot, assets, rng) if mode == "hold" else ""
        if mode == "joints" or robot.gripper is None:
            joints = tuple(self._draw_joints(robot, rng) for _ in range(self.candidates))
            return ArmGoal("joints", joint_candidates=joints, gripper_opening=opening)
        poses = tuple(draw_hand_pose(arm, self.tilt_deg, rng) for _ in range(self.candidates))
        if held:
            return ArmGoal(
                "hold", pose_candidates=poses, gripper_opening=opening, grasped_object=held
            )
        return ArmGoal("reach", pose_candidates=poses, gripper_opening=opening)

    def _draw_joints(self, robot: RobotModel, rng: Rng) -> tuple[float, ...]:
        return tuple(self._draw_position(joint, rng) for joint in arm_joints(robot))

    def _draw_position(self, joint: Joint, rng: Rng) -> float:
        low, high = joint.lower, joint.upper
        if joint.kind == "continuous":
            low, high = -math.pi, math.pi
        middle, half = 0.5 * (low + high), 0.5 * (high - low) * self.range_share
        return round(middle + half * float(rng.uniform(-1.0, 1.0)), 6)


def draw_hand_pose(arm: Articulation, tilt_deg: dist.NonNegative, rng: Rng) -> SE3:
    """Draw ``T_world_grasp`` in an arm's workspace, pointing down with a tilt in any direction."""
    low, high = arm.workspace_m
    x, y, z = (float(rng.uniform(a, b)) for a, b in zip(low, high, strict=True))
    tilt_rad = math.radians(tilt_deg.draw(rng))
    towards_rad = float(rng.uniform(0.0, 2.0 * math.pi))
    yaw_rad = float(rng.uniform(0.0, 2.0 * math.pi))
    return hand_pose((x, y, z), yaw_rad, tilt_rad, towards_rad)


def hand_pose(
    position_m: Vec3, yaw_rad: float, tilt_rad: float = 0.0, towards_rad: float = 0.0
) -> SE3:
    """Compute ``T_world_grasp`` of a hand that points down.

    Args:
        position_m: Origin of the grasp frame.
        yaw_rad: Rotation about Z.
        tilt_rad: Tilt of the hand from the vertical.
        towards_rad: Direction of the horizontal axis of the tilt.
    """
    cosine, sine = math.cos(0.5 * tilt_rad), math.sin(0.5 * tilt_rad)
    axis = (sine * math.cos(towards_rad), sine * math.sin(towards_rad), 0.0)
    lean = SE3(quaternion_wxyz=(cosine, *axis))
    return (SE3(position_m) @ lean @ SE3.about_z(yaw_rad) @ FLIP).rounded()


def arm_joints(robot: RobotModel) -> tuple[Joint, ...]:
    """Joints that a goal sets: all movable ones except fingers and mimic joints."""
    fingers = robot.gripper.finger_joints if robot.gripper else ()
    return tuple(j for j in robot.movable if not j.mimic and j.name not in fingers)


def _draw_graspable(scene: Scene, robot: RobotModel, assets: AssetIndex, rng: Rng) -> str:
    """Draw the name of an object that fits between the fingers; empty if there is none."""
    if robot.gripper is None:
        return ""
    limit_m = GRASP_MARGIN * robot.gripper.stroke_m
    fitting = [b.name for b in scene.bodies if b.group and _width_m(b, assets) < limit_m]
    return fitting[int(rng.integers(len(fitting)))] if fitting else ""


def _width_m(body: Body, assets: AssetIndex) -> float:
    """Smaller horizontal extent of an upright object."""
    return 2.0 * min(placement.half_extents_m(*assets.bounds_m(body.asset), body.scale)[:2])
