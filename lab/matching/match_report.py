"""Report of a fit: tables for the terminal, figures for programs, and a page."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from gen_data.core.se3 import Array
from gen_data.lab.matching.inventory_table import inventory_rows
from gen_data.lab.matching.results import ComparedStatistic, FittedQuantity, Match
from gen_data.report.html_page import format_page
from gen_data.report.report_tables import NOTHING, Histogram, Table, count_values

QUANTILES = (0.1, 0.5, 0.9)
BINS = 16


def make_tables(match: Match) -> tuple[Table, ...]:
    """Tables of files, fitted quantities and statistics."""
    return (_files(match), _quantities(match.quantities), _statistics(match.statistics))


def _files(match: Match) -> Table:
    header = ("files", "found", "read", "skipped", "remark")
    note = " ".join(f"{remark[0].upper()}{remark[1:]}." for remark in match.remarks)
    return Table("Files", header, inventory_rows(match.inventory), note)


def _quantities(rows: Sequence[FittedQuantity]) -> Table:
    header = ("quantity", "before", "fitted", "95 %", "spread", "unit", "n", "enough", "remark")
    note = (
        "Spread: standard deviation between recordings, beyond the scenes' deviation. Enough:"
        " number of recordings for an interval that is narrow enough for most uses."
    )
    return Table("Fit", header, tuple(map(_quantity, rows)), note)


def _quantity(row: FittedQuantity) -> tuple[str, ...]:
    fitted = _number(row.mean)
    if not row.is_fitted:
        fitted = "not fitted"
    elif row.mean is None:
        fitted = "none"
    interval = NOTHING
    if row.is_fitted and row.low is not None:
        interval = f"{_number(row.low)} to {_number(row.high)}"
    enough = NOTHING if row.n_enough is None or not row.is_fitted else str(row.n_enough)
    spread = _number(row.spread) if row.is_fitted else NOTHING
    shown = (_number(row.before), fitted, interval, spread, row.unit)
    return (row.name, *shown, str(row.n), enough, row.note)


def _statistics(rows: Sequence[ComparedStatistic]) -> Table:
    header = ("statistic", "real", "before", "after", "apart before", "apart after")
    note = (
        "10 %, 50 % and 90 % of the recordings. Apart: largest difference of the cumulative"
        " distributions from the real one (Kolmogorov and Smirnov), 0 to 1."
    )
    body = tuple(
        (
            row.name,
            *(_quantiles(values) for values in (row.real, row.before, row.after)),
            *(_number(distance(row.real, other)) for other in (row.before, row.after)),
        )
        for row in rows
    )
    return Table("Statistics", header, body, note)


def distance(one: Array, other: Array) -> float | None:
    """Statistic of Kolmogorov and Smirnov, 0 to 1; None without values."""
    a, b = (np.sort(values[np.isfinite(values)]) for values in (one, other))
    if not len(a) or not len(b):
        return None
    at = np.concatenate([a, b])
    shares = (np.searchsorted(values, at, side="right") / len(values) for values in (a, b))
    return float(np.abs(np.subtract(*shares)).max())


def _quantiles(values: Array) -> str:
    known = values[np.isfinite(values)]
    if not len(known):
        return NOTHING
    return " / ".join(f"{value:.3g}" for value in np.quantile(known, QUANTILES))


def _number(value: float | None) -> str:
    return NOTHING if value is None else f"{value:.4g}"


def make_figures(match: Match) -> dict[str, Any]:
    """The report as plain JSON values; null = unknown."""
    return {
        "folder": str(match.folder),
        "config": match.source,
        "scenes": match.scenes,
        "files": [
            dict(zip(("kind", "found", "read", "skipped", "remark"), row, strict=True))
            for row in inventory_rows(match.inventory)
        ],
        "remarks": list(match.remarks),
        "quantities": [asdict(row) for row in match.quantities],
        "statistics": [
            {
                "name": row.name,
                **{
                    name: [None if math.isnan(v) else float(v) for v in getattr(row, name)]
                    for name in ("real", "before", "after")
                },
                "apart_before": distance(row.real, row.before),
                "apart_after": distance(row.real, row.after),
            }
            for row in match.statistics
        ],
    }


def format_match_page(match: Match, config_name: str) -> str:
    """HTML page with the tables, and charts of every statistic before and after the fit."""
    tables = [asdict(table) for table in make_tables(match)]
    known = [row for row in match.statistics if np.isfinite(row.real).any()]
    real = _page_set(f"real: {match.folder.name}", tables, known, ("real", "real"))
    ours = _page_set(f"simulated: {config_name}", [], known, ("before", "after"))
    return format_page([real, ours])


def _page_set(
    name: str,
    tables: list[dict[str, Any]],
    statistics: Iterable[ComparedStatistic],
    values: tuple[str, str],
) -> dict[str, Any]:
    """One side of the page: a data set as in ``report_data``, with the parts that it needs."""
    rows = list(statistics)
    images = max((int(np.isfinite(getattr(row, values[0])).sum()) for row in rows), default=0)
    histograms = [
        _histogram(f"{row.name}: {when}", row, getattr(row, attribute))
        for row in rows
        for when, attribute in zip(("before", "after"), values, strict=True)
    ]
    return {
        "name": name,
        "counts": {"images": images, "objects": 0},
        "splits": {},
        "tables": tables,
        "histograms": [
            {
                "title": made.title,
                "edges": made.edges.tolist(),
                "counts": {key: counts.tolist() for key, counts in made.counts.items()},
            }
            for made in histograms
        ],
    }


def _histogram(title: str, row: ComparedStatistic, values: Array) -> Histogram:
    """Counts in bins that all three groups share."""
    every = np.concatenate([row.real, row.before, row.after])
    low, high = np.quantile(every[np.isfinite(every)], [0.01, 0.99])
    edges = np.linspace(low, max(high, low + 1e-6), BINS + 1)
    return count_values(title, edges, {"images": values})
