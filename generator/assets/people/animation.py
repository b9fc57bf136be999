"""Joint angles of people who walk, run, stand or sit.

Angles are degrees here, as in the tables of gait analysis: hip and knee flexion, ankle
dorsiflexion and shoulder flexion (arm forward) are positive.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

PoseName = Literal["walk", "run", "stand", "phone", "carry", "sit"]
POSES: tuple[PoseName, ...] = ("walk", "run", "stand", "phone", "carry", "sit")
PHASES = 16
"""A stride is divided into this many steps, from one heel strike to the next of the same foot."""

BEHAVIOURS = {
    "walk": "walking",
    "run": "running",
    "stand": "standing",
    "phone": "using_phone",
    "carry": "carrying",
    "sit": "sitting",
}


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


# Level walking, every 1/16 of a stride from heel strike, rounded from the mean curves of Winter,
# "Biomechanics and motor control of human movement", 4th ed. 2009, ch. 2 and 4.
_WALK_HIP = (25, 24, 20, 14, 8, 1, -6, -12, -17, -18, -12, -2, 9, 19, 25, 26)
_WALK_KNEE = (5, 13, 18, 17, 13, 8, 5, 5, 9, 20, 38, 56, 62, 52, 30, 9)
_WALK_ANKLE = (0, -5, -3, 3, 5, 7, 10, 12, 9, -4, -17, -13, -4, 0, 1, 1)
_WALK_TOES = (0, 0, 0, 0, 0, 0, 0, 4, 16, 28, 20, 5, 0, 0, 0, 0)
# Slow running, rounded from the mean curves of Novacheck, "The biomechanics of running",
# Gait & Posture 7(1), 1998.
_RUN_HIP = (38, 34, 28, 20, 10, 0, -8, -11, -8, 2, 16, 30, 42, 48, 46, 41)
_RUN_KNEE = (20, 34, 42, 40, 32, 22, 16, 20, 38, 62, 84, 96, 92, 72, 44, 22)
_RUN_ANKLE = (5, 12, 18, 20, 16, 6, -10, -20, -16, -8, -2, 2, 5, 6, 6, 5)
_RUN_TOES = (0, 0, 0, 2, 10, 22, 24, 10, 0, 0, 0, 0, 0, 0, 0, 0)


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
    step %= PHASES
    if pose == "walk":
        return _walk(step)
    if pose == "run":
        return _run(step)
    if pose == "carry":
        still = Arm(swing=-2.0, out=11.0, elbow=14.0, curl=48.0)
        return replace(_walk(step), right_arm=still)
    if pose == "phone":
        arm = Arm(swing=24.0, out=10.0, elbow=96.0, inward=32.0, curl=34.0)
        return replace(_stand(), right_arm=arm, nod=24.0)
    return _sit() if pose == "sit" else _stand()


def _walk(step: int) -> Stance:
    turn = math.cos(2.0 * math.pi * step / PHASES)
    return Stance(
        _leg(step, _WALK_HIP, _WALK_KNEE, _WALK_ANKLE, _WALK_TOES),
        _leg(step + PHASES // 2, _WALK_HIP, _WALK_KNEE, _WALK_ANKLE, _WALK_TOES),
        Arm(swing=-20.0 * turn + 1.0, out=9.0, elbow=17.0 - 9.0 * turn),
        Arm(swing=20.0 * turn + 1.0, out=9.0, elbow=17.0 + 9.0 * turn),
        lean=3.0,
        twist=-5.0 * turn,
    )


def _run(step: int) -> Stance:
    turn = math.cos(2.0 * math.pi * step / PHASES)
    return Stance(
        _leg(step, _RUN_HIP, _RUN_KNEE, _RUN_ANKLE, _RUN_TOES),
        _leg(step + PHASES // 2, _RUN_HIP, _RUN_KNEE, _RUN_ANKLE, _RUN_TOES),
        Arm(swing=-34.0 * turn - 4.0, out=14.0, elbow=84.0, inward=20.0, curl=45.0),
        Arm(swing=34.0 * turn - 4.0, out=14.0, elbow=84.0, inward=20.0, curl=45.0),
        lean=8.0,
        twist=-8.0 * turn,
    )


def _stand() -> Stance:
    leg = Leg(hip=0.0, knee=2.0, ankle=2.0)
    return Stance(leg, leg, Arm(swing=1.0), Arm(swing=1.0))


def _sit() -> Stance:
    leg = Leg(hip=86.0, knee=88.0, ankle=2.0)
    arm = Arm(swing=18.0, out=10.0, elbow=52.0, inward=14.0)
    return Stance(leg, leg, arm, arm, lean=-4.0)


def _leg(
    step: int, hip: Sequence[int], knee: Sequence[int], ankle: Sequence[int], toes: Sequence[int]
) -> Leg:
    k = step % PHASES
    return Leg(hip[k], knee[k], ankle[k], toes[k])
