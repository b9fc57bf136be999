"""Table of the conventions of all formats, between two markers of docs/formats.md.

``python docs/conventions.py`` writes it again.
"""

from pathlib import Path

from gen_data.exporters import TABLE

PAGE = Path(__file__).parent / "formats.md"
BEGIN, END = "<!-- conventions -->\n", "<!-- end of conventions -->\n"
HEADS = {
    "pixel_centre": "centre of pixel i",
    "box": "box in the image",
    "lens": "lens",
    "time": "time",
    "ring": "ring 0",
    "intensity": "intensity",
}
"""Columns by name of the convention."""


def table() -> str:
    """Exporters in order of their names; a dash where the format has no such number."""
    lines = [f"| exporter | {' | '.join(HEADS.values())} |", "|---" * (1 + len(HEADS)) + "|"]
    for name in TABLE.names():
        stated = TABLE.load(name).conventions
        cells = (getattr(stated, convention) or "-" for convention in HEADS)
        lines.append(f"| `{name}` | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def with_table(page: str) -> str:
    """The page with the present table between its markers."""
    before, rest = page.split(BEGIN)
    return f"{before}{BEGIN}\n{table()}\n{END}{rest.split(END)[1]}"


if __name__ == "__main__":
    PAGE.write_text(with_table(PAGE.read_text("utf-8")), "utf-8", newline="\n")
