"""Delivery vans and minibuses; proportions after common European models."""

from __future__ import annotations

from dataclasses import replace

from gen_data.generator.assets.procedural.family import Facts, Solid
from gen_data.generator.assets.procedural.material_presets import hex_to_linear
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

STYLES = ("panel_van", "minibus", "high_roof")

_FLEET = ("#f0c419", "#7a4a24", "#1e5aa8", "#c8281e")
_PANEL = Design(
    length_m=5.3,
    width_m=1.98,
    height_m=2.05,
    wheelbase_m=3.2,
    front_axle_m=0.98,
    wheel_radius_m=0.34,
    spokes=0,
    clearance_m=0.18,
    nose_m=1.02,
    cowl_m=1.16,
    belt_m=1.17,
    tail_m=1.18,
    cowl=0.15,
    header=0.315,
    roof_end=0.965,
    rear_base=0.992,
    waist_share=0.965,
    roof_share=0.83,
    body_ends=((8.0, 2.8), (30.0, 8.0)),
    house_ends=((10.0, 2.6), (24.0, 7.0)),
    seams=(0.26, 0.43, 0.66),
    pillars=(0.435,),
    windows_to=0.42,
    rear_window=True,
    cladding=False,
    rails=False,
    lamp_m=(0.88, 1.02),
    upright_lamps=True,
)
_DESIGNS = {
    "panel_van": _PANEL,
    "minibus": replace(_PANEL, pillars=(0.435, 0.67), windows_to=0.95, spokes=5),
    "high_roof": replace(
        _PANEL, length_m=5.95, width_m=2.02, height_m=2.55, wheelbase_m=3.65, front_axle_m=1.0,
        wheel_radius_m=0.345, nose_m=1.06, cowl_m=1.22, belt_m=1.25, tail_m=1.26, cowl=0.125,
        header=0.31, seams=(0.225, 0.385, 0.6), pillars=(), windows_to=0.4, rear_window=False,
        roof_share=0.85, lamp_m=(0.9, 1.08),
    ),
}  # fmt: skip


def van(seed: int, steer_deg: float) -> Solid:
    """A van. Slots and keypoints as every vehicle's; positive steering turns to the left."""
    rng = variant_rng("van", seed)
    design = _drawn(_DESIGNS[_style(seed)], rng)
    draw = float(rng.random())
    white, fleet = hex_to_linear("#e6e7e6"), hex_to_linear(choose(_FLEET, rng))
    paint = white if draw < 0.55 else (fleet if draw < 0.75 else draw_paint(rng))
    finish = materials(rng, paint)
    return make_solid([bodywork(design, steer_deg)], finish, collision(design), keypoints(design))


def van_facts(seed: int, **_: object) -> Facts:
    """Its kind."""
    return Facts(_style(seed))


def _style(seed: int) -> str:
    return STYLES[seed % len(STYLES)]


def _drawn(design: Design, rng: Rng) -> Design:
    """The design stretched and raised a little."""
    long, high = 1.0 + uniform_between(-0.05, 0.08, rng), 1.0 + uniform_between(-0.015, 0.05, rng)
    return replace(
        design,
        length_m=design.length_m * long,
        height_m=design.height_m * high,
        wheelbase_m=design.wheelbase_m * long,
        front_axle_m=design.front_axle_m * long,
        cladding=is_drawn(0.4, rng),
        wheel_radius_m=design.wheel_radius_m + uniform_between(-0.01, 0.01, rng),
    )
