"""Assets that a configuration names and the library lacks."""

import json
import re
from pathlib import Path

import pytest

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.config.paths import write_locations
from gen_data.core.errors import AssetError, ConfigError, UnknownAsset


@pytest.mark.parametrize("wrong", ["../../../etc/passwd", "pybullet/teddie", "muug?seed=3"])
def test_an_unknown_asset_is_told_where_it_is_named(tmp_path: Path, wrong: str) -> None:
    """File, line, column and field: the third line's list begins in column 26."""
    path = tmp_path / "mine.yaml"
    path.write_text(
        "template: tabletop\n"
        "elements:\n"
        f"  clutter: {{assets: {{ids: [{wrong}]}}}}\n"
        "sensors: [{type: rgb_camera, name: color}]\n"
    )
    with pytest.raises(UnknownAsset) as told, open_pipeline(load_config(str(path))):
        pass
    assert str(told.value).startswith(f"{path}:3:28: elements")
    assert f"asset '{wrong}': unknown" in str(told.value)


@pytest.mark.parametrize(
    ("wrong", "fact"),
    [
        ("desk?width_m=16", "width_m expects a number from 1.2 to 1.8"),
        ("desk?widht_m=1.6", "did you mean 'width_m'"),
        ("marker?number=40&dictionary=apriltag_16h5", "number expects a whole number from 0 to 29"),
        ("marker?dictionary=apriltag", "did you mean 'apriltag_"),
        ("desk?seed=-1", "seed is not an integer"),
    ],
)
def test_a_wrong_parameter_of_an_asset_is_told_where_it_is_named(
    tmp_path: Path, wrong: str, fact: str
) -> None:
    """The id as it is written, not in the order of the library."""
    path = tmp_path / "mine.yaml"
    path.write_text(
        "template: tabletop\n"
        "elements:\n"
        f"  clutter: {{assets: {{ids: ['{wrong}']}}}}\n"
        "sensors: [{type: rgb_camera, name: color}]\n"
    )
    with pytest.raises(AssetError) as told, open_pipeline(load_config(str(path))):
        pass
    family = wrong.partition("?")[0]
    assert str(told.value).startswith(f"{path}:3:28: elements[3].assets.ids[0]: asset '{family}")
    assert fact in str(told.value)


@pytest.mark.parametrize(
    ("override", "place"),
    [
        ("elements.clutter.assets={tags: [household], exclude: [foood]}",
         "--set:1:54: elements[3].assets.exclude: "),
        ("randomizers.colors.exclude=[foood]", "--set:1:28: randomizers[4].exclude: "),
    ],
)  # fmt: skip
def test_an_excluded_word_that_no_object_has_is_refused(override: str, place: str) -> None:
    """It left out nothing, silently."""
    with (
        pytest.raises(ConfigError) as told,
        open_pipeline(load_config("tabletop.yaml", overrides=[override])),
    ):
        pass
    assert str(told.value).startswith(place), told.value
    assert "no object has 'foood'" in str(told.value)
    assert "did you mean 'food'?" in str(told.value)


@pytest.mark.parametrize(("override", "fact"), [
    ("elements.clutter.assets={any_of: [household, glaswear]}",
     "--set:1:34: elements[3].assets.any_of: no object has the tag 'glaswear'; .*'glassware'"),
    ("elements.clutter.assets={tags: [houshold], ids: [mug]}",
     "--set:1:32: elements[3].assets.tags: no object has the tag 'houshold'; .*'household'"),
    ("elements.clutter.assets={tags: [household], prefer: [usr]}",
     "--set:1:53: elements[3].assets.prefer: no object has the tag 'usr'; .*'user'"),
])  # fmt: skip
def test_a_word_that_selects_no_object_is_refused(override: str, fact: str) -> None:
    with (
        pytest.raises(ConfigError) as told,
        open_pipeline(load_config("tabletop.yaml", overrides=[override])),
    ):
        pass
    assert re.match(fact.replace("[", r"\[", 1), str(told.value)), told.value


@pytest.mark.parametrize("tag", ["pack", "user"])
def test_assets_of_packs_and_users_may_be_preferred_where_there_are_none(tag: str) -> None:
    override = f"elements.clutter.assets={{tags: [household], prefer: [{tag}]}}"
    with open_pipeline(load_config("tabletop.yaml", overrides=[override])):
        pass


def test_a_file_of_a_user_that_is_missing_is_told_with_what_there_is(tmp_path: Path) -> None:
    (tmp_path / "props").mkdir()
    path = tmp_path / "mine.yaml"
    path.write_text(
        f"template: tabletop\nassets: {{folders: [{tmp_path / 'props'}]}}\n"
        "elements: {clutter: {assets: {ids: [user/cup]}}}\n"
        "sensors: [{type: rgb_camera, name: color}]\n"
    )
    with (
        pytest.raises(UnknownAsset, match="your asset folders hold nothing"),
        open_pipeline(load_config(str(path))),
    ):
        pass


def test_a_data_set_finds_its_folders_anywhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its plan keeps ``props`` as written; the run remembers where that was."""
    folder, props = tmp_path / "set", tmp_path / "project/props"
    (folder / "run").mkdir(parents=True)
    props.mkdir(parents=True)
    (tmp_path / "project/mine.yaml").write_text(
        "template: tabletop\nassets: {folders: [props]}\n"
        "sensors: [{type: rgb_camera, name: color}]\n"
    )
    made = load_config(str(tmp_path / "project/mine.yaml"))
    plan = {"config": made.document.plain(), "name": "mine"}
    (folder / "plan.json").write_text(json.dumps(plan))
    monkeypatch.chdir(folder)
    with pytest.raises(ConfigError, match="there is no folder 'props'"):
        load_config(str(folder))

    write_locations(folder / "run", made.asset_locations)

    assert load_config(str(folder)).asset_folders == (props,)
    props.rmdir()
    with pytest.raises(ConfigError, match="there is no folder 'props'"):
        load_config(str(folder))
