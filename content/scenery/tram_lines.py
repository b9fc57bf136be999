"""Poles of tramways; heights and thicknesses are assumed, 10 %."""

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import painted_material
from gen_data.content.procedural.surface_shapes import block, cone
from gen_data.content.scenery.basic_shapes import make_solid
from gen_data.core.variant_rng import VariantRng

ANCHOR_M, POLE_M = 6.9, 7.2
"""Heights of the cross wire's ends, and of the poles."""


def tram_pole(rng: VariantRng) -> Solid:
    """A steel pole that holds a cross wire. Slots: paint, foot."""
    foot = rng.between(0.11, 0.14, "foot_m")
    parts = [
        cone((foot, 0.0), (0.62 * foot, POLE_M), 10),
        block((-0.22, -0.22, 0.0), (0.22, 0.22, 0.08), 0.0, 1),
        cone((0.75 * foot, ANCHOR_M - 0.06), (0.75 * foot, ANCHOR_M + 0.06), 8, 1),
    ]
    paint = rng.choose(("#3c4a42", "#5b6062", "#2a2d2f", "#8b9092"))
    materials = (painted_material(paint, 0.5), painted_material("#6f7274", 0.7))
    hull = hulls.box((-foot, -foot, 0.0), (foot, foot, POLE_M))
    return make_solid(parts, materials, [hull])
