"""Continuous collision detection for the legs of an arm, by conservative advancement.

Between two checks no point moves farther than the smallest measured gap: no contact can be
skipped (Mirtich, Impulse-based dynamic simulation of rigid body systems, 1996, chapter 2).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gen_data.core import asset_types, kinematics
from gen_data.physics.manipulation import arm_goals, joint_trajectories
from gen_data.physics.world import World

CLEARANCE_M = 0.003
"""Default distance between an arm and its obstacles."""
ITSELF = "itself"

_GAP_LIMIT_M = 0.1
"""Gaps are measured up to this."""
_ADVANCE_MIN_M = 0.002
"""Least motion between two checks: bounds their number near contact."""
_SUPPORT_M = 0.001
"""Allowed overlap of a held body and its support: as deep as bodies at rest overlap."""
_TOUCH_M = 0.0002
"""Overlap attributed to rounding."""


@dataclass(frozen=True, slots=True)
class Obstacles:
    """Bodies that an arm must not hit.

    Attributes:
        fixed: Names of bodies that never move.
        loose: Names of movable bodies at rest.
        clearance_m: Distance to keep from all of them; 0 = contact is allowed.
    """

    fixed: Sequence[str]
    loose: Sequence[str]
    clearance_m: float = CLEARANCE_M


@dataclass(frozen=True, slots=True)
class _Pair:
    """Two bodies to keep apart.

    Attributes:
        gap_min_m: A smaller gap is a collision.
        travel_m: Upper bound of their relative motion over the whole leg.
        obstacle: Name of the other body; ``ITSELF`` for a link of the same arm.
    """

    one: str
    other: str
    gap_min_m: float
    travel_m: float
    obstacle: str


class CollisionSweep:
    """Moves the links of an arm, and the body it holds, along legs and finds collisions."""

    def __init__(self, arm: arm_goals.Arm, world: World) -> None:
        self._arm = arm
        self._world = world
        self._levers = _levers(arm.robot)
        self._radii_m = {link: arm.radius_m(link) for link in arm.links}
        self._prismatic = {j.name for j in arm.robot.movable if j.kind == "prismatic"}
        gripper = arm.robot.gripper
        self._hand = gripper.link if gripper else ""
        holding = kinematics.rigid_group(arm.robot, self._hand) if gripper else frozenset()
        self._holding = holding | set(kinematics.finger_links(arm.robot))

    def first_collision(self, leg: joint_trajectories.Leg, obstacles: Obstacles) -> str | None:
        """Name of the first body hit along a leg, or ``ITSELF``; None if it is free."""
        self._show(leg, 0.0)
        pairs = list(self._pairs(leg, obstacles))
        share = 0.0
        while True:
            self._show(leg, share)
            advance = 1.0
            for pair in pairs:
                spare_m = self._world.gap_m(pair.one, pair.other, _GAP_LIMIT_M) - pair.gap_min_m
                if spare_m < 0.0:
                    return pair.obstacle
                if pair.travel_m > 0.0:
                    advance = min(advance, max(spare_m, _ADVANCE_MIN_M) / pair.travel_m)
            if share >= 1.0:
                return None
            share = min(1.0, share + advance)

    def _show(self, leg: joint_trajectories.Leg, share: float) -> None:
        """Pose the arm and the held body after a share of a leg in [0, 1]."""
        positions = leg.at(share)
        self._arm.show(positions)
        if leg.held is not None:
            pose = self._arm.grasp_pose(positions) @ leg.held.T_grasp_held
            self._world.place(leg.held.body, pose)

    def _pairs(self, leg: joint_trajectories.Leg, obstacles: Obstacles) -> Iterator[_Pair]:
        changes = {
            joint.name: abs(b - a)
            for joint, a, b in zip(self._arm.robot.movable, leg.start, leg.end, strict=True)
        }
        gap_min_m = obstacles.clearance_m - _TOUCH_M
        for link in self._arm.moving:
            travel_m = self._travel_m(link, self._radii_m[link], changes)
            for other in (*obstacles.fixed, *obstacles.loose):
                yield _Pair(self._arm.body(link), other, gap_min_m, travel_m, other)
        yield from self._link_pairs(changes)
        if leg.held is not None:
            yield from self._held_pairs(leg.held, obstacles, changes)

    def _link_pairs(self, changes: Mapping[str, float]) -> Iterator[_Pair]:
        """Pairs of links of the arm that move relative to each other."""
        allowed = self._arm.robot.no_collide
        links = self._arm.links
        for k, one in enumerate(links):
            for other in links[k + 1 :]:
                if (one, other) in allowed or (other, one) in allowed:
                    continue
                # Joints that move both links do not change the distance between them.
                relative = {
                    name: change
                    for name, change in changes.items()
                    if (name in self._levers[one]) != (name in self._levers[other])
                }
                travel_m = self._travel_m(one, self._radii_m[one], relative)
                travel_m += self._travel_m(other, self._radii_m[other], relative)
                if travel_m > 0.0:
                    a, b = self._arm.body(one), self._arm.body(other)
                    yield _Pair(a, b, -_TOUCH_M, travel_m, ITSELF)

    def _held_pairs(
        self, held: joint_trajectories.Held, obstacles: Obstacles, changes: Mapping[str, float]
    ) -> Iterator[_Pair]:
        """Pairs of the held body with obstacles and with links that it is not held by."""
        low, high = self._world.bounds_m(held.body)
        hand = self._world.pose(self._arm.body(self._hand)).translation_m
        far = np.maximum(np.abs(low - hand), np.abs(high - hand))
        travel_m = self._travel_m(self._hand, float(np.sqrt((far * far).sum())), changes)
        clearance_m = obstacles.clearance_m
        to_support_m = clearance_m if clearance_m > 0.0 else -_SUPPORT_M
        for other in obstacles.fixed:
            yield _Pair(held.body, other, to_support_m - _TOUCH_M, travel_m, other)
        for other in obstacles.loose:
            yield _Pair(held.body, other, clearance_m - _TOUCH_M, travel_m, other)
        for link in self._arm.links:
            if link not in self._holding:
                yield _Pair(held.body, self._arm.body(link), -_TOUCH_M, travel_m, ITSELF)

    def _travel_m(self, link: str, radius_m: float, changes: Mapping[str, float]) -> float:
        """Upper bound of the motion of all points within a radius of a link's origin.

        Args:
            link: The link.
            radius_m: Radius of a ball around the link's origin.
            changes: ``{joint: |change of position|}`` over the leg [rad or m].
        """
        return sum(
            changes[name] * (1.0 if name in self._prismatic else lever_m + radius_m)
            for name, lever_m in self._levers[link].items()
            if name in changes
        )


def _levers(robot: asset_types.RobotModel) -> dict[str, dict[str, float]]:
    """``{link: {joint that moves it: largest distance of its origin from the joint [m]}}``."""
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
