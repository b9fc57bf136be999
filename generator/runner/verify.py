"""Verification of a finished data set against its manifest."""

import hashlib
import re
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from gen_data.core.errors import StorageError, VerificationError, no_folder
from gen_data.runner.durable_files import (
    IRREGULAR,
    Contents,
    Inode,
    format_bytes,
    get_inode,
    hash_file,
    scan_tree,
)
from gen_data.runner.layout import (
    CERTIFICATE_NAMES,
    MANIFEST_NAME,
    PLAN_NAME,
    RUN_NAME,
    SHARDS_NAME,
    SUMS_NAME,
    record_path,
    shard_path,
)
from gen_data.runner.plan import Plan, load_plan
from gen_data.runner.seal import parse_object, read_or_empty, read_sums
from gen_data.runner.shard_record import ShardRecord, parse_unchecked_record

SAMPLE_NAME = re.compile(r"(?:^|[/_])(\d{6,9})[._]")
SHARD_PATH = re.compile(rf"{SHARDS_NAME}/(\d+)[/.]")
SHOWN_MAX = 50
REPAIRABLE = frozenset({"missing", "extra", "size", "digest", "inconsistent"})
"""Kinds of deviations from the manifest."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One deviation from the manifest.

    Attributes:
        kind: ``missing``, ``extra``, ``size``, ``digest`` or ``inconsistent``; of samples
            ``invalid``, ``unreadable`` or ``irreproducible`` (see ``deep_verify``).
        path: Relative to the data set's root.
        text: Description of the deviation.
        samples: Affected samples, in words; empty = all or none.
    """

    kind: str
    path: str
    text: str
    samples: str = ""

    def __str__(self) -> str:
        """One line for a user."""
        where = f" ({self.samples})" if self.samples else ""
        return f"{self.path}{where}: {self.text}"


@dataclass(frozen=True, slots=True)
class Report:
    """Result for a data set without deviations.

    Attributes:
        full: Every file was hashed, instead of comparing sizes.
    """

    dataset_id: str
    samples: int
    files: int
    bytes: int
    full: bool

    def __str__(self) -> str:
        """One line for a user."""
        depth = "every sha256 equal" if self.full else "sizes and records equal"
        return (
            f"{self.samples} samples, {self.files} files, {format_bytes(self.bytes)} with linked "
            f"files: {depth}; id {self.dataset_id[:16]}"
        )


def verify(folder: Path, full: bool = False) -> Report:
    """Check a data set against its manifest.

    With ``full``, every file is hashed; otherwise sizes, records and sums are compared.

    Raises:
        VerificationError: the folder has no finished data set, or deviations, which it lists.
    """
    contents = scan_finished(folder)
    report = summarize(folder, full, contents)
    found = find_deviations(folder, full, contents)
    if found:
        raise VerificationError(describe_findings(folder, found))
    return report


def check_source(folder: Path) -> None:
    """Refuse a data set whose plan, records, sums or sizes disagree, before another is made of it.

    Files that do not belong to it do no harm.

    Raises:
        StorageError: the deviations, with the command that repairs them.
    """
    found = [finding for finding in find_deviations(folder) if finding.kind != "extra"]
    if found:
        raise StorageError(describe_findings(folder, found))


def scan_finished(folder: Path) -> Contents:
    """Files and empty folders of a data set, without ``run`` and certificates.

    Raises:
        StorageError: there is no such folder.
        VerificationError: it has no finished data set.
    """
    if not folder.exists():
        raise StorageError(no_folder(folder))
    if not (folder / MANIFEST_NAME).is_file():
        raise VerificationError(
            f"{folder}: not a finished data set: {MANIFEST_NAME} is missing. "
            "The command that started it finishes it."
        )
    return _scan(folder)


def _scan(folder: Path) -> Contents:
    sizes, empty = scan_tree(folder, without=RUN_NAME)
    return {n: size for n, size in sizes.items() if n not in CERTIFICATE_NAMES}, empty


def summarize(folder: Path, full: bool = False, contents: Contents | None = None) -> Report:
    """Sizes of a data set, with ``full`` as in ``verify``; ``contents`` saves a scan.

    Raises:
        VerificationError: the folder has no finished data set.
    """
    sizes, _ = contents or scan_finished(folder)
    manifest = parse_object(read_or_empty(folder / MANIFEST_NAME)) or {}
    identity, n = str(manifest.get("dataset_id", "")), manifest.get("n", 0)
    return Report(
        identity, n - len(manifest.get("failed", ())), len(sizes), sum(sizes.values()), full
    )


def describe_findings(folder: Path, found: Sequence[Finding]) -> str:
    """Message that lists deviations, with the command that repairs them."""
    listed = "\n".join(f"  {finding}" for finding in found[:SHOWN_MAX])
    more = f"\n  and {len(found) - SHOWN_MAX} more" if len(found) > SHOWN_MAX else ""
    damaged = any(finding.kind in REPAIRABLE for finding in found)
    remedy = f"\n  Repair: gen-data repair {shlex.quote(str(folder))}" if damaged else ""
    return f"{folder}: {len(found)} deviation(s):\n{listed}{more}{remedy}"


def find_deviations(
    folder: Path,
    full: bool = False,
    contents: Contents | None = None,
    digests: Mapping[str, str] | None = None,
) -> list[Finding]:
    """Find all deviations, in order of discovery.

    ``contents`` saves a scan. With ``digests``, ``{path: sha256}``, no file is hashed: the folder
    may be an outline (see ``copy_outline``).
    """
    try:
        plan = load_plan(folder)
    except StorageError as error:
        return [Finding("inconsistent", PLAN_NAME, str(error).partition("\n")[0])]
    return list(_Check(folder, plan, contents, digests).run(full))


def _is_manifest(value: Mapping[str, Any]) -> bool:
    """Whether an object has a manifest's parts; another file's object may be in its place."""
    return (
        isinstance(value.get("shards"), list)
        and isinstance(value.get("files"), dict)
        and isinstance(value.get("empty_folders", []), list)
    )


class _Check:
    """Comparison of the declared with the existing files of a data set."""

    def __init__(
        self, folder: Path, plan: Plan, contents: Contents | None, digests: Mapping[str, str] | None
    ) -> None:
        self._contents = contents
        self._digests = digests
        self._folder = folder
        self._plan = plan
        self._sums: Mapping[str, str] = {}
        self._sizes: dict[str, int] = {}
        self._empty_folders: set[str] = set()
        self._hashed: dict[Inode, str] = {}

    def run(self, full: bool) -> Iterator[Finding]:
        manifest_bytes = read_or_empty(self._folder / MANIFEST_NAME)
        manifest = parse_object(manifest_bytes)
        if manifest is None or not _is_manifest(manifest):
            yield Finding("inconsistent", MANIFEST_NAME, "is not a manifest")
            return
        yield from self._read_sums(manifest, manifest_bytes)
        yield from self._read_sizes(manifest)
        actual, empty = self._contents or _scan(self._folder)
        for path in sorted({*self._sums, *actual} - {SUMS_NAME}):
            yield from self._compare(path, actual.get(path), full)
        # Format version 1 does not say which folders are empty.
        if "empty_folders" in manifest:
            yield from self._compare_folders(manifest["empty_folders"], set(empty))

    def _compare_folders(self, merged: Iterable[str], actual: set[str]) -> Iterator[Finding]:
        declared = {*self._empty_folders, *merged}
        for path in sorted(declared ^ actual):
            finding = partial(Finding, path=path, samples=self._samples_of(path))
            if path in actual:
                yield finding("extra", text="is an empty folder that does not belong here")
            else:
                yield finding("missing", text="is missing, or no empty folder any more")

    def _read_sums(self, manifest: dict[str, Any], manifest_bytes: bytes) -> Iterator[Finding]:
        finding = partial(Finding, "inconsistent", SUMS_NAME)
        sums = read_sums(self._folder)
        self._sums = sums.digests
        if sums.damaged:
            yield finding("a line is damaged or double")
        own = self._sums.get(MANIFEST_NAME)
        if own != hashlib.sha256(manifest_bytes).hexdigest():
            yield Finding("digest", MANIFEST_NAME, f"its sha256 is not the one in {SUMS_NAME}")
        if manifest.get("dataset_id") != sums.dataset_id:
            yield finding(f"does not belong to {MANIFEST_NAME}: its sha256 is not dataset_id")

    def _read_sizes(self, manifest: dict[str, Any]) -> Iterator[Finding]:
        """Collect declared sizes: from records, from the manifest, and by equal digest."""
        by_digest: dict[str, int] = {}
        digests = manifest.get("shards", [])
        if len(digests) != self._plan.shard_count:
            yield Finding("inconsistent", MANIFEST_NAME, "number of shards is not the plan's")
        for shard, digest in enumerate(digests[: self._plan.shard_count]):
            place = record_path(self._folder, shard)
            path = f"{SHARDS_NAME}/{place.name}"
            data = read_or_empty(place)
            record = parse_unchecked_record(data)
            if record is None or hashlib.sha256(data).hexdigest() != digest:
                # One that is missing is found among the files of SHA256SUMS.
                if place.is_file():
                    text = "its sha256 is not the one in the manifest"
                    yield Finding("digest", path, text, self._samples_of(path))
                continue
            yield from self._compare_record(shard, record)
            by_digest.update({file.sha256: file.bytes for file in record.files})
        declared = manifest.get("files", {})
        for path, digest in self._sums.items():
            size = declared.get(path, by_digest.get(digest))
            if size is not None:
                self._sizes.setdefault(path, size)

    def _compare_record(self, shard: int, record: ShardRecord) -> Iterator[Finding]:
        folder = f"{SHARDS_NAME}/{shard_path(self._folder, shard).name}"
        self._empty_folders.update(f"{folder}/{inner}" for inner in record.empty_folders)
        for file in record.files:
            path = f"{folder}/{file.path}"
            self._sizes[path] = file.bytes
            if self._sums.get(path) != file.sha256:
                text = f"{SUMS_NAME} and the shard's record disagree"
                yield Finding("inconsistent", path, text, self._samples_of(path))

    def _compare(self, path: str, size: int | None, full: bool) -> Iterator[Finding]:
        finding = partial(Finding, path=path, samples=self._samples_of(path))
        if path not in self._sums:
            yield finding("extra", text="does not belong to the data set")
        elif size is None:
            yield finding("missing", text="is missing")
        elif size == IRREGULAR:
            yield finding("size", text="is not a regular file")
        elif size != self._sizes.get(path, size):
            yield finding("size", text=f"has {size} bytes instead of {self._sizes[path]}")
        elif (full or path == PLAN_NAME) and self._digest(path) != self._sums[path]:
            yield finding("digest", text="its bytes differ (sha256)")

    def _digest(self, path: str) -> str:
        """SHA-256 of a file; hard links to one file are read once."""
        if self._digests is not None:
            return self._digests.get(path, "")
        inode = get_inode(self._folder / path)
        if inode not in self._hashed:
            self._hashed[inode] = hash_file(self._folder / path)
        return self._hashed[inode]

    def _samples_of(self, path: str) -> str:
        shard = SHARD_PATH.match(path)
        named = SAMPLE_NAME.search(path[shard.end() :] if shard else path)
        if named:
            return f"sample {int(named[1])}"
        if shard and int(shard[1]) < self._plan.shard_count:
            indices = self._plan.samples_of(int(shard[1]))
            return f"samples {indices.start} to {indices.stop - 1}"
        return ""
