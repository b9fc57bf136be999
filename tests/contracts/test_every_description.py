"""What ``gen-data describe`` prints of everything that a configuration can contain."""

from typing import Any

import pytest

from gen_data.assemble.descriptions import describe_name, described_models, list_names_of
from gen_data.assemble.plugin_tables import TABLES
from gen_data.config.describe import describe_fields
from gen_data.core.errors import ConfigError

COLUMNS = 80


@pytest.mark.parametrize("kind", sorted(TABLES))
def test_every_field_of_every_plugin_is_described(kind: str) -> None:
    """Those of nested mappings too; a field with one value is the name of its mapping."""
    silent = [
        f"{path}.{row.name}"
        for path, model in described_models(kind)
        for row in describe_fields(model)
        if not row.text
        and row.words != row.default
        and "const" not in model.model_json_schema()["properties"].get(row.name, {})
    ]
    assert silent == []


@pytest.mark.parametrize("kind", [*sorted(TABLES), "section"])
def test_every_description_fits_a_terminal(kind: str) -> None:
    """80 columns, also where the output is piped."""
    names = [path for path, _ in described_models(kind)]
    assert names
    wide = {
        line for name in names for line in describe_name(name).splitlines() if len(line) > COLUMNS
    }
    assert wide == set()


def test_the_list_of_all_names_fits_a_terminal() -> None:
    lines = list_names_of({"kind": [f"name_{k}" for k in range(99)]}).splitlines()
    assert max(map(len, lines)) <= COLUMNS
    assert " ".join(lines).count("name_") == 99


@pytest.mark.parametrize(("name", "contains"), [
    ("rgb_camera.lens", "brown_conrady"),
    ("brown_conrady", "k1"),
    ("labels", "min_visible_px"),
    ("labels.map", "min_box_px"),
    ("splits", "round_robin"),
    ("physics", "engine"),
    ("rgb_camera.image_pipeline", "vignetting"),
    ("coco.rectify", "hfov_deg"),
    ("section/labels", "min_visible_px"),
    ("lidar.model", "range_m"),
])  # fmt: skip
def test_nested_mappings_and_sections_are_described(name: str, contains: str) -> None:
    """By their path, or by the word that selects them."""
    assert contains in describe_name(name)


@pytest.mark.parametrize(
    ("name", "nearest"),
    [("rgb_camra", "rgb_camera"), ("brown_conardy", "brown_conrady"), ("label", "labels"),
     ("rgb_camera.lense", "lens"), ("lidars", "lidar")],
)  # fmt: skip
def test_unknown_names_give_the_nearest(name: str, nearest: Any) -> None:
    with pytest.raises(ConfigError, match=rf"did you mean '([a-z_]+\.)?{nearest}'"):
        describe_name(name)
