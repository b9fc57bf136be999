"""A report as one self-contained HTML file, without external scripts, fonts or images."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from pathlib import Path

from gen_data.generator.report.report_tables import Histogram, Table

BARS_PX = (300, 90)
"""Width and height of one histogram's bars."""

STYLE = "\n" + Path(__file__).with_suffix(".css").read_text(encoding="utf-8")


def format_page(title: str, tables: Iterable[Table], histograms: Iterable[Histogram]) -> str:
    """Format the HTML document."""
    body = [
        f"<h1>{escape(title)}</h1>",
        *map(_format_table, tables),
        *map(_format_plots, histograms),
    ]
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f"<title>{escape(title)}</title><style>{STYLE}</style></head>\n<body>\n"
        + "\n".join(body)
        + "\n</body></html>\n"
    )


def _format_table(table: Table) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in table.header)
    rows = "\n".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in table.rows
    )
    note = f'\n<p class="note">{escape(table.note)}</p>' if table.note else ""
    return f"<h2>{escape(table.title)}</h2>\n<table><tr>{head}</tr>\n{rows}</table>{note}"


def _format_plots(histogram: Histogram) -> str:
    figures = "\n".join(
        f"<figure>{format_bars(histogram, name)}<figcaption>{escape(name)}</figcaption></figure>"
        for name, counts in histogram.counts.items()
        if counts.any()
    )
    return f'<h2>{escape(histogram.title)}</h2>\n<div class="plots">{figures}</div>'


def format_bars(histogram: Histogram, name: str) -> str:
    """Format one histogram as inline SVG: bars of equal width, labelled with their lower edges."""
    counts = histogram.counts[name]
    width_px, height_px = BARS_PX
    step_px = width_px / len(counts)
    every = -(-len(counts) // 10)
    shapes = []
    for k, count in enumerate(counts.tolist()):
        tall_px = height_px * count / max(int(counts.max()), 1)
        low, high = histogram.edges[k], histogram.edges[k + 1]
        shapes.append(
            f'<rect x="{k * step_px:.1f}" y="{height_px - tall_px:.1f}" '
            f'width="{0.9 * step_px:.1f}" height="{tall_px:.1f}">'
            f"<title>{low:g} to {high:g}: {count}</title></rect>"
        )
        if k % every == 0:
            shapes.append(f'<text x="{k * step_px:.1f}" y="{height_px + 11}">{low:g}</text>')
    return (
        f'<svg width="{width_px}" height="{height_px + 14}" role="img" '
        f'aria-label="{escape(histogram.title)}: {escape(name)}">{"".join(shapes)}</svg>'
    )
