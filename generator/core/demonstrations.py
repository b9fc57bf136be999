"""Steps of demonstrations: what imitation learning reads of an arm at one instant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from gen_data.generator.core.asset_types import RobotModel
from gen_data.generator.core.kinematics import gripper_opening, link_poses
from gen_data.generator.core.scene import Articulation, Episode, Span
from gen_data.generator.core.se3 import SE3


@dataclass(frozen=True, slots=True)
class DemonstrationStep:
    """An arm at one instant of a demonstration.

    Attributes:
        positions: Of all movable joints [rad or m].
        action: Their positions one step later, which a position controller would be given.
        T_base_grasp: Pose of the grasp frame; of the root without a gripper.
        opening, opening_action: Of the gripper now and one step later, 0 closed and 1 open.
        phase: Name of the part of the program.
        held: Name of the body in the hand; empty = none.
        contacts: Pairs of bodies that touch, as in ``Episode``.
        succeeded: Whether physics confirmed the whole demonstration.
        failure: Why it failed; empty = it did not.
    """

    positions: tuple[float, ...]
    action: tuple[float, ...]
    T_base_grasp: SE3
    opening: float
    opening_action: float
    phase: str
    held: str
    contacts: tuple[str, ...]
    succeeded: bool
    failure: str


def demonstration_step(
    arm: Articulation, robot: RobotModel, time_s: float, step_s: float
) -> DemonstrationStep | None:
    """The step of an arm at an instant; None if it demonstrates nothing.

    After the end of the demonstration the arm rests, and the labels of its end hold.
    """
    episode = arm.episode
    if episode is None:
        return None
    positions, action = joint_positions(arm, time_s), joint_positions(arm, time_s + step_s)
    at_s = min(time_s, _end_s(episode) - 1e-3)
    poses = link_poses(robot, SE3(), positions)
    hand = robot.gripper
    T_base_grasp = poses[hand.link] @ hand.T_link_grasp if hand else poses[robot.links[0]]
    return DemonstrationStep(
        positions,
        action,
        T_base_grasp.rounded(),
        round(gripper_opening(robot, positions), 6),
        round(gripper_opening(robot, action), 6),
        next(iter(_labels_at(episode.phases, at_s)), ""),
        next(iter(_labels_at(episode.held, at_s)), ""),
        tuple(_labels_at(episode.contacts, at_s)),
        episode.succeeded,
        episode.failure,
    )


def joint_positions(arm: Articulation, time_s: float) -> tuple[float, ...]:
    """Positions of all movable joints at an instant [rad or m]."""
    if arm.joint_track is None:
        return arm.joint_positions
    return arm.joint_track.positions(round(time_s, 9))


def _end_s(episode: Episode) -> float:
    return max((span.end_s for span in episode.phases), default=0.0)


def _labels_at(spans: Sequence[Span], time_s: float) -> list[str]:
    # Times of steps are sums of floats: a span begins a little earlier than it says.
    return [s.label for s in spans if s.start_s - 1e-6 <= time_s < s.end_s - 1e-6]
