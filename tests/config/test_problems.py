"""Telling everything that is wrong in one message."""

import pytest

from gen_data.config.problems import Position, Problems, format_path
from gen_data.core.errors import ConfigError


def told(problems: Problems) -> str:
    with pytest.raises(ConfigError) as caught:
        problems.raise_if_any()
    return str(caught.value)


BAD = (Position("a.yaml", 1, 1), "a", "bad")
TOLD = [f"a.yaml:{line}:1: a: bad" for line in range(1, 101)]


@pytest.mark.parametrize(
    ("found", "message"),
    [([(Position("b.yaml", 1, 1), "x", "third"), (Position("a.yaml", 10, 1), "y", "second"),
       (Position("a.yaml", 9, 7), "z", "first")],
      "a.yaml:9:7: z: first\na.yaml:10:1: y: second\nb.yaml:1:1: x: third"),
     ([(Position("a.yaml", 8, 5, "    fov: abc   "), "camera.fov", "expected a number")],
      "a.yaml:8:5: camera.fov: expected a number\n      8 |     fov: abc\n        |     ^"),
     ([BAD, BAD], "a.yaml:1:1: a: bad"),
     ([(Position("a.yaml", line, 1), "a", "bad") for line in range(1, 251)],
      "\n".join([*TOLD, "... and 150 more"]))],
    ids=["in the order of the source", "the source line with a caret", "the same problem once",
         "of very many, the first hundred"],
)  # fmt: skip
def test_problems_are_told(found: list[tuple[Position, str, str]], message: str) -> None:
    """By file, line and column, in whatever order they were found; no problem raises nothing."""
    problems = Problems()
    problems.raise_if_any()
    assert len(problems) == 0
    for problem in found:
        problems.add(*problem)
    assert told(problems) == message


def test_a_long_line_is_shown_around_the_place() -> None:
    problems = Problems()
    problems.add(Position("a.yaml", 1, 501, "x" * 500 + "HERE" + "x" * 500), "a", "bad")
    line, caret = told(problems).split("\n")[1:]
    assert len(line) < 120
    assert line[caret.index("^") :].startswith("HERE")


@pytest.mark.parametrize(
    ("path", "text"),
    [((), ""), (("a", "b"), "a.b"), (("a", 0, 1, "b"), "a[0][1].b"), ((2, "x"), "[2].x"),
     (("a b", "c.d"), "['a b']['c.d']")],
)  # fmt: skip
def test_paths_are_dotted(path: tuple[str | int, ...], text: str) -> None:
    """Indices in brackets; keys that are not plain words in quotes."""
    assert format_path(path) == text
