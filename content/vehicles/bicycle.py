"""Bicycles, alone and ridden; frames after the usual geometry charts of 28 inch bicycles."""

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from gen_data.assets.family import Facts, Solid, check_option
from gen_data.config.data_files import load_table
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import hex_to_linear
from gen_data.content.procedural.patches import Array, Patch, join_patches
from gen_data.content.procedural.surface_shapes import block, circle, cone, lathe, sweep
from gen_data.content.scenery.basic_shapes import make_solid
from gen_data.content.vehicles import body_shell, luggage
from gen_data.content.vehicles import rider as people
from gen_data.content.vehicles.rider import Seat, blob, limb
from gen_data.content.vehicles.vehicle_materials import COLORS, materials
from gen_data.content.vehicles.vehicle_materials import VehicleSlot as Slot
from gen_data.core.asset_types import Keypoint, Material
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng, in_turn, variant_rng

STYLES = ("city", "mountain", "road")
POSES = ("ride", "wait")

_CRANK_M = 0.17
_BULK = (1.0, 1.22)
"""Girth of a clothed cyclist, from tight to loose or padded, relative to a lean one's; assumed."""
_SPOKES, _SPOKE_M = 18, 0.0024
"""Of a wheel, and half the width of one: together as wide as 36 spokes of 2 mm (a triangle's mean
width is 1.65 of its outer radius), of which a laser beam meets several."""
_WAITS_AHEAD_M, _WAITS_HIPS_M, _WAITS_CRANK_RAD = 0.22, 0.89, math.radians(210.0)
"""Who waits stands before the saddle, astride the bicycle, a foot on a raised pedal (assumed)."""


@dataclass(frozen=True)
class _Frame:
    """Joints in the plane y = 0, metres: (x, z).

    Attributes:
        step: Where the top tube meets the seat tube, as a share of that.
        grip: Place of the left hand: x, y, z.
        tyre_m: Radius of a tyre's section.
        lean_rad: How far a rider leans forward.
    """

    axle: float
    wheel_m: float
    crank: tuple[float, float]
    seat: tuple[float, float]
    saddle: tuple[float, float]
    head: tuple[float, float]
    fork: tuple[float, float]
    step: float
    grip: Vec3
    tyre_m: float
    lean_rad: float


_FRAMES = load_table(__package__, "bicycles", _Frame)


def bicycle(seed: int) -> Solid:
    """A bicycle without rider, upright."""
    parts, finish = bicycle_parts(seed)
    return _solid(parts, _FRAMES[in_turn(STYLES, seed)], finish, 1.0)


def bicycle_parts(seed: int) -> tuple[list[Patch], tuple[Material, ...]]:
    """Triangles of the same bicycle, without texture coordinates, and materials by slot."""
    rng = variant_rng("bicycle", seed)
    frame = _FRAMES[in_turn(STYLES, seed)]
    parts = _machine(in_turn(STYLES, seed), frame, rng.between(0.0, 2.0 * math.pi), rng)
    paint = hex_to_linear(rng.choose(COLORS["bicycles"]))
    return [body_shell.drop_uvs(part) for part in parts], materials(rng, paint)


def bicycle_facts(seed: int) -> Facts:
    """Its kind."""
    return Facts(in_turn(STYLES, seed), {"rider": "no"})


def cyclist(seed: int, pose: str = "ride") -> Solid:
    """A bicycle with its rider, who rides (``ride``) or stands with a foot down (``wait``)."""
    check_option("cyclist", "pose", pose, POSES)
    rng = variant_rng("cyclist", seed)
    style = in_turn(STYLES, seed)
    frame, turn = _FRAMES[style], rng.between(0.0, 2.0 * math.pi)
    turn = turn if pose == "ride" else _WAITS_CRANK_RAD
    seat = _seat(frame, turn) if pose == "ride" else _stance(frame, turn)
    parts = _machine(style, frame, turn, rng)
    nod_rad = people.draw_nod(rng)
    paint = hex_to_linear(rng.choose(COLORS["bicycles"]))
    finish = list(materials(rng, paint, clothes=people.draw_clothes(rng)))
    parts += people.rider(seat, nod_rad, rng.between(*_BULK))
    parts += _luggage(style, frame, seat, rng)
    bag = finish[Slot.SOFT_TOP]
    finish[Slot.SOFT_TOP] = replace(bag, base_color=luggage.draw_color(rng))
    return _solid(parts, frame, tuple(finish), 1.7)


def cyclist_facts(seed: int, pose: str = "ride") -> Facts:
    """The kind of bicycle, and the action of its rider."""
    return Facts(in_turn(STYLES, seed), {"rider": "yes", "pose": pose})


def spoked_wheel(radius_m: float, tyre_m: float) -> Patch:
    """A thin wheel about the origin, its axle along Y."""
    ring = circle(tyre_m, 6) + np.array([radius_m - tyre_m, 0.0])
    tyre = lathe([*map(tuple, ring), tuple(ring[0])], 24, Slot.TYRE)
    rim = lathe(
        [(radius_m - 1.7 * tyre_m - 0.014, h) for h in (0.6 * tyre_m, -0.6 * tyre_m)]
        + [(radius_m - 1.4 * tyre_m, h) for h in (-0.7 * tyre_m, 0.7 * tyre_m)]
        + [(radius_m - 1.7 * tyre_m - 0.014, 0.6 * tyre_m)],
        24,
        Slot.RIM,
    )
    hub = cone((0.022, -0.035), (0.022, 0.035), 6, Slot.CHROME)
    wires = []
    for k in range(_SPOKES):
        turn = 2.0 * math.pi * k / _SPOKES
        end = (radius_m - 2.2 * tyre_m) * np.array([math.cos(turn), math.sin(turn), 0.0])
        start = np.array([0.02 * end[1], -0.02 * end[0], 0.03 * (-1) ** k])
        wire = np.array([start, end])
        wires.append(sweep(wire, circle(_SPOKE_M, 3), capped=False, slot=Slot.SPOKE))
    return join_patches([tyre, rim, hub, *wires]).rotated("x", -0.5 * math.pi)


def _solid(parts: list[Patch], frame: _Frame, finish: tuple[Material, ...], top: float) -> Solid:
    reach, z = frame.axle + frame.wheel_m, frame.wheel_m
    points = (
        Keypoint("wheel_front", (frame.axle, 0.0, z), 0.06),
        Keypoint("wheel_rear", (-frame.axle, 0.0, z), 0.06),
        Keypoint("headlight", (frame.head[0] + 0.08, 0.0, frame.head[1] + 0.02), 0.06),
        Keypoint("taillight", (frame.saddle[0] - 0.14, 0.0, frame.saddle[1] - 0.1), 0.06),
    )
    hull = [
        hulls.box((-reach, -0.05, 0.0), (reach, 0.05, 0.7)),
        hulls.box((-0.45, -0.28, 0.25), (0.45, 0.28, top)),
    ]
    return make_solid([body_shell.drop_uvs(part) for part in parts], finish, hull, points)


def _machine(style: str, frame: _Frame, turn_rad: float, rng: VariantRng) -> list[Patch]:
    """The bicycle itself; ``turn_rad`` is the left crank's angle."""
    wheel = spoked_wheel(frame.wheel_m, frame.tyre_m)
    parts = [wheel.moved(sign * frame.axle, 0.0, frame.wheel_m) for sign in (1.0, -1.0)]
    parts += [*_tubes(frame), *_bars(style, frame), *_drive(frame, turn_rad)]
    x, z = frame.saddle
    parts.append(blob((x, 0.0, z), (0.135, 0.07, 0.035), Slot.TRIM))
    parts.append(limb([(x + 0.1, 0.0, z), (x + 0.15, 0.0, z)], (0.03, 0.016), Slot.TRIM))
    x, z = frame.head
    parts.append(blob((x + 0.08, 0.0, z + 0.02), (0.035, 0.03, 0.03), Slot.HEADLIGHT))
    x, z = frame.saddle
    parts.append(blob((x - 0.14, 0.0, z - 0.1), (0.018, 0.03, 0.025), Slot.TAILLIGHT))
    if style == "city":
        parts += [_mudguard(frame, 1.0, (0.2, 2.0)), _mudguard(frame, -1.0, (0.8, 3.3))]
        parts += _rack(frame)
        if rng.chance(0.5):
            parts.append(block((0.3, -0.18, 0.98), (0.55, 0.18, 1.18), 0.02, Slot.TRIM))
    return parts


def _tubes(frame: _Frame) -> list[Patch]:
    crank, seat, head, fork = (
        _in_plane(p) for p in (frame.crank, frame.seat, frame.head, frame.fork)
    )
    step = crank + frame.step * (seat - crank)
    radius = 0.017
    bars = [(crank, seat), (step, head - 0.12 * (head - fork)), (crank, fork), (head, fork)]
    parts = [limb(bar, (radius, radius), Slot.PAINT, 6) for bar in bars]
    parts.append(limb([seat, _in_plane(frame.saddle)], (0.013, 0.013), Slot.CHROME, 6))
    for sign in (1.0, -1.0):
        out = np.array([0.0, sign * 0.055, 0.0])
        rear = np.array([-frame.axle, sign * 0.065, frame.wheel_m])
        front = np.array([frame.axle, sign * 0.055, frame.wheel_m])
        stays = [(crank + 0.6 * out, rear), (seat + 0.3 * out, rear), (fork + out, front)]
        parts += [limb(stay, (0.012, 0.009), Slot.PAINT, 5) for stay in stays]
    return parts


def _bars(style: str, frame: _Frame) -> list[Patch]:
    x, y, z = frame.grip
    stem = np.array([frame.head[0] - 0.01, 0.0, z - (0.0 if style == "road" else 0.03)])
    parts = [limb([_in_plane(frame.head), stem], (0.014, 0.014), Slot.CHROME, 6)]
    for sign in (1.0, -1.0):
        grip = np.array([x, sign * y, z])
        corner = np.array([stem[0] + 0.06, sign * (y - 0.04), z])
        path = [stem, corner, grip]
        if style == "road":
            drop = np.array([(0.02, 0.0, 0.0), (0.01, 0.0, -0.11), (-0.1, 0.0, -0.13)])
            path = [stem, np.array([x - 0.08, sign * y, z]), *(grip + drop)]
        parts.append(limb(path, (0.012,) * len(path), Slot.TRIM, 5))
        tip = grip + np.array([-0.09, sign * 0.02, 0.0])
        if style != "road":
            parts.append(limb([grip + 0.5 * (grip - tip), tip], (0.016, 0.016), Slot.TRIM, 6))
    return parts


def _pedals(frame: _Frame, turn_rad: float) -> tuple[Vec3, Vec3]:
    x, z = frame.crank
    reach = (_CRANK_M * math.cos(turn_rad), _CRANK_M * math.sin(turn_rad))
    return (x + reach[0], 0.13, z + reach[1]), (x - reach[0], -0.13, z - reach[1])


def _drive(frame: _Frame, turn_rad: float) -> list[Patch]:
    ring = lathe([(0.0, -0.004), (0.09, -0.004), (0.09, 0.004), (0.0, 0.004)], 16, Slot.TRIM)
    x, z = frame.crank
    parts = [ring.rotated("x", 0.5 * math.pi).moved(x, -0.05, z)]
    for sign, pedal in zip((1.0, -1.0), _pedals(frame, turn_rad), strict=True):
        axle, (px, py, pz) = np.array([x, sign * 0.07, z]), pedal
        arm = [axle, np.array([px, sign * 0.07, pz])]
        parts.append(limb(arm, (0.012, 0.01), Slot.CHROME, 5))
        low, high = (px - 0.045, py - 0.045, pz - 0.012), (px + 0.045, py + 0.045, pz + 0.012)
        parts.append(block(low, high, 0.0, Slot.TRIM))
    rear = np.array([-frame.axle, -0.05, frame.wheel_m])
    for up in (1.0, -1.0):
        near, far = (np.array([0.0, 0.0, up * r]) for r in (0.085, 0.035))
        chain = [np.array([x, -0.05, z]) + near, rear + far]
        parts.append(limb(chain, (0.005, 0.005), Slot.TRIM, 4))
    return parts


def _mudguard(frame: _Frame, sign: float, arc_rad: tuple[float, float]) -> Patch:
    turn = np.linspace(*arc_rad, 9)
    radius = frame.wheel_m + 0.02
    x, z = sign * frame.axle + radius * np.cos(turn), frame.wheel_m + radius * np.sin(turn)
    path = np.stack([x, 0 * turn, z], axis=1)
    section = np.array([(0.004, 0.0), (-0.006, 0.028), (-0.006, -0.028)])
    return join_patches(
        sweep(np.array(pair), section, up=(0.0, 0.0, 1.0), slot=Slot.PAINT)
        for pair in pairwise(path)
    )


def _luggage(style: str, frame: _Frame, seat: Seat, rng: VariantRng) -> list[Patch]:
    """Bags of the rider and of the machine; racing bicycles have no carrier."""
    parts = [luggage.backpack(seat, rng)] if rng.chance(luggage.BACKPACK) else []
    if style != "road" and rng.chance(luggage.PANNIERS):
        parts += luggage.panniers(luggage.rear_carrier(frame.axle, frame.wheel_m), rng)
        parts += _rack(frame) if style != "city" else []
    return parts


def _rack(frame: _Frame) -> list[Patch]:
    x, _, z = luggage.rear_carrier(frame.axle, frame.wheel_m)
    top = block((x - 0.2, -0.06, z), (x + 0.2, 0.06, z + 0.015), 0.0, Slot.TRIM)
    ends = [[(x, s * 0.07, frame.wheel_m), (x - 0.1, s * 0.06, z)] for s in (1.0, -1.0)]
    return [top, *(limb(stay, (0.006, 0.006), Slot.TRIM, 4) for stay in ends)]


def _seat(frame: _Frame, turn_rad: float) -> Seat:
    x, y, z = frame.grip
    left, right = ((px, py, pz + 0.03) for px, py, pz in _pedals(frame, turn_rad))
    hips = (frame.saddle[0], 0.0, frame.saddle[1] + 0.1)
    return Seat(hips, ((x, y, z), (x, -y, z)), (left, right), frame.lean_rad, full_face=False)


def _stance(frame: _Frame, turn_rad: float) -> Seat:
    """Contacts of a rider who stands astride, left foot on the ground next to the pedal."""
    x, y, z = frame.grip
    hips = (frame.saddle[0] + _WAITS_AHEAD_M, 0.04, _WAITS_HIPS_M)
    px, py, pz = _pedals(frame, turn_rad)[1]
    soles = ((hips[0] + 0.06, 0.25, 0.01), (px, py, pz + 0.03))
    return Seat(hips, ((x, y, z), (x, -y, z)), soles, 0.4 * frame.lean_rad, full_face=False)


def _in_plane(point: tuple[float, float]) -> Array:
    return np.array([point[0], 0.0, point[1]])
