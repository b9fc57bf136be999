"""``gen-data sample``: one sample on disk."""

from pathlib import Path

import click

from gen_data.cli.options import configuration_options


@click.command("sample")
@click.argument("source", metavar="CONFIG_OR_FOLDER")
@click.option("--index", "-i", type=int, required=True, help="Number of the sample, from 0.")
@click.option(
    "--out", "-o", required=True, type=click.Path(path_type=Path), help="New or empty folder."
)
@configuration_options
def sample(
    source: str,
    index: int,
    out: Path,
    seed: int | None,
    overrides: tuple[str, ...],
    without: tuple[str, ...],
) -> None:
    """Write one sample of a configuration or of a data set, in all of its formats.

    Its files have the same bytes as in the whole data set.
    """
    from gen_data.api.write_sample import write_sample

    folder = write_sample(source, index, out, seed=seed, overrides=overrides, without=without)
    click.echo(f"{folder}: sample {index}")
