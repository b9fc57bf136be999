"""Edits of values in the text of a configuration."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Any

import pytest

from gen_data.config.yaml_tree import parse_yaml
from gen_data.core.errors import ConfigError
from gen_data.lab.edit.files import Folders, OpenedFile, read_file, restore_lines
from gen_data.lab.edit.text_edits import append_item, set_value
from tests.repository import ROOT

TEXT = """\
# a comment
seed: 7   # kept
randomizers:
  - {type: objects, name: clutter, count: {uniform_integer: [4, 12]}}
  - type: textures
    name: cover
    scale_m: {uniform: [0.05, 0.3]}   # metres

labels:
exporters: [{type: coco}]
"""


@pytest.mark.parametrize(
    ("path", "value", "removed", "added"),
    [
        (("seed",), 9, ["seed: 7   # kept"], ["seed: 9   # kept"]),
        (
            ("randomizers", "clutter", "count"),
            {"uniform_integer": [1, 3]},
            ["  - {type: objects, name: clutter, count: {uniform_integer: [4, 12]}}"],
            ["  - {type: objects, name: clutter, count: {uniform_integer: [1, 3]}}"],
        ),
        (
            ("randomizers", "clutter", "scale"),
            2,
            ["  - {type: objects, name: clutter, count: {uniform_integer: [4, 12]}}"],
            ["  - {type: objects, name: clutter, count: {uniform_integer: [4, 12]}, scale: 2}"],
        ),
        (("randomizers", "cover", "probability"), 0.5, [], ["    probability: 0.5"]),
        (("randomizers", "orbit", "fills"), 0.4, [], ["  - {name: orbit, fills: 0.4}"]),
        (("labels", "min_box_px"), 5, ["labels:"], ["labels: {min_box_px: 5}"]),
        (("elements", "arm", "present"), False, [], ["elements:", "  arm: {present: false}"]),
        (
            ("exporters", 0, "type"),
            "voc",
            ["exporters: [{type: coco}]"],
            ["exporters: [{type: voc}]"],
        ),
    ],
)
def test_one_value_changes_and_no_other_byte(
    path: tuple[str | int, ...], value: Any, removed: list[str], added: list[str]
) -> None:
    """Values, fields, items that override inherited ones, and sections are replaced or added."""
    changed = set_value(TEXT, path, value)
    lines = list(difflib.ndiff(TEXT.splitlines(True), changed.splitlines(True)))
    assert [line[2:].rstrip("\n") for line in lines if line[0] == "-"] == removed
    assert [line[2:].rstrip("\n") for line in lines if line[0] == "+"] == added
    # And it reads back, at its place.
    parse_yaml(changed, "x")
    assert set_value(changed, path, value) == changed


@pytest.mark.parametrize("name", ["tabletop.yaml", "street.yaml", "kitti_rig.yaml"])
def test_every_scalar_of_a_shipped_configuration_can_be_replaced(name: str) -> None:
    """The document then differs in that value only."""
    text = (ROOT / "configs" / name).read_text("utf-8")
    before = parse_yaml(text, "x").plain()

    def scalars(value: Any, path: tuple[str | int, ...]) -> Any:
        parts = value.items() if isinstance(value, dict) else enumerate(value)
        for key, part in parts:
            if isinstance(part, (dict, list)):
                yield from scalars(part, (*path, key))
            else:
                yield (*path, key)

    for path in list(scalars(before, ()))[::7]:
        try:
            after = parse_yaml(set_value(text, path, "new value"), "x").plain()
        except ConfigError:
            assert "&" in text  # Of an alias or an anchor.
            continue
        place = after
        for part in path[:-1]:
            place = place[part]
        assert place[path[-1]] == "new value"
        old = before
        for part in path:
            old = old[part]
        place[path[-1]] = old
        assert after == before


def test_an_alias_is_edited_by_hand() -> None:
    """Its value stands elsewhere, where a change would change more; so does an anchor's."""
    for text, path in (
        ("a: &x [1, 2]\nb: *x\n", ("b", 0)),
        ("a: &x [1, 2]\nb: *x\n", ("a",)),
        ("a: {b: &x 1, c: *x}\n", ("a", "c")),
        ("a: [&x 1, *x]\n", ("a", 1)),
    ):
        with pytest.raises(ConfigError, match="has no separate place in the file"):
            set_value(text, path, 3)


def test_an_item_goes_behind_the_last_one() -> None:
    """In the style of the list."""
    assert append_item("a: [x]\nb: 1\n", "a", {"k": 1}) == "a: [x, {k: 1}]\nb: 1\n"
    assert append_item("a:\n- x # y\nb: 1\n", "a", 2) == "a:\n- x # y\n- 2\nb: 1\n"
    assert append_item("", "a", 2) == "a:\n  - 2\n"


@pytest.mark.parametrize(
    ("original", "edited", "expected"),
    [
        ("a\r\nb\nc\r\n", "a\nX\nb\nc\n", "a\r\nX\r\nb\nc\r\n"),
        ("\ufeffa\r\nb", "a\nb", "\ufeffa\r\nb"),
        ("a\rb\r", "a\nb\nc\n", "a\rb\rc\r"),
        ("a\n\n\n", "a\n\n\n", "a\n\n\n"),
        ("", "x", "x"),
    ],
)
def test_lines_that_were_not_edited_keep_their_ends(
    original: str, edited: str, expected: str
) -> None:
    """An editor has LF only."""
    assert restore_lines(original, edited) == expected
    assert restore_lines(original, OpenedFile(Path(), original).text) == original


def test_a_file_that_changed_meanwhile_is_not_overwritten(tmp_path: Path) -> None:
    """Two tabs: the second to save is told; bytes stay until it decides."""
    path = tmp_path / "a.yaml"
    path.write_bytes(b"seed: 1\r\n")
    first, second = read_file(path), read_file(path)
    first.save("seed: 2\n")
    with pytest.raises(Exception, match="has changed since it was read"):
        second.save("seed: 3\n")
    assert path.read_bytes() == b"seed: 2\r\n"
    second.save("seed: 3\n", overwrite=True)
    assert path.read_bytes() == b"seed: 3\r\n"


def test_a_text_cannot_name_files_outside_of_the_folders(tmp_path: Path) -> None:
    """Except for files that the user's file named when it was opened; links are followed."""
    inside, outside = tmp_path / "in", tmp_path / "out"
    inside.mkdir()
    outside.mkdir()
    (inside / "link").symlink_to(outside)
    folders = Folders((inside,))
    file = inside / "a.yaml"
    for named in ("../out", str(outside), "./link", ".."):
        with pytest.raises(ConfigError, match=r"a\.yaml:1:20: .* is outside of the folders"):
            folders.refuse_outside(f"assets: {{folders: ['{named}']}}\n", str(file))
    allowed = folders.with_references("assets: {folders: [../out]}\n", file)
    allowed.refuse_outside("assets: {folders: [../out]}\n", str(file))
