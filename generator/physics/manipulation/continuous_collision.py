"""What an arm hits on a leg of its way, found by conservative advancement.

Between two looks nothing moves farther than the gap that was measured, so that nothing can be
passed through (Mirtich, Impulse-based dynamic simulation of rigid body systems, 1996, chapter 2).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gen_data.generator.core.asset_types import RobotModel
from gen_data.generator.core.kinematics import finger_links, rigid_group
from gen_data.generator.physics.bullet import World
from gen_data.generator.physics.manipulation.arm_goals import Arm
from gen_data.generator.physics.manipulation.joint_trajectories import Held, Leg

CLEARANCE_M = 0.003
"""Distance that an arm keeps from everything where it is free to choose its way."""
ITSELF = "itself"

_LOOK_M = 0.1
"""How far ahead gaps are measured."""
_FINE_M = 0.002
"""Where things are nearer than this, looks are this far apart."""
_SUPPORT_M = 0.001
"""What is held may overlap the surface it stands on by this much, as it does at rest."""
_TOUCH_M = 0.0002
"""Overlap that is put down to rounding."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What an arm may hit.

    Attributes:
        fixed: Names of bodies that never move.
        loose: Names of bodies that lie around.
        clearance_m: Distance that is kept from all of them; 0 = they may be touched.
    """

    fixed: Sequence[str]
    loose: Sequence[str]
    clearance_m: float = CLEARANCE_M


@dataclass(frozen=True, slots=True)
class _Pair:
    """Two bodies that must not come nearer than a gap, and how far they move against each other."""

    one: str
    other: str
    gap_min_m: float
    travel_m: float
    named: str


class CollisionSweep:
    """The moving links of an arm, and what it holds, on their way through a world."""

    def __init__(self, arm: Arm, world: World) -> None:
        self._arm = arm
        self._world = world
        self._levers = _levers(arm.robot)
        self._radii_m = {link: arm.radius_m(link) for link in arm.links}
        self._prismatic = {j.name for j in arm.robot.movable if j.kind == "prismatic"}
        gripper = arm.robot.gripper
        self._hand = gripper.link if gripper else ""
        holding = rigid_group(arm.robot, self._hand) if gripper else frozenset()
        self._holding = holding | set(finger_links(arm.robot))

    def hit(self, leg: Leg, around: Surroundings) -> str:
        """Name of what is hit first; empty if the way is free."""
        self.show(leg, 0.0)
        pairs = list(self._pairs(leg, around))
        share = 0.0
        while True:
            self.show(leg, share)
            advance = 1.0
            for pair in pairs:
                spare_m = self._world.gap_m(pair.one, pair.other, _LOOK_M) - pair.gap_min_m
                if spare_m < 0.0:
                    return pair.named
                if pair.travel_m > 0.0:
                    advance = min(advance, max(spare_m, _FINE_M) / pair.travel_m)
            if share >= 1.0:
                return ""
            share = min(1.0, share + advance)

    def show(self, leg: Leg, share: float) -> None:
        """Put the arm, and what it holds, where they are after a share of a leg."""
        positions = leg.at(share)
        self._arm.show(positions)
        if leg.held is not None:
            pose = self._arm.grasp_pose(positions) @ leg.held.T_grasp_held
            self._world.place(leg.held.body, pose)

    def _pairs(self, leg: Leg, around: Surroundings) -> Iterator[_Pair]:
        changes = {
            joint.name: abs(b - a)
            for joint, a, b in zip(self._arm.robot.movable, leg.start, leg.end, strict=True)
        }
        least_m = around.clearance_m - _TOUCH_M
        for link in self._arm.moving:
            travel_m = self._travel_m(link, self._radii_m[link], changes)
            for other in (*around.fixed, *around.loose):
                yield _Pair(self._arm.body(link), other, least_m, travel_m, other)
        yield from self._own_pairs(changes)
        if leg.held is not None:
            yield from self._held_pairs(leg.held, around, changes)

    def _own_pairs(self, changes: Mapping[str, float]) -> Iterator[_Pair]:
        allowed = self._arm.robot.no_collide
        links = self._arm.links
        for k, one in enumerate(links):
            for other in links[k + 1 :]:
                if (one, other) in allowed or (other, one) in allowed:
                    continue
                apart = {
                    name: change
                    for name, change in changes.items()
                    if (name in self._levers[one]) != (name in self._levers[other])
                }
                travel_m = self._travel_m(one, self._radii_m[one], apart)
                travel_m += self._travel_m(other, self._radii_m[other], apart)
                if travel_m > 0.0:
                    a, b = self._arm.body(one), self._arm.body(other)
                    yield _Pair(a, b, -_TOUCH_M, travel_m, ITSELF)

    def _held_pairs(
        self, held: Held, around: Surroundings, changes: Mapping[str, float]
    ) -> Iterator[_Pair]:
        low, high = self._world.bounds_m(held.body)
        hand = self._world.pose(self._arm.body(self._hand)).translation_m
        far = np.maximum(np.abs(low - hand), np.abs(high - hand))
        travel_m = self._travel_m(self._hand, float(np.sqrt((far * far).sum())), changes)
        standing_m = around.clearance_m if around.clearance_m > 0.0 else -_SUPPORT_M
        for other in around.fixed:
            yield _Pair(held.body, other, standing_m - _TOUCH_M, travel_m, other)
        for other in around.loose:
            yield _Pair(held.body, other, around.clearance_m - _TOUCH_M, travel_m, other)
        for link in self._arm.links:
            if link not in self._holding:
                yield _Pair(held.body, self._arm.body(link), -_TOUCH_M, travel_m, ITSELF)

    def _travel_m(self, link: str, radius_m: float, changes: Mapping[str, float]) -> float:
        """A length that no point within a radius of a link's origin exceeds on its way."""
        return sum(
            changes[name] * (1.0 if name in self._prismatic else lever_m + radius_m)
            for name, lever_m in self._levers[link].items()
            if name in changes
        )


def _levers(robot: RobotModel) -> dict[str, dict[str, float]]:
    """Per link, the joints that move it, and how far its origin can be from each of them [m]."""
    levers: dict[str, dict[str, float]] = {robot.links[0]: {}}
    for joint in robot.joints:
        offset = joint.T_parent_joint.translation_m
        length_m = float(np.sqrt(sum(v * v for v in offset)))
        if joint.kind == "prismatic":
            length_m += max(abs(joint.lower), abs(joint.upper))
        before = levers[joint.parent]
        levers[joint.child] = {name: lever + length_m for name, lever in before.items()}
        if joint.movable:
            levers[joint.child][joint.name] = 0.0
    return levers
