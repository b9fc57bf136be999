"""Commands ``recipe`` and ``pull``: a data set as a few kilobytes, and made from them."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gen_data.cli import options

if TYPE_CHECKING:
    from typing_extensions import Unpack

RECIPE_HELP = """Print the recipe of a data set, from which `gen-data pull` makes it again.

\b
gen-data recipe out/tabletop > recipe.yaml
gen-data recipe tabletop.yaml --n 1000 > recipe.yaml   before it is generated
gen-data recipe recipe.yaml --lock requirements.txt    its versions, for pip
gen-data recipe out/tabletop --pack meshes.zip         with your own assets

The recipe has the resolved configuration, versions, and digests of assets and shards.
"""

PULL_HELP = """Make the data set of a recipe, and prove that it is the same.

\b
gen-data pull recipe.yaml
gen-data pull recipe.yaml --shards 0:50 --out part-0   see merge
gen-data pull recipe.yaml --semantic                   with other versions

Nothing is generated where versions, packs or assets are others: each one is named with its
remedy. An interrupted pull is resumed by the same command. Exit codes: 2 recipe, 3 packs or
assets, 5 versions or other bytes, 7 other labels or images.
"""


@click.command(help=RECIPE_HELP)
@click.argument("source", metavar="FOLDER_OR_CONFIG")
@click.option("--n", "-n", type=int, help="Number of samples, of a configuration.")
@click.option(
    "--lock", type=click.Path(path_type=Path), help="Also write a requirements file for pip."
)
@click.option(
    "--pack",
    "packs",
    multiple=True,
    type=click.Path(path_type=Path),
    help="File of `gen-data assets pack`, named by its digest.",
)
@options.configuration_options
def recipe(
    source: str,
    n: int | None,
    lock: Path | None,
    packs: tuple[Path, ...],
    **changes: Unpack[options.Changes],
) -> None:
    """Print the recipe of a data set."""
    from gen_data.api.recipes import recipe as make_recipe
    from gen_data.api.recipes import requirements

    text = make_recipe(source, n, packs=packs, **changes)
    if lock is not None:
        from gen_data.runner.durable_files import storage_errors

        with storage_errors(lock, ""):
            lock.write_text(requirements(text), "utf-8")
    click.echo(text, nl=False)


@click.command(help=PULL_HELP)
@click.argument("path", metavar="RECIPE", type=click.Path(path_type=Path))
@click.option(
    "--out", "-o", metavar="FOLDER", help="Folder, or URL such as s3://... [default: out/<name>]."
)
@click.option("--workers", "-w", type=int, help="Worker processes [default: one per core].")
@click.option(
    "--shards",
    callback=options.parse_shards,
    metavar="A:B",
    help="Make shards A to B - 1 only; see merge.",
)
@click.option("--semantic", is_flag=True, help="Accept other versions; compare labels only.")
@click.option(
    "--against",
    type=click.Path(path_type=Path, exists=True),
    metavar="FOLDER",
    help="The author's data set: names a difference; with --semantic, compares images.",
)
@click.option("--trust", is_flag=True, help="Read asset folders outside of the recipe's folder.")
@options.cluster_options
def pull(path: Path, semantic: bool, against: Path | None, **keywords: Any) -> None:
    """Make the data set of a recipe."""
    from gen_data.api.recipes import pull as make_again
    from gen_data.cli.generate_command import print_summary, run_with_progress
    from gen_data.runner.recipe import read_recipe

    file = read_recipe(path)
    cluster = options.choose_cluster(**{name: keywords.pop(name) for name in options.CLUSTER})
    run = partial(make_again, file, cluster=cluster, semantic=semantic, against=against, **keywords)
    summary = run_with_progress(file.recipe.n, run)
    proof = file.recipe.proof(semantic)
    which = (
        f"{summary.shards_left} shards left; the others" if summary.shards_left else "all shards"
    )
    if proof is None:
        fact = "the recipe names no digests to compare with"
    elif semantic:
        fact = f"{which} have equal labels" + (", and similar images" if against else "")
    elif summary.shards_left and not proof.shards:
        fact = "proven when all shards are there: the recipe names no digests of shards"
    else:
        fact = f"{which} are equal to the recipe"
    identity = f"; id {summary.dataset_id}" if summary.dataset_id else ""
    click.echo(f"{summary.folder}: {fact}{identity}")
    print_summary(summary)
