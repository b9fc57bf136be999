"""Box trucks with a cab over the front axle; dimensions after Directive 96/53/EC."""

from __future__ import annotations

import numpy as np

from gen_data.generator.assets.procedural import collision_hulls as hulls
from gen_data.generator.assets.procedural.family import Solid
from gen_data.generator.assets.procedural.material_presets import hex_to_linear
from gen_data.generator.assets.procedural.patches import Patch, join_patches
from gen_data.generator.assets.procedural.surface_shapes import block
from gen_data.generator.assets.procedural.variant_rng import variant_rng
from gen_data.generator.assets.scenery.basic_shapes import make_solid
from gen_data.generator.assets.vehicles.body_shell import (
    body_rows,
    drop_uvs,
    gap,
    level_height,
    mirror_half,
    paint,
    plan,
    stack,
)
from gen_data.generator.assets.vehicles.vehicle_materials import COLORS, SIDES, materials
from gen_data.generator.assets.vehicles.vehicle_materials import VehicleSlot as Slot
from gen_data.generator.assets.vehicles.wheels import Axles

_FLOOR_M = 0.42
_HALF_M = 1.16


def truck(seed: int) -> Solid:
    """A box truck. Slots and keypoints are those of all vehicles; the box is the second paint."""
    rng = variant_rng("truck", seed)
    x, cab, roof = (0.5 * rng.between(6.6, 9.8), rng.between(1.75, 2.05), rng.between(2.45, 2.75))
    top = max(roof + 0.25, rng.between(3.0, 3.75))
    radius = rng.between(0.42, 0.49)
    axles = Axles(x - 1.22, -x + rng.between(1.6, 2.0), 1.0, radius, 0.27, radius + 0.08, 0, True)
    before = [_cab(x, cab, roof, axles)]
    fitted = [*axles.wheels(0.0), *_load(x, cab, top), *_chassis(x, cab, axles)]
    before += [drop_uvs(p) for p in fitted]
    after = [drop_uvs(_spoiler(x, cab, roof, top))] if rng.chance(0.6) else []
    body = [*before, *_lamps(x, mirrors=False), *after]
    parts = [*before, *_lamps(x, mirrors=True), *after]
    cab_paint, box_paint = (hex_to_linear(rng.choose(COLORS[k])) for k in ("cabs", "boxes"))
    hull = [
        hulls.box((x - cab, -_HALF_M, _FLOOR_M), (x, _HALF_M, roof)),
        hulls.box((-x, -1.25, 0.95), (x - cab - 0.12, 1.25, top)),
        hulls.box((-x + 0.4, -1.1, 0.0), (x - 0.6, 1.1, 0.95)),
    ]
    points = axles.keypoints((x - 0.08, 0.95, 0.72), (-x + 0.02, 1.0, 0.8))
    return make_solid(parts, materials(rng, cab_paint, box_paint), hull, points, body)


def _cab(x: float, length: float, roof: float, axles: Axles) -> Patch:
    ring = plan((14.0, 3.0), (40.0, 9.0), sides=9)
    rows = body_rows("truck", x, x - length, _HALF_M)
    low, high = level_height(_FLOOR_M), level_height(roof - 0.05)
    half = stack(ring, rows, low, high, crown_m=0.05, lid_rows=2)
    half = paint(half, Slot.UNDERBODY, row=(-2.0, 0.0))
    belt, door = _FLOOR_M + 0.5 * (roof - _FLOOR_M), x - length + 0.42
    half = paint(half, Slot.TRIM, row=(0.0, 1.0), z=(None, 0.6))
    half = paint(half, Slot.GLASS, ring=(-1.0, ring.front(0.9)), z=(belt - 0.05, roof - 0.3))
    side = (ring.front(0.92) + 0.04, 1.0)
    half = paint(half, Slot.GLASS, ring=side, x=(door, None), z=(belt, roof - 0.33))
    half = paint(half, Slot.TRIM, x=(x - 0.4, None), y=(None, 0.78), z=(0.92, belt - 0.24))
    lamp = (ring.front(0.66), ring.front(0.92))
    half = paint(half, Slot.HEADLIGHT, ring=lamp, z=(0.63, 0.82), x=(x - 0.6, None))
    wink = (ring.front(0.83), ring.front(0.92) + 0.03)
    half = paint(half, Slot.INDICATOR_LEFT, ring=wink, x=(x - 0.7, None), z=(0.82, 0.9))
    panels, wells = axles.wells(half, _HALF_M)
    gaps = [
        gap(panels, at, 0.012, Slot.TRIM, y=(0.7, None), row=(0.1, 0.93))
        for at in (door - 0.08, x - 0.42)
    ]
    return mirror_half(join_patches([panels, *wells, *gaps]), SIDES)


def _load(x: float, cab: float, top: float) -> list[Patch]:
    """The box, its frame and the doors behind."""
    front = x - cab - 0.12
    parts = [block((-x + 0.03, -1.235, 0.98), (front, 1.235, top), 0.02, Slot.SECOND_PAINT)]
    for y in (-1.225, 1.225):
        for z in (0.98, top - 0.06):
            parts.append(block((-x, y - 0.025, z), (front, y + 0.025, z + 0.07), 0.0, Slot.CHROME))
        parts.append(block((-x, y - 0.025, 0.98), (-x + 0.08, y + 0.025, top), 0.0, Slot.CHROME))
    for y in (-0.62, -0.1, 0.1, 0.62):
        parts.append(
            block((-x, y - 0.015, 1.05), (-x + 0.04, y + 0.015, top - 0.1), 0.0, Slot.CHROME)
        )
    parts.append(block((-x + 0.02, -0.006, 1.05), (-x + 0.04, 0.006, top - 0.1), 0.0, Slot.TRIM))
    return parts


def _chassis(x: float, cab: float, axles: Axles) -> list[Patch]:
    """Rails, tank, side guards, mudguards, bumper behind."""
    front, guard = x - cab - 0.2, (axles.rear_m + 0.65, axles.front_m - 0.75)
    parts = [
        block((-x + 0.1, sign * 0.42 - 0.05, 0.62), (x - 0.5, sign * 0.42 + 0.05, 0.9))
        for sign in (1.0, -1.0)
    ]
    parts.append(block((-x + 0.1, -1.2, 0.88), (front, 1.2, 0.98)))
    for x_m in (axles.front_m, axles.rear_m):
        parts.append(block((x_m - 0.07, -0.9, axles.radius_m - 0.07),
                           (x_m + 0.07, 0.9, axles.radius_m + 0.07)))  # fmt: skip
    tank = block((guard[1] - 0.9, 0.6, 0.4), (guard[1] - 0.1, 1.1, 0.85), 0.08, Slot.CHROME)
    made = [p.painted(Slot.UNDERBODY) for p in parts]
    for sign in (1.0, -1.0):
        y = sorted((sign * 1.17, sign * 1.2))
        for z in (0.48, 0.72):
            made.append(block((guard[0], y[0], z), (guard[1], y[1], z + 0.1), 0.0, Slot.CHROME))
    made.append(block((-x + 0.05, -1.15, 0.42), (-x + 0.13, 1.15, 0.54), 0.0, Slot.TRIM))
    return [*made, tank]


def _lamps(x: float, *, mirrors: bool) -> list[Patch]:
    """Lamps behind, plates, and exterior mirrors or none."""
    parts = [
        block((x - 0.04, -0.26, 0.46), (x + 0.006, 0.26, 0.57), 0.0, Slot.PLATE),
        block((-x + 0.02, -0.26, 0.66), (-x + 0.06, 0.26, 0.77), 0.0, Slot.PLATE),
    ]
    for sign, wink in ((1.0, Slot.INDICATOR_LEFT), (-1.0, Slot.INDICATOR_RIGHT)):
        for slot, inner in ((Slot.TAILLIGHT, 0.78), (Slot.BRAKELIGHT, 0.92), (wink, 1.06)):
            y = sorted((sign * inner, sign * (inner + 0.13)))
            parts.append(block((-x + 0.01, y[0], 0.73), (-x + 0.08, y[1], 0.87), 0.0, slot))
        if not mirrors:
            continue
        y = sorted((sign * 1.2, sign * 1.38))
        parts.append(block((x - 0.42, y[0], 1.65), (x - 0.3, y[1], 2.1), 0.03, Slot.TRIM))
        y = sorted((sign * 1.0, sign * 1.25))
        parts.append(block((x - 0.45, y[0], 2.1), (x - 0.4, y[1], 2.14), 0.0, Slot.TRIM))
    return [drop_uvs(part) for part in parts]


def _spoiler(x: float, cab: float, roof: float, top: float) -> Patch:
    """A wedge on the cab's roof that leads the air over the box."""
    rear, front, low, high = x - cab + 0.1, x - 0.75, roof - 0.04, top - 0.08
    side = [(rear, low), (front, low), (rear + 0.25, high), (rear, high)]
    left, right = ([(px, y, pz) for px, pz in side] for y in (0.95, -0.95))
    quads = [[right[k], right[(k + 1) % 4], left[(k + 1) % 4], left[k]] for k in range(4)]
    quads += [[*left], [*right[::-1]]]
    points = np.array(quads)[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3, 3)[:, ::-1]
    wedge = Patch(points, np.zeros((len(points), 3, 2)), np.zeros(len(points), dtype=np.int64))
    return wedge.painted(Slot.PAINT)
