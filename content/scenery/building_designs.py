"""Designs of buildings, drawn from a style and a seed, and their materials.

Sizes follow German practice: storeys of 2.7-3.0 m in post-war and 3.4-3.8 m in nineteenth-century
houses, windows of 1.0-1.5 m by 1.2-1.9 m, sills 0.8-0.95 m above the floor.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from gen_data.assets.family import check_option
from gen_data.config.data_files import load_table
from gen_data.content.procedural import material_presets as presets
from gen_data.core.asset_types import Material
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng, variant_rng

STYLES = (
    "residential", "old_town", "modern", "commercial", "house", "villa", "farmhouse", "warehouse",
    "office", "campus", "tower",
)  # fmt: skip
REGIONS = ("central", "north", "south", "nordic", "east")
"""Palettes of walls and roofs; ``any`` leaves the choice to the seed."""
RoofKind = Literal["gable", "hip", "mansard", "flat"]
Cladding = Literal["plaster", "brick", "concrete", "stone", "boards", "sheet", "panels"]


@dataclass(frozen=True, slots=True)
class Design:
    """Dimensions and features shared by the parts of one building.

    Attributes:
        bays: Windows per floor on the street side.
        ground_m, storey_m: Heights of the ground floor and of the others.
        window_m: Width and height of an ordinary window.
        sill_m: Height of window sills over the floor.
        panes: Columns and rows of panes.
        shops: Whether the ground floor is shops.
        trimmed: Whether windows have lintels and storeys are parted by string courses.
        shutters: ``none``, ``roller`` or ``leaves``.
        balconies: ``none``, ``french`` (railings before tall windows) or ``slab``.
        verge_m: Overhang of the roof over the side walls; 0 in a row of houses.
        sided: Whether side walls have windows.
        oriel: Number of the bay that projects over the pavement on the upper floors; -1 = none.
        gable_front: Whether the ridge runs across the street and the gable faces it.
        ground: Use of the ground floor: ``dwelling`` (windows and a door), ``lobby`` (glass),
            ``garage`` (a garage door next to the windows) or ``gates``; shops if ``shops``.
        ribbons: Whether windows of a floor are one band around the building.
        surround: Surround of windows: ``none``, ``border`` or ``pediment``.
        arched: Whether windows have arches.
        timbered: Whether posts and beams show in the upper floors.
        quoins: Whether stones mark the corners.
        wing: Number of bays that project from the ground up, at one end; 0 = none.
        wing_out_m: Their projection.
        porch: Cover of the entrance: ``none``, ``canopy`` or ``columns``.
        age: 0 (new) to 1 (neglected): stains, repairs, cables, graffiti.
        fittings: 0 to 1: density of dishes, air conditioners and flower boxes.
        gate_m: Width of a fence between the building and its neighbour; 0 = none.
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
    ground: Literal["dwelling", "lobby", "garage", "gates"] = "dwelling"
    ribbons: bool = False
    surround: Literal["none", "border", "pediment"] = "none"
    arched: bool = False
    timbered: bool = False
    quoins: bool = False
    wing: int = 0
    wing_out_m: float = 0.0
    porch: Literal["none", "canopy", "columns"] = "none"
    age: float = 0.0
    fittings: float = 0.5
    gate_m: float = 0.0

    @property
    def eaves_m(self) -> float:
        """Height of the walls."""
        return self.ground_m + (self.floors - 1) * self.storey_m


_PLAIN_FROM = 19
"""Fronts with more windows than this have simpler ones, which bounds the size of meshes."""
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
    if values["cladding"] in ("sheet", "panels", "boards"):
        values["arched"] = False
    if bays * values["floors"] > _PLAIN_FROM:
        panes = (min(2, values["panes"][0]), min(2, values["panes"][1]))
        values |= {"arched": False, "fittings": min(0.2, values["fittings"]), "panes": panes}
        values["surround"] = "none" if values.get("trimmed") else values.get("surround", "none")
    if values.get("wing", 0) >= bays:
        values["wing"] = 0
    values["oriel"] = {"middle": bays // 2, "last": bays - 2}.get(values.get("oriel", ""), -1)
    return Design(style=style, **values)


def _draw_fields(recipe: Mapping[str, Any], rng: VariantRng) -> dict[str, Any]:
    """A value for every field of a recipe, drawn in its order; see ``building_styles.yaml``."""
    values: dict[str, Any] = {}
    for name, item in recipe.items():
        if name == "variants":
            values |= _draw_fields(item["yes" if rng.chance(item["chance"]) else "no"], rng)
        else:
            values[name] = _draw_value(item, rng, name)
    return values


def _draw_value(item: Any, rng: VariantRng, name: str = "") -> Any:
    if isinstance(item, list):
        return tuple(_draw_value(part, rng) for part in item)
    if not isinstance(item, dict):
        return item
    if "choose" in item:
        return rng.choose(item["choose"], name)
    if "chance" in item:
        return rng.chance(item["chance"], name)
    low, high = item["uniform"]
    value = rng.between(low, high, name)
    return round(value, item["digits"]) if "digits" in item else value


def building_materials(plan: Design, seed: int, region: str = "any") -> tuple[Material, ...]:
    """The materials of a building, one per slot of ``facade``. Raises AssetError for a region."""
    place = choose_region(plan.style, seed, region)
    rng = variant_rng(f"building/{plan.style}/materials", seed)
    tints = _COLORS.get(f"plaster_{plan.style}", ())
    # Buildings of these styles look alike in all regions.
    if plan.style not in ("modern", "commercial", "office", "tower") and rng.chance(0.7):
        tints = _COLORS[f"plaster_{place}"]
    wall = _wall(plan, tints or _COLORS[f"plaster_{place}"], rng)
    trim_code = rng.choose(_COLORS["trims_plain"])
    trim_code = rng.choose((*_COLORS["trims"], trim_code)) if plan.trimmed else trim_code
    trim_code = rng.choose(_COLORS["beams"]) if plan.timbered else trim_code
    frame = rng.choose(_COLORS.get(f"frames_{plan.style}", _COLORS["frames"]))
    cloth = _COLORS["cloth_" + ("shops" if plan.shops else plan.shutters)]
    seam = rng.choose(_COLORS["seams_flat" if plan.roof == "flat" else "seams"])
    kind = "office" if plan.style in ("office", "campus", "tower", "commercial") else "home"
    other = "office" if plan.style in ("office", "campus") else "home"
    views = [int(rng.random() * VIEWS) for _ in range(2)]
    prints = [f"texture/{name}?seed={int(rng.random() * PRINTS)}" for name in
              ("shop_sign", "wall_advert", "graffiti")]  # fmt: skip
    display = int(rng.random() * VIEWS)
    return (
        wall,
        _base(plan, wall, rng),
        _plain_material(trim_code, 0.85, "trim"),
        _plain_material(frame, 0.45, "trim"),
        _glass_material(f"texture/window_view?seed={views[0]}&kind=hall"),
        _glass_material(f"texture/window_view?seed={views[0]}&kind={kind}"),
        _glass_material(f"texture/window_view?seed={views[1]}&kind={other}"),
        _glass_material(f"texture/window_view?seed={display}&kind=shop"),
        _plain_material(rng.choose(_COLORS["doors"]), 0.5, "trim"),
        Material(presets.hex_to_linear(seam), roughness=0.5, metallic=0.6, role="chrome"),
        _roof(place, plan, rng),
        replace(presets.printed_material(prints[0], 0.5), role="trim"),
        _plain_material(rng.choose(cloth), 0.7, "trim"),
        _textured_material("brick", 4, (0.8, 0.78, 0.76), 1.1, "trim"),
        _plain_material(rng.choose(_COLORS["accents"]), 0.55, "trim"),
        presets.patterned_material(
            "texture/foliage?seed=0", 0.8, 0.8, presets.hex_to_linear(rng.choose(_COLORS["plants"]))
        ),
        _plain_material(rng.choose(_COLORS["flowers"]), 0.8, "trim"),
        replace(presets.printed_material(prints[1], 0.6), role="trim"),
        replace(presets.printed_material(prints[2], 0.7), role="trim"),
        _plain_material(rng.choose(("#1d1f22", "#2a2826", "#22303c")), 0.4, "trim"),
        _textured_material("concrete", 3, (0.8, 0.79, 0.77), 2.2, "trim"),
        _plain_material(rng.choose(("#e6e5e0", "#d8d6ce", "#cfd0cf")), 0.5, "trim"),
    )


TEXTURE_ALBEDOS = {
    "ashlar": 0.71, "concrete": 0.36, "profiled_sheet": 0.72, "roof_tiles": 0.53, "slates": 0.66,
    "wall_boards": 0.76, "weathered_plaster": 0.80,
}  # fmt: skip
"""Mean luminance of textures that palettes tint. Palettes state colours of whole walls and roofs:
white paint 0.5 to 0.9, brick 0.2 to 0.4, stone 0.2 to 0.35, concrete and roof tiles 0.1 to 0.35
(Oke, "Boundary layer climates", 1987, and Taha, "Urban climates and heat islands", 1997, as others
quote them); from memory, coloured paint 0.15 to 0.35, +- 0.1, and slate 0.1, +- 0.05. Undivided,
the texture would darken them twice."""

VIEWS, PRINTS = 8, 24
"""Textures of rooms, and of boards and adverts, that buildings share."""


def choose_region(style: str, seed: int, region: str) -> str:
    """The region of a variant. Raises AssetError for an unknown one."""
    if region == "any":
        return variant_rng(f"building/{style}/region", seed).choose(REGIONS)
    check_option("building", "region", region, ("any", *REGIONS))
    return region


def _wall(plan: Design, tints: Sequence[str], rng: VariantRng) -> Material:
    cladding = plan.cladding
    if cladding == "brick":
        # Colours with an albedo of 0.20 to 0.32; the darkest of Oke's brick walls have 0.20.
        seed, level = rng.choose((0, 2, 4, 6, 9, 12, 13)), rng.between(0.93, 1.0)
        return _textured_material("brick", seed, (level, level, level), 1.1)
    if cladding == "concrete":
        level = rng.between(0.8, 1.0)
        return _textured_material("concrete", rng.choose((0, 3)), (level, level, level), 2.6)
    if cladding == "stone":
        return _textured_material("ashlar", 0, _tint("ashlar", _COLORS["stones"], 0.06, rng), 2.4)
    if cladding == "boards":
        color = _tint("wall_boards", _COLORS["boards"], 0.1, rng)
        return _textured_material("wall_boards", rng.choose((0, 1, 2, 3)), color, 2.0)
    if cladding in ("sheet", "panels"):
        # Panels are of the two kinds of concrete whose mean is the table's.
        is_sheet = cladding == "sheet"
        name = "profiled_sheet" if is_sheet else "concrete"
        color = _tint(name, _COLORS["sheets"], 0.08, rng)
        return _textured_material(
            name, rng.choose((0, 1, 2, 3) if is_sheet else (0, 3)), color, 3.0
        )
    oldest = 1 + int(7.0 * plan.age)
    name = f"texture/weathered_plaster?seed={int(rng.random() * (oldest + 0.999))}"
    color = _tint("weathered_plaster", tints, 0.08, rng)
    return Material(color, roughness=0.92, texture=name, role="facade")


def _tint(texture: str, codes: Sequence[str], amount: float, rng: VariantRng) -> Vec3:
    """Tint of a texture with which its mean is one of several sRGB colours, jittered."""
    mean = TEXTURE_ALBEDOS[texture]
    red, green, blue = (min(1.0, part / mean) for part in presets.draw_linear(codes, amount, rng))
    return (red, green, blue)


def _base(plan: Design, wall: Material, rng: VariantRng) -> Material:
    if plan.trimmed or plan.cladding == "stone":
        return _textured_material("ashlar", 0, _tint("ashlar", _COLORS["stones"], 0.06, rng), 2.4)
    if rng.chance(0.4):
        return _textured_material("concrete", 3, (0.72, 0.71, 0.7), 2.2)
    darker = rng.between(0.5, 0.7)
    r, g, b = wall.base_color
    return _textured_material("plaster", 5, (darker * r, darker * g, darker * b), 2.5)


def _roof(place: str, plan: Design, rng: VariantRng) -> Material:
    if plan.cladding == "sheet" or rng.chance(0.08):
        color = _tint("profiled_sheet", _COLORS["sheets"], 0.08, rng)
        texture = f"texture/profiled_sheet?seed={rng.choose((0, 1, 2, 3))}"
    elif rng.chance(0.25):
        color = _tint("slates", _COLORS["slates"], 0.08, rng)
        texture = f"texture/slates?seed={rng.choose((0, 1, 2))}"
    else:
        color = _tint("roof_tiles", _COLORS[f"roofs_{place}"], 0.1, rng)
        texture = f"texture/roof_tiles?seed={rng.choose((0, 1, 2, 3))}"
    return Material(color, roughness=0.85, texture=texture, role="roof")


def _plain_material(code: str, roughness: float, role: str) -> Material:
    return Material(presets.hex_to_linear(code), roughness=roughness, role=role)


def _glass_material(texture: str) -> Material:
    # Clear double glazing reflects about 15 % of daylight; the strongest dielectric here 8 %.
    return Material((1.0, 1.0, 1.0), roughness=0.05, specular=1.0, texture=texture, role="window")


def _textured_material(
    name: str, seed: int, color: Vec3, scale_m: float, role: str = "facade"
) -> Material:
    texture = f"texture/{name}?seed={seed}"
    return Material(color, roughness=0.92, texture=texture, texture_scale_m=scale_m, role=role)
