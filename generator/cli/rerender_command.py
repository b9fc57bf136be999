"""``gen-data rerender``: the scenes of a finished data set, rendered again."""

from functools import partial
from pathlib import Path
from typing import Any

import click

HELP = """Render the scenes of a finished data set again with other sensors, weather or light.

Objects keep their ids, shapes and poses; only randomizers with changed settings are drawn again.

\b
gen-data rerender out/street --out out/night --set shared.weather=WetNight
gen-data rerender out/tabletop --out out/fisheye --sensors fisheye.yaml
gen-data rerender out/tabletop --out out/traced --tier pathtraced
"""


@click.command("rerender", help=HELP)
@click.argument("folder", type=click.Path(path_type=Path))
@click.option(
    "--out", "-o", required=True, type=click.Path(path_type=Path), help="Folder of the result."
)
@click.option(
    "--sensors",
    type=click.Path(path_type=Path),
    help="Configuration whose sensors replace the data set's.",
)
@click.option("--tier", type=click.Choice(["realtime", "pathtraced"]), help="Rendering tier.")
@click.option(
    "--set",
    "overrides",
    multiple=True,
    metavar="KEY=VALUE",
    help="Override one field; KEY may begin with the name of a randomizer.",
)
@click.option(
    "--redraw", multiple=True, metavar="NAME", help="Draw a further randomizer again. Repeatable."
)
@click.option("--workers", "-w", type=int, help="Worker processes [default: one per core].")
@click.option("--force", is_flag=True, help="Start although the disk is probably too small.")
def rerender(
    folder: Path, out: Path, tier: str | None, overrides: tuple[str, ...], **keywords: Any
) -> None:
    """Render a finished data set again."""
    from gen_data.api.rerender import rerender as render_again
    from gen_data.cli.generate_command import print_summary, run_with_progress
    from gen_data.runner.stored import StoredSamples

    changes = (*overrides, *([f"render.tier={tier}"] if tier else []))
    run = partial(render_again, folder, out, overrides=changes, **keywords)
    print_summary(run_with_progress(StoredSamples(folder).n, run))
