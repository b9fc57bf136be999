"""``gen-data report SOURCE --compare-real FOLDER``: tables for the terminal, and a page."""

import json
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, replace
from html import escape
from itertools import pairwise
from pathlib import Path

from gen_data.core.errors import StorageError
from gen_data.core.whole_files import check_place, write_whole
from gen_data.lab.carry_over.compare_real import CarryOver, compare_real, make_figures
from gen_data.lab.carry_over.differences import VALUES_MIN, Row
from gen_data.lab.carry_over.statistics import DARK_GREY, HEIGHTS_PX, OF_PICTURES
from gen_data.report.html_page import format_document, format_table
from gen_data.report.report_tables import Table

FIELDS, ALIKE = "Fields to change", "Without a difference"
"""Titles of the table that the terminal has as lines, and of the one that only the page has."""
ROWS_MAX = 16
"""Rows of each table on the terminal."""
_NOTE = (
    "Quantiles of 10, 50 and 90 %. Apart: Wasserstein distance in standard deviations of the real"
    ' values; up to "chance", chance explains it. Sizes, distances and points by ratios; dark:'
    f" grey below {DARK_GREY:g} of 255."
)
_FIELDS_NOTE = (
    "The fields that set most of a statistic, the most direct first. gen-data match fits exposure,"
    " distance and pitch to the same folder."
)


def report_real(
    source: Path, folder: Path, classes: Sequence[str], pictures: int, n: int, page: Path | None
) -> None:
    """Compare with real pictures, print tables, and write the page and a file with its figures.

    Raises:
        GenDataError: see ``compare_real``; StorageError if the page cannot be written.
    """
    import click
    from rich.console import Console

    from gen_data.cli.tables import print_tables

    if page is not None:
        check_place(page, "--html")
    with Console(stderr=True).status("") as status:
        found = compare_real(
            str(source), folder, classes=classes, pictures=pictures, n=n, progress=status.update
        )
    if page is not None:
        figures = json.dumps(make_figures(found), ensure_ascii=False, indent=1) + "\n"
        files = {page: format_page(found), page.with_suffix(".json"): figures}
        try:
            write_whole({path: text.encode() for path, text in files.items()})
        except OSError as error:
            fact = f"{page}: {error.strerror}; choose another place with --html"
            raise StorageError(fact) from error
    shown = (_shortened(table) for table in make_tables(found) if table.title != ALIKE)
    print_tables(Console(), map(asdict, shown))
    if page is not None:
        click.echo(f"wrote {page}")


def _shortened(table: Table) -> Table:
    """The table with the rows that the terminal shows; paths of fields stay whole on its lines."""
    rows = table.rows[:ROWS_MAX]
    if len(table.rows) > ROWS_MAX:
        more = (f"and {len(table.rows) - ROWS_MAX} more", *[""] * (len(table.header) - 1))
        rows = (*rows, more)
    if table.title != FIELDS:
        return replace(table, rows=rows)
    lines = (
        (line,)
        for name, direction, change in rows
        for line in (
            f"{name}, ours are {direction}" if direction else name,
            *(f"  {one}" for one in change.split("; ") if one),
        )
    )
    return Table(FIELDS, ("statistic and fields",), tuple(lines), table.note)


def make_tables(found: CarryOver) -> tuple[Table, ...]:
    """Tables of differences, fields, boxes by height, other rows, and files."""
    differing = [row for row in found.rows if row.differs]
    changes: dict[tuple[str, str], list[str]] = {}
    for row, change in zip(differing, found.remedies, strict=True):
        changes.setdefault((row.direction, "; ".join(change)), []).append(_name(row))
    fields = tuple((", ".join(names), *key) for key, names in changes.items())
    tables = (
        _rows("Differences", differing or [_no_difference(found)], _NOTE),
        Table(FIELDS, ("statistic", "ours are", "fields"), fields, _FIELDS_NOTE),
        _heights(found),
        _rows(ALIKE, [row for row in found.rows if not row.differs], ""),
        _files(found),
    )
    return tuple(table for table in tables if table.rows)


def _no_difference(found: CarryOver) -> str:
    """Why no row differs."""
    if not found.rows:
        return f"nothing was compared: every statistic has fewer than {VALUES_MIN} values"
    if {row.quantity for row in found.rows} <= OF_PICTURES.keys():
        return "none of whole pictures; no object was compared"
    return "none"


def _rows(title: str, rows: Sequence[Row | str], note: str) -> Table:
    header = ("statistic", "real", "ours", "apart", "chance")
    return Table(title, header, tuple(map(_cells, rows)), note)


def _cells(row: Row | str) -> tuple[str, ...]:
    if isinstance(row, str):
        return (row, *[""] * 4)
    shown = (_quantiles(row.real), _quantiles(row.ours), f"{row.apart:.2f}", f"{row.chance:.2f}")
    return (_name(row), *shown)


def _name(row: Row) -> str:
    return f"{row.label}: {row.quantity}"


def _quantiles(values: Sequence[float]) -> str:
    texts = (f"{value:.2f}" if abs(value) < 9.995 else f"{value:.0f}" for value in values)
    return "/".join(re.sub(r"^(-?)0\.", r"\1.", text) for text in texts)


def _heights(found: CarryOver) -> Table:
    header = (
        "class",
        *(f"{low:g}-{high:g}".removesuffix("-inf") for low, high in pairwise(HEIGHTS_PX)),
    )
    rows = tuple(
        (f"{label}, {side}", *(f"{count:.2f}" for count in counts))
        for label, both in found.heights.items()
        for side, counts in zip(("real", "ours"), both, strict=True)
    )
    return Table("Boxes a picture by height of the box [px]", header, rows)


def _files(found: CarryOver) -> Table:
    sides = (found.real, found.ours)
    rows = [("pictures", *(str(len(side.pictures)) for side in sides))]
    for reason in dict.fromkeys((*found.real.skipped, *found.ours.skipped)):
        rows.append((f"remark: {reason}", *(str(side.skipped.get(reason, 0)) for side in sides)))
    ignored = [sum(o.is_ignored for p in side.pictures for o in p.objects) for side in sides]
    rows.append(("ignored regions", *map(str, ignored)))
    for fact, listed in (
        (f"statistics of fewer than {VALUES_MIN} values", found.few),
        ("stated by the labels of one side", found.one_sided),
    ):
        rows += [(f"{fact}: {', '.join(listed)}", "", "")] if listed else []
    boxes = Counter(found.unmatched[0]) + Counter(found.unmatched[1])
    for name, _ in boxes.most_common():
        counts = (str(of.get(name, 0)) for of in found.unmatched)
        rows.append((f"not compared: class {name}", *counts))
    note = f"Real: {found.folder}, read as {found.real.layout}. Ours: {found.source}."
    return Table("Read", ("files", "real", "ours"), tuple(rows), note)


def format_page(found: CarryOver) -> str:
    """HTML page with all tables; it requests nothing."""
    title = f"Will it carry over? {Path(found.source).stem} and {found.folder.name}"
    tables = "".join(
        format_table(one.title, one.header, one.rows, one.note) for one in make_tables(found)
    )
    return format_document(title, f"<main><h1>{escape(title)}</h1>{tables}</main>")
