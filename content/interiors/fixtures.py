"""Kitchens and bathrooms: sinks, hobs, sanitary ware."""

from dataclasses import replace

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.interiors.parts import (
    Box,
    board,
    brushed_steel,
    ceramic,
    disc,
    front,
    handle,
    rod,
    solid,
)
from gen_data.content.interiors.storage import _looks
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.material_presets import STAINLESS, metal_material, painted_material
from gen_data.content.procedural.patches import Patch
from gen_data.core.asset_types import Keypoint, Material
from gen_data.core.keypoint_names import DRAIN, SUPPORT, TAP
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng

_X = 0.29
_CHROME = metal_material(STAINLESS, 0.15)


def kitchen_sink(rng: VariantRng) -> Solid:
    """A unit with a sink, as ``kitchen_unit``. Slots: carcass, front, steel, worktop."""
    patches = _base(hole=True)
    basin = [
        ((-0.17, -0.2, 0.72), (0.19, 0.2, 0.726)),
        ((-0.17, -0.2, 0.726), (-0.16, 0.2, 0.902)),
        ((0.18, -0.2, 0.726), (0.19, 0.2, 0.902)),
        ((-0.16, -0.2, 0.726), (0.18, -0.19, 0.902)),
        ((-0.16, 0.19, 0.726), (0.18, 0.2, 0.902)),
    ]
    patches += [shapes.block(*b, 0.002, 2) for b in basin]
    drain = [(0.0, 0.7255), (0.02, 0.7255), (0.026, 0.7275), (0.042, 0.7285), (0.045, 0.726)]
    patches.append(shapes.lathe(drain[::-1], 28, 2).moved(-0.06))
    patches += [
        shapes.block(
            (-0.18 + 0.001, s * 0.205 - 0.008, 0.9), (0.2, s * 0.205 + 0.008, 0.9035), 0.0015, 2
        )
        for s in (-1, 1)
    ]
    patches += [
        shapes.block((x - 0.008, -0.213, 0.9), (x + 0.008, 0.213, 0.9035), 0.0015, 2)
        for x in (-0.172, 0.194)
    ]
    height = rng.between(0.2, 0.32, "tap_m")
    patches += tap(-0.22, 0.0, 0.9, height, 2)
    patches += [
        board((_X, -0.297, 0.103), (_X + 0.018, 0.297, 0.857), 1),
        *handle(_X + 0.018, 0.0, 0.78, 0.2, 2, upright=False),
    ]
    boxes = [((-_X, -0.3, 0.0), (_X, 0.3, 0.72)), *_worktop(hole=True)]
    made = solid(patches, _looks("kitchen_unit", rng, rng.seed), boxes)
    return _with_water(made, (-0.22, 0.0, 0.9), height, 0.726)


def tap(x: float, y: float, z: float, height_m: float, slot: int) -> list[Patch]:
    """A tap whose spout points to +X."""
    rise = max(height_m - 0.07, 0.4 * height_m)
    bow = [
        (x, y, z),
        (x, y, z + 0.6 * rise),
        (x, y, z + rise),
        (x + 0.045, y, z + height_m + 0.005),
        (x + 0.12, y, z + height_m + 0.005),
        (x + 0.16, y, z + height_m - 0.04),
    ]
    path = shapes.spline(bow, 28)
    spout = shapes.sweep(path, shapes.circle(0.0105, 12), up=(0.0, 1.0, 0.0), slot=slot)
    return [
        disc(x, y, z, z + 0.006, 0.03, slot),
        disc(x, y, z, z + 0.07, 0.021, slot),
        spout,
        rod((x, y + 0.015, z + 0.05), (x, y + 0.034, z + 0.05), 0.014, slot, 14),
        rod((x, y + 0.03, z + 0.05), (x + 0.01, y + 0.05, z + 0.13), 0.006, slot),
    ]


def _with_water(made: Solid, tap_m: Vec3, height_m: float, basin_m: float) -> Solid:
    """The solid with keypoints where the water of its tap comes out and where it arrives."""
    x, y, z = tap_m
    mouth, drain = (x + 0.16, y, z + height_m - 0.04), (x + 0.16, y, basin_m)
    return replace(made, keypoints=(Keypoint(TAP, mouth), Keypoint(DRAIN, drain)))


def tap_stream(length_m: float = 0.2) -> Solid:
    """Water that falls from the origin. Slot: water.

    Args:
        length_m: Height of the fall.
    """
    # Falling water is thinner the faster it is: the radius goes with v^-1/2 (continuity).
    z = np.linspace(0.0, length_m, 9)
    speed = np.sqrt(0.6**2 + 2.0 * 9.81 * z)
    radius = 0.006 * np.sqrt(0.6 / speed)
    profile = [(0.0, 0.0), *zip(radius.tolist(), (-z).tolist(), strict=True), (0.0, -length_m)]
    water = Material((0.96, 0.98, 0.98), 0.08, transmission=1.0, ior=1.33, thin=False)
    stream = shapes.lathe([(r, h) for r, h in profile[::-1]], 14)
    return solid([stream], [water], [((-0.004, -0.004, -length_m), (0.004, 0.004, 0.0))])


def cooker(rng: VariantRng) -> Solid:
    """An oven under a hob of glass. Slots: carcass, front, steel, worktop, glass, marks."""
    patches = _base(hole=False)
    patches.append(shapes.block((-0.25, -0.285, 0.9), (0.26, 0.285, 0.906), 0.002, 4))
    for x, y, r in (
        (-0.12, -0.14, 0.075),
        (-0.12, 0.14, 0.09),
        (0.12, -0.14, 0.1),
        (0.12, 0.14, 0.075),
    ):
        ring = [
            (r - 0.004, 0.9062),
            (r, 0.9062),
            (r, 0.9066),
            (r - 0.004, 0.9066),
            (r - 0.004, 0.9062),
        ]
        patches.append(shapes.lathe(ring, 36, 5).moved(x, y))
    # Panel with knobs, door with a window and a bar, drawer below; gaps between them are dark.
    x = _X + 0.02
    glassy = rng.turn((True, False), "glass_hob")
    patches += [
        shapes.block((_X - 0.01, -0.296, 0.1), (_X + 0.004, 0.296, 0.858), 0.0, 4),
        shapes.block((_X, -0.297, 0.742), (x, 0.297, 0.856), 0.004, 2),
        shapes.block((_X, -0.297, 0.262), (x, 0.297, 0.737), 0.005, 4 if glassy else 2),
        shapes.block((_X, -0.297, 0.105), (x, 0.297, 0.257), 0.004, 2),
        shapes.block((x, -0.245, 0.335), (x + 0.003, 0.245, 0.625), 0.0015, 4),
        *(shapes.block(low, high, 0.001, 2) for low, high in _rim(x, 0.25, 0.33, 0.63)),
        rod((x + 0.034, -0.26, 0.69), (x + 0.034, 0.26, 0.69), 0.009, 2, 14),
        *(rod((x, s * 0.235, 0.69), (x + 0.034, s * 0.235, 0.69), 0.007, 2, 10) for s in (-1, 1)),
        # A clock between the knobs.
        shapes.block((x, -0.05, 0.785), (x + 0.001, 0.05, 0.815), 0.0, 4),
    ]
    for k in (-3, -2, -1, 1, 2, 3):
        y = 0.075 * k + (0.02 if k > 0 else -0.02)
        knob = [
            (0.0, 0.0),
            (0.021, 0.0),
            (0.021, 0.003),
            (0.017, 0.004),
            (0.0155, 0.022),
            (0.013, 0.025),
            (0.0, 0.025),
        ]
        turned = shapes.lathe(knob, 24, 4 if not glassy else 2)
        patches.append(turned.rotated("y", 0.5 * np.pi).moved(x, y, 0.8))
        mark = shapes.block((0.0245, -0.001, 0.0), (0.0258, 0.001, 0.013), 0.0, 5)
        turn = rng.between(-2.4, 2.4) if rng.chance(0.25) else 0.0
        patches.append(mark.rotated("x", turn).moved(x, y, 0.8))
    looks = [
        *_looks("kitchen_unit", rng, rng.seed),
        Material((0.012, 0.012, 0.013), 0.06),
        painted_material("#9a9a98", 0.4),
    ]
    return solid(patches, looks, [((-_X, -0.3, 0.0), (_X, 0.3, 0.906))])


def _rim(x: float, half_y: float, z0: float, z1: float) -> list[Box]:
    """Four thin bars around a window before a front at ``x``."""
    t, d = 0.006, 0.0045
    return [
        ((x, -half_y, z0), (x + d, half_y, z0 + t)),
        ((x, -half_y, z1 - t), (x + d, half_y, z1)),
        ((x, -half_y, z0 + t), (x + d, -half_y + t, z1 - t)),
        ((x, half_y - t, z0 + t), (x + d, half_y, z1 - t)),
    ]


def _base(*, hole: bool) -> list[Patch]:
    carcass: Box = ((-_X, -0.3, 0.1), (_X, 0.3, 0.715 if hole else 0.86))
    return [
        board(*carcass),
        board((-_X + 0.02, -0.3, 0.0), (_X - 0.05, 0.3, 0.1)),
        *(
            [
                board((-_X, -0.3, 0.715), (-_X + 0.018, 0.3, 0.86)),
                board((_X - 0.018, -0.3, 0.715), (_X, 0.3, 0.86)),
            ]
            if hole
            else []
        ),
        *(shapes.block(*b, 0.002, 3) for b in _worktop(hole=hole)),
    ]


def _worktop(*, hole: bool) -> list[Box]:
    if not hole:
        return [((-_X, -0.3, 0.86), (_X + 0.03, 0.3, 0.9))]
    return [
        ((-_X, -0.3, 0.86), (-0.17, 0.3, 0.9)),
        ((0.19, -0.3, 0.86), (_X + 0.03, 0.3, 0.9)),
        ((-0.17, -0.3, 0.86), (0.19, -0.2, 0.9)),
        ((-0.17, 0.2, 0.86), (0.19, 0.3, 0.9)),
    ]


def range_hood(rng: VariantRng) -> Solid:
    """A hood over a cooker; origin at the middle below. Slot: body."""
    d, h = rng.between(0.44, 0.5, "depth_m"), rng.between(0.5, 0.7, "height_m")
    low: Box = ((-0.5 * d, -0.3, 0.0), (0.5 * d, 0.3, 0.06))
    duct: Box = ((-0.5 * d, -0.14, 0.06), (-0.5 * d + 0.26, 0.14, h))
    paint = brushed_steel(rng.seed) if rng.chance(0.7) else painted_material("#1f2022", 0.25)
    return solid([shapes.block(*low, 0.006), shapes.block(*duct, 0.004)], [paint], [low, duct])


def toilet(rng: VariantRng) -> Solid:
    """A toilet with cistern or built into the wall. Slots: ceramic, seat."""
    z = rng.between(0.4, 0.44, "seat_m")
    cistern = rng.turn((True, False), "cistern")
    outline = [
        (0.10, 0.0),
        (0.13, 0.05),
        (0.12, 0.15),
        (0.16, 0.3),
        (0.185, z - 0.03),
        (0.185, z),
        (0.13, z),
        (0.1, z - 0.14),
        (0.0, z - 0.2),
    ]
    bowl = shapes.lathe([(0.0, 0.0), *outline], 36).scaled(1.35, 1.0, 1.0).moved(0.1)
    profile = [(0.12, z), (0.19, z), (0.19, z + 0.018), (0.12, z + 0.018), (0.12, z)]
    seat = shapes.lathe(profile, 36, 1)
    patches: list[Patch] = [bowl, seat.scaled(1.35, 1.0, 1.0).moved(0.1)]
    x = -0.35
    patches.append(shapes.block((x, -0.1, 0.08), (0.0, 0.1, z - 0.06), 0.03))
    closed = rng.chance(0.5, "closed")
    oval = [(0.0, 0.0), (0.19, 0.0), (0.19, 0.014), (0.0, 0.02)]
    lid = shapes.lathe(oval, 36, 1).scaled(1.35, 1.0, 1.0)
    if closed:
        patches.append(lid.moved(0.1, 0.0, z + 0.018))
    else:
        patches.append(lid.moved(0.26).rotated("y", -1.75).moved(-0.15, 0.0, z + 0.02))
    boxes: list[Box] = [((x, -0.19, 0.0), (0.35, 0.19, z + 0.03))]
    if cistern:
        tank: Box = ((x, -0.19, z - 0.02), (x + 0.17, 0.19, z + 0.36))
        patches += [shapes.block(*tank, 0.02), disc(x + 0.085, 0.0, z + 0.36, z + 0.37, 0.025, 1)]
        boxes.append(tank)
    return solid(patches, [ceramic(), painted_material("#f4f3f0", 0.25)], boxes)


def wash_basin(rng: VariantRng) -> Solid:
    """A basin on a cupboard. Slots: ceramic, front, steel."""
    d, w = rng.between(0.42, 0.5, "depth_m"), rng.turn((0.5, 0.6, 0.8), "width_m")
    x, y, z = 0.5 * d, 0.5 * w, 0.86
    height = rng.between(0.1, 0.18, "tap_m")
    rim: list[Box] = [
        ((-x, -y, z - 0.095), (-x + 0.13, y, z)),
        ((x - 0.04, -y, z - 0.095), (x, y, z)),
        ((-x + 0.13, -y, z - 0.095), (x - 0.04, -y + 0.05, z)),
        ((-x + 0.13, y - 0.05, z - 0.095), (x - 0.04, y, z)),
    ]
    low: Box = ((-x + 0.13, -y + 0.05, z - 0.1), (x - 0.04, y - 0.05, z - 0.09))
    chest: Box = ((-x, -y + 0.02, 0.25), (x - 0.03, y - 0.02, z - 0.095))
    patches = [
        *(shapes.block(*b, 0.012) for b in rim),
        shapes.block(*low),
        board(*chest, 1),
        board((x - 0.03, -y + 0.022, 0.254), (x - 0.012, -0.002, z - 0.1), 1),
        board((x - 0.03, 0.002, 0.254), (x - 0.012, y - 0.022, z - 0.1), 1),
        *handle(x - 0.012, -0.05, z - 0.2, 0.12, 2, upright=True),
        *handle(x - 0.012, 0.05, z - 0.2, 0.12, 2, upright=True),
        *tap(-x + 0.07, 0.0, z, height, 2),
    ]
    made = solid(patches, [ceramic(), front(rng), _CHROME], [((-x, -y, 0.25), (x, y, z))])
    made = _with_water(made, (-x + 0.07, 0.0, z), height, z - 0.09)
    # The rim behind the bowl, next to the tap.
    rim_m = (-x + 0.012, 0.08, z), (-x + 0.12, y - 0.012, z)
    supports = tuple(Keypoint(SUPPORT, corner) for corner in rim_m)
    return replace(made, keypoints=(*made.keypoints, *supports))


def bathtub(rng: VariantRng) -> Solid:
    """A bathtub. Slots: ceramic, panel, steel."""
    d = rng.turn((0.7, 0.75, 0.8), "depth_m")
    w = rng.turn((1.6, 1.7, 1.8), "width_m")
    z = rng.between(0.52, 0.58, "height_m")
    x, y = 0.5 * d, 0.5 * w
    outer = shapes.rounded_box((d, w, z), 0.03, 2).moved(0.0, 0.0, 0.5 * z)
    # The upper side is open: a rim around an inner shell.
    keep = outer.corners_m[:, :, 2].min(axis=1) < z - 0.031
    shell = type(outer)(outer.corners_m[keep], outer.uvs[keep], outer.slots[keep])
    rim: list[Box] = [
        ((-x, -y, z - 0.04), (-x + 0.07, y, z)),
        ((x - 0.07, -y, z - 0.04), (x, y, z)),
        ((-x + 0.07, -y, z - 0.04), (x - 0.07, -y + 0.14, z)),
        ((-x + 0.07, y - 0.09, z - 0.04), (x - 0.07, y, z)),
    ]
    inner: list[Box] = [
        ((-x + 0.07, -y + 0.14, 0.14), (x - 0.07, y - 0.09, 0.15)),
        ((-x + 0.06, -y + 0.13, 0.14), (-x + 0.07, y - 0.08, z - 0.01)),
        ((x - 0.07, -y + 0.13, 0.14), (x - 0.06, y - 0.08, z - 0.01)),
        ((-x + 0.06, -y + 0.13, 0.14), (x - 0.06, -y + 0.14, z - 0.01)),
        ((-x + 0.06, y - 0.09, 0.14), (x - 0.06, y - 0.08, z - 0.01)),
    ]
    patches = [
        shell.painted(1),
        *(shapes.block(*b, 0.015) for b in rim),
        *(shapes.block(*b, 0.0) for b in inner),
    ]
    patches += tap(-x + 0.05, 0.0, z, 0.12, 2)
    made = solid(patches, [ceramic(), ceramic(0.2), _CHROME], [((-x, -y, 0.0), (x, y, z))])
    return _with_water(made, (-x + 0.05, 0.0, z), 0.12, 0.15)


def shower(rng: VariantRng) -> Solid:
    """A shower: tray, pole with head, and panes of glass. Slots: ceramic, steel, glass."""
    d = rng.turn((0.8, 0.9, 1.0), "width_m")
    x = 0.5 * d
    tray: Box = ((-x, -x, 0.0), (x, x, 0.06))
    patches: list[Patch] = [shapes.block(*tray, 0.012)]
    pane = Material((0.94, 0.97, 0.96), 0.03, transmission=1.0, role="glass")
    sides: list[Box] = [
        ((-x, x - 0.008, 0.06), (x, x, 1.95)),
        ((x - 0.008, 0.0, 0.06), (x, x - 0.008, 1.95)),
    ]
    patches += [shapes.block(*b, 0.0, 2) for b in sides]
    patches += [
        shapes.block((b[0][0], b[0][1] - 0.004, 1.94), (b[1][0], b[1][1] + 0.004, 1.97), 0.002, 1)
        for b in sides
    ]
    patches += [
        rod((-x + 0.06, 0.0, 0.9), (-x + 0.06, 0.0, 2.05), 0.011, 1),
        rod((-x + 0.06, 0.0, 2.05), (-x + 0.34, 0.0, 2.05), 0.011, 1),
        disc(-x + 0.34, 0.0, 2.02, 2.04, rng.between(0.08, 0.13), 1, 32),
        shapes.block((-x, -0.13, 1.0), (-x + 0.06, 0.13, 1.05), 0.02, 1),
    ]
    return solid(patches, [ceramic(), _CHROME, pane], [tray, *sides])
