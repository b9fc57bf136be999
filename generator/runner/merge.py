"""Parts of one data set that different machines generated, gathered in one folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gen_data.exporters.image_files import link_or_copy
from gen_data.generator.core.errors import StorageError
from gen_data.generator.runner.numerics_guard import gather_numerics
from gen_data.generator.runner.plan import Plan, compare_plans, load_plan
from gen_data.generator.runner.store import LocalStore


def common_plan(parts: Sequence[Path]) -> Plan:
    """The plan of all parts.

    Raises:
        StorageError: a folder holds no data set, or one of another plan.
    """
    plan = load_plan(parts[0])
    for part in parts[1:]:
        differences = compare_plans(plan, load_plan(part))
        if differences:
            raise StorageError(
                f"{part}: holds a part of another data set than {parts[0]}: {differences[0]}; "
                "expected parts made with the same configuration, seed and --n"
            )
    return plan


def gather_shards(
    plan: Plan, parts: Sequence[Path], store: LocalStore, allow_mixed_numerics: bool
) -> None:
    """Commit the shards of all parts to ``store``; files are linked where the disk is the same.

    Shards that several parts have must be equal. The parts stay as they are.

    Raises:
        DeterminismError: two parts have the same shard with different bytes.
        NumericsError: the parts come from machines that compute differently.
        StorageError: the folder of ``store`` holds another data set or cannot be written.
    """
    with store.errors():
        store.state(plan)
    with store.locked():
        store.prepare(plan)
        gather_numerics([LocalStore(part).run_dir for part in parts], store, allow_mixed_numerics)
        for part in parts:
            _gather(plan, LocalStore(part.absolute()), store)


def _gather(plan: Plan, part: LocalStore, store: LocalStore) -> None:
    for shard in range(plan.shard_count):
        record = part.record(shard)
        if record is None:
            continue
        if not all((part.shard_dir(shard) / file.path).exists() for file in record.files):
            # A shard that is not whole is generated, as one that no part has.
            continue
        with store.errors():
            folder = store.scratch_dir()
            for file in record.files:
                target = folder / file.path
                target.parent.mkdir(parents=True, exist_ok=True)
                link_or_copy(part.shard_dir(shard) / file.path, target)
            for inner in record.empty_folders:
                (folder / inner).mkdir(parents=True, exist_ok=True)
        store.commit(folder, record)
