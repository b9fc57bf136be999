"""A worker process: starts its engines once, makes shards until there are none.

The module is light, so that a new process can tie its life to its parent's before it imports
anything slow. The environment is the parent's: the command line has pinned the thread pools of BLAS
and OpenMP there, because their sums depend on the number of threads.
"""

from __future__ import annotations

import ctypes
import faulthandler
import gc
import os
import pickle
import resource
import signal
import sys
import traceback
import zlib
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING

from generator.core.errors import GenDataError
from generator.runner.events import Failed, Ready, SampleDone, ShardDone
from generator.runner.unforeseen import unforeseen

if TYPE_CHECKING:
    from generator.core.sample import Sample
    from generator.runner.shard import Job, MadeShard, PipelineLike

PR_SET_PDEATHSIG = 1  # <linux/prctl.h>


def worker_main(
    number: int, connection: Connection, parent_pid: int, payload: bytes, log: Path
) -> None:
    """Entry of the process. None on the connection ends it.

    Args:
        number: Of the worker.
        connection: Shards come in, events go out.
        parent_pid: The process ends with that one.
        payload: A Job, pickled and compressed.
        log: Takes what the process prints.
    """
    _die_with(parent_pid)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    _redirect_output(log)
    try:
        _work(number, connection, pickle.loads(zlib.decompress(payload)))
    except (EOFError, BrokenPipeError):
        # The supervisor is gone, and with it whoever would read a report.
        sys.exit(1)
    except Exception as error:
        traceback.print_exc()
        with suppress(BrokenPipeError):
            connection.send(Failed(number, sendable(error)))
        sys.exit(1)


def sendable(error: Exception) -> GenDataError:
    """The error as one that survives the way to another process and has a message for users."""
    if not isinstance(error, GenDataError):
        return unforeseen(error, "a worker could not start")
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        # Whatever a plug-in's error class does wrong, its kind and its text still count.
        plain: GenDataError = _ancestor_of_message(type(error))(str(error))
        return plain
    return error


def _ancestor_of_message(kind: type[GenDataError]) -> type[GenDataError]:
    """The nearest of our own error classes that is made of nothing but a message."""
    return next(
        base
        for base in kind.__mro__
        if base.__module__ == GenDataError.__module__ and "__init__" not in vars(base)
    )


def _work(number: int, connection: Connection, job: Job) -> None:
    with job.make_pipeline() as pipeline:
        # What is there now stays to the end, and between shards is early enough to look at the
        # rest: looking all the time takes a fiftieth of the run.
        gc.collect()
        gc.freeze()
        gc.disable()
        connection.send(Ready(number))
        while (shard := connection.recv()) is not None:
            _make(number, connection, job, pipeline, shard)
            _give_memory_back()


def _make(
    number: int, connection: Connection, job: Job, pipeline: PipelineLike, shard: int
) -> None:
    def report(sample: Sample) -> None:
        connection.send(SampleDone(number, shard, sample.index, dict(sample.timings_s)))

    # Imports numpy: only after this process is tied to its parent.
    from generator.runner.shard import make_shard

    made = make_shard(job, pipeline, shard, report)
    connection.send(done_event(number, made))


def done_event(number: int, made: MadeShard) -> ShardDone:
    """What the supervisor is told about a shard that worker ``number`` made."""
    record = made.record
    return ShardDone(
        number,
        record.shard,
        record.end - record.first,
        record.size_bytes,
        record.rejections,
        resident_bytes(),
        made.timings_s,
    )


def resident_bytes() -> int:
    """Memory that this process occupies now; 0 where Linux's procfs is missing."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:
        return 0
    return pages * resource.getpagesize()


def _give_memory_back() -> None:
    """Return freed memory to the system: glibc keeps what caches of arrays leave in between."""
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)


def _die_with(parent_pid: int) -> None:
    """Have the kernel kill this process when its parent ends, however that ends."""
    if sys.platform == "linux":
        ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent_pid:
        # The parent ended before the kernel was asked.
        os._exit(1)


def _redirect_output(log: Path) -> None:
    """Send what libraries print, and the stack of a crash, to a file of the run folder."""
    descriptor = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
    os.dup2(descriptor, 1)
    os.dup2(descriptor, 2)
    os.close(descriptor)
    faulthandler.enable()
