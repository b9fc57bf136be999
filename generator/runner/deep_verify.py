"""Verification beyond checksums: every sample decoded and checked, some generated again.

Checksums find changes after a data set was sealed. These checks find earlier faults: invalid
labels, and samples that this installation would generate differently.
"""

import json
import secrets
from collections.abc import Iterator, Sequence
from pathlib import Path

from gen_data.annotations.sample_checks import sample_faults
from gen_data.core.errors import GenDataError
from gen_data.runner import labels, layout, provenance, verify
from gen_data.runner.plan import load_plan
from gen_data.runner.regeneration import compare_regenerated, plan_regeneration
from gen_data.runner.store import LocalStore
from gen_data.runner.stored import StoredSamples


def find_invalid_samples(folder: Path) -> Iterator[verify.Finding]:
    """Decode every sample of a finished data set, and check it as before it was written.

    Raises:
        StorageError: the folder holds no finished data set.
    """
    stored = StoredSamples(folder)
    for shard in range(stored.plan.shard_count):
        yield from _lax_json(stored, shard)
        absent = {failure.index for failure in stored.failed}
        for index in (i for i in stored.plan.samples_of(shard) if i not in absent):
            where = f"{layout.SHARDS_NAME}/{stored.shard_dir(shard).name}"
            samples = f"sample {index}"
            try:
                for field, fact in sample_faults(stored.info, stored.sample(index)):
                    yield verify.Finding("invalid", where, f"{field}: {fact}", samples)
            except GenDataError as error:
                yield verify.Finding("unreadable", where, str(error), samples)
            except (ValueError, KeyError, TypeError, IndexError) as error:
                text = f"does not fit the data set ({type(error).__name__}: {error})"
                yield verify.Finding("unreadable", where, text, samples)
        stored.close()


def _lax_json(stored: StoredSamples, shard: int) -> Iterator[verify.Finding]:
    """Lines that are not strict JSON: Python also reads NaN and Infinity."""

    def refuse(name: str) -> None:
        raise ValueError(f"{name} is not JSON")

    for name in (provenance.SCENES_NAME, labels.LABELS_NAME):
        path = stored.shard_dir(shard) / name
        lines = path.read_bytes().splitlines() if path.is_file() else []
        for number, line in enumerate(lines, 1):
            # Most lines have neither word, and need not be parsed once more.
            if b"NaN" not in line and b"Infinity" not in line:
                continue
            try:
                json.loads(line, parse_constant=refuse)
            except ValueError as error:
                where = path.relative_to(stored.folder).as_posix()
                yield verify.Finding("invalid", where, f"line {number}: {error}")


def choose_samples(folder: Path, count: int) -> list[int]:
    """Indices of ``count`` samples, or of all that exist if there are fewer; ascending.

    They are others every time: repeated verification covers more and more of the data set.

    Raises:
        StorageError: the plan is missing or damaged.
    """
    plan, store = load_plan(folder), LocalStore(folder)
    records = filter(None, map(store.record, range(plan.shard_count)))
    absent = {failure.index for record in records for failure in record.failed}
    if count >= plan.n - len(absent):
        return [index for index in range(plan.n) if index not in absent]
    chosen: set[int] = set()
    while len(chosen) < count:
        chosen |= {secrets.randbelow(plan.n)} - absent
    return sorted(chosen)


def find_irreproducible_samples(
    folder: Path, indices: Sequence[int], semantic: bool = False, source: Path | None = None
) -> Iterator[verify.Finding]:
    """Generate samples again, and compare them with the stored ones.

    Args:
        folder: A data set; unfinished ones need the shards of the samples.
        indices: Indices of the samples.
        semantic: Compare decoded contents, not bytes: other releases of encoders are equal then.
        source: See ``plan_regeneration``.

    Raises:
        GenDataError: see ``plan_regeneration`` and ``compare_regenerated``.
    """
    plan = load_plan(folder)
    regeneration = plan_regeneration(folder, plan, source)
    store = LocalStore(folder)
    found = compare_regenerated(store, plan, regeneration, indices, semantic)
    for difference in found:
        where = f"{layout.SHARDS_NAME}/{store.shard_dir(difference.index // plan.shard_size).name}"
        text = f"generated again, it differs in stage {difference.stage}: {difference.text}"
        if regeneration.changes:
            text += f" (this installation differs: {'; '.join(regeneration.changes[:3])})"
        yield verify.Finding("irreproducible", where, text, f"sample {difference.index}")
