"""Words of earlier releases are read, and a warning names the new one and its place."""

import subprocess
import sys
import warnings
from pathlib import Path

import pytest

from gen_data.assemble.config import load_config
from gen_data.assemble.plugin_tables import TABLES
from gen_data.config.distributions import Constant
from gen_data.config.renamed_keys import PLUGINS, RANDOMIZERS, TYPES, replace_old_words
from gen_data.config.yaml_tree import parse_yaml
from gen_data.core.errors import ConfigError

OLD = """\
template: street
shared: {crowd: {choice: [few, many]}, gap: {given: crowd, few: 9, otherwise: 1}}
randomizers:
  - {type: along, name: parked, used: {given: crowd, few: false, otherwise: true}, rows: 2,
     turned: true, scattered: false, at_least: 1, spare_m: 0.2, every: scene}
  - {type: lighting, name: lamps, every: view, keep: true, panel_m: 0.5}
  - {type: ceiling_lights, name: ceiling, rows: 2}
sensors:
  - {type: rgb_camera, name: color, lens: {model: published, camera: kitti_raw_02}}
  - {type: lidar, name: top, motion: compensated}
  - {type: watcher, name: log, watches: [collision]}
"""

NEW = """\
template: street
shared: {crowd: {choice: [few, many]}, gap: {switch: crowd, few: 9, default: 1}}
randomizers:
  - {type: lane_objects, name: parked, occupancy: {switch: crowd, few: false, default: true},
     passes: 2, reversed: true, uniform_area: false, min_count: 1, min_clearance_m: 0.2,
     stage: scene}
  - {type: lighting, name: lamps, stage: view, keep_existing: true, width_m: 0.5}
  - {type: ceiling_lights, name: ceiling, rows: 2}
sensors:
  - {type: rgb_camera, name: color, lens: {model: calibrated, camera: kitti_raw_02}}
  - {type: lidar, name: top, motion_distortion: deskewed}
  - {type: watcher, name: log, events: [collision]}
"""


def test_old_words_mean_the_new_ones_and_a_warning_names_place_and_new_word() -> None:
    with pytest.warns(FutureWarning) as caught:
        current = replace_old_words(parse_yaml(OLD, "old.yaml"))
    assert current.plain() == parse_yaml(NEW, "new.yaml").plain()
    messages = [str(warning.message) for warning in caught]
    assert len(messages) == len(set(messages)) == 19
    assert messages[0] == (
        "old.yaml:2:46: shared.gap.given: 'given' is called 'switch' now; "
        "the old name will be refused by the next release"
    )
    assert any(m.startswith("old.yaml:9:51: sensors[0].lens.model: 'published'") for m in messages)


def test_old_words_are_told_as_often_as_a_document_is_read() -> None:
    """Only items without any are not searched again."""
    document = parse_yaml(OLD, "old.yaml")
    for _ in range(2):
        with pytest.warns(FutureWarning) as caught:
            current = replace_old_words(document)
        assert len(caught) == 19
    assert replace_old_words(current) is current
    assert replace_old_words(current).plain() == parse_yaml(NEW, "new.yaml").plain()


def test_current_words_and_plans_of_older_data_sets_are_read_in_silence() -> None:
    """Nobody is meant to edit a plan."""
    document = parse_yaml(NEW, "new.yaml")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert replace_old_words(document) == document
        current = replace_old_words(parse_yaml(OLD, "out/street/plan.json"))
    assert current.plain() == document.plain()


def test_old_words_may_stand_in_selections_but_not_beside_the_new_word() -> None:
    """Which of them is meant cannot be known."""
    text = "randomizers: [{type: ego_on_lane, name: e, spare_m: 1, min_clearance_m: 2}]"
    with pytest.raises(ConfigError) as caught:
        replace_old_words(parse_yaml(text, "x.yaml"))
    assert str(caught.value).startswith(
        "x.yaml:1:44: randomizers[0].spare_m: is called 'min_clearance_m' now"
    )
    text = "sensors: [{type: rgb_camera, formation: {given: s, a: {bloom: 1}, otherwise: {}}}]"
    with pytest.warns(FutureWarning):
        current = replace_old_words(parse_yaml(text, "x.yaml"))
    pipeline = {"switch": "s", "a": {"glare": 1}, "default": {}}
    assert current.plain() == {"sensors": [{"type": "rgb_camera", "image_pipeline": pipeline}]}


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::FutureWarning")
def test_the_command_line_may_use_old_words_too(tmp_path: Path) -> None:
    """They take precedence over the file, like overrides."""
    path = tmp_path / "mine.yaml"
    path.write_text("extends: street.yaml\n")
    spec = load_config(str(path), overrides=("randomizers.people.rows=3",))
    assert {r.name: r for r in spec.probes[0].randomizers}["people"].passes == 3


def test_every_new_word_is_one_of_its_plugin_and_no_old_one_is() -> None:
    """The tables agree with the plug-ins."""
    for (section, kind), renames in PLUGINS.items():
        plugin = TABLES[section.removesuffix("s")].load(kind)
        for path, words in renames.keys.items():
            fields = (plugin.model_fields[path].annotation if path else plugin).model_fields
            assert set(words.values()) <= fields.keys()
            assert not words.keys() & fields.keys()
    for section, names in TYPES.items():
        table = TABLES[section.removesuffix("s")]
        assert set(names.values()) <= set(table)
        assert not set(names) & set(table)
    for kind in TABLES["randomizer"]:
        fields = TABLES["randomizer"].load(kind).model_fields
        assert set(RANDOMIZERS.values()) <= fields.keys()
        assert not set(RANDOMIZERS) & fields.keys()


@pytest.mark.slow
def test_the_command_line_shows_a_warning_as_one_plain_line(tmp_path: Path) -> None:
    """On standard error, before anything else; no source line of Python's."""
    inherited = len(load_config("street.yaml").resolved["randomizers"])
    path = tmp_path / "mine.yaml"
    path.write_text("extends: street.yaml\nrandomizers: [{type: along, name: x, sped: 1}]\n")
    done = subprocess.run(
        [sys.executable, "-m", "gen_data.cli", "--config", str(path), "--n", "1"],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    lines = done.stderr.splitlines()
    assert done.returncode == 2
    assert lines[0].startswith(
        f"gen-data: warning: {path}:2:22: randomizers[0].type: 'along' is called 'lane_objects'"
    )
    where = f"{path}:2:38: randomizers[{inherited}].sped"
    assert lines[1].startswith(f"gen-data: {where}: unknown key")


def test_an_override_without_a_type_may_use_old_words(tmp_path: Path) -> None:
    """Nested ones too; other values stay inherited, and the last file takes precedence."""
    (tmp_path / "base.yaml").write_text(
        "template: tabletop\n"
        "sensors: [{type: rgb_camera, name: c, image_pipeline: {glare: 0.1, flare: 0.2}}]\n"
    )
    middle = tmp_path / "middle.yaml"
    middle.write_text(
        "extends: base.yaml\nsensors: [{name: c, formation: {bloom: 0.3, vignetting: 0.4}}]\n"
    )
    top = tmp_path / "top.yaml"
    top.write_text("extends: middle.yaml\nsensors: [{name: c, image_pipeline: {glare: 0.5}}]\n")
    with pytest.warns(FutureWarning) as caught:
        (overridden,) = load_config(str(middle)).sensors
    with pytest.warns(FutureWarning):
        (last,) = load_config(str(top)).sensors
    found = overridden.image_pipeline
    assert [found.glare, found.flare, found.vignetting] == [Constant(v) for v in (0.3, 0.2, 0.4)]
    assert last.image_pipeline.glare == Constant(0.5)
    messages = [str(warning.message) for warning in caught]
    assert [m.partition(": ")[0] for m in messages] == [f"{middle}:2:21", f"{middle}:2:33"]
