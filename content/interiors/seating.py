"""Seats, beds and tables. Usual sizes of furniture on sale, assumed."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.interiors.parts import (
    Box,
    Measures,
    board,
    cushion,
    disc,
    drawn,
    four_legs,
    front,
    lacquer,
    posts,
    rod,
    solid,
    upholstery,
    wood,
)
from gen_data.content.interiors.soft_goods import drape, fabric, padding, pillow
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.material_presets import (
    ALUMINIUM,
    STEEL,
    metal_material,
    painted_material,
)
from gen_data.content.procedural.patches import Patch
from gen_data.core.asset_types import Keypoint
from gen_data.core.keypoint_names import BACKREST, INSIDE, SUPPORT
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng, variant_rng

PIPING_HEIGHT = 0.9
"""Share of a cushion's half height, just below its top, at which objects lie flat."""


def upholstered(family: str, seed: int, measures: Measures) -> Solid:
    """A sofa or an armchair. Slots: cover, legs, pillows. Measures: places and width of each."""
    rng = variant_rng(family, seed)
    places, place_m = drawn(rng, measures).values()
    return _upholstered(rng, places, places * place_m)


def _upholstered(rng: VariantRng, places: int, seat_m: float) -> Solid:
    arm, depth = rng.between(0.12, 0.22, "arm_width_m"), rng.between(0.82, 0.98, "depth_m")
    seat_z = rng.between(0.4, 0.46, "seat_m")
    back_z = rng.between(0.72, 0.9, "back_m")
    leg = rng.between(0.05, 0.15, "leg_m")
    arm_z, soft = rng.between(0.54, 0.64, "armrest_m"), rng.between(0.03, 0.07, "softness_m")
    w, x0, x1 = seat_m + 2 * arm, -0.5 * depth, 0.5 * depth
    y0, y1 = -0.5 * w, 0.5 * w
    base: Box = ((x0 + 0.02, y0 + 0.02, leg), (x1 - 0.03, y1 - 0.02, seat_z - 0.14))
    back: Box = ((x0, y0 + 0.01, leg), (x0 + 0.2, y1 - 0.01, back_z))
    arms: list[Box] = [
        ((x0 + 0.02, y0, leg), (x1, y0 + arm, arm_z)),
        ((x0 + 0.02, y1 - arm, leg), (x1, y1, arm_z)),
    ]
    patches = [cushion(*b, 0, soft) for b in (base, back)]
    patches += [padding(*b, rng, 0, 9.0, 0.002) for b in arms]
    each, piped = seat_m / places, rng.chance(0.45, "piped")
    loose, bulge = rng.chance(0.5), rng.between(4.5, 8.0)
    for k in range(places):
        a = y0 + arm + k * each
        low, high = (x0 + 0.17, a + 0.002, seat_z - 0.16), (x1 + 0.01, a + each - 0.002, seat_z)
        sat_on = _sagged(padding(low, high, rng, 0, 18.0, 0.001), rng.between(0.0, 0.003))
        patches.append(sat_on)
        if piped:
            patches += _piping(low, high, 18.0)
        rest = padding(
            (-0.1, -0.5 * each + 0.006, -0.5 * (back_z + 0.08 - seat_z)),
            (0.1, 0.5 * each - 0.006, 0.5 * (back_z + 0.08 - seat_z)),
            rng,
            0,
            bulge,
            0.008,
        )
        # Loose cushions lean, each in its own way.
        lean = -rng.between(0.12, 0.24) if loose else -0.12
        aside = rng.between(-0.03, 0.03) if loose else 0.0
        turned = rest.rotated("x", aside).rotated("y", lean)
        patches.append(turned.moved(x0 + 0.24, a + 0.5 * each, 0.5 * (seat_z + back_z + 0.06)))
    patches += _pillows(rng, places, (x0 + 0.37, y0 + arm + 0.2, seat_z))
    beside = arm + soft
    if rng.chance(0.35):
        side = rng.choose((-1, 1))
        # Its folds reach over the seat.
        beside += 0.06
        at = rng.between(-0.3, 0.05) * depth
        throw = drape(
            (at, at + rng.between(0.3, 0.5)), 0.5 * arm + 0.006, arm_z + 0.022, 0.13, rng, 3, 0.006
        )
        patches.append(throw.moved(0.0, side * (0.5 * w - 0.5 * arm), 0.0))
    patches += [
        disc(*at, 0.0, leg + 0.02, 0.02, 1)
        for at in shapes.at_corners(0.5 * depth - 0.09, 0.5 * w - 0.09)
    ]
    seat: Box = ((x0 + 0.17, y0 + arm, leg), (x1, y1 - arm, seat_z))
    looks = [upholstery(rng), wood(rng), fabric(rng, 0.3), fabric(rng, 0.4)]
    made = solid(patches, looks, [base, back, *arms, seat])
    # Before the pillows, and clear of the round edges of the cushions.
    corners = (x0 + 0.54, y0 + beside, seat_z), (x1 - soft, y1 - beside, seat_z)
    return replace(made, keypoints=tuple(Keypoint(SUPPORT, corner) for corner in corners))


def _pillows(rng: VariantRng, places: int, corner: Vec3) -> list[Patch]:
    """Loose pillows that lean on the backs of seats, from ``corner`` to its mirror image."""
    x, y0, seat_z = corner
    pillows = []
    for _ in range(int(rng.between(0, places + 1.6))):
        y = rng.between(y0, -y0) if places > 1 else 0.0
        size = rng.between(0.19, 0.25)
        lying = pillow(size, size * rng.between(0.75, 1.0), 0.15, rng, 2)
        skew = lying.rotated("z", rng.between(-0.3, 0.3)).moved(0.0, 0.0, -0.05)
        standing = skew.rotated("y", rng.between(1.25, 1.42)).rotated("z", rng.between(-0.35, 0.35))
        pillows.append(standing.moved(x, y, seat_z + 0.9 * size))
    return pillows


def _sagged(patch: Patch, depth_m: float) -> Patch:
    p = patch.corners_m.copy()
    low, high = patch.bounds_m()
    u, v, w = (2.0 * (p[..., i] - low[i]) / (high[i] - low[i]) - 1.0 for i in range(3))
    hollow = np.exp(-2.5 * (u * u + v * v)) - 0.1
    p[..., 2] -= depth_m * np.maximum(hollow, 0.0) * (w > 0.0)
    return replace(patch, corners_m=p)


def _piping(low: Vec3, high: Vec3, power: float) -> list[Patch]:
    """A cord along the upper edge of a cushion made by ``padding``, on its superellipsoid."""
    turn = np.linspace(0.0, 2.0 * math.pi, 73)
    c, s = np.cos(turn), np.sin(turn)
    around = ((1.0 - PIPING_HEIGHT**power) / (np.abs(c) ** power + np.abs(s) ** power)) ** (
        1.0 / power
    )
    unit = np.stack([around * c, around * s, np.full_like(turn, PIPING_HEIGHT)], axis=1)
    middle, half = 0.5 * np.add(high, low), 0.5 * np.subtract(high, low)
    return [shapes.sweep(middle + half * unit, shapes.circle(0.0055, 6), capped=False)]


def _bent(patch: Patch, wrap_per_m: float, lumbar_m: float) -> Patch:
    """A back along Y and Z, its sides and the small of its back brought forward."""
    p = patch.corners_m.copy()
    low, high = patch.bounds_m()
    v = (p[..., 2] - low[2]) / (high[2] - low[2])
    p[..., 0] += wrap_per_m * p[..., 1] ** 2 + lumbar_m * np.exp(-(((v - 0.3) / 0.22) ** 2))
    return replace(patch, corners_m=p)


def chair(rng: VariantRng) -> Solid:
    """A chair for tables, wooden, upholstered or a shell on steel. Slots: seat, legs."""
    w = rng.between(0.4, 0.48, "width_m")
    d = rng.between(0.42, 0.48, "depth_m")
    z = rng.between(0.44, 0.47, "seat_m")
    back_z = rng.between(0.8, 0.98, "back_m")
    kind = rng.turn(("wood", "upholstered", "shell"), "kind")
    soft, back = kind == "upholstered", kind != "wood"
    seat: Box = ((-0.5 * d, -0.5 * w, z - (0.06 if soft else 0.025)), (0.5 * d, 0.5 * w, z))
    patches = [padding(*seat, rng, 0, 6.0, 0.003) if soft else board(*seat, 0, 0.008)]
    x = -0.5 * d + 0.02
    legs = 1 if back else 0
    for sy in (-1, 1):
        y = sy * (0.5 * w - 0.03)
        patches.append(rod((0.5 * d - 0.03, y, z - 0.02), (0.5 * d, 1.03 * y, 0.0), 0.014, legs))
        patches.append(rod((x, y, z - 0.02), (x - 0.04, 1.03 * y, 0.0), 0.014, legs))
        patches.append(rod((x, y, z - 0.03), (x - 0.07, y, back_z), 0.012, legs))
    if back:
        rest: Box = (
            (-0.02, -0.5 * w, -0.5 * (back_z - z) + 0.1),
            (0.02, 0.5 * w, 0.5 * (back_z - z)),
        )
        panel = padding(*rest, rng, 0, 6.0, 0.003) if soft else cushion(*rest, 0, 0.02)
        patches.append(
            _bent(panel, 0.5, 0.012)
            .rotated("y", -0.14)
            .moved(x - 0.045, 0.0, 0.5 * (z + back_z) + 0.02)
        )
    else:
        for k in range(rng.turn((2, 3), "slats")):
            h = back_z - 0.05 - 0.13 * k
            lean = x - 0.07 * (h - z) / (back_z - z)
            patch = board(
                (lean - 0.009, -0.5 * w + 0.02, h - 0.035),
                (lean + 0.009, 0.5 * w - 0.02, h + 0.035),
                0,
                0.006,
            )
            patches.append(patch)
    steel = metal_material(STEEL, 0.35) if rng.chance(0.5) else painted_material("#26282b", 0.4)
    body = upholstery(rng) if soft else (wood(rng) if rng.chance(0.65) else lacquer(rng))
    boxes: list[Box] = [seat, ((x - 0.08, -0.5 * w, z), (x + 0.01, 0.5 * w, back_z))]
    boxes += _legs_under(d, w, z)
    made = solid(patches, [body, wood(rng) if legs and soft else steel if legs else body], boxes)
    edge = (x - 0.075, 0.0, back_z + (0.015 if back else 0.0))
    # Before the back, and clear of the round edges of cushions.
    corners = (-0.5 * d + 0.08, -0.5 * w + 0.03, z), (0.5 * d - 0.03, 0.5 * w - 0.03, z)
    supports = tuple(Keypoint(SUPPORT, corner) for corner in corners)
    return replace(made, keypoints=(*supports, Keypoint(BACKREST, edge)))


def stool(rng: VariantRng) -> Solid:
    """A stool, low or at bar height. Slots: seat, legs."""
    z = rng.turn((0.45, 0.65), "seat_m") + rng.between(-0.02, 0.02)
    r = rng.between(0.15, 0.19, "radius_m")
    patches = [disc(0, 0, z - 0.035, z, r, 0, 32)]
    for k in range(4):
        a = 0.25 * math.pi * (2 * k + 1)
        c, s = math.cos(a), math.sin(a)
        patches.append(
            rod((0.7 * r * c, 0.7 * r * s, z - 0.03), (1.05 * r * c, 1.05 * r * s, 0.0), 0.014, 1)
        )
    looks = [front(rng), wood(rng)]
    return solid(patches, looks, [((-0.7 * r, -0.7 * r, 0.0), (0.7 * r, 0.7 * r, z))])


def office_chair(rng: VariantRng) -> Solid:
    """A swivel chair on five castors. Slots: cover, base."""
    w, z = rng.between(0.46, 0.52, "width_m"), rng.between(0.44, 0.52, "seat_m")
    top = z + rng.between(0.48, 0.7)
    high, half = top - z - 0.08, 0.46 * w
    seat = padding((-0.24, -0.5 * w, z - 0.075), (0.27, 0.5 * w, z), rng, 0, 5.0, 0.003)
    mesh = rng.chance(0.4, "mesh")
    thin = 0.014 if mesh else 0.034
    rest = padding((-thin, -half, 0.0), (thin, half, high), rng, 0, 5.0, 0.003)
    bend = rng.between(0.7, 1.3), rng.between(0.025, 0.045)
    shell = padding(
        (-thin - 0.016, -0.9 * half, 0.02), (-0.4 * thin, 0.9 * half, 0.9 * high), rng, 1, 5.0, 0.0
    )
    patches = [
        _sagged(seat, 0.012),
        *(
            _bent(part, *bend).rotated("y", -0.14).moved(-0.25, 0.0, z + 0.08)
            for part in ((rest,) if mesh else (rest, shell))
        ),
        rod((0.0, 0.0, 0.1), (0.0, 0.0, z - 0.07), 0.026, 1),
        rod((-0.1, 0.0, z - 0.09), (-0.27, 0.0, z - 0.03), 0.022, 1),
        rod((-0.27, 0.0, z - 0.03), (-0.33, 0.0, z + 0.3), 0.02, 1),
        shapes.block((-0.17, -0.1, z - 0.1), (0.14, 0.1, z - 0.06), 0.012, 1),
        rod((0.0, 0.0, 0.09), (0.0, 0.0, 0.26), 0.036, 1, 16),
    ]
    for k in range(5):
        a = 2.0 * math.pi * k / 5 + 0.3
        c, s = 0.29 * math.cos(a), 0.29 * math.sin(a)
        arm = np.array([(0.0, 0.0, 0.115), (0.5 * c, 0.5 * s, 0.105), (c, s, 0.07)])
        taper = np.linspace(1.25, 0.8, 8)
        path = shapes.spline(arm.tolist(), 8)
        patches.append(shapes.sweep(path, shapes.circle(0.018, 10), scale=taper, slot=1))
        for wheel in (-0.02, 0.008):
            patches.append(rod((c, s + wheel, 0.028), (c, s + wheel + 0.014, 0.028), 0.028, 1, 16))
    if rng.chance(0.7):
        for sy in (-1, 1):
            y = sy * (0.5 * w + 0.03)
            patch = cushion((-0.12, y - 0.03, z + 0.18), (0.14, y + 0.03, z + 0.215), 1, 0.015)
            patches.append(patch)
            patches.append(rod((0.0, y, z + 0.19), (0.0, y, z - 0.06), 0.014, 1))
            patches.append(rod((0.0, y, z - 0.06), (0.0, 0.3 * y, z - 0.07), 0.014, 1))
    dark = painted_material("#1d1e20", 0.5) if rng.chance(0.7) else metal_material(ALUMINIUM, 0.3)
    boxes: list[Box] = [
        ((-0.28, -0.28, 0.0), (0.28, 0.28, z)),
        ((-0.32, -0.23, z), (-0.2, 0.23, top)),
    ]
    made = solid(patches, [upholstery(rng), dark], boxes)
    edge = (-0.25 - 0.14 * high, 0.0, z + 0.08 + 0.99 * high)
    return replace(made, keypoints=(Keypoint(BACKREST, edge),))


def table(
    family: str,
    seed: int,
    sides: Measures | None = None,
    round_top: Measures | None = None,
    round_in_turn: Sequence[bool] = (),
) -> Solid:
    """A table with a rectangular top, a round one, or either in turn. Slots: top, legs."""
    rng = variant_rng(family, seed)
    is_round = rng.turn(tuple(round_in_turn), "round_top") if round_in_turn else not sides
    if is_round:
        return _round_table(rng, **drawn(rng, round_top or {}))
    return _rectangular_table(rng, **drawn(rng, sides or {}))


def workbench(rng: VariantRng) -> Solid:
    """A workbench with a thick top and a lower board. Slots: top, legs."""
    d = rng.between(0.6, 0.75, "depth_m")
    w = rng.between(1.4, 2.0, "width_m")
    z = rng.between(0.82, 0.92, "height_m")
    top: Box = ((-0.5 * d, -0.5 * w, z - 0.05), (0.5 * d, 0.5 * w, z))
    low: Box = ((-0.5 * d + 0.06, -0.5 * w + 0.06, 0.18), (0.5 * d - 0.08, 0.5 * w - 0.06, 0.21))
    patches = [board(*top, 0, 0.005), board(*low, 0), *four_legs(d, w, z - 0.05, 0.07, 1, 0.06)]
    legs = painted_material(rng.choose(("#2f5d7c", "#3b4046", "#6b7074", "#8a2f26")), 0.45)
    looks = [wood(rng, 0.6), legs if rng.chance(0.6) else wood(rng)]
    made = solid(patches, looks, [top, low, *_legs_under(d, w, z)])
    # Three places side by side on the lower board.
    third, inside = (w - 0.26) / 3.0, []
    for k in range(3):
        y = -0.5 * w + 0.13 + k * third
        inside.append(Keypoint(INSIDE, (-0.5 * d + 0.13, y, 0.21)))
        inside.append(Keypoint(INSIDE, (0.5 * d - 0.13, y + third, z - 0.08)))
    return replace(made, keypoints=tuple(inside))


def _rectangular_table(
    rng: VariantRng,
    depth_m: float,
    width_m: float,
    height_m: float,
    *,
    drawers: bool = False,
    cables: bool = False,
) -> Solid:
    d, w, z = depth_m, width_m, height_m
    thick = rng.between(0.02, 0.04, "top_thickness_m")
    top: Box = ((-0.5 * d, -0.5 * w, z - thick), (0.5 * d, 0.5 * w, z))
    patches = [board(*top, 0, 0.004), *four_legs(d, w, z - thick, rng.between(0.04, 0.07), 1, 0.05)]
    apron = 0.02
    for sx in (-1, 1):
        x = sx * (0.5 * d - 0.05)
        patch = board(
            (x - apron / 2, -0.5 * w + 0.06, z - thick - 0.08),
            (x + apron / 2, 0.5 * w - 0.06, z - thick),
            1,
        )
        patches.append(patch)
    boxes: list[Box] = [top, *_legs_under(d, w, z)]
    if drawers:
        chest: Box = (
            (-0.5 * d + 0.06, 0.5 * w - 0.5, 0.1),
            (0.5 * d - 0.02, 0.5 * w - 0.08, z - thick),
        )
        patches.append(board(*chest, 1))
        for k in range(3):
            h = (z - thick - 0.1) / 3
            a = 0.1 + k * h
            patches.append(
                board(
                    (0.5 * d - 0.02, 0.5 * w - 0.495, a + 0.002),
                    (0.5 * d - 0.012, 0.5 * w - 0.085, a + h - 0.002),
                    0,
                )
            )
        boxes.append(chest)
    legs = (
        painted_material(rng.choose(("#26282b", "#d9d8d4")), 0.4) if rng.chance(0.4) else wood(rng)
    )
    looks = [front(rng), legs]
    if cables:
        patches += _cables(rng, -0.5 * d + 0.025, w, z - thick)
        looks.append(painted_material(rng.choose(("#17181a", "#17181a", "#d9d8d4")), 0.5))
    return solid(patches, looks, boxes)


def _cables(rng: VariantRng, x: float, w: float, z: float) -> list[Patch]:
    """Cables that fall behind a desk and run along the floor, in slot 2."""
    made = []
    for _ in range(int(rng.between(1, 4))):
        y = rng.between(-0.35, 0.35) * w
        aside = rng.between(-0.3, 0.3) * w
        path = [
            (x, y, z - 0.005),
            (x + 0.012, y + 0.1 * aside, 0.62 * z),
            (x + rng.between(0.0, 0.05), y + 0.35 * aside, 0.25 * z),
            (x + 0.06, y + 0.6 * aside, 0.02),
            (x + rng.between(0.03, 0.16), y + 0.85 * aside, 0.0045),
            (x + 0.01, y + aside, 0.0045),
        ]
        line = shapes.spline(path, 36)
        line[:, 2] = np.maximum(line[:, 2], 0.0042)
        made.append(shapes.sweep(line, shapes.circle(0.0035, 7), up=(1.0, 0.0, 0.0), slot=2))
    return made


def _round_table(rng: VariantRng, radius_m: float, height_m: float) -> Solid:
    r, z = radius_m, height_m
    profile = [
        (0.0, 0.0),
        (0.6 * r, 0.0),
        (0.6 * r, 0.012),
        (0.05, 0.04),
        (0.03, 0.1),
        (0.03, z - 0.05),
        (0.1, z - 0.025),
        (0.0, z - 0.025),
    ]
    patches = [disc(0.0, 0.0, z - 0.025, z, r, 0, 40), shapes.lathe(profile, 28, 1)]
    legs = painted_material("#26282b", 0.4) if rng.chance(0.6) else wood(rng)
    q = 0.7071 * r
    boxes: list[Box] = [
        ((-q, -q, z - 0.025), (q, q, z)),
        ((-0.4 * r, -0.4 * r, 0.0), (0.4 * r, 0.4 * r, z)),
    ]
    return solid(patches, [front(rng), legs], boxes)


def _legs_under(depth_m: float, width_m: float, height_m: float) -> Sequence[Box]:
    return posts(0.5 * depth_m - 0.05, 0.5 * width_m - 0.05, height_m - 0.03, 0.03)
