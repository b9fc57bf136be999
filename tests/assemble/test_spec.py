"""A configuration and its template become one validated Config; every fault has its place."""

import json
import pickle
from pathlib import Path

import pytest

from gen_data.assemble.config import load_config
from gen_data.assemble.plugin_tables import find_plugin
from gen_data.config.distributions import Constant
from gen_data.core.errors import ConfigError

CAMERA = "sensors: [{type: rgb_camera, name: color, size_px: [64, 48], hfov_deg: 60}]\n"


def written(folder: Path, text: str) -> str:
    path = folder / "mine.yaml"
    path.write_text(text)
    return str(path)


def refusal(source: str, **options: object) -> str:
    with pytest.raises(ConfigError) as error:
        load_config(source, **options)  # type: ignore[arg-type]
    return str(error.value)


@pytest.mark.parametrize("name", ["tabletop.yaml", "bin_picking.yaml", "shelf.yaml", "tabletop"])
def test_shipped_configurations_are_valid_from_any_folder(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Shipped names work wherever the user is, with or without their suffix."""
    monkeypatch.chdir(tmp_path)

    spec = load_config(name)

    assert spec.name == name.removesuffix(".yaml")
    assert (
        spec.probes[0].elements and spec.probes[0].randomizers and spec.sensors and spec.exporters
    )


def test_configuration_overrides_its_template_by_element_name(tmp_path: Path) -> None:
    """Only what is named changes; the rest of the element stays the template's."""
    source = written(tmp_path, "template: tabletop\nelements: {table: {height_m: 0.9}}\n" + CAMERA)
    nominal = {e.name: e for e in load_config("tabletop.yaml").probes[0].elements}

    table = {e.name: e for e in load_config(source).probes[0].elements}["table"]

    assert (table.height_m, table.top_size_m) == (0.9, nominal["table"].top_size_m)


def test_override_of_an_unknown_element_is_refused(tmp_path: Path) -> None:
    source = written(tmp_path, "template: tabletop\nelements: {tabel: {height_m: 1}}\n" + CAMERA)

    message = refusal(source)

    assert message.startswith(f"{source}:2:12: elements.tabel: ")
    assert "did you mean 'table'?" in message


def test_command_line_wins_over_file_and_template() -> None:
    """``--set`` reaches elements and randomizers by name, the top level, and absent sections."""
    spec = load_config(
        "tabletop.yaml",
        seed=0,
        overrides=(
            "elements.table.height_m=0.6",
            "randomizers.clutter.count=3",
            "physics.settle_time_s_max=2.5",
            "views_per_scene=2",
        ),
    )

    assert spec.general.seed == 0
    assert {e.name: e for e in spec.probes[0].elements}["table"].height_m == 0.6
    assert {r.name: r for r in spec.probes[0].randomizers}["clutter"].count == Constant(3)
    assert spec.general.physics.settle_time_s_max == 2.5
    assert spec.general.views_per_scene == 2


def test_without_leaves_a_randomizer_out() -> None:
    names = [r.name for r in load_config("tabletop.yaml").probes[0].randomizers]

    kept = [r.name for r in load_config("tabletop.yaml", without=("colors",)).probes[0].randomizers]

    assert kept == [name for name in names if name != "colors"]
    assert "did you mean 'colors'?" in refusal("tabletop.yaml", without=("colour",))


def test_resolved_document_makes_the_same_spec_again(tmp_path: Path) -> None:
    """``plan.json`` is sufficient to make every sample of a data set again."""
    first = load_config("tabletop.yaml", seed=5, overrides=("randomizers.clutter.count=3",))
    plan = {"config": first.resolved, "name": first.name}
    (tmp_path / "plan.json").write_text(json.dumps(plan))

    assert load_config(str(tmp_path)) == first


@pytest.mark.parametrize("name", ["parking", "tabletop"])
def test_probes_are_the_configurations_that_their_shared_values_give_alone(name: str) -> None:
    """Plug-ins made for an earlier probe are used again only where they are the same."""
    config = load_config(name)

    assert len(config.probes) > 1
    assert len({repr(probe) for probe in config.probes}) == len(config.probes)
    for probe in config.probes:
        assert repr(config.scene_config(probe.shared)) == repr(probe)


@pytest.mark.slow
def test_a_configuration_with_finished_scenes_may_probe_the_first_alone() -> None:
    """Exports draw nothing: outcomes of shared values were checked before their data set."""
    (probe,) = load_config("street.yaml", first_scene_only=True).probes

    assert repr(probe) == repr(load_config("street.yaml").probes[0])


def test_spec_crosses_process_borders() -> None:
    """A worker process gets the Config itself, not a path that may change meanwhile."""
    spec = load_config("tabletop.yaml")

    assert pickle.loads(pickle.dumps(spec)) == spec


@pytest.mark.parametrize(("text", "fact"), [
    ("seed: 1\n" + CAMERA, "template: expected the name of a template"),
    ("template: tabeltop\n" + CAMERA, "did you mean 'tabletop.yaml'?"),
    ("template: [{type: room}]\n" + CAMERA, "a list of elements has the key 'elements'"),
    ("template: tabletop\n", "sensors: at least one sensor is needed"),
    ("template: tabletop\nseed: -1\n" + CAMERA, "seed: "),
    ("template: tabletop\nsplits: {train: 0.5, val: 0.1}\n" + CAMERA, "shares must sum to 1"),
    ("template: tabletop\nrandomizers: {a: 1}\n" + CAMERA, "randomizers: expected a list"),
    ("template: tabletop\nrandomizers: [{name: a}]\n" + CAMERA, "randomizers[0].type: "),
    ("template: tabletop\nannotations: [boxes]\n" + CAMERA, "unknown annotation 'boxes'"),
    ("template: tabletop\nrender: {device: gpu}\n" + CAMERA, "render.device: "),
])  # fmt: skip
def test_wrong_configuration_is_refused(tmp_path: Path, text: str, fact: str) -> None:
    assert fact in refusal(written(tmp_path, text))


def test_equal_names_are_refused_at_the_second(tmp_path: Path) -> None:
    """Names are keys of random streams: two of one would draw the same."""
    text = (
        "template: tabletop\nrandomizers:\n"
        "  - {type: colors, name: a}\n  - {type: materials, name: a}\n"
    )
    source = written(tmp_path, text + CAMERA)

    assert f"{source}:4:29: randomizers[1].name: the name 'a' is taken" in refusal(source)


def test_plugins_are_found_by_name_and_kind() -> None:
    """A name that two kinds share needs its kind; an unknown one gets the nearest."""
    assert find_plugin("lighting")[0] == "randomizer"
    assert find_plugin("element/objects")[0] == "element"
    with pytest.raises(ConfigError, match="element/objects, randomizer/objects"):
        find_plugin("objects")
    with pytest.raises(ConfigError, match="did you mean 'lighting'"):
        find_plugin("lightning")
