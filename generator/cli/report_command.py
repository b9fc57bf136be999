"""``gen-data report``: statistics of a data set, as tables and as an HTML page."""

import json
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from gen_data.cli.tables import print_tables
from gen_data.core.errors import ConfigError, StorageError
from gen_data.core.whole_files import check_place, write_whole

if TYPE_CHECKING:
    from rich.console import Console

PAGE = Path("run/report/index.html")
"""Default path of the page in the folder of a data set."""
REAL_PAGE = PAGE.with_name("carry_over.html")
COMPARE_REAL = "gen_data.lab.carry_over.carry_over_report"
"""Module of the laboratory behind ``--compare-real``, imported on demand."""


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option(
    "--compare",
    type=click.Path(path_type=Path),
    metavar="FOLDER2",
    help="Show a second data set next to it in the page.",
)
@click.option(
    "--compare-real",
    type=click.Path(path_type=Path),
    metavar="REAL_FOLDER",
    help="Compare with labelled real pictures instead: COCO, KITTI, YOLO or VOC.",
)
@click.option(
    "--classes",
    multiple=True,
    metavar="REAL=OURS",
    help="With --compare-real: class names that correspond.",
)
@click.option(
    "--pictures",
    type=click.IntRange(min=2),
    default=500,
    show_default=True,
    help="With --compare-real: pictures of each side to read at most.",
)
@click.option(
    "--n",
    "-n",
    type=click.IntRange(min=2),
    default=60,
    show_default=True,
    help="With --compare-real: samples of a configuration in place of FOLDER.",
)
@click.option(
    "--html",
    type=click.Path(path_type=Path),
    help=f"The page to write [default: FOLDER/{PAGE}]; its figures are in a .json file next to it.",
)
@click.option(
    "--scenes",
    type=int,
    default=100,
    show_default=True,
    help="Scenes whose parameters are drawn again for the page; 0 = none.",
)
def report(
    folder: Path,
    compare: Path | None,
    compare_real: Path | None,
    classes: tuple[str, ...],
    pictures: int,
    n: int,
    html: Path | None,
    scenes: int,
) -> None:
    """Print statistics of a data set, and write an HTML page with its samples.

    FOLDER is a finished data set, or any folder with labels in the layout of the formats coco or
    kitti. The page shows labelled samples, drawn parameters next to their distributions, checks of
    labels, near-duplicates, costs and licences. It is one file that requests nothing.

    With --compare-real, FOLDER may also be a configuration. The tables list the statistics that
    differ most between both, and the fields to change; the page has all.
    """
    from rich.console import Console
    from threadpoolctl import threadpool_limits

    _refuse_idle(compare_real is not None)
    is_stored = (folder / "plan.json").is_file()
    if compare_real is not None:
        if compare is not None:
            raise ConfigError("--compare and --compare-real exclude each other; give one of them")
        page = folder / REAL_PAGE if html is None and is_stored else html
        lab = import_module(COMPARE_REAL)
        lab.report_real(folder, compare_real, classes, pictures, n, page)
        return
    if scenes < 0:
        raise ConfigError(f"--scenes: {scenes} is negative; expected 0 or more")
    folders = [folder] if compare is None else [folder, compare]
    page = folder / PAGE if html is None and is_stored else html
    if page is not None:
        check_place(page, "--html")
    # Poses of scenes that are drawn again must have the last bits of the stored ones.
    with threadpool_limits(limits=1):
        sets = [_describe(one, scenes, len(folders), Console(stderr=True)) for one in folders]
    if page is not None:
        # Before the tables: their reader may close the output early, as `| head` does.
        _write(page, sets)
    console = Console()
    for number, described in enumerate(sets):
        if len(sets) > 1:
            console.rule(str(folders[number]))
        print_tables(console, described["tables"])
    if page is not None:
        click.echo(f"wrote {page}")


def _refuse_idle(is_real: bool) -> None:
    """Refuse options without an effect: some need ``--compare-real``, and one excludes it."""
    source = click.get_current_context().get_parameter_source
    for name in ("scenes",) if is_real else ("classes", "pictures", "n"):
        if source(name) is ParameterSource.COMMANDLINE:
            place = "with" if is_real else "without"
            raise ConfigError(f"--{name}: has no effect {place} --compare-real; leave it out")


def _describe(folder: Path, scenes: int, sets: int, console: "Console") -> dict[str, Any]:
    from gen_data.report.report_data import BROWSER_BYTES_MAX, describe_dataset, describe_folder

    if not (folder / "plan.json").is_file():
        return describe_folder(folder)
    with console.status("") as status:
        return describe_dataset(
            folder,
            scenes_max=scenes,
            browser_bytes_max=BROWSER_BYTES_MAX // sets,
            progress=lambda step: status.update(f"{folder}: {step}"),
        )


def _write(page: Path, sets: list[dict[str, Any]]) -> None:
    from gen_data.report.html_page import format_page
    from gen_data.report.report_data import without_pictures

    figures = [without_pictures(described) for described in sets]
    text = json.dumps({"sets": figures}, ensure_ascii=False, indent=1) + "\n"
    try:
        write_whole({page: format_page(sets).encode(), page.with_suffix(".json"): text.encode()})
    except OSError as error:
        raise StorageError(f"{page}: {error.strerror}; choose another place with --html") from error
