"""A world simulated by Bullet.

The only module that imports pybullet. It hides pybullet's conventions: quaternions with the scalar
last, body numbers, and poses of the centre of mass.
"""

import math
import weakref
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from gen_data.core import processes, scene, temporary_folders
from gen_data.core.se3 import IDENTITY, SE3, Array, Vec3
from gen_data.physics import collision_shapes, world

with processes.silence_stdio():  # it prints its build time
    import pybullet

_HULL_FILES = 4096
"""Most files of shapes in the scratch folder, 10 kB each."""


@dataclass(frozen=True, eq=False, slots=True)
class _Solid:
    number: int
    shape: collision_shapes.CollisionShape
    scale: float
    T_body_center: SE3
    mass_kg: float
    friction: float
    joint: scene.BodyJoint | None = None
    T_world_home: SE3 = IDENTITY

    @property
    def link(self) -> int:
        """Number of the link that has the shape; -1 = the base."""
        return -1 if self.joint is None else 0


class BulletWorld:
    """A simulated world as described at ``World``, which owns a pybullet connection.

    All bodies are single rigid bodies ("maximal coordinates"), whose contact solver separates
    overlapping bodies without giving them speed.
    """

    def __init__(self, time_step_s: float, solver_iterations: int) -> None:
        self._parameters = {
            "fixedTimeStep": time_step_s,
            "numSolverIterations": solver_iterations,
            "deterministicOverlappingPairs": 1,
            "contactBreakingThreshold": 0.02,
            "useSplitImpulse": 1,
            # pybullet never drops cached files: 16 kB for each shape at each scale.
            "enableFileCaching": 0,
        }
        folder = temporary_folders.TemporaryFolder("physics")
        self._folder, self._hull_files = folder.path, 0
        # Also when a program ends, or drops the world, without closing it.
        self._remove_folder = weakref.finalize(self, folder.remove)
        self._client: int = pybullet.connect(pybullet.DIRECT)
        self._here = {"physicsClientId": self._client}
        self._solids: dict[str, _Solid] = {}
        self._names: dict[int, str] = {}
        self._bounds: dict[str, tuple[Array, Array]] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all bodies, in the order in which they were added."""
        return tuple(self._solids)

    def close(self) -> None:
        """Close the connection and delete scratch files; may be called twice."""
        if self._client >= 0:
            pybullet.disconnect(**self._here)
            self._remove_folder()
        self._client = -1

    def reset(self) -> None:
        """Remove all bodies and restore the parameters."""
        self._solids, self._names, self._bounds = {}, {}, {}
        pybullet.resetSimulation(**self._here)
        pybullet.setGravity(0.0, 0.0, -world.GRAVITY_M_S2, **self._here)
        pybullet.setPhysicsEngineParameter(**self._here, **self._parameters)

    def add(
        self,
        name: str,
        shape: collision_shapes.CollisionShape,
        T_world_body: SE3,
        *,
        scale: float = 1.0,
        mass_kg: float = 0.0,
        friction: float = 0.6,
        restitution: float = 0.05,
    ) -> None:
        """Add a body; a body with mass 0 is static."""
        x, y, z = shape.center_of_mass_m
        T_body_center = SE3((x * scale, y * scale, z * scale))
        position, orientation = _bullet_pose(T_world_body @ T_body_center)
        number = pybullet.createMultiBody(
            baseMass=mass_kg,
            baseCollisionShapeIndex=self._collision_shape(shape, scale),
            basePosition=position,
            baseOrientation=orientation,
            useMaximalCoordinates=1,
            **self._here,
        )
        rolling = 0.0
        if mass_kg > 0.0:
            rolling = world.ROLLING_FRICTION_SHARE * float(shape.half_extents_m.min()) * scale
        pybullet.changeDynamics(
            number,
            -1,
            lateralFriction=friction,
            restitution=restitution,
            rollingFriction=rolling,
            spinningFriction=rolling,
            angularDamping=world.ANGULAR_DAMPING_PER_S,
            **self._here,
        )
        self._solids[name] = _Solid(number, shape, scale, T_body_center, mass_kg, friction)
        self._names[number] = name

    def add_jointed(
        self,
        name: str,
        shape: collision_shapes.CollisionShape,
        T_world_body: SE3,
        joint: scene.BodyJoint,
        *,
        mass_kg: float,
        friction: float = 0.6,
    ) -> None:
        """Add a body that moves along its joint only, at position 0 and at rest.

        It is the only link of a fixed base without a shape; the link's frame is at the axis.
        """
        T_body_center = SE3(shape.center_of_mass_m)
        position, orientation = _bullet_pose(T_world_body @ SE3(joint.anchor_m))
        center = (SE3(joint.anchor_m).inverse() @ T_body_center).translation_m
        prismatic = joint.kind == "prismatic"
        number = pybullet.createMultiBody(
            baseMass=0.0,
            basePosition=position,
            baseOrientation=orientation,
            linkMasses=[mass_kg],
            linkCollisionShapeIndices=[self._collision_shape(shape, 1.0, center)],
            linkVisualShapeIndices=[-1],
            linkPositions=[(0.0, 0.0, 0.0)],
            linkOrientations=[(0.0, 0.0, 0.0, 1.0)],
            linkInertialFramePositions=[center],
            linkInertialFrameOrientations=[(0.0, 0.0, 0.0, 1.0)],
            linkParentIndices=[0],
            linkJointTypes=[pybullet.JOINT_PRISMATIC if prismatic else pybullet.JOINT_REVOLUTE],
            linkJointAxis=[joint.axis],
            **self._here,
        )
        pybullet.changeDynamics(
            number,
            0,
            lateralFriction=friction,
            jointLowerLimit=joint.lower,
            jointUpperLimit=joint.upper,
            **self._here,
        )
        pybullet.setJointMotorControl2(
            number, 0, pybullet.VELOCITY_CONTROL, force=joint.friction, **self._here
        )
        self._solids[name] = _Solid(
            number, shape, 1.0, T_body_center, mass_kg, friction, joint, T_world_body
        )
        self._names[number] = name

    def hinge(self, name: str, joint: scene.BodyJoint) -> None:
        """Let a loose body move along a joint only, from its present pose on, at rest."""
        solid, pose = self._solids[name], self.pose(name)
        self.remove(name)
        self.add_jointed(name, solid.shape, pose, joint, mass_kg=solid.mass_kg, friction=0.0)
        self._solids[name] = replace(self._solids[name], friction=solid.friction)

    def carry(self, name: str, T_world_home: SE3) -> None:
        """Move the joint of a body; position and speed of the joint remain."""
        solid = self._solids[name]
        assert solid.joint is not None
        position, orientation = _bullet_pose(T_world_home @ SE3(solid.joint.anchor_m))
        pybullet.resetBasePositionAndOrientation(solid.number, position, orientation, **self._here)
        self._solids[name] = replace(solid, T_world_home=T_world_home)
        self._bounds.pop(name, None)

    def unhinge(self, name: str) -> None:
        """Make a jointed body loose, at its present pose and at rest."""
        solid, pose = self._solids[name], self.pose(name)
        self.remove(name)
        self.add(name, solid.shape, pose, mass_kg=solid.mass_kg, friction=solid.friction)

    def remove(self, name: str) -> None:
        """Remove a body."""
        solid = self._solids.pop(name)
        del self._names[solid.number]
        self._bounds.pop(name, None)
        pybullet.removeBody(solid.number, **self._here)

    def ignore(self, name: str, others: Iterable[str]) -> None:
        """Disable collisions of a body with others."""
        one = self._solids[name]
        for other in (self._solids[other] for other in others):
            pybullet.setCollisionFilterPair(
                one.number, other.number, one.link, other.link, 0, **self._here
            )

    def place(self, name: str, T_world_body: SE3) -> None:
        """Move a body to a pose, at rest."""
        solid = self._solids[name]
        self._bounds.pop(name, None)
        if solid.joint is not None:
            at = world.joint_position(solid.joint, solid.T_world_home, T_world_body)
            pybullet.resetJointState(solid.number, 0, at, **self._here)
            return
        position, orientation = _bullet_pose(T_world_body @ solid.T_body_center)
        pybullet.resetBasePositionAndOrientation(solid.number, position, orientation, **self._here)

    def pose(self, name: str) -> SE3:
        """``T_world_body``."""
        solid = self._solids[name]
        return self._center(solid) @ solid.T_body_center.inverse()

    def bounds_m(self, name: str) -> tuple[Array, Array]:
        """Low and high corner of a body in the world [m]."""
        if name not in self._bounds:
            solid = self._solids[name]
            self._bounds[name] = solid.shape.bounds_m(self._center(solid), solid.scale)
        return self._bounds[name]

    def gap_m(self, one: str, other: str, limit_m: float) -> float:
        """Distance between two bodies [m]: negative if they overlap, at most ``limit_m``."""
        (low, high), (other_low, other_high) = self.bounds_m(one), self.bounds_m(other)
        if (low > other_high + limit_m).any() or (other_low > high + limit_m).any():
            return limit_m
        a, b = self._solids[one].number, self._solids[other].number
        points = pybullet.getClosestPoints(a, b, distance=limit_m, **self._here)
        return min((float(point[8]) for point in points), default=limit_m)

    def step(self, count: int) -> None:
        """Simulate ``count`` steps."""
        for _ in range(count):
            self._pull_springs()
            pybullet.stepSimulation(**self._here)
        self._bounds = {}

    def _pull_springs(self) -> None:
        for solid in self._solids.values():
            if solid.joint is not None and solid.joint.stiffness > 0.0:
                force = -solid.joint.stiffness * self._position(solid)
                pybullet.setJointMotorControl2(
                    solid.number, 0, pybullet.TORQUE_CONTROL, force=force, **self._here
                )

    def _position(self, solid: _Solid) -> float:
        return float(pybullet.getJointState(solid.number, 0, **self._here)[0])

    def speed(self, name: str) -> tuple[float, float]:
        """Linear [m/s] and angular speed [rad/s] of a body."""
        linear, angular = pybullet.getBaseVelocity(self._solids[name].number, **self._here)
        return math.dist(linear, (0.0, 0.0, 0.0)), math.dist(angular, (0.0, 0.0, 0.0))

    def mass_kg(self, name: str) -> float:
        """Mass of a body; 0 = it is static."""
        return self._solids[name].mass_kg

    def hits_m(self, name: str, origins_m: Array, direction: Array) -> Array:
        """Distances [n] from points [n, 3] to a body along a unit vector [3]; inf = missed."""
        solid = self._solids[name]
        return solid.shape.hits_m(self._center(solid), solid.scale, origins_m, direction)

    def contacts(self) -> list[world.Contact]:
        """All points at which bodies touch, one of which can move."""
        pybullet.performCollisionDetection(**self._here)
        return [
            world.Contact(
                self._names[p[1]], self._names[p[2]], float(p[8]), float(p[9]), tuple(p[6])
            )
            for p in pybullet.getContactPoints(**self._here)
        ]

    def _center(self, solid: _Solid) -> SE3:
        if solid.joint is not None:
            pose = world.jointed_pose(solid.joint, solid.T_world_home, self._position(solid))
            return pose @ solid.T_body_center
        pose = pybullet.getBasePositionAndOrientation(solid.number, **self._here)
        (px, py, pz), (x, y, z, w) = pose
        return SE3((px, py, pz), (w, x, y, z))

    def _collision_shape(
        self, shape: collision_shapes.CollisionShape, scale: float, center_m: Vec3 = (0.0, 0.0, 0.0)
    ) -> int:
        """The number of a shape, with its centre of mass at a point of the frame that has it."""
        if shape.boxes:
            number = pybullet.createCollisionShapeArray(
                shapeTypes=[pybullet.GEOM_BOX] * len(shape.boxes),
                halfExtents=[_scale(half, scale) for _, half in shape.boxes],
                collisionFramePositions=[
                    (SE3(center_m) @ SE3(_scale(center, scale))).translation_m
                    for center, _ in shape.boxes
                ],
                **self._here,
            )
            return int(number)
        number = pybullet.createCollisionShape(
            pybullet.GEOM_MESH,
            fileName=str(self._hull_file(shape, collision_shapes.scale_step(scale))),
            meshScale=[scale, scale, scale],
            collisionFramePosition=center_m,
            **self._here,
        )
        return int(number)

    def _hull_file(self, shape: collision_shapes.CollisionShape, step: int) -> Path:
        """The file of a shape: pybullet takes compounds of hulls only from files, read at once."""
        path = self._folder / f"{shape.key}_{step}.obj"
        if not path.exists():
            if self._hull_files == _HULL_FILES:
                for old in self._folder.iterdir():
                    old.unlink()
                self._hull_files = 0
            path.write_text(shape.obj(step))
            self._hull_files += 1
        return path


def _bullet_pose(pose: SE3) -> tuple[Vec3, tuple[float, float, float, float]]:
    w, x, y, z = pose.quaternion_wxyz
    return pose.translation_m, (x, y, z, w)


def _scale(vector: Vec3, scale: float) -> Vec3:
    x, y, z = vector
    return (x * scale, y * scale, z * scale)
