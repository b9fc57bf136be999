"""A world simulated by MuJoCo, with wheels for every platform.

The only module that imports MuJoCo. Its models are compiled as a whole: bodies that are added or
removed take effect when something is next asked of the world, and all keep their motion.

Differences from Bullet: hulls have no margin and are not shrunk; restitution is ignored; of two
coefficients of friction the larger one counts instead of their product, and squares are given, with
which equal surfaces agree.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import mujoco
import numpy as np

from gen_data.core.scene import BodyJoint
from gen_data.core.se3 import SE3, Array
from gen_data.physics.collision_shapes import CollisionShape, Hull
from gen_data.physics.world import (
    ANGULAR_DAMPING_PER_S,
    GRAVITY_M_S2,
    JOINT_DAMPING_S,
    ROLLING_FRICTION_SHARE,
    Contact,
    joint_position,
    jointed_pose,
)

_SOLIMP = (0.95, 0.99, 0.001, 0.5, 2.0)
"""Impedance of contacts: with the shortest time constant, a body at rest sinks in by 7
micrometres (MuJoCo documentation, "Computation", "Solver parameters")."""
_FLAT_M = 2e-4
"""Thickness given to flat parts, which MuJoCo refuses."""
_ROLLING_DIMENSIONS, _SLIDING_DIMENSIONS = 6, 3


@dataclass(eq=False, slots=True)
class _Solid:
    """A body about its centre of mass; ``position_at`` to ``geoms`` refer to the compiled model.

    ``T_world_home`` is the pose of the body, not of its centre, at position 0 of its joint.
    """

    shape: CollisionShape
    scale: float
    mass_kg: float
    friction: float
    T_world_center: SE3
    velocity: tuple[float, ...] = (0.0,) * 6
    position_at: int = -1
    velocity_at: int = -1
    geoms: tuple[int, ...] = ()
    joint: BodyJoint | None = None
    T_world_home: SE3 = field(default_factory=SE3)
    is_smooth: bool = False

    @property
    def T_body_center(self) -> SE3:  # noqa: N802
        x, y, z = self.shape.center_of_mass_m
        return SE3((x * self.scale, y * self.scale, z * self.scale))


@dataclass(eq=False, slots=True)
class _Compiled:
    """A model with its state; ``names`` are names of bodies by MuJoCo's number."""

    model: mujoco.MjModel
    data: mujoco.MjData
    names: dict[int, str] = field(default_factory=dict)
    is_stale: bool = True

    def update(self) -> None:
        """Move the geometry to the poses of the bodies."""
        if self.is_stale:
            mujoco.mj_kinematics(self.model, self.data)
            self.is_stale = False


class MujocoWorld:
    """A simulated world as described at ``World``.

    Args:
        time_step_s: Simulated time per step.
        solver_iterations: Most iterations of the contact solver per step.
    """

    def __init__(self, time_step_s: float, solver_iterations: int) -> None:
        self._time_step_s, self._solver_iterations = time_step_s, solver_iterations
        self._solids: dict[str, _Solid] = {}
        self._ignored: set[tuple[str, str]] = set()
        self._bounds: dict[str, tuple[Array, Array]] = {}
        self._current: _Compiled | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all bodies, in the order in which they were added."""
        return tuple(self._solids)

    def close(self) -> None:
        """Drop all bodies; may be called twice."""
        self.reset()

    def reset(self) -> None:
        """Remove all bodies."""
        self._solids, self._ignored, self._bounds, self._current = {}, set(), {}, None

    def add(
        self,
        name: str,
        shape: CollisionShape,
        T_world_body: SE3,
        *,
        scale: float = 1.0,
        mass_kg: float = 0.0,
        friction: float = 0.6,
        restitution: float = 0.05,
    ) -> None:
        """Add a body at rest; a body with mass 0 is static."""
        del restitution
        self._suspend()
        solid = _Solid(shape, scale, mass_kg, friction, SE3())
        solid.T_world_center = T_world_body @ solid.T_body_center
        self._solids[name] = solid

    def add_jointed(
        self,
        name: str,
        shape: CollisionShape,
        T_world_body: SE3,
        joint: BodyJoint,
        *,
        mass_kg: float,
        friction: float = 0.6,
    ) -> None:
        """Add a body that moves along its joint only, at position 0 and at rest."""
        self.add(name, shape, T_world_body, mass_kg=mass_kg, friction=friction)
        solid = self._solids[name]
        solid.joint, solid.T_world_home = joint, T_world_body

    def hinge(self, name: str, joint: BodyJoint) -> None:
        """Let a loose body move along a joint only, from its present pose on, at rest."""
        self._suspend()
        solid = self._solids[name]
        solid.joint, solid.T_world_home, solid.velocity = joint, self.pose(name), (0.0,) * 6
        solid.is_smooth = True

    def carry(self, name: str, T_world_home: SE3) -> None:
        """Move the joint of a body; position and speed of the joint remain."""
        solid = self._solids[name]
        assert solid.joint is not None
        position = joint_position(solid.joint, solid.T_world_home, self.pose(name))
        solid.T_world_home = T_world_home
        pose = jointed_pose(solid.joint, T_world_home, position)
        solid.T_world_center = pose @ solid.T_body_center
        if self._current is not None:
            model = self._current.model
            number = int(model.geom_bodyid[solid.geoms[0]])
            home = T_world_home @ solid.T_body_center
            model.body_pos[number], model.body_quat[number] = (
                home.translation_m,
                home.quaternion_wxyz,
            )
            self._current.is_stale = True
        self._bounds.pop(name, None)

    def unhinge(self, name: str) -> None:
        """Make a jointed body loose, at its present pose and at rest."""
        self._suspend()
        solid = self._solids[name]
        solid.joint, solid.velocity, solid.is_smooth = None, (0.0,) * 6, False
        self._ignored = {pair for pair in self._ignored if name not in pair}

    def remove(self, name: str) -> None:
        """Remove a body."""
        self._suspend()
        del self._solids[name]
        self._ignored = {pair for pair in self._ignored if name not in pair}
        self._bounds.pop(name, None)

    def ignore(self, name: str, others: Iterable[str]) -> None:
        """Disable collisions of a body with others."""
        self._suspend()
        self._ignored |= {(name, other) for other in others}

    def place(self, name: str, T_world_body: SE3) -> None:
        """Move a body to a pose, at rest."""
        solid = self._solids[name]
        solid.T_world_center, solid.velocity = T_world_body @ solid.T_body_center, (0.0,) * 6
        if self._current is not None:
            _load(self._current, solid)
        self._bounds.pop(name, None)

    def pose(self, name: str) -> SE3:
        """``T_world_body``."""
        solid = self._solids[name]
        return solid.T_world_center @ solid.T_body_center.inverse()

    def bounds_m(self, name: str) -> tuple[Array, Array]:
        """Low and high corner of a body in the world [m]."""
        if name not in self._bounds:
            solid = self._solids[name]
            self._bounds[name] = solid.shape.bounds_m(solid.T_world_center, solid.scale)
        return self._bounds[name]

    def gap_m(self, one: str, other: str, limit_m: float) -> float:
        """Distance between two bodies [m]: negative if they overlap, at most ``limit_m``."""
        (low, high), (other_low, other_high) = self.bounds_m(one), self.bounds_m(other)
        if (low > other_high + limit_m).any() or (other_low > high + limit_m).any():
            return limit_m
        world = self._compile()
        world.update()
        gap_m = limit_m
        for a, b in _near_geoms(world, self._solids[one], self._solids[other], limit_m):
            found_m = mujoco.mj_geomDistance(world.model, world.data, a, b, limit_m, None)
            gap_m = min(gap_m, float(found_m))
        return gap_m

    def step(self, count: int) -> None:
        """Simulate ``count`` steps."""
        world = self._compile()
        mujoco.mj_step(world.model, world.data, nstep=count)
        world.is_stale = True
        for solid in self._solids.values():
            _store(world, solid)
        self._bounds = {}

    def speed(self, name: str) -> tuple[float, float]:
        """Linear [m/s] and angular speed [rad/s] of a body."""
        x, y, z, *spin = self._solids[name].velocity
        return math.hypot(x, y, z), math.hypot(*spin)

    def mass_kg(self, name: str) -> float:
        """Mass of a body; 0 = it is static."""
        return self._solids[name].mass_kg

    def hits_m(self, name: str, origins_m: Array, direction: Array) -> Array:
        """Distances [n] from points [n, 3] to a body along a unit vector [3]; inf = missed."""
        solid = self._solids[name]
        return solid.shape.hits_m(solid.T_world_center, solid.scale, origins_m, direction)

    def contacts(self) -> list[Contact]:
        """All points at which bodies touch, one of which can move."""
        world = self._compile()
        # Asking for forces must not change where the solver starts in the next step.
        start = world.data.qacc_warmstart.copy()
        mujoco.mj_forward(world.model, world.data)
        world.data.qacc_warmstart[:] = start
        world.is_stale = False
        found = world.data.contact
        bodies = world.model.geom_bodyid[found.geom].tolist()
        wrench = np.zeros(6)
        contacts = []
        for k, (a, b) in enumerate(bodies):
            mujoco.mj_contactForce(world.model, world.data, k, wrench)
            x, y, z = found.pos[k].tolist()
            gap_m, force_n = float(found.dist[k]), float(wrench[0])
            contacts.append(Contact(world.names[a], world.names[b], gap_m, force_n, (x, y, z)))
        return contacts

    def _suspend(self) -> None:
        """Drop the compiled model; ``_Solid`` has the state of each body."""
        self._current = None

    def _compile(self) -> _Compiled:
        if self._current is None:
            self._current = _compile(
                self._solids, self._ignored, self._time_step_s, self._solver_iterations
            )
        return self._current


def _compile(
    solids: dict[str, _Solid],
    ignored: Iterable[tuple[str, str]],
    time_step_s: float,
    solver_iterations: int,
) -> _Compiled:
    spec = mujoco.MjSpec()
    spec.option.timestep = time_step_s
    spec.option.gravity = (0.0, 0.0, -GRAVITY_M_S2)
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.iterations = solver_iterations
    # A world that diverges keeps its NaNs, which no test for rest accepts.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    # Flat faces need several points of contact; since MuJoCo 4 they have them by default.
    spec.option.enableflags |= getattr(mujoco.mjtEnableBit, "mjENBL_MULTICCD", 0)
    meshes: dict[tuple[str, float], list[str]] = {}
    for number, solid in enumerate(solids.values()):
        _add_body(spec, f"{number}", solid, meshes, time_step_s)
    numbers = {name: f"{number}" for number, name in enumerate(solids)}
    for one, other in sorted(ignored):
        spec.add_exclude(bodyname1=numbers[one], bodyname2=numbers[other])
    model = spec.compile()
    world = _Compiled(model, mujoco.MjData(model))
    for name, solid in solids.items():
        body = model.body(numbers[name])
        world.names[body.id] = name
        first = int(body.geomadr[0])
        solid.geoms = tuple(range(first, first + int(body.geomnum[0])))
        if solid.joint is not None:
            solid.position_at = int(model.jnt_qposadr[body.jntadr[0]])
            solid.velocity_at = int(body.dofadr[0])
        elif solid.mass_kg > 0.0:
            solid.position_at = int(model.jnt_qposadr[body.jntadr[0]])
            solid.velocity_at = int(body.dofadr[0])
            spin = slice(solid.velocity_at + 3, solid.velocity_at + 6)
            model.dof_damping[spin] = ANGULAR_DAMPING_PER_S * body.inertia
        else:
            solid.position_at = int(body.mocapid[0])
        _load(world, solid)
    return world


def _add_body(
    spec: mujoco.MjSpec,
    name: str,
    solid: _Solid,
    meshes: dict[tuple[str, float], list[str]],
    time_step_s: float,
) -> None:
    falls = solid.mass_kg > 0.0
    body = spec.worldbody.add_body(name=name, mocap=not falls)
    if solid.joint is not None:
        home = solid.T_world_home @ solid.T_body_center
        body.pos, body.quat = home.translation_m, home.quaternion_wxyz
    rolling_m = 0.0
    if falls:
        half_m = solid.shape.half_extents_m * solid.scale
        rolling_m = ROLLING_FRICTION_SHARE * float(half_m.min())
        # Of the bounding box, as Bullet's.
        squares = np.maximum(half_m, _FLAT_M) ** 2
        body.explicitinertial, body.mass = True, solid.mass_kg
        # By default the centre of mass is at the position of the body in the world.
        body.ipos, body.iquat = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)
        body.inertia = solid.mass_kg / 3.0 * (squares.sum() - squares)
        if solid.joint is None:
            body.add_freejoint()
        else:
            _add_joint(body, solid, solid.joint, time_step_s)
    friction = 0.0 if solid.is_smooth else solid.friction
    dimensions = _ROLLING_DIMENSIONS if falls else _SLIDING_DIMENSIONS
    surface = {
        "friction": (friction**2, rolling_m, rolling_m),
        # A cone without sliding friction has rolling friction only, and diverges.
        "condim": 1 if solid.is_smooth else dimensions,
        # Smooth bodies stay smooth in contact with any other.
        "priority": int(friction == 0.0),
        "solref": (2.0 * time_step_s, 1.0),
        "solimp": _SOLIMP,
    }
    if solid.shape.boxes:
        kind = mujoco.mjtGeom.mjGEOM_BOX
        for center, half in solid.shape.boxes:
            at, size = (np.array(v) * solid.scale for v in (center, half))
            body.add_geom(type=kind, pos=at, size=np.maximum(size, _FLAT_M), **surface)
        return
    key = (solid.shape.key, solid.scale)
    if key not in meshes:
        first = sum(map(len, meshes.values()))
        meshes[key] = [f"{first + k}" for k in range(len(solid.shape.hulls))]
        for mesh, hull in zip(meshes[key], solid.shape.hulls, strict=True):
            points = _thick(hull, solid.scale)
            spec.add_mesh(
                name=mesh,
                uservert=points.reshape(-1),
                inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX,
            )
    for mesh in meshes[key]:
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh, **surface)


def _add_joint(body: mujoco.MjsBody, solid: _Solid, joint: BodyJoint, time_step_s: float) -> None:
    prismatic = joint.kind == "prismatic"
    anchor = (solid.T_body_center.inverse() @ SE3(joint.anchor_m)).translation_m
    body.add_joint(
        type=mujoco.mjtJoint.mjJNT_SLIDE if prismatic else mujoco.mjtJoint.mjJNT_HINGE,
        axis=joint.axis,
        pos=anchor,
        limited=mujoco.mjtLimited.mjLIMITED_TRUE,
        # Degrees are the unit of specifications.
        range=[v if prismatic else math.degrees(v) for v in (joint.lower, joint.upper)],
        frictionloss=joint.friction,
        # Soft by default: a slow joint would not meet the whole friction.
        solref_friction=(2.0 * time_step_s, 1.0),
        solimp_friction=_SOLIMP,
        damping=JOINT_DAMPING_S * joint.friction,
        stiffness=joint.stiffness,
    )


def _thick(hull: Hull, scale: float) -> Array:
    """Vertices [n, 3] at a scale; vertices of a flat part twice, on both sides of its plane."""
    points = hull.vertices_m * scale
    if hull.width_m * scale >= _FLAT_M:
        return points
    middle = points.mean(axis=0)
    normal = np.linalg.svd(points - middle)[2][2]
    return np.concatenate([points - 0.5 * _FLAT_M * normal, points + 0.5 * _FLAT_M * normal])


def _load(world: _Compiled, solid: _Solid) -> None:
    pose, at, data = solid.T_world_center, solid.position_at, world.data
    if solid.joint is not None:
        T_world_body = pose @ solid.T_body_center.inverse()
        data.qpos[at] = joint_position(solid.joint, solid.T_world_home, T_world_body)
        data.qvel[solid.velocity_at] = solid.velocity[0]
    elif solid.mass_kg > 0.0:
        data.qpos[at : at + 7] = (*pose.translation_m, *pose.quaternion_wxyz)
        data.qvel[solid.velocity_at : solid.velocity_at + 6] = solid.velocity
    else:
        data.mocap_pos[at] = pose.translation_m
        data.mocap_quat[at] = pose.quaternion_wxyz
    world.is_stale = True


def _store(world: _Compiled, solid: _Solid) -> None:
    """Take pose and velocity of a body that moves from the model."""
    at, data = solid.position_at, world.data
    if solid.joint is not None:
        pose = jointed_pose(solid.joint, solid.T_world_home, float(data.qpos[at]))
        solid.T_world_center = pose @ solid.T_body_center
        solid.velocity = (float(data.qvel[solid.velocity_at]), *(0.0,) * 5)
    elif solid.mass_kg > 0.0:
        x, y, z, *turn = data.qpos[at : at + 7].tolist()
        qw, qx, qy, qz = turn
        solid.T_world_center = SE3((x, y, z), (qw, qx, qy, qz))
        solid.velocity = tuple(data.qvel[solid.velocity_at : solid.velocity_at + 6].tolist())


def _near_geoms(
    world: _Compiled, one: _Solid, other: _Solid, limit_m: float
) -> Iterator[tuple[int, int]]:
    """Pairs of convex parts whose bounding spheres are closer than a limit."""
    a, b = np.array(one.geoms), np.array(other.geoms)
    at, radius = world.data.geom_xpos, world.model.geom_rbound
    offsets = at[a][:, None] - at[b]
    reach = radius[a][:, None] + radius[b] + max(limit_m, 0.0)
    near = np.einsum("abk,abk->ab", offsets, offsets) <= reach**2
    for i, j in zip(*np.nonzero(near), strict=True):
        yield int(a[i]), int(b[j])
