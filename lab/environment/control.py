"""Control of an arm: from actions in [-1, 1] to targets of its motors.

The last number of every action is the opening of the gripper, from -1 closed to 1 open.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gen_data.config.yaml_tree import Node
from gen_data.core.asset_types import RobotModel
from gen_data.core.kinematics import arm_joints, position_limits
from gen_data.core.se3 import SE3, Quaternion, Vec3, multiply_quaternions
from gen_data.lab.environment.settings import EnvSettings, refuse_field
from gen_data.physics.manipulation import inverse_kinematics

Action = NDArray[np.float32]

HAND_DOWN: Quaternion = (0.0, 1.0, 0.0, 0.0)
"""Rotation of the grasp frame in the base frame when the hand points down."""
_JOINTS_MIN = 6
"""Fewer joints cannot take the hand to an arbitrary pose."""


@dataclass(frozen=True, slots=True)
class Command:
    """Targets of the motors: positions of the arm joints [rad or m], opening in [0, 1]."""

    positions: tuple[float, ...]
    opening: float


class Control(Protocol):
    """Meaning of actions."""

    @property
    def size(self) -> int:
        """Length of an action."""
        ...

    def command(self, action: Action, before: Command) -> Command | None:
        """Targets after the latest ones; None if the arm cannot reach the requested ones."""
        ...


@dataclass(frozen=True, slots=True)
class JointControl:
    """Actions are joint positions, from the lowest to the highest of each [rad or m]."""

    low: tuple[float, ...]
    high: tuple[float, ...]

    @property
    def size(self) -> int:
        """Joints and gripper."""
        return len(self.low) + 1

    def command(self, action: Action, before: Command) -> Command:
        """Positions within the limits."""
        del before
        return Command(tuple(_spread(action[:-1], self.low, self.high)), _opening(action))

    def encode(self, positions: Sequence[float], opening: float) -> Action:
        """The action for positions of the arm joints [rad or m] and an opening in [0, 1]."""
        return _action([*_squeeze(positions, self.low, self.high), 2.0 * opening - 1.0])


@dataclass(frozen=True, slots=True)
class PoseControl:
    """Actions are poses of the grasp frame in the frame of the arm's base.

    Three numbers are the position in a box, three a rotation vector over pi, by which the hand is
    turned from pointing down.

    Attributes:
        chain: The arm.
        low_m, high_m: Corners of the box.
    """

    chain: inverse_kinematics.Chain
    low_m: Vec3
    high_m: Vec3

    @property
    def size(self) -> int:
        """Position, rotation and gripper."""
        return 7

    def command(self, action: Action, before: Command) -> Command | None:
        """Joint positions near the latest targets if there are any, else others."""
        x, y, z = _spread(action[:3], self.low_m, self.high_m)
        turn = quaternion_of([math.pi * float(v) for v in action[3:6]])
        T_base_grasp = SE3((x, y, z), multiply_quaternions(turn, HAND_DOWN))
        found = inverse_kinematics.solve_near(self.chain, T_base_grasp, before.positions)
        found = found or next(inverse_kinematics.solve_all(self.chain, T_base_grasp), None)
        return None if found is None else Command(found, _opening(action))

    def encode(
        self, position_m: Vec3, opening: float, rotation_rad: Vec3 = (0.0, 0.0, 0.0)
    ) -> Action:
        """The action for a position in the base frame, and a rotation from pointing down."""
        at = _squeeze(position_m, self.low_m, self.high_m)
        return _action([*at, *(v / math.pi for v in rotation_rad), 2.0 * opening - 1.0])


@dataclass(frozen=True, slots=True)
class DeltaControl:
    """Actions move the hand: three shares of a distance, and three of an angle.

    Both are along and about the axes of the arm's base, from the latest targets on.

    Attributes:
        chain: The arm.
        step_m: Largest motion along each axis.
        step_rad: Largest rotation about each axis.
    """

    chain: inverse_kinematics.Chain
    step_m: float
    step_rad: float

    @property
    def size(self) -> int:
        """Motion, rotation and gripper."""
        return 7

    def command(self, action: Action, before: Command) -> Command | None:
        """The solution of inverse kinematics next to the latest targets."""
        pose = inverse_kinematics.grasp_pose(self.chain, before.positions)
        x, y, z = (
            a + self.step_m * float(b) for a, b in zip(pose.translation_m, action[:3], strict=True)
        )
        turn = quaternion_of([self.step_rad * float(v) for v in action[3:6]])
        target = SE3((x, y, z), multiply_quaternions(turn, pose.quaternion_wxyz))
        found = inverse_kinematics.solve_near(self.chain, target, before.positions)
        return None if found is None else Command(found, _opening(action))

    def encode(
        self, motion_m: Vec3, opening: float, rotation_rad: Vec3 = (0.0, 0.0, 0.0)
    ) -> Action:
        """The action for a motion and a rotation vector in the base frame."""
        turn = (v / self.step_rad for v in rotation_rad)
        return _action([*(v / self.step_m for v in motion_m), *turn, 2.0 * opening - 1.0])


def make_control(robot: RobotModel, settings: EnvSettings, document: Node) -> Control:
    """The control of a robot with a gripper; ``document`` is the source of the settings.

    Raises:
        ConfigError: the arm has too few joints for poses, or cannot reach the workspace.
    """
    if settings.control == "joint":
        low, high = zip(*(position_limits(j, robot) for j in arm_joints(robot)), strict=True)
        return JointControl(low, high)
    assert robot.gripper is not None
    chain = inverse_kinematics.make_chain(robot, robot.gripper)
    if len(chain.solved) < _JOINTS_MIN:
        fact = (
            f"'{settings.control}' needs an arm with {_JOINTS_MIN} joints, this one has "
            f"{len(chain.solved)}; expected 'joint'"
        )
        refuse_field(document, "control", fact)
    if settings.control == "cartesian_delta":
        return DeltaControl(chain, settings.delta_m_max, math.radians(settings.delta_deg_max))
    low_m, high_m = settings.workspace_m
    nearest = [min(max(0.0, a), b) for a, b in zip(low_m, high_m, strict=True)]
    if math.hypot(*nearest) > chain.reach_m:
        fact = (
            f"its nearest point is {math.hypot(*nearest):.2f} m from the base of the arm, which "
            f"cannot reach farther than {chain.reach_m:.2f} m"
        )
        refuse_field(document, "workspace_m", fact)
    return PoseControl(chain, low_m, high_m)


def quaternion_of(rotation_rad: Sequence[float]) -> Quaternion:
    """Unit quaternion of a rotation vector [rad]."""
    angle = math.hypot(*rotation_rad)
    share = 0.5 if angle < 1e-12 else math.sin(0.5 * angle) / angle
    x, y, z = (share * v for v in rotation_rad)
    return (math.cos(0.5 * angle), x, y, z)


def _opening(action: Action) -> float:
    return 0.5 * (1.0 + float(action[-1]))


def _spread(action: Action, low: Sequence[float], high: Sequence[float]) -> list[float]:
    """From [-1, 1] to [low, high]."""
    return [a + 0.5 * (1.0 + float(v)) * (b - a) for v, a, b in zip(action, low, high, strict=True)]


def _squeeze(values: Sequence[float], low: Sequence[float], high: Sequence[float]) -> list[float]:
    """From [low, high] to [-1, 1]."""
    return [2.0 * (v - a) / (b - a) - 1.0 for v, a, b in zip(values, low, high, strict=True)]


def _action(values: Sequence[float]) -> Action:
    return np.clip(np.array(values, dtype=np.float32), -1.0, 1.0)
