"""Generation of a data set with a progress bar and a summary."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial
from typing import TYPE_CHECKING, Any, Protocol

from gen_data.api.generate import generate
from gen_data.cli import options, tables
from gen_data.core.errors import SamplesSkipped

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from gen_data.runner.progress import RunProgress, Summary

    class Run(Protocol):
        """A function of the API that makes a data set, with all other arguments bound."""

        def __call__(
            self, *, on_progress: Callable[[RunProgress], None], resume_command: str
        ) -> Summary:
            """Make the data set, or its missing part."""


def generate_with_progress(config: str, n: int, **keywords: Any) -> None:
    """Generate samples 0 to n - 1, or the missing ones, and print a summary.

    Args:
        config: A path, or a shipped name.
        n: Number of samples.
        keywords: By name, the options of a cluster, and other keywords of ``gen_data.generate``.

    Raises:
        GenDataError: see ``gen_data.generate``.
    """
    chosen = {name: keywords.pop(name) for name in options.CLUSTER}
    cluster = options.choose_cluster(**chosen)
    print_summary(run_with_progress(n, partial(generate, config, n, cluster=cluster, **keywords)))


def run_with_progress(n: int, run: Run) -> Summary:
    """Make a data set of ``n`` samples under a progress bar; the same command line resumes it."""
    with _progress_bar(n) as show:
        return run(on_progress=show, resume_command=shlex.join(["gen-data", *sys.argv[1:]]))


@contextmanager
def _progress_bar(n: int) -> Iterator[Callable[[RunProgress], None]]:
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
