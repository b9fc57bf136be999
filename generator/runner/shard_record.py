"""Records of committed shards; the existence of its record *is* the commit of a shard.

A record ends in a checksum of itself: its digests decide whether files are damaged; a damaged
record must be found before any comparison with it.
"""

import hashlib
import json
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from gen_data.core import path_names, scene_assets, serialization
from gen_data.core.errors import StorageError
from gen_data.core.sample import Sample
from gen_data.runner.durable_files import (
    IRREGULAR,
    Inode,
    empty_folders,
    get_inode,
    hash_file,
    tree_sizes,
)
from gen_data.runner.failed_sample import FailedSample


@dataclass(frozen=True, slots=True)
class FileRecord:
    """One file of a shard; ``path`` is relative to the shard's folder."""

    path: str
    bytes: int
    sha256: str

    def __post_init__(self) -> None:
        """Refuse a path that leaves the shard's folder: records may come from elsewhere."""
        path_names.check_inner_path(self.path)


@dataclass(frozen=True, slots=True)
class SplitCount:
    """Numbers of samples and of visible annotated objects by category in a split."""

    split: str
    samples: int
    objects: Mapping[str, int]


@dataclass(frozen=True, slots=True)
class ShardRecord:
    """Contents of one shard.

    Attributes:
        first, end: Sample indices ``first <= i < end``.
        scenes: Scenes whose first view lies in this shard.
        rejections: Layouts rejected before these scenes were accepted.
        splits: Counts, sorted by split.
        assets: Ids of all objects, robots, textures and environments in its samples, sorted.
        files: Sorted by path.
        empty_folders: Folders without any file, relative to the shard's folder, sorted.
        failed: Samples that the shard does not have, by index; left out of the file if none.
    """

    shard: int
    first: int
    end: int
    scenes: int
    rejections: int
    splits: tuple[SplitCount, ...]
    assets: tuple[str, ...]
    files: tuple[FileRecord, ...]
    empty_folders: tuple[str, ...] = ()
    failed: tuple[FailedSample, ...] = field(default=(), metadata={serialization.SPARSE: True})

    def __post_init__(self) -> None:
        """Refuse folders outside the shard's folder."""
        for folder in self.empty_folders:
            path_names.check_inner_path(folder)

    @property
    def samples(self) -> int:
        """Number of its samples."""
        return self.end - self.first - len(self.failed)

    @property
    def sha256(self) -> str:
        """SHA-256 of its file."""
        return hashlib.sha256(self.to_bytes()).hexdigest()

    def sha256_of(self, path: str) -> str:
        """SHA-256 of a file of the shard; empty if there is none."""
        return next((file.sha256 for file in self.files if file.path == path), "")

    @property
    def size_bytes(self) -> int:
        """Size of all its files."""
        return sum(file.bytes for file in self.files)

    def to_bytes(self) -> bytes:
        """Contents of the record's file: one line of canonical JSON.

        Its ``sha256`` is computed from the same line without that entry.
        """
        plain = serialization.to_plain(self)
        checksum = hashlib.sha256(serialization.canonical_json(plain).encode()).hexdigest()
        return (serialization.canonical_json({**plain, "sha256": checksum}) + "\n").encode()


def parse_record(data: bytes) -> ShardRecord | None:
    """Parse the bytes of a record; None if a single bit of them is damaged."""
    record = parse_unchecked_record(data)
    return record if record is not None and record.to_bytes() == data else None


def parse_unchecked_record(data: bytes) -> ShardRecord | None:
    """Parse the bytes of a record whose digest is known otherwise; None if they are not a record.

    A record with a path outside its shard's folder is none.

    Records of format version 1 have no checksum; the manifest of a finished data set has their
    digests.
    """
    try:
        plain = json.loads(data)
        plain.pop("sha256", None)
        return serialization.from_plain(ShardRecord, plain)
    except (ValueError, TypeError, KeyError, AttributeError):
        return None


def describe_shard(
    shard: int,
    indices: range,
    samples: Iterable[Sample],
    folder: Path,
    known: Mapping[Inode, str] = MappingProxyType({}),
    failed: tuple[FailedSample, ...] = (),
) -> ShardRecord:
    """Make the record of a finished shard folder; hashes every file of unknown digest.

    ``known`` are digests by inode, of files that are linked from a committed shard; ``failed`` are
    the samples of the shard that could not be made, by index.

    Raises:
        StorageError: the folder contains something other than regular files and folders.
    """
    scenes, rejections = 0, 0
    counts = []
    assets: set[str] = set()
    for sample in samples:
        assets |= scene_assets.assets_in(sample.scene)
        if sample.view_index == 0 and sample.step_index == 0:
            scenes += 1
            rejections += sample.attempts - 1
        counts.append(_count(sample))
    sizes = tree_sizes(folder)
    irregular = [path for path, size in sizes.items() if size == IRREGULAR]
    if irregular:
        raise StorageError(
            f"shard {shard}: {irregular[0]} is not a regular file; exporters must write files"
        )
    try:
        files = tuple(
            FileRecord(path, size, _digest(f"{folder}/{path}", known))
            for path, size in sizes.items()
        )
    except ValueError as error:
        raise StorageError(f"shard {shard}: {error}; exporters must write such files") from None
    return ShardRecord(
        shard,
        indices.start,
        indices.stop,
        scenes,
        rejections,
        sum_counts(counts),
        tuple(sorted(assets)),
        files,
        empty_folders(folder),
        failed,
    )


def _digest(path: str, known: Mapping[Inode, str]) -> str:
    digest = known.get(get_inode(path)) if known else None
    return digest or hash_file(path)


def sum_counts(counts: Iterable[SplitCount]) -> tuple[SplitCount, ...]:
    """Sum counts by split, sorted by split and category."""
    samples: Counter[str] = Counter()
    objects: dict[str, Counter[str]] = {}
    for count in counts:
        samples[count.split] += count.samples
        objects.setdefault(count.split, Counter()).update(count.objects)
    return tuple(
        SplitCount(split, samples[split], dict(sorted(objects[split].items())))
        for split in sorted(samples)
    )


def _count(sample: Sample) -> SplitCount:
    objects = Counter(
        seen.instance.category
        for truth in sample.truth.values()
        for seen in truth.objects
        if seen.instance.annotated and seen.visible_px > 0
    )
    return SplitCount(sample.split, 1, objects)
