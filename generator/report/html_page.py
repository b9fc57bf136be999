"""Reports and certificates as self-contained HTML files that request nothing.

The page holds the data as JSON, and one script that draws it. A content security policy permits
only this script and style sheet, by their digests, and images in ``data:`` URLs.
"""

import base64
import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

STYLE = Path(__file__).with_suffix(".css").read_text(encoding="utf-8")
SCRIPT = Path(__file__).with_suffix(".js").read_text(encoding="utf-8")


def format_page(sets: Sequence[Mapping[str, Any]]) -> str:
    """Format the HTML document of one data set, or of two for comparison.

    Args:
        sets: Reports as in ``gen_data.report.report_data``.
    """
    title = " and ".join(str(report["name"]) for report in sets)
    body = (
        f"<noscript>The report of {escape(title)} needs JavaScript; report.json next to it has "
        "the same figures.</noscript>\n"
        f'<script type="application/json" id="data">{embed_json(sets)}</script>\n'
        f"<script>{SCRIPT}</script>"
    )
    return format_document(f"{title}: data set report", body, _digest(SCRIPT))


def format_document(title: str, body: str, script_digest: str = "") -> str:
    """Format an HTML document with the style sheet of reports.

    Args:
        title: Plain text.
        body: HTML.
        script_digest: Digest of the only script that may run, as in a content security policy;
            empty =
            none may.
    """
    script = f"script-src '{script_digest}'; " if script_digest else ""
    policy = (
        f"default-src 'none'; img-src data:; {script}"
        f"style-src '{_digest(STYLE)}'; base-uri 'none'; form-action 'none'"
    )
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style></head>\n"
        f"<body>{body}</body></html>\n"
    )


def format_table(
    title: str, header: Sequence[str], rows: Sequence[Sequence[str]], note: str
) -> str:
    """A table of plain texts under a heading, with a note below; the first column is left."""

    def line(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    body = "".join(line(row, "td") for row in rows)
    return (
        f'<h2>{escape(title.capitalize())}</h2><div class="card scroll"><table><thead>'
        f"{line(header, 'th')}</thead><tbody>{body}</tbody></table></div>"
        f'<p class="quiet">{escape(note)}</p>'
    )


def format_tiles(tiles: Iterable[tuple[str, str, str]]) -> str:
    """A row of figures, each a name, a value and a class of the style sheet."""
    shown = (
        f'<div class="tile"><b class="{kind}">{escape(value)}</b><span>{escape(name)}</span></div>'
        for name, value, kind in tiles
    )
    return f'<div class="tiles">{"".join(shown)}</div>'


def format_check(name: str, verdict: str, kind: str) -> str:
    """A line with a name and a verdict of a class of the style sheet."""
    return (
        f'<div class="check"><span>{escape(name)}</span>'
        f'<span class="{kind}">{escape(verdict)}</span></div>'
    )


def embed_json(value: Any) -> str:
    """JSON that no HTML parser takes for markup: ``<`` is an escape sequence."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")


def _digest(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
