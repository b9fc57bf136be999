"""``gen-data ladder``: the same scenes at several steps of one factor."""

from pathlib import Path

import click

from gen_data.core.errors import ConfigError

HELP = """Generate the same scenes at several steps of one factor, and judge a detector on them.

With --factor, CONFIG is generated once per value: all scenes agree but for the factor. With
--results, CONFIG is the folder of a ladder, and COCO results of a detector on every step
become a table of AP by step, with differences paired by picture.

\b
gen-data ladder street.yaml --factor "shared.weather=[ClearNoon, ClearNight]"
gen-data ladder tabletop.yaml --factor randomizers.orbit.distance_m=0.6..2
gen-data ladder out/ladder --results 'results/{step}.json'
"""


@click.command("ladder", help=HELP)
@click.argument("config")
@click.option("--factor", metavar="FIELD=VALUES", help="LOW..HIGH, or [value, value, ...].")
@click.option("--steps", type=int, default=5, show_default=True, help="Steps from LOW to HIGH.")
@click.option("--n", "-n", type=click.IntRange(1), default=50, show_default=True, help="Samples.")
@click.option(
    "--out", "-o", type=click.Path(path_type=Path), default=Path("out/ladder"), show_default=True
)
@click.option("--workers", "-w", type=int, help="Processes [default: one per core].")
@click.option("--results", metavar="PATTERN", help="COCO results by step: a path with {step}.")
def ladder(
    config: str,
    factor: str | None,
    steps: int,
    n: int,
    out: Path,
    workers: int | None,
    results: str | None,
) -> None:
    """Make a ladder, or judge the results of a detector on one."""
    from rich.console import Console

    from gen_data.cli.tables import print_tables
    from gen_data.lab.study import ladder as ladders
    from gen_data.lab.study.study import PAGE

    if (factor is None) == (results is None):
        raise ConfigError("expected --factor to make a ladder, or --results to judge by one")
    if results is not None:
        print_tables(Console(), ladders.judge(Path(config), results)["tables"])
        click.echo(f"wrote {Path(config) / PAGE}")
        return
    made = ladders.parse_factor(str(factor), steps)
    same = ladders.build(config, made, n, out, workers=workers, report=click.echo)
    print_tables(Console(), [ladders.table_of(made, same, n)])
