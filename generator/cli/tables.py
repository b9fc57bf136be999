"""Tables of commands, printed."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

GAP = 3
"""Blanks between two columns, and around a table."""
TEXT_WIDTH = 40
"""Columns of the longest texts, which are wrapped."""
_UNLIMITED = 10_000


def print_tables(console: "Console", tables: Iterable[Mapping[str, Any]]) -> None:
    """Print tables, given by ``title``, ``header``, ``rows`` of texts, and ``note``.

    Long texts are wrapped between words. Columns that do not fit into the terminal follow in
    further tables, each with the first column again.
    """
    from rich import box
    from rich.table import Table
    from rich.text import Text

    for table in tables:
        columns = list(zip(table["header"], *table["rows"], strict=True))
        widths = [_width(column) for column in columns]
        groups = list(_groups(widths, console.width - GAP))
        for part, group in enumerate(groups):
            last = part == len(groups) - 1
            shown = Table(
                title=None if part else table["title"],
                caption=(table["note"] or None) if last else None,
                box=box.SIMPLE_HEAD,
            )
            for number in group:
                shown.add_column(
                    Text(table["header"][number]),
                    justify="right" if number and widths[number] < TEXT_WIDTH else "left",
                    overflow="fold",
                )
            for row in table["rows"]:
                # Names are text: brackets in them are not markup.
                shown.add_row(*(Text(row[number]) for number in group))
            _print_whole(console, shown)


def print_facts(console: "Console", title: str, facts: Iterable[tuple[str, str]]) -> None:
    """Print names and their values as a table; values are wrapped between words."""
    from rich.table import Table
    from rich.text import Text

    rows = [(Text(name), Text(value)) for name, value in facts]
    table = Table(title=Text(title), show_header=False)
    table.add_column(min_width=max(len(name) for name, _ in rows))
    table.add_column(overflow="fold")
    for row in rows:
        table.add_row(*row)
    _print_whole(console, table)


def _print_whole(console: "Console", table: "Table") -> None:
    """Print a table without cutting a word: files have lines as long as paths need."""
    if not console.is_terminal:
        needed = console.measure(table, options=console.options.update(width=_UNLIMITED)).minimum
        console.width = max(console.width, needed)
    console.print(table)


def _width(column: Sequence[str]) -> int:
    longest_word = max((len(word) for cell in column for word in cell.split()), default=1)
    return max(longest_word, min(max(map(len, column)), TEXT_WIDTH)) + GAP


def _groups(widths: Sequence[int], width: int) -> Iterator[list[int]]:
    """Numbers of the columns of each table: the first one, and columns that fit next to it."""
    group, used = [0], widths[0]
    for number, own in enumerate(widths[1:], 1):
        if used + own > width and len(group) > 1:
            yield group
            group, used = [0], widths[0]
        group.append(number)
        used += own
    yield group
