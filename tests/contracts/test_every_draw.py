"""Named draws of every family: sizes and choices that asset ids may ask for."""

from __future__ import annotations

import re
from collections.abc import Iterator
from hashlib import sha256

import numpy as np
import pytest

from gen_data.assets.asset_arrays import pack_imported
from gen_data.assets.asset_ids import AssetId, ParameterValue, parse_asset_id
from gen_data.assets.families import own_families
from gen_data.assets.family import Family
from gen_data.assets.procedural_library import ProceduralLibrary
from gen_data.core.variant_rng import Draw, VariantRng
from tests.contracts.asset_digests import open_procedural
from tests.tiers import cases

FAMILIES = {
    name: family
    for name, family in own_families().items()
    if isinstance(family, Family) and family.variants
}
QUICK = {"desk", "chair", "mug", "gear", "wardrobe/door", "cone", "wheelie_bin", "building/shed"}
PRINTED = "its print is an image made for the size or the kind of the same seed"
STANDARD = "it is made in the sizes of a standard, in turn"
FIXED = "it has one shape; seeds change its colours"
PARAMETRIC = "its sizes are parameters; seeds change its colours"
MIXED = "it consists of things, each of which is drawn"
WITHOUT = {
    **dict.fromkeys(("can", "carton", "milk_carton", "ball"), PRINTED),
    **dict.fromkeys(("toy_block", "nut", "washer", "kitchen_unit", "kitchen_unit/door"), STANDARD),
    **dict.fromkeys(("gimbal", "router", "shoes", "vacuum_cleaner", "iron", "vise", "knife_block",
                     "toilet_brush", "bathroom_scale", "guitar", "drill"), FIXED),
    **dict.fromkeys(("overpass", "embankment"), PARAMETRIC),
    **dict.fromkeys(("crockery", "groceries", "hanging_clothes", "horizon/skyline"), MIXED),
    "bicycle": "frames take turns by seed; its other draws are pedals, colours and luggage",
    "motorcycle": "styles and riders take turns by seed, in step with their facts",
    "cyclist": "styles and riders take turns by seed, in step with their facts",
    "simple_person": "traits of one person depend on each other; poses are parameters",
}  # fmt: skip
"""Families without a named draw, and the reason."""


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ProceduralLibrary:
    """Procedural assets with an empty cache."""
    return open_procedural(tmp_path_factory.mktemp("cache"))


def some_variants(name: str, most: int) -> Iterator[AssetId]:
    """The first variants of a family."""
    for seed in range(min(most, FAMILIES[name].variants)):
        yield AssetId(name, {"seed": seed})


def some_values(draw: Draw) -> tuple[ParameterValue, ...]:
    """The lowest, middle and highest value."""
    if draw.is_range:
        low, high = (float(end) for end in draw.options if isinstance(end, (int, float)))
        return (low, 0.5 * (low + high), high) if high > low else (low,)
    return tuple({0: draw.options[0], 1: draw.options[len(draw.options) // 2],
                  2: draw.options[-1]}.values())  # fmt: skip


@pytest.mark.parametrize("name", cases(FAMILIES, QUICK))
def test_every_family_has_a_named_draw_or_a_reason(library: ProceduralLibrary, name: str) -> None:
    """Names are keys of ids that hide no parameter; values are written as in ids."""
    found = [library.draws(one) for one in some_variants(name, 6)]
    assert any(found) == (name not in WITHOUT)
    for key, draw in ((key, draw) for draws in found for key, draw in draws.items()):
        assert re.fullmatch("[a-z][a-z0-9_]*", key)
        assert key not in {"seed", *FAMILIES[name].parameters}
        for value in draw.options:
            asked = parse_asset_id(str(AssetId(name, {key: value})))
            assert asked.parameters[key] == value


@pytest.mark.parametrize("name", cases(sorted(set(FAMILIES) - set(WITHOUT)), QUICK))
def test_every_value_of_a_named_draw_makes_a_valid_object(
    library: ProceduralLibrary, name: str
) -> None:
    """Low, middle and high; in some variant two differ in shape or material.

    A house without a wing has a width of its wing, which nothing shows. Parts draw what their
    piece needs.
    """
    named: set[str] = set()
    shown: set[str] = set()
    for number, one in enumerate(some_variants(name, 16)):
        if number > 2 and shown == named:
            break
        draws = library.draws(one)
        new = draws.keys() - named
        named |= draws.keys()
        for key in new | (draws.keys() - shown):
            values = dict.fromkeys(some_values(draws[key]))
            made = {make_valid(library, one, key, value) for value in values}
            if len(made) > 1 or len(values) == 1:
                shown.add(key)
    assert "part_of" in FAMILIES[name].tags or shown == named


def make_valid(library: ProceduralLibrary, one: AssetId, key: str, value: ParameterValue) -> bytes:
    """Bytes of an object with one value asked for, after checks."""
    asked = AssetId(one.name, {**one.parameters, key: value})
    assert library.draws(asked)[key].value == pytest.approx(value)
    imported = library.imported(asked)
    assert imported.mesh is not None
    assert imported.collision is not None
    assert np.isfinite(imported.mesh.vertices_m).all()
    assert len(imported.mesh.faces)
    arrays = pack_imported(imported)
    return sha256(b"".join(array.tobytes() for _, array in sorted(arrays.items()))).digest()


@pytest.mark.parametrize("name", cases(FAMILIES, QUICK))
def test_no_stream_draws_a_name_twice(
    library: ProceduralLibrary, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A value asked for would go to both draws."""
    settle, alive = VariantRng._settle, list[VariantRng]()
    seen: set[tuple[int, str]] = set()

    def once(rng: VariantRng, key: str, *arguments: object, **options: bool) -> object:
        if key:
            assert (id(rng), key) not in seen, f"{name} draws {key} twice"
            seen.add((id(rng), key))
            # Else another generator may take its id.
            alive.append(rng)
        return settle(rng, key, *arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(VariantRng, "_settle", once)
    for one in some_variants(name, 6):
        library.draws(one)


@pytest.mark.parametrize(
    "name", cases([name for name, family in FAMILIES.items() if "part_of" in family.tags], QUICK)
)
def test_parts_draw_what_their_piece_draws(library: ProceduralLibrary, name: str) -> None:
    """A piece's id with other parameters is its part's id: the door fits."""
    piece = name.rpartition("/")[0]
    for one in some_variants(name, 6):
        part = library.draws(one)
        assert library.draws(AssetId(piece, one.parameters)).keys() <= part.keys()
