"""Material slots that all vehicles share, and their materials."""

from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any

import numpy as np

from gen_data.config.data_files import load_table
from gen_data.content.procedural.material_presets import hex_to_linear
from gen_data.content.vehicles import plates
from gen_data.core import asset_types, se3, variant_rng


class VehicleSlot(IntEnum):
    """Index of a material in the result of ``materials``."""

    PAINT = 0
    GLASS = 1
    TRIM = 2
    UNDERBODY = 3
    TYRE = 4
    RIM = 5
    HEADLIGHT = 6
    TAILLIGHT = 7
    BRAKELIGHT = 8
    INDICATOR_LEFT = 9
    INDICATOR_RIGHT = 10
    PLATE = 11
    CHROME = 12
    SECOND_PAINT = 13
    SKIN = 14
    TOP = 15
    BOTTOM = 16
    SHOES = 17
    HELMET = 18
    HOUSING = 19
    CLEAR_LENS = 20
    PLASTIC = 21
    INTERIOR = 22
    REAR_PLATE = 23
    LIVERY = 24
    BLUE_BEACON = 25
    AMBER_BEACON = 26
    ROOF_SIGN = 27
    SOFT_TOP = 28
    SPOKE = 29


COLORS = load_table(__package__, "colors", tuple[str, ...])
_MATERIALS = load_table(__package__, "materials", asset_types.Material)
_WORN = tuple(VehicleSlot)[VehicleSlot.SKIN : VehicleSlot.HELMET + 1]
"""Slots of a rider."""
PRINTED = (VehicleSlot.PLATE, VehicleSlot.REAR_PLATE, VehicleSlot.LIVERY)
"""Slots whose texture coordinates are kept."""
SIDES = ((VehicleSlot.INDICATOR_LEFT, VehicleSlot.INDICATOR_RIGHT),)
"""Slots that a mirror image exchanges."""


def draw_paint(rng: variant_rng.VariantRng) -> se3.Vec3:
    """Colour of a private car, linear RGB."""
    weights, codes = zip(*(row.split() for row in COLORS["cars"]), strict=True)
    shares = np.cumsum([float(weight) for weight in weights])
    index = int(np.searchsorted(shares, float(rng.random()), side="right"))
    return hex_to_linear(codes[min(index, len(codes) - 1)])


@dataclass(frozen=True)
class Print:
    """Print on vehicles that randomizers must not paint over.

    Attributes:
        livery: Texture of the slot ``LIVERY``; empty = none.
        fixed: Whether paint and second paint belong to the vehicle's task, as on taxis.
        sign: Colour of a roof sign, linear RGB.
        plate_rows: Rows of the licence plate.
    """

    livery: str = ""
    fixed: bool = False
    sign: se3.Vec3 = (0.8, 0.62, 0.08)
    plate_rows: int = 1


PLAIN = Print()


def materials(
    rng: variant_rng.VariantRng,
    paint: se3.Vec3,
    second: se3.Vec3 = (0.8, 0.8, 0.78),
    clothes: tuple[se3.Vec3, ...] = (),
    printed: Print = PLAIN,
) -> tuple[asset_types.Material, ...]:
    """One material per slot; colours are linear RGB.

    Args:
        rng: Draws gloss, tint and licence plate.
        paint: Colour of the body.
        second: Colour of the load box, or a stripe.
        clothes: Skin, top, bottom, shoes and helmet of a rider.
        printed: Livery, roof sign, and rows of the licence plate.
    """
    tint = rng.between(0.015, 0.035)
    rim = rng.between(0.35, 0.75) if rng.random() < 0.75 else 0.04
    gloss, plate = rng.between(0.15, 0.25), int(rng.random() * plates.SEEDS)
    rows = printed.plate_rows
    drawn: dict[VehicleSlot, dict[str, Any]] = {
        VehicleSlot.PAINT: {"base_color": paint, "roughness": gloss, "printed": printed.fixed},
        VehicleSlot.GLASS: {"base_color": (tint, 1.1 * tint, 1.15 * tint)},
        VehicleSlot.RIM: {"base_color": (rim, rim, 1.02 * rim)},
        VehicleSlot.PLATE: {"texture": plates.plate_id(plate, rows)},
        VehicleSlot.REAR_PLATE: {"texture": plates.plate_id(plate, rows, rear=1)},
        VehicleSlot.SECOND_PAINT: {"base_color": second, "printed": printed.fixed},
        VehicleSlot.LIVERY: {"texture": printed.livery},
        VehicleSlot.ROOF_SIGN: {"base_color": printed.sign},
    }
    for slot, color in zip(_WORN, clothes or ((0.4,) * 3,) * 5, strict=True):
        drawn[slot] = {"base_color": color}
    return tuple(
        replace(_MATERIALS[slot.name.lower()], **drawn.get(slot, {})) for slot in VehicleSlot
    )
