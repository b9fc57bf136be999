"""``gen-data report``: statistics of a data set."""

from __future__ import annotations

from pathlib import Path

import click

from gen_data.generator.core.errors import StorageError


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option(
    "--html", type=click.Path(path_type=Path), help="Also write a page with histograms here."
)
def report(folder: Path, html: Path | None) -> None:
    """Print statistics of a data set, compared with published ones of KITTI.

    FOLDER is a data set with an export as coco or kitti. Statistics by category: objects, box
    sizes, occlusion, truncation, distances and keypoints; also laser points, if kitti has them.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table as RichTable

    from gen_data.generator.report.html_page import format_page
    from gen_data.generator.report.label_files import read_records, read_scans
    from gen_data.generator.report.label_statistics import collect_statistics
    from gen_data.generator.report.report_tables import (
        make_histograms,
        make_scan_tables,
        make_tables,
    )

    found = collect_statistics(read_records(folder))
    made = (*make_tables(found), *make_scan_tables(tuple(read_scans(folder))))
    console = Console()
    for table in made:
        shown = RichTable(title=table.title, caption=table.note or None, box=box.SIMPLE_HEAD)
        for number, name in enumerate(table.header):
            shown.add_column(name, justify="right" if number else "left")
        for row in table.rows:
            shown.add_row(*row)
        console.print(shown)
    if html is not None:
        try:
            html.parent.mkdir(parents=True, exist_ok=True)
            html.write_text(
                format_page(folder.resolve().name, made, make_histograms(found)),
                encoding="utf-8",
                newline="\n",
            )
        except OSError as error:
            raise StorageError(f"{html}: {error.strerror}") from error
        click.echo(f"wrote {html}")
