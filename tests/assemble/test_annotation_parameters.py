"""Annotations in configurations: names, or mappings with parameters."""

import inspect
from pathlib import Path

import pytest

from gen_data.annotations import TABLE
from gen_data.annotations.bev_map import BevMap
from gen_data.annotations.boxes2d import Boxes2d
from gen_data.annotations.lanes import Lanes
from gen_data.assemble.config import load_config
from gen_data.assemble.config_schema import config_schema
from gen_data.config.describe import describe
from gen_data.core.errors import ConfigError

CAMERA = "template: tabletop\nsensors:\n  - {type: rgb_camera, name: color}\n"


def loaded(tmp_path: Path, annotations: str) -> dict[str, object]:
    path = tmp_path / "some.yaml"
    path.write_text(f"{CAMERA}annotations: {annotations}\n")
    return dict(load_config(str(path)).annotations)


def test_names_and_mappings_may_be_mixed(tmp_path: Path) -> None:
    """In order; what is not given has its default."""
    found = loaded(tmp_path, "[boxes2d, {type: bev_map, px_m: 0.5}, lanes]")

    assert found == {"boxes2d": Boxes2d(), "bev_map": BevMap(px_m=0.5), "lanes": Lanes()}
    assert list(found) == ["boxes2d", "bev_map", "lanes"]


@pytest.mark.parametrize(("annotations", "fault"), [
    ("[{type: bev_map, pxm: 0.5}]", r"annotations\[0\].pxm: unknown key .*'px_m'"),
    ("[{type: bev_map, px_m: -1}]", r"annotations\[0\].px_m: "),
    ("[{type: boxes2d, px_m: 1}]", r"annotations\[0\].px_m: unknown key"),
    ("[{type: language, kinds: [distanse]}]",
     r"annotations\[0\].kinds: unknown kind 'distanse'; .*'distance'"),
    ("[{type: language, kinds: []}]", r"annotations\[0\].kinds: "),
    ("[lanes, {type: lanes, far_m: 9}]", "the annotation 'lanes' is listed twice"),
    ("[{type: bev_mpa}]", "unknown annotation 'bev_mpa'; .*did you mean 'bev_map'"),
    ("[{px_m: 1}]", "unknown annotation"),
])  # fmt: skip
def test_what_cannot_be_is_told_at_its_place(tmp_path: Path, annotations: str, fault: str) -> None:
    with pytest.raises(ConfigError, match=rf"some.yaml:4:\d+: .*{fault}"):
        loaded(tmp_path, annotations)


@pytest.mark.slow
def test_editors_know_both_spellings() -> None:
    """The schema lists every name, and a mapping for each that has parameters."""
    names, *mappings = config_schema()["properties"]["annotations"]["items"]["oneOf"]

    assert names == {"enum": list(TABLE)}
    assert {m["$ref"].rpartition(".")[2] for m in mappings} == {
        name
        for name in TABLE.names()
        if set(inspect.signature(TABLE.load(name)).parameters) - {"type"}
    }


@pytest.mark.parametrize("name", TABLE.names())
def test_every_annotator_explains_itself(name: str) -> None:
    text = describe(TABLE.load(name))

    assert len(text.splitlines()[0]) > 20
    assert ("px_m" in text) == (name == "bev_map")
