"""The configuration that a fit writes: it extends the source by the fitted values."""

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from gen_data.lab.matching.results import FittedField, FittedQuantity, Match

WIDTH = 1 << 16
"""Of a line: values stay on their lines."""


def format_config(match: Match, out: Path) -> str:
    """Format the configuration with its fitted values, each under a comment with its interval.

    Args:
        match: The fit.
        out: Its file, from whose folder ``extends`` starts.
    """
    lines = [
        f"# Fitted to {_one_line(match.folder.name)} by gen-data match;"
        f" {match.scenes} simulated scenes. Intervals: 95 %.",
        f"extends: {_flow(_base(match.source, out))}",
    ]
    sections: dict[str, dict[int, list[FittedField]]] = {}
    for field in match.fields:
        change = field.change
        sections.setdefault(change.section, {}).setdefault(change.number, []).append(field)
    for section, plugins in sections.items():
        lines += ["", f"{section}:"]
        for number, fields in sorted(plugins.items()):
            lines += _plugin(match.resolved[section][number], fields)
    return "\n".join(lines) + "\n"


def _base(source: str, out: Path) -> str:
    """The value of ``extends``: a file relative to the new one, or a shipped name."""
    if not Path(source).expanduser().is_file():
        return source
    target = Path(source).expanduser().resolve()
    try:
        return Path(os.path.relpath(target, out.resolve().parent)).as_posix()
    except ValueError:
        # Another drive of Windows.
        return target.as_posix()


def _plugin(item: Mapping[str, Any], fields: Sequence[FittedField]) -> Iterator[str]:
    """Lines of one plug-in of a list, which merges by its name, or else its type."""
    key = "name" if "name" in item else "type"
    yield f"  - {key}: {_flow(item[key])}"
    open_path: tuple[str, ...] = ()
    stated: set[str] = set()
    for field in fields:
        *parents, name = field.change.field.split(".")
        for depth, parent in enumerate(parents):
            if open_path[: depth + 1] != tuple(parents[: depth + 1]):
                yield f"{_indent(depth)}{parent}:"
        open_path = tuple(parents)
        for quantity in field.quantities:
            if quantity.name in stated:
                continue
            stated.add(quantity.name)
            yield f"{_indent(len(parents))}# {_comment(quantity)}"
        yield f"{_indent(len(parents))}{name}: {_flow(field.change.value)}"


def _indent(depth: int) -> str:
    return "    " + "  " * depth


def _comment(row: FittedQuantity) -> str:
    if row.mean is None:
        return f"{row.name}: {row.note}; n = {row.n}"
    interval = "" if row.low is None else f" ({row.low:.4g} to {row.high:.4g})"
    spread = f", spread {row.spread:.2g}" if row.spread else ""
    return f"{row.name}: {row.mean:.4g} {row.unit}{interval}{spread}, n = {row.n}"


def _flow(value: Any) -> str:
    text = yaml.safe_dump(_whole(value), default_flow_style=True, width=WIDTH, allow_unicode=True)
    return text.removesuffix("\n").removesuffix("...").rstrip("\n")


def _whole(value: Any) -> Any:
    """The value with whole numbers as such: 2610 instead of 2610.0, and 92 as a key, not '92'."""
    if isinstance(value, Mapping):
        return {int(k) if k.isdigit() else k: _whole(item) for k, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_whole(item) for item in value]
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _one_line(text: str) -> str:
    """A name that cannot leave its comment."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)
