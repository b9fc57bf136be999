"""``gen-data adapt``: the next round of a curriculum, with more of the missed objects."""

from pathlib import Path

import click

HELP = """Draw more of the objects that a detector missed.

CONFIG is a configuration and DATA a finished data set of it that the detector did not train on.
Missed objects are joined with the values that were drawn for their scenes; where misses depend on a
parameter, its distribution is weighted towards them, within its declared support. The result is a
configuration for the next round, and a line in the curriculum of the folder.

\b
gen-data --config tabletop.yaml --seed 7 --n 400 --out out/judged
gen-data adapt tabletop.yaml out/judged --results results.json --out out/next
gen-data --config out/next/round_1.yaml --n 4000
"""


@click.command("adapt", help=HELP)
@click.argument("config")
@click.argument("data", type=click.Path(path_type=Path))
@click.option("--results", type=click.Path(path_type=Path), help="COCO results of any detector.")
@click.option("--detector", type=click.Path(path_type=Path), help="Or: a small detector of study.")
@click.option(
    "--strength",
    type=float,
    default=1.0,
    show_default=True,
    help="Exponent of the ratio of misses by which weights change.",
)
@click.option(
    "--out",
    "-o",
    type=click.Path(path_type=Path),
    default=Path("out/curriculum"),
    show_default=True,
)
def adapt(
    config: str, data: Path, results: Path | None, detector: Path | None, strength: float, out: Path
) -> None:
    """Write the next round of a curriculum."""
    from rich.console import Console

    from gen_data.cli.tables import print_tables
    from gen_data.lab.study.adapt import adapt as write_round
    from gen_data.lab.study.adapt import tabulate

    made = write_round(config, data, out, results=results, detector=detector, strength=strength)
    print_tables(Console(), [tabulate(made, strength)])
    click.echo(f"wrote {made.config}")
