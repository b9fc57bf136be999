"""The main job: from a configuration to a data set, with progress and a summary."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from gen_data.generator.assemble.pipeline_factory import PipelineFactory
from gen_data.generator.cli.options import ConfigurationOptions
from gen_data.generator.core.errors import ConfigError
from gen_data.generator.pipeline.splits import warn_of_empty_splits
from gen_data.generator.runner.identity import format_licences, make_plan
from gen_data.generator.runner.run import RunProgress, Settings, Summary, run


def generate(
    choice: ConfigurationOptions,
    n: int,
    *,
    out: Path | None,
    workers: int | None,
    repair: bool = False,
) -> None:
    """Make samples 0 to n - 1, or the missing ones, and print a summary.

    ``repair`` hashes all files that are there and makes damaged shards again.

    Raises:
        GenDataError: of the kind that fits; see ``gen_data.generator.core.errors``.
    """
    if n < 1:
        raise ConfigError(f"--n: {n} samples cannot be made; expected at least 1")
    workers = _core_count() if workers is None else workers
    if workers < 0:
        raise ConfigError(f"--workers: {workers}; expected at least 1, or 0 to run in this process")
    config = choice.config()
    general = config.general
    scenes = -(-n // (general.views_per_scene * general.steps_per_scene))
    warn_of_empty_splits(scenes, config.split_shares, general.splits.assign, general.seed)
    factory = PipelineFactory(config, n)
    folder = out if out is not None else Path("out") / config.name
    console = Console(stderr=True)
    with _progress_bar(console, n) as show:
        summary = run(
            make_plan(factory),
            factory,
            folder,
            workers=workers,
            progress=show,
            resume_command=shlex.join(["gen-data", *sys.argv[1:]]),
            licences=partial(format_licences, factory),
            settings=Settings(full_check=repair),
        )
    _print_summary(console, folder, summary)


def _core_count() -> int:
    return len(os.sched_getaffinity(0))


@contextmanager
def _progress_bar(console: Console, n: int) -> Iterator[Callable[[RunProgress], None]]:
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[rejections]} rejected"),
    )
    with Progress(*columns, console=console) as bar:
        task = bar.add_task("samples", total=n, rate="", rejections=0)

        def show(progress: RunProgress) -> None:
            bar.update(
                task,
                completed=progress.done,
                rate=f"{progress.samples_per_s:.1f}/s",
                rejections=progress.rejections,
            )

        yield show


def _print_summary(console: Console, folder: Path, summary: Summary) -> None:
    table = Table(title=str(folder), show_header=False)
    for name, value in summary.rows():
        table.add_row(name, value)
    console.print(table)
