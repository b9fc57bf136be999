"""Steps of demonstrations: an arm's state and action at one instant, for imitation learning."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from gen_data.core import asset_types, kinematics, scene, se3

AnySpan = TypeVar("AnySpan", bound=scene.Span)


@dataclass(frozen=True, slots=True)
class DemonstrationStep:
    """An arm at one instant of a demonstration.

    Attributes:
        positions: Positions of all movable joints [rad or m].
        action: Their positions one step later, which a position controller would be given.
        T_base_grasp: Pose of the grasp frame; pose of the root without a gripper.
        opening, opening_action: Gripper opening now and one step later, 0 closed and 1 open; of a
            suction cup 0 while it holds something and else 1.
        phase: Name of the part of the program.
        held: Name of the body in the hand; empty = none.
        contacts: Pairs of bodies that touch, as in ``Episode``.
        contact_forces_n: Normal force of each of them, as in ``ContactSpan``.
        contact_points_m: Point of each of them in the world.
        succeeded: Whether physics confirmed the whole demonstration.
        failure: Why it failed; empty = it did not.
        recovered: The failure that happened in a success; empty = none.
    """

    positions: tuple[float, ...]
    action: tuple[float, ...]
    T_base_grasp: se3.SE3
    opening: float
    opening_action: float
    phase: str
    held: str
    contacts: tuple[str, ...]
    contact_forces_n: tuple[float, ...]
    contact_points_m: tuple[se3.Vec3, ...]
    succeeded: bool
    failure: str
    recovered: str


def demonstration_step(
    arm: scene.Articulation, robot: asset_types.RobotModel, time_s: float, step_s: float
) -> DemonstrationStep | None:
    """The step of an arm at an instant; None if it demonstrates nothing.

    After the end of the demonstration the arm rests, and the labels of its end hold.
    """
    episode, hand = arm.episode, robot.gripper
    if episode is None:
        return None
    positions, action = joint_positions(arm, time_s), joint_positions(arm, time_s + step_s)
    end_s = _end_s(episode) - 1e-3
    at_s, next_s = min(time_s, end_s), min(time_s + step_s, end_s)
    contacts = _spans_at(episode.contacts, at_s)
    touching = [contact.at(at_s) for contact in contacts]
    openings = [round(kinematics.gripper_opening(robot, q), 6) for q in (positions, action)]
    if hand is not None and hand.cup is not None:
        openings = [0.0 if _spans_at(episode.held, t) else 1.0 for t in (at_s, next_s)]
    poses = kinematics.link_poses(robot, se3.SE3(), positions)
    T_base_grasp = poses[hand.link] @ hand.T_link_grasp if hand else poses[robot.links[0]]
    return DemonstrationStep(
        positions,
        action,
        T_base_grasp.rounded(),
        openings[0],
        openings[1],
        next((span.label for span in _spans_at(episode.phases, at_s)), ""),
        next((span.label for span in _spans_at(episode.held, at_s)), ""),
        tuple(contact.label for contact in contacts),
        tuple(force_n for force_n, _ in touching),
        tuple(point_m for _, point_m in touching),
        episode.succeeded,
        episode.failure,
        episode.recovered,
    )


def joint_positions(arm: scene.Articulation, time_s: float) -> tuple[float, ...]:
    """Positions of all movable joints at an instant [rad or m]."""
    if arm.joint_track is None:
        return arm.joint_positions
    return arm.joint_track.positions(round(time_s, 9))


def _end_s(episode: scene.Episode) -> float:
    return max((span.end_s for span in episode.phases), default=0.0)


def _spans_at(spans: Sequence[AnySpan], time_s: float) -> list[AnySpan]:
    # Times of steps are sums of floats: a span begins a little earlier than stated.
    return [s for s in spans if s.start_s - 1e-6 <= time_s < s.end_s - 1e-6]
