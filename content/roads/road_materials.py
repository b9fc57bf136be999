"""Materials of streets. Albedos: asphalt 0.05 to 0.17, concrete 0.25 to 0.4, paint 0.5 to 0.7.

Source: Pomerantz et al., "The effect of pavements' temperatures on air temperatures in large
cities", LBNL-43442, 2000 (new asphalt 0.04-0.05, aged 0.1-0.15, concrete 0.25-0.4).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from gen_data.assets.family import Solid, check_option
from gen_data.config.data_files import load_table
from gen_data.content.procedural.patches import Array, Patch, join_patches, make_solid_in_place
from gen_data.content.roads.lane_textures import DAMAGES
from gen_data.core.asset_types import Material
from gen_data.core.se3 import Vec3

SCALES_M = load_table(__package__, "texture_scales", float)
SLOT_OF = load_table(__package__, "slots", str)
GROUNDS = ("grass", "paving", "cobbles", "gravel", "earth", "asphalt")
"""Covers of the land, each a family of textures."""


def textured_material(
    name: str, role: str, roughness: float, color: Vec3 = (1.0, 1.0, 1.0)
) -> Material:
    """A surface with separate texture coordinates; the name is a texture's id."""
    return Material(color, roughness, texture=f"texture/{name}", role=role)


def ground_material(ground: str, seed: int) -> Material:
    """The surface of a ``GROUNDS`` word."""
    role = ground if ground in ("grass", "asphalt") else "pavement"
    return textured_material(f"{ground}?seed={seed % 4}", role, 0.95)


CARRIAGEWAYS = ("asphalt", "concrete", "cobbles", "gravel", "earth")
"""Driven surfaces; all have the role ``asphalt``, by which labels know the carriageway."""
UNPAVED = ("gravel", "earth")
LANE_SLOTS = ("lane", "lane_cracks", "lane_alligator", "lane_stains", "lane_new")
"""Slots of driven lanes; their textures follow the lane, see ``lane_textures``."""
AGES_YEARS = (0.5, 1.5, 3.0, 6.0, 12.0, 25.0)
"""Ages with separate textures; others use the nearest, which bounds the number of textures."""
_BASIC = 11
_COLORS: dict[str, Vec3] = {
    "red": (0.26, 0.055, 0.04), "green": (0.05, 0.15, 0.085), "blue": (0.035, 0.11, 0.27),
    "yellow": (0.62, 0.4, 0.03), "none": (0.0, 0.0, 0.0),
}  # fmt: skip
"""Linear colours of coatings and of yellow paint; assumed, from photographs."""


@dataclass(frozen=True, slots=True)
class StreetLook:
    """Appearance of the surfaces of a street.

    Attributes:
        seed: Seed of textures.
        wear: 0 freshly laid to 1 worn out.
        paving: Cover of the sidewalks, a word of ``GROUNDS``.
        ground: Cover of the adjacent land, a word of ``GROUNDS``.
        carriageway: Driven surface, a word of ``CARRIAGEWAYS``.
        age_years: Age of the carriageway's surface; negative = 40 years times the wear.
        coating: Colour of bicycle lanes and of areas laid out with them; ``none`` = asphalt.
        center_color: Colour of the line between the directions, ``white`` or ``yellow`` (MUTCD).
    """

    seed: int = 0
    wear: float = 0.3
    paving: str = "paving"
    ground: str = "grass"
    carriageway: str = "asphalt"
    age_years: float = -1.0
    coating: str = "none"
    center_color: str = "white"

    @property
    def age_shown_years(self) -> float:
        """Age of the textures."""
        age = 40.0 * self.wear if self.age_years < 0.0 else self.age_years
        return min(AGES_YEARS, key=lambda known: abs(known - age))


def street_materials(look: StreetLook) -> dict[str, Material]:
    """Every slot of a street by name, in slot order.

    Raises:
        AssetError: a word of the look is unknown.
    """
    check_option("road", "carriageway", look.carriageway, CARRIAGEWAYS)
    check_option("road", "coating", look.coating, _COLORS)
    seed, worn, stone = look.seed, f"{round(look.wear, 1):g}", look.seed % 4
    age = f"age_years={look.age_shown_years:g}"
    # Some roads have been repainted; on others the paint is older than usual.
    paint = (look.wear, min(look.wear, 0.1), min(1.0, look.wear + 0.2))[seed % 3]
    line = f"road_paint?{age}&seed={stone}&wear={round(paint, 1):g}"
    white = textured_material(line, "marking", 0.75)
    base = textured_material(f"asphalt?{age}&seed={stone}&wear={worn}", "asphalt", 0.92)
    newer = textured_material(
        f"asphalt?{_repaired(look)}&seed={(stone + 1) % 4}&wear=0", "asphalt", 0.88
    )
    slots = {
        "asphalt": _driven(look, base),
        "asphalt_new": newer,
        "marking": white,
        "kerb": textured_material("concrete?seed=1", "kerb", 0.85, (0.95, 0.94, 0.91)),
        "pavement": ground_material(look.paving, seed),
        "verge": ground_material("grass", seed + 1),
        "ground": ground_material(look.ground, seed),
        "tar": Material(base_color=(0.022, 0.022, 0.023), roughness=0.55, role="asphalt"),
        "manhole": textured_material(f"manhole?seed={seed % 3}", "", 0.6),
        "drain": textured_material(f"drain?seed={seed % 2}", "", 0.6),
        "steel": Material(base_color=(0.56, 0.57, 0.58), roughness=0.5, metallic=0.9),
    }
    slots |= _lane_slots(look, slots["asphalt"], stone, age)
    old = f"road_paint?{age}&seed={stone}&wear=1.6"
    return slots | {
        "gutter": textured_material(f"gutter?{age}&seed={stone}", "asphalt", 0.95),
        "ghost": textured_material(old, "asphalt", 0.85),
        "manhole_b": textured_material(f"manhole?seed={(seed + 1) % 3}", "", 0.6),
        "hatch": textured_material(f"hatch?seed={seed % 2}", "", 0.6),
        "coating": Material(_COLORS[look.coating], 0.9, role="asphalt"),
        "center": _tinted(white, _COLORS["yellow"]) if look.center_color == "yellow" else white,
        "setts": replace(ground_material("cobbles", seed), role="asphalt"),
        "rail": Material(base_color=(0.42, 0.41, 0.4), roughness=0.35, metallic=0.9),
        "groove": Material(base_color=(0.012, 0.011, 0.01), roughness=0.9, role="asphalt"),
    }


def _driven(look: StreetLook, asphalt: Material) -> Material:
    """The carriageway outside lanes: parking strips, shoulders, junctions."""
    if look.carriageway == "asphalt":
        return asphalt
    if look.carriageway == "concrete":
        name = f"concrete?seed={look.seed % 4}"
        return replace(textured_material(name, "asphalt", 0.92), texture_scale_m=4.0)
    scale_m = {"cobbles": 2.4, "gravel": 3.0, "earth": 5.0}[look.carriageway]
    plain = ground_material(look.carriageway, look.seed)
    return replace(plain, role="asphalt", texture_scale_m=scale_m)


def _lane_slots(look: StreetLook, base: Material, stone: int, age: str) -> dict[str, Material]:
    """Materials of ``LANE_SLOTS``."""
    kind = look.carriageway
    if kind == "cobbles":
        return dict.fromkeys(LANE_SLOTS, base)
    if kind in ("gravel", "earth"):
        track = textured_material(f"track_lane?material={kind}&seed={stone}", "asphalt", 0.97)
        return dict.fromkeys(LANE_SLOTS, track)
    ids = [f"{kind}_lane?{age}&damage={damage}&seed={stone}" for damage in DAMAGES]
    ids.append(f"{kind}_lane?{_repaired(look)}&damage=none&seed={(stone + 1) % 4}")
    made = (textured_material(name, "asphalt", 0.92) for name in ids)
    return dict(zip(LANE_SLOTS, made, strict=True))


def _repaired(look: StreetLook) -> str:
    """Age of repaved patches and stretches, as a parameter."""
    return f"age_years={(1.5, 3.0)[look.seed % 2]:g}"


def _tinted(material: Material, color: Vec3) -> Material:
    # The paint's texture is about 0.65 bright itself.
    x, y, z = (min(1.0, v / 0.62) for v in color)
    return replace(material, base_color=(x, y, z))


def split_look(parameters: Mapping[str, Any]) -> tuple[StreetLook, dict[str, Any]]:
    """The look among the parameters of a family, and the other parameters."""
    names = {field.name for field in fields(StreetLook)}
    look = {name: value for name, value in parameters.items() if name in names}
    return StreetLook(**look), {k: v for k, v in parameters.items() if k not in names}


def number_slots(look: StreetLook) -> dict[str, int]:
    """Number of each slot of ``street_materials`` by name."""
    return {name: k for k, name in enumerate(street_materials(look))}


def make_street_solid(patches: Iterable[Patch], look: StreetLook, hulls_m: list[Array]) -> Solid:
    """A solid that keeps its frame, without the rare slots that none of its patches uses.

    An unused slot would load its texture.
    """
    patch = join_patches(patches)
    materials = tuple(street_materials(look).values())
    used = np.unique(patch.slots)
    kept = np.unique(np.concatenate([np.arange(_BASIC), used]))
    slots = np.searchsorted(kept, patch.slots)
    whole = Patch(patch.corners_m, patch.uvs, slots.astype(np.int64))
    return make_solid_in_place([whole], tuple(materials[k] for k in kept), hulls_m)
