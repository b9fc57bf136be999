"""Shared values that no selection and no inherited choice has are refused at their own place."""

import re
from pathlib import Path

import pytest

from gen_data.assemble.config import load_config
from gen_data.core.errors import ConfigError, ConfigWarning

TEMPLATE = """\
shared: {PLACE}
elements:
  - type: surface
    name: desk
    asset: table
    top_size_m: [1.3, 0.9]
    height_m: {switch: place, kitchen: 0.9, living: 0.5, default: 0.7}
"""
CONFIG = """\
template: t.yaml
SHARED
randomizers: []
sensors: [{type: rgb_camera, name: color, size_px: [64, 48], hfov_deg: 60}]
annotations: [boxes2d]
exporters: [coco]
"""
CHOICE = "place: {choice: {kitchen: 1, terrace: 1}}"


def load(folder: Path, place: str, shared: str, *overrides: str) -> None:
    (folder / "t.yaml").write_text(TEMPLATE.replace("PLACE", place))
    (folder / "own.yaml").write_text(CONFIG.replace("SHARED", shared))
    load_config(str(folder / "own.yaml"), overrides=overrides)


def refusal(name: str, *overrides: str) -> str:
    with pytest.raises(ConfigError) as caught:
        load_config(name, overrides=overrides)
    return str(caught.value)


@pytest.mark.parametrize(("name", "override", "column", "fact"), [
    ("closeup", "shared.arranged=piel", 17, "unknown value 'piel'; .*(did you mean 'pile'?)"),
    ("closeup", "shared.place=kitchn", 14, "unknown value 'kitchn'; .*(did you mean 'kitchen'?)"),
    ("street", "shared.landmark=brige", 17, "unknown value 'brige'; expected one of bridge, none, "
     "petrol, rail, square (did you mean 'bridge'?)"),
    ("street", "shared.cut={choice: {wals: 1, none: 1}}", 22, "unknown value 'wals'; .*'walls'"),
    ("street", "shared.parking=paralel", 16, "unknown value 'paralel'; .*'parallel'"),
    ("street", "shared.season=wintr", 15, "unknown value 'wintr'; .*'winter'"),
    ("street", "shared.robott=kuka", 8, "nothing uses this shared value; "),
    ("street", "shared.junctoin=x", 8, "nothing uses this shared value; .*did you mean 'junction'"),
])  # fmt: skip
def test_a_misspelt_override_is_refused(name: str, override: str, column: int, fact: str) -> None:
    field = re.match(r"shared\.\w+", override)
    assert field
    wanted = f"--set:1:{column}: {field[0]}: {fact}".replace("(", r"\(").replace("?)", r"\?\)")
    assert re.match(wanted, refusal(name, override)), refusal(name, override)


@pytest.mark.parametrize(("shared", "place"), [
    ("shared: {place: kitchn}", "2:17: shared.place: unknown value 'kitchn'"),
    ("shared: {place: {choice: [living, kitchn]}}", "2:35: shared.place: unknown value 'kitchn'"),
    ("shared: {plaec: kitchen}", "2:10: shared.plaec: nothing uses this shared value; expected "
     r"one of place \(did you mean 'place'\?\)"),
])  # fmt: skip
def test_a_misspelt_entry_is_refused_at_its_place(shared: str, place: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=f"own.yaml:{place}"):
        load(tmp_path, CHOICE, shared)


def test_values_that_a_chain_of_files_declares_are_known_in_all_of_them(tmp_path: Path) -> None:
    """A configuration in between narrows the choice; the next one may widen it again."""
    load(tmp_path, CHOICE, "shared: {place: kitchen}")
    (tmp_path / "mine.yaml").write_text("extends: own.yaml\nshared: {place: terrace}\n")
    load_config(str(tmp_path / "mine.yaml"), overrides=["shared.place=living"])
    (tmp_path / "mine.yaml").write_text("extends: own.yaml\nshared: {place: terace}\n")
    assert "mine.yaml:2:17: shared.place: unknown value 'terace'" in refusal(
        str(tmp_path / "mine.yaml")
    )


@pytest.mark.parametrize(("place", "shared", "overrides"), [
    ("place: kitchen", "shared: {place: garage}", ()),
    ("place: {choice: [kitchen, garage]}", "seed: 1", ("shared.place=garage",)),
    (CHOICE, "shared: {place: {choice: [living, terrace]}}", ()),
    (CHOICE, "shared: {room: {choice: [kitchen, living]}, place: $shared.room}", ()),
    ("", "shared: {place: garage}", ()),
    ("place: 3", "shared: {place: 4}", ()),
])  # fmt: skip
def test_constants_and_declared_values_without_an_entry_stay_legal(
    place: str, shared: str, overrides: tuple[str, ...], tmp_path: Path
) -> None:
    load(tmp_path, place, shared, *overrides)


@pytest.mark.parametrize(("shared", "fact"), [
    ("shared: {place: kitchn}", "shared.place: no selection has 'kitchn' .did you mean 'kitchen'"),
    ("shared: {hue: red}", "shared.hue: nothing uses this shared value"),
])  # fmt: skip
def test_probable_mistakes_are_warnings(shared: str, fact: str, tmp_path: Path) -> None:
    with pytest.warns(ConfigWarning, match=rf"own.yaml:2:\d+: {fact}"):
        load(tmp_path, "place: garage", shared)


def test_a_value_without_an_entry_names_the_entries() -> None:
    """``beside`` selects by the width of the verge, without a default."""
    text = refusal("street", "shared.verge=7", "shared.parking=parallel")
    assert "no entry for verge = 7; expected one, or 'default'; shared.verge may be 0.0, " in text
