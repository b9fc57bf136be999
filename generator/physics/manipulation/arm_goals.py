"""Arms obey: from the candidates of a goal to the first stance that is reachable and free."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gen_data.generator.core.asset_types import RobotModel
from gen_data.generator.core.errors import Rejection
from gen_data.generator.core.kinematics import (
    all_positions,
    finger_links,
    is_arm_joint,
    is_within_limits,
    link_poses,
    rigid_group,
    round_positions,
)
from gen_data.generator.core.scene import ArmGoal, Articulation
from gen_data.generator.core.se3 import SE3
from gen_data.generator.physics.bullet import World
from gen_data.generator.physics.collision_shapes import CollisionShape
from gen_data.generator.physics.manipulation.grasping import Grasp, Hand
from gen_data.generator.physics.manipulation.inverse_kinematics import make_chain, solve_all

COLLIDES = "arm collides"
CANNOT_REACH = "arm cannot reach"
DOES_NOT_FIT = "object does not fit the gripper"


@dataclass(frozen=True, slots=True)
class ArmState:
    """What an arm ends up doing.

    Attributes:
        positions: One per movable joint, rounded [rad or m].
        T_world_held: Pose of the held body; None where nothing is held.
    """

    positions: tuple[float, ...]
    T_world_held: SE3 | None = None


class Arm:
    """A robot that stands in a world: its links are bodies ``<articulation>/<link>``."""

    def __init__(
        self,
        articulation: Articulation,
        robot: RobotModel,
        shapes: dict[str, CollisionShape],
        world: World,
    ) -> None:
        self._articulation = articulation
        self._robot = robot
        self._world = world
        self._shapes = shapes
        self._links = [link for link in robot.links if link in shapes]
        base = rigid_group(robot, robot.links[0])
        self._moving = [link for link in self._links if link not in base]
        self._fingers = finger_links(robot)
        poses = link_poses(robot, articulation.T_world_base, articulation.joint_positions)
        for link in self._links:
            world.add(self.body(link), shapes[link], poses[link])

    @property
    def bodies(self) -> list[str]:
        """Names of all its links in the world."""
        return [self.body(link) for link in self._links]

    @property
    def articulation(self) -> Articulation:
        """The robot in the scene."""
        return self._articulation

    @property
    def robot(self) -> RobotModel:
        """Its model."""
        return self._robot

    @property
    def links(self) -> list[str]:
        """Links that collide."""
        return self._links

    @property
    def moving(self) -> list[str]:
        """Links that collide and can move."""
        return self._moving

    def radius_m(self, link: str) -> float:
        """Of the ball around a link's origin that holds its collision geometry."""
        shape = self._shapes[link]
        points = shape.vertices_m + np.array(shape.center_of_mass_m)
        return float(np.sqrt((points * points).sum(axis=1).max()))

    def body(self, link: str) -> str:
        """Name of a link in the world."""
        return f"{self._articulation.name}/{link}"

    def show(self, positions: Sequence[float]) -> None:
        """Put the links in the world where these joint positions have them."""
        poses = link_poses(self._robot, self._articulation.T_world_base, positions)
        for link in self._moving:
            self._world.place(self.body(link), poses[link])

    def grasp_pose(self, positions: Sequence[float]) -> SE3:
        """``T_world_grasp`` at these joint positions; of the root link without a gripper."""
        poses = link_poses(self._robot, self._articulation.T_world_base, positions)
        gripper = self._robot.gripper
        if gripper is None:
            return poses[self._robot.links[0]]
        return poses[gripper.link] @ gripper.T_link_grasp

    def obey(self, fixed: Sequence[str], placed: Sequence[str]) -> ArmState | Rejection:
        """Take the first candidate that works and stay there.

        Args:
            fixed: Bodies that never move.
            placed: Dynamic bodies that already lie where they belong.
        """
        goal = self._articulation.goal
        if goal is None:
            stance = ArmState(round_positions(self._articulation.joint_positions))
            self._take(stance, "")
            hit = self._hits(self._moving, fixed)
            return self._rejection(COLLIDES, goal) if hit else stance
        obstacles = [name for name in (*fixed, *placed) if name != goal.held]
        failures = {CANNOT_REACH}
        for candidate in self._stances(goal):
            if isinstance(candidate, str):
                failures.add(candidate)
                continue
            self._take(candidate, goal.held)
            if not self._collides(obstacles, goal.held):
                return candidate
            failures.add(COLLIDES)
        furthest = next(f for f in (COLLIDES, DOES_NOT_FIT, CANNOT_REACH) if f in failures)
        return self._rejection(furthest, goal)

    def _stances(self, goal: ArmGoal) -> Iterator[ArmState | str]:
        """Candidates in order, or why one of them is none."""
        if goal.kind == "joints":
            yield from self._joint_stances(goal)
            return
        gripper = self._robot.gripper
        if gripper is None:
            return
        chain = make_chain(self._robot, gripper)
        hand = Hand(self._robot, gripper, self._world, self.body) if goal.kind == "hold" else None
        T_base_world = self._articulation.T_world_base.inverse()
        for T_world_grasp in goal.pose_candidates:
            grasp = hand.grasp(goal.held, T_world_grasp) if hand else Grasp(goal.opening)
            if grasp is None:
                yield DOES_NOT_FIT
                continue
            for arm_positions in solve_all(chain, T_base_world @ T_world_grasp):
                positions = all_positions(self._robot, arm_positions, grasp.opening)
                yield ArmState(positions, self._held_pose(positions, grasp))

    def _joint_stances(self, goal: ArmGoal) -> Iterator[ArmState | str]:
        count = sum(is_arm_joint(joint, self._robot) for joint in self._robot.movable)
        for candidate in goal.joint_candidates:
            if len(candidate) != count:
                raise ValueError(
                    f"{self._articulation.name}: a joint candidate has {len(candidate)} "
                    f"positions, the arm has {count} joints"
                )
            positions = all_positions(self._robot, candidate, goal.opening)
            ok = is_within_limits(self._robot, positions)
            yield ArmState(positions) if ok else CANNOT_REACH

    def _held_pose(self, positions: tuple[float, ...], grasp: Grasp) -> SE3 | None:
        if grasp.T_grasp_held is None:
            return None
        return (self.grasp_pose(positions) @ grasp.T_grasp_held).rounded()

    def _take(self, stance: ArmState, held: str) -> None:
        self.show(stance.positions)
        if stance.T_world_held is not None:
            self._world.place(held, stance.T_world_held)

    def _collides(self, obstacles: Sequence[str], held: str) -> bool:
        if self._hits(self._moving, obstacles):
            return True
        if held:
            palm = [link for link in self._links if link not in self._fingers]
            if self._hits(palm, [held]) or self._touch(held, obstacles):
                return True
        return self._hits_itself()

    def _hits_itself(self) -> bool:
        allowed = self._robot.no_collide
        return any(
            (one, other) not in allowed
            and (other, one) not in allowed
            and self._touch(self.body(one), [self.body(other)])
            for k, one in enumerate(self._links)
            for other in self._links[k + 1 :]
        )

    def _hits(self, links: Sequence[str], others: Sequence[str]) -> bool:
        return any(self._touch(self.body(link), others) for link in links)

    def _touch(self, name: str, others: Sequence[str]) -> bool:
        return any(self._world.gap_m(name, other, limit_m=0.0) < 0.0 for other in others)

    def _rejection(self, reason: str, goal: ArmGoal | None) -> Rejection:
        name = self._articulation.name
        if reason == DOES_NOT_FIT:
            remedy = f"let arm '{name}' hold smaller objects, or lower their scale"
        elif goal is None:
            remedy = f"move robot '{name}' (at_m) or give it other joint positions"
        else:
            remedy = (
                f"more candidates for arm '{name}', a smaller workspace, "
                "or fewer objects around it (count)"
            )
        return Rejection(reason, remedy)
