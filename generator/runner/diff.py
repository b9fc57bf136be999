"""Comparison of two data sets, or of two folders of one shard."""

import filecmp
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from gen_data.core.errors import StorageError
from gen_data.runner import durable_files, labels, provenance, seal, shard_record, store
from gen_data.runner.layout import MANIFEST_NAME, PLAN_NAME, SHARDS_NAME
from gen_data.runner.plan import Plan, compare_plans, load_plan
from gen_data.runner.sample_stages import Difference, SampleFiles, compare_samples


@dataclass(frozen=True)
class Comparison:
    """Result of a comparison.

    Attributes:
        samples: Number of samples that both have.
        plan: Differences of the plans, one line per field.
        sample: The first difference of the first sample that differs.
        file: Path of the first other file that differs, written by an exporter.
    """

    samples: int
    plan: tuple[str, ...] = ()
    sample: Difference | None = None
    file: str = ""

    @property
    def equal(self) -> bool:
        """Whether all common samples and all exported files are equal."""
        return self.sample is None and not self.file


def compare(one: Path, other: Path, semantic: bool = False) -> Comparison:
    """Compare two data sets, or two folders of the same shard, such as a quarantined one.

    Args:
        one: A folder.
        other: A folder of the same kind.
        semantic: Compare contents only, not the bytes of encoded files.

    Raises:
        StorageError: a folder is neither, or a file cannot be read.
    """
    if (one / PLAN_NAME).is_file() and (other / PLAN_NAME).is_file():
        return _compare_datasets(one, other, semantic)
    for folder in (one, other):
        if not (folder / provenance.SCENES_NAME).is_file():
            raise StorageError(
                f"{folder}: no data set and no folder of a shard; expected two of the same kind"
            )
    indices = _indices(one)
    for index in indices:
        found = compare_samples(SampleFiles(one, index), SampleFiles(other, index), semantic)
        if found is not None:
            return Comparison(len(indices), sample=found)
    return Comparison(len(indices), file="" if semantic else _first_differing_file(one, other))


def _compare_datasets(one: Path, other: Path, semantic: bool) -> Comparison:
    plans = load_plan(one), load_plan(other)
    changes = tuple(compare_plans(*plans))
    n = min(plan.n for plan in plans)
    absent = [_failed(folder, plan) for folder, plan in zip((one, other), plans, strict=True)]
    for index in _samples_to_compare(one, other, plans, n):
        if index in absent[0] and index in absent[1]:
            continue
        if index in absent[0] or index in absent[1]:
            owner = other if index in absent[0] else one
            text = f"only {owner} has it; in the other it failed"
            return Comparison(n, changes, sample=Difference(index, "sample", text))
        files = [
            SampleFiles(store.LocalStore(folder).shard_dir(index // plan.shard_size), index)
            for folder, plan in zip((one, other), plans, strict=True)
        ]
        found = compare_samples(files[0], files[1], semantic)
        if found is not None:
            return Comparison(n, changes, sample=found)
    if semantic:
        return Comparison(n, changes)
    was, now = seal.read_sums(one).digests, seal.read_sums(other).digests
    for path in sorted({*was, *now}):
        exported = path.partition("/")[0] not in (SHARDS_NAME, PLAN_NAME, MANIFEST_NAME)
        differs = was.get(path) != now.get(path) or not _are_equal(one / path, other / path)
        if exported and differs:
            return Comparison(n, changes, file=path)
    return Comparison(n, changes)


def _samples_to_compare(one: Path, other: Path, plans: tuple[Plan, Plan], n: int) -> Iterator[int]:
    """Indices of the samples of the shards with different records or files."""
    if plans[0].shard_size != plans[1].shard_size:
        yield from range(n)
        return
    for shard in range(-(-n // plans[0].shard_size)):
        records = [store.LocalStore(folder).record(shard) for folder in (one, other)]
        folders = [store.LocalStore(folder).shard_dir(shard) for folder in (one, other)]
        if records[0] is None or records[0] != records[1] or _differ(records[0], *folders):
            yield from (i for i in plans[0].samples_of(shard) if i < n)


def _differ(record: shard_record.ShardRecord, one: Path, other: Path) -> bool:
    """Whether a file differs on the disk, although both records of its shard are equal."""
    return not all(_are_equal(one / file.path, other / file.path) for file in record.files)


def _first_differing_file(one: Path, other: Path) -> str:
    paths = sorted({*durable_files.tree_sizes(one), *durable_files.tree_sizes(other)})
    return next((path for path in paths if not _are_equal(one / path, other / path)), "")


def _are_equal(one: Path, other: Path) -> bool:
    if not one.is_file() or not other.is_file():
        return False
    # Exports link images to their shards: most pairs were read before, or are one file.
    return one.samefile(other) or filecmp.cmp(one, other, shallow=False)


def _failed(folder: Path, plan: Plan) -> set[int]:
    """Indices of the samples that a data set does not have."""
    records = filter(None, map(store.LocalStore(folder).record, range(plan.shard_count)))
    return {failure.index for record in records for failure in record.failed}


def _indices(folder: Path) -> list[int]:
    try:
        with (folder / labels.LABELS_NAME).open("rb") as file:
            return [int(json.loads(line)["index"]) for line in file]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise StorageError(f"{folder / labels.LABELS_NAME}: cannot be read ({error})") from None
