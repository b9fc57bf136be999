"""Paths in configurations: relative to the file that names them, then shipped names."""

from pathlib import Path

import pytest

from gen_data.assemble.config import load_config
from gen_data.config.paths import find_path
from gen_data.config.problems import Position
from gen_data.core.errors import ConfigError

SENSOR = "sensors: [{type: rgb_camera, name: color, size_px: [64, 48], hfov_deg: 60}]\n"


def at(file: Path) -> Position:
    return Position(str(file), 2, 5)


def test_a_path_starts_from_file_or_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not from the current folder, even where that has a file of this name."""
    for folder in ("configs", "elsewhere"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "sheet.yaml").touch()
    document = tmp_path / "configs" / "mine.yaml"
    document.touch()
    monkeypatch.chdir(tmp_path / "elsewhere")
    found = find_path("sheet.yaml", at(document), "model", "file")
    assert found == tmp_path / "configs" / "sheet.yaml"
    # In documents, too, which no shell expands.
    (tmp_path / "sheet.yaml").touch()
    monkeypatch.setenv("HOME", str(tmp_path))
    found = find_path("~/sheet.yaml", at(tmp_path / "mine.yaml"), "model", "file")
    assert found == tmp_path / "sheet.yaml"


@pytest.mark.parametrize("position", [None, Position("--set", 1, 1)])
def test_on_the_command_line_a_path_starts_from_the_current_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, position: Position | None
) -> None:
    (tmp_path / "assets").mkdir()
    monkeypatch.chdir(tmp_path)
    assert find_path("assets", position, "", "folder", is_folder=True) == Path("assets")


def test_a_folder_in_place_of_a_file_is_named_as_such_and_so_are_long_names(tmp_path: Path) -> None:
    """It was said not to be there."""
    (tmp_path / "coco").mkdir()
    (tmp_path / "mine.yaml").touch()
    with pytest.raises(ConfigError, match=r"coco' is a folder; expected a file with a model"):
        find_path("coco", at(tmp_path / "mine.yaml"), "sensors[0].model", "model")
    with pytest.raises(ConfigError, match=r"coco' is a folder; expected a file with a config"):
        load_config(str(tmp_path / "coco"))
    with pytest.raises(
        ConfigError, match=r"^'n{57}\.\.\.' is not a configuration \(File name too long\)$"
    ):
        load_config("n" * 300)


def test_shipped_names_come_last_and_need_no_suffix(tmp_path: Path) -> None:
    """A file of the user comes before a shipped one; a file never means itself."""
    shipped = [tmp_path / "package" / "street.yaml"]
    document = tmp_path / "street.yaml"
    document.touch()
    (tmp_path / "other.yaml").touch()

    def found(name: str, position: Position) -> Path:
        return find_path(name, position, "extends", "configuration", shipped=shipped)

    assert found("street", at(document)) == shipped[0]
    assert found("street.yaml", at(document)) == shipped[0]
    assert found("street.yaml", at(tmp_path / "other.yaml")) == document


def test_the_message_says_where_it_was_looked_for(tmp_path: Path) -> None:
    """Place, path, and the nearest shipped name."""
    document = tmp_path / "mine.yaml"
    document.touch()
    with pytest.raises(ConfigError) as caught:
        find_path("stret", at(document), "template", "template", shipped=[Path("street.yaml")])
    assert str(caught.value) == (
        f"{document}:2:5: template: there is no template 'stret'; "
        f"looked for '{tmp_path / 'stret'}' (did you mean 'street.yaml'?); expected a file or a "
        "shipped name, which gen-data describe lists"
    )


def test_asset_folders_start_from_the_configuration_and_do_not_enter_its_identity(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A data set is resumed from any folder: its plan holds the path as it is written."""
    (tmp_path / "set" / "meshes").mkdir(parents=True)
    (tmp_path / "set" / "mine.yaml").write_text(
        "template: tabletop\nassets: {folders: [meshes]}\n" + SENSOR
    )
    monkeypatch.chdir(tmp_path)
    first = load_config("set/mine.yaml")
    folders = first.asset_folders
    monkeypatch.chdir(tmp_path / "set")
    second = load_config("mine.yaml")
    assert [folder.resolve() for folder in second.asset_folders] == [tmp_path / "set" / "meshes"]
    assert folders == (Path("set/meshes"),)
    assert first.resolved == second.resolved
    assert first.resolved["assets"] == {"folders": ["meshes"]}


def test_a_missing_asset_folder_is_told_with_its_place(tmp_path: Path) -> None:
    source = tmp_path / "mine.yaml"
    source.write_text("template: tabletop\nassets: {folders: [mehses]}\n" + SENSOR)
    with pytest.raises(ConfigError) as caught:
        load_config(str(source))
    assert str(caught.value).startswith(
        f"{source}:2:20: assets.folders[0]: there is no folder 'mehses'; "
        f"looked for '{tmp_path / 'mehses'}'"
    )


@pytest.mark.parametrize(
    ("name", "reason"),
    [("n" * 300, "too long"), ("~nobody-here/x", "home directory"), ("a\nb", r"'a\\nb'; looked")],
)
def test_an_impossible_file_name_is_refused_at_once(tmp_path: Path, name: str, reason: str) -> None:
    """With its place, whatever the operating system's message."""
    with pytest.raises(ConfigError, match=reason) as caught:
        find_path(name, at(tmp_path / "mine.yaml"), "template", "template")
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(f"{tmp_path}/mine.yaml:2:5: template: ")
