"""Farm tractors with a cab, a bonnet and large rear wheels.

Sizes of tractors of 70 to 150 kW: 4 to 5 m long, 2.3 to 2.55 m wide, 2.7 to 3.1 m high, rear tyres
of 1.65 to 1.9 m; assumed, 10 %. At most 2.55 m wide (Directive 96/53/EC for trucks; assumed for
tractors).
"""

import math

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import hex_to_linear
from gen_data.content.procedural.patches import Patch
from gen_data.content.procedural.surface_shapes import block, cone, lathe, sweep
from gen_data.content.scenery.basic_shapes import make_solid
from gen_data.content.vehicles import body_shell, wheels
from gen_data.content.vehicles.vehicle_materials import VehicleSlot as Slot
from gen_data.content.vehicles.vehicle_materials import materials
from gen_data.core.asset_types import Keypoint
from gen_data.core.variant_rng import VariantRng

_COLORS = ("#2f6b2f", "#a3221c", "#1f4f8f", "#c9541a", "#8f9598", "#5f8f2f")
_HALF_M = 1.2
"""Half of the width over the tyres."""


def tractor(rng: VariantRng) -> Solid:
    """A tractor without implements. Slots and keypoints as for all vehicles."""
    x = 0.5 * rng.between(4.1, 4.8, "depth_m")
    rear, front = rng.between(0.84, 0.95, "rear_m"), rng.between(0.55, 0.68, "front_m")
    top = rng.between(2.75, 3.05, "top_m")
    rear_x, front_x = -x + rear + 0.12, x - front - 0.28
    parts = [*_wheels(rear_x, rear, front_x, front)]
    parts += _bonnet(rear_x + 0.85, x, rng)
    parts += _cab(rear_x - 0.55, rear_x + 0.95, top)
    parts += _fenders(rear_x, rear)
    parts += _lamps(x, rear_x, rear, top)
    paint = hex_to_linear(rng.choose(_COLORS))
    finish = materials(rng, paint, hex_to_linear(rng.choose(("#e9e9e4", "#d9b520", "#26282a"))))
    hull = [
        hulls.box((-x, -_HALF_M, 0.0), (rear_x + rear, _HALF_M, 2.0 * rear)),
        hulls.box((rear_x - 0.6, -0.85, 0.9), (rear_x + 1.0, 0.85, top)),
        hulls.box((rear_x, -0.95, 0.0), (x, 0.95, 1.75)),
    ]
    body = [body_shell.drop_uvs(p) for p in parts]
    whole = [*body, *(body_shell.drop_uvs(p) for p in _mirrors(rear_x + 0.95))]
    points = _keypoints(x, (rear_x, rear), (front_x, front))
    return make_solid(whole, finish, hull, points, body)


def _mirrors(x: float) -> list[Patch]:
    parts = []
    for sign in (1.0, -1.0):
        y = sorted((sign * 1.21, sign * 1.4))
        parts.append(block((x + 0.02, y[0], 1.95), (x + 0.09, y[1], 2.32), 0.02, Slot.TRIM))
        y = sorted((sign * 0.76, sign * 1.3))
        parts.append(block((x + 0.03, y[0], 2.32), (x + 0.07, y[1], 2.36), 0.0, Slot.TRIM))
    return parts


def _wheels(rear_x: float, rear: float, front_x: float, front: float) -> list[Patch]:
    """Wide tyres; the rear wheels are about half as large again as the front ones."""
    made = []
    for at, radius, width in ((rear_x, rear, 0.55), (front_x, front, 0.42)):
        one = wheels.wheel(radius, width, "steel")
        for sign in (1.0, -1.0):
            side = one if sign > 0.0 else one.rotated("z", math.pi)
            made.append(side.moved(at, sign * (_HALF_M - 0.5 * width), radius))
        beam = block((at - 0.12, -_HALF_M + 0.5, radius - 0.12), (at + 0.12, _HALF_M - 0.5,
                     radius + 0.12), 0.0, Slot.UNDERBODY)  # fmt: skip
        made.append(beam)
    return made


def _bonnet(rear_x: float, x: float, rng: VariantRng) -> list[Patch]:
    low, high, nose = 1.0, rng.between(1.6, 1.75, "bonnet_m"), x - 0.3
    side = np.array([(low, 0.0), (high, 0.0), (high - 0.08, nose - rear_x - 0.25),
                     (high - 0.3, nose - rear_x), (low, nose - rear_x)])  # fmt: skip
    path = np.array([(rear_x, -0.42, 0.0), (rear_x, 0.42, 0.0)])
    # The section's first axis is Z; its second runs along X.
    hood = sweep(path, side, up=(0.0, 0.0, 1.0), slot=Slot.PAINT)
    exhaust = cone((0.06, 1.6), (0.06, 2.6), 10, Slot.CHROME).moved(rear_x + 0.12, -0.62)
    return [
        hood,
        block((rear_x - 0.4, -0.3, 0.55), (nose - 0.05, 0.3, low), 0.0, Slot.UNDERBODY),
        block((nose - 0.02, -0.36, low + 0.05), (nose + 0.015, 0.36, high - 0.36), 0.0, Slot.TRIM),
        block((nose, -0.35, 0.6), (x, 0.35, 0.98), 0.03, Slot.UNDERBODY),
        block((rear_x + 0.05, -0.66, 1.5), (rear_x + 0.2, -0.4, 1.62), 0.0, Slot.TRIM),
        exhaust,
    ]


def _cab(rear_x: float, front_x: float, top: float) -> list[Patch]:
    """Panes between four posts under a roof that stands out."""
    half, low, eaves = 0.8, 1.3, top - 0.2
    parts = [
        block((rear_x - 0.1, -half - 0.06, eaves), (front_x + 0.12, half + 0.06, top - 0.02), 0.06,
              Slot.SECOND_PAINT),
        block((rear_x, -half, 0.95), (front_x, half, low), 0.02, Slot.PAINT),
        block((rear_x + 0.04, -half + 0.04, low), (front_x - 0.04, half - 0.04, eaves), 0.0,
              Slot.GLASS),
        block((rear_x + 0.25, -0.25, low), (rear_x + 0.75, 0.25, low + 0.02), 0.0, Slot.TRIM),
    ]  # fmt: skip
    for at in (rear_x, front_x - 0.07, 0.5 * (rear_x + front_x) - 0.1):
        for sign in (1.0, -1.0):
            y = sorted((sign * (half - 0.08), sign * half))
            parts.append(block((at, y[0], low), (at + 0.07, y[1], eaves), 0.0, Slot.TRIM))
    beacon = lathe([(0.08, 0.0), (0.07, 0.13), (0.0, 0.16)], 10, Slot.AMBER_BEACON)
    parts.append(beacon.moved(rear_x + 0.15, 0.55, top - 0.16))
    return parts


def _fenders(rear_x: float, radius: float) -> list[Patch]:
    turns = np.linspace(0.12 * math.pi, 0.9 * math.pi, 7)
    reach = radius + 0.1
    parts = []
    for a, b in zip(turns[:-1].tolist(), turns[1:].tolist(), strict=True):
        middle, half = 0.5 * (a + b), reach * math.sin(0.5 * (b - a)) + 0.02
        for sign in (1.0, -1.0):
            y = sorted((sign * 0.72, sign * (_HALF_M - 0.04)))
            plate = block((-half, y[0], -0.02), (half, y[1], 0.02), 0.0, Slot.PAINT)
            plate = plate.rotated("y", 0.5 * math.pi - middle)
            parts.append(plate.moved(rear_x + reach * math.cos(middle), 0.0,
                                     radius + reach * math.sin(middle)))  # fmt: skip
    return parts


def _lamps(x: float, rear_x: float, rear: float, top: float) -> list[Patch]:
    nose, back = x - 0.28, rear_x - rear - 0.06
    parts = [
        block((nose - 0.02, -0.26, 1.0), (nose + 0.02, 0.26, 1.1), 0.0, Slot.PLATE),
        block((rear_x - 0.63, -0.26, top - 0.42), (rear_x - 0.6, 0.26, top - 0.31), 0.0,
              Slot.REAR_PLATE),
    ]  # fmt: skip
    for sign, wink in ((1.0, Slot.INDICATOR_LEFT), (-1.0, Slot.INDICATOR_RIGHT)):
        y = sorted((sign * 0.23, sign * 0.41))
        parts.append(block((nose - 0.04, y[0], 1.2), (nose + 0.025, y[1], 1.34), 0.0,
                           Slot.HEADLIGHT))  # fmt: skip
        for slot, inner in ((Slot.TAILLIGHT, 0.78), (Slot.BRAKELIGHT, 0.9), (wink, 1.02)):
            y = sorted((sign * inner, sign * (inner + 0.11)))
            parts.append(block((back, y[0], 1.32), (back + 0.06, y[1], 1.44), 0.0, slot))
        y = sorted((sign * 0.44, sign * 0.58))
        parts.append(block((nose - 0.12, y[0], 1.24), (nose - 0.02, y[1], 1.36), 0.0, wink))
        y = sorted((sign * 0.38, sign * 0.58))
        parts.append(block((nose - 0.2, y[0], 1.26), (nose - 0.12, y[1], 1.34), 0.0, Slot.TRIM))
    return parts


def _keypoints(
    x: float, rear: tuple[float, float], front: tuple[float, float]
) -> tuple[Keypoint, ...]:
    (rear_x, rear_r), (front_x, front_r) = rear, front
    places = (
        ("wheel_front", (front_x, _HALF_M - 0.21, front_r), 0.3),
        ("wheel_rear", (rear_x, _HALF_M - 0.275, rear_r), 0.35),
        ("headlight", (x - 0.26, 0.32, 1.27), 0.2),
        ("taillight", (rear_x - rear_r - 0.06, 0.84, 1.38), 0.2),
    )
    return tuple(
        Keypoint(f"{name}_{side}", (px, sign * py, pz), radius)
        for name, (px, py, pz), radius in places
        for side, sign in (("left", 1.0), ("right", -1.0))
    )
