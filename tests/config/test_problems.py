"""Telling everything that is wrong in one message."""

import pytest

from gen_data.config.problems import Position, Problems, format_path
from gen_data.core.errors import ConfigError


def told(problems: Problems) -> str:
    with pytest.raises(ConfigError) as caught:
        problems.raise_if_any()
    return str(caught.value)


def test_no_problem_raises_nothing() -> None:
    problems = Problems()

    problems.raise_if_any()

    assert len(problems) == 0


def test_problems_are_told_in_the_order_of_the_source() -> None:
    """By file, line and column, whatever the order in which they were found."""
    problems = Problems()
    problems.add(Position("b.yaml", 1, 1), "x", "third")
    problems.add(Position("a.yaml", 10, 1), "y", "second")
    problems.add(Position("a.yaml", 9, 7), "z", "first")

    assert told(problems) == "a.yaml:9:7: z: first\na.yaml:10:1: y: second\nb.yaml:1:1: x: third"


def test_the_source_line_is_shown_with_a_caret() -> None:
    problems = Problems()
    problems.add(Position("a.yaml", 8, 5, "    fov: abc   "), "camera.fov", "expected a number")

    assert told(problems) == (
        "a.yaml:8:5: camera.fov: expected a number\n      8 |     fov: abc\n        |     ^"
    )


def test_a_long_line_is_shown_around_the_place() -> None:
    problems = Problems()
    problems.add(Position("a.yaml", 1, 501, "x" * 500 + "HERE" + "x" * 500), "a", "bad")

    line, caret = told(problems).split("\n")[1:]

    assert len(line) < 120
    assert line[caret.index("^") :].startswith("HERE")


def test_the_same_problem_is_told_once() -> None:
    """Two checks may find the same fault."""
    problems = Problems()
    problems.add(Position("a.yaml", 1, 1), "a", "bad")
    problems.add(Position("a.yaml", 1, 1), "a", "bad")

    assert told(problems) == "a.yaml:1:1: a: bad"


def test_of_very_many_problems_the_first_hundred_are_told() -> None:
    """A megabyte of nonsense does not become ten megabytes of messages."""
    problems = Problems()
    for line in range(1, 251):
        problems.add(Position("a.yaml", line, 1), "a", "bad")

    lines = told(problems).split("\n")

    assert lines[0] == "a.yaml:1:1: a: bad"
    assert lines[99:] == ["a.yaml:100:1: a: bad", "... and 150 more"]


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ((), ""),
        (("a", "b"), "a.b"),
        (("a", 0, 1, "b"), "a[0][1].b"),
        ((2, "x"), "[2].x"),
        (("a b", "c.d"), "['a b']['c.d']"),
    ],
)
def test_paths_are_dotted(path: tuple[str | int, ...], text: str) -> None:
    """Indices in brackets; keys that are no plain words in quotes."""
    assert format_path(path) == text
