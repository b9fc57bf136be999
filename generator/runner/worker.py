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
import tempfile
import traceback
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING

from gen_data.generator.core.child_processes import end_with_parent
from gen_data.generator.core.errors import GenDataError
from gen_data.generator.runner.error_context import unexpected_error
from gen_data.generator.runner.worker_events import Failed, Ready, SampleDone, ShardDone

if TYPE_CHECKING:
    from gen_data.generator.core.sample import Sample
    from gen_data.generator.runner.shard import Job, MadeShard, PipelineLike


def main(number: int, connection_fd: int, job_fd: int, parent_pid: int) -> None:
    """Entry of the process; ends when the connection brings None or closes.

    Args:
        number: Of the worker.
        connection_fd: A socket: shards come in, events go out.
        job_fd: A file that holds a pickled Job.
        parent_pid: The process ends with that one.
    """
    end_with_parent(parent_pid)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    faulthandler.enable()
    connection = Connection(connection_fd)
    try:
        job = _load_job(job_fd)
        _keep_temporary_files_in(job.store.scratch_root)
        _make_shards(number, connection, job)
    except (EOFError, ConnectionError):
        # The supervisor is gone: nobody would read a report.
        sys.exit(1)
    except Exception as error:
        traceback.print_exc()
        with suppress(ConnectionError):
            connection.send(Failed(number, make_sendable(error)))
        sys.exit(1)


def _load_job(descriptor: int) -> Job:
    # All workers share the descriptor's position, hence pread.
    job: Job = pickle.loads(os.pread(descriptor, os.fstat(descriptor).st_size, 0))
    os.close(descriptor)
    return job


def _keep_temporary_files_in(folder: Path) -> None:
    """Let ``tempfile`` use a folder of the run, which outlives no run, even of killed workers.

    The alias is short and plain whatever the folder is called: Bullet cuts long paths off.
    """
    tempfile.tempdir = f"/proc/self/fd/{os.open(folder, os.O_RDONLY | os.O_DIRECTORY)}"


def make_sendable(error: Exception) -> GenDataError:
    """The error as one that survives the way to another process and has a message for users."""
    if not isinstance(error, GenDataError):
        return unexpected_error(error, "a worker could not start")
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


def _make_shards(number: int, connection: Connection, job: Job) -> None:
    with job.make_pipeline() as pipeline:
        # Objects that exist now stay to the end. Collecting the rest between shards is early
        # enough: automatic collection takes 2 % of the run.
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
    from gen_data.generator.runner.shard import make_shard

    made = make_shard(job, pipeline, shard, report)
    connection.send(done_event(number, made))


def done_event(number: int, made: MadeShard) -> ShardDone:
    """Summarise a shard that worker ``number`` made, for the supervisor."""
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
