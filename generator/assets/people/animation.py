"""Joint angles of people who walk, run, stand or sit, from ``poses.yaml`` and ``gaits.yaml``.

Angles are degrees here, as in the tables of gait analysis: hip and knee flexion, ankle
dorsiflexion and shoulder flexion (arm forward) are positive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, get_args

from gen_data.generator.assets.procedural.data_tables import load_table

PoseName = Literal["walk", "run", "stand", "phone", "carry", "sit"]
POSES: tuple[PoseName, ...] = get_args(PoseName)
PHASES = 16
"""A stride is divided into this many steps, from one heel strike to the next of the same foot."""


@dataclass(frozen=True, slots=True)
class Leg:
    """Joint angles of one leg [deg]; ``toes`` bends them up against the foot."""

    hip: float = 0.0
    knee: float = 0.0
    ankle: float = 0.0
    toes: float = 0.0


@dataclass(frozen=True, slots=True)
class Arm:
    """Joint angles of one arm [deg].

    Attributes:
        swing: Upper arm forward.
        out: Upper arm away from the body.
        elbow: Flexion.
        inward: How far the forearm turns to the body's middle.
        curl: Of each finger joint.
    """

    swing: float = 0.0
    out: float = 8.0
    elbow: float = 12.0
    inward: float = 8.0
    curl: float = 16.0


@dataclass(frozen=True, slots=True)
class Stance:
    """Joint angles of a whole body [deg].

    Attributes:
        lean: Trunk forward.
        nod: Head downward.
        twist: Pelvis to the left; the shoulders turn as far to the right.
    """

    left_leg: Leg = Leg()
    right_leg: Leg = Leg()
    left_arm: Arm = Arm()
    right_arm: Arm = Arm()
    lean: float = 0.0
    nod: float = 0.0
    twist: float = 0.0


@dataclass(frozen=True, slots=True)
class _Gait:
    """A row of ``gaits.yaml``."""

    hip: tuple[float, ...]
    knee: tuple[float, ...]
    ankle: tuple[float, ...]
    toes: tuple[float, ...]
    arm: Arm
    arm_swing: float
    elbow_swing: float
    lean: float
    twist: float


@dataclass(frozen=True, slots=True)
class _Pose:
    """A row of ``poses.yaml``."""

    behaviour: str
    gait: str = ""
    leg: Leg = Leg()
    arm: Arm = Arm()
    right_arm: Arm | None = None
    lean: float = 0.0
    nod: float = 0.0


_GAITS = load_table(__package__, "gaits", _Gait)
_POSES = load_table(__package__, "poses", _Pose)
BEHAVIOURS = {name: pose.behaviour for name, pose in _POSES.items()}


def shorten_stride(stance: Stance, share: float) -> Stance:
    """Shorten the steps of a stride, for narrow clothes."""
    left, right = (
        Leg(share * leg.hip, leg.knee * (0.5 + 0.5 * share), leg.ankle * share, leg.toes)
        for leg in (stance.left_leg, stance.right_leg)
    )
    return replace(stance, left_leg=left, right_leg=right)


def stance(pose: PoseName, step: int) -> Stance:
    """Joint angles of a pose.

    Args:
        pose: Name of the pose.
        step: Sixteenth of the stride of the left leg, 0 = its heel strikes; walk, carry, run.
    """
    row = _POSES[pose]
    made = Stance(row.leg, row.leg, row.arm, row.arm, row.lean, row.nod)
    if row.gait:
        made = _stride(_GAITS[row.gait], step % PHASES)
    return replace(made, right_arm=row.right_arm or made.right_arm)


def _stride(gait: _Gait, step: int) -> Stance:
    turn = math.cos(2.0 * math.pi * step / PHASES)
    left_leg, right_leg = (
        Leg(gait.hip[k], gait.knee[k], gait.ankle[k], gait.toes[k])
        for k in (step, (step + PHASES // 2) % PHASES)
    )
    left_arm, right_arm = (
        replace(
            gait.arm,
            swing=sign * gait.arm_swing * turn + gait.arm.swing,
            elbow=gait.arm.elbow + sign * gait.elbow_swing * turn,
        )
        for sign in (-1.0, 1.0)
    )
    twist = -gait.twist * turn
    return Stance(left_leg, right_leg, left_arm, right_arm, lean=gait.lean, twist=twist)
