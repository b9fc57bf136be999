"""The seam to rigid-body simulators: the simulated world that settling and planning use."""

import math
from collections.abc import Iterable
from typing import NamedTuple, Protocol

from gen_data.core.scene import BodyJoint
from gen_data.core.se3 import SE3, Array, Vec3
from gen_data.physics.collision_shapes import CollisionShape

GRAVITY_M_S2 = 9.81
ANGULAR_DAMPING_PER_S = 0.5
JOINT_DAMPING_S = 0.2
"""Damping of joints over their friction, per m/s or rad/s."""
ROLLING_FRICTION_SHARE = 0.1
"""Rolling friction over an object's smallest half extent: balls and cans stop within a few turns,
too little for anything to rest visibly out of balance."""


class Contact(NamedTuple):
    """A point at which two bodies touch.

    Attributes:
        gap_m: Distance between them, negative if they overlap.
        force_n: Normal force in the latest step; 0 if the engine pushed neither body, as where both
            are placed instead of simulated.
        point_m: In the world.
    """

    one: str
    other: str
    gap_m: float
    force_n: float
    point_m: Vec3


class World(Protocol):
    """Rigid bodies by name, with poses of the bodies' frames; ``reset`` must be called first.

    Its state depends on the calls since the last ``reset`` only. Overlapping bodies are
    separated without giving them speed.
    """

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all bodies, in the order in which they were added."""
        ...

    def close(self) -> None:
        """Release everything; may be called twice."""
        ...

    def reset(self) -> None:
        """Remove all bodies and restore the parameters."""
        ...

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
        ...

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
        """Add a body that moves along its joint only, at position 0 and at rest.

        ``place`` takes it to the position nearest to a pose.
        """
        ...

    def hinge(self, name: str, joint: BodyJoint) -> None:
        """Let a loose body move along a joint only, from its present pose on, at rest.

        Until ``unhinge`` its contacts are free of friction, whose direction would be wrong: the
        solvers do not know of the speed at which ``carry`` moves the joint.
        """
        ...

    def carry(self, name: str, T_world_home: SE3) -> None:
        """Move the joint of a body; position and speed of the joint remain.

        Args:
            name: Name of a jointed body.
            T_world_home: Pose of the body at position 0.
        """
        ...

    def unhinge(self, name: str) -> None:
        """Make a jointed body loose, at its present pose and at rest."""
        ...

    def remove(self, name: str) -> None:
        """Remove a body."""
        ...

    def ignore(self, name: str, others: Iterable[str]) -> None:
        """Disable collisions of a body with others."""
        ...

    def place(self, name: str, T_world_body: SE3) -> None:
        """Move a body to a pose, at rest."""
        ...

    def pose(self, name: str) -> SE3:
        """``T_world_body``."""
        ...

    def bounds_m(self, name: str) -> tuple[Array, Array]:
        """Low and high corner of a body in the world [m]."""
        ...

    def gap_m(self, one: str, other: str, limit_m: float) -> float:
        """Distance between two bodies [m]: negative if they overlap, at most ``limit_m``."""
        ...

    def step(self, count: int) -> None:
        """Simulate ``count`` steps."""
        ...

    def speed(self, name: str) -> tuple[float, float]:
        """Linear [m/s] and angular speed [rad/s] of a body."""
        ...

    def mass_kg(self, name: str) -> float:
        """Mass of a body; 0 = it is static."""
        ...

    def hits_m(self, name: str, origins_m: Array, direction: Array) -> Array:
        """Distances [n] from points [n, 3] to a body along a unit vector [3]; inf = it is missed.

        A point inside the body has distance 0.
        """
        ...

    def contacts(self) -> list[Contact]:
        """All points at which bodies touch, one of which can move."""
        ...


def jointed_pose(joint: BodyJoint, T_world_home: SE3, position: float) -> SE3:
    """``T_world_body`` of a body at a position of its joint [m or rad].

    Args:
        joint: The joint.
        T_world_home: Pose of the body at position 0.
        position: The position.
    """
    x, y, z = joint.axis
    if joint.kind == "prismatic":
        return T_world_home @ SE3((position * x, position * y, position * z))
    sine, anchor = math.sin(0.5 * position), SE3(joint.anchor_m)
    turn = SE3(quaternion_wxyz=(math.cos(0.5 * position), sine * x, sine * y, sine * z))
    return T_world_home @ anchor @ turn @ anchor.inverse()


def joint_position(joint: BodyJoint, T_world_home: SE3, T_world_body: SE3) -> float:
    """Position [m or rad] of the joint of a body at a pose: the inverse of ``jointed_pose``."""
    moved = T_world_home.inverse() @ T_world_body
    if joint.kind == "prismatic":
        return sum(a * b for a, b in zip(joint.axis, moved.translation_m, strict=True))
    w, *vector = moved.quaternion_wxyz
    along = sum(a * b for a, b in zip(joint.axis, vector, strict=True))
    angle = 2.0 * math.atan2(along, w)
    return angle - 2.0 * math.pi * round(angle / (2.0 * math.pi))
