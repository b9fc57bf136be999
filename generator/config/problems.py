"""Errors of a configuration with their positions, collected and reported together."""

import re
from dataclasses import dataclass, field
from typing import NoReturn

from gen_data.core.errors import ConfigError

FieldPath = tuple[str | int, ...]
"""Keys and indices from the root of a document: ``("randomizers", 0, "count")``."""

_PLAIN_KEY = re.compile(r"[\w/-]{1,60}")
_LINE_LENGTH = 100
_REPORTED_MAX = 100


@dataclass(frozen=True, slots=True, order=True)
class Position:
    """A place in a source text.

    Attributes:
        file: As the user named it; ``--set`` for an override on the command line.
        line, column: From 1; the column counts characters.
        source: Text of the whole line, quoted below the message.
    """

    file: str
    line: int
    column: int
    source: str = field(default="", compare=False, repr=False)

    def __str__(self) -> str:
        """``file:line:column``."""
        return f"{self.file}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True)
class Problem:
    """One error in a document.

    Attributes:
        field: Dotted path of the field; empty if unknown, as in a syntax error.
        fact: The error and the expectation.
    """

    position: Position
    field: str
    fact: str

    def __str__(self) -> str:
        """``file:line:column: field: fact``, and the source line with a caret."""
        place = f"{self.position}: {self.field}" if self.field else str(self.position)
        return f"{place}: {self.fact}{_quote_source(self.position)}"


def refuse(position: Position, field: str | FieldPath, fact: str) -> NoReturn:
    """Raise a ConfigError for one problem."""
    path = field if isinstance(field, str) else format_path(field)
    raise ConfigError(str(Problem(position, path, fact)))


class Problems:
    """Collected problems: a user can correct all of them at once."""

    def __init__(self) -> None:
        self._problems: dict[Problem, None] = {}

    def add(self, position: Position, field: str | FieldPath, fact: str) -> None:
        """Add a problem, unless it is a duplicate; a ``field`` with keys of the user is a path."""
        path = field if isinstance(field, str) else format_path(field)
        self._problems[Problem(position, path, fact)] = None

    def extend(self, others: "Problems") -> None:
        """Add all problems of another collection."""
        for problem in others.sorted():
            self.add(problem.position, problem.field, problem.fact)

    def __len__(self) -> int:
        """Number of problems."""
        return len(self._problems)

    def sorted(self) -> tuple[Problem, ...]:
        """All problems in the order of the source; at equal positions, as they were found."""
        return tuple(sorted(self._problems, key=lambda problem: problem.position))

    def raise_if_any(self) -> None:
        """Raise one ConfigError for all problems; if there are very many, for the first ones."""
        if not self._problems:
            return
        texts = [str(problem) for problem in self.sorted()[:_REPORTED_MAX]]
        if len(self) > _REPORTED_MAX:
            texts.append(f"... and {len(self) - _REPORTED_MAX} more")
        raise ConfigError("\n".join(texts))


def format_path(path: FieldPath) -> str:
    """``randomizers[0].count``; unusual keys are quoted."""
    text = ""
    for part in path:
        if isinstance(part, int):
            text += f"[{part}]"
        elif _PLAIN_KEY.fullmatch(part):
            text += f".{part}" if text else part
        else:
            text += f"[{_truncate(part, 60)!r}]"
    return text


def _quote_source(position: Position) -> str:
    if not position.source.strip():
        return ""
    column, line = position.column - 1, position.source.rstrip()
    # Of a very long line, a window around the column.
    start = 0 if len(line) <= _LINE_LENGTH else max(0, column - _LINE_LENGTH // 2)
    window = line[start : start + _LINE_LENGTH]
    return f"\n{position.line:>7} | {window}\n{'':>7} | {' ' * (column - start)}^"


def _truncate(text: str, length: int) -> str:
    return text if len(text) <= length else text[: length - 3] + "..."
