"""``gen-data match``: a configuration fitted to recordings."""

from functools import partial
from pathlib import Path

import click

HELP = """Fit the sensors of CONFIG to a folder of unlabelled recordings.

Exposure, tone, colour, noise, blur and JPEG quality follow from photographs; reflectance, dropout
and range from laser scans; distance and pitch of the camera from boxes of COCO or KITTI, if there
are any. The result extends CONFIG; a .json and an .html file next to it have the report.

\b
gen-data match recordings/ street.yaml --out matched.yaml
gen-data --config matched.yaml --n 1000
"""


@click.command("match", help=HELP)
@click.argument("folder", metavar="REAL_FOLDER", type=click.Path(path_type=Path))
@click.argument("config")
@click.option(
    "--out",
    "-o",
    type=click.Path(path_type=Path),
    default=Path("matched.yaml"),
    show_default=True,
    help="The configuration to write.",
)
@click.option(
    "--images", type=int, default=200, show_default=True, help="Photographs to read at most."
)
@click.option("--scans", type=int, default=60, show_default=True, help="Scans to read at most.")
@click.option(
    "--scenes", type=int, default=48, show_default=True, help="Scenes of CONFIG to simulate."
)
@click.option("--camera", default="", metavar="NAME", help="Camera to fit [default: the first].")
@click.option(
    "--lidar", default="", metavar="NAME", help="Laser scanner to fit [default: the first]."
)
@click.option("--force", is_flag=True, help="Replace existing files.")
def match(
    folder: Path,
    config: str,
    out: Path,
    images: int,
    scans: int,
    scenes: int,
    camera: str,
    lidar: str,
    force: bool,
) -> None:
    """Fit a configuration to recordings."""
    from dataclasses import asdict

    from rich.console import Console

    from gen_data.cli.tables import print_tables
    from gen_data.lab.matching.api import match as fit
    from gen_data.lab.matching.match_report import make_tables

    console = Console(stderr=True)
    with console.status("") as status:
        found = fit(
            folder,
            config,
            out,
            images=images,
            scans=scans,
            scenes=scenes,
            camera=camera,
            lidar=lidar,
            force=force,
            # A file or another program gets lines.
            on_progress=status.update if console.is_terminal else partial(click.echo, err=True),
        )
    print_tables(Console(), map(asdict, make_tables(found)))
    for path in (out, out.with_suffix(".json"), out.with_suffix(".html")):
        click.echo(f"wrote {path}")
