"""Materials of streets. Albedos: asphalt 0.07 to 0.13, concrete 0.25 to 0.4, paint 0.5 to 0.7.

Source: Pomerantz et al., "The effect of pavements' temperatures on air temperatures in large
cities", LBNL-43442, 2000 (new asphalt 0.04-0.05, aged 0.1-0.15, concrete 0.25-0.4).
"""

from __future__ import annotations

from gen_data.generator.assets.procedural.data_tables import load_table
from gen_data.generator.core.asset_types import Material
from gen_data.generator.core.se3 import Vec3

SCALES_M = load_table(__package__, "texture_scales", float)
SLOT_OF = load_table(__package__, "slots", str)
GROUNDS = ("grass", "paving", "cobbles", "gravel", "earth", "asphalt")
"""Covers of the land, each a family of textures."""


def textured_material(
    name: str, role: str, roughness: float, color: Vec3 = (1.0, 1.0, 1.0)
) -> Material:
    """A surface with texture coordinates of its own; the name is that of a texture's id."""
    return Material(color, roughness, texture=f"texture/{name}", role=role)


def ground_material(ground: str, seed: int) -> Material:
    """The surface of a ``GROUNDS`` word."""
    role = ground if ground in ("grass", "asphalt") else "pavement"
    return textured_material(f"{ground}?seed={seed % 4}", role, 0.95)


def street_materials(seed: int, wear: float, paving: str, ground: str) -> dict[str, Material]:
    """Every slot of a street by name, in slot order."""
    worn = f"{round(wear, 1):g}"
    return {
        "asphalt": textured_material(f"asphalt?seed={seed % 6}&wear={worn}", "asphalt", 0.92),
        "asphalt_new": textured_material(f"asphalt?seed={6 + seed % 3}&wear=0", "asphalt", 0.88),
        "marking": textured_material(f"road_paint?seed={seed % 3}&wear={worn}", "marking", 0.75),
        "kerb": textured_material("concrete?seed=1", "kerb", 0.85, (0.95, 0.94, 0.91)),
        "pavement": ground_material(paving, seed),
        "verge": ground_material("grass", seed + 1),
        "ground": ground_material(ground, seed),
        "tar": Material(base_color=(0.022, 0.022, 0.023), roughness=0.55, role="asphalt"),
        "manhole": textured_material("manhole?seed=0", "", 0.6),
        "drain": textured_material("drain?seed=0", "", 0.6),
        "steel": Material(base_color=(0.56, 0.57, 0.58), roughness=0.5, metallic=0.9),
    }
