"""Motorcycles and scooters, with or without a rider."""

import math
from dataclasses import dataclass

import numpy as np

from gen_data.assets.family import Facts, Solid
from gen_data.config.data_files import load_table
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import material_presets, patches
from gen_data.content.procedural.surface_shapes import block, circle, sweep
from gen_data.content.scenery.basic_shapes import make_solid
from gen_data.content.vehicles import body_shell, wheels
from gen_data.content.vehicles import rider as people
from gen_data.content.vehicles.rider import Seat, blob, limb
from gen_data.content.vehicles.vehicle_materials import COLORS, Print, materials
from gen_data.content.vehicles.vehicle_materials import VehicleSlot as Slot
from gen_data.core import asset_types, se3
from gen_data.core.variant_rng import VariantRng, in_turn, variant_rng

STYLES = ("naked", "sport", "scooter")


@dataclass(frozen=True)
class _Build:
    """Main measures, metres: half wheelbase, wheels, seat, hands, feet, handlebar, fork's top."""

    axle: float
    wheel_m: float
    tyre_m: float
    seat: tuple[float, float]
    grip: se3.Vec3
    foot: se3.Vec3
    head: tuple[float, float]
    fork: tuple[float, float]
    lean_rad: float


_BUILDS = load_table(__package__, "motorcycles", _Build)


def motorcycle(rng: VariantRng) -> Solid:
    """A motorcycle; two of three have a rider."""
    style = in_turn(STYLES, rng.seed)
    build = _BUILDS[style]
    above = [*_lamps(style, build), *_bodies(style, build)]
    ridden = _is_ridden(rng.seed)
    if ridden:
        above += people.rider(_seat(build), people.draw_nod(rng))
    parts, body = (
        [body_shell.drop_uvs(part) for part in (*_running_gear(build, mirrors=mirrors), *above)]
        for mirrors in (True, False)
    )
    paint = material_presets.hex_to_linear(rng.choose(COLORS["motorcycles"]))
    finish = materials(rng, paint, clothes=people.draw_clothes(rng), printed=Print(plate_rows=2))
    reach = build.axle + build.wheel_m
    hull = [
        hulls.box((-reach, -0.12, 0.0), (reach, 0.12, 0.75)),
        hulls.box((-0.6, -0.36, 0.3), (0.5, 0.36, 1.65 if ridden else 1.1)),
    ]
    z = build.wheel_m
    head, tail = _lamp_places(style, build)
    points = (
        asset_types.Keypoint("wheel_front", (build.axle, 0.0, z), 0.12),
        asset_types.Keypoint("wheel_rear", (-build.axle, 0.0, z), 0.12),
        asset_types.Keypoint("headlight", head, 0.12),
        asset_types.Keypoint("taillight", tail, 0.1),
    )
    return make_solid(parts, finish, hull, points, body)


def motorcycle_facts(seed: int) -> Facts:
    """Its kind, and whether it has a rider."""
    return Facts(in_turn(STYLES, seed), {"rider": "yes" if _is_ridden(seed) else "no"})


def _is_ridden(seed: int) -> bool:
    return variant_rng("motorcycle rider", seed).chance(2.0 / 3.0)


def _running_gear(build: _Build, *, mirrors: bool) -> list[patches.Patch]:
    made = wheels.wheel(build.wheel_m, build.tyre_m, "six")
    both = [made, made.rotated("z", math.pi)]
    parts = [w.moved(sign * build.axle, 0.0, build.wheel_m) for sign in (1.0, -1.0) for w in both]
    head_x, head_z = build.head
    gx, gy, gz = build.grip
    for sign in (1.0, -1.0):
        side = np.array([0.0, sign * 0.5 * (build.tyre_m + 0.05), 0.0])
        hub = np.array([build.axle, 0.0, build.wheel_m]) + side
        top = np.array([build.fork[0], 0.0, build.fork[1]]) + side
        parts.append(limb([hub, top], (0.024, 0.021), Slot.CHROME, 7))
        rear = np.array([-build.axle, 0.0, build.wheel_m]) + side
        parts.append(limb([rear, np.array([-0.12, 0.0, 0.42]) + side], (0.022, 0.03), Slot.TRIM, 5))
        grip = np.array([gx, sign * gy, gz])
        bar = [np.array([head_x, 0.0, head_z + 0.03]), np.array([gx + 0.1, sign * (gy - 0.12), gz]),
               grip + np.array([-0.03, sign * 0.04, 0.0])]  # fmt: skip
        parts.append(limb(bar, (0.014, 0.014, 0.018), Slot.TRIM, 6))
        if not mirrors:
            continue
        glass = np.array([gx + 0.1, sign * (gy - 0.06), gz + 0.17])
        parts.append(limb([bar[1], glass], (0.006, 0.006), Slot.TRIM, 4))
        parts.append(blob(glass, (0.02, 0.065, 0.04), Slot.TRIM))
    return [*parts, _guard(build, 1.0, (0.7, 2.3)), _guard(build, -1.0, (0.7, 2.2))]


def _guard(build: _Build, sign: float, arc_rad: tuple[float, float]) -> patches.Patch:
    turn = np.linspace(*arc_rad, 8)
    radius = build.wheel_m + 0.03
    x, z = sign * build.axle + radius * np.cos(turn), build.wheel_m + radius * np.sin(turn)
    path = np.stack([x, 0.0 * turn, z], axis=1)
    section = circle(1.0, 6) * np.array([0.014, 0.5 * build.tyre_m + 0.012])
    return sweep(path, section, up=(0.0, 0.0, 1.0), slot=Slot.PAINT)


def _lamp_places(style: str, build: _Build) -> tuple[se3.Vec3, se3.Vec3]:
    x, z = build.head
    if style == "scooter":
        return (x + 0.14, 0.0, z + 0.0), (-build.axle - 0.12, 0.0, 0.68)
    return (x + 0.17, 0.0, z - 0.1), (-build.axle - 0.06, 0.0, 0.87)


def _lamps(style: str, build: _Build) -> list[patches.Patch]:
    (hx, _, hz), (tx, _, tz) = _lamp_places(style, build)
    parts = [
        blob((hx - 0.03, 0.0, hz), (0.09, 0.1, 0.095), Slot.TRIM),
        blob((hx, 0.0, hz), (0.075, 0.085, 0.08), Slot.HEADLIGHT),
        blob((tx, 0.0, tz), (0.05, 0.09, 0.035), Slot.TAILLIGHT),
        blob((tx - 0.02, 0.0, tz), (0.04, 0.045, 0.03), Slot.BRAKELIGHT),
        block((tx - 0.05, -0.09, tz - 0.25), (tx - 0.03, 0.09, tz - 0.1), 0.0, Slot.REAR_PLATE),
        block((tx - 0.03, -0.03, tz - 0.2), (tx + 0.12, 0.03, tz - 0.02), 0.0, Slot.TRIM),
    ]
    for sign, slot in ((1.0, Slot.INDICATOR_LEFT), (-1.0, Slot.INDICATOR_RIGHT)):
        parts.append(blob((hx - 0.04, sign * 0.16, hz - 0.04), (0.03, 0.045, 0.022), slot))
        parts.append(blob((tx, sign * 0.14, tz - 0.03), (0.03, 0.045, 0.022), slot))
    return parts


def _bodies(style: str, build: _Build) -> list[patches.Patch]:
    if style == "scooter":
        return _scooter(build)
    x, z = build.seat
    saddle = [(x + 0.25, 0.0, z - 0.02), (x, 0.0, z - 0.045), (-0.62, 0.0, z + 0.03)]
    tail = [(x + 0.05, 0.0, z - 0.07), (-0.55, 0.0, z - 0.01), (-0.76, 0.0, z + 0.05)]
    parts = [
        blob((0.1, 0.0, 0.86), (0.3, 0.15, 0.14), Slot.PAINT, 0.12),
        limb(saddle, (0.075, 0.115, 0.08), Slot.TRIM, 8),
        limb(tail, (0.11, 0.095, 0.05), Slot.PAINT, 8),
        block((-0.18, -0.15, 0.3), (0.22, 0.15, 0.6), 0.05, Slot.UNDERBODY),
        blob((0.14, 0.0, 0.58), (0.15, 0.17, 0.14), Slot.RIM, -0.5),
        blob((-0.05, 0.0, 0.4), (0.19, 0.2, 0.12), Slot.RIM),
    ]
    for sign in (1.0, -1.0):
        frame = [(0.33, sign * 0.08, 0.88), (0.0, sign * 0.16, 0.72), (-0.16, sign * 0.12, 0.42)]
        parts.append(limb(frame, (0.03, 0.03, 0.03), Slot.TRIM, 6))
    pipe = [(0.25, -0.1, 0.5), (0.2, -0.12, 0.27), (-0.15, -0.15, 0.25), (-0.45, -0.19, 0.38),
            (-0.78, -0.2, 0.5)]  # fmt: skip
    parts.append(limb(pipe, (0.025, 0.025, 0.03, 0.055, 0.055), Slot.CHROME, 8))
    if style == "sport":
        parts += _fairing()
    return parts


def _fairing() -> list[patches.Patch]:
    parts = [
        blob((0.42, 0.0, 0.86), (0.26, 0.19, 0.17), Slot.PAINT, 0.35),
        blob((0.36, 0.0, 1.0), (0.17, 0.14, 0.13), Slot.GLASS, 0.5),
        blob((0.08, 0.0, 0.34), (0.3, 0.19, 0.12), Slot.PAINT, -0.1),
    ]
    for sign in (1.0, -1.0):
        parts.append(blob((0.16, sign * 0.15, 0.6), (0.3, 0.06, 0.24), Slot.PAINT, 0.4))
    return parts


def _scooter(build: _Build) -> list[patches.Patch]:
    x, z = build.seat
    shield = np.array([(0.36, 0.0, 0.98), (0.4, 0.0, 0.7), (0.33, 0.0, 0.34), (0.1, 0.0, 0.24)])
    sizes = np.array([(0.12, 0.07), (0.22, 0.07), (0.2, 0.06), (0.17, 0.05)])
    saddle = [(x + 0.2, 0.0, z - 0.05), (x - 0.05, 0.0, z - 0.06), (x - 0.4, 0.0, z - 0.01)]
    return [
        sweep(shield, circle(1.0, 10), up=(0.0, 1.0, 0.0), slot=Slot.PAINT, scale=sizes),
        blob((0.39, 0.0, 0.98), (0.13, 0.16, 0.1), Slot.PAINT),
        block((-0.15, -0.17, 0.22), (0.36, 0.17, 0.29), 0.02, Slot.TRIM),
        blob((-0.45, 0.0, 0.52), (0.42, 0.2, 0.24), Slot.PAINT, 0.06),
        limb(saddle, (0.09, 0.13, 0.09), Slot.TRIM, 8),
        block((-0.7, 0.06, 0.17), (-0.25, 0.14, 0.34), 0.04, Slot.UNDERBODY),
        limb([(-0.3, -0.13, 0.24), (-0.78, -0.15, 0.32)], (0.04, 0.055), Slot.CHROME, 8),
    ]


def _seat(build: _Build) -> Seat:
    gx, gy, gz = build.grip
    fx, fy, fz = build.foot
    return Seat(
        hips=(build.seat[0], 0.0, build.seat[1] + 0.12),
        grips=((gx, gy, gz + 0.02), (gx, -gy, gz + 0.02)),
        soles=((fx, fy, fz), (fx, -fy, fz)),
        lean_rad=build.lean_rad,
        full_face=True,
    )
