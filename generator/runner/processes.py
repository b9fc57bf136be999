"""Worker processes: executes the actions of the supervisor and reports events to it.

Nothing here may block the supervisor, or Ctrl-C would be ignored and a batch job would use up its
allocation. ``multiprocessing`` blocks: its ``Process.start`` writes the task into a pipe and
waits until the new process reads it, which a process that is killed at its start never does;
``multiprocessing.Pool`` waits forever after a worker is killed; one kill breaks all futures of a
``ProcessPoolExecutor``. Here, workers inherit the job as a file in memory, and a process is a
socket and an exit code.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, Pipe, wait
from pathlib import Path
from socket import socket
from typing import IO, TYPE_CHECKING, Protocol

from gen_data.core import errors, processes, system_calls
from gen_data.runner import termination_signals, worker_events
from gen_data.runner.supervisor import Supervisor

if TYPE_CHECKING:
    from gen_data.runner.shard import Job

TICK_S = 0.5
ENDING_TICK_S = 0.02
STANDBY = -1
"""Number of a worker that waits for its number, its log and its job."""
JOIN_S = 3.0
"""Time to wait for killed processes [s]. A process that the kernel cannot end, as on dead storage,
must not block the run; its parent-death signal is pending."""

START_WORKER = (
    "import os, sys; sys.path[:] = sys.argv[5:]; "
    f"os.environ.update(dict.fromkeys({processes.SINGLE_THREADED!r}, '1')); "
    "from gen_data.runner.worker import main; main(*map(int, sys.argv[1:5]))"
)
"""Program of a worker; it has the module search path of this process, and so its plug-ins.

It is single-threaded whatever the environment of the host program.
"""


@dataclass
class _Child:
    process: subprocess.Popen[bytes]
    connection: Connection
    connected: bool = True

    def messages(self) -> Iterator[worker_events.Event]:
        """Receive all messages of the worker; a message cut off by its death is dropped."""
        try:
            while self.connected and self.connection.poll():
                yield self.connection.recv()
        except (EOFError, OSError):
            self.connected = False


class Pool(Protocol):
    """Workers of one run. A context manager: leaves no worker behind."""

    def __enter__(self) -> Pool:
        """Start without workers."""
        ...

    def __exit__(self, *exception: object) -> None:
        """End the remaining workers."""
        ...

    def execute(self, action: worker_events.Action) -> None:
        """Execute one action; actions on a worker that has ended do nothing."""
        ...

    def events(self, wake: socket, timeout_s: float) -> Iterator[worker_events.Event]:
        """Wait for an event, ``wake`` or the timeout; yield all events since the last call."""
        ...


class StandbyWorker:
    """A worker that imports and loads the needs of most jobs, while its job is still being planned.

    A context manager: without a job, the process does not outlive it.

    Attributes:
        process: The process, which a pool may take over.
    """

    def __init__(self) -> None:
        self._job_fd = system_calls.anonymous_file("gen-data job")
        # The folder of logs is not known yet.
        with os.fdopen(system_calls.anonymous_file("gen-data standby log"), "wb") as log:
            child = _start_worker(STANDBY, self._job_fd, log)
        self.process = child.process
        self._child: _Child | None = child

    def __enter__(self) -> StandbyWorker:
        """Return the worker, whose process has started."""
        return self

    def __exit__(self, *exception: object) -> None:
        """End the process unless a pool has taken it."""
        if self._child is not None:
            child, job_fd = self.take()
            _end([child])
            os.close(job_fd)

    def take(self) -> tuple[_Child, int]:
        """The process, and the file from which it will read its job; the caller owns both."""
        assert self._child is not None
        child, self._child = self._child, None
        return child, self._job_fd


class WorkerPool:
    """The worker processes of one run. A context manager: leaves no process behind.

    Args:
        job: Work of the workers.
        logs: Folder for the output of workers, one file per worker.
        standby: Becomes the first worker.
    """

    def __init__(self, job: Job, logs: Path, standby: StandbyWorker | None = None) -> None:
        self._standby: _Child | None = None
        if standby is None:
            self._job_fd = system_calls.anonymous_file("gen-data job")
        else:
            self._standby, self._job_fd = standby.take()
        with open(self._job_fd, "wb", closefd=False) as file:
            pickle.dump(job, file)
        self._logs = logs
        self._children: dict[int, _Child] = {}
        self._out_of_memory_kills = _count_out_of_memory_kills()

    def __enter__(self) -> WorkerPool:
        """Start without processes."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Kill the remaining processes and wait for them for at most ``JOIN_S``."""
        unused = [self._standby] if self._standby is not None else []
        _end([*self._children.values(), *unused])
        self._children.clear()
        os.close(self._job_fd)

    def execute(self, action: worker_events.Action) -> None:
        """Execute one action; actions on a process that has ended do nothing.

        Raises:
            OSError: No process can be started, or its log cannot be opened.
        """
        if isinstance(action, worker_events.Spawn):
            self._children[action.worker] = self._spawn(action.worker)
        elif (
            isinstance(action, (worker_events.Assign, worker_events.Dismiss))
            and action.worker in self._children
        ):
            # The end of a worker arrives as Exited.
            with suppress(BrokenPipeError, ConnectionResetError):
                work = (
                    (action.shard, action.failed)
                    if isinstance(action, worker_events.Assign)
                    else None
                )
                self._children[action.worker].connection.send(work)
        elif isinstance(action, worker_events.Kill) and action.worker in self._children:
            self._children[action.worker].process.kill()

    def events(self, wake: socket, timeout_s: float) -> Iterator[worker_events.Event]:
        """Wait for an event, ``wake`` or the timeout; yield all events since the last call."""
        connections = [c.connection for c in self._children.values() if c.connected]
        some_end = len(connections) < len(self._children)
        wait([wake, *connections], ENDING_TICK_S if some_end else timeout_s)
        for number, child in sorted(self._children.items()):
            # Poll first: messages before the end must not be lost.
            exit_code = child.process.poll()
            yield from child.messages()
            if exit_code is not None:
                yield self._on_exit(number, exit_code)
        yield worker_events.Tick()

    def _spawn(self, number: int) -> _Child:
        log_path = self._logs / f"worker-{number}.log"
        with log_path.open("wb") as log:
            child, self._standby = self._standby, None
            if child is None or child.process.poll() is not None:
                return _start_worker(number, self._job_fd, log)
            # The end of a worker arrives as Exited.
            with suppress(BrokenPipeError, ConnectionResetError):
                child.connection.send((number, str(log_path)))
            return child

    def _on_exit(self, number: int, exit_code: int) -> worker_events.Exited:
        self._children.pop(number).connection.close()
        kills = _count_out_of_memory_kills()
        out_of_memory = exit_code == system_calls.KILLED and kills > self._out_of_memory_kills
        self._out_of_memory_kills = kills
        return worker_events.Exited(number, exit_code, out_of_memory)


def _start_worker(number: int, job_fd: int, log: IO[bytes]) -> _Child:
    ours, theirs = Pipe(duplex=True)
    arguments = (number, theirs.fileno(), job_fd, os.getpid())
    with theirs, processes.interrupts_blocked():
        process = subprocess.Popen(
            [sys.executable, "-c", START_WORKER, *map(str, arguments), *sys.path],
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            pass_fds=(theirs.fileno(), job_fd),
        )
    return _Child(process, ours)


def _end(children: Sequence[_Child]) -> None:
    """Kill processes and wait for them for at most ``JOIN_S``."""
    for child in children:
        child.process.kill()
    deadline_s = time.monotonic() + JOIN_S
    for child in children:
        with suppress(subprocess.TimeoutExpired):
            child.process.wait(max(0.0, deadline_s - time.monotonic()))
        child.connection.close()


def open_worker_pool(job: Job, standby: StandbyWorker | None = None) -> Pool:
    """Open a pool of processes on this machine."""
    return WorkerPool(job, job.store.run_dir, standby)


def run_supervisor(
    job: Job,
    open_pool: Callable[[Job], Pool],
    supervisor: Supervisor,
    interruption: termination_signals.Interruption,
    observe: Callable[[worker_events.Event | worker_events.Action], errors.GenDataError | None],
    clock: Callable[[], float] = time.monotonic,
) -> None:
    """Run the supervisor with real workers until it is finished.

    ``observe`` receives every event and action; an error that it returns aborts the run. Returns
    ``JOIN_S`` after an interruption at the latest, even if a process cannot be killed.

    Raises:
        StorageError: A worker's log cannot be opened, or the system refuses another process.
    """
    deadline_s = float("inf")

    def execute(actions: list[worker_events.Action]) -> None:
        for action in actions:
            observe(action)
            with job.store.errors():
                pool.execute(action)

    with open_pool(job) as pool:
        execute(supervisor.start(clock()))
        while not supervisor.finished and clock() < deadline_s:
            for event in pool.events(interruption.wake, TICK_S):
                objection = observe(event)
                execute(supervisor.handle(event, clock()))
                if objection is not None:
                    execute(supervisor.handle(worker_events.Abort(objection), clock()))
            if interruption.pending:
                deadline_s = clock() + JOIN_S
                execute(supervisor.handle(worker_events.Abort(interruption.take()), clock()))


def _count_out_of_memory_kills() -> int:
    """Number of processes killed for lack of memory since boot; 0 if unknown."""
    try:
        lines = Path("/proc/vmstat").read_text().splitlines()
    except OSError:
        return 0
    counts = dict(line.split() for line in lines)
    return int(counts.get("oom_kill", 0))
