"""Admission of machines to a data set: all of them must compute alike.

``run/numerics.json`` has one line per class of machines that generated samples. It is not part of
the data set, which is identified by its contents, not by its machines.
"""

from __future__ import annotations

import json
import platform
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from gen_data.core import errors, serialization
from gen_data.runner.durable_files import write_durably
from gen_data.runner.seal import read_or_empty

if TYPE_CHECKING:
    from gen_data.runner.shard import EnteredPipeline, Job, PipelineLike
    from gen_data.runner.store import LocalStore

NUMERICS_NAME = "numerics.json"


def admit_numerics(job: Job, pipeline: PipelineLike) -> None:
    """Compare this process with the one that began the data set; the first one is recorded.

    Pipelines without ``numerics``, such as pipelines of exports, compute nothing that could differ.

    Raises:
        NumericsError: its results differ, and the job does not allow that.
    """
    compute = getattr(pipeline, "numerics", None)
    if compute is None:
        return
    digests: Mapping[str, str] = compute()
    entry = {"digests": dict(digests), "machine": platform.machine(), "processor": processor_name()}
    line = (serialization.canonical_json(entry) + "\n").encode()
    with job.store.errors():
        job.store.create_run_file(NUMERICS_NAME, line)
        known = _parse(job.store.read_run_file(NUMERICS_NAME))
        if not known or any(dict(digests) == one.get("digests") for one in known):
            return
        if not job.allow_mixed_numerics:
            raise errors.NumericsError(_describe(known[0], entry))
        job.store.append_run_file(NUMERICS_NAME, line)


def is_admitted(store: LocalStore, make_pipeline: Callable[[], EnteredPipeline]) -> bool:
    """Whether this process computes like one that generated a data set, or none is known."""
    known = _parse(store.read_run_file(NUMERICS_NAME))
    with make_pipeline() as pipeline:
        compute = getattr(pipeline, "numerics", None)
        digests = None if compute is None else dict(compute())
    return not known or any(digests == one.get("digests") for one in known)


def gather_numerics(run_dirs: Sequence[Path], store: LocalStore, allow_mixed: bool) -> None:
    """Record the classes of machines of all parts of a data set, given their ``run`` folders.

    Raises:
        NumericsError: there is more than one class, and ``allow_mixed`` is not set.
    """
    classes: dict[str, dict[str, object]] = {}
    for folder in run_dirs:
        for entry in _parse(read_or_empty(folder / NUMERICS_NAME)):
            classes.setdefault(serialization.canonical_json(entry.get("digests")), entry)
    entries = list(classes.values())
    if len(entries) > 1 and not allow_mixed:
        raise errors.NumericsError(_describe(entries[0], entries[1]))
    lines = "".join(serialization.canonical_json(entry) + "\n" for entry in entries)
    if lines:
        with store.errors():
            write_durably(store.run_dir / NUMERICS_NAME, lines.encode(), store.scratch_root)


def processor_name() -> str:
    """Model of the processor; empty if unknown."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(": ")[2] for line in lines if line.startswith("model name")), "")


def _parse(data: bytes) -> list[dict[str, object]]:
    """Entries of the file; none if it is damaged, as it guards nothing then."""
    try:
        rows = [json.loads(line) for line in data.decode().splitlines()]
    except ValueError:
        return []
    return [row for row in rows if isinstance(row, dict)]


def _describe(first: Mapping[str, object], entry: Mapping[str, object]) -> str:
    was, now = first.get("digests"), entry["digests"]
    assert isinstance(now, dict)
    known = was if isinstance(was, dict) else {}
    kinds = ", ".join(sorted(k for k in {*known, *now} if known.get(k) != now.get(k)))
    return (
        f"this machine computes differently from the one that began the data set ({kinds}): "
        f"processor was '{first.get('processor', '')}', now '{entry['processor']}'.\n"
        "  Its samples would differ in their last bits: the data set could not be made "
        "again on one machine.\n"
        "  Resume on a machine of the first kind, or accept that with --allow-mixed-numerics"
    )
