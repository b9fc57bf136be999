"""The physics engine: settles objects and plans the motion of arms in a Scene."""

from dataclasses import replace
from types import TracebackType

from gen_data.core.bounded_cache import CountCache
from gen_data.core.errors import Rejection
from gen_data.core.interfaces import AssetLibrary, DerivedArrays, Settled
from gen_data.core.kinematics import make_link_bodies
from gen_data.core.scene import Articulation, Body, BodyJoint, Episode, Outcome, Scene
from gen_data.physics import collision_shapes, physics_config, settling
from gen_data.physics.manipulation.arm_goals import Arm, ArmState
from gen_data.physics.manipulation.arm_simulation import ArmSimulation, Servo, SimulatedBodies
from gen_data.physics.manipulation.demonstration import demonstrate
from gen_data.physics.manipulation.joint_trajectories import TrajectoryRecording
from gen_data.physics.manipulation.manipulation_planner import TaskPlanner
from gen_data.physics.open_world import open_world

_SHAPES = 512
"""Capacity of the cache of collision shapes, about 20 kB each."""
_DENSITY_KG_M3 = 300.0
"""Mass over bounding box for bodies without a mass: household objects are mostly hollow."""


class Engine:
    """Settles scenes in a simulated world; only collision shapes of assets are kept between calls.

    Args:
        assets: Source of collision geometry and robots.
        config: Times, thresholds and accuracy.
    """

    def __init__(self, assets: AssetLibrary, config: physics_config.PhysicsConfig) -> None:
        self._assets = assets
        self._config = config
        self._world = open_world(config)
        self._shapes: CountCache[collision_shapes.CollisionShape] = CountCache(_SHAPES)

    def __enter__(self) -> "Engine":
        """Return the engine, ready to settle."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the world."""
        self._world.close()

    def settle(self, scene: Scene) -> Settled:
        """Settle a scene; a rejected scene is returned unchanged.

        Arms are posed first, then objects fall around them. Goals stay in the scene as a record;
        joint positions and poses hold the result.

        Raises:
            AssetError: an asset has no collision geometry, or is not a robot.
        """
        free = [body for body in _solids(scene) if body.name not in _held(scene)]
        falling = [body for body in free if body.motion == "dynamic"]
        fixed = [body.name for body in free if body.motion != "dynamic"]
        if not falling and not scene.articulations:
            return Settled(scene)
        arms = self._place(scene, falling, fixed)
        if isinstance(arms, Rejection):
            return Settled(scene, arms)
        rejection = self._let_fall(scene, falling, fixed)
        if rejection is not None:
            return Settled(scene, rejection)
        settled = self._update_poses(scene, falling, [state for _, state in arms])
        names = [body.name for body in falling]
        demonstrate = self._demonstrate_twins if scene.twins else self._demonstrate
        shown = demonstrate(settled, fixed, names, arms)
        return Settled(scene, shown) if isinstance(shown, Rejection) else Settled(shown)

    def prepare_asset(self, asset_id: str) -> None:
        """See ``AssetPreparation``: collision shapes of objects."""
        if self._assets.get(asset_id).kind == "object":
            self._shape(asset_id)

    def weigh(self, scene: Scene) -> Scene:
        """The scene with a mass for every body that collides, guessed where none is known."""
        return scene.with_bodies(*(replace(b, mass_kg=self._mass_kg(b)) for b in _solids(scene)))

    def simulate(self, scene: Scene, arm: str, servo: Servo) -> ArmSimulation:
        """Start the simulation of a settled scene in which one arm moves as it is told.

        It is valid until the engine's next simulation, or until it settles a scene.

        Args:
            scene: The scene at its present poses.
            arm: Name of the arm; all others stand still.
            servo: Its motors.
        """
        own = next(a for a in scene.articulations if a.name == arm)
        held = own.goal.grasped_object if own.goal and own.goal.kind == "hold" else ""
        loose = [b for b in _solids(scene) if b.motion == "dynamic" or b.name == held]
        fixed = [b.name for b in _solids(scene) if b not in loose]
        joints = self._fill(scene, loose, fixed)
        arms = {a.name: self._arm(a) for a in scene.articulations}
        obstacles = [name for name in fixed if name not in joints]
        obstacles += [name for a in arms.values() if a.articulation != own for name in a.bodies]
        return ArmSimulation(
            arms[arm],
            self._world,
            SimulatedBodies(tuple(b.name for b in loose), joints, tuple(obstacles), held),
            servo,
            self._config.time_step_s,
        )

    def _fill(self, scene: Scene, falling: list[Body], fixed: list[str]) -> dict[str, BodyJoint]:
        """Start with a world of a scene's bodies; returns the joints of bodies."""
        self._world.reset()
        joints = {
            joint.body: joint
            for a in scene.articulations
            if a.assignment is not None
            for joint in a.assignment.joints
        }
        for body in _solids(scene):
            self._add(body, body in falling, joints.get(body.name))
        for name in joints:
            # Fixed bodies do not stop a part that moves: the limits of its joint do.
            self._world.ignore(name, [other for other in fixed if other != name])
        return joints

    def _mass_kg(self, body: Body) -> float:
        half_m = self._shape(body.asset).half_extents_m
        return body.mass_kg or _DENSITY_KG_M3 * 8.0 * float(half_m.prod()) * body.scale**3

    def _add(self, body: Body, falls: bool, joint: BodyJoint | None = None) -> None:
        shape, mass_kg = self._shape(body.asset), self._mass_kg(body)
        if joint is not None:
            self._world.add_jointed(
                body.name, shape, body.T_world_body, joint, mass_kg=mass_kg, friction=body.friction
            )
            return
        self._world.add(
            body.name,
            shape,
            body.T_world_body,
            scale=body.scale,
            mass_kg=mass_kg if falls else 0.0,
            friction=body.friction,
            restitution=body.restitution,
        )

    def _shape(self, asset_id: str) -> collision_shapes.CollisionShape:
        return self._shapes.get(asset_id, lambda: self._load_shape(asset_id))

    def _load_shape(self, asset_id: str) -> collision_shapes.CollisionShape:
        def compute() -> collision_shapes.CollisionShape:
            return collision_shapes.collision_shape(self._assets.convex_parts(asset_id))

        if not isinstance(self._assets, DerivedArrays):
            return compute()
        name = f"collision shape {collision_shapes.shape_version()}"
        return collision_shapes.unpack_shape(
            self._assets.derived(asset_id, name, lambda: collision_shapes.pack_shape(compute()))
        )

    def _place(
        self, scene: Scene, falling: list[Body], fixed: list[str]
    ) -> list[tuple[Arm, ArmState]] | Rejection:
        """Fill the world, and pose each arm; arms avoid those before them."""
        self._fill(scene, falling, fixed)
        placed = _resting_bodies(scene, falling)
        arms: list[tuple[Arm, ArmState]] = []
        obstacles = list(fixed)
        for articulation in scene.articulations:
            arm = self._arm(articulation)
            state = arm.solve(obstacles, placed)
            if isinstance(state, Rejection):
                return state
            arms.append((arm, state))
            obstacles += arm.bodies
            obstacles += filter(None, [_held_by(arm, state)])
        return arms

    def _let_fall(self, scene: Scene, falling: list[Body], fixed: list[str]) -> Rejection | None:
        surfaces = {body.name: settling.candidate_surfaces(scene, body) for body in falling}
        links = [name for name in self._world.names if name not in fixed and name not in surfaces]
        return settling.Settling(self._world, falling, surfaces, self._config).settle(fixed, links)

    def _arm(self, articulation: Articulation) -> Arm:
        robot = self._assets.robot(articulation.asset)
        shapes = {link: self._shape(asset) for link, asset in robot.collisions.items()}
        return Arm(articulation, robot, shapes, self._world)

    def _demonstrate_twins(
        self, scene: Scene, fixed: list[str], fallen: list[str], arms: list[tuple[Arm, ArmState]]
    ) -> Scene | Rejection:
        """The scene with demonstrations that fail, and with recovering ones as ``recovery``.

        Both begin in a world that was filled with the same bodies: nothing of the one is in the
        other.
        """
        shown: list[Scene] = []
        for recovers in (False, True):
            asked = replace(
                scene, articulations=tuple(_asked(a, recovers) for a in scene.articulations)
            )
            self._fill(asked, [asked.body(name) for name in fallen], fixed)
            states = [state for _, state in arms]
            again = [(self._arm(a), s) for a, s in zip(asked.articulations, states, strict=True)]
            one = self._demonstrate(asked, fixed, fallen, again)
            if isinstance(one, Rejection):
                return one
            shown.append(one)
        failing, recovering = shown
        return replace(failing, recovery=Outcome(recovering.articulations, recovering.tracks))

    def _demonstrate(
        self, scene: Scene, fixed: list[str], fallen: list[str], arms: list[tuple[Arm, ArmState]]
    ) -> Scene | Rejection:
        """The scene with trajectories of arms with tasks, and of the bodies they carry.

        Arms move one after the other, each when those before it have come to rest.
        """
        at_work = [(arm, state) for arm, state in arms if arm.articulation.task]
        if not at_work:
            return scene
        held = [name for name in (_held_by(arm, state) for arm, state in arms) if name]
        resting = {name: scene.body(name).T_world_body for name in (*fallen, *held)}
        recording = TrajectoryRecording(dict(resting))
        episodes: dict[str, Episode] = {}
        for arm, state in at_work:
            named = {name for goal in arm.articulation.task for name in goal.arms}
            partners = [(a, s) for a, s in arms if a is not arm and a.articulation.name in named]
            planners = [
                TaskPlanner(
                    one,
                    its_state,
                    self._world,
                    [*fixed, *(n for a, _ in arms if a is not one for n in a.bodies)],
                    resting,
                    scene.surfaces,
                )
                for one, its_state in ((arm, state), *partners)
            ]
            if arm.articulation.assignment is not None:
                shown = demonstrate(planners, self._world, self._config.time_step_s)
                if isinstance(shown, Rejection):
                    return shown
                episodes[arm.articulation.name] = shown.episode(recording.end_s)
                recording.add([(a, legs, _parts(a)) for a, legs in shown.legs], shown.poses)
                resting = shown.poses[-1]
                continue
            planner = planners[0]
            plan = planner.plan()
            if isinstance(plan, Rejection):
                return plan
            resting = planner.resting
            recording.add([(arm, plan, _parts(arm))])
        return replace(
            scene,
            tracks=(*scene.tracks, *recording.tracks()),
            articulations=tuple(
                replace(
                    a, joint_track=recording.joint_tracks.get(a.name), episode=episodes.get(a.name)
                )
                for a in scene.articulations
            ),
        )

    def _update_poses(self, scene: Scene, fallen: list[Body], states: list[ArmState]) -> Scene:
        """The scene with the final poses of fallen bodies and the solved states of arms."""
        poses = {body.name: self._world.pose(body.name).rounded() for body in fallen}
        bodies = {
            body.name: replace(body, T_world_body=poses[body.name]) if body.name in poses else body
            for body in scene.bodies
        }
        articulations = []
        for articulation, state in zip(scene.articulations, states, strict=True):
            moved = replace(articulation, joint_positions=state.positions)
            articulations.append(moved)
            for link in self._links(scene, moved):
                shown = bodies.get(link.name, link)
                bodies[link.name] = replace(
                    shown, T_world_body=link.T_world_body, motion="kinematic", collides=False
                )
            if articulation.goal and state.T_world_held is not None:
                name = articulation.goal.grasped_object
                bodies[name] = replace(
                    bodies[name], T_world_body=state.T_world_held, motion="kinematic"
                )
        return replace(scene, bodies=tuple(bodies.values()), articulations=tuple(articulations))

    def _links(self, scene: Scene, articulation: Articulation) -> tuple[Body, ...]:
        parts = next(
            (i.parts for i in scene.instances if i.instance_id == articulation.instance_id), ()
        )
        return make_link_bodies(articulation, self._assets.robot(articulation.asset), parts)


def _solids(scene: Scene) -> list[Body]:
    """Bodies that collide, without links of robots, whose geometry comes from their robot."""
    prefixes = tuple(f"{articulation.name}/" for articulation in scene.articulations)
    return [b for b in scene.bodies if b.collides and not b.name.startswith(prefixes)]


def _parts(arm: Arm) -> list[str]:
    """Links with a body in the scene."""
    return [link for link in arm.robot.links if link in arm.robot.visuals]


def _asked(arm: Articulation, recovers: bool) -> Articulation:
    """The arm, whose failure it recovers from or not."""
    if arm.assignment is None or not arm.assignment.failure:
        return arm
    return replace(arm, assignment=replace(arm.assignment, recovers=recovers))


def _held(scene: Scene) -> set[str]:
    """Names of bodies that arms hold from the beginning."""
    goals = (articulation.goal for articulation in scene.articulations)
    return {goal.grasped_object for goal in goals if goal and goal.kind == "hold"}


def _held_by(arm: Arm, state: ArmState) -> str:
    """Name of the body that an arm holds in a state; empty = none."""
    goal = arm.articulation.goal
    return goal.grasped_object if goal and state.T_world_held is not None else ""


def _resting_bodies(scene: Scene, falling: list[Body]) -> list[str]:
    """Names of dynamic bodies that start near their resting pose, which arms must avoid."""
    dropped = {group.name for group in scene.groups if group.placement in ("drop", "pile")}
    return [body.name for body in falling if body.group not in dropped]
