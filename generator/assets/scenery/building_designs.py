"""Designs of buildings, drawn from a style and a seed, and their materials.

Sizes follow German practice: storeys of 2.7-3.0 m in post-war and 3.4-3.8 m in nineteenth-century
houses, windows of 1.0-1.5 m by 1.2-1.9 m, sills 0.8-0.95 m above the floor.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from gen_data.generator.assets.procedural.data_tables import load_table
from gen_data.generator.assets.procedural.family import check_option
from gen_data.generator.assets.procedural.material_presets import (
    draw_linear,
    hex_to_linear,
    jitter_color,
    printed_material,
)
from gen_data.generator.assets.procedural.variant_rng import VariantRng, variant_rng
from gen_data.generator.core.asset_types import Material
from gen_data.generator.core.se3 import Vec3

STYLES = ("residential", "old_town", "modern", "commercial", "house")
RoofKind = Literal["gable", "hip", "mansard", "flat"]
Cladding = Literal["plaster", "brick", "concrete", "stone"]


@dataclass(frozen=True, slots=True)
class Design:
    """Measures and features that the parts of one building share.

    Attributes:
        bays: Windows per floor on the street side.
        ground_m, storey_m: Heights of the ground floor and of the others.
        window_m: Width and height of an ordinary window.
        sill_m: Height of window sills over the floor.
        panes: Panes beside and above one another.
        shops: Whether the ground floor is shops.
        trimmed: Whether windows have lintels and storeys are parted by string courses.
        shutters: ``none``, ``roller`` or ``leaves``.
        balconies: ``none``, ``french`` (railings before tall windows) or ``slab``.
        verge_m: How far the roof reaches over the side walls; 0 in a row of houses.
        sided: Whether side walls have windows.
        oriel: Number of the bay that projects over the pavement on the upper floors; -1 = none.
        gable_front: Whether the ridge runs across the street and the gable looks at it.
    """

    style: str
    width_m: float
    depth_m: float
    floors: int
    bays: int
    ground_m: float
    storey_m: float
    window_m: tuple[float, float]
    sill_m: float
    recess_m: float
    panes: tuple[int, int]
    roof: RoofKind
    cladding: Cladding
    shops: bool = False
    trimmed: bool = False
    shutters: Literal["none", "roller", "leaves"] = "none"
    balconies: Literal["none", "french", "slab"] = "none"
    pitch_rad: float = 0.7
    verge_m: float = 0.0
    dormers: int = 0
    sided: bool = False
    oriel: int = -1
    gable_front: bool = False

    @property
    def eaves_m(self) -> float:
        """Height of the walls."""
        return self.ground_m + (self.floors - 1) * self.storey_m


_STYLES = load_table(__package__, "building_styles", dict)
_COLORS = load_table(__package__, "building_colors", tuple[str, ...])


def draw_design(style: str, seed: int) -> Design:
    """The design of variant ``seed`` of a style. Raises AssetError for an unknown style."""
    check_option("building", "style", style, STYLES)
    values = _draw_fields(_STYLES[style], variant_rng(f"building/{style}", seed))
    bays, bay_m = values["bays"], values.pop("bay_m")
    low, high = values["width_m"]
    values["width_m"] = round(min(high, max(low, bays * bay_m)), 2)
    if "pier_m" in values:
        values["window_m"] = (round(bay_m - values.pop("pier_m"), 2), values["window_m"][1])
    values["oriel"] = {"middle": bays // 2, "last": bays - 2}.get(values.get("oriel", ""), -1)
    return Design(style=style, **values)


def _draw_fields(recipe: Mapping[str, Any], rng: VariantRng) -> dict[str, Any]:
    """A value for every field of a recipe, drawn in its order; see ``building_styles.yaml``."""
    values: dict[str, Any] = {}
    for name, item in recipe.items():
        if name == "variants":
            values |= _draw_fields(item["yes" if rng.chance(item["chance"]) else "no"], rng)
        else:
            values[name] = _draw_value(item, rng)
    return values


def _draw_value(item: Any, rng: VariantRng) -> Any:
    if isinstance(item, list):
        return tuple(_draw_value(part, rng) for part in item)
    if not isinstance(item, dict):
        return item
    if "choose" in item:
        return rng.choose(item["choose"])
    if "chance" in item:
        return rng.chance(item["chance"])
    value = rng.between(*item["uniform"])
    return round(value, item["digits"]) if "digits" in item else value


def building_materials(plan: Design, seed: int) -> tuple[Material, ...]:
    """The materials of a building, one per slot of ``facade``."""
    rng = variant_rng(f"building/{plan.style}/materials", seed)
    wall = _wall(plan.cladding, _COLORS[f"plaster_{plan.style}"], rng)
    base = _base(plan, wall, rng)
    trim_code = rng.choose(("#d9d4c8", "#c9bfae", "#b5a592", "#e3e0d8"))
    trim_code = rng.choose(("#a98d7c", "#b3a48e", trim_code)) if plan.trimmed else trim_code
    frame = rng.choose(_COLORS.get(f"frames_{plan.style}", _COLORS["frames"]))
    curtains = [jitter_color(hex_to_linear(code), 0.1, rng) for code in ("#8d8a82", "#6a6862")]
    cloth = _COLORS["cloth_" + ("shops" if plan.shops else plan.shutters)]
    seam = "#77797a" if plan.roof == "flat" else rng.choose(("#8a8c8d", "#7d5f4c", "#9a9c9b"))
    return (
        wall,
        base,
        _plain_material(trim_code, 0.85, "trim"),
        _plain_material(frame, 0.45, "trim"),
        _glass_material((0.012, 0.016, 0.019), 0.04),
        _glass_material((0.03, 0.034, 0.036), 0.06),
        _glass_material(curtains[0], 0.08),
        _glass_material(curtains[1], 0.08),
        _plain_material(rng.choose(_COLORS["doors"]), 0.5, "trim"),
        Material(hex_to_linear(seam), roughness=0.5, metallic=0.6, role="chrome"),
        _roof(rng),
        replace(printed_material(f"texture/shop_sign?seed={seed % 12}", 0.5), role="sign"),
        _plain_material(rng.choose(cloth), 0.7, "trim"),
        _textured_material("brick", 4, (0.8, 0.78, 0.76), 1.1, "trim"),
    )


def _wall(cladding: Cladding, tints: Sequence[str], rng: VariantRng) -> Material:
    if cladding == "brick":
        seed, level = rng.choose((4, 9, 12)), rng.between(0.75, 1.0)
        return _textured_material("brick", seed, (level, level, level), 1.1)
    if cladding == "concrete":
        level = rng.between(0.8, 1.0)
        return _textured_material("concrete", rng.choose((0, 3)), (level, level, level), 2.6)
    if cladding == "stone":
        return _textured_material("ashlar", 0, draw_linear(_COLORS["stones"], 0.06, rng), 2.4)
    return _textured_material("plaster", 5, draw_linear(tints, 0.05, rng), 2.5)


def _base(plan: Design, wall: Material, rng: VariantRng) -> Material:
    if plan.trimmed or plan.cladding == "stone":
        return _textured_material("ashlar", 0, draw_linear(_COLORS["stones"], 0.06, rng), 2.4)
    if rng.chance(0.4):
        return _textured_material("concrete", 3, (0.72, 0.71, 0.7), 2.2)
    darker = rng.between(0.5, 0.7)
    r, g, b = wall.base_color
    color = (darker * r, darker * g, darker * b)
    return Material(color, 0.9, texture=wall.texture, texture_scale_m=wall.texture_scale_m)


def _roof(rng: VariantRng) -> Material:
    color = draw_linear(_COLORS["roofs"], 0.08, rng)
    texture = f"texture/roof_tiles?seed={rng.choose((0, 1))}"
    return Material(color, roughness=0.85, texture=texture, role="roof")


def _plain_material(code: str, roughness: float, role: str) -> Material:
    return Material(hex_to_linear(code), roughness=roughness, role=role)


def _glass_material(color: Vec3, roughness: float) -> Material:
    return Material(color, roughness=roughness, specular=0.7, role="window")


def _textured_material(
    name: str, seed: int, color: Vec3, scale_m: float, role: str = "facade"
) -> Material:
    texture = f"texture/{name}?seed={seed}"
    return Material(color, roughness=0.92, texture=texture, texture_scale_m=scale_m, role=role)
