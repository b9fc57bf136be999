"""Worker process: starts its engines once and generates shards until it is dismissed.

The module imports little: a new process can arrange to end with its parent before slow imports. It
inherits the environment, where the command line limits BLAS and OpenMP to one thread,
because their sums depend on the number of threads.
"""

from __future__ import annotations

import faulthandler
import gc
import os
import pickle
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gen_data.core.errors import CacheWarning, ConfigWarning, GenDataError
from gen_data.core.processes import end_with_parent, forbid_core_dumps, ignore_interrupts
from gen_data.runner import error_context, resident_memory
from gen_data.runner.labels import LABELS_NAME
from gen_data.runner.worker_events import Failed, Ready, SampleDone, SampleSkipped, ShardDone

if TYPE_CHECKING:
    from gen_data.core.sample import Sample
    from gen_data.runner.failed_sample import FailedSample
    from gen_data.runner.shard import Job, MadeShard, PipelineLike


def main(number: int, connection_fd: int, job_fd: int, parent_pid: int) -> None:
    """Entry point of the process; returns when it receives None or the connection closes.

    Args:
        number: Number of the worker; negative = sent together with the path of its log, when the
            job is
            ready.
        connection_fd: Socket for shard numbers, each with the samples to leave out (in), and for
            events (out).
        job_fd: File with a pickled Job.
        parent_pid: Process whose end also ends this one.
    """
    end_with_parent(parent_pid)
    # Objects made by imports and engines are kept, and never searched for garbage, which is a
    # hundredth of it: searching it takes a tenth of the start, again and again.
    gc.disable()
    ignore_interrupts()
    forbid_core_dumps()
    faulthandler.enable()
    connection = Connection(connection_fd)
    notices: list[str] = []
    warnings.showwarning = partial(_show_warning, notices, warnings.showwarning)
    try:
        if number < 0:
            _prepare()
            number, log = connection.recv()
            _redirect_output(log)
        job = _load_job(job_fd)
        _set_temporary_folder(job.store.scratch_root)
        _make_shards(number, connection, job, notices)
    except (EOFError, ConnectionError):
        # The supervisor has ended, so there is no reader for a report.
        sys.exit(1)
    except Exception as error:
        traceback.print_exc()
        with suppress(ConnectionError):
            connection.send(Failed(number, make_sendable(error)))
        sys.exit(1)


def _prepare() -> None:
    from gen_data.assemble import pipeline_factory
    from gen_data.renderers.warp import renderer
    from gen_data.renderers.warp.device import prepare_device
    from gen_data.runner import numerics_guard, shard

    del pipeline_factory, renderer, numerics_guard, shard
    try:
        prepare_device("auto")
    except Exception:
        # The job may need no renderer; one that does reports the same error under its number.
        traceback.print_exc()


def _redirect_output(path: str) -> None:
    with Path(path).open("ab") as file:
        for stream in (1, 2):
            os.dup2(file.fileno(), stream)


def _load_job(descriptor: int) -> Job:
    # pread, because all workers share the position of the descriptor.
    job: Job = pickle.loads(os.pread(descriptor, os.fstat(descriptor).st_size, 0))
    os.close(descriptor)
    return job


def _set_temporary_folder(folder: Path) -> None:
    """Make ``tempfile`` use a folder of the run, which is cleared even if workers are killed.

    With procfs, the alias is short ASCII whatever the name of the folder, because Bullet truncates
    long paths.
    """
    if not Path("/proc/self/fd").is_dir():
        tempfile.tempdir = str(folder)
        return
    tempfile.tempdir = f"/proc/self/fd/{os.open(folder, os.O_RDONLY | os.O_DIRECTORY)}"


def make_sendable(error: Exception) -> GenDataError:
    """Convert an error to one that can be pickled and has a message for users."""
    if not isinstance(error, GenDataError):
        return error_context.unexpected_error(error, "a worker could not start")
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        # The error class of a plug-in cannot be pickled: keep its kind and its text.
        plain: GenDataError = _picklable_base(type(error))(str(error))
        return plain
    return error


def _picklable_base(kind: type[GenDataError]) -> type[GenDataError]:
    """Nearest base class among our own errors whose only argument is a message."""
    return next(
        base
        for base in kind.__mro__
        if base.__module__ == GenDataError.__module__ and "__init__" not in vars(base)
    )


def _make_shards(number: int, connection: Connection, job: Job, notices: list[str]) -> None:
    with job.make_pipeline() as pipeline:
        # Existing objects live until the end. Collecting the others between shards suffices;
        # automatic collection takes 2 % of the run.
        gc.freeze()
        resident_memory.release_memory()
        # Imports numpy, therefore only after ``end_with_parent``.
        from gen_data.runner.numerics_guard import admit_numerics

        admit_numerics(job, pipeline)
        connection.send(Ready(number, tuple(notices)))
        while (assigned := connection.recv()) is not None:
            _make_shard(number, connection, job, pipeline, *assigned)
            resident_memory.release_memory()


def _show_warning(
    notices: list[str],
    show: Callable[..., None],
    message: Warning | str,
    category: type[Warning],
    *place: Any,
    **options: Any,
) -> None:
    """Keep the texts of gen-data's warnings, for the user; all go to the log of the worker."""
    if category in (CacheWarning, ConfigWarning):
        notices.append(str(message))
    show(message, category, *place, **options)


def _make_shard(
    number: int,
    connection: Connection,
    job: Job,
    pipeline: PipelineLike,
    shard: int,
    failed: tuple[FailedSample, ...],
) -> None:
    def report(sample: Sample) -> None:
        connection.send(SampleDone(number, shard, sample.index, dict(sample.timings_s)))

    def report_failure(failure: FailedSample, text: str) -> None:
        connection.send(SampleSkipped(number, shard, failure, text))

    # Imports numpy, therefore only after ``end_with_parent``.
    from gen_data.runner.shard import make_shard

    made = make_shard(job, pipeline, shard, report, report_failure, failed)
    connection.send(done_event(number, made))


def done_event(number: int, made: MadeShard) -> ShardDone:
    """Event for a shard that worker ``number`` has committed."""
    record = made.record
    return ShardDone(
        number,
        record.shard,
        record.samples,
        record.size_bytes,
        record.rejections,
        resident_memory.resident_bytes(),
        made.timings_s,
        record.sha256,
        record.failed,
        record.sha256_of(LABELS_NAME),
    )
