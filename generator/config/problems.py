"""Everything that is wrong with a configuration, told in one go."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from gen_data.generator.core.errors import ConfigError

FieldPath = tuple[str | int, ...]
"""Keys and indices from the root of a document: ``("randomizers", 0, "count")``."""

_PLAIN_KEY = re.compile(r"[\w/-]{1,60}")
_LINE_LENGTH = 100
_TOLD_MAX = 100


@dataclass(frozen=True, slots=True, order=True)
class Position:
    """A place in a source text.

    Attributes:
        file: As the user named it; ``--set`` for an override on the command line.
        line, column: From 1; the column counts characters.
        source: The text of the whole line, to be shown under the message.
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
    """One thing that is wrong.

    Attributes:
        field: Dotted path of the field; empty where none is known, as in a syntax error.
        fact: What is wrong; what was expected.
    """

    position: Position
    field: str
    fact: str

    def __str__(self) -> str:
        """``file:line:column: field: fact``, and the source line with a caret."""
        place = f"{self.position}: {self.field}" if self.field else str(self.position)
        return f"{place}: {self.fact}{_quoted(self.position)}"


class Problems:
    """Collects problems, so that a user can mend all of them at once."""

    def __init__(self) -> None:
        self._problems: dict[Problem, None] = {}

    def add(self, position: Position, field: str, fact: str) -> None:
        """Note a problem; one that is known already is not repeated."""
        self._problems[Problem(position, field, fact)] = None

    def extend(self, others: Problems) -> None:
        """Note everything that others hold."""
        for problem in others.sorted():
            self.add(problem.position, problem.field, problem.fact)

    def __len__(self) -> int:
        """How many there are."""
        return len(self._problems)

    def sorted(self) -> tuple[Problem, ...]:
        """All problems in the order of the source; equal places in the order they were found."""
        return tuple(sorted(self._problems, key=lambda problem: problem.position))

    def raise_if_any(self) -> None:
        """Raise one ConfigError that tells all of them; of very many, the first and how many."""
        if not self._problems:
            return
        told = [str(problem) for problem in self.sorted()[:_TOLD_MAX]]
        if len(self) > _TOLD_MAX:
            told.append(f"... and {len(self) - _TOLD_MAX} more")
        raise ConfigError("\n".join(told))


def format_path(path: FieldPath) -> str:
    """``randomizers[0].count``; a key that is no plain word is quoted."""
    text = ""
    for part in path:
        if isinstance(part, int):
            text += f"[{part}]"
        elif _PLAIN_KEY.fullmatch(part):
            text += f".{part}" if text else part
        else:
            text += f"[{_cut(part, 60)!r}]"
    return text


def _quoted(position: Position) -> str:
    if not position.source.strip():
        return ""
    column, line = position.column - 1, position.source.rstrip()
    # A window into very long lines, such that the place stays in sight.
    start = 0 if len(line) <= _LINE_LENGTH else max(0, column - _LINE_LENGTH // 2)
    window = line[start : start + _LINE_LENGTH]
    return f"\n{position.line:>7} | {window}\n{'':>7} | {' ' * (column - start)}^"


def _cut(text: str, length: int) -> str:
    return text if len(text) <= length else text[: length - 3] + "..."
