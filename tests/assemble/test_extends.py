"""A configuration may extend another: it states only the differences."""

from pathlib import Path

import pytest

from gen_data.assemble.config import load_config
from gen_data.assemble.documents import load_config_document
from gen_data.core.errors import ConfigError

BASE = """\
seed: 3
template: tabletop
render: {max_lamps: 4, device: cpu}
shared: {side: {uniform: [0, 1]}}
elements: {table: {height_m: 0.8}}
randomizers:
  - {type: objects, name: clutter, count: 3}
  - {type: colors, name: colors}
sensors:
  - {type: rgb_camera, name: color, size_px: [64, 48], hfov_deg: 60}
annotations: [boxes2d]
exporters: [{type: coco}]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "base.yaml").write_text(BASE)
    return tmp_path


def written(folder: Path, text: str, name: str = "mine.yaml") -> str:
    path = folder / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    return str(path)


def refusal(source: str) -> str:
    with pytest.raises(ConfigError) as caught:
        load_config(source)
    return str(caught.value)


def test_what_is_not_given_is_inherited(folder: Path) -> None:
    """Sections merge key by key, plug-ins by name, new ones are appended."""
    own = """\
extends: base.yaml
render: {max_lamps: 8}
elements: {table: {top_size_m: [1, 1]}}
randomizers:
  - {name: clutter, upright: true}
  - {type: materials, name: finish}
annotations: [poses]
exporters: [{type: kitti}]
"""
    plain = load_config_document(written(folder, own)).plain()

    assert plain == {
        "seed": 3,
        "template": "tabletop",
        "render": {"max_lamps": 8, "device": "cpu"},
        "shared": {"side": {"uniform": [0, 1]}},
        "elements": {"table": {"height_m": 0.8, "top_size_m": [1, 1]}},
        "randomizers": [
            {"type": "objects", "name": "clutter", "count": 3, "upright": True},
            {"type": "colors", "name": "colors"},
            {"type": "materials", "name": "finish"},
        ],
        "sensors": [{"type": "rgb_camera", "name": "color", "size_px": [64, 48], "hfov_deg": 60}],
        "annotations": ["poses"],
        "exporters": [{"type": "kitti"}],
    }


def test_a_list_of_outputs_replaces_the_inherited_one(folder: Path) -> None:
    """Annotations and exporters are computed and written as listed, and no others."""
    text = "extends: base.yaml\nannotations: [poses, {type: boxes3d}]\nexporters: []\n"
    spec = load_config(written(folder, text))

    assert list(spec.annotations) == ["poses", "boxes3d"]
    assert spec.exporters == ()


def test_names_of_exporters_are_short_for_mappings(folder: Path) -> None:
    """They give the same document, which runs are compared by, and may be left out."""
    written(folder, BASE.replace("[{type: coco}]", "[coco, yolo]"), "base.yaml")
    both, one = (
        load_config(written(folder, f"extends: base.yaml\n{more}")).document
        for more in ("", "without: {exporters: [yolo]}\n")
    )
    assert both.plain()["exporters"] == [{"type": "coco"}, {"type": "yolo"}]
    assert one.plain()["exporters"] == [{"type": "coco"}]


@pytest.mark.parametrize("key", ["annotations", "exporters"])
def test_errors_in_a_list_of_outputs_count_its_own_items(folder: Path, key: str) -> None:
    """The second item of the user's list is number 1, whatever is inherited."""
    items = {"annotations": "boxes2d, bokses", "exporters": "{type: yolo}, {type: koko}"}
    message = refusal(written(folder, f"extends: base.yaml\n{key}: [{items[key]}]\n"))

    assert f"mine.yaml:2:{24 if key == 'annotations' else 34}: {key}[1]" in message


@pytest.mark.parametrize("key", ["annotations", "exporters"])
def test_outputs_are_either_listed_or_left_out(folder: Path, key: str) -> None:
    """Nothing is left of the inherited list when a new one replaces it."""
    named = {"annotations": ("boxes2d", "[poses]"), "exporters": ("coco", "[{type: kitti}]")}
    name, own = named[key]
    text = f"extends: base.yaml\nwithout: {{{key}: [{name}]}}\n{key}: {own}\n"

    assert (
        f"mine.yaml:2:{13 + len(key)}: without.{key}: the list '{key}' replaces all inherited ones;"
        " expected one of the two"
    ) in refusal(written(folder, text))
    everything = f"extends: base.yaml\nwithout: {{{key}: all}}\n{key}: {own}\n"
    assert load_config(written(folder, everything)).resolved[key]


def test_inherited_plugins_can_be_left_out(folder: Path) -> None:
    """Before merging: another item of the same name starts without inherited values."""
    own = """\
extends: base.yaml
without: {randomizers: [clutter], exporters: [coco], elements: [table], annotations: [boxes2d]}
randomizers: [{type: materials, name: clutter}]
"""
    plain = load_config_document(written(folder, own)).plain()

    assert plain["randomizers"] == [
        {"type": "colors", "name": "colors"},
        {"type": "materials", "name": "clutter"},
    ]
    assert (plain["exporters"], plain["elements"], plain["annotations"]) == ([], {}, [])
    assert "without" not in plain


def test_a_chain_is_followed_and_paths_start_from_each_file(folder: Path) -> None:
    """``../base.yaml`` is relative to the file that contains it, whatever the current folder."""
    written(folder, "extends: ../base.yaml\nseed: 4\n", "sub/middle.yaml")
    spec = load_config(written(folder, "extends: sub/middle.yaml\nviews_per_scene: 2\n"))

    assert (spec.general.seed, spec.general.views_per_scene, spec.name) == (4, 2, "mine")


def test_shipped_configurations_can_be_extended_even_by_one_of_the_same_name(folder: Path) -> None:
    spec = load_config(written(folder, "extends: tabletop.yaml\nseed: 99\n", "tabletop.yaml"))

    assert spec.general.seed == 99
    assert spec.probes[0].randomizers == load_config("tabletop").probes[0].randomizers


def test_an_error_in_an_inherited_value_points_to_its_own_file(folder: Path) -> None:
    """File, line and column of the base."""
    (folder / "base.yaml").write_text(BASE.replace("count: 3", "count: three"))
    message = refusal(written(folder, "extends: base.yaml\n"))

    assert message.startswith(f"{folder / 'base.yaml'}:7:43: randomizers[0].count: ")


def test_a_chain_has_an_end_and_a_circle_is_named(folder: Path) -> None:
    first = written(folder, "extends: b.yaml\n", "a.yaml")
    second = written(folder, "extends: a.yaml\n", "b.yaml")

    message = refusal(first)

    assert message.startswith(f"{second}:1:10: extends: extends itself: ")
    assert f"{first} -> {second} -> {first}" in message

    for k in range(10):
        written(folder, f"extends: c{k + 1}.yaml\n", f"c{k}.yaml")
    written(folder, BASE, "c10.yaml")

    assert load_config(str(folder / "c2.yaml")).general.seed == 3
    assert "more than 8 configurations extend one another" in refusal(str(folder / "c1.yaml"))


@pytest.mark.parametrize(
    ("text", "fact"),
    [
        ("extends: [base.yaml]\n", "1:10: extends: expected a configuration"),
        ("extends: bass.yaml\n", "1:10: extends: there is no configuration 'bass.yaml'; looked"),
        (
            "extends: base.yaml\nwithout: {randomizers: [{a: 1}]}\n",
            "2:25: without.randomizers: nothing inherited is named {a: 1}; ",
        ),
        (
            "extends: base.yaml\nwithout: {randomizers: [colour]}\n",
            "2:25: without.randomizers: nothing inherited is named 'colour'; "
            "expected one of clutter, colors (did you mean 'colors'?)",
        ),
        ("extends: base.yaml\nwithout: {sensor: [a]}\n", "2:11: without.sensor: unknown key"),
        ("extends: base.yaml\nwithout: {sensors: a}\n", "2:20: without.sensors: expected a list"),
    ],
)
def test_what_cannot_be_extended_is_refused_in_place(folder: Path, text: str, fact: str) -> None:
    assert fact in refusal(written(folder, text))


def template_of(folder: Path, defaults: str) -> str:
    """Path of a configuration whose template lays down what its tables have in common."""
    written(
        folder,
        f"defaults: {defaults}\n"
        "elements:\n"
        "  - {type: room, name: room, size_m: [4, 4, 3]}\n"
        "  - {type: surface, name: a, asset: table, top_size_m: [1, 1]}\n"
        "  - {type: surface, name: b, asset: table, top_size_m: [1, 1], height_m: 0.4}\n",
        "tables.yaml",
    )
    camera = "sensors: [{type: rgb_camera, name: color}]\n"
    return written(folder, f"template: tables.yaml\n{camera}elements: {{a: {{style: trestle}}}}\n")


def test_a_template_lays_down_what_elements_of_a_type_have_in_common(tmp_path: Path) -> None:
    """Each of them may differ, and a configuration overrides both."""
    spec = load_config(template_of(tmp_path, "{surface: {height_m: 0.7, style: bench}}"))
    a, b = (e for e in spec.probes[0].elements if e.type == "surface")

    assert (a.height_m, a.style, b.height_m, b.style) == (0.7, "trestle", 0.4, "bench")


def test_defaults_for_a_type_that_no_element_has_are_refused(tmp_path: Path) -> None:
    message = refusal(template_of(tmp_path, "{surfaces: {height_m: 0.7}}"))

    assert f"{tmp_path / 'tables.yaml'}:1:12: defaults.surfaces: no element is of this" in message
    assert "did you mean 'surface'?" in message


@pytest.mark.parametrize(("text", "place", "near"), [
    ("sensors: [{name: colour, size_px: [64, 48]}]", "2:18: sensors[1].type", "color"),
    ("randomizers: [{name: cluter, count: 3}]", "2:22: randomizers[2].type", "clutter"),
])  # fmt: skip
def test_a_change_of_an_inherited_plugin_that_does_not_exist_names_the_nearest(
    folder: Path, text: str, place: str, near: str
) -> None:
    told = refusal(written(folder, f"extends: base.yaml\n{text}\n"))
    name = text.partition("name: ")[2].partition(",")[0]
    fact = f"nothing inherited is named '{name}' (did you mean '{near}'?); expected a mapping with"
    assert f"mine.yaml:{place}: {fact} 'type', which names one " in told
