"""Joint positions over time: straight legs in joint space, each from rest to rest.

A leg runs through ``start + s(t / T) * (end - start)`` with ``s = 10 x^3 - 15 x^4 + 6 x^5``.
Speed and acceleration vanish at both ends; their peaks are 15/8 of the mean speed and 10/sqrt(3)
of ``(end - start) / T^2`` (Biagiotti & Melchiorri, Trajectory Planning for Automatic Machines and
Robots, 2008, section 2.1.7).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from gen_data.generator.core.asset_types import Joint, RobotModel
from gen_data.generator.core.kinematics import round_positions
from gen_data.generator.core.se3 import SE3

STEP_S = 0.05
"""Time between the knots of a track; legs last a whole number of steps."""

_PEAK_SPEED = 15.0 / 8.0
_PEAK_ACCELERATION = 10.0 / math.sqrt(3.0)
_SPEED_RAD_S = 1.5
_SPEED_M_S = 0.1
"""Of joints whose description gives no limit: slower than any arm in the catalogue."""
_SPEED_CAP_RAD_S = math.pi
"""Of turning joints: the limit of a UR5e and an xArm. Some descriptions name 10 rad/s for want of
a figure."""
_SPEED_UP_S = 0.25
"""In which a joint reaches its full speed; URDF knows no acceleration. A Panda's own limits
(7.5 to 20 rad/s^2 at 2.2 to 2.6 rad/s) are reached in 0.13 to 0.29 s."""
_STEPS_MIN = 2


@dataclass(frozen=True, slots=True)
class Held:
    """What a hand holds.

    Attributes:
        body: Name of the body.
        T_grasp_held: Where it is in the grasp frame.
        T_surface_rest: How it stands on a level surface below it, X and Y aside.
        opening: Of the gripper around it, in [0, 1].
    """

    body: str
    T_grasp_held: SE3
    T_surface_rest: SE3
    opening: float


@dataclass(frozen=True, slots=True)
class Leg:
    """A straight way in joint space, from rest to rest.

    Attributes:
        start, end: One position per movable joint [rad or m].
        duration_s: A whole number of steps; 0 = not yet known.
        held: What moves along with the hand; None = nothing.
    """

    start: tuple[float, ...]
    end: tuple[float, ...]
    duration_s: float = 0.0
    held: Held | None = None

    def at(self, share: float) -> tuple[float, ...]:
        """Positions after a share of the way."""
        return round_positions(
            [a + share * (b - a) for a, b in zip(self.start, self.end, strict=True)]
        )


def smooth_step(share: float) -> float:
    """Share of the way after a share of the time: the quintic from rest to rest."""
    return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)


def speed_max(joint: Joint) -> float:
    """Limit of a joint's speed [rad/s or m/s]."""
    if joint.kind == "prismatic":
        return joint.speed_max or _SPEED_M_S
    return min(joint.speed_max or _SPEED_RAD_S, _SPEED_CAP_RAD_S)


def acceleration_max(joint: Joint) -> float:
    """Limit of a joint's acceleration [rad/s^2 or m/s^2]."""
    return speed_max(joint) / _SPEED_UP_S


def time_leg(leg: Leg, robot: RobotModel, speed: float) -> Leg:
    """The leg with the shortest duration that keeps to a share of every joint's limits."""
    longest_s = 0.0
    for joint, a, b in zip(robot.movable, leg.start, leg.end, strict=True):
        way = abs(b - a)
        by_speed_s = _PEAK_SPEED * way / (speed * speed_max(joint))
        limit = speed * acceleration_max(joint)
        longest_s = max(longest_s, by_speed_s, math.sqrt(_PEAK_ACCELERATION * way / limit))
    steps = max(_STEPS_MIN, math.ceil(longest_s / STEP_S - 1e-9))
    return replace(leg, duration_s=round(steps * STEP_S, 6))


def sample_times(legs: Sequence[Leg]) -> list[tuple[Leg, tuple[float, ...]]]:
    """The legs' positions every step, with the leg that leads there; the beginning counts once."""
    knots = [(legs[0], legs[0].start)] if legs else []
    for leg in legs:
        count = round(leg.duration_s / STEP_S)
        knots += [(leg, leg.at(smooth_step(k / count))) for k in range(1, count + 1)]
    return knots
