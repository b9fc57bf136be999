"""Delivery vans and minibuses; proportions after common European models."""

from __future__ import annotations

from dataclasses import replace

from gen_data.generator.assets.procedural.family import Facts, Solid
from gen_data.generator.assets.procedural.material_presets import hex_to_linear
from gen_data.generator.assets.procedural.variant_rng import VariantRng, in_turn, variant_rng
from gen_data.generator.assets.scenery.basic_shapes import make_solid
from gen_data.generator.assets.vehicles.bodywork import (
    DESIGNS,
    Design,
    bodywork,
    collision,
    keypoints,
)
from gen_data.generator.assets.vehicles.vehicle_materials import draw_paint, materials

STYLES = ("panel_van", "minibus", "high_roof")

_FLEET = ("#f0c419", "#7a4a24", "#1e5aa8", "#c8281e")


def van(seed: int, steer_deg: float) -> Solid:
    """A van. Slots and keypoints are those of all vehicles; positive steering turns to the left."""
    rng = variant_rng("van", seed)
    design = _vary_design(DESIGNS[in_turn(STYLES, seed)], rng)
    draw = float(rng.random())
    white, fleet = hex_to_linear("#e6e7e6"), hex_to_linear(rng.choose(_FLEET))
    paint = white if draw < 0.55 else (fleet if draw < 0.75 else draw_paint(rng))
    finish = materials(rng, paint)
    return make_solid([bodywork(design, steer_deg)], finish, collision(design), keypoints(design))


def van_facts(seed: int, **_: object) -> Facts:
    """Its kind."""
    return Facts(in_turn(STYLES, seed))


def _vary_design(design: Design, rng: VariantRng) -> Design:
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
