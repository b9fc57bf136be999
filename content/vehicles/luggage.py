"""Luggage of cyclists: bags at the rear wheel and on the back."""

from gen_data.content.procedural import material_presets, patches
from gen_data.content.procedural.surface_shapes import block
from gen_data.content.vehicles.rider import Seat
from gen_data.content.vehicles.vehicle_materials import COLORS
from gen_data.content.vehicles.vehicle_materials import VehicleSlot as Slot
from gen_data.core import se3, variant_rng

BACKPACK, PANNIERS, BOTH_SIDES = 0.4, 0.45, 0.6
"""Shares of riders with a backpack, of carriers with panniers, and of these with two; assumed."""
_SLOT = Slot.SOFT_TOP
"""Slot of canvas, which two-wheelers have no other use for."""


def draw_color(rng: variant_rng.VariantRng) -> se3.Vec3:
    """Colour of the luggage, linear RGB."""
    return material_presets.hex_to_linear(rng.choose(COLORS["luggage"]))


def backpack(seat: Seat, rng: variant_rng.VariantRng) -> patches.Patch:
    """A bag on the rider's back."""
    depth, width, height = (rng.between(0.12, 0.2), rng.between(0.28, 0.34), rng.between(0.4, 0.5))
    back = -0.1
    bag = block((back - depth, -0.5 * width, 0.08), (back, 0.5 * width, 0.08 + height), 0.05, _SLOT)
    return bag.rotated("y", seat.lean_rad).moved(*seat.hips)


def panniers(carrier: se3.Vec3, rng: variant_rng.VariantRng) -> list[patches.Patch]:
    """Bags that hang from a carrier whose middle is given, on one side or both."""
    x, _, z = carrier
    length, width, height = (
        rng.between(0.28, 0.36),
        rng.between(0.12, 0.18),
        rng.between(0.3, 0.4),
    )
    first = 1.0 if rng.chance(0.5) else -1.0
    sides = (first, -first) if rng.chance(BOTH_SIDES) else (first,)
    bags = []
    for side in sides:
        inner, outer = sorted((side * 0.075, side * (0.075 + width)))
        low = (x - 0.6 * length, inner, z - height)
        bags.append(block(low, (x + 0.4 * length, outer, z + 0.01), 0.04, _SLOT))
    return bags


def rear_carrier(axle_m: float, wheel_m: float) -> se3.Vec3:
    """Middle of the carrier over the rear wheel, in the bicycle's frame."""
    return (-axle_m, 0.0, 2.0 * wheel_m + 0.07)
