"""A study as one HTML page without scripts, which requests nothing."""

import base64
from collections.abc import Mapping, Sequence
from html import escape

import cv2

from gen_data.lab.study import failures, findings
from gen_data.lab.study.evaluation import Evaluation
from gen_data.report.html_page import format_document, format_table

PICTURES_MAX = 12
"""Pictures of faults per variant."""

LAST = (findings.BY_CLASS,)
"""Titles of the tables that are below the pictures, as they may be long."""

_LEGEND = (
    '<p class="legend"><span><i class="key found"></i>found</span>'
    '<span><i class="key missed"></i>missed</span>'
    '<span><i class="key alarm"></i>false alarm, by the first seed</span></p>'
)


def format_page(
    title: str, tables: Sequence[findings.Table], runs: Mapping[str, Sequence[Evaluation]]
) -> str:
    """Format the HTML document: tables, and the pictures of each variant with most faults."""
    first, last = (
        "".join(format_table(**table) for table in tables if (table["title"] in LAST) == is_last)
        for is_last in (False, True)
    )
    pictures = "".join(_pictures(name, evaluations) for name, evaluations in runs.items())
    return format_document(
        title, f"<main><h1>{escape(title)}</h1>{first}{_LEGEND}{pictures}{last}</main>"
    )


def _pictures(name: str, runs: Sequence[Evaluation]) -> str:
    figures = "".join(
        f'<figure><img alt="" src="{_data_url(runs[0], number)}"><figcaption>'
        f"{escape(runs[0].pictures[number].path.name)}: {count} faults in "
        f"{len(runs)} {'run' if len(runs) == 1 else 'runs'}</figcaption></figure>"
        for number, count in failures.worst_pictures(runs, PICTURES_MAX)
    )
    shown = f'<div class="grid">{figures}</div>' if figures else "<p>There are none.</p>"
    return f"<h2>{escape(name)}: pictures with most faults</h2>{shown}"


def _data_url(run: Evaluation, number: int) -> str:
    encoded = cv2.imencode(".jpg", failures.draw_faults(run, number)[..., ::-1])[1]
    return "data:image/jpeg;base64," + base64.b64encode(encoded.tobytes()).decode()
