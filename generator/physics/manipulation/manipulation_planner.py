"""Task planning of one arm: from its goals to legs that are reachable and free of collision."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from gen_data.core import errors, kinematics, scene
from gen_data.core.se3 import SE3, Vec3
from gen_data.physics.manipulation import arm_goals, grasping
from gen_data.physics.manipulation.continuous_collision import ITSELF, Obstacles
from gen_data.physics.manipulation.joint_trajectories import Held, Leg, limit_speed, time_leg
from gen_data.physics.manipulation.motion_planner import MotionPlanner, Positions
from gen_data.physics.settling import home_surface, is_within
from gen_data.physics.world import World

CANNOT_REACH = "its pose or joint positions are out of reach"
NOTHING_TO_GRASP = "no listed object lies free and fits between the fingers"
NOTHING_TO_SUCK = "on no listed object that lies free can the suction cup seal and bear the load"
NOTHING_BETWEEN = "there is nothing between the fingers to close them around"
NOTHING_HELD = "the gripper holds nothing to place"
NO_PLACE = "no candidate is a free and stable place for the held object"

_APPROACH_M = 0.10
"""Length of the straight approach along the fingers, and of the retreat."""
_YAWS = 12
_NARROW = 1.08
"""Grasps at most this much wider than the narrowest one are tried."""
_GRASPS_MAX = 8
_SPOTS_PER_BATCH = 3
_RELEASES_MAX = 4
_CONFIGURATIONS_MAX = 3
_FLOOR_GAP_M = 0.004
"""Between the finger tips and the ground below a grasped object."""
_APART_M = 0.001
"""Objects nearer to each other than this may lean on or carry each other."""
_SUPPORT_GAP_M = 0.002
"""Largest gap between an object and the body that supports it."""
_STABLE_STEPS = 60
_STABLE_M = 0.002
"""A stable object moves no farther than this in so many simulated steps."""
_BLOWS_MAX = 8
_BLOW_M = 0.08
"""Distance from a body at which a hand comes down to knock it away; it goes half as far beyond."""
_PUSH_M_S = 0.15
"""Fastest empty hand that may push bodies: links have no speed in physics, which moves overlapped
bodies out of the way by a fifth of the overlap per step of 1/240 s. At this speed bodies lag behind
by 3 mm, half the thickness of a thin finger."""
_HALF_TURN = SE3(quaternion_wxyz=(0.0, 0.0, 0.0, 1.0))
"""The same grasp with the fingers exchanged."""
_FLIP = SE3(quaternion_wxyz=(0.0, 1.0, 0.0, 0.0))


class TaskPlanner:
    """Plans the task of one arm in a world where everything else is at rest.

    Args:
        arm: The robot, in the world.
        state: Its state at the beginning.
        world: The world it moves in.
        fixed: Names of bodies that never move, and of other arms' links.
        resting: ``{name: T_world_body}`` of all movable bodies at rest.
        surfaces: Surfaces that objects may be placed on.

    Attributes:
        arm: The robot.
        positions: Positions of all joints after the legs planned so far.
        resting: Poses of bodies after the legs planned so far, without the held one.
    """

    def __init__(
        self,
        arm: arm_goals.Arm,
        state: arm_goals.ArmState,
        world: World,
        fixed: Sequence[str],
        resting: Mapping[str, SE3],
        surfaces: Sequence[scene.SupportSurface],
    ) -> None:
        self.arm = self._arm = arm
        self._world = world
        self._fixed = list(fixed)
        self._surfaces = surfaces
        self._motion = MotionPlanner(arm, world)
        gripper = arm.robot.gripper
        self._hand = grasping.Hand(arm.robot, gripper, world, arm.body) if gripper else None
        self.positions = state.positions
        self.resting = dict(resting)
        goal = arm.articulation.goal
        held = goal.grasped_object if goal and state.T_world_held is not None else ""
        self._held = self._initial_held(held, state) if held else None
        self.resting.pop(held, None)

    def plan(self) -> list[Leg] | errors.Rejection:
        """Timed legs to all goals, in order, or the reason why one cannot be accomplished."""
        legs: list[Leg] = []
        for number, goal in enumerate(self._arm.articulation.task, 1):
            planned = self.plan_goal(goal, number)
            if isinstance(planned, errors.Rejection):
                return planned
            legs += planned
        self._restore_world()
        return legs

    def plan_goal(self, goal: scene.ArmGoal, number: int) -> list[Leg] | errors.Rejection:
        """Timed legs to the next goal, or the reason why it cannot be accomplished.

        Args:
            goal: The goal.
            number: Its place in the task, from 1, for that reason.
        """
        self._restore_world()
        planned = self._plan_untimed(goal, number)
        if isinstance(planned, errors.Rejection):
            return planned
        legs = [time_leg(leg, self._arm.robot, goal.speed) for leg in planned]
        if goal.touches and self._held is None and not _only_rises(goal):
            legs = [limit_speed(leg, self._hand_points_m(leg), _PUSH_M_S) for leg in legs]
        self.positions = legs[-1].end
        return legs

    def _hand_points_m(self, leg: Leg) -> list[Vec3]:
        return [self._arm.grasp_pose(p).translation_m for p in (leg.start, *leg.via, leg.end)]

    def observe(self, poses: Mapping[str, SE3]) -> None:
        """Plan from here on with the poses of bodies from physics, ``T_world_body``."""
        self.resting.update({name: pose for name, pose in poses.items() if name in self.resting})
        if self._held is not None:
            T_grasp_world = self._arm.grasp_pose(self.positions).inverse()
            moved = T_grasp_world @ poses[self._held.body]
            self._held = replace(self._held, T_grasp_held=moved)

    def look(self, poses: Mapping[str, SE3]) -> None:
        """Plan from here on with all poses from physics, and with an empty hand."""
        if self._held is not None:
            self.resting[self._held.body] = poses[self._held.body]
            self._held = None
        self.observe(poses)

    def return_goal(self, body: str, speed: float) -> scene.ArmGoal:
        """The goal of putting a body, once it is grasped, back to where it rests now."""
        pose = self.resting[body]
        self._restore_world()
        rest = self._rest_on_surface(body)
        x, y, z = pose.translation_m
        spot = SE3((x, y, z - (rest.translation_m[2] if rest else 0.0)))
        return scene.ArmGoal("place", pose_candidates=(spot,), speed=speed)

    def plan_blow(self, goal: scene.ArmGoal, number: int) -> list[Leg] | errors.Rejection:
        """Timed legs of a closed hand that knock away the first object of a grasp.

        They come down next to it, pass through its place and rise; of several directions the first
        possible one is taken. The object keeps its place in ``resting``.
        """
        start, refused = self.positions, self._reject([], CANNOT_REACH, number)
        for k in range(_BLOWS_MAX):
            self.positions = start
            legs: list[Leg] = []
            for blow in self._blow_goals(goal, 2.0 * math.pi * k / _BLOWS_MAX):
                planned = self.plan_goal(blow, number)
                if isinstance(planned, errors.Rejection):
                    refused = planned
                    break
                legs += planned
            else:
                return legs
        self.positions = start
        return refused

    def _blow_goals(self, goal: scene.ArmGoal, yaw_rad: float) -> list[scene.ArmGoal]:
        body = goal.objects[0]
        self._restore_world()
        low, high = self._world.bounds_m(body)
        x, y, z = (float(v) for v in 0.5 * (low + high))
        tip_m = self._hand.tip_depth_m() if self._hand else 0.0
        z = max(z, float(low[2]) + tip_m + 2.0 * _FLOOR_GAP_M)
        way_m = 0.5 * math.hypot(*(float(v) for v in (high - low)[:2])) + _BLOW_M
        turn = SE3.about_z(yaw_rad)
        place = SE3((x, y, z)) @ turn @ SE3((-way_m, 0.0, _APPROACH_M)) @ _FLIP
        rise = SE3((0.0, 0.0, 1.5 * _APPROACH_M))
        ahead = (turn @ SE3((way_m + 0.5 * _BLOW_M, 0.0, 0.0))).translation_m
        return [
            scene.ArmGoal("reach", pose_candidates=(place,), gripper_opening=0.0, speed=goal.speed),
            scene.ArmGoal("move", waypoints=(SE3((0.0, 0.0, -_APPROACH_M)),), speed=goal.speed),
            scene.ArmGoal("move", waypoints=(SE3(ahead),), touches=(body,), speed=goal.speed),
            scene.ArmGoal("move", waypoints=(rise,), touches=(body,), speed=goal.speed),
        ]

    def all_poses(self) -> dict[str, SE3]:
        """``{name: T_world_body}`` of all movable bodies now, with the held one."""
        if self._held is None:
            return dict(self.resting)
        pose = self._arm.grasp_pose(self.positions) @ self._held.T_grasp_held
        return {**self.resting, self._held.body: pose.rounded()}

    def _plan_untimed(self, goal: scene.ArmGoal, number: int) -> list[Leg] | errors.Rejection:
        if goal.kind == "grasp":
            return self._plan_grasp(goal, number)
        if goal.kind == "place":
            return self._plan_place(goal, number)
        if goal.kind == "grip":
            return self._plan_grip(goal, number)
        if goal.carries and self._held is None:
            return self._reject([], NOTHING_HELD, number)
        if goal.kind == "move":
            return self._plan_move(goal, number)
        collisions: list[str] = []
        for end in self._goal_configurations(goal):
            path = self._plan_path(end)
            if not isinstance(path, str):
                return path
            collisions.append(path)
        return self._reject(collisions, CANNOT_REACH, number)

    def _goal_configurations(self, goal: scene.ArmGoal) -> Iterator[Positions]:
        """Configurations at a goal, in the order of its candidates."""
        opening = self._held.opening if self._held else goal.gripper_opening
        for candidate in goal.joint_candidates:
            positions = kinematics.all_positions(self._arm.robot, candidate, opening)
            if kinematics.is_within_limits(self._arm.robot, positions):
                yield positions
        for pose in goal.pose_candidates:
            found = self._motion.configurations(
                self._hand_pose(goal, pose), self.positions, opening
            )
            yield from found[:_CONFIGURATIONS_MAX]

    def _hand_pose(self, goal: scene.ArmGoal, pose: SE3) -> SE3:
        """``T_world_grasp`` for a pose of a goal, which may be a pose of the held object."""
        if not goal.carries or self._held is None:
            return pose
        return pose @ self._held.T_surface_rest @ self._held.T_grasp_held.inverse()

    def _plan_move(self, goal: scene.ArmGoal, number: int) -> list[Leg] | errors.Rejection:
        """One leg along straight lines of the hand, which may touch some bodies."""
        hand = self._arm.grasp_pose(self.positions)
        poses = [motion @ hand for motion in goal.waypoints]
        if goal.pivots:
            if self._held is None:
                return self._reject([], NOTHING_HELD, number)
            poses = [SE3(pose.translation_m, hand.quaternion_wxyz) for pose in poses]
        way = self._motion.follow(poses, self.positions)
        if way is None:
            return self._reject([], CANNOT_REACH, number)
        via = tuple(way[:-1])
        leg = Leg(self.positions, way[-1], held=self._held, via=via, pivots=goal.pivots)
        # Physics decides how far a body that pivots has turned on the way.
        checked = None if goal.pivots else self._held
        # Arms that move together keep their distance.
        partners = tuple(f"{arm}/" for arm in goal.arms)
        obstacles = Obstacles(
            [n for n in self._fixed if n not in goal.touches and not n.startswith(partners)],
            [name for name in self.resting if name not in goal.touches],
            clearance_m=0.0,
        )
        self._restore_world()
        for start, end in leg.lines:
            collision = self._motion.first_collision(Leg(start, end, held=checked), obstacles)
            if collision is not None:
                return self._reject([collision], CANNOT_REACH, number)
        return [leg]

    def _plan_grip(self, goal: scene.ArmGoal, number: int) -> list[Leg] | errors.Rejection:
        """A leg of the fingers; their object rests from then on where it is, or is held."""
        opening, taken = goal.gripper_opening, goal.objects[0] if goal.carries else ""
        if goal.objects and self._hand is not None:
            T_world_grasp = self._arm.grasp_pose(self.positions)
            opening = self._hand.opening_around(goal.objects[0], T_world_grasp, play=not taken)
        if self._held is not None:
            pose = self._arm.grasp_pose(self.positions) @ self._held.T_grasp_held
            self.resting[self._held.body] = pose.rounded()
            self._held = None
        end = kinematics.round_positions(self._motion.with_opening(self.positions, opening))
        leg = Leg(self.positions, end)
        if taken:
            if opening <= 0.0:
                return self._reject([], NOTHING_BETWEEN, number)
            self._restore_world()
            pose = self.resting.pop(taken)
            height_m = pose.translation_m[2] - float(self._world.bounds_m(taken)[0][2])
            rest = SE3((0.0, 0.0, height_m), pose.quaternion_wxyz)
            T_grasp_held = self._arm.grasp_pose(end).inverse() @ pose
            self._held = Held(taken, T_grasp_held, rest, opening)
            return [leg, Leg(end, end, held=self._held)]
        return [leg]

    def _plan_path(self, end: Positions) -> list[Leg] | str:
        """Legs from the current configuration to another, clear of all resting bodies."""
        self._restore_world()
        obstacles = Obstacles(self._fixed, list(self.resting))
        return self._motion.plan(self.positions, end, self._held, obstacles)

    # Grasping.

    def _plan_grasp(self, goal: scene.ArmGoal, number: int) -> list[Leg] | errors.Rejection:
        if self._hand is None or self._held is not None:
            return self._reject([], NOTHING_TO_GRASP, number)
        otherwise = NOTHING_TO_SUCK
        if not self._hand.sucks:
            otherwise = f"{NOTHING_TO_GRASP}, which open by {1000.0 * self._hand.stroke_m:.0f} mm"
        collisions: list[str] = []
        for body in goal.objects:
            rest = self._rest_on_surface(body)
            if rest is None:
                continue
            grasps = self._find_grasps(self._hand, body)
            if grasps:
                otherwise = CANNOT_REACH
            for candidate in self._grasp_candidates(grasps, body, rest):
                legs = self._plan_lift(*candidate)
                if not isinstance(legs, str):
                    self._held = candidate[0]
                    del self.resting[body]
                    return legs
                collisions.append(legs)
        return self._reject(collisions, otherwise, number)

    def _grasp_candidates(
        self, grasps: list[grasping.Grasp], body: str, rest: SE3
    ) -> list[tuple[Held, Positions, Positions]]:
        """The narrowest grasps with configurations at and above them, least effort first."""
        candidates = []
        for grasp in grasps:
            if grasp.T_grasp_held is None or grasp.opening > _NARROW * grasps[0].opening:
                continue
            for turn in (SE3(), _HALF_TURN):
                held = Held(body, turn @ grasp.T_grasp_held, rest, grasp.opening)
                pairs = self._approach_pairs(held, self.resting[body])
                candidates += [(held, *pair) for pair in pairs]
        candidates.sort(key=lambda candidate: self._effort_s(*candidate[1:]))
        return candidates[:_GRASPS_MAX]

    def _find_grasps(self, hand: grasping.Hand, body: str) -> list[grasping.Grasp]:
        """Grasps of a resting body from above, the narrowest first.

        Some close along its own axes, flush with the faces of a box.
        """
        T_world_held = self.resting[body]
        first = _heading_rad(T_world_held)
        low, high = self._world.bounds_m(body)
        x, y = (float(v) for v in 0.5 * (low + high)[:2])
        bottom, top = float(low[2]), float(high[2])
        height = max(0.5 * (bottom + top), top - hand.palm_height_m())
        height = max(height, bottom + hand.tip_depth_m() + _FLOOR_GAP_M)
        grasps = []
        for k in range(_YAWS):
            yaw = SE3.about_z(first + math.pi * k / _YAWS, (x, y, height))
            if hand.sucks:
                above = SE3((0.0, 0.0, top - height)) @ yaw @ _FLIP
                grasp = hand.suck_in_place(body, T_world_held, above)
            else:
                grasp = hand.grasp_in_place(body, (yaw @ _FLIP).inverse() @ T_world_held)
            if grasp is not None:
                grasps.append(grasp)
        self._restore_world()
        return sorted(grasps, key=lambda grasp: grasp.opening)

    def _plan_lift(self, held: Held, closed: Positions, lifted: Positions) -> list[Leg] | str:
        motion = self._motion
        above, around = motion.with_opening(lifted, 1.0), motion.with_opening(closed, 1.0)
        approach, lift = Leg(above, around), Leg(closed, lifted, held=held)
        self._restore_world()
        collision = motion.first_collision(approach, self._contact_allowed())
        collision = collision or motion.first_collision(lift, self._contact_allowed(held.body))
        path = collision or self._plan_path(above)
        return path if isinstance(path, str) else [*path, approach, Leg(around, closed), lift]

    def _rest_on_surface(self, body: str) -> SE3 | None:
        """``T_surface_rest`` of a body that rests on a surface alone; None if it is not alone."""
        if body not in self.resting:
            return None
        pose = self.resting[body]
        surface = home_surface(self._surfaces, *self._world.bounds_m(body))
        if surface is None or not self._is_supported_by_fixed(body):
            return None
        height = pose.translation_m[2] - surface.T_world_surface.translation_m[2]
        return SE3((0.0, 0.0, height), pose.quaternion_wxyz)

    # Placing.

    def _plan_place(self, goal: scene.ArmGoal, number: int) -> list[Leg] | errors.Rejection:
        """Legs that place the held object and leave the open hand above it."""
        held = self._held
        if held is None:
            return self._reject([], NOTHING_HELD, number)
        collisions: list[str] = []
        for T_world_rest, closed, above in self._place_candidates(held, goal.pose_candidates):
            legs = self._plan_release(held, T_world_rest, closed, above)
            if not isinstance(legs, str):
                self.resting[held.body] = T_world_rest.rounded()
                self._held = None
                return legs
            collisions.append(legs)
        return self._reject(collisions, NO_PLACE, number)

    def _place_candidates(
        self, held: Held, candidates: Sequence[SE3]
    ) -> Iterator[tuple[SE3, Positions, Positions]]:
        """Stable poses of the held body with configurations at and above them.

        Candidates are examined in batches, which prefers early ones; least effort comes
        first within a batch.
        """
        for first in range(0, len(candidates), _SPOTS_PER_BATCH):
            found = []
            for spot in candidates[first : first + _SPOTS_PER_BATCH]:
                T_world_rest = spot @ held.T_surface_rest
                if self._is_stable(held.body, T_world_rest):
                    pairs = self._approach_pairs(held, T_world_rest)
                    found += [(T_world_rest, *pair) for pair in pairs]
            found.sort(key=lambda candidate: self._effort_s(*candidate[1:]))
            yield from found[:_RELEASES_MAX]

    def _plan_release(
        self, held: Held, T_world_rest: SE3, closed: Positions, above: Positions
    ) -> list[Leg] | str:
        """Legs that lower the held body, open the gripper and retreat."""
        motion = self._motion
        opened, away = motion.with_opening(closed, 1.0), motion.with_opening(above, 1.0)
        lower = Leg(above, closed, held=held)
        release, retreat = Leg(closed, opened), Leg(opened, away)
        self._restore_world()
        collision = motion.first_collision(lower, self._contact_allowed())
        self._world.place(held.body, T_world_rest)
        for leg in (release, retreat):
            collision = collision or motion.first_collision(leg, self._contact_allowed(held.body))
        path = collision or self._plan_path(above)
        return path if isinstance(path, str) else [*path, lower, release, retreat]

    def _is_stable(self, body: str, T_world_rest: SE3) -> bool:
        """Whether a body stays at a pose: on a surface, apart from others, and at rest."""
        self._restore_world()
        self._arm.show(self.positions)
        self._world.place(body, T_world_rest)
        if not self._is_supported_by_fixed(body) or not is_within(
            self._surfaces, *self._world.bounds_m(body)
        ):
            return False
        self._world.step(_STABLE_STEPS)
        moved_m = math.dist(self._world.pose(body).translation_m, T_world_rest.translation_m)
        self._restore_world()
        return moved_m < _STABLE_M

    # Shared by both.

    def _approach_pairs(self, held: Held, T_world_held: SE3) -> list[tuple[Positions, Positions]]:
        """Pairs of configurations: with the fingers around a body, and retreated from it."""
        T_world_grasp = T_world_held @ held.T_grasp_held.inverse()
        retreated = T_world_grasp @ SE3((0.0, 0.0, -_APPROACH_M))
        pairs = []
        for closed in self._motion.configurations(T_world_grasp, self.positions, held.opening):
            above = self._motion.nearest_configuration(retreated, closed)
            if above is not None:
                pairs.append((closed, above))
        return pairs

    def _effort_s(self, closed: Positions, above: Positions) -> float:
        effort_s = self._motion.effort_s
        return effort_s(self.positions, above) + 2.0 * effort_s(above, closed)

    def _contact_allowed(self, body: str = "") -> Obstacles:
        """All obstacles without clearance; ``body``: the one that is grasped or was placed."""
        loose = [name for name in self.resting if name != body]
        if body and self._held is not None:
            loose.append(body)
        return Obstacles(self._fixed, loose, clearance_m=0.0)

    def _is_supported_by_fixed(self, body: str) -> bool:
        """Whether a body touches a fixed body and no loose one."""
        others = [name for name in self.resting if name != body]
        apart = all(self._world.gap_m(body, o, _APART_M) >= _APART_M for o in others)
        return apart and any(
            self._world.gap_m(body, name, _SUPPORT_GAP_M) < _SUPPORT_GAP_M for name in self._fixed
        )

    def _initial_held(self, body: str, state: arm_goals.ArmState) -> Held:
        """The body that the arm holds from the beginning; it will be placed upright."""
        assert state.T_world_held is not None
        self._world.place(body, SE3())
        bottom = float(self._world.bounds_m(body)[0][2])
        T_grasp_held = self._arm.grasp_pose(state.positions).inverse() @ state.T_world_held
        opening = kinematics.gripper_opening(self._arm.robot, state.positions)
        return Held(body, T_grasp_held, SE3((0.0, 0.0, -bottom)), opening)

    def _restore_world(self) -> None:
        """Put the arm and all bodies back to where the legs planned so far leave them."""
        for name, pose in self.resting.items():
            self._world.place(name, pose)
        self._arm.show(self.positions)
        if self._held is not None:
            pose = self._arm.grasp_pose(self.positions) @ self._held.T_grasp_held
            self._world.place(self._held.body, pose)

    def _reject(self, collisions: Sequence[str], otherwise: str, number: int) -> errors.Rejection:
        """The first collision as the reason; ``otherwise`` if there was none."""
        reason = otherwise
        if collisions:
            reason = "it hits " + (ITSELF if collisions[0] == ITSELF else f"'{collisions[0]}'")
        name = self._arm.articulation.name
        return errors.Rejection(
            f"arm '{name}', goal {number} of its task: {reason}",
            f"other goals or more candidates for arm '{name}', or fewer objects around it (count)",
        )


def _only_rises(goal: scene.ArmGoal) -> bool:
    return all(w == SE3((0.0, 0.0, max(0.0, w.translation_m[2]))) for w in goal.waypoints)


def _heading_rad(T_world_body: SE3) -> float:
    """Direction of the more level one of a body's X and Y axes, about the vertical."""
    one, other = (T_world_body.rotate(axis) for axis in np.eye(3)[:2])
    x, y, _ = one if abs(one[2]) <= abs(other[2]) else other
    return round(math.atan2(y, x), 9)
