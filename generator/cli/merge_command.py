"""The command ``merge``."""

from functools import partial
from pathlib import Path
from typing import Any

import click


@click.command()
@click.argument("parts", nargs=-1, required=True, type=click.Path(path_type=Path, exists=True))
@click.option("--out", "-o", required=True, type=click.Path(path_type=Path), help="Data set.")
@click.option(
    "--workers", "-w", type=int, help="Processes for missing shards [default: one per core]."
)
@click.option(
    "--allow-mixed-numerics",
    is_flag=True,
    help="Accept parts of machines whose computations differ in the last bits.",
)
def merge(parts: tuple[Path, ...], out: Path, **keywords: Any) -> None:
    r"""Join PARTS, folders that were generated with --shards, into one data set.

    \b
    gen-data --config street.yaml --n 10000 --shards 0:50 --out part-0     on one machine
    gen-data --config street.yaml --n 10000 --shards 50:100 --out part-1   on another
    gen-data merge part-0 part-1 --out out/street

    The result has the same bytes as one run. Shards that no part has are generated; parts stay.
    """
    from gen_data.api.merge import merge as join
    from gen_data.cli.generate_command import print_summary, run_with_progress
    from gen_data.runner.merge import common_plan

    print_summary(run_with_progress(common_plan(parts).n, partial(join, parts, out, **keywords)))
