"""Repair of a data set: the function behind ``gen-data repair``."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from gen_data.api.config import count_workers
from gen_data.core.errors import StorageError, no_folder

if TYPE_CHECKING:
    from gen_data.runner.plan import Plan
    from gen_data.runner.progress import RunProgress, Summary
    from gen_data.runner.run import Settings


def repair(
    folder: str | PathLike[str],
    *,
    source: str | PathLike[str] | None = None,
    workers: int | None = None,
    on_progress: Callable[[RunProgress], None] | None = None,
    resume_command: str = "the same call of repair",
) -> Summary:
    """Restore damaged or missing files of a data set, byte for byte, from its own plan.

    Damaged shards are generated again, merged files are written again, and files that do not belong
    to the data set are moved to ``run/quarantine``, where the damaged ones are, too. Samples that
    failed are tried again; if they fail again, the data set stays without them.

    Args:
        folder: A data set; an unfinished one is finished.
        source: The data set whose scenes were rendered again, if it was made by ``rerender``.
        workers: Processes; None = one per core, 0 = this process.
        on_progress: Called after each sample and shard.
        resume_command: Command that error messages give for resuming.

    Returns:
        Summary of the run; ``already_complete`` if there was nothing to repair.

    Raises:
        StorageError: the plan is lost, or this installation would make other bytes.
        ConfigError: ``source`` is missing or another data set.
        DeterminismError: the repaired data set differs from the sealed one; it stays unfinished.
    """
    from gen_data.runner.plan import parse_plan
    from gen_data.runner.repair import read_declared_plan
    from gen_data.runner.run import Settings, lacks_samples
    from gen_data.runner.store import LocalStore

    path = Path(folder)
    if not path.exists():
        raise StorageError(no_folder(path))
    data = read_declared_plan(LocalStore(path.absolute()))
    if data is None:
        raise StorageError(
            f"{path}: its plan.json is damaged or missing, and there is no intact copy in run/.\n"
            "  With the configuration of the data set, this command restores it:\n"
            f"    gen-data --config FILE --n N --out {shlex.quote(str(path))} --repair"
        )
    plan = parse_plan(data, path)
    settings = Settings(
        count_workers(workers),
        resume_command,
        on_progress,
        repair=True,
        skip_failed=lacks_samples(LocalStore(path.absolute()), plan),
    )
    return restore(plan, path, settings, None if source is None else Path(source))


def restore(plan: Plan, path: Path, settings: Settings, source: Path | None = None) -> Summary:
    """Finish the data set in ``path`` from its plan alone; see ``repair`` and ``generate``."""
    from threadpoolctl import threadpool_limits

    from gen_data.runner.regeneration import plan_regeneration, refuse_changes
    from gen_data.runner.run import run

    made = plan_regeneration(path, plan, source)
    refuse_changes(path, made.changes, "repair it" if settings.repair else "finish it")
    with threadpool_limits(limits=1):
        return run(plan, made.make_pipeline, path, settings, made.licences)
