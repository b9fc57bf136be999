"""Procedural assets through the library: ids, parameters, hashes, cache."""

from dataclasses import replace
from pathlib import Path
from typing import cast

import pytest

from gen_data.assets.families import own_families
from gen_data.assets.family import Facts, Family
from gen_data.assets.library import Library, open_library
from gen_data.core.errors import AssetError


def test_parameters_make_the_asset_defaults_too_and_only_seeds_are_listed(library: Library) -> None:
    """Leaving a default out and writing it gives the same content."""
    assert library.get("mug").sha256 == library.get("mug?seed=0").sha256
    assert library.get("mug?seed=1").sha256 != library.get("mug?seed=0").sha256
    # A table of 0.9 x 0.6 x 0.5 m, standing on the floor.
    low, high = library.bounds_m("table?size_m=0.9,0.6,0.5")
    assert low == pytest.approx((-0.45, -0.3, 0.0), abs=1e-3)
    assert high == pytest.approx((0.45, 0.3, 0.5), abs=1e-3)
    # Furniture is asked for by its size, not drawn.
    mugs = library.find({"mug", "procedural"})
    assert [a.asset_id for a in mugs] == sorted(f"mug?seed={k}" for k in range(len(mugs)))
    assert not [a for a in library.find({"procedural"}) if a.asset_id.startswith("table?")]


def test_variants_of_every_family_are_those_offered_for_selection(library: Library) -> None:
    """Families of textures and skies have no objects; an id with a seed is not a family."""
    objects = library.find(())
    families = {asset.asset_id.partition("?")[0] for asset in objects}
    for family in families:
        offered = tuple(a for a in objects if a.asset_id.partition("?")[0] == family)
        assert library.variants(family) == offered, family
    assert [library.variants(x) for x in ("mug?seed=1", "wood", "no such family")] == [()] * 3


def test_libraries_of_a_process_share_descriptions_of_offered_assets(tmp_path: Path) -> None:
    """A command opens several, and each search by tags finds many of them."""
    one, two = (open_library(cache_dir=tmp_path / name) for name in "ab")
    mug = one.get("mug?seed=1")
    assert two.get("mug?seed=1") is mug
    assert any(found is mug for found in two.find({"mug"}))
    assert one.get("mug?seed=123456") is not two.get("mug?seed=123456")


def test_search_finds_no_facts_that_nobody_asks_for(tmp_path: Path) -> None:
    """Facts of all people and vehicles of a street take a third of a second."""
    asked: list[int] = []

    def find_facts(seed: int) -> Facts:
        asked.append(seed)
        return Facts("tall", {"lid": "open"})

    mug = cast(Family, own_families()["mug"])
    family = replace(mug, name="test_mug", facts=find_facts)
    library = open_library(cache_dir=tmp_path)
    library._generated._families["test_mug"] = family
    found = library.find({"test_mug"})
    assert [a.asset_id for a in found if a.has_word("test_mug") and not a.has_word("red")]
    assert asked == []
    assert found[0].has_word("mug/tall")
    assert found[0].attributes == (("lid", "open"),)
    assert asked == [0]


@pytest.mark.parametrize(
    ("asset_id", "reason"),
    [("mug?sede=1", "did you mean 'seed'"), ("mug?seed=-1", "integer from 0"),
     ("mug?seed=1.5", "integer from 0"), ("mug?seed=red", "integer from 0"),
     ("table?size_m=1,2", "expects 3 comma-separated numbers"),
     ("table?size_m=wide", "expects 3 comma-separated numbers"),
     ("table?style=3", "expects a word"), ("table?size_m=0,0,0", "table"),
     ("mgu?seed=3", "did you mean 'mug")],
)  # fmt: skip
def test_wrong_parameters_are_refused_so(library: Library, asset_id: str, reason: str) -> None:
    with pytest.raises(AssetError, match=reason):
        library.mesh(asset_id)


@pytest.mark.parametrize(
    ("kind", "article"), [("texture", "a"), ("environment", "an"), ("robot", "a")]
)
def test_kinds_are_not_confused(library: Library, kind: str, article: str) -> None:
    with pytest.raises(AssetError, match=f"not {article} {kind}"):
        getattr(library, kind)("mug?seed=0")
