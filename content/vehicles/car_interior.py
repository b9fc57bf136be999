"""Interiors of cars as seen through their windows: floor, dashboard, steering wheel, seats."""

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from gen_data.content.procedural.patches import Patch
from gen_data.content.procedural.surface_shapes import block, circle, sweep
from gen_data.content.vehicles.car_design import Design
from gen_data.content.vehicles.vehicle_materials import VehicleSlot as Slot

_CLEARANCE_M = 0.12
"""Distance of the trim from the shell at the belt."""
_ROW_M = 0.86
"""Distance of rows of seats; assumed, within a tenth."""


def fit_interior(design: Design) -> Iterator[Patch]:
    """All parts; the wheel is on the left. Seats stand where the windows let them be seen."""
    wide = design.waist_share * design.half_m - _CLEARANCE_M
    screen, rear = design.x(design.cowl), design.x(design.rear_base)
    belt, top = min(design.cowl_m, design.belt_m), design.height_m
    floor = belt - 0.3
    dash = screen - 0.55 * (design.x(design.cowl) - design.x(design.header)) - 0.1
    yield block((dash, -wide, floor), (screen - 0.25, wide, belt - 0.02), 0.0, Slot.INTERIOR)
    # A floor just below the windows hides the hollow body.
    yield block((rear + 0.3, -wide, floor - 0.02), (dash, wide, floor), 0.0, Slot.UNDERBODY)
    yield from _linings(design, wide, floor, (rear + 0.5, dash))
    front = dash - 0.5
    yield _steering_wheel(dash - 0.12, 0.42 * design.half_m, belt - 0.03)
    last = max(design.x(design.roof_end) + 0.33, design.x(design.windows_to) + 0.55)
    places = [front - _ROW_M * k for k in range(3) if k == 0 or front - _ROW_M * k > last]
    crown = min(belt + 0.43, top - 0.14)
    for k, x in enumerate(places):
        for sign in (1.0, -1.0):
            y = sign * (0.44 if k == 0 else 0.48) * design.half_m
            yield from _seat(x, y, floor, crown)


def _linings(
    design: Design, wide_m: float, floor_m: float, ends_m: tuple[float, float]
) -> Iterator[Patch]:
    """Dark trim inside doors, up to the windows, and a shelf under the rear window."""
    shoulder = design.shoulder()
    steps = np.linspace(*ends_m, 4)
    for low, high in pairwise(steps):
        top = float(min(shoulder(np.array([low, high])))) + 0.02
        for y in (-wide_m - 0.06, wide_m - 0.02):
            yield block((low, y, floor_m), (high, y + 0.08, top), 0.0, Slot.INTERIOR)
    # The body is round behind: narrower there.
    top, half = design.tail_m + 0.02, 0.72 * wide_m
    rear = design.x(design.rear_base) + 0.2
    yield block((rear, -half, floor_m), (rear + 0.34, half, top), 0.0, Slot.INTERIOR)


def _seat(x_m: float, y_m: float, floor_m: float, crown_m: float) -> Iterator[Patch]:
    back = block((-0.07, -0.23, 0.0), (0.07, 0.23, crown_m - 0.2 - floor_m), 0.0, Slot.INTERIOR)
    yield back.rotated("y", -0.22).moved(x_m, y_m, floor_m)
    lean = 0.22 * (crown_m - floor_m)
    yield block(
        (x_m - lean - 0.05, y_m - 0.13, crown_m - 0.18),
        (x_m - lean + 0.05, y_m + 0.13, crown_m),
        0.0,
        Slot.INTERIOR,
    )


def _steering_wheel(x_m: float, y_m: float, z_m: float) -> Patch:
    """A ring of 0.37 m, tilted towards the driver."""
    turn = np.linspace(0.0, 2.0 * math.pi, 9)
    path = 0.185 * np.stack([0.0 * turn, np.cos(turn), np.sin(turn)], axis=1)
    ring = sweep(path, circle(0.015, 4), up=(1.0, 0.0, 0.0), capped=False, slot=Slot.INTERIOR)
    return ring.rotated("y", 0.4).moved(x_m, y_m, z_m)
