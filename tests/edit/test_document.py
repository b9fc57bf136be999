"""The editor's view of a text: faults, origins, completions, explanations, controls."""

from __future__ import annotations

from pathlib import Path

import pytest

from gen_data.assemble.config import load_config
from gen_data.config.distributions import Choice, UniformInteger
from gen_data.core.errors import ConfigError
from gen_data.lab.edit import controls
from gen_data.lab.edit.completion import complete, explain
from gen_data.lab.edit.document import Fault, analyse, find_faults, find_item, list_origins
from tests.repository import ROOT

TABLETOP = (ROOT / "configs/tabletop.yaml").read_text("utf-8")
CONFIG = load_config("tabletop.yaml")


def labels(marked: str) -> list[str]:
    """Words that are proposed at the bar of a text."""
    offset = marked.index("|")
    _, found = complete(marked.replace("|", "", 1), offset, CONFIG.document)
    return [one.label for one in found]


def test_a_file_that_is_not_saved_yet_names_files_next_to_it(tmp_path: Path) -> None:
    """As it will when it is saved, wherever the command was started."""
    (tmp_path / "base.yaml").write_text("extends: closeup.yaml\nseed: 77\n")
    (tmp_path / "assets").mkdir()
    text = "extends: base.yaml\nassets: {folders: [assets]}\n"
    config = analyse(text, str(tmp_path / "new.yaml")).config
    assert config is not None
    assert (config.general.seed, config.asset_folders) == (77, (tmp_path / "assets",))


@pytest.mark.parametrize(
    "wrong",
    ["seed: -7\n", "seed: 7\nrandomizers:\n  - {type: objects, name: a, cuont: 3}\n", "a: [\n"],
)
def test_faults_are_the_texts_of_the_command_line(wrong: str, tmp_path: Path) -> None:
    """Each with its line and column; the quoted source line is left to the editor."""
    text = f"template: tabletop\nsensors: [{{type: rgb_camera}}]\n{wrong}"
    path = tmp_path / "a.yaml"
    path.write_text(text, "utf-8")
    with pytest.raises(ConfigError) as refused:
        load_config(str(path))
    said = [line for line in str(refused.value).splitlines() if line.startswith(str(path))]
    faults = analyse(text, str(path)).faults
    assert [fault.text for fault in faults] == said
    for fault in faults:
        assert fault.text.startswith(f"{path}:{fault.line}:{fault.column}: ")


def test_a_fault_without_a_place_in_the_file_has_no_line() -> None:
    """As of a template that is wrong."""
    assert list(find_faults("other.yaml:3:1: a: is wrong", "x.yaml")) == [
        Fault(0, 0, "other.yaml:3:1: a: is wrong")
    ]


def test_every_value_has_the_file_and_line_that_give_it(tmp_path: Path) -> None:
    """The user's file, the one that it extends, and the template."""
    path = tmp_path / "mine.yaml"
    text = "extends: tabletop.yaml\nrandomizers:\n  - {name: orbit, distance_m: 2}\n"
    config = analyse(text, str(path)).config
    assert config is not None
    places = {origin.field: (origin.value, origin.place) for origin in list_origins(config)}
    orbit = next(k for k, r in enumerate(config.probes[0].randomizers) if r.name == "orbit")
    line = TABLETOP.splitlines().index("    elevation_deg: {uniform: [22, 65]}") + 1
    assert places[f"randomizers[{orbit}].distance_m"] == ("2", "mine.yaml:3")
    assert places[f"randomizers[{orbit}].elevation_deg"] == (
        "{uniform: [22, 65]}",
        f"tabletop.yaml:{line}",
    )
    assert places["elements[0].size_m"] == ("[5, 4, 2.8]", "tabletop.yaml:6")


@pytest.mark.parametrize(
    ("marked", "some", "none"),
    [
        ("|", ["seed", "randomizers", "extends"], ["count"]),
        ("randomizers:\n  - {type: objects, name: a, c|", ["count", "scale"], ["name", "fills"]),
        ("randomizers:\n  - {type: objects, name: a, c|}\nsensors: [", ["count"], ["fills"]),
        ("randomizers:\n  - type: camera_pose\n    |\n  - {type: x}\n", ["fills"], ["type"]),
        ("randomizers:\n  - {type: cam|", ["camera_pose", "objects"], ["rgb_camera"]),
        ("randomizers:\n  - |", ["camera_pose", "objects"], ["count"]),
        ("randomizers:\n  - {name: orbit, |}", ["fills", "azimuth_deg"], ["kinds"]),
        ("randomizers:\n  - {name: orbit, fills: |}", ["uniform", "normal"], ["fills"]),
        ("elements:\n  clutter:\n    |\n", ["placement", "count"], ["clutter"]),
        ("annotations: [boxes2d, |]", ["keypoints"], ["objects"]),
        ("sensors:\n  - {type: rgb_camera, lens: {model: |}}", ["pinhole"], ["k1"]),
        ("labels: {box3d: |}", ["body", "all"], ["min_box_px"]),
        ("labels:\n  include_invisible: |\n", ["true", "false"], ["body"]),
        ("a: 'it", [], ["seed"]),
    ],
)
def test_what_fits_at_the_cursor_is_proposed(marked: str, some: list[str], none: list[str]) -> None:
    """Also where the text is broken, and for items whose type is inherited."""
    found = labels(marked if "|" in marked else f"{marked}|")
    assert set(some) <= set(found)
    assert not set(none) & set(found)


def test_a_field_is_explained_by_its_type_default_and_description() -> None:
    """At any of its letters; other words have no explanation."""
    offset = TABLETOP.index("distance_m") + 4
    assert explain(TABLETOP, offset) == (
        "distance_m",
        "a number > 0 or a distribution\ndefault {uniform: [0.8, 1.3]}\nDistance to the look-at "
        "point.",
    )
    assert explain(TABLETOP, TABLETOP.index("orbit")) == ("", "")


def test_the_item_at_the_cursor_is_found() -> None:
    """By the line of the cursor, in lists and sections."""
    lines = TABLETOP.splitlines()
    orbit = lines.index("    elevation_deg: {uniform: [22, 65]}")
    assert find_item(TABLETOP, "x", orbit + 1) == ("randomizers", "orbit")
    assert find_item(TABLETOP, "x", lines.index("seed: 7") + 1) == ("seed", "")


def test_controls_follow_the_schema() -> None:
    """Kind, value and legal range of fields; changed values are as the file has them."""
    found = {one.field: one for one in controls.list_controls(CONFIG, "randomizers", "orbit")}
    elevation = found["elevation_deg"]
    assert (elevation.kind, elevation.low, elevation.high) == ("range", -90, 90)
    assert elevation.yaml((10, 20.04)) == {"uniform": [10, 20.04]}
    assert found["clearance_m"].kind == "number"
    assert found["clearance_m"].low == 0
    assert (elevation.legal, found["clearance_m"].legal) == ("from -90 to 90", "from 0")
    assert found["stage"].options == ("scene", "view")
    assert found["roll_deg"].yaml((1, 2)) == {
        "normal": {"mean": 1, "stddev": 2, "clip": [-10.0, 10.0]}
    }
    pose = {one.field: one for one in controls.list_controls(CONFIG, "randomizers", "pose")}
    assert pose["mode"].yaml(["reach", "hold"]) == {"choice": {"reach": 2, "hold": 1}}
    clutter = {one.field: one for one in controls.list_controls(CONFIG, "randomizers", "clutter")}
    assert clutter["count"].yaml((2.0, 5.0)) == {"uniform_integer": [2, 5]}
    assert clutter["upright"].yaml(0.25) == {"probability": 0.25}


def test_drawn_values_stand_beside_the_declared_density() -> None:
    """Over the same values; shares of each sum to one."""
    shown = controls.density(UniformInteger(1, 4), [1, 1, 4])
    assert shown is not None
    assert shown.labels == ("1", "2", "3", "4")
    assert shown.drawn == pytest.approx((2 / 3, 0, 0, 1 / 3))
    assert sum(shown.declared) == pytest.approx(1)
    named = controls.density(Choice({"a": 1, "b": 3}), ["b"])
    assert named is not None
    assert (named.labels, named.drawn) == (("a", "b"), (0, 1))
