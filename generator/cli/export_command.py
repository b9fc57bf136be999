"""``gen-data export``: a finished data set in other formats."""

import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import click

from gen_data.core.errors import ConfigError

HELP = """Write a finished data set in other formats, without rendering it again.

The result is a data set with the same bytes as if it had been generated with these exporters; its
images are hard links.

\b
gen-data export out/tabletop --format yolo --format voc --out out/further
"""


@click.command("export", help=HELP)
@click.argument("folder", type=click.Path(path_type=Path))
@click.option(
    "--format",
    "-f",
    "formats",
    multiple=True,
    required=True,
    metavar="NAME",
    help="Exporter, as in a configuration: coco, or '{type: coco, amodal: false}'. Repeatable.",
)
@click.option(
    "--out", "-o", required=True, type=click.Path(path_type=Path), help="Folder of the result."
)
@click.option("--label-map", type=click.Path(path_type=Path), help="YAML file with a label map.")
@click.option("--workers", "-w", type=int, help="Worker processes [default: one per core].")
@click.option("--force", is_flag=True, help="Start although the disk is probably too small.")
def export(folder: Path, formats: tuple[str, ...], out: Path, **keywords: Any) -> None:
    """Export a finished data set."""
    from gen_data.api.export import export as write_exports
    from gen_data.cli.generate_command import print_summary, run_with_progress
    from gen_data.runner.stored import StoredSamples

    with _named_options(formats):
        parsed = [_parse_format(text) for text in formats]
        run = partial(write_exports, folder, parsed, out, **keywords)
        summary = run_with_progress(StoredSamples(folder).n, run)
    print_summary(summary)


@contextmanager
def _named_options(formats: Sequence[str]) -> Iterator[None]:
    """Name the options in errors about formats: ``formats[1].rectify`` is part of the second."""
    try:
        yield
    except ConfigError as error:

        def option(found: re.Match[str]) -> str:
            return f"--format {shlex.quote(formats[int(found[1])])}:"

        text = re.sub(r"formats\[(\d+)\](?:\.type)?:", option, str(error))
        raise ConfigError(re.sub(r"formats\[(\d+)\]\.", lambda m: f"{option(m)} ", text)) from error


def _parse_format(text: str) -> str | Mapping[str, Any]:
    """Parse a name, or a YAML mapping as in a configuration."""
    from gen_data.config.yaml_tree import parse_yaml

    if not text.lstrip().startswith("{"):
        return text
    entry: Mapping[str, Any] = parse_yaml(text, "--format").plain()
    return entry
