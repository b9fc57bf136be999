"""Private cars of five body styles; proportions after common European models."""

from __future__ import annotations

from dataclasses import replace

from gen_data.generator.assets.procedural.family import Facts, Solid
from gen_data.generator.assets.procedural.variant_rng import (
    choose,
    is_drawn,
    uniform_between,
    variant_rng,
)
from gen_data.generator.assets.scenery.basic_shapes import make_solid
from gen_data.generator.assets.vehicles.bodywork import Design, bodywork, collision, keypoints
from gen_data.generator.assets.vehicles.vehicle_materials import draw_paint, materials
from gen_data.generator.core.streams import Rng

STYLES = ("hatchback", "sedan", "estate", "suv", "coupe")

_SEDAN = Design(
    length_m=4.65,
    width_m=1.82,
    height_m=1.45,
    wheelbase_m=2.72,
    front_axle_m=0.88,
    wheel_radius_m=0.325,
    spokes=5,
    clearance_m=0.16,
    nose_m=0.73,
    cowl_m=0.94,
    belt_m=0.95,
    tail_m=1.0,
    cowl=0.255,
    header=0.44,
    roof_end=0.7,
    rear_base=0.875,
    waist_share=0.925,
    roof_share=0.66,
    body_ends=((8.0, 2.6), (9.0, 3.0)),
    house_ends=((9.0, 2.4), (9.0, 2.8)),
    seams=(0.31, 0.53, 0.755),
    pillars=(0.54,),
    windows_to=0.86,
    rear_window=True,
    cladding=False,
    rails=False,
    lamp_m=(0.66, 0.84),
    upright_lamps=False,
)
_DESIGNS = {
    "sedan": _SEDAN,
    "hatchback": replace(
        _SEDAN, length_m=4.1, width_m=1.77, height_m=1.47, wheelbase_m=2.55, front_axle_m=0.83,
        wheel_radius_m=0.31, nose_m=0.76, cowl_m=0.95, belt_m=0.96, tail_m=1.0, cowl=0.235,
        header=0.43, roof_end=0.87, rear_base=0.985, seams=(0.315, 0.56, 0.79), pillars=(0.57,),
        windows_to=0.93, lamp_m=(0.68, 0.86), body_ends=((8.0, 2.6), (11.0, 3.4)),
        house_ends=((9.0, 2.4), (11.0, 3.2)),
    ),
    "estate": replace(
        _SEDAN, length_m=4.68, height_m=1.48, roof_end=0.9, rear_base=0.985, windows_to=0.96,
        pillars=(0.54, 0.745), rails=True, body_ends=((8.0, 2.6), (12.0, 3.4)),
        house_ends=((9.0, 2.4), (12.0, 3.2)), lamp_m=(0.66, 0.86),
    ),
    "suv": replace(
        _SEDAN, length_m=4.5, width_m=1.86, height_m=1.68, wheelbase_m=2.68, front_axle_m=0.87,
        wheel_radius_m=0.355, clearance_m=0.18, nose_m=0.92, cowl_m=1.06, belt_m=1.07, tail_m=1.1,
        cowl=0.24, header=0.41, roof_end=0.89, rear_base=0.98, seams=(0.31, 0.535, 0.77),
        pillars=(0.545, 0.765), windows_to=0.955, cladding=True, rails=True, lamp_m=(0.8, 0.96),
        body_ends=((9.0, 2.8), (12.0, 3.4)), house_ends=((9.0, 2.5), (12.0, 3.2)),
    ),
    "coupe": replace(
        _SEDAN, length_m=4.4, width_m=1.82, height_m=1.4, wheelbase_m=2.62, front_axle_m=0.87,
        wheel_radius_m=0.33, clearance_m=0.145, nose_m=0.72, cowl_m=0.92, belt_m=0.93, tail_m=0.98,
        cowl=0.285, header=0.47, roof_end=0.66, rear_base=0.9, seams=(0.325, 0.63),
        pillars=(0.64,), windows_to=0.83, roof_share=0.64, lamp_m=(0.64, 0.83),
    ),
}  # fmt: skip


def car(seed: int, steer_deg: float) -> Solid:
    """A car. Slots and keypoints as every vehicle's; positive steering turns to the left."""
    rng = variant_rng("car", seed)
    design = _drawn(_DESIGNS[_style(seed)], rng)
    finish = materials(rng, draw_paint(rng))
    return make_solid([bodywork(design, steer_deg)], finish, collision(design), keypoints(design))


def car_facts(seed: int, **_: object) -> Facts:
    """Its body style."""
    return Facts(_style(seed))


def _style(seed: int) -> str:
    return STYLES[seed % len(STYLES)]


def _drawn(design: Design, rng: Rng) -> Design:
    """The design stretched, raised and restyled a little."""
    long, wide, high = (1.0 + uniform_between(-share, share, rng) for share in (0.04, 0.02, 0.02))
    shift = uniform_between(-0.012, 0.012, rng)
    rise = uniform_between(-0.02, 0.03, rng)
    return replace(
        design,
        length_m=design.length_m * long,
        width_m=design.width_m * wide,
        height_m=max(1.402, design.height_m * high),
        wheelbase_m=design.wheelbase_m * long,
        front_axle_m=design.front_axle_m * long,
        wheel_radius_m=design.wheel_radius_m + uniform_between(-0.01, 0.012, rng),
        spokes=choose((5, 5, 6, 7, 8, 10, 0), rng),
        nose_m=design.nose_m + rise,
        belt_m=design.belt_m + 0.5 * rise,
        tail_m=design.tail_m + rise,
        cowl=design.cowl + shift,
        header=design.header + shift,
        roof_end=design.roof_end + uniform_between(-0.015, 0.01, rng),
        lamp_m=(design.lamp_m[0] + rise, design.lamp_m[1] + rise),
        rails=design.rails and is_drawn(0.7, rng),
    )
