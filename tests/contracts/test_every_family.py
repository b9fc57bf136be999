"""Contract of every family of objects: well-formed meshes, materials, facts and bytes.

Sizes, budgets, fronts and parts stand in the tests of each package of families.
"""

import numpy as np
import pytest

from gen_data.assets.families import own_families
from gen_data.assets.family import Family, Solid
from tests.every_value import for_every
from tests.solids import assert_well_formed, build, digest, variant

FAMILIES = {name: family for name, family in own_families().items() if isinstance(family, Family)}
SLIVERS = {"simple_person"}
"""Families with faces almost without area, whose meshes tests/people checks."""
ALIKE = {"bathroom_scale": 2, "cone": 2, "drill": 3, "knife_block": 3, "socket": 3,
         "toilet_brush": 2, "vise": 2}  # fmt: skip
"""Number of different objects among the first four, where it is smaller."""
WITHOUT_SUBCATEGORY = {"grapes", "marker", "plate", "qr_code"}


def seeds_of(name: str, most: int) -> range:
    return range(min(most, FAMILIES[name].variants))


def built(key: tuple[str, int | None]) -> tuple[str, Solid]:
    """A variant, or the default object of a parametric family."""
    name, seed = key
    family = FAMILIES[name]
    return name, family.build(**family.parameters) if seed is None else variant(name, seed)


@for_every([(name, seed) for name in FAMILIES for seed in (seeds_of(name, 2) or (None,))], built)
def test_meshes_are_well_formed_and_materials_are_physical(made: tuple[str, Solid]) -> None:
    """Colours are reflectances, and the family of every texture exists."""
    name, solid = made
    if name not in SLIVERS:
        assert_well_formed(solid.mesh)
    for material in solid.mesh.materials:
        assert all(0.0 <= channel <= 1.0 for channel in material.base_color)
        assert 0.02 <= material.roughness <= 1.0
        assert not material.texture or material.texture.partition("?")[0] in own_families()
    assert all(len(part) >= 4 and np.isfinite(part).all() for part in solid.collision.parts_m)


@pytest.mark.slow
@for_every([name for name, family in FAMILIES.items() if family.variants])
def test_equal_seeds_make_equal_bytes_and_others_differ(name: str) -> None:
    digests = [digest(variant(name, seed)) for seed in seeds_of(name, 4)]

    assert digest(build(name, 0)) == digests[0]
    assert len(set(digests)) == ALIKE.get(name, len(digests))


@for_every([name for name, family in FAMILIES.items() if family.facts])
def test_facts_are_known_without_building(name: str) -> None:
    family = FAMILIES[name]
    assert family.facts is not None
    seeds = [{"seed": seed} for seed in range(family.variants)] or [{}]
    for seed in seeds:
        facts = family.facts(**{**family.parameters, **seed})
        assert facts.subcategory or name in WITHOUT_SUBCATEGORY
        assert all(isinstance(value, str) for value in facts.attributes.values())
