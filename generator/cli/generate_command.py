"""Generation of a data set with a progress bar and a summary."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING

from gen_data.api.generate import generate
from gen_data.cli import options, tables
from gen_data.core.errors import SamplesSkipped

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from gen_data.runner.progress import RunProgress, Summary
    from gen_data.runner.ray_cluster import RayCluster


def generate_with_progress(
    choice: options.ConfigurationOptions,
    n: int,
    *,
    out: str | None,
    workers: int | None,
    repair: bool = False,
    allow_mixed_numerics: bool = False,
    force: bool = False,
    skip_failed: bool = False,
    sample_timeout_s: float | None = None,
    shards: tuple[int, int] | None = None,
    cluster: RayCluster | None = None,
) -> None:
    """Generate samples 0 to n - 1, or the missing ones, and print a summary.

    Raises:
        GenDataError: see ``gen_data.api.generate``, which has the same arguments.
    """
    with progress_bar(n) as show:
        summary = generate(
            choice.source,
            n,
            out=out,
            workers=workers,
            seed=choice.seed,
            overrides=choice.overrides,
            without=choice.without,
            repair=repair,
            allow_mixed_numerics=allow_mixed_numerics,
            force=force,
            skip_failed=skip_failed,
            sample_timeout_s=sample_timeout_s,
            shards=shards,
            cluster=cluster,
            on_progress=show,
            resume_command=shlex.join(["gen-data", *sys.argv[1:]]),
        )
    print_summary(summary)


@contextmanager
def progress_bar(n: int) -> Iterator[Callable[[RunProgress], None]]:
    """Show the progress of a run of ``n`` samples."""

    @cache
    def started() -> tuple[Progress, TaskID]:
        bar = _make_bar()
        bar.start()
        return bar, bar.add_task("samples", total=n, rate="", rejections=0)

    def show(progress: RunProgress) -> None:
        # Started by the first sample, because errors and warnings of the configuration come alone.
        bar, task = started()
        bar.update(
            task,
            completed=progress.done,
            # A worker with empty caches makes the assets of its first scene for half a minute.
            description="samples" if progress.samples_per_s else "first assets",
            rate=f"{progress.samples_per_s:.1f}/s",
            rejections=progress.rejections,
        )

    try:
        yield show
    finally:
        if started.cache_info().currsize:
            started()[0].stop()


def _make_bar() -> Progress:
    # Not imported before: a worker already prepares itself when a run shows its first bar.
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[rejections]} rejected"),
        console=Console(stderr=True),
    )


def print_summary(summary: Summary) -> None:
    """Print the summary of a run as a table.

    Raises:
        SamplesSkipped: the data set does not have all of its samples.
    """
    from rich.console import Console

    tables.print_facts(Console(stderr=True), summary.folder, summary.rows())
    if summary.failed:
        raise SamplesSkipped(
            f"{len(summary.failed)} samples could not be made and were skipped; the first one: "
            f"sample {summary.failed[0].index}. Texts of errors are in run/log.jsonl"
        )
