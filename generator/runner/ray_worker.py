"""Worker on a machine of a Ray cluster: an actor that generates one shard per task.

Its tasks are streams of batches of events: the driver sees progress and signs of life before a
shard is finished.
"""

import faulthandler
import gc
import os
import pickle
import queue
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from gen_data.core.errors import NumericsError
from gen_data.core.sample import Sample
from gen_data.runner import durable_files, identity, numerics_guard, resident_memory
from gen_data.runner.failed_sample import FailedSample
from gen_data.runner.shard import Job, PipelineLike, make_shard
from gen_data.runner.worker import done_event, make_sendable
from gen_data.runner.worker_events import Event, Failed, Ready, SampleDone, SampleSkipped

BATCH_S = 1.0
"""Time between two batches of events [s]: a driver of a thousand workers reads so many per second.
"""


@dataclass(frozen=True, slots=True)
class Placed:
    """A worker has a machine, the one with this id; for the pool."""

    worker: int
    node: str


class ShardWorker:
    """Generates shards; the class of the actor.

    All work is done in one thread, because engines belong to the thread that starts them.

    Args:
        number: Number of the worker.
        job: A pickled ``Job``.
    """

    def __init__(self, number: int, job: bytes) -> None:
        self._number = number
        self._job_bytes = job
        self._work: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._events: queue.SimpleQueue[Event | None] = queue.SimpleQueue()
        self._engines = ExitStack()
        threading.Thread(target=self._serve, daemon=True).start()

    def start(self) -> Iterator[Sequence[Event | Placed]]:
        """Start the engines. The first batch signals that the worker has a machine."""
        import ray

        yield [Placed(self._number, ray.get_runtime_context().get_node_id())]
        yield from self._stream(self._start)

    def make(self, shard: int, failed: tuple[FailedSample, ...] = ()) -> Iterator[list[Event]]:
        """Generate and commit one shard, without the samples in ``failed``."""
        yield from self._stream(lambda: self._make(shard, failed))

    def leave(self) -> None:
        """Stop the engines, which removes their temporary files."""
        ended = threading.Event()
        self._work.put(self._engines.close)
        self._work.put(ended.set)
        ended.wait()

    def _serve(self) -> None:
        for work in iter(self._work.get, None):
            work()

    def _stream(self, work: Callable[[], None]) -> Iterator[list[Event]]:
        self._work.put(lambda: self._report(work))
        batch: list[Event] = []
        sent_s = time.monotonic()
        while (event := self._events.get()) is not None:
            batch.append(event)
            if time.monotonic() - sent_s >= BATCH_S:
                yield batch
                batch, sent_s = [], time.monotonic()
        yield batch

    def _report(self, work: Callable[[], None]) -> None:
        """Do the work; its error becomes an event."""
        try:
            work()
        except Exception as error:
            traceback.print_exc()
            self._events.put(Failed(self._number, make_sendable(error)))
        self._events.put(None)

    def _start(self) -> None:
        self._job: Job = pickle.loads(self._job_bytes)
        store = self._job.store
        durable_files.make_folder(store.scratch_root)
        _redirect_output(store.run_dir / f"worker-{self._number}.log")
        differences = identity.installation_differences(self._job.plan)
        if differences:
            raise NumericsError(f"another installation: {'; '.join(differences[:3])}")
        self._pipeline: PipelineLike = self._engines.enter_context(self._job.make_pipeline())
        gc.collect()
        gc.freeze()
        numerics_guard.admit_numerics(self._job, self._pipeline)
        self._events.put(Ready(self._number))

    def _make(self, shard: int, failed: tuple[FailedSample, ...]) -> None:
        def report(sample: Sample) -> None:
            self._events.put(SampleDone(self._number, shard, sample.index, dict(sample.timings_s)))

        def report_failure(failure: FailedSample, text: str) -> None:
            self._events.put(SampleSkipped(self._number, shard, failure, text))

        made = make_shard(self._job, self._pipeline, shard, report, report_failure, failed)
        self._events.put(done_event(self._number, made))
        resident_memory.release_memory()


def _redirect_output(log: Path) -> None:
    """Send standard output and error, also of native code, to a file."""
    descriptor = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
    for stream in (1, 2):
        os.dup2(descriptor, stream)
    os.close(descriptor)
    faulthandler.enable()
