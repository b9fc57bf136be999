"""Riders of two-wheelers: limbs between hips, grips and pedals.

Lengths are shares of stature from Drillis and Contini, "Body segment parameters", 1966.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gen_data.content.procedural.material_presets import hex_to_linear
from gen_data.content.procedural.patches import Array, Patch
from gen_data.content.procedural.surface_shapes import ball, circle, spline, sweep
from gen_data.content.vehicles.vehicle_materials import COLORS
from gen_data.content.vehicles.vehicle_materials import VehicleSlot as Slot
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng

_STATURE_M = 1.74
_THIGH_M, _SHIN_M = 0.245 * _STATURE_M, 0.246 * _STATURE_M
_UPPER_ARM_M, _FOREARM_M = 0.186 * _STATURE_M, 0.17 * _STATURE_M
_TORSO_M = 0.275 * _STATURE_M


@dataclass(frozen=True)
class Seat:
    """Points of contact between rider and vehicle [m]; left (y > 0) before right.

    Attributes:
        hips: Middle of the hip joints.
        grips, soles: Positions of hands and feet.
        lean_rad: Forward lean of the trunk from upright.
        full_face: Whether the helmet covers the face.
    """

    hips: Vec3
    grips: tuple[Vec3, Vec3]
    soles: tuple[Vec3, Vec3]
    lean_rad: float
    full_face: bool


def draw_clothes(rng: VariantRng) -> tuple[Vec3, ...]:
    """Colours of skin, top, bottom, shoes and helmet, linear RGB."""
    kinds = ("skins", "tops", "bottoms", "shoes", "helmets")
    return tuple(hex_to_linear(rng.choose(COLORS[kind])) for kind in kinds)


def draw_nod(rng: VariantRng) -> float:
    """How far a rider's face is lowered [rad]."""
    return rng.between(-0.1, 0.15)


def rider(seat: Seat, nod_rad: float, bulk: float = 1.0) -> list[Patch]:
    """The rider's body; ``bulk`` is the girth of trunk and limbs relative to a lean body."""
    hips = np.array(seat.hips)
    spine = np.array([math.sin(seat.lean_rad), 0.0, math.cos(seat.lean_rad)])
    neck = hips + (_TORSO_M + 0.05) * spine
    parts = [*_trunk(hips, spine, bulk), *_head(neck, seat, nod_rad)]
    for sign, grip, sole in zip((1.0, -1.0), seat.grips, seat.soles, strict=True):
        shoulder = hips + _TORSO_M * spine + np.array([0.0, sign * 0.175, 0.0])
        parts += _arm(shoulder, np.array(grip), sign, bulk)
        parts += _leg(hips + np.array([0.0, sign * 0.09, 0.0]), np.array(sole), sign, bulk)
    return parts


def limb(
    path: Sequence[Array | Vec3], radii_m: Sequence[float], slot: int, sides: int = 8
) -> Patch:
    """A tapering round bar through points, rounded where it bends."""
    points = np.array(path, dtype=np.float64)
    if len(path) > 2:
        both = np.concatenate([points, np.array(radii_m)[:, None]], axis=1)
        smooth = spline(both.tolist(), 2 * (len(path) - 1) + 1)
        points, radii_m = smooth[:, :3], smooth[:, 3].tolist()
    start = np.abs(points[1] - points[0])
    up = (0.0, 1.0, 0.0) if start[1] < 0.8 * math.sqrt(float((start**2).sum())) else (1.0, 0.0, 0.0)
    return sweep(points, circle(1.0, sides), up=up, scale=np.array(radii_m), slot=slot)


def blob(centre: Sequence[float] | Array, half: Vec3, slot: int, pitch_rad: float = 0.0) -> Patch:
    """An ellipsoid, its nose lowered by the pitch."""
    made = ball(lambda d: d * np.array(half), rings=6, segments=10)
    x, y, z = (float(c) for c in centre)
    return made.rotated("y", pitch_rad).moved(x, y, z).painted(slot)


def joint(start: Array, end: Array, first_m: float, second_m: float, towards: Array) -> Array:
    """Joint of a limb of two bones that bends towards a direction; straight if it cannot reach."""
    reach = end - start
    distance = math.sqrt(float((reach**2).sum()))
    along = (distance**2 + first_m**2 - second_m**2) / (2.0 * distance)
    out = math.sqrt(max(0.0, first_m**2 - along**2))
    axis = reach / distance
    side = towards - (towards * axis).sum() * axis
    bent: Array = start + along * axis + out * side / math.sqrt(float((side**2).sum()))
    return bent


def _trunk(hips: Array, spine: Array, bulk: float) -> list[Patch]:
    path = [hips + share * _TORSO_M * spine for share in (-0.16, 0.0, 0.4, 0.8, 1.02, 1.12)]
    # Half width across, half depth.
    sizes = np.array([(0.1, 0.09), (0.17, 0.125), (0.155, 0.11), (0.185, 0.115), (0.14, 0.08),
                      (0.06, 0.06)])  # fmt: skip
    sizes *= bulk
    points = np.array(path)
    top = sweep(points[1:], circle(1.0, 10), up=(0.0, 1.0, 0.0), scale=sizes[1:], slot=Slot.TOP)
    seat = sweep(points[:3], circle(1.0, 10), up=(0.0, 1.0, 0.0), scale=0.98 * sizes[:3],
                 slot=Slot.BOTTOM)  # fmt: skip
    return [top, seat]


def _head(neck: Array, seat: Seat, nod_rad: float) -> list[Patch]:
    middle = neck + np.array([0.07, 0.0, 0.13])
    ends = [neck - (0.01, 0.0, 0.03), middle - (0.01, 0.0, 0.04)]
    throat = limb(ends, (0.06, 0.055), Slot.SKIN)
    if seat.full_face:
        shell = blob(
            np.add(middle, (0.005, 0.0, 0.01)), (0.148, 0.122, 0.145), Slot.HELMET, nod_rad
        )
        visor = blob(np.add(middle, (0.05, 0.0, 0.02)), (0.11, 0.113, 0.058), Slot.GLASS, nod_rad)
        return [throat, shell, visor]
    face = blob(middle, (0.1, 0.078, 0.12), Slot.SKIN, nod_rad)
    helmet = blob(np.add(middle, (-0.015, 0.0, 0.065)), (0.14, 0.1, 0.085), Slot.HELMET, nod_rad)
    return [throat, face, helmet]


def _arm(shoulder: Array, grip: Array, sign: float, bulk: float) -> list[Patch]:
    out = np.array([-0.3, 0.8 * sign, -0.8])
    elbow = joint(shoulder, grip, _UPPER_ARM_M, _FOREARM_M, out)
    wrist = elbow + 0.85 * (grip - elbow)
    sleeve = limb([shoulder, elbow, wrist], (0.062 * bulk, 0.047 * bulk, 0.036 * bulk), Slot.TOP)
    return [sleeve, blob(grip + 0.02 * (wrist - grip), (0.045, 0.045, 0.04), Slot.SKIN)]


def _leg(hip: Array, sole: Array, sign: float, bulk: float) -> list[Patch]:
    ankle = sole + np.array([-0.09, 0.0, 0.085])
    knee = joint(hip, ankle, _THIGH_M, _SHIN_M, np.array([1.0, 0.12 * sign, 0.5]))
    trouser = limb([hip, knee, ankle], (0.088 * bulk, 0.062 * bulk, 0.045 * bulk), Slot.BOTTOM)
    heel, toe = ankle + np.array([-0.05, 0.0, -0.05]), sole + np.array([0.13, 0.0, 0.03])
    path = [heel, 0.5 * (heel + toe) + (0.0, 0.0, 0.012), toe]
    return [trouser, limb(path, (0.045, 0.05, 0.032), Slot.SHOES)]
