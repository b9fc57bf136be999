"""Where an arm may go: configurations for a pose of its hand, and free ways between them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice, pairwise

from gen_data.generator.core.kinematics import all_positions, is_arm_joint, round_positions
from gen_data.generator.core.motion import Trajectory
from gen_data.generator.core.se3 import SE3
from gen_data.generator.physics.bullet import World
from gen_data.generator.physics.manipulation.arm_goals import Arm
from gen_data.generator.physics.manipulation.continuous_collision import (
    CollisionSweep,
    Surroundings,
)
from gen_data.generator.physics.manipulation.inverse_kinematics import (
    EXACT,
    make_chain,
    solve_all,
    solve_near,
)
from gen_data.generator.physics.manipulation.joint_trajectories import Held, Leg, speed_max

Positions = tuple[float, ...]

_SOLUTIONS_MAX = 4
_LED_STEPS = 5
_RISES_M = (0.10, 0.20, 0.35)
"""Of the hand on its detours, above the higher end of a way."""


class MotionPlanner:
    """Finds configurations of an arm and ways between them that hit nothing."""

    def __init__(self, arm: Arm, world: World) -> None:
        self._arm = arm
        self._robot = arm.robot
        self._chain = make_chain(arm.robot, arm.robot.gripper) if arm.robot.gripper else None
        self._sweep = CollisionSweep(arm, world)
        self._T_base_world = arm.articulation.T_world_base.inverse()
        self._is_arm = [is_arm_joint(joint, arm.robot) for joint in arm.robot.movable]

    def opened(self, positions: Sequence[float], opening: float) -> Positions:
        """The same positions with another opening of the gripper."""
        return all_positions(self._robot, self._of_arm(positions), opening)

    def configurations(
        self, T_world_grasp: SE3, start: Positions, opening: float
    ) -> list[Positions]:
        """Positions that put the hand at a pose, those soonest reached first; may be empty."""
        if self._chain is None:
            return []
        target = self._T_base_world @ T_world_grasp
        seeds = [
            self._follow_hand(T_world_grasp, start),
            *islice(solve_all(self._chain, target), _SOLUTIONS_MAX),
        ]
        found: dict[Positions, None] = {}
        for seed in seeds:
            exact = solve_near(self._chain, target, seed)
            if exact is not None:
                found[round_positions(all_positions(self._robot, exact, opening))] = None
        return sorted(found, key=lambda end: self.effort_s(start, end))

    def near(self, T_world_grasp: SE3, positions: Positions) -> Positions | None:
        """The same configuration with the hand at a pose that is near, or None."""
        if self._chain is None:
            return None
        target = self._T_base_world @ T_world_grasp
        exact = solve_near(self._chain, target, self._of_arm(positions), EXACT)
        if exact is None:
            return None
        moved = iter(exact)
        return round_positions(
            [
                next(moved) if is_arm else position
                for is_arm, position in zip(self._is_arm, positions, strict=True)
            ]
        )

    def effort_s(self, start: Positions, end: Positions) -> float:
        """Time that the slowest joint needs at full speed, and a little for each of the others."""
        times = [
            abs(b - a) / speed_max(joint)
            for joint, a, b in zip(self._robot.movable, start, end, strict=True)
        ]
        return max(times) + 0.1 * sum(times)

    def hit(self, leg: Leg, around: Surroundings) -> str:
        """Name of what a leg hits first; empty if it is free."""
        return self._sweep.hit(leg, around)

    def route(
        self, start: Positions, end: Positions, held: Held | None, around: Surroundings
    ) -> list[Leg] | str:
        """Free legs from one configuration to another, or what the straight way hits."""
        direct = Leg(start, end, held=held)
        hit = self.hit(direct, around)
        if not hit:
            return [direct]
        for middle in self._detours(start, end):
            stops = [start, *middle, end]
            legs = [Leg(a, b, held=held) for a, b in pairwise(stops)]
            if not any(self.hit(leg, around) for leg in legs):
                return legs
        return hit

    def _detours(self, start: Positions, end: Positions) -> Iterator[list[Positions]]:
        """Configurations to pass through: the hand raised over both ends, then home."""
        one, other = self._arm.grasp_pose(start), self._arm.grasp_pose(end)
        top_m = max(one.translation_m[2], other.translation_m[2])
        for rise_m in _RISES_M:
            first = self.near(_at_height(one, top_m + rise_m), start)
            last = self.near(_at_height(other, top_m + rise_m), end)
            if first is not None and last is not None:
                yield [first, last]
        home = [
            h if is_arm else position
            for h, is_arm, position in zip(self._robot.home, self._is_arm, end, strict=True)
        ]
        yield [round_positions(home)]

    def _follow_hand(self, T_world_grasp: SE3, start: Positions) -> list[float]:
        """Arm positions near a pose that a hand led there from a start ends with."""
        assert self._chain is not None
        way = Trajectory("hand", 1.0, (self._arm.grasp_pose(start), T_world_grasp))
        positions = self._of_arm(start)
        for k in range(1, _LED_STEPS):
            target = self._T_base_world @ way.pose(k / _LED_STEPS)
            positions = list(solve_near(self._chain, target, positions, 1.0) or positions)
        return positions

    def _of_arm(self, positions: Sequence[float]) -> list[float]:
        return [p for p, is_arm in zip(positions, self._is_arm, strict=True) if is_arm]


def _at_height(pose: SE3, z_m: float) -> SE3:
    x, y, _ = pose.translation_m
    return SE3((x, y, z_m), pose.quaternion_wxyz)
