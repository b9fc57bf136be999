"""An arm that moves as it is told, among simulated bodies.

As in demonstrations, the arm is kinematic and a held body is attached to the hand: motors follow
their targets whatever they push, fixed bodies stop the arm, and fingers that touch a loose body
from both sides hold it until they open.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gen_data.core import kinematics, scene
from gen_data.core.se3 import SE3, Array
from gen_data.physics.manipulation import demonstration, measures
from gen_data.physics.manipulation.arm_goals import Arm
from gen_data.physics.manipulation.joint_trajectories import speed_max
from gen_data.physics.world import World

_TOUCH_M = 0.0005
"""Fingers nearer than this to a body touch it."""
_DEPTH_M = 0.002
"""Fixed bodies stop the arm where it, or the held body, is this deep inside them."""
_PROBE = 0.05
"""Share of their stroke by which fingers are closed to find the bodies that stop them."""
_RELEASE = 0.01
"""Fingers let go when they are told to open by this share of their stroke."""


@dataclass(frozen=True, slots=True)
class Servo:
    """Motors of an arm: ``acceleration = gain * (target - position) - damping * speed``.

    Attributes:
        gain_per_s2: Square of the angular frequency of a motor without damping.
        damping_per_s: Damping of the joints; ``2 sqrt(gain)`` is critical.
    """

    gain_per_s2: float = 400.0
    damping_per_s: float = 40.0

    def next_speeds(self, positions: Array, speeds: Array, targets: Array, step_s: float) -> Array:
        """Speeds one step later, by the implicit Euler method; all arrays have shape [n]."""
        pull = speeds + step_s * self.gain_per_s2 * (targets - positions)
        return pull / (1.0 + step_s * self.damping_per_s + step_s**2 * self.gain_per_s2)


@dataclass(frozen=True, slots=True)
class SimulatedBodies:
    """Names of the bodies around an arm.

    Attributes:
        loose: Bodies that fall.
        joints: Joints of the bodies that have one, by body.
        obstacles: Bodies that stop the arm.
        held: The body that is in the hand at time 0; empty = none.
    """

    loose: tuple[str, ...]
    joints: Mapping[str, scene.BodyJoint]
    obstacles: tuple[str, ...]
    held: str = ""


class ArmSimulation:
    """The bodies of a scene, and an arm that moves as it is told.

    Args:
        arm: The robot, in the world.
        world: Has all bodies.
        bodies: Their names.
        servo: The motors of the arm.
        time_step_s: Simulated time per step of the world.

    Attributes:
        positions, speeds: Positions and speeds of the arm joints [rad or m, and per s], shape [n].
        limits: Lowest and highest positions, shape [2, n].
        speeds_max: Limits of their speeds, shape [n].
        opening: Opening of the gripper, in [0, 1].
        held: Name of the body in the hand; empty = none.
        is_blocked: Whether an obstacle stopped the arm during the latest ``advance``.
    """

    def __init__(
        self, arm: Arm, world: World, bodies: SimulatedBodies, servo: Servo, time_step_s: float
    ) -> None:
        robot, start = arm.robot, arm.articulation.joint_positions
        joints = kinematics.arm_joints(robot)
        at = dict(zip((j.name for j in robot.movable), start, strict=True))
        self._arm, self._world, self._bodies = arm, world, bodies
        self._servo, self._step_s = servo, time_step_s
        self._fingers = [arm.body(k) for k in kinematics.finger_links(robot) if k in arm.links]
        self.limits = np.array([kinematics.position_limits(joint, robot) for joint in joints]).T
        self.speeds_max = np.array([speed_max(joint) for joint in joints])
        self.positions = np.array([at[joint.name] for joint in joints])
        self.speeds = np.zeros(len(joints))
        self.opening = kinematics.gripper_opening(robot, start)
        self._finger_speed = _opening_speed(arm)
        self.held, self.is_blocked = bodies.held, False
        self._T_grasp_held = SE3()
        self._poses = {name: world.pose(name) for name in (*bodies.loose, *bodies.joints)}
        self.measures = measures.Measures(world, self._poses, bodies.joints)
        if self.held:
            self._T_grasp_held = self.T_world_grasp.inverse() @ world.pose(self.held)

    @property
    def joint_positions(self) -> tuple[float, ...]:
        """Positions of all movable joints of the robot [rad or m]."""
        return kinematics.all_positions(self._arm.robot, self.positions.tolist(), self.opening)

    @property
    def T_world_grasp(self) -> SE3:  # noqa: N802
        """Pose of the grasp frame."""
        return self._arm.grasp_pose(self.joint_positions)

    def advance(self, targets: Sequence[float], opening: float, steps: int) -> None:
        """Simulate some steps of the world.

        Args:
            targets: Positions that the motors of the arm joints pull to [rad or m].
            opening: Opening in [0, 1] that the fingers move to at their speed.
            steps: Number of steps.
        """
        goal = np.clip(np.asarray(targets, dtype=np.float64), *self.limits)
        self.is_blocked = False
        for _ in range(steps):
            self._move(goal, opening)
            self._world.step(1)
        if self.held:
            self._world.place(self.held, self.T_world_grasp @ self._T_grasp_held)

    def place(self, poses: Mapping[str, SE3]) -> None:
        """Move bodies that follow their own trajectories: ``{name: T_world_body}``."""
        for name, pose in poses.items():
            self._world.place(name, pose)

    def poses(self) -> dict[str, SE3]:
        """``{name: T_world_body}`` of all bodies that can move, and of the robot's links.

        A body that has moved by no more than the simulator's noise has the same pose as before.
        """
        for name, before in self._poses.items():
            now = self._world.pose(name).rounded()
            if name == self.held or demonstration.has_moved(before, now):
                self._poses = {**self._poses, name: now}
        arm = self._arm
        links = kinematics.link_poses(
            arm.robot, arm.articulation.T_world_base, self.joint_positions
        )
        return {**self._poses, **{arm.body(k): pose.rounded() for k, pose in links.items()}}

    def proximity_m(self, limit_m: float) -> float:
        """Distance from the fingers to the nearest body that they do not hold [m].

        It is 0 for bodies that overlap, and at most ``limit_m``.
        """
        others = [n for n in (*self._poses, *self._bodies.obstacles) if n != self.held]
        for finger in self._fingers:
            for other in others:
                limit_m = min(limit_m, self._world.gap_m(finger, other, limit_m))
        return max(0.0, limit_m)

    def _move(self, goal: Array, opening: float) -> None:
        """Move the arm by one step, unless an obstacle is in its way."""
        before, opening_before = self.positions, self.opening
        speeds = self._servo.next_speeds(before, self.speeds, goal, self._step_s)
        speeds = np.clip(speeds, -self.speeds_max, self.speeds_max)
        self.positions = np.clip(before + self._step_s * speeds, *self.limits)
        self.speeds = (self.positions - before) / self._step_s
        if opening > self.opening + _RELEASE:
            self.held = ""
        if not self.held:
            change = self._finger_speed * self._step_s
            self.opening += min(max(opening - self.opening, -change), change)
        self._show()
        if self._hits_obstacle():
            self.positions, self.opening = before, opening_before
            self.speeds = np.zeros_like(self.speeds)
            self.is_blocked = True
            self._show()
        if not self.held and opening < 1.0 and opening <= self.opening:
            self.held = self._between_fingers()
            if self.held:
                self._T_grasp_held = self.T_world_grasp.inverse() @ self._world.pose(self.held)

    def _between_fingers(self) -> str:
        """Name of the loose body that stops fingers from both sides; empty if there is none."""
        for name in self._bodies.loose:
            touching = [f for f in self._fingers if self._gap_m(f, name) < _TOUCH_M]
            if len(touching) > 1 and len(self._sides_stopped(touching, name)) == 2:
                return name
        return ""

    def _sides_stopped(self, fingers: Sequence[str], name: str) -> set[bool]:
        """Sides of the grasp frame, along Y, on which a body is in the way of closing fingers.

        Bodies before the fingers touch them, too, but they would slide along these.
        """
        T_grasp_world = self.T_world_grasp.inverse()
        before = {f: (self._gap_m(f, name), self._middle_m(f)) for f in fingers}
        opening = self.opening
        self.opening = max(0.0, opening - _PROBE)
        self._show()
        stopped = set()
        for finger, (gap_m, middle_m) in before.items():
            way_m = float(np.linalg.norm(self._middle_m(finger) - middle_m))
            if way_m > _TOUCH_M and gap_m - self._gap_m(finger, name) > 0.5 * way_m:
                stopped.add(float(T_grasp_world.apply(middle_m)[1]) > 0.0)
        self.opening = opening
        self._show()
        return stopped

    def _gap_m(self, finger: str, name: str) -> float:
        return self._world.gap_m(finger, name, 2.0 * _TOUCH_M)

    def _middle_m(self, name: str) -> Array:
        low, high = self._world.bounds_m(name)
        middle: Array = 0.5 * (low + high)
        return middle

    def _show(self) -> None:
        self._arm.show(self.joint_positions)
        if self.held:
            self._world.place(self.held, self.T_world_grasp @ self._T_grasp_held)

    def _hits_obstacle(self) -> bool:
        moving = [self._arm.body(link) for link in self._arm.moving]
        if self.held:
            moving.append(self.held)
        return any(
            self._world.gap_m(name, other, limit_m=0.0) < -_DEPTH_M
            for name in moving
            for other in self._bodies.obstacles
        )


def _opening_speed(arm: Arm) -> float:
    """Share of the gripper's stroke that its fingers move in a second."""
    hand = arm.robot.gripper
    names = hand.finger_joints if hand is not None else ()
    fingers = [j for j in arm.robot.movable if j.name in names and j.upper > j.lower]
    return min((speed_max(j) / (j.upper - j.lower) for j in fingers), default=0.0)
