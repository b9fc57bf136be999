"""Arms on their way: from goals to legs that are within reach and hit nothing."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from gen_data.generator.core.errors import Rejection
from gen_data.generator.core.kinematics import all_positions, gripper_opening, is_within_limits
from gen_data.generator.core.scene import ArmGoal, SupportSurface
from gen_data.generator.core.se3 import SE3
from gen_data.generator.physics.bullet import World
from gen_data.generator.physics.manipulation.arm_goals import Arm, ArmState
from gen_data.generator.physics.manipulation.continuous_collision import Surroundings
from gen_data.generator.physics.manipulation.grasping import Grasp, Hand
from gen_data.generator.physics.manipulation.joint_trajectories import Held, Leg, time_leg
from gen_data.generator.physics.manipulation.motion_planner import MotionPlanner, Positions
from gen_data.generator.physics.placement_surfaces import home_surface, is_within

CANNOT_REACH = "cannot get to its goal"
NOTHING_TO_GRASP = "finds nothing that lies free and fits between its fingers"
NOTHING_HELD = "holds nothing that it could put down"
NO_PLACE = "has no free place for what it holds"

_APPROACH_M = 0.10
"""Of the straight way along the fingers, to what is grasped and from it."""
_YAWS = 12
_NARROW = 1.15
"""Hands take things across sides at most this much wider than the narrowest."""
_TAKES_MAX = 8
_SPOTS_AT_ONCE = 3
_PUTS_MAX = 4
_ENDS_MAX = 3
_FLOOR_GAP_M = 0.004
"""Between the finger tips and the ground of what they grasp."""
_APART_M = 0.001
"""What is nearer to its neighbours than this may lean on them or carry them."""
_STANDS_M = 0.002
"""Largest gap between a thing and what it stands on."""
_STAY_STEPS = 60
_STAY_M = 0.002
"""A thing that is put down must not move farther than this while simulated for so many steps."""
_TURNED = SE3(quaternion_wxyz=(0.0, 0.0, 0.0, 1.0))
"""The same grip with the fingers exchanged."""
_FLIP = SE3(quaternion_wxyz=(0.0, 1.0, 0.0, 0.0))


class TaskPlanner:
    """One arm that passes its goals in turn, in a world where everything else rests.

    Args:
        arm: The robot, in the world.
        stance: What it does at the beginning.
        world: Where it moves.
        fixed: Names of bodies that never move, and of other arms' links.
        resting: ``{name: T_world_body}`` of everything that lies around.
        surfaces: What things may stand on.

    Attributes:
        positions: Of all joints after the legs so far.
        resting: Where things lie after the legs so far; what is held is not among them.
    """

    def __init__(
        self,
        arm: Arm,
        stance: ArmState,
        world: World,
        fixed: Sequence[str],
        resting: Mapping[str, SE3],
        surfaces: Sequence[SupportSurface],
    ) -> None:
        self._arm = arm
        self._world = world
        self._fixed = list(fixed)
        self._surfaces = surfaces
        self._router = MotionPlanner(arm, world)
        gripper = arm.robot.gripper
        self._hand = Hand(arm.robot, gripper, world, arm.body) if gripper else None
        self.positions = stance.positions
        self.resting = dict(resting)
        goal = arm.articulation.goal
        held = goal.held if goal and stance.T_world_held is not None else ""
        self._held = self._held_upright(held, stance) if held else None
        self.resting.pop(held, None)

    def legs(self) -> list[Leg] | Rejection:
        """All legs, timed, or why there are none."""
        legs: list[Leg] = []
        for number, goal in enumerate(self._arm.articulation.way, 1):
            self._restore()
            found = self._plan_goal(goal)
            if isinstance(found, str):
                return self._rejection(found, number)
            legs += [time_leg(leg, self._arm.robot, goal.speed) for leg in found]
            self.positions = legs[-1].end
        self._restore()
        return legs

    def _plan_goal(self, goal: ArmGoal) -> list[Leg] | str:
        """Legs to a goal, not yet timed, or why it cannot be had."""
        if goal.kind == "grasp":
            return self._plan_pick(goal)
        if goal.kind == "place":
            return self._plan_place(goal)
        hits: dict[str, None] = {}
        for end in self._ends(goal):
            route = self._route(end)
            if not isinstance(route, str):
                return route
            hits[route] = None
        return _what_hits(hits, CANNOT_REACH)

    def _ends(self, goal: ArmGoal) -> Iterator[Positions]:
        """Configurations at a goal, in the order of its candidates."""
        opening = self._held.opening if self._held else goal.opening
        for candidate in goal.joint_candidates:
            positions = all_positions(self._arm.robot, candidate, opening)
            if is_within_limits(self._arm.robot, positions):
                yield positions
        for pose in goal.pose_candidates:
            found = self._router.configurations(pose, self.positions, opening)
            yield from found[:_ENDS_MAX]

    def _route(self, end: Positions) -> list[Leg] | str:
        self._restore()
        around = Surroundings(self._fixed, list(self.resting))
        return self._router.route(self.positions, end, self._held, around)

    # Picking up.

    def _plan_pick(self, goal: ArmGoal) -> list[Leg] | str:
        """Legs that end with one of the objects lifted."""
        if self._hand is None or self._held is not None:
            return NOTHING_TO_GRASP
        hits: dict[str, None] = {}
        for body in goal.objects:
            rest = self._rest_on_surface(body)
            if rest is None:
                continue
            for held, closed, lifted in self._takes(self._grips(self._hand, body), body, rest):
                legs = self._pick(held, closed, lifted)
                if not isinstance(legs, str):
                    self._held = held
                    del self.resting[body]
                    return legs
                hits[legs] = None
        return _what_hits(hits, NOTHING_TO_GRASP)

    def _takes(
        self, grips: list[Grasp], body: str, rest: SE3
    ) -> list[tuple[Held, Positions, Positions]]:
        """Configurations at and above the narrowest grips, those soonest reached first."""
        found = []
        for grip in grips:
            if grip.T_grasp_held is None or grip.opening > _NARROW * grips[0].opening:
                continue
            for turn in (SE3(), _TURNED):
                held = Held(body, turn @ grip.T_grasp_held, rest, grip.opening)
                found += [(held, *stop) for stop in self._stops(held, self.resting[body])]
        found.sort(key=lambda take: self._effort_s(*take[1:]))
        return found[:_TAKES_MAX]

    def _grips(self, hand: Hand, body: str) -> list[Grasp]:
        """Ways to hold a body as it lies, from above, across its narrow sides first."""
        T_world_held = self.resting[body]
        low, high = self._world.bounds_m(body)
        x, y = (float(v) for v in 0.5 * (low + high)[:2])
        bottom, top = float(low[2]), float(high[2])
        height = max(0.5 * (bottom + top), top - hand.palm_height_m())
        height = max(height, bottom + hand.tip_depth_m() + _FLOOR_GAP_M)
        found = []
        for k in range(_YAWS):
            yaw = SE3.about_z(math.pi * k / _YAWS, (x, y, height))
            grasp = hand.grasp_as_it_lies(body, (yaw @ _FLIP).inverse() @ T_world_held)
            if grasp is not None:
                found.append(grasp)
        self._restore()
        return sorted(found, key=lambda grasp: grasp.opening)

    def _pick(self, held: Held, closed: Positions, lifted: Positions) -> list[Leg] | str:
        """Open, come, close, lift; or what is hit."""
        router = self._router
        above, around = router.opened(lifted, 1.0), router.opened(closed, 1.0)
        come, lift = Leg(above, around), Leg(closed, lifted, held=held)
        self._restore()
        hit = router.hit(come, self._touching()) or router.hit(lift, self._touching(held.body))
        route = hit or self._route(above)
        return route if isinstance(route, str) else [*route, come, Leg(around, closed), lift]

    def _rest_on_surface(self, body: str) -> SE3 | None:
        """How a body stands on its surface; None if it stands on, leans on or carries others."""
        if body not in self.resting:
            return None
        pose = self.resting[body]
        surface = home_surface(self._surfaces, *self._world.bounds_m(body))
        if surface is None or not self._stands(body):
            return None
        height = pose.translation_m[2] - surface.T_world_surface.translation_m[2]
        return SE3((0.0, 0.0, height), pose.quaternion_wxyz)

    # Putting down.

    def _plan_place(self, goal: ArmGoal) -> list[Leg] | str:
        """Legs that end with the empty hand above what was put down."""
        held = self._held
        if held is None:
            return NOTHING_HELD
        hits: dict[str, None] = {}
        for T_world_rest, closed, above in self._spots(held, goal.pose_candidates):
            legs = self._plan_release(held, T_world_rest, closed, above)
            if not isinstance(legs, str):
                self.resting[held.body] = T_world_rest.rounded()
                self._held = None
                return legs
            hits[legs] = None
        return _what_hits(hits, NO_PLACE)

    def _spots(
        self, held: Held, candidates: Sequence[SE3]
    ) -> Iterator[tuple[SE3, Positions, Positions]]:
        """Where a body can be left, and configurations there and above, soonest reached first.

        Candidates are looked at a few at a time, so that the first ones are preferred.
        """
        for first in range(0, len(candidates), _SPOTS_AT_ONCE):
            found = []
            for spot in candidates[first : first + _SPOTS_AT_ONCE]:
                T_world_rest = spot @ held.T_surface_rest
                if self._stays(held.body, T_world_rest):
                    found += [(T_world_rest, *stop) for stop in self._stops(held, T_world_rest)]
            found.sort(key=lambda stop: self._effort_s(*stop[1:]))
            yield from found[:_PUTS_MAX]

    def _plan_release(
        self, held: Held, T_world_rest: SE3, closed: Positions, above: Positions
    ) -> list[Leg] | str:
        """Lower, open, leave; or what is hit."""
        router = self._router
        opened, away = router.opened(closed, 1.0), router.opened(above, 1.0)
        lower = Leg(above, closed, held=held)
        release, leave = Leg(closed, opened), Leg(opened, away)
        self._restore()
        hit = router.hit(lower, self._touching())
        self._world.place(held.body, T_world_rest)
        hit = hit or router.hit(release, self._touching(held.body))
        hit = hit or router.hit(leave, self._touching(held.body))
        route = hit or self._route(above)
        return route if isinstance(route, str) else [*route, lower, release, leave]

    def _stays(self, body: str, T_world_rest: SE3) -> bool:
        """Whether a body can be left at a pose: on a surface, apart from others, and at rest."""
        self._restore()
        self._arm.show(self.positions)
        self._world.place(body, T_world_rest)
        if not self._stands(body) or not is_within(self._surfaces, *self._world.bounds_m(body)):
            return False
        self._world.step(_STAY_STEPS)
        moved_m = math.dist(self._world.pose(body).translation_m, T_world_rest.translation_m)
        self._restore()
        return moved_m < _STAY_M

    # What all of them need.

    def _stops(self, held: Held, T_world_held: SE3) -> list[tuple[Positions, Positions]]:
        """Configurations with the fingers around a body, and drawn back from it."""
        T_world_grasp = T_world_held @ held.T_grasp_held.inverse()
        drawn_back = T_world_grasp @ SE3((0.0, 0.0, -_APPROACH_M))
        stops = []
        for closed in self._router.configurations(T_world_grasp, self.positions, held.opening):
            above = self._router.near(drawn_back, closed)
            if above is not None:
                stops.append((closed, above))
        return stops

    def _effort_s(self, closed: Positions, above: Positions) -> float:
        effort_s = self._router.effort_s
        return effort_s(self.positions, above) + 2.0 * effort_s(above, closed)

    def _touching(self, body: str = "") -> Surroundings:
        """Everything may be touched; a body that is taken up or was put down counts besides."""
        loose = [name for name in self.resting if name != body]
        if body and self._held is not None:
            loose.append(body)
        return Surroundings(self._fixed, loose, clearance_m=0.0)

    def _stands(self, body: str) -> bool:
        """Whether a body touches what is fixed and nothing that is loose."""
        others = [name for name in self.resting if name != body]
        apart = all(self._world.gap_m(body, o, _APART_M) >= _APART_M for o in others)
        return apart and any(
            self._world.gap_m(body, name, _STANDS_M) < _STANDS_M for name in self._fixed
        )

    def _held_upright(self, body: str, stance: ArmState) -> Held:
        """What the arm holds from the beginning; put down, it stands upright."""
        assert stance.T_world_held is not None
        self._world.place(body, SE3())
        bottom = float(self._world.bounds_m(body)[0][2])
        T_grasp_held = self._arm.grasp_pose(stance.positions).inverse() @ stance.T_world_held
        opening = gripper_opening(self._arm.robot, stance.positions)
        return Held(body, T_grasp_held, SE3((0.0, 0.0, -bottom)), opening)

    def _restore(self) -> None:
        """Put everything back where it is."""
        for name, pose in self.resting.items():
            self._world.place(name, pose)
        self._arm.show(self.positions)
        if self._held is not None:
            pose = self._arm.grasp_pose(self.positions) @ self._held.T_grasp_held
            self._world.place(self._held.body, pose)

    def _rejection(self, why: str, number: int) -> Rejection:
        name = self._arm.articulation.name
        return Rejection(
            f"arm '{name}' {why} at goal {number} of its way",
            f"other goals or more candidates for arm '{name}', or fewer objects around it (count)",
        )


def _what_hits(hits: Mapping[str, None], otherwise: str) -> str:
    """The first thing that was hit, else the reason given."""
    named = [hit for hit in hits if hit != CANNOT_REACH]
    if named:
        return f"hits {named[0]}" if named[0] == "itself" else f"hits '{named[0]}'"
    return CANNOT_REACH if hits else otherwise
