"""Motion planning: configurations that reach a pose, and collision-free paths between them."""

import math
from collections.abc import Iterator, Sequence
from itertools import islice, pairwise

from gen_data.core.kinematics import all_positions, is_arm_joint, round_positions
from gen_data.core.motion import Trajectory
from gen_data.core.se3 import SE3
from gen_data.physics.manipulation.arm_goals import Arm
from gen_data.physics.manipulation.continuous_collision import CollisionSweep, Obstacles
from gen_data.physics.manipulation.inverse_kinematics import (
    EXACT,
    make_chain,
    solve_all,
    solve_near,
)
from gen_data.physics.manipulation.joint_trajectories import Held, Leg, speed_max
from gen_data.physics.world import World

Positions = tuple[float, ...]

_LINE_M, _LINE_RAD = 0.02, 0.15
"""Farthest neighbours on straight lines of the hand: between them a joint path of an arm with links
of half a metre leaves the line by a tenth of a millimetre."""
_LINE_JOINT_RAD = 0.6
"""Largest turn of a joint between such neighbours; more means another branch of solutions."""

_SOLUTIONS_MAX = 4
_GUIDE_STEPS = 5
_RISES_M = (0.10, 0.20, 0.35)
"""Heights of the hand on detours, above the higher end of the path."""


class MotionPlanner:
    """Finds configurations of an arm and collision-free paths between them."""

    def __init__(self, arm: Arm, world: World) -> None:
        self._arm = arm
        self._robot = arm.robot
        self._chain = make_chain(arm.robot, arm.robot.gripper) if arm.robot.gripper else None
        self._sweep = CollisionSweep(arm, world)
        self._T_base_world = arm.articulation.T_world_base.inverse()
        self._is_arm = [is_arm_joint(joint, arm.robot) for joint in arm.robot.movable]

    def with_opening(self, positions: Sequence[float], opening: float) -> Positions:
        """The same configuration of the arm with another opening of the gripper in [0, 1]."""
        return all_positions(self._robot, self._arm_positions(positions), opening)

    def configurations(
        self, T_world_grasp: SE3, start: Positions, opening: float
    ) -> list[Positions]:
        """Positions that put the grasp frame at a pose, least effort first; may be empty."""
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

    def nearest_configuration(self, T_world_grasp: SE3, positions: Positions) -> Positions | None:
        """The solution for a pose that descent from ``positions`` finds; None if it finds none."""
        if self._chain is None:
            return None
        target = self._T_base_world @ T_world_grasp
        exact = solve_near(self._chain, target, self._arm_positions(positions), EXACT)
        if exact is None:
            return None
        remaining = iter(exact)
        return round_positions(
            [
                next(remaining) if is_arm else position
                for is_arm, position in zip(self._is_arm, positions, strict=True)
            ]
        )

    def follow(self, poses: Sequence[SE3], start: Positions) -> list[Positions] | None:
        """Positions along straight lines of the hand from a start through poses; None if it cannot.

        The hand turns evenly on the way. Positions come from ``nearest_configuration``, close
        enough to each other that straight lines in joint space stay near the lines of the hand.
        """
        positions, way = start, []
        for pose in poses:
            here = self._arm.grasp_pose(positions)
            line = Trajectory("hand", 1.0, (here, pose))
            cosine = sum(
                a * b for a, b in zip(here.quaternion_wxyz, pose.quaternion_wxyz, strict=True)
            )
            angle_rad = 2.0 * math.acos(min(1.0, abs(cosine)))
            length_m = math.dist(here.translation_m, pose.translation_m)
            steps = max(1, math.ceil(max(length_m / _LINE_M, angle_rad / _LINE_RAD)))
            for k in range(1, steps + 1):
                found = self.nearest_configuration(line.pose(k / steps), positions)
                if found is None or self._jumps(positions, found):
                    return None
                positions = found
                way.append(found)
        return way

    def _jumps(self, one: Positions, other: Positions) -> bool:
        """Whether a joint turns so far between neighbours on a line that the hand leaves it."""
        return any(
            abs(b - a) > _LINE_JOINT_RAD and is_arm
            for a, b, is_arm in zip(one, other, self._is_arm, strict=True)
        )

    def effort_s(self, start: Positions, end: Positions) -> float:
        """Time of the slowest joint at full speed, plus a tenth of the sum over all joints [s]."""
        times = [
            abs(b - a) / speed_max(joint)
            for joint, a, b in zip(self._robot.movable, start, end, strict=True)
        ]
        return max(times) + 0.1 * sum(times)

    def first_collision(self, leg: Leg, obstacles: Obstacles) -> str | None:
        """Name of the first body hit along a leg, or ``ITSELF``; None if it is free."""
        return self._sweep.first_collision(leg, obstacles)

    def plan(
        self, start: Positions, end: Positions, held: Held | None, obstacles: Obstacles
    ) -> list[Leg] | str:
        """Free legs from one configuration to another, or the body hit by the direct leg."""
        direct = Leg(start, end, held=held)
        collision = self.first_collision(direct, obstacles)
        if collision is None:
            return [direct]
        for via in self._detours(start, end):
            legs = [Leg(a, b, held=held) for a, b in pairwise([start, *via, end])]
            if not any(self.first_collision(leg, obstacles) for leg in legs):
                return legs
        return collision

    def _detours(self, start: Positions, end: Positions) -> Iterator[list[Positions]]:
        """Lists of via points: the hand raised over both ends, then the home configuration."""
        one, other = self._arm.grasp_pose(start), self._arm.grasp_pose(end)
        top_m = max(one.translation_m[2], other.translation_m[2])
        for rise_m in _RISES_M:
            first = self.nearest_configuration(_at_height(one, top_m + rise_m), start)
            last = self.nearest_configuration(_at_height(other, top_m + rise_m), end)
            if first is not None and last is not None:
                yield [first, last]
        home = [
            h if is_arm else position
            for h, is_arm, position in zip(self._robot.home, self._is_arm, end, strict=True)
        ]
        yield [round_positions(home)]

    def _follow_hand(self, T_world_grasp: SE3, start: Positions) -> list[float]:
        """Arm positions near a pose, by following a straight motion of the hand from a start.

        They stay in the start's branch of solutions, which makes for a short path.
        """
        assert self._chain is not None
        motion = Trajectory("hand", 1.0, (self._arm.grasp_pose(start), T_world_grasp))
        positions = self._arm_positions(start)
        for k in range(1, _GUIDE_STEPS):
            target = self._T_base_world @ motion.pose(k / _GUIDE_STEPS)
            positions = list(solve_near(self._chain, target, positions, 1.0) or positions)
        return positions

    def _arm_positions(self, positions: Sequence[float]) -> list[float]:
        """Positions of the arm joints out of the positions of all movable joints."""
        return [p for p, is_arm in zip(positions, self._is_arm, strict=True) if is_arm]


def _at_height(pose: SE3, z_m: float) -> SE3:
    x, y, _ = pose.translation_m
    return SE3((x, y, z_m), pose.quaternion_wxyz)
