"""The last step: exporters merge all shards, then sums and manifest seal the data set.

Done again after a kill it gives the same bytes: nothing here is taken from an earlier attempt.
"""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from generator.core.errors import StorageError
from generator.core.interfaces import DatasetInfo
from generator.core.serial import canonical_json, to_plain
from generator.runner.files import (
    Inode,
    inode_of,
    move_durably,
    sha256_of_file,
    sync_tree,
    tree_sizes,
    write_durably,
)
from generator.runner.plan import PLAN_NAME, Plan, plan_bytes
from generator.runner.record import ShardRecord, summed
from generator.runner.shard import PipelineLike
from generator.runner.store import LICENCES_NAME, MANIFEST_NAME, SHARDS_NAME, SUMS_NAME, LocalStore
from generator.runner.unforeseen import explaining


@dataclass(frozen=True, slots=True)
class Entry:
    """One file of the data set as a whole; ``path`` is relative to its root."""

    path: str
    bytes: int
    sha256: str


def finalize(plan: Plan, store: LocalStore, pipeline: PipelineLike, licences: str) -> str:
    """Merge, sum up and seal a data set whose shards are all committed.

    Args:
        licences: Text of ``LICENSES-ASSETS.md``; empty = no such file.

    Returns:
        The data set's id: sha256 over its sums, of which ``dataset_id`` has the definition.

    Raises:
        StorageError: a shard is not committed, or a file cannot be written.
    """
    with store.errors():
        records = _all_records(plan, store)
        known = _inodes(store, records)
        names = sorted(pipeline.exporters)
        for name in names:
            with explaining(f"exporter {name}, merging"), store.errors():
                _merge(plan, store, pipeline, name, known)
        scratch = store.scratch_dir()
        _remove_other_exports(store, names)
        if licences:
            write_durably(store.root / LICENCES_NAME, licences.encode(), scratch)
        entries = sorted(_entries(plan, store, records, known), key=lambda entry: entry.path)
        sums = sums_text(entries)
        manifest = _manifest(plan, pipeline.info, records, entries)
        sealed = [*entries, _entry_of_bytes(MANIFEST_NAME, manifest)]
        lines = sums_text(sorted(sealed, key=lambda entry: entry.path))
        write_durably(store.root / SUMS_NAME, lines.encode(), scratch)
        write_durably(store.manifest_path, manifest, scratch)
    return dataset_id(sums)


def sums_text(entries: list[Entry]) -> str:
    """The format of ``sha256sum``."""
    return "".join(f"{entry.sha256}  {entry.path}\n" for entry in entries)


def dataset_id(sums: str) -> str:
    """Identity of a data set: sha256 of ``SHA256SUMS`` without the manifest's own line.

    ``grep -v '  manifest.json$' SHA256SUMS | sha256sum`` prints it.
    """
    return hashlib.sha256(sums.encode()).hexdigest()


def _all_records(plan: Plan, store: LocalStore) -> list[ShardRecord]:
    records = []
    for shard in range(plan.shard_count):
        record = store.record(shard)
        if record is None:
            raise StorageError(f"{store.record_path(shard)}: vanished while the run was finishing")
        records.append(record)
    return records


def _inodes(store: LocalStore, records: list[ShardRecord]) -> dict[Inode, str]:
    """Digests by inode: what exporters hard-link need not be hashed again."""
    return {
        inode_of(store.shard_dir(record.shard) / file.path): file.sha256
        for record in records
        for file in record.files
    }


def _merge(
    plan: Plan, store: LocalStore, pipeline: PipelineLike, name: str, known: Mapping[Inode, str]
) -> None:
    """Let one exporter merge into a folder aside, then put that in place of an older one."""
    staging = store.scratch_dir()
    shard_dirs = [store.shard_dir(shard) for shard in range(plan.shard_count)]
    pipeline.exporters[name].finalize(pipeline.info, shard_dirs, staging)
    sync_tree(staging, synced=known)
    target = store.root / name
    if target.exists():
        move_durably(target, store.scratch_dir() / name)
    move_durably(staging, target)


def _remove_other_exports(store: LocalStore, names: list[str]) -> None:
    """Take away what an earlier release's exporter may have left: it would be an extra file."""
    ours = {*names, "run", SHARDS_NAME}
    for path in sorted(store.root.iterdir()):
        if path.is_dir() and path.name not in ours:
            shutil.rmtree(path)


def _entries(
    plan: Plan, store: LocalStore, records: list[ShardRecord], known: Mapping[Inode, str]
) -> Iterator[Entry]:
    yield _entry_of_bytes(PLAN_NAME, plan_bytes(plan))
    if (store.root / LICENCES_NAME).exists():
        yield _entry_of_bytes(LICENCES_NAME, (store.root / LICENCES_NAME).read_bytes())
    for record in records:
        prefix = store.shard_dir(record.shard).relative_to(store.root).as_posix()
        yield _entry_of_bytes(f"{prefix}.json", record.to_bytes())
        for file in record.files:
            yield Entry(f"{prefix}/{file.path}", file.bytes, file.sha256)
    for folder in sorted(store.root.iterdir()):
        if folder.is_dir() and folder.name not in ("run", SHARDS_NAME):
            for name, size in tree_sizes(folder).items():
                path = folder / name
                digest = known.get(inode_of(path)) or sha256_of_file(path)
                yield Entry(f"{folder.name}/{name}", size, digest)


def _entry_of_bytes(path: str, data: bytes) -> Entry:
    return Entry(path, len(data), hashlib.sha256(data).hexdigest())
