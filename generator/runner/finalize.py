"""The last step: exporters merge all shards, then sums and manifest seal the data set.

Done again after a kill it gives the same bytes: nothing here is taken from an earlier attempt.
"""

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence

from gen_data.core.errors import SampleError, StorageError
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.serialization import canonical_json
from gen_data.runner import durable_files, error_context, layout, seal, shard_record
from gen_data.runner.data_card import (
    CARD_NAME,
    CROISSANT_NAME,
    DatasetFacts,
    croissant_json,
    data_card,
)
from gen_data.runner.plan import Plan, plan_bytes
from gen_data.runner.shard import PipelineLike
from gen_data.runner.store import LocalStore

LicencesOf = Callable[[Sequence[str]], str]
"""Formats the licences of the assets with these ids."""


def finalize(
    plan: Plan,
    store: LocalStore,
    pipeline: PipelineLike,
    licences: LicencesOf | None,
    expected: seal.Expectation,
) -> str:
    """Merge, summarise and seal a data set whose shards are all committed.

    Args:
        plan: Plan of the data set.
        store: Its folder.
        pipeline: For its exporters and facts.
        licences: Makes the text of ``LICENSES-ASSETS.md``; None = no such file.
        expected: Judges the files before they are sealed.

    Returns:
        Id of the data set; see ``seal.dataset_id``.

    Raises:
        StorageError: a shard is not committed, or a file cannot be written.
        SampleError: every sample failed.
        DeterminismError: the result is not as expected; nothing is sealed.
    """
    with store.errors():
        records = _all_records(plan, store)
        failed = [failure for record in records for failure in record.failed]
        if len(failed) == plan.n:
            raise SampleError(
                f"none of the {plan.n} samples could be made; sample {failed[0].index}: "
                f"{failed[0].stage}: {failed[0].error}\n"
                f"  Reproduce: {store.reproduce_command(failed[0].index)}"
            )
        names = sorted(pipeline.exporters)
        # Only exporters link files of shards; without any, the files may be elsewhere.
        known = _inodes(store, records) if names else {}
        for name in names:
            with error_context.explain_errors(f"exporter {name}, merging"), store.errors():
                _merge(records, store, pipeline, name, known)
        scratch = store.scratch_dir()
        documents = _documents(plan, store, pipeline, records, licences)
        for name, data in documents.items():
            store.replace_file(name, data, scratch)
        entries = [_entry_of_bytes(name, data) for name, data in documents.items()]
        record_bytes = [record.to_bytes() for record in records]
        entries += _entries(plan, store, records, record_bytes, names, known)
        entries.sort(key=_by_path)
        sums = seal.sums_text(entries)
        expected.expect(entries)
        folders = [
            f"{n}/{inner}" for n in names for inner in durable_files.empty_folders(store.root / n)
        ]
        manifest = _manifest(plan, pipeline.info, records, record_bytes, entries, folders)
        sealed = [*entries, _entry_of_bytes(layout.MANIFEST_NAME, manifest)]
        lines = seal.sums_text(sorted(sealed, key=_by_path))
        store.replace_file(layout.SUMS_NAME, lines.encode(), scratch)
        store.replace_file(layout.MANIFEST_NAME, manifest, scratch)
    return seal.dataset_id(sums)


def _all_records(plan: Plan, store: LocalStore) -> list[shard_record.ShardRecord]:
    records = []
    for shard in range(plan.shard_count):
        record = store.record(shard)
        if record is None:
            raise StorageError(f"{store.record_path(shard)}: vanished while the run was finishing")
        records.append(record)
    return records


def _inodes(
    store: LocalStore, records: list[shard_record.ShardRecord]
) -> dict[durable_files.Inode, str]:
    """Digests by inode: files that exporters hard-link are not hashed again."""
    folders = [(store.shard_dir(record.shard), record) for record in records]
    return {
        durable_files.get_inode(f"{folder}/{file.path}"): file.sha256
        for folder, record in folders
        for file in record.files
    }


def _merge(
    records: Sequence[shard_record.ShardRecord],
    store: LocalStore,
    pipeline: PipelineLike,
    name: str,
    known: Mapping[durable_files.Inode, str],
) -> None:
    """Let one exporter merge into a temporary folder, which then replaces the older one."""
    staging = store.scratch_dir()
    shard_dirs = [store.shard_dir(record.shard) for record in records if record.samples]
    pipeline.exporters[name].finalize(pipeline.info, shard_dirs, staging)
    durable_files.sync_tree(staging, synced=known)
    target = store.root / name
    if not any(staging.iterdir()):
        return
    if target.exists():
        durable_files.move_durably(target, store.scratch_dir() / name)
    durable_files.move_durably(staging, target)


def _documents(
    plan: Plan,
    store: LocalStore,
    pipeline: PipelineLike,
    records: list[shard_record.ShardRecord],
    licences: LicencesOf | None,
) -> dict[str, bytes]:
    """Files for readers at the root of the data set: licences, card and metadata."""
    used = sorted({asset for record in records for asset in record.assets})
    table = None if licences is None else licences(used)
    facts = DatasetFacts(
        plan,
        pipeline.info,
        shard_record.sum_counts(count for record in records for count in record.splits),
        sum(record.scenes for record in records),
        [name for name in pipeline.exporters if (store.root / name).is_dir()],
        table,
    )
    texts = {CARD_NAME: data_card(facts), CROISSANT_NAME: croissant_json(facts)}
    if table is not None:
        texts[layout.LICENCES_NAME] = table
    return {name: text.encode() for name, text in texts.items()}


def _entries(
    plan: Plan,
    store: LocalStore,
    records: list[shard_record.ShardRecord],
    record_bytes: list[bytes],
    exporters: list[str],
    known: Mapping[durable_files.Inode, str],
) -> Iterator[seal.Entry]:
    """Plan, records, files of shards and of exporters, in no particular order."""
    yield _entry_of_bytes(layout.PLAN_NAME, plan_bytes(plan))
    for record, data in zip(records, record_bytes, strict=True):
        folder = f"{layout.SHARDS_NAME}/{store.shard_dir(record.shard).name}"
        yield _entry_of_bytes(f"{folder}.json", data)
        for file in record.files:
            yield seal.Entry(f"{folder}/{file.path}", file.bytes, file.sha256)
    for name in exporters:
        for inner, size in durable_files.tree_sizes(store.root / name).items():
            path = f"{store.root}/{name}/{inner}"
            digest = known.get(durable_files.get_inode(path)) or durable_files.hash_file(path)
            yield seal.Entry(f"{name}/{inner}", size, digest)


def _manifest(
    plan: Plan,
    info: DatasetInfo,
    records: list[shard_record.ShardRecord],
    record_bytes: list[bytes],
    entries: list[seal.Entry],
    folders: list[str],
) -> bytes:
    """Contents of the manifest, without time, host, path or number of workers.

    ``folders`` are the empty folders outside of shards.
    """
    sized_by_records = {file.sha256 for record in records for file in record.files}
    manifest = {
        "format_version": plan.format_version,
        "dataset_id": seal.dataset_id(seal.sums_text(entries)),
        "name": plan.name,
        "seed": plan.seed,
        "n": plan.n,
        "shard_size": plan.shard_size,
        "info": info,
        "splits": shard_record.sum_counts(count for record in records for count in record.splits),
        "scenes": sum(record.scenes for record in records),
        "rejections": sum(record.rejections for record in records),
        "bytes": sum(record.size_bytes for record in records),
        "shards": [hashlib.sha256(data).hexdigest() for data in record_bytes],
        # Sizes of the files that equal no file of a shard.
        "files": {e.path: e.bytes for e in entries if e.sha256 not in sized_by_records},
        "empty_folders": folders,
        "versions": plan.versions,
    }
    failed = [failure for record in records for failure in record.failed]
    # Data sets that have every sample stay the same.
    return (canonical_json(manifest | ({"failed": failed} if failed else {})) + "\n").encode()


def _by_path(entry: seal.Entry) -> str:
    return entry.path


def _entry_of_bytes(path: str, data: bytes) -> seal.Entry:
    return seal.Entry(path, len(data), hashlib.sha256(data).hexdigest())
