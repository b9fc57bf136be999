"""``gen-data sample``: one sample on disk."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from gen_data.cli import options

if TYPE_CHECKING:
    from typing_extensions import Unpack


@click.command("sample")
@click.argument("source", metavar="CONFIG_OR_FOLDER")
@click.option("--index", "-i", type=int, required=True, help="Number of the sample, from 0.")
@click.option(
    "--out", "-o", required=True, type=click.Path(path_type=Path), help="New or empty folder."
)
@options.configuration_options
def sample(source: str, index: int, out: Path, **changes: Unpack[options.Changes]) -> None:
    """Write one sample of a configuration or of a data set, in all of its formats.

    Its files have the same bytes as in the whole data set.
    """
    from gen_data.api.write_sample import write_sample

    folder = write_sample(source, index, out, **changes)
    click.echo(f"{folder}: sample {index}")
