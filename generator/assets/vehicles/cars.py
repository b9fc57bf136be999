"""Private cars of five body styles, delivery vans and minibuses, after common European models."""

from __future__ import annotations

from dataclasses import replace

from gen_data.generator.assets.procedural.family import Facts, Solid
from gen_data.generator.assets.procedural.material_presets import hex_to_linear
from gen_data.generator.assets.procedural.variant_rng import VariantRng, in_turn, variant_rng
from gen_data.generator.assets.vehicles.bodywork import DESIGNS, Design, make_vehicle
from gen_data.generator.assets.vehicles.vehicle_materials import COLORS, draw_paint, materials

CARS = ("hatchback", "sedan", "estate", "suv", "coupe")
VANS = ("panel_van", "minibus", "high_roof")


def car(seed: int, steer_deg: float) -> Solid:
    """A car. Slots and keypoints are those of all vehicles; positive steering turns to the left."""
    rng = variant_rng("car", seed)
    design = _vary_car(DESIGNS[in_turn(CARS, seed)], rng)
    return make_vehicle(design, steer_deg, materials(rng, draw_paint(rng)))


def van(seed: int, steer_deg: float) -> Solid:
    """A van. Slots and keypoints are those of all vehicles; positive steering turns to the left."""
    rng = variant_rng("van", seed)
    design = _vary_van(DESIGNS[in_turn(VANS, seed)], rng)
    draw = float(rng.random())
    white, fleet = hex_to_linear("#e6e7e6"), hex_to_linear(rng.choose(COLORS["fleets"]))
    paint = white if draw < 0.55 else (fleet if draw < 0.75 else draw_paint(rng))
    return make_vehicle(design, steer_deg, materials(rng, paint))


def car_facts(seed: int, **_: object) -> Facts:
    """Its body style."""
    return Facts(in_turn(CARS, seed))


def van_facts(seed: int, **_: object) -> Facts:
    """Its kind."""
    return Facts(in_turn(VANS, seed))


def _vary_car(design: Design, rng: VariantRng) -> Design:
    """The design stretched, raised and restyled a little."""
    long, wide, high = (1.0 + rng.between(-share, share) for share in (0.04, 0.02, 0.02))
    shift = rng.between(-0.012, 0.012)
    rise = rng.between(-0.02, 0.03)
    return replace(
        design,
        length_m=design.length_m * long,
        width_m=design.width_m * wide,
        height_m=max(1.402, design.height_m * high),
        wheelbase_m=design.wheelbase_m * long,
        front_axle_m=design.front_axle_m * long,
        wheel_radius_m=design.wheel_radius_m + rng.between(-0.01, 0.012),
        spokes=rng.choose((5, 5, 6, 7, 8, 10, 0)),
        nose_m=design.nose_m + rise,
        belt_m=design.belt_m + 0.5 * rise,
        tail_m=design.tail_m + rise,
        cowl=design.cowl + shift,
        header=design.header + shift,
        roof_end=design.roof_end + rng.between(-0.015, 0.01),
        lamp_m=(design.lamp_m[0] + rise, design.lamp_m[1] + rise),
        rails=design.rails and rng.chance(0.7),
    )


def _vary_van(design: Design, rng: VariantRng) -> Design:
    """The design stretched and raised a little."""
    long, high = 1.0 + rng.between(-0.05, 0.08), 1.0 + rng.between(-0.015, 0.05)
    return replace(
        design,
        length_m=design.length_m * long,
        height_m=design.height_m * high,
        wheelbase_m=design.wheelbase_m * long,
        front_axle_m=design.front_axle_m * long,
        cladding=rng.chance(0.4),
        wheel_radius_m=design.wheel_radius_m + rng.between(-0.01, 0.01),
    )
