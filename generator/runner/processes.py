"""Worker processes: carries out what the supervisor decides, and tells it what happened.

``multiprocessing.Pool`` waits for ever after a worker is killed, and one kill breaks every future
of a ``ProcessPoolExecutor``; here a process is a pipe, an exit code, and nothing shared.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from pathlib import Path

from generator.core.errors import GenDataError
from generator.runner.events import (
    Abort,
    Action,
    Assign,
    Dismiss,
    Event,
    Exited,
    Kill,
    Spawn,
    Tick,
)
from generator.runner.interruption import Interruption
from generator.runner.shard import Job
from generator.runner.supervisor import Supervisor
from generator.runner.worker import worker_main

TICK_S = 0.5
JOIN_S = 5.0


@dataclass(frozen=True)
class _Child:
    process: SpawnProcess
    connection: Connection


class Crew:
    """The worker processes of one run. A context manager: leaves no process behind."""

    def __init__(self, job: Job) -> None:
        # Compressed it fits into a pipe: a spawn need not wait for the process to read it.
        self._payload = zlib.compress(pickle.dumps(job))
        self._logs = job.store.run_dir
        self._context = multiprocessing.get_context("spawn")
        self._children: dict[int, _Child] = {}
        self._out_of_memory_kills = _out_of_memory_kills()

    def __enter__(self) -> Crew:
        """Begin with no process."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Kill what still runs."""
        for child in self._children.values():
            child.process.kill()
        for number in list(self._children):
            self._bury(number)

    def carry_out(self, action: Action) -> None:
        """Do one thing the supervisor wants; what is meant for a dead process is dropped."""
        if isinstance(action, Spawn):
            self._spawn(action.worker)
        elif isinstance(action, (Assign, Dismiss)) and action.worker in self._children:
            # A worker that has just died shows up as Exited.
            with suppress(BrokenPipeError, ConnectionResetError):
                shard = action.shard if isinstance(action, Assign) else None
                self._children[action.worker].connection.send(shard)
        elif isinstance(action, Kill) and action.worker in self._children:
            self._children[action.worker].process.kill()

    def events(self, wake_fd: int, timeout_s: float) -> Iterator[Event]:
        """What happened since the last call; waits for something, or for the time to pass."""
        sources: list[Connection | int] = [wake_fd]
        for child in self._children.values():
            sources += [child.connection, child.process.sentinel]
        ready = set(wait(sources, timeout_s))
        for number, child in sorted(self._children.items()):
            gone = child.process.sentinel in ready
            if gone or child.connection in ready:
                # Its last words come before its end.
                yield from _messages(child.connection)
            if gone:
                yield self._exited(number)
        yield Tick()

    def _spawn(self, number: int) -> None:
        ours, theirs = self._context.Pipe(duplex=True)
        log = self._logs / f"worker-{number}.log"
        process = self._context.Process(
            target=worker_main,
            args=(number, theirs, os.getpid(), self._payload, log),
            name=f"gen-data worker {number}",
        )
        with _interrupts_blocked():
            process.start()
        theirs.close()
        self._children[number] = _Child(process, ours)

    def _exited(self, number: int) -> Exited:
        exit_code = self._bury(number)
        kills = _out_of_memory_kills()
        starved = exit_code == -signal.SIGKILL and kills > self._out_of_memory_kills
        self._out_of_memory_kills = kills
        return Exited(number, exit_code, starved)

    def _bury(self, number: int) -> int:
        child = self._children.pop(number)
        child.process.join(JOIN_S)
        exit_code = child.process.exitcode
        child.connection.close()
        if exit_code is None:
            # Unkillable: in the kernel, on dead storage. Its parent-death signal is pending.
            return -signal.SIGKILL
        child.process.close()
        return exit_code


def drive(
    job: Job,
    supervisor: Supervisor,
    interruption: Interruption,
    observe: Callable[[Event | Action], GenDataError | None],
    clock: Callable[[], float] = time.monotonic,
) -> None:
    """Run the supervisor with real processes until it is finished.

    ``observe`` sees every event and action; an error that it returns aborts the run.
    """
    with Crew(job) as crew:
        _do(supervisor.start(clock()), crew, observe)
        while not supervisor.finished:
            for event in crew.events(interruption.wake_fd, TICK_S):
                objection = observe(event)
                _do(supervisor.handle(event, clock()), crew, observe)
                if objection is not None:
                    _do(supervisor.handle(Abort(objection), clock()), crew, observe)
            if interruption.pending:
                stop = Abort(interruption.take())
                _do(supervisor.handle(stop, clock()), crew, observe)


def _do(
    actions: list[Action], crew: Crew, observe: Callable[[Event | Action], GenDataError | None]
) -> None:
    for action in actions:
        observe(action)
        crew.carry_out(action)


def _messages(connection: Connection) -> Iterator[Event]:
    """Everything a worker has sent; a message torn by its death is dropped."""
    try:
        while connection.poll():
            yield connection.recv()
    except (EOFError, OSError):
        return


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """A child inherits the mask: Ctrl-C, sent to all, cannot hit it before it ignores it."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _out_of_memory_kills() -> int:
    """Processes that the kernel has killed for want of memory since boot; 0 if it does not say."""
    try:
        lines = Path("/proc/vmstat").read_text().splitlines()
    except OSError:
        return 0
    counts = dict(line.split() for line in lines)
    return int(counts.get("oom_kill", 0))
