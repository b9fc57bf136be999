"""Commands that show samples: ``preview`` and ``contact-sheet``."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gen_data.cli import options
from gen_data.core import capture, optional_packages, sample
from gen_data.core.errors import ConfigError

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from gen_data.preview.overlay import Image
    from gen_data.preview.sensor_views import PointColors


WRITTEN = "written"


@click.command()
@click.argument("source")
@click.option("--n", "-n", type=int, default=8, show_default=True, help="Number of samples.")
@click.option("--first", type=int, default=0, show_default=True, help="Index of the first sample.")
@click.option("--save", type=click.Path(path_type=Path), help="Write a .rrd file instead.")
@click.option(
    "--points",
    type=click.Choice(["class", "intensity"]),
    default="class",
    show_default=True,
    help="Quantity shown by the colour of laser points.",
)
@click.option("--web", is_flag=True, help="Serve to a browser instead of the desktop viewer.")
@click.option(
    "--host",
    default="127.0.0.1",
    show_default=True,
    help="With --web: the address to listen on; 0.0.0.0 shows the scene to the whole network.",
)
@options.configuration_options
def preview(
    source: str,
    n: int,
    first: int,
    save: Path | None,
    points: "PointColors",
    web: bool,
    host: str,
    **changes: "Unpack[options.Changes]",
) -> None:
    """Show samples in Rerun: 3D scene, images, scans, boxes; sequences have a timeline [s].

    SOURCE is a configuration (a path or a shipped name), or the folder of a data set, whose
    samples are generated again from its plan.
    """
    from gen_data.assemble.config import load_config
    from gen_data.assemble.pipeline_factory import open_pipeline

    missing = optional_packages.missing_packages("rerun")
    if missing:
        raise ConfigError(f"gen-data preview {missing}; gen-data contact-sheet draws without it")
    from gen_data.preview.rerun_recording import save_recording, send_samples
    from gen_data.preview.viewer import open_window, serve_web

    config = load_config(source, **changes)
    with open_pipeline(config) as pipeline:
        samples = _samples(pipeline.sample, first, n)
        info = pipeline.info
        if save is not None:
            save_recording(save, samples, pipeline.assets, info=info, points=points)
            click.echo(f"{save}: {n} sample{'' if n == 1 else 's'}; open it with: rerun {save}")
            return
        viewer = serve_web(host) if web else open_window()
        if web:
            click.echo(f"open {viewer.web_url} (Ctrl-C ends)")
        send_samples(viewer.stream_url, samples, pipeline.assets, info=info, points=points)
        if web:
            with suppress(KeyboardInterrupt):
                viewer.process.wait()


@click.command("contact-sheet")
@click.argument("sources", nargs=-1, required=True)
@click.option("--n", "-n", type=int, default=48, show_default=True, help="Number of samples.")
@click.option("--first", type=int, default=0, show_default=True, help="Index of the first sample.")
@click.option("--step", type=int, default=1, show_default=True, help="Distance between samples.")
@click.option(
    "--out",
    "-o",
    type=click.Path(path_type=Path),
    default=Path("contact-sheet.png"),
    show_default=True,
    help="The PNG to write.",
)
@click.option("--columns", type=int, default=0, help="Tiles in a row; 0 = a sheet of about 4:3.")
@click.option("--tile-px", type=int, default=320, show_default=True, help="Width of a tile.")
@click.option(
    "--channels",
    default="rgb",
    show_default=True,
    help="Comma-separated channels of all cameras; 'written' = the channels written by each.",
)
@click.option("--labels/--no-labels", default=True, show_default=True, help="Draw the labels.")
@click.option("--captions", is_flag=True, help="Write a caption under every tile.")
@options.configuration_options
def contact_sheet(
    sources: tuple[str, ...],
    n: int,
    first: int,
    step: int,
    out: Path,
    columns: int,
    tile_px: int,
    channels: str,
    labels: bool,
    captions: bool,
    **changes: "Unpack[options.Changes]",
) -> None:
    """Draw samples with their labels on one PNG.

    SOURCES are configurations (paths or shipped names) or folders of data sets, in the order of
    the tiles.
    """
    if out.suffix.lower() not in ("", ".png"):
        raise ConfigError(
            f"--out {out}: a contact sheet is a PNG; expected {out.with_suffix('.png')}"
        )
    from gen_data.assemble.config import load_config
    from gen_data.assemble.pipeline_factory import open_pipeline
    from gen_data.preview.contact_sheet import arrange_tiles, make_tiles, render_tiles, write_sheet

    own = channels == WRITTEN
    wanted = () if own else tuple(_channel(name.strip()) for name in channels.split(","))
    images: list[Image] = []
    for source in sources:
        config = load_config(source, **changes)
        with open_pipeline(config, extra_channels=frozenset(wanted)) as pipeline:
            samples = _samples(pipeline.sample, first, n, step)
            info = pipeline.info
            shown = info.media if own else dict.fromkeys(info.cameras, wanted)
            views = info.views if own else {}
            drawn = make_tiles(samples, shown, labels=labels, views=views, width_px=tile_px)
            images += render_tiles(drawn, tile_px, captions=captions)
    write_sheet(arrange_tiles(images, columns), out)
    click.echo(f"{out}: {len(images)} tile{'' if len(images) == 1 else 's'}")


def _samples(
    sample_at: Callable[[int], sample.Sample], first: int, n: int, step: int = 1
) -> Iterator[sample.Sample]:
    if n < 1 or first < 0 or step < 1:
        raise ConfigError("--n and --step must be at least 1, --first at least 0")
    for index in range(first, first + n * step, step):
        yield sample_at(index)


def _channel(name: str) -> capture.Channel:
    shown = [c.value for c in capture.Channel if c.is_image]
    if name not in shown:
        raise ConfigError(
            f"--channels: unknown channel '{name}'; expected {WRITTEN}, or some of"
            f" {', '.join(shown)}"
        )
    return capture.Channel(name)
