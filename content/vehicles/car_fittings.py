"""Fittings of cars: mirrors, handles, wipers, antennas, roof boxes, exhausts, tow bars."""

import math
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from gen_data.content.procedural.patches import Patch
from gen_data.content.procedural.surface_shapes import Point2, block, extrude, rounded_box
from gen_data.content.scenery.basic_shapes import tube
from gen_data.content.vehicles.car_design import Design
from gen_data.content.vehicles.vehicle_materials import VehicleSlot as Slot


def fit_mirror(design: Design) -> Iterator[Patch]:
    """The left exterior mirror."""
    shoulder = design.shoulder()
    y = design.half_m
    mirror_x = design.x(design.cowl + 0.42 * (design.header - design.cowl))
    z = float(shoulder(np.array(mirror_x))) + 0.1
    housing = rounded_box((0.13, 0.2, 0.14), 0.045, 1).moved(mirror_x, y + 0.07, z)
    yield housing.painted(Slot.PLASTIC if design.bare_bumpers else Slot.PAINT)
    face = block((mirror_x - 0.07, y - 0.01, z - 0.05), (mirror_x - 0.06, y + 0.15, z + 0.05))
    yield face.painted(Slot.CHROME)
    yield block(
        (mirror_x - 0.03, 0.86 * y, z - 0.1), (mirror_x + 0.03, y, z - 0.04), 0.0, Slot.TRIM
    )


def fit_side(design: Design) -> Iterator[Patch]:
    """Handles, rub strip, lip and rail of the roof: the left half of each."""
    shoulder, y = design.shoulder(), design.half_m
    handle = Slot.TRIM if design.bare_bumpers else Slot.PAINT
    for share in design.seams[1:]:
        x = design.x(share) + 0.16
        z = float(shoulder(np.array(x))) - 0.13
        # A dark bowl behind the handle.
        yield block(
            (x - 0.07, 0.9 * y, z - 0.022), (x + 0.07, y - 0.006, z + 0.045), 0.0, Slot.TRIM
        )
        yield block((x - 0.1, 0.95 * y, z), (x + 0.1, y + 0.012, z + 0.03), 0.0, handle)
    if design.strip:
        z = 0.5 * (design.clearance_m + design.belt_m) + 0.02
        axles = design.axles
        ends = (axles.rear_m + axles.arch_m + 0.06, axles.front_m - axles.arch_m - 0.06)
        yield block((ends[0], 0.96 * y, z), (ends[1], y + 0.008, z + 0.055), 0.0, Slot.PLASTIC)
    if "spoiler" in design.extras:
        x, edge = design.x(design.roof_end), 0.86 * design.roof_share * y
        low = design.height_m - 0.1
        yield block((x - 0.1, 0.0, low), (x + 0.08, edge, low + 0.045), 0.0, Slot.PAINT)
    if design.rails:
        front, rear = design.x(design.header + 0.05), design.x(design.roof_end - 0.04)
        at = design.roof_share * y - 0.06
        top = design.height_m
        yield block((rear, at - 0.015, top - 0.06), (front, at + 0.015, top), 0.0, Slot.CHROME)


def fit_wipers(design: Design) -> Iterator[Patch]:
    """Two blades at the foot of the windscreen, both pointing to the right."""
    slope = (design.height_m - design.cowl_m) / (design.x(design.cowl) - design.x(design.header))
    x, z, y = design.x(design.cowl) - 0.1, design.cowl_m + 0.02, design.half_m
    for start in (0.55 * y, -0.05 * y):
        end = start - 0.52 * y
        points = [(x, start, z + 0.012), (x - 0.09, end, z + 0.09 * slope + 0.03)]
        yield tube(points, 0.009, 4).painted(Slot.TRIM)


def fit_antenna(design: Design) -> Iterator[Patch]:
    """A rod or a fin on the roof; 3D boxes leave them out as they do mirrors."""
    x, z = design.x(design.roof_end) + 0.25, design.height_m
    if "antenna" in design.extras:
        points = [(x, 0.0, z - 0.05), (x - 0.16, 0.0, z + 0.2)]
        yield tube(points, 0.006, 4).painted(Slot.TRIM)
    if "fin" in design.extras:
        side = [(0.1, 0.0), (0.0, 0.075), (-0.07, 0.08), (-0.07, 0.0)]
        yield _wedge([(x + px, z - 0.03 + pz) for px, pz in side], 0.022, Slot.TRIM)


def fit_extras(design: Design) -> Iterator[Patch]:
    """Extras of the design, except on the roof."""
    for word in design.extras:
        if word in _EXTRAS:
            yield from _EXTRAS[word](design)


def _roof_bars(design: Design) -> Iterator[Patch]:
    y, z = design.roof_share * design.half_m, design.height_m
    for share in (0.3, 0.72):
        x = design.x(design.header + share * (design.roof_end - design.header))
        yield block((x - 0.025, -y, z), (x + 0.025, y, z + 0.03), 0.0, Slot.CHROME)
        for side in (-y, y):
            yield block(
                (x - 0.03, side - 0.03, z - 0.06), (x + 0.03, side + 0.03, z + 0.03), 0.0, Slot.TRIM
            )


def _roof_box(design: Design) -> Iterator[Patch]:
    yield from _roof_bars(design)
    middle = design.x(0.5 * (design.header + design.roof_end))
    length = min(2.0, 0.95 * design.length_m * (design.roof_end - design.header) + 0.3)
    box = rounded_box((length, 0.76, 0.36), 0.14, 1)
    yield box.moved(middle, -0.1, design.height_m + 0.2).painted(Slot.PLASTIC)


def _tow_bar(design: Design) -> Iterator[Patch]:
    x, z = -0.5 * design.length_m, design.clearance_m + 0.16
    points = [(x + 0.2, 0.0, z), (x - 0.03, 0.0, z), (x - 0.06, 0.0, z + 0.09)]
    yield tube(points, 0.022, 5).painted(Slot.TRIM)
    yield (
        rounded_box((0.05, 0.05, 0.05), 0.02, 1).moved(x - 0.06, 0.0, z + 0.11).painted(Slot.CHROME)
    )


def _exhaust(design: Design, sides: tuple[float, ...] = (-0.55,)) -> Iterator[Patch]:
    for side in sides:
        x, y, z = -0.5 * design.length_m + 0.06, side * design.half_m, design.clearance_m + 0.02
        yield tube([(x + 0.16, y, z), (x, y, z)], 0.034, 8).painted(Slot.CHROME)


def _twin_exhaust(design: Design) -> Iterator[Patch]:
    yield from _exhaust(design, (-0.58, 0.58))


def _wedge(side: list[Point2], half_m: float, slot: int) -> Patch:
    """A polygon of (x, z) as thick as ``half_m`` to both sides of the middle."""
    made = extrude(np.array(side), 2.0 * half_m).rotated("x", 0.5 * math.pi)
    return made.moved(0.0, half_m, 0.0).painted(slot)


_EXTRAS: Mapping[str, Callable[[Design], Iterator[Patch]]] = {
    "roof_bars": _roof_bars,
    "roof_box": _roof_box,
    "tow_bar": _tow_bar,
    "exhaust": _exhaust,
    "twin_exhaust": _twin_exhaust,
}
