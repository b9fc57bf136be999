"""Trucks with a cab over the front axle.

At most 2.55 m wide, 2.60 m with insulated walls, 4.00 m high and 12.00 m long (Directive 96/53/EC,
by transportxxl.eu); other measures assumed, 10 %.
"""

import math
from dataclasses import replace

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import hex_to_linear
from gen_data.content.procedural.patches import Patch, join_patches
from gen_data.content.procedural.surface_shapes import block, lathe
from gen_data.content.scenery.basic_shapes import make_solid
from gen_data.content.vehicles import body_shell
from gen_data.content.vehicles.vehicle_materials import COLORS, SIDES, Print, materials
from gen_data.content.vehicles.vehicle_materials import VehicleSlot as Slot
from gen_data.content.vehicles.wheels import Axles
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng

_FLOOR_M = 0.42
_HALF_M = 1.16


KINDS = ("box_truck", "box_truck", "curtain_sider", "tipper", "box_truck", "tanker", "flatbed",
         "refuse_truck", "box_truck", "car_transporter", "curtain_sider", "box_truck")  # fmt: skip
"""Kinds by seed, in turn."""
_SECOND = {"tanker": "tankers", "tipper": "tippers", "flatbed": "tippers",
           "refuse_truck": "refuse", "car_transporter": "tippers"}  # fmt: skip
"""Colours of the load by kind; boxes by default."""


def truck(rng: VariantRng) -> Solid:
    """A truck. Slots and keypoints as for all vehicles; the load is the second paint.

    Randomizers paint the cab; boxes, tanks and beds keep the colour of their kind.
    """
    kind = rng.turn(KINDS, "kind")
    longest = 7.6 if kind in ("tipper", "refuse_truck") else 9.8
    x, cab, roof = (
        0.5 * rng.between(6.6, longest, "depth_m"),
        rng.between(1.75, 2.05, "cab_m"),
        rng.between(2.45, 2.75, "roof_m"),
    )
    top = max(roof + 0.25, rng.between(3.0, 3.75))
    loads = {"tipper": _tipper, "tanker": _tank, "flatbed": _flatbed, "car_transporter": _decks,
             "curtain_sider": _curtains, "refuse_truck": _hopper}  # fmt: skip
    load = loads.get(kind, _load)(x, cab, top)
    spoiler = rng.chance(0.6) and kind in ("box_truck", "curtain_sider")
    cab_paint = hex_to_linear(rng.choose(COLORS["cabs"]))
    box_paint = hex_to_linear(rng.choose(COLORS[_SECOND.get(kind, "boxes")]))
    paints = materials(rng, cab_paint, box_paint)
    keep = replace(paints[Slot.SECOND_PAINT], printed=True)
    finish = (*paints[: Slot.SECOND_PAINT], keep, *paints[Slot.SECOND_PAINT + 1 :])
    return assemble_truck(
        (x, cab, roof, top), rng.between(0.42, 0.49, "wheel_radius_m"), load, finish, spoiler
    )


def fire_engine(rng: VariantRng) -> Solid:
    """A fire engine with lockers, roller shutters, a ladder and beacons."""
    x, cab, roof = (
        0.5 * rng.between(7.2, 8.4, "depth_m"),
        rng.between(2.4, 2.7, "cab_m"),
        rng.between(2.6, 2.8, "roof_m"),
    )
    top = roof + rng.between(0.15, 0.4)
    red, stripe = hex_to_linear("#b5121b"), hex_to_linear(rng.choose(("#f2e600", "#e9e9e6")))
    finish = materials(rng, red, stripe, printed=Print(fixed=True))
    return assemble_truck((x, cab, roof, top), 0.49, _lockers(x, cab, roof, top), finish, False)


def assemble_truck(
    sizes_m: tuple[float, float, float, float],
    radius_m: float,
    load: list[Patch],
    finish: tuple[Material, ...],
    spoiler: bool,
) -> Solid:
    """A truck of half its length, the cab's length, the heights of the cab and of the load."""
    x, cab, roof, top = sizes_m
    axles = Axles(x - 1.22, -x + 1.8, 1.0, radius_m, 0.27, radius_m + 0.08, "truck", twin=True)
    fitted = [*axles.wheels(0.0), *load, *_chassis(x, cab, axles)]
    before = [_cab(x, cab, roof, axles), *(body_shell.drop_uvs(p) for p in fitted)]
    after = [body_shell.drop_uvs(_spoiler(x, cab, roof, top))] if spoiler else []
    body = [*before, *_lamps(x, mirrors=False), *after]
    parts = [*before, *_lamps(x, mirrors=True), *after]
    hull = [
        hulls.box((x - cab, -_HALF_M, _FLOOR_M), (x, _HALF_M, roof)),
        hulls.box((-x, -1.25, 0.95), (x - cab - 0.12, 1.25, top)),
        hulls.box((-x + 0.4, -1.1, 0.0), (x - 0.6, 1.1, 0.95)),
    ]
    points = axles.keypoints((x - 0.08, 0.95, 0.72), (-x + 0.02, 1.0, 0.8))
    return make_solid(parts, finish, hull, points, body)


def _cab(x: float, length: float, roof: float, axles: Axles) -> Patch:
    ring = body_shell.plan((14.0, 3.0), (40.0, 9.0), sides=9)
    rows = body_shell.body_rows("truck", x, x - length, _HALF_M)
    low, high = body_shell.level_height(_FLOOR_M), body_shell.level_height(roof - 0.05)
    half = body_shell.stack(ring, rows, low, high, crown_m=0.05, lid_rows=2)
    half = body_shell.paint(half, Slot.UNDERBODY, row=(-2.0, 0.0))
    belt, door = _FLOOR_M + 0.5 * (roof - _FLOOR_M), x - length + 0.42
    half = body_shell.paint(half, Slot.TRIM, row=(0.0, 1.0), z=(None, 0.6))
    half = body_shell.paint(
        half, Slot.GLASS, ring=(-1.0, ring.front(0.9)), z=(belt - 0.05, roof - 0.3)
    )
    side = (ring.front(0.92) + 0.04, 1.0)
    half = body_shell.paint(half, Slot.GLASS, ring=side, x=(door, None), z=(belt, roof - 0.33))
    half = body_shell.paint(
        half, Slot.TRIM, x=(x - 0.4, None), y=(None, 0.78), z=(0.92, belt - 0.24)
    )
    lamp = (ring.front(0.66), ring.front(0.92))
    half = body_shell.paint(half, Slot.HEADLIGHT, ring=lamp, z=(0.63, 0.82), x=(x - 0.6, None))
    wink = (ring.front(0.83), ring.front(0.92) + 0.03)
    half = body_shell.paint(half, Slot.INDICATOR_LEFT, ring=wink, x=(x - 0.7, None), z=(0.82, 0.9))
    panels, wells = axles.wells(half, _HALF_M)
    gaps = [
        body_shell.gap(panels, at, 0.012, Slot.TRIM, y=(0.7, None), row=(0.1, 0.93))
        for at in (door - 0.08, x - 0.42)
    ]
    return body_shell.mirror_half(join_patches([panels, *wells, *gaps]), SIDES)


def _load(x: float, cab: float, top: float) -> list[Patch]:
    """The box, its frame and the doors behind."""
    front = x - cab - 0.12
    parts = [block((-x + 0.03, -1.235, 0.98), (front, 1.235, top), 0.02, Slot.SECOND_PAINT)]
    for y in (-1.225, 1.225):
        for z in (0.98, top - 0.06):
            parts.append(block((-x, y - 0.025, z), (front, y + 0.025, z + 0.07), 0.0, Slot.CHROME))
        parts.append(block((-x, y - 0.025, 0.98), (-x + 0.08, y + 0.025, top), 0.0, Slot.CHROME))
    for y in (-0.62, -0.1, 0.1, 0.62):
        part = block((-x, y - 0.015, 1.05), (-x + 0.04, y + 0.015, top - 0.1), 0.0, Slot.CHROME)
        parts.append(part)
    parts.append(block((-x + 0.02, -0.006, 1.05), (-x + 0.04, 0.006, top - 0.1), 0.0, Slot.TRIM))
    return parts


def _curtains(x: float, cab: float, top: float) -> list[Patch]:
    """A box whose sides are canvas with straps."""
    front, parts = x - cab - 0.12, _load(x, cab, top)
    places = np.arange(-x + 0.35, front - 0.2, 0.6)
    for at in places:
        for y in (-1.24, 1.24):
            side = sorted((y, y - math.copysign(0.02, y)))
            parts.append(block((at - 0.025, side[0], 1.0), (at + 0.025, side[1], top - 0.1), 0.0,
                               Slot.TRIM))  # fmt: skip
    return parts


def _tipper(x: float, cab: float, top: float) -> list[Patch]:
    """An open skip with ribs, and a heap of gravel in it."""
    del top
    front, high = x - cab - 0.25, 2.1
    bed = block((-x + 0.05, -1.22, 1.0), (front, 1.22, high), 0.0, Slot.SECOND_PAINT)
    shield = block((front, -1.22, 1.1), (front + 0.08, 1.22, 2.55), 0.0, Slot.SECOND_PAINT)
    visor = block((front, -1.2, 2.5), (front + 0.55, 1.2, 2.56), 0.0, Slot.SECOND_PAINT)
    middle = 0.5 * (front - x + 0.05)
    heap = lathe([(1.0, 0.0), (0.82, 0.22), (0.45, 0.36), (0.0, 0.4)], 12, Slot.PLASTIC)
    parts = [bed, shield, visor, heap.scaled(0.46 * (front + x), 1.1, 1.0).moved(middle, 0.0, high)]
    for at in np.linspace(-x + 0.1, front - 0.06, 7):
        for y in (-1.22, 1.22):
            side = sorted((y, y + math.copysign(0.04, y)))
            parts.append(block((at - 0.04, side[0], 1.0), (at + 0.04, side[1], high), 0.0,
                               Slot.SECOND_PAINT))  # fmt: skip
    return parts


def _tank(x: float, cab: float, top: float) -> list[Patch]:
    """An oval tank with a walkway, rails and hazard boards."""
    front, radius = x - cab - 0.2, 0.5 * (min(top, 3.2) - 1.05)
    ends = ((0.0, 0.0), (0.8, 0.0), (0.97, 0.08), (1.0, 0.18))
    length = front + x - 0.1
    profile = [*ends, *((r, length - z) for r, z in ends[::-1])]
    barrel = lathe(profile, 20, Slot.SECOND_PAINT).scaled(radius, 1.2, 1.0)
    # A lathe's axle is Z: turned to X.
    barrel = barrel.rotated("y", 0.5 * math.pi).moved(-x + 0.1, 0.0, 1.05 + radius)
    crest = 1.05 + 2.0 * radius
    parts = [barrel, block((-x + 0.5, -0.25, crest - 0.06), (front - 0.5, 0.25, crest + 0.05), 0.0,
                           Slot.CHROME)]  # fmt: skip
    parts += [lathe([(0.22, 0.0), (0.22, 0.12), (0.0, 0.14)], 10, Slot.CHROME).moved(at, 0.0, crest)
              for at in (-0.5 * x, 0.2 * x)]  # fmt: skip
    board = block((-x + 0.02, 0.5, 1.2), (-x + 0.06, 0.9, 1.5), 0.0, Slot.AMBER_BEACON)
    return [*parts, board]


def _flatbed(x: float, cab: float, top: float) -> list[Patch]:
    """Drop sides with posts, and pallets of building materials."""
    del top
    front = x - cab - 0.15
    parts = [block((-x + 0.03, -1.24, 0.98), (front, 1.24, 1.1), 0.0, Slot.UNDERBODY)]
    for y in (-1.24, 1.21):
        parts.append(block((-x + 0.03, y, 1.1), (front, y + 0.03, 1.5), 0.0, Slot.SECOND_PAINT))
    for at in (-x + 0.03, front - 0.04):
        parts.append(block((at, -1.24, 1.1), (at + 0.04, 1.24, 1.5), 0.0, Slot.SECOND_PAINT))
    parts.append(block((front - 0.04, -1.2, 1.5), (front, 1.2, 2.3), 0.0, Slot.CHROME))
    for k, at in enumerate(np.linspace(-x + 0.6, front - 1.0, 3)):
        slot = (Slot.ROOF_SIGN, Slot.PLASTIC, Slot.ROOF_SIGN)[k]
        parts.append(block((at - 0.5, -0.9, 1.1), (at + 0.5, 0.9, 1.75 + 0.2 * k), 0.03, slot))
    return parts


def _hopper(x: float, cab: float, top: float) -> list[Patch]:
    """The body of a refuse truck, its tail hopper and lifting arms."""
    front, high = x - cab - 0.12, min(top, 3.3)
    middle = -x + 1.5
    parts = [block((middle, -1.22, 0.98), (front, 1.22, high), 0.06, Slot.SECOND_PAINT)]
    parts.append(block((-x + 0.25, -1.2, 1.25), (middle, 1.2, high - 0.1), 0.12, Slot.SECOND_PAINT))
    parts.append(block((-x + 0.05, -1.1, 1.0), (-x + 0.35, 1.1, 1.5), 0.0, Slot.UNDERBODY))
    for y in (-1.0, 0.86):
        parts.append(block((-x + 0.02, y, 0.95), (-x + 0.25, y + 0.14, 2.3), 0.0, Slot.CHROME))
    for at in np.linspace(middle + 0.3, front - 0.3, 4):
        for y in (-1.25, 1.21):
            parts.append(block((at - 0.05, y, 1.0), (at + 0.05, y + 0.04, high - 0.08), 0.0,
                               Slot.SECOND_PAINT))  # fmt: skip
    beacon = lathe([(0.09, 0.0), (0.08, 0.14), (0.0, 0.17)], 10, Slot.AMBER_BEACON)
    return [*parts, beacon.moved(front - 0.2, 0.8, high), beacon.moved(-x + 0.6, 0.8, high - 0.1)]


def _decks(x: float, cab: float, top: float) -> list[Patch]:
    """Two decks of an empty car transporter on posts, the upper one sloping to the cab's roof."""
    front, high = x - cab - 0.12, min(top, 3.1)
    parts = []
    for z, reach in ((0.98, front), (high - 0.15, x - 0.5)):
        for y in (-1.2, 0.62):
            parts.append(block((-x + 0.03, y, z), (reach, y + 0.58, z + 0.06), 0.0, Slot.CHROME))
        for y in (-1.24, 1.2):
            parts.append(block((-x + 0.03, y, z), (reach, y + 0.04, z + 0.15), 0.0,
                               Slot.SECOND_PAINT))  # fmt: skip
    for at in np.linspace(-x + 0.1, front - 0.1, 5):
        for y in (-1.24, 1.16):
            parts.append(block((at - 0.05, y, 1.0), (at + 0.05, y + 0.08, high), 0.0,
                               Slot.SECOND_PAINT))  # fmt: skip
    return parts


def _lockers(x: float, cab: float, roof: float, top: float) -> list[Patch]:
    """Body of a fire engine: shutters, stripe, ladder and beacons."""
    front = x - cab - 0.05
    parts = [block((-x + 0.03, -1.22, 0.85), (front, 1.22, top), 0.04, Slot.PAINT)]
    width = (front + x - 0.2) / 3.0
    for k in range(3):
        low = -x + 0.12 + k * width
        for y in (-1.235, 1.215):
            parts.append(block((low, y, 1.15), (low + width - 0.1, y + 0.02, top - 0.25), 0.0,
                               Slot.CHROME))  # fmt: skip
    for y in (-1.232, 1.212):
        parts.append(block((-x + 0.03, y, 0.92), (front, y + 0.02, 1.1), 0.0, Slot.SECOND_PAINT))
    for y in (-0.35, 0.3):
        parts.append(block((-x - 0.05, y, top + 0.12), (front + 0.9, y + 0.05, top + 0.2), 0.0,
                           Slot.CHROME))  # fmt: skip
    parts += [
        block((at, -0.35, top + 0.13), (at + 0.04, 0.35, top + 0.17), 0.0, Slot.CHROME)
        for at in np.arange(-x, front + 0.8, 0.45)
    ]
    parts.append(block((x - 0.75, -1.0, roof - 0.05), (x - 0.5, 1.0, roof + 0.02), 0.0, Slot.TRIM))
    for y in (-1.0, 0.4):
        parts.append(block((x - 0.75, y, roof + 0.02), (x - 0.5, y + 0.6, roof + 0.14), 0.02,
                           Slot.BLUE_BEACON))  # fmt: skip
    beacon = lathe([(0.09, 0.0), (0.08, 0.14), (0.0, 0.17)], 10, Slot.BLUE_BEACON)
    return [*parts, beacon.moved(-x + 0.2, 1.0, top), beacon.moved(-x + 0.2, -1.0, top)]


def _chassis(x: float, cab: float, axles: Axles) -> list[Patch]:
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
    parts = [
        block((x - 0.04, -0.26, 0.46), (x + 0.006, 0.26, 0.57), 0.0, Slot.PLATE),
        block((-x + 0.02, -0.26, 0.66), (-x + 0.06, 0.26, 0.77), 0.0, Slot.REAR_PLATE),
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
    return [body_shell.drop_uvs(part) for part in parts]


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
