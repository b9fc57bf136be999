"""``LICENSES-ASSETS.md``: a Markdown table of the assets in a data set, grouped by source."""

import html
import re
from collections.abc import Iterable

from gen_data.core import asset_types, markdown

_BAR = re.compile(r"(?<!\\)\|")
_HEADER = ("source", "licence", "author", "assets")


def licence_table(assets: Iterable[asset_types.Asset]) -> str:
    """Format the table; assets of one family are one entry."""
    groups: dict[tuple[str, str, str], list[str]] = {}
    for asset in assets:
        family = asset.asset_id.partition("?")[0]
        members = groups.setdefault((asset.source, asset.licence, asset.author), [])
        if family not in members:
            members.append(family)
    lines = ["# Assets of this data set", "", _row(*_HEADER), "|---" * len(_HEADER) + "|"]
    lines += [_row(*facts, ", ".join(members)) for facts, members in sorted(groups.items())]
    return "\n".join(lines) + "\n"


def licences_in(table: str) -> list[str]:
    """Names of the licences in a table of ``licence_table``, sorted; empty for other texts."""
    rows = [_BAR.split(line.strip("|")) for line in table.splitlines() if line.startswith("|")]
    cells = {row[1].strip() for row in rows[2:] if len(row) == len(_HEADER)}
    return sorted(html.unescape(cell.replace(r"\|", "|")) for cell in cells)


def _row(*cells: str) -> str:
    return f"| {' | '.join(map(markdown.plain, cells))} |"
