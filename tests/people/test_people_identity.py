"""Traits of people, before anything is built; and people offered for selection."""

import importlib
from pathlib import Path

import numpy as np
import pytest

from gen_data.assets.library import open_library
from gen_data.assets.paths import packs_dir
from gen_data.content import people
from gen_data.content.people.body import load
from gen_data.content.people.convert import convert
from gen_data.content.people.person import draw_person, facts
from gen_data.core.errors import AssetError


def test_grown_people_are_from_145_to_200_cm_and_about_as_tall_as_the_population() -> None:
    """Means within 2 cm of NCHS 2021 for either sex."""
    grown = [p for p in map(draw_person, range(600)) if p.age_group != "child"]
    assert all(1.45 <= p.height_m <= 2.0 for p in grown)
    for sex, mean in (("female", 1.613), ("male", 1.753)):
        heights = [p.height_m for p in grown if p.sex == sex]
        assert np.mean(heights) == pytest.approx(mean, abs=0.02)


def test_one_person_in_ten_is_a_child() -> None:
    """A third of the 14.6 % of Eurostat 2024 stays at home; one in five is 65 or older."""
    drawn = [draw_person(seed) for seed in range(600)]
    children = [p for p in drawn if p.age_group == "child"]
    assert 0.06 < len(children) / len(drawn) < 0.14
    assert max(p.height_m for p in children) <= 1.5
    seniors = [p for p in drawn if p.age_group == "senior"]
    assert 0.17 < len(seniors) / len(drawn) < 0.26


def test_a_pose_or_a_phase_leaves_the_person_the_same() -> None:
    """Pose has a separate stream; sixteen phases of a stride need as many meshes."""
    walking, sitting = draw_person(7, "walk", 0.5), draw_person(7, "sit")
    assert walking.outfit == sitting.outfit and walking.skin == sitting.skin
    assert walking.height_m == sitting.height_m
    assert (walking.pose, walking.step, sitting.pose) == ("walk", 8, "sit")

    assert [draw_person(1, "walk", p).step for p in (0.0, 0.03, 0.04, 0.97, 1.0)] == [0, 0, 1, 0, 0]


def test_a_pose_that_does_not_exist_is_refused_with_a_suggestion() -> None:
    with pytest.raises(
        ValueError, match=r"pose 'walks' is none of walk, walk_slow.*did you mean 'walk'"
    ):
        draw_person(1, "walks")


def test_facts_say_what_labels_need() -> None:
    """Sex, age, pose, behaviour and height, all as text."""
    known = facts(12, "walk", 0.25)
    assert known.subcategory in ("adult", "child")
    assert known.attributes["pose"] == "walk" and known.attributes["behaviour"] == "walking"
    assert 1.0 < float(known.attributes["height_m"]) < 2.05
    assert set(known.attributes) == {"sex", "age_group", "pose", "behaviour", "height_m"}


def test_people_from_formulas_are_always_offered(tmp_path: Path) -> None:
    """256 of them, by tag; parameters work in ids."""
    library = open_library((), tmp_path)
    offered = [a for a in library.find(("pedestrian",)) if a.asset_id.startswith("simple_person")]
    assert len(offered) == 256
    assert {a.category for a in offered} == {"person"}
    asset = library.get("simple_person?seed=12&pose=walk&phase=0.25")
    assert dict(asset.attributes)["pose"] == "walk"
    assert len(library.keypoints(asset.asset_id)) == 17


def test_without_the_pack_people_are_formulas(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The family of the pack is absent; with the file it is there and has the tag ``pack``."""
    monkeypatch.setenv("GEN_DATA_ASSETS", str(tmp_path))
    try:
        assert set(importlib.reload(people).FAMILIES) == {"simple_person"}
        (packs_dir() / "people").mkdir(parents=True)
        (packs_dir() / "people" / "body.npz").write_bytes(b"")
        assert "pack" in importlib.reload(people).FAMILIES["person"].tags
    finally:
        monkeypatch.undo()
        importlib.reload(people)


def test_packs_lie_where_the_environment_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else in the user's data folder."""
    monkeypatch.setenv("GEN_DATA_ASSETS", str(tmp_path))
    assert packs_dir() == tmp_path / "packs"
    monkeypatch.delenv("GEN_DATA_ASSETS")
    assert packs_dir().parts[-2:] == ("gen-data", "packs")


def test_a_damaged_pack_is_refused_with_a_remedy(tmp_path: Path) -> None:
    path = tmp_path / "body.npz"
    for content in (b"", b"no archive"):
        path.write_bytes(content)
        with pytest.raises(AssetError, match="gen-data assets install people"):
            load(path)
    np.savez(path, format=np.array(999))
    with pytest.raises(AssetError, match="is of format 999, not"):
        load(path)
    with pytest.raises(AssetError, match="cannot be read"):
        load(tmp_path / "absent.npz")


def test_a_folder_without_body_data_cannot_be_converted(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match="no body data"):
        convert(tmp_path, tmp_path / "people")
    assert not (tmp_path / "people").exists()
