"""Goals of arms: the first candidate that is reachable and free of collision."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from gen_data.core import asset_types, errors, kinematics, scene, se3
from gen_data.physics.collision_shapes import CollisionShape
from gen_data.physics.manipulation.grasping import Grasp, Hand
from gen_data.physics.manipulation.inverse_kinematics import make_chain, solve_all
from gen_data.physics.world import World


class Failure(Enum):
    """Why a candidate of a goal fails: the later the check, the earlier in this list."""

    COLLIDES = "arm collides"
    DOES_NOT_FIT = "object does not fit the gripper"
    CANNOT_REACH = "arm cannot reach"


@dataclass(frozen=True, slots=True)
class ArmState:
    """Configuration of an arm.

    Attributes:
        positions: One per movable joint, rounded [rad or m].
        T_world_held: Pose of the held body; None if the arm holds nothing.
    """

    positions: tuple[float, ...]
    T_world_held: se3.SE3 | None = None


class Arm:
    """A robot in a world; its links are the bodies ``<articulation>/<link>``.

    Attributes:
        articulation: The robot in the scene.
        robot: Its model.
        links: Links with collision geometry.
        moving: Links among these that can move.
        bodies: Names of the bodies of all its links.
    """

    def __init__(
        self,
        articulation: scene.Articulation,
        robot: asset_types.RobotModel,
        shapes: dict[str, CollisionShape],
        world: World,
    ) -> None:
        self.articulation = articulation
        self.robot = robot
        self.links = [link for link in robot.links if link in shapes]
        base = kinematics.rigid_group(robot, robot.links[0])
        self.moving = [link for link in self.links if link not in base]
        self.bodies = [self.body(link) for link in self.links]
        self._world = world
        self._shapes = shapes
        self._fingers = kinematics.finger_links(robot)
        poses = kinematics.link_poses(
            robot, articulation.T_world_base, articulation.joint_positions
        )
        for link in self.links:
            world.add(self.body(link), shapes[link], poses[link])

    def radius_m(self, link: str) -> float:
        """Radius of a link's collision geometry about the link's origin."""
        shape = self._shapes[link]
        points = shape.vertices_m + np.array(shape.center_of_mass_m)
        return float(np.sqrt((points * points).sum(axis=1).max()))

    def body(self, link: str) -> str:
        """Name of a link's body."""
        return f"{self.articulation.name}/{link}"

    def show(self, positions: Sequence[float]) -> None:
        """Pose the links in the world at these joint positions [rad or m]."""
        poses = kinematics.link_poses(self.robot, self.articulation.T_world_base, positions)
        for link in self.moving:
            self._world.place(self.body(link), poses[link])

    def grasp_pose(self, positions: Sequence[float]) -> se3.SE3:
        """``T_world_grasp`` at these joint positions; ``T_world_root`` without a gripper."""
        poses = kinematics.link_poses(self.robot, self.articulation.T_world_base, positions)
        gripper = self.robot.gripper
        if gripper is None:
            return poses[self.robot.links[0]]
        return poses[gripper.link] @ gripper.T_link_grasp

    def solve(self, fixed: Sequence[str], placed: Sequence[str]) -> ArmState | errors.Rejection:
        """Solve the articulation's goal: pose the arm at the first candidate without collision.

        Args:
            fixed: Names of bodies that never move.
            placed: Names of dynamic bodies that are already at rest.
        """
        goal = self.articulation.goal
        if goal is None:
            state = ArmState(kinematics.round_positions(self.articulation.joint_positions))
            self._show_state(state, "")
            hit = next((name for name in fixed if self._touches_any(self.moving, [name])), "")
            return self._reject(Failure.COLLIDES, goal, hit) if hit else state
        obstacles = [name for name in (*fixed, *placed) if name != goal.grasped_object]
        failures = {Failure.CANNOT_REACH}
        for candidate in self._candidates(goal):
            if isinstance(candidate, Failure):
                failures.add(candidate)
                continue
            self._show_state(candidate, goal.grasped_object)
            if not self._collides(obstacles, goal.grasped_object):
                return candidate
            failures.add(Failure.COLLIDES)
        # The candidate that got farthest shows best how to change the goal.
        return self._reject(next(f for f in Failure if f in failures), goal)

    def _candidates(self, goal: scene.ArmGoal) -> Iterator[ArmState | Failure]:
        """Candidates in order, or why one of them fails before collisions are checked."""
        if goal.kind == "joints":
            yield from self._joint_candidates(goal)
            return
        gripper = self.robot.gripper
        if gripper is None:
            return
        chain = make_chain(self.robot, gripper)
        hand = Hand(self.robot, gripper, self._world, self.body) if goal.kind == "hold" else None
        T_base_world = self.articulation.T_world_base.inverse()
        for T_world_grasp in goal.pose_candidates:
            grasp: Grasp | None = Grasp(goal.gripper_opening)
            if hand:
                grasp = hand.grasp(goal.grasped_object, T_world_grasp)
            if grasp is None:
                yield Failure.DOES_NOT_FIT
                continue
            for arm_positions in solve_all(chain, T_base_world @ T_world_grasp):
                positions = kinematics.all_positions(self.robot, arm_positions, grasp.opening)
                yield ArmState(positions, self._held_pose(positions, grasp))

    def _joint_candidates(self, goal: scene.ArmGoal) -> Iterator[ArmState | Failure]:
        count = sum(kinematics.is_arm_joint(joint, self.robot) for joint in self.robot.movable)
        for candidate in goal.joint_candidates:
            if len(candidate) != count:
                raise ValueError(
                    f"{self.articulation.name}: a joint candidate has {len(candidate)} "
                    f"positions, the arm has {count} joints"
                )
            positions = kinematics.all_positions(self.robot, candidate, goal.gripper_opening)
            ok = kinematics.is_within_limits(self.robot, positions)
            yield ArmState(positions) if ok else Failure.CANNOT_REACH

    def _held_pose(self, positions: tuple[float, ...], grasp: Grasp) -> se3.SE3 | None:
        if grasp.T_grasp_held is None:
            return None
        return (self.grasp_pose(positions) @ grasp.T_grasp_held).rounded()

    def _show_state(self, state: ArmState, held: str) -> None:
        self.show(state.positions)
        if state.T_world_held is not None:
            self._world.place(held, state.T_world_held)

    def _collides(self, obstacles: Sequence[str], held: str) -> bool:
        if self._touches_any(self.moving, obstacles):
            return True
        if held:
            palm = [link for link in self.links if link not in self._fingers]
            if self._touches_any(palm, [held]) or self._touches(held, obstacles):
                return True
        return self._collides_with_itself()

    def _collides_with_itself(self) -> bool:
        allowed = self.robot.no_collide
        return any(
            (one, other) not in allowed
            and (other, one) not in allowed
            and self._touches(self.body(one), [self.body(other)])
            for k, one in enumerate(self.links)
            for other in self.links[k + 1 :]
        )

    def _touches_any(self, links: Sequence[str], others: Sequence[str]) -> bool:
        return any(self._touches(self.body(link), others) for link in links)

    def _touches(self, name: str, others: Sequence[str]) -> bool:
        return any(self._world.gap_m(name, other, limit_m=0.0) < 0.0 for other in others)

    def _reject(
        self, failure: Failure, goal: scene.ArmGoal | None, hit: str = ""
    ) -> errors.Rejection:
        name, reason = self.articulation.name, failure.value
        if failure is Failure.DOES_NOT_FIT:
            remedy = f"let arm '{name}' hold smaller objects, or lower their scale"
        elif goal is None:
            reason = f"arm '{name}' at rest collides with '{hit}'"
            remedy = f"move robot '{name}' (elements.{name}.at_m), or give it other joint positions"
        else:
            remedy = (
                f"more candidates for arm '{name}', a smaller workspace, "
                "or fewer objects around it (count)"
            )
        return errors.Rejection(reason, remedy)
