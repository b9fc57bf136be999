"""Decisions of the supervisor as a state machine: events in, actions out.

It starts no process, reads no clock and accesses no file: a simulation with a virtual clock and
seeded faults exercises exactly the production code.
"""

import signal
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum

from gen_data.core import errors, system_calls
from gen_data.runner.failed_sample import FailedSample
from gen_data.runner.worker_events import (
    Abort,
    Action,
    Assign,
    Dismiss,
    Event,
    Exited,
    Failed,
    Kill,
    Note,
    Queued,
    SampleDone,
    SampleSkipped,
    ShardDone,
    Spawn,
    Tick,
)


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits on silence, deaths and memory of workers.

    Attributes:
        silence_s: A worker that sends nothing for this long counts as hung and is killed.
        sample_s: The same while it makes a sample, which then gets no second try; None = as
            ``silence_s``, with ``shard_attempts``.
        start_s: The same for the start of its engines, in which kernels may be compiled.
        farewell_s: Time that a dismissed worker has to exit.
        shard_attempts: Deaths on one shard until it is abandoned.
        machine_losses: Machines lost while they worked on one shard until it is abandoned.
        lost_shards: Abandoned shards until the run is abandoned.
        failed_starts: Consecutive deaths during start until the run is abandoned.
        rss_bytes: Resident memory above which a worker is replaced after its shard; None = never.
        rss_growth: It is replaced only if it has grown to this multiple of its memory after its
            first shard: otherwise a new one would soon be as large.
    """

    silence_s: float = 300.0
    sample_s: float | None = None
    start_s: float = 300.0
    farewell_s: float = 10.0
    shard_attempts: int = 3
    machine_losses: int = 10
    lost_shards: int = 3
    failed_starts: int = 3
    rss_bytes: int | None = 3 * 1024**3
    rss_growth: float = 1.5


class State(Enum):
    """State of a worker."""

    STARTING = "starting"
    IDLE = "idle"
    BUSY = "busy"
    LEAVING = "leaving"


@dataclass
class _Worker:
    state: State
    heard_s: float
    shard: int = -1
    done: int = 0
    killed: str = ""
    timed_out: bool = False
    failed: tuple[FailedSample, ...] = ()
    first_rss_bytes: int | None = None


@dataclass
class Supervisor:
    """Keeps up to ``workers`` processes busy until every shard is finished or abandoned.

    Attributes:
        shards: Shards to generate, in this order.
        samples_of: Sample indices of a shard.
        describe_sample: Command that generates one sample by itself, for messages.
        skip_failed: Generate a shard without a sample that keeps killing its worker, or exceeds
            ``limits.sample_s``, instead of abandoning the shard.
        error: The first error that ends the run, or else the error of the first abandoned shard.
        given_up: Abandoned shards, which killed too many workers.
        deaths: Processes that ended unexpectedly.
    """

    shards: Sequence[int]
    samples_of: Callable[[int], range]
    workers: int
    describe_sample: Callable[[int], str]
    limits: Limits = field(default_factory=Limits)
    skip_failed: bool = False
    error: errors.GenDataError | None = None
    given_up: list[int] = field(default_factory=list)
    deaths: int = 0

    def __post_init__(self) -> None:
        """Start without processes."""
        if self.workers < 1:
            raise ValueError(f"at least one worker is needed, got {self.workers}")
        self._alive: dict[int, _Worker] = {}
        self._next_number = 0
        self._cursor = 0
        self._again: deque[int] = deque()
        self._deaths: dict[tuple[int, int], int] = {}
        self._losses: dict[tuple[int, int], int] = {}
        self._failed: dict[int, tuple[FailedSample, ...]] = {}
        self._failed_starts = 0
        self._draining = False

    @property
    def finished(self) -> bool:
        """Whether no process runs and none will be started."""
        return not self._alive and (self._draining or self._waiting == 0)

    @property
    def _waiting(self) -> int:
        """Number of shards that are not assigned."""
        return len(self.shards) - self._cursor + len(self._again)

    def start(self, now_s: float) -> list[Action]:
        """Return the first actions."""
        return self._dispatch(now_s)

    def handle(self, event: Event, now_s: float) -> list[Action]:
        """Return the actions for an event; events of processes that have ended are ignored."""
        if isinstance(event, (SampleDone, SampleSkipped, Queued)):
            # The most frequent events, which change no state: a thousand workers send many.
            self._hear(event, now_s)
            return []
        actions = self._react(event, now_s)
        return actions + self._dispatch(now_s)

    def _react(self, event: Event, now_s: float) -> list[Action]:
        if isinstance(event, Tick):
            return self._kill_silent(now_s)
        if isinstance(event, Abort):
            return self._abort(event.error)
        worker = self._alive.get(event.worker)
        if worker is None:
            return []
        worker.heard_s = now_s
        if isinstance(event, Exited):
            return self._on_exit(event, self._alive.pop(event.worker))
        if isinstance(event, Failed):
            return self._report(event.error, worker)
        if worker.state is not State.LEAVING:
            worker.state = State.LEAVING if worker.killed else State.IDLE
            self._failed_starts = 0
        if isinstance(event, ShardDone):
            return self._recycle(event, worker)
        return []

    def _hear(self, event: SampleDone | SampleSkipped | Queued, now_s: float) -> None:
        worker = self._alive.get(event.worker)
        if worker is not None:
            worker.heard_s = now_s
            worker.done += not isinstance(event, Queued)

    def _dispatch(self, now_s: float) -> list[Action]:
        actions: list[Action] = []
        for number, worker in self._workers_in(State.IDLE):
            if self._draining or self._waiting == 0:
                break
            worker.state, worker.shard, worker.done = State.BUSY, self._next_shard(), 0
            worker.heard_s, worker.failed = now_s, self._failed.get(worker.shard, ())
            actions.append(Assign(number, worker.shard, worker.failed))
        open_shards = 0 if self._draining else self._waiting + len(self._workers_in(State.BUSY))
        if open_shards == 0:
            return actions + self._dismiss_idle(now_s)
        staff = sum(worker.state is not State.LEAVING for worker in self._alive.values())
        for _ in range(min(self.workers, open_shards) - staff):
            actions.append(Spawn(self._next_number))
            self._alive[self._next_number] = _Worker(State.STARTING, now_s)
            self._next_number += 1
        return actions

    def _dismiss_idle(self, now_s: float) -> list[Action]:
        actions: list[Action] = []
        for number, worker in self._workers_in(State.IDLE):
            worker.state, worker.heard_s = State.LEAVING, now_s
            actions.append(Dismiss(number))
        for number, worker in self._workers_in(State.STARTING):
            worker.state, worker.killed = State.LEAVING, "no longer needed"
            actions.append(Kill(number))
        return actions

    def _workers_in(self, state: State) -> list[tuple[int, _Worker]]:
        return [(n, w) for n, w in sorted(self._alive.items()) if w.state is state]

    def _next_shard(self) -> int:
        if self._again:
            return self._again.popleft()
        self._cursor += 1
        return self.shards[self._cursor - 1]

    def _kill_silent(self, now_s: float) -> list[Action]:
        actions: list[Action] = []
        for number, worker in sorted(self._alive.items()):
            patience_s = self._patience_s(worker)
            waits = worker.state is State.IDLE
            if not waits and not worker.killed and now_s - worker.heard_s > patience_s:
                worker.killed = f"no sign of life for {patience_s:g} s"
                worker.timed_out = self._has_sample_limit(worker)
                actions += [Note(f"worker {number}: {worker.killed}"), Kill(number)]
        return actions

    def _patience_s(self, worker: _Worker) -> float:
        if worker.state is State.LEAVING:
            return self.limits.farewell_s
        if worker.state is State.STARTING:
            return self.limits.start_s
        limit_s = self.limits.sample_s if self._has_sample_limit(worker) else None
        return self.limits.silence_s if limit_s is None else limit_s

    def _has_sample_limit(self, worker: _Worker) -> bool:
        """Whether the limit of a sample applies: not while engines start, or files are written."""
        makes_sample = worker.state is State.BUSY and self._current_sample(worker) is not None
        return makes_sample and self.limits.sample_s is not None

    def _abort(self, error: errors.GenDataError) -> list[Action]:
        self._drain(error)
        actions: list[Action] = []
        for number, worker in sorted(self._alive.items()):
            worker.state, worker.killed = State.LEAVING, "stopped"
            actions.append(Kill(number))
        return actions

    def _report(self, error: errors.GenDataError, worker: _Worker) -> list[Action]:
        worker.state = State.LEAVING
        if isinstance(error, errors.NumericsError):
            return self._refuse(error)
        if isinstance(error, (errors.StorageError, errors.DeterminismError)):
            # The other workers would fail in the same way.
            return self._abort(error)
        return self._drain(error)

    def _refuse(self, error: errors.NumericsError) -> list[Action]:
        """Go on without a worker that computes differently, unless it was the last one."""
        if all(worker.state is State.LEAVING for worker in self._alive.values()):
            return self._drain(error)
        self.workers = max(1, self.workers - 1)
        return [Note(f"a worker takes no work: {error}")]

    def _drain(self, error: errors.GenDataError) -> list[Action]:
        """Assign no more shards; shards in progress are finished.

        The first error that ends the run precedes errors of abandoned shards, which do not end it.
        """
        if not self._draining:
            self.error = error
        self._draining = True
        return []

    def _on_exit(self, event: Exited, worker: _Worker) -> list[Action]:
        if worker.state is State.LEAVING:
            return []
        self.deaths += 1
        cause = worker.killed or describe_exit(event)
        if event.out_of_memory and self.workers > 1:
            self.workers -= 1
            cause += f"; continuing with {self.workers} worker(s)"
        if worker.state is State.BUSY:
            return self._on_shard_death(event, worker, cause)
        if worker.state is State.STARTING and not event.machine_lost:
            self._failed_starts += 1
            if self._failed_starts >= self.limits.failed_starts:
                self._drain(
                    errors.WorkerLost(
                        f"worker processes end while they start: {cause}; "
                        f"see run/worker-{event.worker}.log in the output folder"
                    )
                )
        return [Note(f"worker {event.worker} {cause} while {worker.state.value}")]

    def _on_shard_death(self, event: Exited, worker: _Worker, cause: str) -> list[Action]:
        shard = worker.shard
        counts = self._losses if event.machine_lost else self._deaths
        most = self.limits.machine_losses if event.machine_lost else self.limits.shard_attempts
        index = self._current_sample(worker)
        # A sample that may be skipped is judged by its own deaths, else the shard by all of them.
        key = (shard, -1 if index is None or not self.skip_failed else index)
        counts[key] = counts.get(key, 0) + 1
        place = "writing its files" if index is None else f"sample {index}"
        note = Note(f"worker {event.worker} {cause}; shard {shard}, {place}")
        if counts[key] < most and not worker.timed_out:
            self._again.append(shard)
            return [note]
        if self.skip_failed and index is not None and not event.machine_lost:
            error = "hang" if worker.killed else describe_exit(event)
            skipped = FailedSample(index, "process", error)
            self._failed[shard] = (*self._failed.get(shard, ()), skipped)
            self._again.append(shard)
            return [note, Note(f"sample {index} is skipped: {error}")]
        self.given_up.append(shard)
        suspect = self.samples_of(shard)[-1] if index is None else index
        lost = errors.WorkerLost(
            f"shard {shard}: its worker process died {_times(counts[key])}, "
            f"at last in {place}: {cause}.\n"
            f"  Reproduce: {self.describe_sample(suspect)}"
        )
        self.error = self.error or lost
        if len(self.given_up) >= self.limits.lost_shards:
            self._drain(self.error)
        return [note]

    def _current_sample(self, worker: _Worker) -> int | None:
        """Sample that a busy worker makes; None while it writes the files of the shard."""
        absent = {failure.index for failure in worker.failed}
        made = [index for index in self.samples_of(worker.shard) if index not in absent]
        return made[worker.done] if worker.done < len(made) else None

    def _recycle(self, event: ShardDone, worker: _Worker) -> list[Action]:
        cap, first = self.limits.rss_bytes, worker.first_rss_bytes
        if first is None:
            worker.first_rss_bytes = first = event.rss_bytes
        if cap is None or worker.state is State.LEAVING:
            return []
        if event.rss_bytes <= max(cap, self.limits.rss_growth * first):
            return []
        worker.state = State.LEAVING
        text = f"worker {event.worker} holds {event.rss_bytes / 1e6:.0f} MB and is replaced"
        return [Note(text), Dismiss(event.worker)]


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


def describe_exit(event: Exited) -> str:
    """Describe the end of a process."""
    if event.cause:
        return event.cause
    if event.exit_code >= 0:
        return f"exited with status {event.exit_code}"
    number = -event.exit_code
    try:
        name = signal.Signals(number).name
    except ValueError:
        name = "unknown"
    text = f"killed by signal {number} ({name})"
    if event.out_of_memory:
        return f"{text}; the kernel was out of memory"
    return f"{text}; out of memory?" if number == -system_calls.KILLED else text
