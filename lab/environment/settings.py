"""Settings of an environment: control, observations, length of episodes and dynamics."""

from dataclasses import dataclass, replace
from typing import Literal, NoReturn

from pydantic import Field, field_validator

from gen_data.config import base_model, problems, yaml_tree
from gen_data.config import distributions as dist
from gen_data.core.scene import Articulation, Scene
from gen_data.core.se3 import Vec3
from gen_data.core.streams import Rng, Streams
from gen_data.physics.manipulation.arm_simulation import Servo

ControlName = Literal["joint", "ik", "cartesian_delta"]


@dataclass(frozen=True, slots=True)
class DrawnDynamics:
    """The dynamics of one episode.

    Attributes:
        scene: With drawn masses and coefficients of friction.
        servo: The motors of the arm.
        latency_steps: Steps between an action and its effect.
    """

    scene: Scene
    servo: Servo
    latency_steps: int


class Dynamics(base_model.Strict):
    """Dynamics, drawn again at every reset; constants switch the variation off.

    Attributes:
        mass_factor: Factor on the mass of every body that can move, drawn for each.
        friction_factor: Factor on the coefficient of friction of every body, and on the friction of
            its joint, drawn for each.
        joint_damping_per_s: Damping of the arm's joints over their inertia [1/s].
        motor_gain_per_s2: Gain of the arm's motors over the inertia [1/s^2].
        latency_steps: Whole steps between an action and its effect.
    """

    mass_factor: dist.Positive = dist.LogUniform(0.8, 1.25)
    friction_factor: dist.Positive = dist.Uniform(0.7, 1.3)
    joint_damping_per_s: dist.Positive = dist.Uniform(36.0, 44.0)
    motor_gain_per_s2: dist.Positive = dist.Uniform(320.0, 480.0)
    latency_steps: dist.Count = dist.UniformInteger(0, 2)

    def draw(self, scene: Scene, streams: Streams) -> DrawnDynamics:
        """Draw the dynamics of one scene, in which every body that can move has a mass."""
        mass, friction = streams.rng("dynamics/mass"), streams.rng("dynamics/friction")
        bodies = tuple(
            replace(
                body,
                mass_kg=body.mass_kg * self.mass_factor.draw(mass),
                friction=body.friction * self.friction_factor.draw(friction),
            )
            for body in scene.bodies
        )
        joints = streams.rng("dynamics/joints")
        arms = tuple(_vary_joints(a, self.friction_factor, joints) for a in scene.articulations)
        servo = Servo(
            self.motor_gain_per_s2.draw(streams.rng("dynamics/motor_gain")),
            self.joint_damping_per_s.draw(streams.rng("dynamics/joint_damping")),
        )
        latency = self.latency_steps.draw(streams.rng("dynamics/latency"))
        return DrawnDynamics(replace(scene, bodies=bodies, articulations=arms), servo, latency)


class EnvSettings(base_model.Strict):
    """Settings of an environment.

    Attributes:
        control: Meaning of actions: ``joint`` positions, ``ik`` for a pose of the hand,
            ``cartesian_delta`` for a motion of the hand.
        arm: Name of the arm; empty = the only one.
        camera: Name of the camera that observes; empty = the first one.
        step_s: Time between actions [s].
        steps_max: Steps after which an episode is truncated.
        delta_m_max: Largest motion of the hand along each axis in a step [m].
        delta_deg_max: Largest rotation of the hand about each axis in a step.
        workspace_m: Low and high corner of the positions of ``ik``, in the frame of the arm's
            base [m].
        depth_m_max: Depths are observed up to this distance [m], which also stands for nothing.
        proximity_m_max: Range of the proximity sensors of the fingers [m].
        dynamics: Further draws of every reset, besides the scene.
    """

    control: ControlName = "cartesian_delta"
    arm: str = ""
    camera: str = ""
    step_s: float = Field(0.05, gt=0.0, le=1.0)
    steps_max: int = Field(400, ge=1)
    delta_m_max: float = Field(0.03, gt=0.0, le=0.2)
    delta_deg_max: float = Field(10.0, gt=0.0, le=45.0)
    workspace_m: tuple[Vec3, Vec3] = ((0.2, -0.5, 0.0), (0.8, 0.5, 0.6))
    depth_m_max: float = Field(4.0, gt=0.0)
    proximity_m_max: float = Field(0.2, gt=0.0, le=1.0)
    dynamics: Dynamics = Dynamics()

    @field_validator("workspace_m")
    @classmethod
    def _has_extent(cls, corners: tuple[Vec3, Vec3]) -> tuple[Vec3, Vec3]:
        low, high = corners
        if any(a >= b for a, b in zip(low, high, strict=True)):
            raise ValueError("expected the low corner, then the high one")
        return corners


def refuse_field(document: yaml_tree.Node, field: str, fact: str) -> NoReturn:
    """Raise a ConfigError at a field of a document; a default has the document's position."""
    problems.refuse((document.get(field) or document).position, field, fact)


def _vary_joints(arm: Articulation, factor: dist.Numeric[float], rng: Rng) -> Articulation:
    """The arm with drawn friction of the joints of its task's bodies."""
    if arm.assignment is None:
        return arm
    joints = arm.assignment.joints
    varied = tuple(replace(j, friction=j.friction * factor.draw(rng)) for j in joints)
    return replace(arm, assignment=replace(arm.assignment, joints=varied))
