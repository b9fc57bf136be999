"""``gen-data rerender``: the scenes of a finished data set, rendered again."""

import shlex
import sys
from pathlib import Path

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
    folder: Path,
    out: Path,
    sensors: Path | None,
    tier: str | None,
    overrides: tuple[str, ...],
    redraw: tuple[str, ...],
    workers: int | None,
    force: bool,
) -> None:
    """Render a finished data set again."""
    from gen_data.api.rerender import rerender as render_again
    from gen_data.cli.generate_command import print_summary, progress_bar
    from gen_data.runner.stored import StoredSamples

    with progress_bar(StoredSamples(folder).n) as show:
        summary = render_again(
            folder,
            out,
            sensors=sensors,
            overrides=(*overrides, *([f"render.tier={tier}"] if tier else [])),
            redraw=redraw,
            workers=workers,
            force=force,
            on_progress=show,
            resume_command=shlex.join(["gen-data", *sys.argv[1:]]),
        )
    print_summary(summary)
