"""Trajectories of bodies from the legs of arms, sampled at even steps of time."""

from __future__ import annotations

from collections.abc import Sequence

from gen_data.generator.core.kinematics import link_poses
from gen_data.generator.core.motion import JointTrajectory, Trajectory
from gen_data.generator.core.se3 import SE3
from gen_data.generator.physics.manipulation.arm_goals import Arm
from gen_data.generator.physics.manipulation.joint_trajectories import (
    STEP_S,
    Leg,
    sample_positions,
)


class TrajectoryRecording:
    """Records the poses of all moving bodies, knot by knot; the first knot is at time 0.

    Args:
        resting: ``{name: T_world_body}`` of all movable bodies at time 0.

    Attributes:
        joint_tracks: ``{articulation: trajectory of its joints}``.
    """

    def __init__(self, resting: dict[str, SE3]) -> None:
        self._resting = resting
        self._knot = 0
        self._poses: dict[str, list[SE3]] = {}
        self._starts: dict[str, int] = {}
        self.joint_tracks: dict[str, JointTrajectory] = {}

    def add(self, arm: Arm, legs: Sequence[Leg], parts: Sequence[str]) -> None:
        """Record the legs of an arm after everything recorded so far.

        Args:
            arm: The robot.
            legs: Timed legs.
            parts: Links with a body in the scene.
        """
        knots = sample_positions(legs)
        if not knots:
            return
        start = self._knot
        name = arm.articulation.name
        for number, (leg, positions) in enumerate(knots, start):
            poses = link_poses(arm.robot, arm.articulation.T_world_base, positions)
            for link in parts:
                self._add_knot(f"{name}/{link}", number, poses[link])
            if leg.held is not None:
                pose = arm.grasp_pose(positions) @ leg.held.T_grasp_held
                self._add_knot(leg.held.body, number, pose)
        self._knot = start + len(knots) - 1
        self.joint_tracks[name] = JointTrajectory(
            STEP_S, tuple(positions for _, positions in knots), round(start * STEP_S, 6)
        )

    def tracks(self) -> tuple[Trajectory, ...]:
        """One trajectory per body that moved; each body is at rest before and after its own."""
        return tuple(
            Trajectory(body, STEP_S, tuple(poses), round(self._starts[body] * STEP_S, 6))
            for body, poses in self._poses.items()
            if any(pose != poses[0] for pose in poses)
        )

    def _add_knot(self, body: str, number: int, pose: SE3) -> None:
        """Record the pose of a body at a knot; it was at rest since its previous knot."""
        if body not in self._poses:
            # A body that was at rest gets a knot there, one step before it starts to move.
            at_rest = body in self._resting and number > 0
            self._starts[body] = number - 1 if at_rest else number
            self._poses[body] = [self._resting[body]] if at_rest else []
        poses = self._poses[body]
        missing = number - self._starts[body] - len(poses)
        if missing >= 0:
            poses += [poses[-1]] * missing if missing else []
            poses.append(pose.rounded())
