"""Demonstrations: an arm carries out its legs in physics, which moves the bodies that it meets.

The arm and its held body move as planned; everything else is simulated. The fingers push bodies in
their way, but carry nothing by friction: a held body is attached to the hand until the fingers
open.
While it pivots, the fingers are a hinge with friction, and contacts turn it. A suction cup holds a
body only if it seals on it, and as long as its force is large enough.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from gen_data.core import errors, kinematics, scene, se3
from gen_data.physics.manipulation import arm_goals, manipulation_planner, measures, suction
from gen_data.physics.manipulation.joint_trajectories import STEP_S, Held, Leg, smooth_step
from gen_data.physics.world import Contact, World

_TOUCH_M = 0.0005
"""Bodies nearer than this touch."""
_STILL_M = 0.0005
_STILL_RAD = 0.002
"""Smaller motions between knots are the simulator's noise."""
_SLIP_KNOTS = 12
"""A slip happens after a body has been held for 0.6 s."""
_PAD_FRICTION_N_M = 0.05
"""Torque that turns a body between two finger tips: a 100 g block held 2 cm off its centre does
not turn by its weight (0.02 N m), and turns when its edge is pressed down with 2 N (assumed)."""
_SETTLE_S = 0.6
"""After the last goal, for released bodies to come to rest, and before a recovery."""
_HESITATION_S = 1.0
"""An arm that recovers from being late has waited for this time."""
_IN_HAND: tuple[scene.FailureKind, ...] = ("", "late", "wrong_object")
"""Failures with which the first body that is grasped stays in the hand."""


def demonstrate(
    planners: Sequence[manipulation_planner.TaskPlanner], world: World, time_step_s: float
) -> "Demonstration | errors.Rejection":
    """Plan and carry out the task of an arm goal by goal; each plan starts from physics.

    Other arms stand still, or pursue the goals that name them. A failure that was asked for befalls
    the first grasp, or makes the arms wait in the middle of the program. It does not stop the arm,
    which goes on as if nothing had happened, or, if the assignment recovers, looks at the state of
    all bodies and tries again.

    Args:
        planners: Planners of the arm with the task, then of the others that its goals name.
        world: Has all bodies.
        time_step_s: Simulated time per step of the world.

    Returns:
        The demonstration; or why a goal cannot be accomplished, or which condition of success does
        not hold although no failure was asked for, or the arm should have recovered.
    """
    articulation = planners[0].arm.articulation
    assignment = articulation.assignment
    assert assignment is not None
    shown = Demonstration(planners, world, time_step_s)
    refused = _carry_out(planners, articulation, assignment, shown)
    if refused is not None:
        return refused
    failed = shown.failed_conditions()
    if assignment.failure and not assignment.recovers and not failed:
        return errors.Rejection(
            f"task '{assignment.name}': it succeeds in spite of a {assignment.failure}",
            "fewer failures, or another task",
        )
    if failed and (assignment.recovers or not assignment.failure):
        first = failed[0]
        between = f" to '{first.other}'" if first.other else ""
        return errors.Rejection(
            f"task '{assignment.name}': after the demonstration, {first.measure} of "
            f"'{first.body}'{between} is {shown.value_at_end(first):.3f}",
            f"other places of the objects of task '{assignment.name}', or another task",
        )
    return shown


def _carry_out(
    planners: Sequence[manipulation_planner.TaskPlanner],
    articulation: scene.Articulation,
    assignment: scene.Assignment,
    shown: "Demonstration",
) -> errors.Rejection | None:
    """Carry out all goals, with the failure and perhaps the recovery; the reason if one cannot."""
    by_name = {planner.arm.articulation.name: planner for planner in planners}
    goals, failure = articulation.task, assignment.failure
    grasp = next((k for k, goal in enumerate(goals) if goal.kind == "grasp"), -1)
    ahead = failure  # Failures still to happen.
    number = 0
    while number < len(goals):
        goal = goals[number]
        at_work = [by_name[name] for name in goal.arms or (articulation.name,)]
        planner = at_work[0]
        if ahead == "late" and number == len(goals) // 2:
            assert assignment.deadline_s is not None
            if not assignment.recovers:
                shown.wait(assignment.deadline_s - shown.end_s, "wait")
                break
            shown.wait(_HESITATION_S, "wait")
            ahead = ""
        if ahead in ("collision", "wrong_object") and number == grasp:
            mishap = _mishap(planner, assignment, goal, number + 1, shown)
            if mishap is not None:
                return mishap
            if ahead == "wrong_object" and not assignment.recovers:
                number += 1
                continue
            if assignment.recovers:
                ahead = shown.recover(planners)
        missed = ahead == "miss" and number == grasp
        planned = _plan(at_work, goal, number + 1, missed)
        if isinstance(planned, errors.Rejection):
            if ahead == "wrong_object" and number > grasp:
                break  # A misplaced body may be out of reach: the arm gives up.
            return planned
        shown.run(planned, goal.phase or goal.kind)
        number += 1
        if assignment.recovers and (missed or (ahead == "slip" and shown.has_slipped())):
            ahead, number = shown.recover(planners), grasp
        elif ahead in ("", "late"):
            for other in planners:
                other.observe(shown.poses[-1])
    shown.settle()
    return None


def _plan(
    planners: Sequence[manipulation_planner.TaskPlanner],
    goal: scene.ArmGoal,
    number: int,
    misses: bool,
) -> dict[str, list[Leg]] | errors.Rejection:
    """Legs of the arms that pursue a goal, by name."""
    planned: dict[str, list[Leg]] = {}
    for planner in planners:
        legs = planner.plan_goal(goal, number)
        if isinstance(legs, errors.Rejection):
            return legs
        planned[planner.arm.articulation.name] = _without_approach(legs) if misses else legs
    return planned


def _mishap(
    planner: manipulation_planner.TaskPlanner,
    assignment: scene.Assignment,
    goal: scene.ArmGoal,
    number: int,
    shown: "Demonstration",
) -> errors.Rejection | None:
    """Fail before the first grasp: by a blow, or with a wrong body, which it may put back."""
    if assignment.failure == "collision":
        steps: list[tuple[scene.ArmGoal | None, str]] = [(None, "approach")]
    else:
        steps = [(replace(goal, objects=(assignment.mistaken,)), goal.phase or goal.kind)]
        if assignment.recovers:
            steps.append((planner.return_goal(assignment.mistaken, goal.speed), "return"))
    for step, phase in steps:
        legs = planner.plan_goal(step, number) if step else planner.plan_blow(goal, number)
        if isinstance(legs, errors.Rejection):
            return legs
        shown.run({planner.arm.articulation.name: legs}, phase)
    return None


def _without_approach(legs: list[Leg]) -> list[Leg]:
    """Legs to a grasp whose fingers close above the object, at the start of the approach."""
    approach, _, lift = legs[-3:]
    return [*legs[:-3], replace(approach, end=lift.end, held=None)]


class _Hand:
    """An arm of a demonstration, and the body in its hand at every knot; empty = nothing."""

    def __init__(self, planner: manipulation_planner.TaskPlanner) -> None:
        self.arm = planner.arm
        links = kinematics.finger_links(self.arm.robot)
        self.fingers = [self.arm.body(k) for k in links if k in self.arm.links]
        self.held: list[str] = []
        self.legs: list[Leg] = []
        self.torn = ""
        self.positions = planner.positions

    def stay(self, duration_s: float) -> Leg:
        """A leg that stands still, with the body in the hand."""
        held = self.legs[-1].held if self.legs else None
        return Leg(self.positions, self.positions, duration_s, held)


class Demonstration:
    """Simulates the legs of arms and records the motion, knot by knot.

    Args:
        planners: Planners of its arms, the one with the task first.
        world: Has all bodies.
        time_step_s: Simulated time per step of the world.

    Attributes:
        poses: ``{name: T_world_body}`` of all movable bodies at every knot.
    """

    def __init__(
        self,
        planners: Sequence[manipulation_planner.TaskPlanner],
        world: World,
        time_step_s: float,
    ) -> None:
        assignment = planners[0].arm.articulation.assignment
        assert assignment is not None
        self._hands = [_Hand(planner) for planner in planners]
        self._world, self._assignment = world, assignment
        self._steps = max(1, round(STEP_S / time_step_s))
        joints = {joint.body: joint for joint in assignment.joints}
        loose = planners[0].all_poses()
        self._start = {**loose, **{name: world.pose(name) for name in joints}}
        self._measures = measures.Measures(world, self._start, joints)
        self._values: list[tuple[float, ...]] = []
        self._phases: list[str] = []
        self._contacts: list[dict[str, tuple[float, se3.Vec3]]] = []
        self._first_held = ""
        self._recovered: scene.FailureKind = ""
        self.poses: list[dict[str, se3.SE3]] = []

    @property
    def legs(self) -> list[tuple[arm_goals.Arm, list[Leg]]]:
        """All legs carried out so far, by arm; legs of all arms last equally long."""
        return [(hand.arm, hand.legs) for hand in self._hands]

    def run(self, legs: Mapping[str, Sequence[Leg]], phase: str) -> None:
        """Carry out timed legs of arms from where the latest ones ended.

        Several arms move at the same time, each leg for as long as the longest; others stay.
        """
        for name, pose in (self.poses[-1] if self.poses else self._start).items():
            self._world.place(name, pose)
        for together in zip(*legs.values(), strict=True):
            moving = dict(zip(legs, together, strict=True))
            longest_s = max(leg.duration_s for leg in together)
            timed = {name: replace(leg, duration_s=longest_s) for name, leg in moving.items()}
            self._run(
                [(h, timed.get(h.arm.articulation.name, h.stay(longest_s))) for h in self._hands],
                round(longest_s / STEP_S),
                phase,
            )

    def _run(self, moving: Sequence[tuple[_Hand, Leg]], count: int, phase: str) -> None:
        if not self.poses:
            for hand, leg in moving:
                hand.arm.show(leg.start)
            self._record(phase, moving, [leg.start for _, leg in moving])
        pivoting = [(h, leg.held) for h, leg in moving if leg.pivots and self._held_body(h, leg)]
        for hand, held in pivoting:
            assert held is not None
            self._world.hinge(held.body, _finger_joint(held))
            self._world.ignore(held.body, hand.arm.bodies)
        for knot in range(count):
            bodies = [self._held_body(hand, leg) for hand, leg in moving]
            for step in range(1, self._steps + 1):
                share = (knot + step / self._steps) / count
                positions = [leg.at(smooth_step(share)) for _, leg in moving]
                for (hand, leg), body, at in zip(moving, bodies, positions, strict=True):
                    hand.arm.show(at)
                    self._move_held(hand, leg, body, at)
                self._world.step(1)
            for (hand, leg), body, at in zip(moving, bodies, positions, strict=True):
                self._move_held(hand, leg, body, at)
            self._record(phase, moving, positions, bodies)
        for _, held in pivoting:
            assert held is not None
            self._world.unhinge(held.body)
        for hand, leg in moving:
            hand.legs.append(leg)
            hand.positions = leg.end

    def _move_held(self, hand: _Hand, leg: Leg, body: str, positions: Sequence[float]) -> None:
        """Take the held body, or the hinge that it pivots about, to where the hand is."""
        if not body or leg.held is None:
            return
        pose = hand.arm.grasp_pose(positions) @ leg.held.T_grasp_held
        move = self._world.carry if leg.pivots else self._world.place
        move(body, pose)

    @property
    def end_s(self) -> float:
        """Time of the latest knot, from the beginning."""
        return max(0, len(self.poses) - 1) * STEP_S

    def settle(self) -> None:
        """Wait at the end until everything has come to rest."""
        self.wait(_SETTLE_S, "settle")

    def wait(self, duration_s: float, phase: str) -> None:
        """Stand still for at least two knots."""
        knots = max(2, math.ceil(duration_s / STEP_S - 1e-9))
        hand = self._hands[0]
        stay = hand.stay(round(knots * STEP_S, 6))
        self.run({hand.arm.articulation.name: [stay]}, phase)

    def has_slipped(self) -> bool:
        """Whether the first body that was held has left the fingers."""
        held = self._hands[0].held
        return held.count(self._first_held) >= _SLIP_KNOTS and not held[-1]

    def recover(self, planners: Sequence[manipulation_planner.TaskPlanner]) -> scene.FailureKind:
        """Notice the failure: wait, plan from the simulated state, and let no other happen."""
        self.wait(_SETTLE_S, "notice")
        for planner in planners:
            planner.look(self.poses[-1])
        self._recovered = self._assignment.failure
        return ""

    def episode(self, start_s: float) -> scene.Episode:
        """The record, and whether it is a success, at times from ``start_s`` on."""
        succeeded = not self.failed_conditions()
        return scene.Episode(
            succeeded,
            "" if succeeded else self._assignment.failure,
            tuple(_spans(self._phases, start_s)),
            tuple(
                sorted(
                    (s for h in self._hands for s in _spans(h.held, start_s) if s.label),
                    key=lambda span: span.start_s,
                )
            ),
            tuple(self._contact_spans(start_s)),
            self._assignment.failure if succeeded and self._assignment.recovers else "",
        )

    def failed_conditions(self) -> list[scene.Condition]:
        """The conditions of success that do not hold."""
        return [
            condition
            for k, condition in enumerate(self._assignment.success)
            if not any(
                condition.holds(values[k])
                for values in (self._judged if condition.ever else self._judged[-1:])
            )
        ]

    def value_at_end(self, condition: scene.Condition) -> float:
        """Value of a condition of success at the latest knot."""
        return self._judged[-1][self._assignment.success.index(condition)]

    @property
    def _judged(self) -> list[tuple[float, ...]]:
        """Values up to the deadline."""
        deadline_s = self._assignment.deadline_s
        if deadline_s is None:
            return self._values
        return self._values[: math.floor(deadline_s / STEP_S + 1e-9) + 1]

    def _held_body(self, hand: _Hand, leg: Leg) -> str:
        """Name of the body that is in the hand on a leg; empty where it fails to hold it."""
        if leg.held is None:
            hand.torn = ""
            return ""
        if self._tears_off(hand, leg.held):
            hand.torn = leg.held.body
        if hand.torn:
            return ""
        body, failure = leg.held.body, self._assignment.failure
        self._first_held = self._first_held or body
        if failure in _IN_HAND or self._recovered or body != self._first_held:
            return body
        slips_later = failure == "slip" and hand.held.count(body) < _SLIP_KNOTS
        return body if slips_later else ""

    def _tears_off(self, hand: _Hand, held: Held) -> bool:
        """Whether a suction cup does not seal on a body, or the load exceeds its force."""
        gripper = hand.arm.robot.gripper
        if gripper is None or gripper.cup is None or hand.torn:
            return False
        if hand.held[-1:] != [held.body]:
            T_world_grasp = self._world.pose(held.body) @ held.T_grasp_held.inverse()
            return not suction.is_sealed(self._world, held.body, T_world_grasp, gripper.cup)
        if hand.held[-3:] != [held.body] * 3:
            return False
        one, two, three = (np.array(p[held.body].translation_m) for p in self.poses[-3:])
        acceleration = (one - 2.0 * two + three) / STEP_S**2
        needed_n = suction.needed_force_n(self._world.mass_kg(held.body), acceleration)
        return needed_n > gripper.cup.force_n

    def _record(
        self,
        phase: str,
        moving: Sequence[tuple[_Hand, Leg]],
        positions: Sequence[Sequence[float]],
        bodies: Sequence[str] | None = None,
    ) -> None:
        """Record a knot; ``bodies`` are the bodies in the hands, by default as in the legs."""
        if bodies is None:
            bodies = [self._held_body(hand, leg) for hand, leg in moving]
        before = self.poses[-1] if self.poses else self._start
        poses = {name: self._world.pose(name).rounded() for name in self._start}
        self.poses.append(
            {
                n: p if n in bodies or has_moved(before[n], p) else before[n]
                for n, p in poses.items()
            }
        )
        self._phases.append(phase)
        for (hand, _), body in zip(moving, bodies, strict=True):
            hand.held.append(body)
        self._contacts.append(_sum_contacts(self._touching(bodies, before)))
        first_m = np.array(self._hands[0].arm.grasp_pose(positions[0]).translation_m)
        values = (self._measures.value(c, first_m) for c in self._assignment.success)
        self._values.append(tuple(values))

    def _touching(self, bodies: Sequence[str], before: Mapping[str, se3.SE3]) -> Iterator[Contact]:
        """Contacts of two bodies, one of which moves or is of an arm."""
        moving = {n for n, pose in self.poses[-1].items() if pose != before[n]} | {*bodies}
        moving |= {hand.arm.body(link) for hand in self._hands for link in hand.arm.moving}
        robots = [set(hand.arm.bodies) for hand in self._hands]
        # A grasp leaves some micrometres, which not every simulator counts as contact.
        grasped = [
            Contact(link, held, self._world.gap_m(link, held, _TOUCH_M), 0.0, self._middle_m(link))
            for hand, held in zip(self._hands, bodies, strict=True)
            for link in (hand.fingers if held else ())
        ]
        for contact in (*self._world.contacts(), *grasped):
            one, other = contact.one, contact.other
            own = any(one in links and other in links for links in robots)
            if contact.gap_m < _TOUCH_M and not own and (one in moving or other in moving):
                yield contact

    def _contact_spans(self, start_s: float) -> Iterator[scene.ContactSpan]:
        for pair in sorted({pair for contacts in self._contacts for pair in contacts}):
            seen = [pair if pair in contacts else "" for contacts in self._contacts]
            for span in (span for span in _spans(seen, start_s) if span.label):
                first, end = (round((t - start_s) / STEP_S) for t in (span.start_s, span.end_s))
                values = [c[pair] for c in self._contacts[first:end] if pair in c]
                forces, points = zip(*values, strict=True)
                yield scene.ContactSpan(pair, span.start_s, span.end_s, STEP_S, forces, points)

    def _middle_m(self, link: str) -> se3.Vec3:
        low, high = self._world.bounds_m(link)
        x, y, z = (0.5 * (low + high)).tolist()
        return (x, y, z)


def _finger_joint(held: Held) -> scene.BodyJoint:
    """The joint that a held body turns about: the line between the fingers."""
    T_held_grasp = held.T_grasp_held.inverse()
    x, y, z = T_held_grasp.rotate(np.array([0.0, 1.0, 0.0])).tolist()
    anchor_m = T_held_grasp.translation_m
    return scene.BodyJoint(
        held.body, "revolute", (x, y, z), anchor_m, -math.pi, math.pi, _PAD_FRICTION_N_M
    )


def _sum_contacts(contacts: Iterable[Contact]) -> dict[str, tuple[float, se3.Vec3]]:
    """Sum of forces [N] and middle of the points [m] of every pair of bodies."""
    points: dict[str, list[Contact]] = {}
    for contact in contacts:
        points.setdefault(" + ".join(sorted((contact.one, contact.other))), []).append(contact)
    summed = {}
    for pair, found in points.items():
        x, y, z = (round(math.fsum(c.point_m[k] for c in found) / len(found), 4) for k in range(3))
        summed[pair] = (round(math.fsum(c.force_n for c in found), 3), (x, y, z))
    return summed


def has_moved(one: se3.SE3, other: se3.SE3) -> bool:
    """Whether two poses of a body differ by more than the simulator's noise."""
    cosine = sum(a * b for a, b in zip(one.quaternion_wxyz, other.quaternion_wxyz, strict=True))
    turned = 2.0 * math.sqrt(max(0.0, 2.0 * (1.0 - abs(cosine)))) > _STILL_RAD
    return turned or math.dist(one.translation_m, other.translation_m) > _STILL_M


def _spans(labels: Sequence[str], start_s: float) -> Iterator[scene.Span]:
    """Runs of equal labels; label k holds during the step up to knot k."""
    first = 0
    for k in range(1, len(labels) + 1):
        if k == len(labels) or labels[k] != labels[first]:
            low_s, high_s = start_s + first * STEP_S, start_s + k * STEP_S
            yield scene.Span(labels[first], round(low_s, 6), round(high_s, 6))
            first = k
