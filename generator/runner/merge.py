"""Parts of one data set that different machines generated, gathered in one folder."""

from collections.abc import Sequence
from pathlib import Path

from gen_data.core.errors import StorageError
from gen_data.exporters.image_files import link_or_copy
from gen_data.runner.durable_files import format_bytes, nearest_folder
from gen_data.runner.free_space import DOCUMENTS_BYTES, MARGIN, RESERVE_BYTES, full_disk
from gen_data.runner.numerics_guard import gather_numerics
from gen_data.runner.plan import Plan, compare_plans, load_plan, plan_bytes
from gen_data.runner.store import FolderState, LocalStore


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
        _check_space(plan, parts, store)
    with store.locked():
        store.prepare(plan)
        gather_numerics([LocalStore(part).run_dir for part in parts], store, allow_mixed_numerics)
        for part in parts:
            _gather(plan, LocalStore(part.absolute()), store)


def _check_space(plan: Plan, parts: Sequence[Path], store: LocalStore) -> None:
    """Refuse a disk that is too small for the shards that cannot be linked.

    Raises:
        StorageError: with the needed and the free space.
    """
    place = nearest_folder(store.root)
    copied = [LocalStore(part) for part in parts if not _is_same_disk(part, place)]
    records = {
        shard: record
        for part in copied
        for shard in range(plan.shard_count)
        if (record := part.record(shard)) and store.record(shard) is None
    }
    need = sum(record.size_bytes for record in records.values())
    if store.state(plan) is FolderState.NEW:
        need += 2 * len(plan_bytes(plan)) + DOCUMENTS_BYTES
    free = store.free_bytes()
    if free < MARGIN * need + RESERVE_BYTES:
        raise StorageError(
            f"{store.root}: the parts need about {format_bytes(need)} here and "
            f"{format_bytes(free)} are free.\n  Make room, or choose a folder on another disk "
            "with --out; on the disk of the parts, their files are linked"
        ) from full_disk()


def _is_same_disk(part: Path, place: Path) -> bool:
    return part.stat().st_dev == place.stat().st_dev


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
