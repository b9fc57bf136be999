"""Observations: a policy's input in an episode."""

from typing import TYPE_CHECKING, Any

import numpy as np

from gen_data.core.asset_types import RobotModel
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.kinematics import arm_joints, position_limits
from gen_data.lab.environment.rollout import Rollout
from gen_data.lab.environment.settings import EnvSettings
from gen_data.physics.manipulation.joint_trajectories import speed_max

if TYPE_CHECKING:
    from gymnasium import spaces

CHANNELS = frozenset({Channel.RGB, Channel.Z_DEPTH})
_FAR_M = 3.0
"""Positions farther than this from the arm's base, along an axis, are observed at this limit."""

Observation = dict[str, Any]


def observation_space(robot: RobotModel, image: Intrinsics, settings: EnvSettings) -> "spaces.Dict":
    """The space of ``observe``.

    ``rgb`` is uint8 [h, w, 3], ``depth`` float32 [h, w, 1] along the optical axis [m].
    ``joint_positions`` and ``joint_velocities`` refer to the arm joints [rad or m, and per s],
    ``gripper_opening`` is in [0, 1]. ``hand_position`` [m] and ``hand_rotation`` (quaternion w, x,
    y, z) are the grasp frame's in the frame of the arm's base, as are ``object_position`` and
    ``goal_position``, the middles of the two bodies of the task's first condition of success;
    zeros without a task. ``proximity`` is the distance from the fingers to the nearest body [m],
    ``holding`` is 1 with a body in the hand.
    """
    from gymnasium import spaces

    joints = arm_joints(robot)
    low, high = np.array([position_limits(joint, robot) for joint in joints], np.float32).T
    fastest = np.array([speed_max(joint) for joint in joints], np.float32)
    height, width = image.height_px, image.width_px

    def box(low: float, high: float, *shape: int) -> "spaces.Box":
        return spaces.Box(low, high, shape, np.float32)

    return spaces.Dict(
        {
            "rgb": spaces.Box(0, 255, (height, width, 3), np.uint8),
            "depth": box(0.0, settings.depth_m_max, height, width, 1),
            "joint_positions": spaces.Box(low, high, dtype=np.float32),
            "joint_velocities": spaces.Box(-fastest, fastest, dtype=np.float32),
            "gripper_opening": box(0.0, 1.0, 1),
            "hand_position": box(-_FAR_M, _FAR_M, 3),
            "hand_rotation": box(-1.0, 1.0, 4),
            "object_position": box(-_FAR_M, _FAR_M, 3),
            "goal_position": box(-_FAR_M, _FAR_M, 3),
            "proximity": box(0.0, settings.proximity_m_max, 1),
            "holding": spaces.Discrete(2),
        }
    )


def observe(
    rollout: Rollout, reading: SensorReading, space: "spaces.Dict", settings: EnvSettings
) -> Observation:
    """The observation now, within the bounds of its space."""
    arm = rollout.simulation
    T_base_grasp = rollout.arm.T_world_base.inverse() @ arm.T_world_grasp
    w, x, y, z = T_base_grasp.quaternion_wxyz
    sign = 1.0 if w >= 0.0 else -1.0
    values = {
        "depth": reading.channels[Channel.Z_DEPTH][..., None],
        "joint_positions": arm.positions,
        "joint_velocities": arm.speeds,
        "gripper_opening": [arm.opening],
        "hand_position": T_base_grasp.translation_m,
        "hand_rotation": [sign * w, sign * x, sign * y, sign * z],
        "object_position": rollout.target_m("body"),
        "goal_position": rollout.target_m("other"),
        "proximity": [arm.proximity_m(settings.proximity_m_max)],
    }
    bounded = {name: _within(space[name], value) for name, value in values.items()}
    return {
        "rgb": np.ascontiguousarray(reading.channels[Channel.RGB]),
        **bounded,
        "holding": np.int64(bool(arm.held)),
    }


def _within(box: Any, values: Any) -> np.ndarray:
    return np.clip(np.asarray(values, dtype=np.float32), box.low, box.high)
