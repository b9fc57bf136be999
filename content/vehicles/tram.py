"""Low-floor trams of 27 to 35 m in three or five sections, with a raised pantograph.

Sizes: 2.30 m wide and 30 m long (Ruhrbahn's tender of 2019 for Essen and Krefeld), 2.65 m wide and
29 m long (GT6-70D/N, Karlsruhe), floors 0.35 m above the rails; other measures assumed, 10 %.
"""

from itertools import pairwise

import numpy as np

from gen_data.assets.family import Facts, Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import hex_to_linear
from gen_data.content.procedural.patches import Patch
from gen_data.content.procedural.surface_shapes import block
from gen_data.content.scenery.basic_shapes import make_solid
from gen_data.content.scenery.clutter_shapes import bar
from gen_data.content.vehicles.body_shell import (
    BodyOutline,
    body_rows,
    drop_uvs,
    level_height,
    mirror_half,
    paint,
    plan,
    stack,
)
from gen_data.content.vehicles.vehicle_materials import COLORS, SIDES, materials
from gen_data.content.vehicles.vehicle_materials import VehicleSlot as Slot
from gen_data.core.asset_types import Keypoint
from gen_data.core.variant_rng import VariantRng

WIRE_M = 5.5
"""Height of the contact wire, at which the pantograph's head is (assumed, 10 %)."""
_WIDTHS_M = (2.3, 2.4, 2.65)
_FLOOR_M, _TOP_M = 0.16, 3.25
_SILL_M, _LINTEL_M = 1.0, 2.62
"""Windows from sill to lintel."""


def tram(rng: VariantRng) -> Solid:
    """A tram with doors on both sides. Slots and keypoints as for all vehicles."""
    half, x = 0.5 * rng.turn(_WIDTHS_M, "width_m"), 0.5 * rng.between(27.0, 35.0, "length_m")
    joints = np.linspace(-x, x, (3 if rng.seed % 2 else 5) + 1)[1:-1].tolist()
    main, second = (hex_to_linear(code) for code in rng.choose(COLORS["liveries"]).split())
    shell = [_body(half, x, joints, rng), *_running_gear(x)]
    shell += [*_roof(half, x, joints, rng), *_ends(x)]
    parts = [drop_uvs(part) for part in shell]
    hull = [
        hulls.box((-x, -half, _FLOOR_M), (x, half, _TOP_M)),
        hulls.box((-x + 2.0, -0.8, 0.0), (x - 2.0, 0.8, _FLOOR_M)),
    ]
    whole = [*parts, *(drop_uvs(part) for part in _pantograph())]
    return make_solid(whole, materials(rng, main, second), hull, _keypoints(half, x), parts)


def tram_facts(seed: int) -> Facts:
    """The number of sections."""
    return Facts("low_floor_tram", {"sections": "3" if seed % 2 else "5"})


def _body(half: float, x: float, joints: list[float], rng: VariantRng) -> Patch:
    """The shell: bands of paint, windows, doors, and dark bellows at the joints."""
    ring = plan((22.0, 2.4), (22.0, 2.4), sides=6)
    rows = body_rows("tram", x, -x, half)
    left = stack(ring, rows, level_height(_FLOOR_M), level_height(_TOP_M), crown_m=0.06, lid_rows=1)
    if rng.chance(0.5):
        left = paint(left, Slot.SECOND_PAINT, z=(None, _SILL_M - 0.12))
    left = paint(left, Slot.TRIM, z=(None, 0.34))
    left = paint(left, Slot.SECOND_PAINT, z=(_LINTEL_M + 0.18, _TOP_M - 0.2))
    left = _paint_ends(left, ring, x)
    left = paint(left, Slot.GLASS, x=(-x + 2.0, x - 2.0), z=(_SILL_M, _LINTEL_M))
    borders = [-x + 0.6, *joints, x - 0.6]
    for start, end in pairwise(borders):
        middle = 0.5 * (start + end)
        left = paint(left, Slot.GLASS, x=(middle - 0.65, middle + 0.65), z=(0.4, _LINTEL_M))
    for joint in joints:
        left = paint(left, Slot.TRIM, x=(joint - 0.3, joint + 0.3))
    return mirror_half(left, SIDES)


def _paint_ends(left: Patch, ring: BodyOutline, x: float) -> Patch:
    """Windscreens, lamps and displays: lamps for both directions, red ones at the rear."""
    ahead, behind = (x - 2.0, None), (None, -x + 2.0)
    left = paint(left, Slot.GLASS, x=ahead, z=(_SILL_M, _LINTEL_M))
    left = paint(left, Slot.GLASS, x=behind, z=(_SILL_M, _LINTEL_M))
    lamp, wink = (ring.front(0.5), ring.front(0.72)), (ring.front(0.74), ring.front(0.84))
    left = paint(left, Slot.HEADLIGHT, ring=lamp, x=ahead, z=(0.62, 0.8))
    left = paint(left, Slot.INDICATOR_LEFT, ring=wink, x=ahead, z=(0.62, 0.8))
    lamp, wink = (ring.rear(0.72), ring.rear(0.5)), (ring.rear(0.84), ring.rear(0.74))
    left = paint(left, Slot.TAILLIGHT, ring=lamp, x=behind, z=(0.62, 0.8))
    left = paint(left, Slot.BRAKELIGHT, ring=lamp, x=behind, z=(0.82, 0.92))
    return paint(left, Slot.INDICATOR_LEFT, ring=wink, x=behind, z=(0.62, 0.8))


def _running_gear(x: float) -> list[Patch]:
    parts = []
    for at in (-x + 4.5, 0.0, x - 4.5):
        parts.append(block((at - 1.3, -0.8, 0.0), (at + 1.3, 0.8, 0.3), 0.0, Slot.UNDERBODY))
    return parts


def _roof(half: float, x: float, joints: list[float], rng: VariantRng) -> list[Patch]:
    """Boxes of air conditioning and electrics on the roofs of the sections."""
    borders, parts = [-x + 2.2, *joints, x - 2.2], []
    for start, end in pairwise(borders):
        low, high = start + 0.5, end - 0.5
        top = _TOP_M + rng.between(0.18, 0.34)
        reach = half - rng.between(0.2, 0.35)
        part = block((low, -reach, _TOP_M - 0.06), (high, reach, top), 0.05, Slot.SECOND_PAINT)
        parts.append(part)
    return parts


def _ends(x: float) -> list[Patch]:
    """Couplings' covers, and pillars of the windscreens with their displays."""
    parts = []
    for way in (1.0, -1.0):
        low, high = sorted((way * (x - 1.1), way * (x - 0.55)))
        parts.append(block((low, -0.6, 2.45), (high, 0.6, 2.62), 0.0, Slot.TRIM))
        low, high = sorted((way * (x - 0.3), way * x))
        parts.append(block((low, -0.35, 0.25), (high, 0.35, 0.5), 0.0, Slot.TRIM))
    return parts


def _pantograph() -> list[Patch]:
    """A half-scissor arm from the roof to the contact wire."""
    foot, knee, head = (-0.6, _TOP_M + 0.3), (0.75, 0.5 * (_TOP_M + WIRE_M) + 0.1), (-0.1, WIRE_M)
    parts = [block((-0.8, -0.45, _TOP_M), (0.8, 0.45, _TOP_M + 0.36), 0.0, Slot.UNDERBODY)]
    for y in (-0.18, 0.18):
        parts.append(bar((foot[0], y, foot[1]), (knee[0], 0.5 * y, knee[1]), 0.03, 4, Slot.TRIM))
        parts.append(bar((knee[0], 0.5 * y, knee[1]), (head[0], 2.0 * y, head[1] - 0.08), 0.02, 4,
                         Slot.TRIM))  # fmt: skip
    for k in (-0.2, 0.2):
        parts.append(block((head[0] + k - 0.03, -0.55, WIRE_M - 0.05),
                           (head[0] + k + 0.03, 0.55, WIRE_M), 0.0, Slot.TRIM))  # fmt: skip
        for way in (1.0, -1.0):
            outer = (head[0] + k, way * 0.8, WIRE_M - 0.22)
            parts.append(bar((head[0] + k, way * 0.55, WIRE_M - 0.03), outer, 0.02, 4, Slot.TRIM))
    parts.append(bar((head[0] - 0.2, 0.0, WIRE_M - 0.08), (head[0] + 0.2, 0.0, WIRE_M - 0.08), 0.02,
                     4, Slot.TRIM))  # fmt: skip
    return parts


def _keypoints(half: float, x: float) -> tuple[Keypoint, ...]:
    places = (
        ("wheel_front", (x - 4.5, half, 0.3), 0.4),
        ("wheel_rear", (-x + 4.5, half, 0.3), 0.4),
        ("headlight", (x - 0.3, 0.6 * half, 0.71), 0.3),
        ("taillight", (-x + 0.3, 0.6 * half, 0.71), 0.3),
    )
    return tuple(
        Keypoint(f"{name}_{side}", (px, sign * py, pz), radius)
        for name, (px, py, pz), radius in places
        for side, sign in (("left", 1.0), ("right", -1.0))
    )
