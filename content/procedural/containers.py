"""Open containers for piles: crates, stands of slanted crates, bowls, bags and sinks."""

import math

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.furniture import check_size, rounded_loop
from gen_data.content.procedural.material_presets import (
    PLASTICS,
    STAINLESS,
    ceramic_material,
    metal_material,
    painted_material,
    patterned_material,
)
from gen_data.content.procedural.patches import Array, make_solid_in_place, rotate
from gen_data.core.asset_types import Material, Symmetry
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng, in_turn, variant_rng

_WALL_M = 0.012
_FOOT_M = 0.008


def crate(size_m: Vec3 = (0.5, 0.34, 0.2), seed: int = 0) -> Solid:
    """An open crate of slats, as for fruit. Slot: body.

    Args:
        size_m: Outer length, width, height.
        seed: Seed of its wood or plastic.
    """
    boxes = _crate_boxes(check_size("open_crate", size_m, 0.06))
    patches = [shapes.map_along_grain(shapes.block(*b, 0.0015), 0.5) for b in boxes]
    return make_solid_in_place(patches, (_crate_look(seed),), [hulls.box(*b) for b in boxes])


def _crate_boxes(size_m: Vec3) -> list[tuple[Vec3, Vec3]]:
    """Opposite corners of its floor, slats and posts [m]."""
    x, y, z = size_m
    rows = max(2, round(z / 0.075))
    boxes: list[tuple[Vec3, Vec3]] = [((-x / 2, -y / 2, 0.0), (x / 2, y / 2, _WALL_M))]
    for k in range(rows):
        low, high = k * z / rows + (0.0 if k else _WALL_M), (k + 1) * z / rows - 0.012
        for side in (-1, 1):
            a, b = sorted((side * x / 2, side * (x / 2 - _WALL_M)))
            boxes.append(((a, -y / 2, low), (b, y / 2, high)))
            a, b = sorted((side * y / 2, side * (y / 2 - _WALL_M)))
            boxes.append(((-x / 2 + _WALL_M, a, low), (x / 2 - _WALL_M, b, high)))
    w = 0.03
    for sx in (-1, 1):
        for sy in (-1, 1):
            px, py = sx * (x / 2 - _WALL_M - w / 2), sy * (y / 2 - _WALL_M - w / 2)
            boxes.append(((px - w / 2, py - w / 2, _WALL_M), (px + w / 2, py + w / 2, z - 0.012)))
    return boxes


def _crate_look(seed: int) -> Material:
    rng = variant_rng("open_crate", seed)
    if in_turn((True, True, False), seed):
        return patterned_material(f"texture/wood_grain?seed={seed % 18}", 0.0, 0.75)
    return painted_material(rng.choose(PLASTICS), 0.45)


def crate_interior_m(size_m: Vec3) -> Vec3:
    """Length and width of its floor between the walls, and its height above the ground."""
    return (size_m[0] - 2 * _WALL_M, size_m[1] - 2 * _WALL_M, _WALL_M)


def bowl(size_m: Vec3 = (0.28, 0.28, 0.09), seed: int = 0) -> Solid:
    """A round bowl, as for fruit. Slot: body.

    Args:
        size_m: Diameter, twice, and height.
        seed: Seed of its wood or glaze.
    """
    x, y, z = check_size("serving_bowl", size_m, 0.04)
    r, t = 0.5 * min(x, y), 0.006
    # A quarter of an ellipse from the foot to the rim.
    turns = [k * math.pi / 16 for k in range(9)]
    outer = [(r * (0.45 + 0.55 * math.sin(a)), z * (1.0 - math.cos(a))) for a in turns]
    inner = [(radius - t, max(high + 0.3 * t, _FOOT_M)) for radius, high in outer[::-1]]
    profile = [(0.0, 0.0), *outer, (r - 0.5 * t, z + 0.003), *inner, (0.0, _FOOT_M)]
    rings = [
        part
        for (ra, za), (rb, zb) in zip(outer[0:-1:2], outer[2::2], strict=True)
        for part in hulls.ring((ra - t, ra, za), (rb - t, rb, zb), 14)
    ]
    floor = hulls.frustum((outer[0][0], 0.0), (outer[0][0], _FOOT_M))
    return make_solid_in_place([shapes.lathe(profile, 56)], (_bowl_look(seed),), [floor, *rings])


def _bowl_look(seed: int) -> Material:
    rng = variant_rng("serving_bowl", seed)
    if in_turn((False, True, False), seed):
        return patterned_material(f"texture/wood_grain?seed={seed % 18}", 0.0, 0.4)
    return ceramic_material(rng)


def bowl_interior_m(size_m: Vec3) -> Vec3:
    """Sides of the square in its mouth's circle, and the height of its floor."""
    side = math.sqrt(0.5) * min(size_m[:2])
    return (side, side, _FOOT_M)


def bowl_symmetries(size_m: Vec3 = (0.28, 0.28, 0.09), seed: int = 0) -> tuple[Symmetry, ...]:
    """Any turn about its axis, unless the grain of wood shows it."""
    if _bowl_look(seed).texture:
        return ()
    return (Symmetry((0.0, 0.0, 1.0), 0, (0.0, 0.0, 0.5 * size_m[2])),)


_TIERS, _TILT_RAD = 3, math.radians(16.0)
"""Crates of a market stand, and their slope (assumed)."""


def market_stand(size_m: Vec3 = (0.9, 0.8, 0.6), seed: int = 0) -> Solid:
    """Crates that slope towards -Y, one above and behind another, on blocks. Slots: crates, base.

    Args:
        size_m: Length, depth and height.
        seed: Seed of the crates' wood or plastic.
    """
    size_m = check_size("market_stand", size_m, 0.3)
    patches, parts = [], []
    for (_, y, z), tilt, (length, width) in market_tiers(size_m):
        crate_m = (length + 2 * _WALL_M, width + 2 * _WALL_M, 0.09)
        for low, high in _crate_boxes(crate_m):
            board = shapes.map_along_grain(shapes.block(low, high, 0.0015), 0.5)
            patches.append(board.moved(z=-_WALL_M).rotated("x", tilt).moved(y=y, z=z))
            part = hulls.box(low, high) - np.array([0.0, 0.0, _WALL_M])
            parts.append(rotate(part, "x", tilt) + np.array([0.0, y, z]))
        under = z - 0.5 * crate_m[1] * math.sin(tilt) - 0.02
        block = ((-0.46 * size_m[0], y - 0.1, 0.0), (0.46 * size_m[0], y + 0.1, under))
        patches.append(shapes.map_along_grain(shapes.block(*block, 0.002, 1), 0.5))
        parts.append(hulls.box(*block))
    base = patterned_material(f"texture/wood_grain?seed={seed % 18}", 0.0, 0.6)
    return make_solid_in_place(patches, (_crate_look(seed), base), parts)


Tier = tuple[Vec3, float, tuple[float, float]]


def market_tiers(size_m: Vec3) -> tuple[Tier, ...]:
    """Of each crate the middle of its floor, its slope about X [rad], and length and width."""
    x, y, z = size_m
    pitch = y / _TIERS
    width = pitch / math.cos(_TILT_RAD) - 2 * _WALL_M
    low = 0.5 * pitch * math.tan(_TILT_RAD) + 0.04
    rise = (z - low - 0.16) / (_TIERS - 1)
    return tuple(
        ((0.0, (k + 0.5) * pitch - 0.5 * y, low + k * rise), _TILT_RAD, (x - 2 * _WALL_M, width))
        for k in range(_TIERS)
    )


def shopping_bag(size_m: Vec3 = (0.36, 0.2, 0.22), seed: int = 0) -> Solid:
    """An open bag of cloth or paper, creased, with two handles. Slot: body.

    Args:
        size_m: Length, width and height of its wall.
        seed: Seed of its creases and material.
    """
    x, y, z = check_size("shopping_bag", size_m, 0.1)
    rng = variant_rng("shopping_bag", seed)
    levels = np.linspace(0.0, 1.0, 9)
    waves = [
        (rng.between(2.0, 7.0), rng.between(0.0, 6.3), rng.between(3.0, 9.0)) for _ in range(4)
    ]
    turn = np.linspace(0.0, 2.0 * math.pi, 65)

    def wall(inset: float) -> Array:
        rows = []
        for level in levels:
            crease = sum(np.sin(round(f) * turn + p + g * level) for f, p, g in waves)
            swell = 1.0 - 0.06 + 0.012 * crease * (0.3 + level) + 0.02 * math.sin(math.pi * level)
            c, s = np.cos(turn), np.sin(turn)
            # A superellipse: nearly a rectangle with rounded corners.
            r = (np.abs(c) ** 6 + np.abs(s) ** 6) ** (-1.0 / 6.0) * swell
            row = [(0.5 * x - inset) * r * c, (0.5 * y - inset) * r * s]
            rows.append(np.stack([*row, np.full_like(turn, inset + (z - inset) * level)], axis=1))
        return np.array(rows)

    outside, inside = wall(0.0), wall(_CLOTH_M)
    rim = np.array([outside[-1], inside[-1]])
    patches = [shapes.grid(outside), shapes.grid(rim), shapes.grid(inside[::-1]),
               shapes.fan(outside[0, :0:-1]), shapes.fan(inside[0, :-1])]  # fmt: skip
    for side in (-1, 1):
        low, high = (side * 0.46 * y, 0.9 * z), (side * 0.6 * y, 1.3 * z)
        arch = [(-0.2 * x, *low), (-0.16 * x, *high), (0.16 * x, *high), (0.2 * x, *low)]
        path = shapes.space_evenly(shapes.spline(arch, 32), 15)
        section = shapes.circle(1.0, 8) * np.array([0.011, 0.002])
        patches.append(shapes.sweep(path, section, up=(1.0, 0.0, 0.0)))
    boxes = _wall_boxes(0.94 * x, 0.94 * y, z, _CLOTH_M)
    return make_solid_in_place(patches, (_bag_look(rng),), [hulls.box(*b) for b in boxes])


_CLOTH_M = 0.004


def _wall_boxes(x: float, y: float, z: float, wall: float) -> list[tuple[Vec3, Vec3]]:
    """Opposite corners of a floor and of four walls, which reach outward [m]."""
    out = 0.02
    return [
        ((-x / 2, -y / 2, 0.0), (x / 2, y / 2, wall)),
        ((-x / 2 - out, -y / 2 - out, 0.0), (-x / 2 + wall, y / 2 + out, z)),
        ((x / 2 - wall, -y / 2 - out, 0.0), (x / 2 + out, y / 2 + out, z)),
        ((-x / 2, -y / 2 - out, 0.0), (x / 2, -y / 2 + wall, z)),
        ((-x / 2, y / 2 - wall, 0.0), (x / 2, y / 2 + out, z)),
    ]


def _bag_look(rng: VariantRng) -> Material:
    if rng.chance(0.35):
        return painted_material(rng.choose(("#b1875a", "#a67c50", "#efece4")), 0.85)
    cloth = f"texture/fabric?seed={int(rng.between(0, 16))}"
    return patterned_material(cloth, 0.0, 0.95)


def bag_interior_m(size_m: Vec3) -> Vec3:
    """Length and width of its floor, and its height."""
    return (0.94 * size_m[0] - 2 * _CLOTH_M, 0.94 * size_m[1] - 2 * _CLOTH_M, _CLOTH_M)


_BASIN_M = (0.5, 0.38)
"""Length and width of a basin."""
_UNDER_M = 0.01


def sink(size_m: Vec3 = (1.2, 0.6, 0.2), seed: int = 0) -> Solid:
    """A worktop with a basin and a tap behind it. Slots: worktop, basin, tap.

    Args:
        size_m: Length, depth, and height of the worktop above its support.
        seed: Seed of the worktop and of the basin's steel or glaze.
    """
    x, y, z = check_size("sink", size_m, 0.12)
    (length, width), rng = _BASIN_M, variant_rng("sink", seed)
    top = [
        ((-x / 2, -y / 2, 0.0), (-length / 2, y / 2, z)),
        ((length / 2, -y / 2, 0.0), (x / 2, y / 2, z)),
        ((-length / 2, -y / 2, 0.0), (length / 2, -width / 2, z)),
        ((-length / 2, width / 2, 0.0), (length / 2, y / 2, z)),
        ((-length / 2, -width / 2, 0.0), (length / 2, width / 2, 0.5 * _UNDER_M)),
    ]  # fmt: skip
    levels = [(-0.022, z, 0.05), (-0.021, z + 0.003, 0.05), (0.0, z + 0.003, 0.045),
              (0.006, z - 0.004, 0.045), (0.012, 0.05, 0.05), (0.03, _UNDER_M, 0.06)]  # fmt: skip
    loops = [rounded_loop(length / 2 - inset, width / 2 - inset, r, h) for inset, h, r in levels]
    rows = np.stack([np.concatenate([loop, loop[:1]]) for loop in loops])
    drain = shapes.cone((0.042, _UNDER_M), (0.038, _UNDER_M + 0.003), 24, 2)
    foot = width / 2 + 0.06
    neck = [(0.0, foot, z), (0.0, foot, z + 0.2), (0.0, foot - 0.05, z + 0.27),
            (0.0, foot - 0.14, z + 0.26), (0.0, foot - 0.17, z + 0.2)]  # fmt: skip
    path = shapes.space_evenly(shapes.spline(neck, 48), 25)
    tap = shapes.sweep(path, shapes.circle(0.0125, 14), up=(1.0, 0.0, 0.0), slot=2)
    lever = shapes.block(
        (0.012, foot - 0.008, z + 0.06), (0.075, foot + 0.008, z + 0.072), 0.003, 2
    )
    patches = [
        *(shapes.map_along_grain(shapes.block(*b, 0.0015), 0.5) for b in top),
        shapes.grid(rows, slot=1), shapes.fan(loops[-1], 1), drain, tap, lever,
    ]  # fmt: skip
    steel = metal_material(STAINLESS, 0.3)
    stone = f"texture/{rng.choose(('granite', 'wood_grain', 'marble'))}?seed={seed % 16}"
    basin = steel if rng.chance(0.65) else ceramic_material(rng, ("#f1efe9", "#e6e4de", "#3a3c40"))
    materials = (patterned_material(stone, 0.0, 0.35), basin, metal_material(STAINLESS, 0.16))
    floor = ((-length / 2, -width / 2, 0.0), (length / 2, width / 2, _UNDER_M))
    parts = [hulls.box(*b) for b in (*top[:4], floor)]
    return make_solid_in_place(patches, materials, [*parts, *hulls.tube(path[::6], 0.0125)])


def sink_interior_m(size_m: Vec3) -> Vec3:
    """Length and width of the basin's floor, and its height."""
    del size_m
    return (_BASIN_M[0] - 0.06, _BASIN_M[1] - 0.06, _UNDER_M)
