"""Joint trajectories: legs in joint space, each from rest to rest.

A straight leg follows ``start + s(t / T) * (end - start)`` with ``s = 10 x^3 - 15 x^4 + 6 x^5``.
Speed and acceleration vanish at both ends; their peaks are 15/8 of the mean speed and 10/sqrt(3)
of ``(end - start) / T^2`` (Biagiotti & Melchiorri, Trajectory Planning for Automatic Machines and
Robots, 2008, section 2.1.7).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from gen_data.core.asset_types import Joint, RobotModel
from gen_data.core.kinematics import link_poses, round_positions
from gen_data.core.motion import JointTrajectory, Trajectory
from gen_data.core.se3 import SE3, Vec3
from gen_data.physics.manipulation.arm_goals import Arm

STEP_S = 0.05
"""Time between the knots of a track; legs last a whole number of steps."""

_PEAK_SPEED = 15.0 / 8.0
_PEAK_ACCELERATION = 10.0 / math.sqrt(3.0)
_SPEED_RAD_S = 1.5
_SPEED_M_S = 0.1
"""Speeds of joints without a limit in their description: slower than any arm in the catalogue."""
_SPEED_CAP_RAD_S = math.pi
"""Cap for revolute joints: the limit of a UR5e and an xArm. Some descriptions state 10 rad/s as a
placeholder."""
_SPEED_UP_S = 0.25
"""Time in which a joint reaches its full speed, as URDF has no limit of acceleration. A Panda with
its own limits (7.5 to 20 rad/s^2 at 2.2 to 2.6 rad/s) takes 0.13 to 0.29 s."""
_STEPS_MIN = 2


@dataclass(frozen=True, slots=True)
class Held:
    """A body in the hand.

    Attributes:
        body: Its name.
        T_grasp_held: Its pose in the grasp frame.
        T_surface_rest: Its pose at rest on a level surface; X and Y are 0.
        opening: Opening of the gripper around it, in [0, 1].
    """

    body: str
    T_grasp_held: SE3
    T_surface_rest: SE3
    opening: float


@dataclass(frozen=True, slots=True)
class Leg:
    """A path of straight lines in joint space, from rest to rest.

    Attributes:
        start, end: One position per movable joint [rad or m].
        via: Positions to pass between them; each line takes the same share of the path.
        duration_s: A multiple of ``STEP_S``; 0 = not yet timed.
        held: The body that moves with the hand; None = the hand is empty.
        pivots: Whether the held body turns about the grasp frame's Y as contacts make it.
    """

    start: tuple[float, ...]
    end: tuple[float, ...]
    duration_s: float = 0.0
    held: Held | None = None
    via: tuple[tuple[float, ...], ...] = ()
    pivots: bool = False

    @property
    def lines(self) -> list[tuple[tuple[float, ...], tuple[float, ...]]]:
        """Start and end of every straight line."""
        return list(pairwise([self.start, *self.via, self.end]))

    def at(self, share: float) -> tuple[float, ...]:
        """Positions after a share of the path in [0, 1]."""
        lines = self.lines
        number = min(int(share * len(lines)), len(lines) - 1)
        share = share * len(lines) - number
        return round_positions([a + share * (b - a) for a, b in zip(*lines[number], strict=True)])


def smooth_step(share: float) -> float:
    """Share of the path after a share of the time: the quintic from rest to rest."""
    return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)


def speed_max(joint: Joint) -> float:
    """Limit of a joint's speed [rad/s or m/s]."""
    if joint.kind == "prismatic":
        return joint.speed_max or _SPEED_M_S
    return min(joint.speed_max or _SPEED_RAD_S, _SPEED_CAP_RAD_S)


def acceleration_max(joint: Joint) -> float:
    """Limit of a joint's acceleration [rad/s^2 or m/s^2]."""
    return speed_max(joint) / _SPEED_UP_S


def time_leg(leg: Leg, robot: RobotModel, speed: float) -> Leg:
    """The leg with the shortest duration that stays within a share of all joints' limits."""
    longest_s = 0.0
    lines = leg.lines
    for k, joint in enumerate(robot.movable):
        change = len(lines) * max(abs(b[k] - a[k]) for a, b in lines)
        by_speed_s = _PEAK_SPEED * change / (speed * speed_max(joint))
        limit = speed * acceleration_max(joint)
        longest_s = max(longest_s, by_speed_s, math.sqrt(_PEAK_ACCELERATION * change / limit))
    steps = max(_STEPS_MIN, math.ceil(longest_s / STEP_S - 1e-9))
    return replace(leg, duration_s=round(steps * STEP_S, 6))


def limit_speed(leg: Leg, points_m: Sequence[Vec3], speed_m_s: float) -> Leg:
    """The timed leg, made so slow that a point on the arm stays below a speed.

    Args:
        leg: The leg.
        points_m: Where the point is at the start, at every via position and at the end.
        speed_m_s: The speed.
    """
    longest_m = len(leg.lines) * max(math.dist(a, b) for a, b in pairwise(points_m))
    steps = math.ceil(_PEAK_SPEED * longest_m / speed_m_s / STEP_S - 1e-9)
    return replace(leg, duration_s=max(leg.duration_s, round(steps * STEP_S, 6)))


def sample_positions(legs: Sequence[Leg]) -> list[tuple[Leg, tuple[float, ...]]]:
    """Positions every ``STEP_S`` along timed legs, each with its leg; the start comes first."""
    knots = [(legs[0], legs[0].start)] if legs else []
    for leg in legs:
        count = round(leg.duration_s / STEP_S)
        knots += [(leg, leg.at(smooth_step(k / count))) for k in range(1, count + 1)]
    return knots


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

    @property
    def end_s(self) -> float:
        """Time of the latest knot."""
        return round(self._knot * STEP_S, 6)

    def add(
        self,
        arms: Sequence[tuple[Arm, Sequence[Leg], Sequence[str]]],
        simulated: Sequence[Mapping[str, SE3]] = (),
    ) -> None:
        """Record arms that move at the same time, after everything recorded so far.

        Args:
            arms: Each with its timed legs, which last equally long, and the links with a body in
                the scene.
            simulated: ``{name: T_world_body}`` of all movable bodies at every knot, from physics;
                without it only held bodies move.
        """
        start = self._knot
        for arm, legs, parts in arms:
            name, knots = arm.articulation.name, sample_positions(legs)
            if not knots:
                continue
            for number, (leg, positions) in enumerate(knots, start):
                poses = link_poses(arm.robot, arm.articulation.T_world_base, positions)
                for link in parts:
                    self._add_knot(f"{name}/{link}", number, poses[link])
                if not simulated and leg.held is not None:
                    pose = arm.grasp_pose(positions) @ leg.held.T_grasp_held
                    self._add_knot(leg.held.body, number, pose)
            self._knot = start + len(knots) - 1
            self.joint_tracks[name] = JointTrajectory(
                STEP_S, tuple(positions for _, positions in knots), round(start * STEP_S, 6)
            )
        for number, bodies in enumerate(simulated, start):
            for body, pose in bodies.items():
                self._add_knot(body, number, pose)

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
