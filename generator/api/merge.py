"""One data set of parts that different machines generated: the function behind ``merge``."""

from collections.abc import Callable, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from gen_data.api import label_gaps, repair
from gen_data.api.config import count_workers
from gen_data.core.errors import ConfigError

if TYPE_CHECKING:
    from gen_data.runner.progress import RunProgress, Summary


def merge(
    parts: Sequence[str | PathLike[str]],
    out: str | PathLike[str],
    *,
    workers: int | None = None,
    allow_mixed_numerics: bool = False,
    on_progress: "Callable[[RunProgress], None] | None" = None,
    resume_command: str = "the same call of merge",
) -> "Summary":
    """Gather parts made by ``generate(..., shards=...)`` into one data set, and finish it.

    The result has the same bytes as a data set that one machine generated. Shards that no part has
    are generated. Files are linked where ``out`` is on the same file system, else copied.

    Args:
        parts: Folders with the same plan; they stay as they are.
        out: Folder of the data set.
        workers: Processes for missing shards; None = one per core, 0 = this process.
        allow_mixed_numerics: Accept parts of machines that compute differently.
        on_progress: Called after each sample and shard.
        resume_command: Command that error messages give for resuming.

    Raises:
        ConfigError: no parts are given.
        StorageError: a part belongs to another data set, or ``out`` cannot be written.
        NumericsError: the parts come from machines that compute differently.
        DeterminismError: two parts have the same shard with different bytes.
    """
    from gen_data.runner.merge import common_plan, gather_shards
    from gen_data.runner.run import Settings
    from gen_data.runner.store import LocalStore

    folders = [Path(part) for part in parts]
    if not folders:
        raise ConfigError("parts: none are given; expected the folders made with --shards")
    target = Path(out)
    plan = common_plan(folders)
    store = LocalStore(target.absolute(), resume_command)
    gather_shards(plan, folders, store, allow_mixed_numerics)
    settings = Settings(
        count_workers(workers),
        resume_command,
        on_progress,
        allow_mixed_numerics=allow_mixed_numerics,
    )
    summary = repair.restore(plan, target, settings)
    return label_gaps.check_label_gaps(summary)
