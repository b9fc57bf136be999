"""Motion of robot arms during a sequence."""

import math
from dataclasses import replace
from typing import Annotated, Literal

from pydantic import Field, model_validator

from gen_data.config import distributions as dist
from gen_data.config.base_model import Strict
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import ArmGoal, Articulation, Body, Scene, SupportSurface
from gen_data.core.se3 import SE3
from gen_data.core.streams import Rng
from gen_data.randomizers import arm_configuration, base, placement

TASKS = ("pick_and_place", "reach")
EDGE_M = 0.08
"""Smallest distance of a placed object from the edges of a surface."""
CANDIDATES_MAX = 12
"""Largest number of objects to try in turn."""

Speed = Annotated[dist.Scalar, dist.Bounds(0.01, 1.0)]


class Stop(Strict):
    """One goal of an explicit way: exactly one of joints_deg, reach_m, grasp and place_m.

    Attributes:
        joints_deg: Position of every arm joint; metres for prismatic joints.
        reach_m: Target (x, y, z) of the hand in the world; the hand points down.
        yaw_deg: Rotation about Z of the hand or of the placed object.
        tilt_deg: Tilt of the hand from straight down.
        towards_deg: Direction of the horizontal axis of the tilt.
        opening: Gripper opening: 0 closed, 1 fully open.
        grasp: Names of object groups; the arm lifts one of their members from above.
        place_m: Point (x, y) in the world where the arm puts the object down, on a surface.
    """

    joints_deg: tuple[float, ...] | None = None
    reach_m: tuple[float, float, float] | None = None
    yaw_deg: float = 0.0
    tilt_deg: float = Field(0.0, ge=0, le=90)
    towards_deg: float = 0.0
    opening: float = Field(1.0, ge=0, le=1)
    grasp: tuple[str, ...] | None = None
    place_m: tuple[float, float] | None = None

    @model_validator(mode="after")
    def _has_one_goal(self) -> "Stop":
        given = [v for v in (self.joints_deg, self.reach_m, self.grasp, self.place_m) if v]
        if len(given) != 1:
            raise ValueError("give exactly one of joints_deg, reach_m, grasp and place_m")
        return self


class ArmMotion(base.RandomizerBase):
    """Draws a sequence of goals for every arm; physics plans collision-free trajectories.

    List it after arm_configuration, which draws the arms' poses at time 0.

    Attributes:
        task: pick_and_place: the arm lifts an object, carries it and puts it down elsewhere.
            reach: the hand visits poses above the workspace.
        way: Explicit goals in order, instead of a task.
        objects: Names of the object groups to handle; empty = all.
        count: Number of objects to move, or of poses to visit.
        candidates: Number of candidate places or poses to draw for each goal.
        tilt_deg: Tilt of the hand from straight down when it visits poses.
        speed: Fraction of the joints' speed and acceleration limits to use.
    """

    type: Literal["arm_motion"] = "arm_motion"
    stage: Literal["scene"] = "scene"
    task: Annotated[dist.Name, dist.OneOf(TASKS)] = dist.Choice({"pick_and_place": 1.0})
    way: tuple[Stop, ...] = ()
    objects: tuple[str, ...] = ()
    count: int = Field(1, ge=1, le=20)
    candidates: int = Field(16, ge=1, le=256)
    tilt_deg: dist.NonNegative = dist.Uniform(0.0, 25.0)
    speed: Speed = dist.Uniform(0.4, 0.7)

    def check(self, scene: Scene, assets: AssetIndex) -> None:
        """Raise ConfigError if there is no such object group."""
        super().check(scene, assets)
        known = [group.name for group in scene.groups]
        named = {"objects": self.objects}
        named |= {f"way[{k}].grasp": stop.grasp or () for k, stop in enumerate(self.way)}
        for field, groups in named.items():
            for name in groups:
                fault = f"randomizers.{self.name}.{field}: there is no object group"
                base.check_known(name, known, fault)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene with a sequence of goals for every arm."""
        self.check(scene, assets)
        arms = scene.articulations
        arms = tuple(replace(a, task=self._draw_goals(a, scene, assets, rng)) for a in arms)
        return replace(scene, articulations=arms)

    def _draw_goals(
        self, arm: Articulation, scene: Scene, assets: AssetIndex, rng: Rng
    ) -> tuple[ArmGoal, ...]:
        speed = round(self.speed.draw(rng), 4)
        if self.way:
            where = f"randomizers.{self.name}.way"
            goals = [
                self._goal_at_stop(stop, f"{where}[{k}]", arm, scene, assets, rng)
                for k, stop in enumerate(self.way)
            ]
        elif self.task.draw(rng) == "reach" or assets.robot(arm.asset).gripper is None:
            goals = [self._draw_reach_goal(arm, assets, rng) for _ in range(self.count)]
        else:
            goals = self._draw_pick_and_place(arm, scene, assets, rng)
        return tuple(replace(goal, speed=speed) for goal in goals)

    def _draw_reach_goal(self, arm: Articulation, assets: AssetIndex, rng: Rng) -> ArmGoal:
        robot = assets.robot(arm.asset)
        if robot.gripper is not None:
            poses = tuple(
                arm_configuration.draw_hand_pose(arm, self.tilt_deg, rng)
                for _ in range(self.candidates)
            )
            return ArmGoal("reach", pose_candidates=poses)
        candidates = tuple(
            tuple(
                round(float(rng.uniform(j.lower, j.upper)), 6)
                for j in arm_configuration.arm_joints(robot)
            )
            for _ in range(self.candidates)
        )
        return ArmGoal("joints", joint_candidates=candidates)

    def _draw_pick_and_place(
        self, arm: Articulation, scene: Scene, assets: AssetIndex, rng: Rng
    ) -> list[ArmGoal]:
        """Alternate grasps and placements; an object held at time 0 is placed first."""
        holds = arm.goal is not None and arm.goal.kind == "hold"
        goals: list[ArmGoal] = []
        for number in range(self.count):
            if number > 0 or not holds:
                names = self._draw_graspable(arm, self.objects, scene, assets, rng)
                goals.append(ArmGoal("grasp", objects=names))
            goals.append(ArmGoal("place", pose_candidates=self._draw_placements(arm, scene, rng)))
        return goals

    def _draw_graspable(
        self, arm: Articulation, groups: tuple[str, ...], scene: Scene, assets: AssetIndex, rng: Rng
    ) -> tuple[str, ...]:
        """Draw an order of the objects with a side that fits between the fingers."""
        gripper = assets.robot(arm.asset).gripper
        known = [group.name for group in scene.groups]
        limit_m = arm_configuration.GRASP_MARGIN * gripper.stroke_m if gripper else 0.0
        wanted = groups or tuple(known)
        held = arm.goal.grasped_object if arm.goal else ""
        fitting = [
            body.name
            for body in scene.bodies
            if body.group in wanted and body.name != held and _narrowest_m(body, assets) < limit_m
        ]
        order = rng.permutation(len(fitting))
        return tuple(fitting[int(k)] for k in order)[:CANDIDATES_MAX]

    def _draw_placements(self, arm: Articulation, scene: Scene, rng: Rng) -> tuple[SE3, ...]:
        """Draw poses on the surfaces within an arm's reach, turned by up to a quarter turn."""
        wanted = self.objects or tuple(group.name for group in scene.groups)
        names = {s for group in scene.groups if group.name in wanted for s in group.surfaces}
        surfaces = [s for s in scene.surfaces if s.name in names and not s.walled]
        surfaces = surfaces or [s for s in scene.surfaces if s.name in names]
        if not surfaces:
            raise ConfigError(
                f"randomizers.{self.name}: there is no surface to put objects on; "
                "list object groups that lie on one (objects)"
            )
        return tuple(
            _draw_placement(surfaces[int(rng.integers(len(surfaces)))], arm, rng)
            for _ in range(self.candidates)
        )

    def _goal_at_stop(
        self, stop: Stop, field: str, arm: Articulation, scene: Scene, assets: AssetIndex, rng: Rng
    ) -> ArmGoal:
        if stop.grasp:
            names = self._draw_graspable(arm, stop.grasp, scene, assets, rng)
            return ArmGoal("grasp", objects=names)
        yaw_rad = math.radians(stop.yaw_deg)
        if stop.place_m:
            pose = _pose_on_surface(stop, yaw_rad, scene, field)
            return ArmGoal("place", pose_candidates=(pose,))
        if stop.reach_m:
            tilt_rad, towards_rad = math.radians(stop.tilt_deg), math.radians(stop.towards_deg)
            pose = arm_configuration.hand_pose(stop.reach_m, yaw_rad, tilt_rad, towards_rad)
            return ArmGoal("reach", pose_candidates=(pose,), gripper_opening=stop.opening)
        joints = arm_configuration.arm_joints(assets.robot(arm.asset))
        given = stop.joints_deg or ()
        if len(given) != len(joints):
            raise ConfigError(
                f"{field}.joints_deg: {len(given)} positions for the {len(joints)} joints of arm "
                f"'{arm.name}' ({', '.join(joint.name for joint in joints)})"
            )
        positions = tuple(
            value if joint.kind == "prismatic" else round(math.radians(value), 6)
            for joint, value in zip(joints, given, strict=True)
        )
        return ArmGoal("joints", joint_candidates=(positions,), gripper_opening=stop.opening)


def _draw_placement(surface: SupportSurface, arm: Articulation, rng: Rng) -> SE3:
    """Draw a pose on a surface, away from its edges, clamped to below the arm's workspace."""
    low, high = arm.workspace_m
    half_x, half_y = (max(0.0, 0.5 * size - EDGE_M) for size in surface.size_m)
    u, v = float(rng.uniform(-half_x, half_x)), float(rng.uniform(-half_y, half_y))
    yaw = SE3.about_z(float(rng.uniform(-0.5 * math.pi, 0.5 * math.pi)))
    x, y, z = (surface.T_world_surface @ SE3((u, v, 0.0))).translation_m
    x, y = min(max(x, low[0]), high[0]), min(max(y, low[1]), high[1])
    return (SE3((x, y, z)) @ yaw).rounded()


def _pose_on_surface(stop: Stop, yaw_rad: float, scene: Scene, field: str) -> SE3:
    """Pose at a stop's point on the highest surface below it."""
    assert stop.place_m is not None
    x, y = stop.place_m
    heights = []
    for surface in scene.surfaces:
        u, v, _ = (surface.T_world_surface.inverse() @ SE3((x, y, 0.0))).translation_m
        if abs(u) <= 0.5 * surface.size_m[0] and abs(v) <= 0.5 * surface.size_m[1]:
            heights.append(surface.T_world_surface.translation_m[2])
    if not heights:
        raise ConfigError(
            f"{field}.place_m: there is no surface at ({x}, {y}); expected a point over one of "
            f"{', '.join(surface.name for surface in scene.surfaces)}"
        )
    return SE3.about_z(yaw_rad, (x, y, max(heights))).rounded()


def _narrowest_m(body: Body, assets: AssetIndex) -> float:
    return 2.0 * min(placement.half_extents_m(*assets.bounds_m(body.asset), body.scale))
