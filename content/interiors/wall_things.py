"""Wall-mounted fixtures: shelves, rails, boards, sockets, switches.

Origin at the lowest point, in the middle of the back.
"""

import math

from gen_data.assets.family import Solid
from gen_data.content.interiors.fittings import photograph
from gen_data.content.interiors.parts import TOOLS, Box, board, cloth, front, rod, solid, wood
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.furniture import rectangle
from gen_data.content.procedural.material_presets import (
    STAINLESS,
    STEEL,
    draw_linear,
    metal_material,
    painted_material,
    patterned_material,
    printed_material,
)
from gen_data.content.procedural.patches import Patch
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng, variant_rng

_WHITE = painted_material("#f3f2ee", 0.35)
_DARK = painted_material("#1d1e20", 0.5)
SHELF_BRACKET_M = 0.12


def wall_shelf(rng: VariantRng) -> Solid:
    """A board on brackets. Slots: board, brackets."""
    d = rng.between(0.18, 0.26, "depth_m")
    w = rng.between(0.6, 1.2, "width_m")
    t = rng.between(0.02, 0.035, "thickness_m")
    top = SHELF_BRACKET_M + t
    shelf: Box = ((0.0, -0.5 * w, SHELF_BRACKET_M), (d, 0.5 * w, top))
    patches = [board(*shelf, 0, 0.003)]
    for sy in (-1, 1):
        y = sy * 0.36 * w
        patches += [
            shapes.block((0.0, y - 0.012, 0.0), (0.005, y + 0.012, SHELF_BRACKET_M), 0.001, 1),
            shapes.block(
                (0.0, y - 0.012, SHELF_BRACKET_M - 0.005),
                (0.8 * d, y + 0.012, SHELF_BRACKET_M),
                0.001,
                1,
            ),
            rod((0.004, y, 0.02), (0.7 * d, y, SHELF_BRACKET_M - 0.004), 0.005, 1, 8),
        ]
    return solid(patches, [front(rng), rng.choose((_DARK, _WHITE))], [shelf])


def socket(rng: VariantRng) -> Solid:
    """One to three sockets in a frame. Slots: plate, holes."""
    count = rng.turn((1, 2, 3), "count")
    w = 0.081 * count
    plate: Box = ((0.0, -0.5 * w, 0.0), (0.009, 0.5 * w, 0.081))
    patches = [shapes.block(*plate, 0.003)]
    for k in range(count):
        y = (k + 0.5) * 0.081 - 0.5 * w
        well = shapes.lathe([(0.0, 0.001), (0.019, 0.001), (0.022, 0.0)], 24, 1)
        patches.append(well.rotated("y", 0.5 * math.pi).moved(0.009, y, 0.0405))
        if rng.chance(0.35):
            # A plug, with the first stretch of its cable.
            patches.append(rod((0.009, y, 0.04), (0.045, y, 0.04), 0.018, 2, 16))
            patches.append(rod((0.04, y, 0.035), (0.03, y, -0.25), 0.004, 2, 8))
    lowest = -0.25 if len(patches) > count + 1 else 0.0
    moved = [patch.moved(0.0, 0.0, -lowest) for patch in patches]
    dark = painted_material(rng.choose(("#1d1e20", "#e8e6e1")), 0.5)
    box: Box = ((0.0, -0.5 * w, -lowest), (0.009, 0.5 * w, 0.081 - lowest))
    return solid(moved, [_WHITE, painted_material("#c9c7c1", 0.4), dark], [box])


def light_switch(seed: int = 0) -> Solid:
    """One or two rockers in a frame. Slots: plate, rockers."""
    count = variant_rng("light_switch", seed).turn((1, 2), "count")
    w = 0.081 * count
    plate: Box = ((0.0, -0.5 * w, 0.0), (0.008, 0.5 * w, 0.081))
    patches = [shapes.block(*plate, 0.003)]
    for k in range(count):
        y = (k + 0.5) * 0.081 - 0.5 * w
        rocker = shapes.block((0.0, -0.028, -0.028), (0.006, 0.028, 0.028), 0.002, 1)
        tilt = 0.06 if (seed // 2 + k) % 2 else -0.06
        patches.append(rocker.rotated("y", tilt).moved(0.006, y, 0.0405))
    return solid(patches, [_WHITE, painted_material("#f7f6f3", 0.3)], [plate])


def utensil_rail(rng: VariantRng) -> Solid:
    """A rail with ladles, spoons and a cloth. Slots: steel, wood, cloth."""
    w, top = rng.between(0.45, 0.7, "width_m"), 0.36
    patches: list[Patch] = [rod((0.045, -0.5 * w, top), (0.045, 0.5 * w, top), 0.007, 0, 12)]
    for sy in (-1, 1):
        patches.append(rod((0.0, sy * 0.45 * w, top), (0.045, sy * 0.45 * w, top), 0.008, 0))
    count = int(w / 0.085)
    for k in range(count):
        y = (k + 0.5) * w / count - 0.5 * w
        if rng.chance(0.2):
            continue
        length, slot = rng.between(0.22, 0.33), 1 if rng.chance(0.4) else 0
        z = top - 0.02
        patches.append(rod((0.045, y, top + 0.004), (0.052, y, z - length), 0.005, slot, 8))
        head = shapes.ball(lambda d: d * (0.011, 0.03, 0.042), 8, 14).painted(slot)
        patches.append(head.moved(0.054, y, z - length))
    lowest = min(float(p.corners_m[..., 2].min()) for p in patches)
    moved = [patch.moved(0.0, 0.0, -lowest) for patch in patches]
    box: Box = ((0.0, -0.5 * w, 0.0), (0.08, 0.5 * w, top - lowest))
    return solid(moved, [metal_material(STAINLESS, 0.25), wood(rng), cloth(rng)], [box])


def pegboard(rng: VariantRng) -> Solid:
    """A board with hand tools on hooks. Slots: board, steel, handles."""
    w, h = rng.between(0.9, 1.4, "width_m"), rng.between(0.6, 0.8, "height_m")
    back: Box = ((0.0, -0.5 * w, 0.0), (0.012, 0.5 * w, h))
    patches: list[Patch] = [shapes.block(*back, 0.002)]
    columns = int(w / 0.11)
    for row, high in enumerate((0.93 * h, 0.47 * h)):
        for k in range(columns):
            y = (k + 0.5) * w / columns - 0.5 * w
            patches.append(rod((0.012, y, high), (0.05, y, high + 0.005), 0.003, 1, 6))
            if rng.chance(0.85):
                patches += _hand_tool(y, high, rng.between(0.16, 0.27), (k + row) % 4)
    paint = painted_material(rng.choose(("#c9c3b4", "#3d4a57", "#d8d6d0", "#8d5a2b")), 0.7)
    grip = Material(draw_linear(("#b3261e", "#f2b01e", "#1f4e8c", "#2b2d30"), 0.1, rng), 0.45)
    return solid(patches, [paint, metal_material(STEEL, 0.35), grip], [back])


def _hand_tool(y: float, top: float, length: float, kind: int) -> list[Patch]:
    """A spanner, screwdriver, hammer or pair of pliers that hangs before a board."""
    x, low = 0.034, top - length
    if kind == 0:
        bar: Box = ((x - 0.004, y - 0.008, low + 0.015), (x + 0.004, y + 0.008, top - 0.01))
        profile = [(0.0, -0.004), (0.018, -0.004), (0.018, 0.004), (0.0, 0.004)]
        ends = [
            shapes.lathe(profile, 14, 1).rotated("y", 0.5 * math.pi).moved(x, y, z)
            for z in (low + 0.012, top - 0.012)
        ]
        return [shapes.block(*bar, 0.001, 1), *ends]
    if kind == 1:
        middle = top - 0.45 * length
        return [
            rod((x, y, middle), (x, y, top - 0.002), 0.013, 2, 12),
            rod((x, y, low), (x, y, middle), 0.0035, 1, 8),
        ]
    if kind == 2:
        head = rod((x, y - 0.05, top - 0.02), (x, y + 0.05, top - 0.02), 0.014, 1, 12)
        return [rod((x, y, low), (x, y, top - 0.01), 0.011, 2, 10), head]
    jaw = 0.32 * length
    return [
        rod((x, y - 0.022, low), (x, y + 0.004, top - jaw), 0.007, 2, 8),
        rod((x, y + 0.022, low), (x, y - 0.004, top - jaw), 0.007, 2, 8),
        shapes.block((x - 0.006, y - 0.012, top - jaw), (x + 0.006, y + 0.012, top), 0.003, 1),
    ]


def notice_board(rng: VariantRng) -> Solid:
    """A cork board with sheets of paper. Slots: frame, cork, papers."""
    w, h = rng.between(0.6, 1.0, "width_m"), rng.between(0.45, 0.7, "height_m")
    back: Box = ((0.0, -0.5 * w, 0.0), (0.012, 0.5 * w, h))
    patches: list[Patch] = [shapes.block(*back, 0.0, 1)]
    for low, high in (
        ((0.0, -0.5 * w, 0.0), (0.02, 0.5 * w, 0.025)),
        ((0.0, -0.5 * w, h - 0.025), (0.02, 0.5 * w, h)),
        ((0.0, -0.5 * w, 0.0), (0.02, -0.5 * w + 0.025, h)),
        ((0.0, 0.5 * w - 0.025, 0.0), (0.02, 0.5 * w, h)),
    ):
        patches.append(board(low, high, 0))
    for k in range(int(rng.between(4, 9))):
        a, b = rng.choose(((0.21, 0.297), (0.148, 0.21), (0.1, 0.15), (0.076, 0.076)))
        y = rng.between(-0.5 * w + 0.04, 0.5 * w - 0.04 - a)
        z = rng.between(0.04, max(h - 0.04 - b, 0.05))
        if z + b > h - 0.02:
            continue
        sheet = rectangle((0.0, 0.0, 0.0), (0.0, a, 0.0), (0.0, 0.0, b)).painted(2 + k % 3)
        turned = sheet.rotated("x", rng.between(-0.06, 0.06))
        patches.append(turned.moved(0.0135 + 0.0006 * k, y, z))
    looks = [
        wood(rng),
        patterned_material(f"texture/cardboard?seed={rng.seed % 16}", 0.15, 0.95),
        painted_material("#f6f5f1", 0.8),
        printed_material(f"texture/wall_art?seed={13 + 14 * (2 * (rng.seed % 3))}", 0.7),
        painted_material(rng.choose(("#f2e37a", "#e9a6b2", "#a9d3e8")), 0.8),
    ]
    return solid(patches, looks, [back])


def roll_holder(rng: VariantRng) -> Solid:
    """A holder with a roll of toilet paper. Slots: steel, paper."""
    r = rng.between(0.04, 0.058, "radius_m")
    roll = shapes.lathe([(0.02, -0.05), (r, -0.05), (r, 0.05), (0.02, 0.05), (0.02, -0.05)], 32, 1)
    tail: Box = ((0.075 + r - 0.002, -0.05, 0.0), (0.075 + r - 0.001, 0.05, 0.1))
    patches = [
        roll.rotated("x", 0.5 * math.pi).moved(0.075, 0.0, 0.1),
        shapes.block(*tail, 0.0, 1),
        rod((0.075, -0.07, 0.1), (0.075, 0.07, 0.1), 0.007, 0),
        rod((0.0, -0.066, 0.1), (0.075, -0.066, 0.1), 0.007, 0),
        shapes.block((0.0, -0.09, 0.075), (0.006, -0.042, 0.125), 0.002, 0),
    ]
    box: Box = ((0.0, -0.07, 0.04), (0.13, 0.07, 0.16))
    looks = [metal_material(STAINLESS, 0.2), painted_material("#f6f5f2", 0.95)]
    return solid(patches, looks, [box])


def wall_calendar(rng: VariantRng) -> Solid:
    """A calendar: a picture above a table of days. Slots: paper, picture, ink."""
    w, h = 0.3, rng.between(0.4, 0.5, "height_m")
    sheet: Box = ((0.0, -0.5 * w, 0.0), (0.004, 0.5 * w, h))
    photo = rectangle((0.0045, -0.46 * w, 0.48 * h), (0.0, 0.92 * w, 0.0), (0.0, 0.0, 0.48 * h))
    patches = [shapes.block(*sheet), photo.painted(1)]
    for row in range(5):
        for k in range(7):
            y, z = (k / 6 - 0.5) * 0.8 * w, 0.05 * h + row * 0.08 * h
            mark = rectangle((0.0045, y - 0.006, z), (0.0, 0.012, 0.0), (0.0, 0.0, 0.012))
            patches.append(mark.painted(2))
    looks = [
        painted_material("#f7f6f2", 0.8),
        printed_material(photograph(rng.seed, upright=False), 0.5),
        painted_material("#3a3d42", 0.8),
    ]
    return solid(patches, looks, [sheet])


def bathroom_cabinet(rng: VariantRng) -> Solid:
    """A cabinet with mirrors for doors. Slots: body, mirror."""
    w = rng.between(0.55, 0.9, "width_m")
    h = rng.between(0.6, 0.75, "height_m")
    d = 0.14
    doors = rng.turn((1, 2, 3), "doors")
    body: Box = ((0.0, -0.5 * w, 0.0), (d, 0.5 * w, h))
    patches = [board(*body)]
    for k in range(doors):
        a, b = w * (k / doors - 0.5) + 0.002, w * ((k + 1) / doors - 0.5) - 0.002
        glass = rectangle((d + 0.006, a, 0.003), (0.0, b - a, 0.0), (0.0, 0.0, h - 0.006))
        patches += [shapes.block((d, a, 0.003), (d + 0.0055, b, h - 0.003)), glass.painted(1)]
    silver = Material((0.93, 0.94, 0.93), 0.02, metallic=1.0, role="mirror")
    return solid(patches, [_WHITE if rng.chance(0.6) else front(rng), silver], [body])


def parts_bins(rng: VariantRng) -> Solid:
    """Rows of open plastic bins for small parts. Slots: rail, bins, parts."""
    rows, columns = rng.turn((2, 3, 4), "rows"), rng.whole(4, 8, "columns")
    a, h, d = 0.105, 0.085, 0.15
    w, pitch = columns * (a + 0.006), h + 0.045
    back: Box = ((0.0, -0.5 * w, 0.0), (0.01, 0.5 * w, rows * pitch))
    patches: list[Patch] = [shapes.block(*back, 0.001)]
    for row in range(rows):
        for k in range(columns):
            y, z = -0.5 * w + k * (a + 0.006) + 0.003, row * pitch
            slot = 1 + (row + (1 if k > columns // 2 else 0)) % 2
            patches += [
                shapes.block((0.01, y, z), (0.01 + d, y + a, z + 0.006), 0.0, slot),
                shapes.block((0.01, y, z), (0.01 + d, y + 0.003, z + h), 0.0, slot),
                shapes.block((0.01, y + a - 0.003, z), (0.01 + d, y + a, z + h), 0.0, slot),
                shapes.block((0.007 + d, y, z), (0.01 + d, y + a, z + 0.55 * h), 0.0, slot),
            ]
            if rng.chance(0.8):
                fill = rng.between(0.2, 0.5) * h
                heap: Box = ((0.015, y + 0.004, z + 0.006), (d, y + a - 0.004, z + fill))
                patches.append(shapes.block(*heap, 0.004, 3))
    looks = [
        metal_material(STEEL, 0.5),
        painted_material("#1f5fa8", 0.4),
        Material(draw_linear(TOOLS, 0.1, rng), 0.4),
        metal_material(STEEL, 0.55),
    ]
    return solid(patches, looks, [((0.0, -0.5 * w, 0.0), (0.16, 0.5 * w, rows * pitch))])
