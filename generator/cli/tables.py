"""Tables of commands, printed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console


def print_tables(console: Console, tables: Iterable[Mapping[str, Any]]) -> None:
    """Print tables, given by ``title``, ``header``, ``rows`` of texts, and ``note``."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    for table in tables:
        shown = Table(title=table["title"], caption=table["note"] or None, box=box.SIMPLE_HEAD)
        for number, name in enumerate(table["header"]):
            shown.add_column(name, justify="right" if number else "left")
        for row in table["rows"]:
            # Names are text: brackets in them are no markup.
            shown.add_row(*map(Text, row))
        console.print(shown)
