"""``gen-data edit``: a live page for configurations and data sets."""

from pathlib import Path

import click

from gen_data.core import errors, optional_packages
from gen_data.core.system_calls import usable_cores

HELP = """Edit a configuration in the browser, with samples that are drawn as you type.

CONFIG is a file, which need not exist yet, a shipped name, or the folder of a finished data set to
browse. Without it, the page begins with the gallery. The page is served on this machine only;
with --host, whoever has the printed address with its token can edit.

\b
gen-data edit tabletop.yaml
gen-data edit my_scene.yaml --real photos
gen-data edit out/tabletop
"""


@click.command("edit", help=HELP)
@click.argument("config", required=False)
@click.option(
    "--real",
    type=click.Path(path_type=Path, exists=True, file_okay=False),
    metavar="FOLDER",
    help="Real pictures, with labels or without, to compare with.",
)
@click.option(
    "--folder",
    "folders",
    multiple=True,
    type=click.Path(path_type=Path, exists=True, file_okay=False),
    help="A further folder that the page may read and write [default: the folder of CONFIG].",
)
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on.")
@click.option("--port", type=int, default=0, help="Port [default: one of the file, if free].")
@click.option("--workers", "-w", type=int, help="Processes that render [default: one per core].")
@click.option("--browser/--no-browser", default=True, help="Open the page in the browser.")
def edit(
    config: str | None,
    real: Path | None,
    folders: tuple[Path, ...],
    host: str,
    port: int,
    workers: int | None,
    browser: bool,
) -> None:
    """Serve the page until Ctrl-C."""
    missing = optional_packages.missing_packages("nicegui")
    if missing:
        raise errors.ConfigError(f"gen-data edit {missing}")
    if workers is not None and workers < 1:
        raise errors.ConfigError(f"--workers: {workers}; expected at least 1")
    import secrets
    import webbrowser

    from gen_data.lab.edit.desk import Desk
    from gen_data.lab.edit.files import Folders
    from gen_data.lab.edit.server import serve

    source = None if config is None else Path(config)
    home = Path() if source is None else source.parent
    roots = dict.fromkeys(path.resolve() for path in (home, *folders, *([real] if real else [])))

    def announce(url: str) -> None:
        click.echo(f"open {url} (Ctrl-C ends)")
        if browser:
            webbrowser.open(url)

    desk = Desk(Folders(tuple(roots)), source, real, secrets.token_urlsafe(16))
    serve(desk, host, port, workers or min(usable_cores(), 4), announce)
