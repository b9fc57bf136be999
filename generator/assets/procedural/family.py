"""Families; see ``generator/assets/family.py``."""

from __future__ import annotations

from gen_data.generator.assets.family import (
    OURS,
    ConstantFacts,
    ConstantSymmetries,
    EnvironmentFamily,
    Facts,
    Family,
    FamilyTables,
    ImageFamily,
    Lazy,
    Provenance,
    Solid,
    TextureFamily,
    Worn,
    axis_symmetries,
    check_option,
    choose_option,
    load_families,
)

__all__ = [
    "OURS",
    "ConstantFacts",
    "ConstantSymmetries",
    "EnvironmentFamily",
    "Facts",
    "Family",
    "FamilyTables",
    "ImageFamily",
    "Lazy",
    "Provenance",
    "Solid",
    "TextureFamily",
    "Worn",
    "axis_symmetries",
    "check_option",
    "choose_option",
    "load_families",
]
