"""Tables on terminals: 80 columns, whole words."""

import io
import re
from typing import Any

import click
import pytest
from click.testing import CliRunner
from rich.console import Console

from gen_data.cli.main import cli
from gen_data.cli.tables import print_facts, print_tables


def printed(table: dict[str, Any], columns: int = 80, terminal: bool = True) -> str:
    file = io.StringIO()
    console = Console(file=file, width=columns, force_terminal=terminal, color_system=None)
    print_tables(console, [{"title": "t", "note": "", **table}])
    return re.sub(r"\x1b\[[0-9;]*m", "", file.getvalue())


HEADER = ["category", "visible", "occluded", "truncated", "visibility", "distance [m]", "area [px]",
          "aspect", "difficult", "moderate"]  # fmt: skip
ROWS = [[f"name_{k}", *[f"{k}.{c:02d}" for c in range(9)]] for k in range(3)]


@pytest.mark.parametrize("columns", [80, 120, 200])
def test_no_word_of_a_wide_table_is_cut(columns: int) -> None:
    """Its columns continue below, next to the first one again."""
    text = printed({"header": HEADER, "rows": ROWS}, columns)
    assert max(map(len, text.splitlines())) <= columns
    assert "…" not in text
    words = set(text.split())
    for word in (*" ".join(HEADER).split(), *(cell for row in ROWS for cell in row)):
        assert word in words
    if columns == 200:
        assert text.count("name_0") == 1
    if columns == 80:
        assert text.count("name_0") == 2


def test_long_remarks_are_wrapped_between_words() -> None:
    """In a separate column, wide enough to be read."""
    remark = "narrower with more --scenes; the interval of a recording of 20 pictures is this only"
    header = ["quantity", "value", "from", "to", "unit", "remark"]
    rows = [["exposure compensation", "1.375", "0.58", "1.02", "EV", remark]]
    text = printed({"header": header, "rows": rows})
    assert max(map(len, text.splitlines())) <= 80
    assert "…" not in text
    assert set(remark.split()) <= set(text.split())
    assert len(text.splitlines()) < 16


def test_a_word_longer_than_the_terminal_is_folded() -> None:
    """Nothing is lost: paths can be copied in pieces."""
    path = "/very/long" * 12
    text = printed({"header": ["file", "n"], "rows": [[path, "1"]]})
    assert max(map(len, text.splitlines())) == 80
    assert path in "".join(line.strip().split(" ")[0] for line in text.splitlines())
    assert "…" not in text


def test_a_path_in_a_file_is_whole() -> None:
    """Lines of logs are as long as paths, and no longer."""
    path = "/very/long" * 12
    text = printed({"header": ["file", "n"], "rows": [[path, "1"]]}, terminal=False)
    assert path in text
    assert max(map(len, text.splitlines())) == len(f"  {path}   1  ")

    file = io.StringIO()
    facts = [("not used", f"{path}: {'joints without a position ' * 9}"), ("scenes", "4 scenes")]
    print_facts(Console(file=file), "plan", facts)
    lines = file.getvalue().splitlines()
    assert path in file.getvalue()
    assert "…" not in file.getvalue()
    assert max(map(len, lines)) == len(f"│ not used │ {path}: │")


def helps(group: click.Group, names: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    context = click.Context(group)
    found = []
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        found.append((*names, name, "--help"))
        if isinstance(command, click.Group):
            found += helps(command, (*names, name))
    return found


@pytest.mark.parametrize("arguments", [
    *helps(cli), ("--help",), ("assets", "list"), ("formats",),
    ("plan", "tabletop.yaml", "--n", "20"),
    pytest.param(("plan", "kitti_rig.yaml", "--n", "20"), marks=pytest.mark.slow),
], ids=" ".join)  # fmt: skip
def test_help_fits_a_terminal(arguments: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """Examples of commands, which nobody wraps, too."""
    monkeypatch.setenv("COLUMNS", "80")
    done = CliRunner().invoke(cli, arguments)
    assert done.exit_code == 0
    assert [
        line
        for line in done.output.splitlines()
        if len(line) > 80 and not line.startswith("folder: ")
    ] == []
