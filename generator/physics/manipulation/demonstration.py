"""Demonstrations: an arm carries out its legs in physics, which tells what becomes of the bodies.

The arm and what it holds move as planned; everything else is simulated. The fingers push what they
meet, but carry nothing by friction: a held body is attached to the hand until the fingers open.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from gen_data.generator.core.errors import Rejection
from gen_data.generator.core.kinematics import finger_links
from gen_data.generator.core.scene import Condition, Episode, Span
from gen_data.generator.core.se3 import SE3
from gen_data.generator.physics.manipulation.arm_goals import Arm
from gen_data.generator.physics.manipulation.joint_trajectories import (
    STEP_S,
    Leg,
    smooth_step,
)
from gen_data.generator.physics.manipulation.manipulation_planner import TaskPlanner
from gen_data.generator.physics.manipulation.measures import Measures
from gen_data.generator.physics.world import World

_TOUCH_M = 0.0005
"""Bodies nearer than this touch."""
_STILL_M = 0.0005
_STILL_RAD = 0.002
"""Smaller motions between knots are the simulator's noise."""
_SLIP_KNOTS = 12
"""A slip happens after a body has been held for 0.6 s."""
_SETTLE_S = 0.6
"""After the last goal, so that what was let go comes to rest."""


def demonstrate(
    planner: TaskPlanner, arm: Arm, world: World, time_step_s: float
) -> Demonstration | Rejection:
    """Plan and carry out the task of an arm goal by goal; each plan starts from what physics left.

    A failure that was asked for befalls the first grasp. It is no reason to stop: the arm goes on
    as if nothing had happened.

    Returns:
        The demonstration; or why a goal cannot be accomplished, or which condition of success does
        not hold although no failure was asked for.
    """
    articulation = arm.articulation
    assignment = articulation.assignment
    assert assignment is not None
    shown = Demonstration(arm, world, planner.all_poses(), time_step_s)
    first_grasp = next((g for g in articulation.task if g.kind == "grasp"), None)
    for number, goal in enumerate(articulation.task, 1):
        fails = goal is first_grasp
        if assignment.failure == "collision" and fails:
            blow = planner.plan_blow(goal, number)
            if isinstance(blow, Rejection):
                return blow
            shown.run(blow, "approach")
        legs = planner.plan_goal(goal, number)
        if isinstance(legs, Rejection):
            return legs
        if assignment.failure == "miss" and fails:
            legs = _without_approach(legs)
        shown.run(legs, goal.phase or goal.kind)
        if not assignment.failure:
            planner.resting.update(
                {n: p for n, p in shown.poses[-1].items() if n in planner.resting}
            )
    shown.settle()
    failed = shown.failed_conditions()
    if assignment.failure and not failed:
        return Rejection(
            f"task '{assignment.name}': it succeeds in spite of a {assignment.failure}",
            "fewer failures, or another task",
        )
    if failed and not assignment.failure:
        first = failed[0]
        between = f" to '{first.other}'" if first.other else ""
        return Rejection(
            f"task '{assignment.name}': after the demonstration, {first.measure} of "
            f"'{first.body}'{between} is {shown.value_at_end(first):.3f}",
            f"other places of the things of task '{assignment.name}', or another task",
        )
    return shown


def _without_approach(legs: list[Leg]) -> list[Leg]:
    """Legs to a grasp whose fingers close above the object, at the start of the approach."""
    approach, _, lift = legs[-3:]
    return [*legs[:-3], replace(approach, end=lift.end, held=None)]


class Demonstration:
    """Simulates the legs of one arm and records what happens, knot by knot.

    Args:
        arm: The robot, in the world.
        world: Has all bodies.
        loose: ``{name: T_world_body}`` of all movable bodies at the beginning.
        time_step_s: Simulated time per step of the world.

    Attributes:
        legs: All legs carried out so far.
        poses: ``{name: T_world_body}`` of all movable bodies at every knot.
    """

    def __init__(
        self, arm: Arm, world: World, loose: Mapping[str, SE3], time_step_s: float
    ) -> None:
        assignment = arm.articulation.assignment
        assert assignment is not None
        self._arm, self._world, self._assignment = arm, world, assignment
        self._steps = max(1, round(STEP_S / time_step_s))
        joints = {joint.body: joint for joint in assignment.joints}
        self._start = {**loose, **{name: world.pose(name) for name in joints}}
        self._measures = Measures(world, self._start, joints)
        self._values: list[tuple[float, ...]] = []
        self._phases: list[str] = []
        self._held: list[str] = []
        self._contacts: list[frozenset[str]] = []
        self._fingers = [arm.body(k) for k in finger_links(arm.robot) if k in arm.links]
        self._first_held = ""
        self.legs: list[Leg] = []
        self.poses: list[dict[str, SE3]] = []

    def run(self, legs: Sequence[Leg], phase: str) -> None:
        """Carry out timed legs from where the latest ones ended."""
        for name, pose in (self.poses[-1] if self.poses else self._start).items():
            self._world.place(name, pose)
        for leg in legs:
            if not self.poses:
                self._arm.show(leg.start)
                self._record(phase, self._held_body(leg), leg.start)
            count = round(leg.duration_s / STEP_S)
            for knot in range(count):
                held = self._held_body(leg)
                for step in range(1, self._steps + 1):
                    share = (knot + step / self._steps) / count
                    positions = leg.at(smooth_step(share))
                    self._arm.show(positions)
                    if held and leg.held is not None:
                        pose = self._arm.grasp_pose(positions) @ leg.held.T_grasp_held
                        self._world.place(held, pose)
                    self._world.step(1)
                if held and leg.held is not None:
                    self._world.place(held, self._arm.grasp_pose(positions) @ leg.held.T_grasp_held)
                self._record(phase, held, positions)
        self.legs += legs

    def settle(self) -> None:
        """Wait at the end until everything has come to rest."""
        last = self.legs[-1]
        self.run([Leg(last.end, last.end, _SETTLE_S, last.held)], "settle")

    def episode(self, start_s: float) -> Episode:
        """What happened, and whether it is a success, at times from ``start_s`` on."""
        succeeded = not self.failed_conditions()
        return Episode(
            succeeded,
            "" if succeeded else self._assignment.failure,
            tuple(_spans(self._phases, start_s)),
            tuple(span for span in _spans(self._held, start_s) if span.label),
            tuple(self._contact_spans(start_s)),
        )

    def failed_conditions(self) -> list[Condition]:
        """The conditions of success that do not hold."""
        return [
            condition
            for k, condition in enumerate(self._assignment.success)
            if not any(
                condition.holds(values[k])
                for values in (self._values if condition.ever else self._values[-1:])
            )
        ]

    def value_at_end(self, condition: Condition) -> float:
        """Value of a condition of success at the latest knot."""
        return self._values[-1][self._assignment.success.index(condition)]

    def _held_body(self, leg: Leg) -> str:
        """Name of the body that is in the hand on a leg; empty where it fails to hold it."""
        if leg.held is None:
            return ""
        body, failure = leg.held.body, self._assignment.failure
        self._first_held = self._first_held or body
        if not failure or body != self._first_held:
            return body
        slips_later = failure == "slip" and self._held.count(body) < _SLIP_KNOTS
        return body if slips_later else ""

    def _record(self, phase: str, held: str, positions: Sequence[float]) -> None:
        before = self.poses[-1] if self.poses else self._start
        poses = {name: self._world.pose(name).rounded() for name in self._start}
        self.poses.append(
            {n: p if n == held or has_moved(before[n], p) else before[n] for n, p in poses.items()}
        )
        self._phases.append(phase)
        self._held.append(held)
        self._contacts.append(frozenset(self._touching(held, before)))
        hand = np.array(self._arm.grasp_pose(positions).translation_m)
        self._values.append(tuple(self._measures.value(c, hand) for c in self._assignment.success))

    def _touching(self, held: str, before: Mapping[str, SE3]) -> Iterator[str]:
        """Pairs of bodies in contact, one of which moves or is of the arm."""
        moving = {n for n, pose in self.poses[-1].items() if pose != before[n]} | {held}
        moving |= {self._arm.body(link) for link in self._arm.moving}
        links = set(self._arm.bodies)
        # A grasp leaves some micrometres, which not every simulator counts as contact.
        grasped = [
            (link, held, self._world.gap_m(link, held, _TOUCH_M))
            for link in (self._fingers if held else ())
        ]
        for one, other, gap_m in (*self._world.contacts(), *grasped):
            own = one in links and other in links
            if gap_m < _TOUCH_M and not own and (one in moving or other in moving):
                yield " + ".join(sorted((one, other)))

    def _contact_spans(self, start_s: float) -> Iterator[Span]:
        for pair in sorted(frozenset().union(*self._contacts)):
            seen = [pair if pair in contacts else "" for contacts in self._contacts]
            yield from (span for span in _spans(seen, start_s) if span.label)


def has_moved(one: SE3, other: SE3) -> bool:
    """Whether two poses of a body differ by more than the simulator's noise."""
    cosine = sum(a * b for a, b in zip(one.quaternion_wxyz, other.quaternion_wxyz, strict=True))
    turned = 2.0 * math.sqrt(max(0.0, 2.0 * (1.0 - abs(cosine)))) > _STILL_RAD
    return turned or math.dist(one.translation_m, other.translation_m) > _STILL_M


def _spans(labels: Sequence[str], start_s: float) -> Iterator[Span]:
    """Runs of equal labels; label k holds during the step up to knot k."""
    first = 0
    for k in range(1, len(labels) + 1):
        if k == len(labels) or labels[k] != labels[first]:
            low_s, high_s = start_s + first * STEP_S, start_s + k * STEP_S
            yield Span(labels[first], round(low_s, 6), round(high_s, 6))
            first = k
