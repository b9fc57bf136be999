"""Writing a data set from Python: what ``gen-data --config ... --n ...`` does."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from gen_data.generator.api.config import ConfigLike, load_config
from gen_data.generator.core.errors import ConfigError

if TYPE_CHECKING:
    from gen_data.generator.runner.progress import RunProgress, Summary


def generate(  # noqa: PLR0913  (keywords of one front door)
    config: ConfigLike,
    n: int,
    *,
    out: str | PathLike[str] | None = None,
    workers: int | None = None,
    seed: int | None = None,
    overrides: Sequence[str] = (),
    without: Sequence[str] = (),
    on_progress: Callable[[RunProgress], None] | None = None,
    resume_command: str = "the same call of gen_data.generate",
) -> Summary:
    """Generate a data set, or what is missing of it.

    Args:
        config: As of ``Dataset``.
        n: Number of samples, at least 1.
        out: Folder; None = ``out/<name of the configuration>``.
        workers: Processes; None = one per core, 0 = this process. The bytes do not depend on it.
        seed: Replaces the configuration's seed.
        overrides: ``KEY=VALUE`` texts as of ``gen-data --set``.
        without: Names of randomizers to leave out.
        on_progress: Called after each sample and shard.
        resume_command: What error messages name as the way to go on.

    Returns:
        What was made, with the identity of the data set; its folder is ``summary.folder``.

    Raises:
        ConfigError: the configuration or an argument is wrong.
        GenDataError: of the kind that fits; see ``gen_data.generator.core.errors``.
        Interrupted: Ctrl-C or SIGTERM; finished shards stay.
    """
    from gen_data.generator.assemble.pipeline_factory import PipelineFactory
    from gen_data.generator.runner.identity import format_licences, make_plan
    from gen_data.generator.runner.run import run

    if n < 1:
        raise ConfigError(f"n: {n} samples cannot be made; expected at least 1")
    if workers is not None and workers < 0:
        raise ConfigError(
            f"workers: {workers}; expected at least 1, or 0 to generate in this process"
        )
    spec = load_config(config, seed=seed, overrides=overrides, without=without)
    factory = PipelineFactory(spec, n)
    folder = Path(out) if out is not None else Path("out") / spec.name
    return run(
        make_plan(factory),
        factory,
        folder,
        workers=len(os.sched_getaffinity(0)) if workers is None else workers,
        resume_command=resume_command,
        licences=partial(format_licences, factory),
        progress=on_progress or _ignore,
    )


def _ignore(progress: RunProgress) -> None:
    del progress
