"""How far a run is, what it cost, and its log: for people, never for a data file."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from gen_data.generator.core.errors import GenDataError, StorageError
from gen_data.generator.core.serialization import canonical_json
from gen_data.generator.runner.durable_files import free_bytes
from gen_data.generator.runner.worker_events import (
    Action,
    Event,
    Exited,
    Note,
    SampleDone,
    ShardDone,
    Spawn,
)

if TYPE_CHECKING:
    from gen_data.generator.runner.store import LocalStore, Scan

FREE_SPACE_MARGIN = 1.05


@dataclass(frozen=True, slots=True)
class RunProgress:
    """Where a run is.

    Attributes:
        phase: ``samples`` or ``merging``.
        done: Samples that exist, those of earlier runs and of unfinished shards included.
        total: Samples of the data set.
        samples_per_s: Over this run; 0 until the first sample.
        rejections: Layouts refused so far, in committed shards.
        workers: Processes alive; 0 = in this process.
    """

    phase: str
    done: int
    total: int
    samples_per_s: float
    rejections: int
    workers: int


@dataclass(frozen=True)
class Summary:
    """What a run did.

    Attributes:
        samples: Samples of the data set.
        made: Samples made by this run; the others were there. Work done twice after a crash
            counts once.
        seconds: Wall-clock time of this run.
        rejections: Layouts refused, over the whole data set.
        bytes: Size of all shards.
        cpu_s: Mean CPU seconds per sample by stage, over this run.
        worker_deaths: Processes that ended unexpectedly.
        rss_bytes_max: Largest memory of a worker after a shard; 0 if unknown.
        folder: Of the data set; empty in the run's log.
    """

    dataset_id: str
    samples: int
    made: int
    seconds: float
    rejections: int
    bytes: int
    cpu_s: Mapping[str, float] = field(default_factory=dict)
    worker_deaths: int = 0
    rss_bytes_max: int = 0
    already_complete: bool = False
    folder: str = ""

    @property
    def samples_per_s(self) -> float:
        """Samples of this run per second of it."""
        return self.made / self.seconds if self.seconds > 0 else 0.0

    def rows(self) -> list[tuple[str, str]]:
        """Names and values, for a table."""
        if self.already_complete:
            return [
                (
                    "samples",
                    f"{self.samples} (all there, nothing to do; --repair compares every byte)",
                ),
                ("id", self.dataset_id[:16]),
            ]
        rows = [
            ("samples", _with_note(str(self.samples), self.samples - self.made, "from before")),
            ("time", f"{self.seconds:.1f} s, {self.samples_per_s:.2f} samples/s"),
            ("rejected layouts", str(self.rejections)),
            ("size", f"{self.bytes / 1e6:.1f} MB, {self.bytes / self.samples / 1e3:.0f} kB/sample"),
        ]
        stages = ", ".join(f"{name} {seconds:.3f}" for name, seconds in self.cpu_s.items())
        if stages:
            rows.append(("CPU s per sample", stages))
        if self.rss_bytes_max:
            rows.append(("memory per worker", f"{self.rss_bytes_max / 1e6:.0f} MB"))
        if self.worker_deaths:
            rows.append(
                ("worker deaths", f"{self.worker_deaths} (work repeated; see run/log.jsonl)")
            )
        return [*rows, ("id", self.dataset_id[:16])]


class RunMonitor:
    """Counts events, reports progress, appends to ``run/log.jsonl``, and watches the disk."""

    def __init__(
        self,
        store: LocalStore,
        scan: Scan,
        total: int,
        report: Callable[[RunProgress], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._store = store
        self._scan = scan
        self._total = total
        self._report = report
        self._clock = clock
        self._started_s = clock()
        self._in_flight: dict[int, tuple[int, int]] = {}
        self._workers: set[int] = set()
        self._measured = 0
        self._cpu_s: dict[str, float] = {}
        self.made = 0
        self.bytes = 0
        self.rejections = scan.rejections
        self.worker_deaths = 0
        self.rss_bytes_max = 0

    @property
    def seconds(self) -> float:
        """Since the start."""
        return self._clock() - self._started_s

    def observe(self, event: Event | Action) -> GenDataError | None:
        """Take note; an error means that going on makes no sense."""
        objection = None
        if isinstance(event, SampleDone):
            self._sample(event)
        elif isinstance(event, ShardDone):
            objection = self._shard(event)
        elif isinstance(event, Note):
            self.log({"note": event.text})
        elif isinstance(event, Spawn):
            self._workers.add(event.worker)
        elif isinstance(event, Exited):
            self._workers.discard(event.worker)
            self._in_flight.pop(event.worker, None)
        else:
            return None
        self.show("samples")
        return objection

    def show(self, phase: str) -> None:
        """Report the progress."""
        unfinished = sum(count for _, count in self._in_flight.values())
        new = self.made + unfinished
        self._report(
            RunProgress(
                phase=phase,
                done=self._scan.samples + new,
                total=self._total,
                samples_per_s=new / self.seconds if new and self.seconds > 0 else 0.0,
                rejections=self.rejections,
                workers=len(self._workers),
            )
        )

    def log(self, entry: Mapping[str, object]) -> None:
        """Append one line to the run's log."""
        line = canonical_json({"at_s": round(self.seconds, 3), **entry})
        with self._store.errors(), (self._store.run_dir / "log.jsonl").open("a") as file:
            file.write(f"{line}\n")

    def mean_cpu_s(self) -> dict[str, float]:
        """CPU seconds per sample by stage, in the order in which stages first ran."""
        return {stage: total / self._measured for stage, total in self._cpu_s.items()}

    def _sample(self, event: SampleDone) -> None:
        _, before = self._in_flight.get(event.worker, (event.shard, 0))
        self._in_flight[event.worker] = (event.shard, before + 1)
        self._measured += 1
        self._spend(event.timings_s)

    def _spend(self, timings_s: Mapping[str, float]) -> None:
        for stage, seconds in timings_s.items():
            self._cpu_s[stage] = self._cpu_s.get(stage, 0.0) + seconds

    def _shard(self, event: ShardDone) -> GenDataError | None:
        self._in_flight.pop(event.worker, None)
        self.made += event.samples
        self.bytes += event.bytes
        self.rejections += event.rejections
        self._spend(event.timings_s)
        self.rss_bytes_max = max(self.rss_bytes_max, event.rss_bytes)
        self.log(
            {
                "shard": event.shard,
                "worker": event.worker,
                "bytes": event.bytes,
                "rss_bytes": event.rss_bytes,
                "cpu_s_per_sample": self.mean_cpu_s(),
            }
        )
        return self._space_objection()

    def _space_objection(self) -> StorageError | None:
        """Stop before the disk is full: predicts the rest from the shards there are."""
        samples = self._scan.samples + self.made
        rest = (self._scan.bytes + self.bytes) / samples * (self._total - samples)
        with self._store.errors():
            free = free_bytes(self._store.root)
        if free >= FREE_SPACE_MARGIN * rest:
            return None
        return StorageError(
            f"{self._store.root}: the other {self._total - samples} samples need about "
            f"{_format_bytes(rest)} and {_format_bytes(free)} are free; stopped before the disk is "
            f"full.\n  After making room, go on with:\n    {self._store.resume_command}"
        )


def _format_bytes(size: float) -> str:
    for factor, unit in ((1e9, "GB"), (1e6, "MB")):
        if size >= factor:
            return f"{size / factor:.1f} {unit}"
    return f"{size / 1e3:.1f} kB"


def _with_note(text: str, number: int, what: str) -> str:
    return f"{text} ({number} {what})" if number else text
