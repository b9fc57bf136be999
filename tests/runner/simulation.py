"""A run with virtual processes: they are started slowly, die at birth, stop, and answer late.

``python -m tests.runner.simulation FIRST_SEED SEEDS``
``python -m tests.runner.simulation cluster WORKERS SHARDS LOSS``

The second form simulates one run on a cluster, each of whose machines is lost with probability LOSS
per sample, and prints its efficiency and the load of the supervisor.

Drives the production supervisor on a virtual clock. Processes are independent: commands reach
it through a pipe after a delay, its messages arrive late but in order, and its end arrives after
the messages that it sent before. Everything follows from the seed.
"""

import heapq
import random
import sys
import time
from collections import Counter
from dataclasses import dataclass, field, replace

from gen_data.core.errors import GenDataError, Interrupted, StorageError, WorkerLost
from gen_data.runner import worker_events
from gen_data.runner.supervisor import Limits, Supervisor

SHARD_SIZE = 3
TICK_S = 0.5
LIMITS = Limits(silence_s=40.0, start_s=60.0, farewell_s=10.0, rss_bytes=1000)
END_S = 10_000.0
"""A run that has not ended by then never ends."""


@dataclass(frozen=True)
class Faults:
    """Probabilities of faults.

    Attributes:
        dies_at_start, stops_at_start: For a new process.
        dies, stops: For a process, per sample.
        dies_after_commit: For a process that has committed a shard and not reported it.
        stays: For a process that was dismissed.
        loses_machine: For the machine of a process, per sample.
        poisoned: Index of a sample that kills its process, or -1.
        fails_at: Index of a sample that cannot be written, or -1.
        abort_s: Instant of Ctrl-C.
    """

    dies_at_start: float = 0.0
    stops_at_start: float = 0.0
    dies: float = 0.0
    stops: float = 0.0
    dies_after_commit: float = 0.0
    stays: float = 0.0
    loses_machine: float = 0.0
    poisoned: int = -1
    fails_at: int = -1
    abort_s: float = float("inf")


def random_faults(rng: random.Random, samples: int) -> Faults:
    """Draw which faults occur, and how often; many runs have a few kinds only."""

    def rate(most: float) -> float:
        return rng.choice((0.0, 0.0, most / 10.0, most))

    return Faults(
        dies_at_start=1.0 if rng.random() < 0.05 else rate(0.4),
        stops_at_start=rate(0.2),
        dies=rate(0.1),
        stops=rate(0.05),
        dies_after_commit=rate(0.2),
        stays=rate(0.5),
        loses_machine=rate(0.05),
        poisoned=rng.randrange(samples) if rng.random() < 0.2 else -1,
        fails_at=rng.randrange(samples) if rng.random() < 0.1 else -1,
        abort_s=rng.uniform(0.0, 60.0) if rng.random() < 0.2 else float("inf"),
    )


@dataclass
class Process:
    """A virtual process, as the operating system sees it."""

    shard: int = -1
    stopped_s: float | None = None
    killed_s: float | None = None
    ended: bool = False
    leaves: bool = False
    delivered_s: float = 0.0
    read_s: float = 0.0
    began_s: float = 0.0


@dataclass
class Run:
    """One run from a seed. Every broken promise is an AssertionError that names the seed.

    Attributes:
        size: Number of shards and of workers; None = drawn.
        chosen_faults: None = drawn.
        sample_s: Longest time of a sample.
        late_s: Longest delay of a command or a message.
        limits: Limits of the supervisor.
        busy_s: Virtual time in which processes worked on shards that they committed.
        handling_s: Real time in which the supervisor handled events.
        events: Number of events.
    """

    seed: int
    supervisor_type: type[Supervisor] = Supervisor
    size: tuple[int, int] | None = None
    chosen_faults: Faults | None = None
    sample_s: float = 2.0
    late_s: float = 5.0
    limits: Limits = LIMITS
    busy_s: float = 0.0
    handling_s: float = 0.0
    events: int = 0
    committed: Counter[int] = field(default_factory=Counter)
    attempts: Counter[int] = field(default_factory=Counter)
    spawned: int = 0

    def __post_init__(self) -> None:
        """Draw the size of the run and its faults."""
        self.rng = random.Random(self.seed)
        self.shards, self.workers = self.size or (self.rng.randint(1, 12), self.rng.randint(1, 4))
        samples = self.shards * SHARD_SIZE
        self.faults = self.chosen_faults or random_faults(self.rng, samples)
        self.processes: dict[int, Process] = {}
        self.now_s = 0.0
        self.ended_s = END_S
        self._agenda: list[tuple[float, int, str, int, object]] = []
        self._added = 0
        self.supervisor = self.supervisor_type(
            shards=range(self.shards),
            samples_of=lambda shard: range(shard * SHARD_SIZE, (shard + 1) * SHARD_SIZE),
            workers=self.workers,
            describe_sample=str,
            limits=self.limits,
        )

    def execute(self) -> GenDataError | None:
        """Run until the supervisor is finished, and check its promises."""
        self._at(0.0, "tick")
        if self.faults.abort_s < END_S:
            self._at(self.faults.abort_s, "abort")
        self._carry_out(self.supervisor.start(0.0))
        while not self.supervisor.finished:
            self.now_s, _, what, number, detail = heapq.heappop(self._agenda)
            self._expect(self.now_s < END_S, "it never ends")
            getattr(self, f"_on_{what}")(number, detail)
        self._check()
        return self.supervisor.error

    def _check(self) -> None:
        error, given_up = self.supervisor.error, set(self.supervisor.given_up)
        missing = set(range(self.shards)) - set(self.committed)
        living = [n for n, p in self.processes.items() if not p.ended]
        self._expect(not living, f"processes {living} are left")
        most = self.limits.shard_attempts + self.limits.machine_losses - 1
        most = most if self.faults.loses_machine else self.limits.shard_attempts
        self._expect(
            max(self.attempts.values(), default=0) <= most, f"more attempts of a shard than {most}"
        )
        self._expect(not missing or error is not None, f"shards {missing} are missing silently")
        if isinstance(error, WorkerLost) and len(given_up) < 3 and "they start" not in str(error):
            self._expect(missing <= given_up, f"shards {missing} are missing, not only {given_up}")
        if self.faults.abort_s < self.now_s and isinstance(error, Interrupted):
            took_s = self.now_s - self.faults.abort_s
            self._expect(took_s <= self.late_s + 1.0, f"it took {took_s:.1f} s to stop")
        for process in self.processes.values():
            self._check_patience(process)

    def _check_patience(self, process: Process) -> None:
        """Within 5 s and the delay of messages after the limit, a stopped process is killed."""
        if process.stopped_s is not None and process.killed_s is not None:
            heard_s = max(process.stopped_s, process.delivered_s)
            patience_s = max(self.limits.silence_s, self.limits.start_s)
            took_s = process.killed_s - heard_s
            self._expect(took_s <= patience_s + 5.0, f"hung for {took_s:.1f} s")

    def _carry_out(self, actions: list[worker_events.Action]) -> None:
        for action in actions:
            if isinstance(action, worker_events.Spawn):
                self._spawn(action.worker)
            elif isinstance(action, (worker_events.Assign, worker_events.Dismiss)):
                self._send_command(action)
            elif isinstance(action, worker_events.Kill):
                process = self.processes[action.worker]
                process.killed_s = process.killed_s or self.now_s
                self._later(0.2, "end", action.worker, -9)
        if not self.size:
            self._check_number_of_processes()

    def _check_number_of_processes(self) -> None:
        working = [p for p in self.processes.values() if not (p.ended or p.killed_s or p.leaves)]
        self._expect(len(working) <= self.workers, "too many processes")

    def _spawn(self, number: int) -> None:
        self.spawned += 1
        self._expect(self.spawned < 200 + 2 * self.shards + self.workers, "endless starting")
        self.processes[number] = Process()
        self._later(3.0, "started", number)

    def _send_command(self, action: worker_events.Assign | worker_events.Dismiss) -> None:
        process = self.processes[action.worker]
        process.leaves = isinstance(action, worker_events.Dismiss)
        if isinstance(action, worker_events.Assign):
            self.attempts[action.shard] += 1
        if isinstance(action, worker_events.Assign) and not self.size:
            holders = [
                n
                for n, p in self.processes.items()
                if p.shard == action.shard and not p.ended and p.killed_s is None
            ]
            self._expect(not holders, f"shard {action.shard} is given to {holders} and another")
        process.read_s = max(process.read_s, self.now_s + self._delay())
        self._at(process.read_s, "command", action.worker, action)

    def _on_started(self, number: int, detail: object) -> None:
        del detail
        if self._happens(self.faults.dies_at_start):
            self._on_end(number, self.rng.choice((-9, -11, 1)))
        elif self._happens(self.faults.stops_at_start):
            self.processes[number].stopped_s = self.now_s
        else:
            self._send(number, worker_events.Ready(number))

    def _on_command(self, number: int, action: object) -> None:
        if self._is_dead_or_stopped(number):
            return
        if isinstance(action, worker_events.Assign):
            self.processes[number].shard = action.shard
            self.processes[number].began_s = self.now_s
            self._later(self.sample_s, "sample", number, 0)
        elif self._happens(self.faults.stays):
            self.processes[number].stopped_s = self.now_s
        else:
            self._later(1.0, "end", number, 0)

    def _on_sample(self, number: int, done: object) -> None:
        if self._is_dead_or_stopped(number):
            return
        assert isinstance(done, int)
        shard = self.processes[number].shard
        index = shard * SHARD_SIZE + done
        if self._happens(self.faults.loses_machine):
            self._on_end(number, 1, machine_lost=True)
        elif index == self.faults.poisoned or self._happens(self.faults.dies):
            self._on_end(number, self.rng.choice((-9, -11, 1)))
        elif self._happens(self.faults.stops):
            self.processes[number].stopped_s = self.now_s
        elif index == self.faults.fails_at:
            self._send(number, worker_events.Failed(number, StorageError("the disk is full")))
            self._on_end(number, 1)
        else:
            self._send(number, worker_events.SampleDone(number, shard, index))
            last = done + 1 == SHARD_SIZE
            self._later(self.sample_s, "commit" if last else "sample", number, done + 1)

    def _on_commit(self, number: int, detail: object) -> None:
        del detail
        if self._is_dead_or_stopped(number):
            return
        process = self.processes[number]
        self.committed[process.shard] += 1
        self.busy_s += self.now_s - process.began_s
        if self._happens(self.faults.dies_after_commit):
            self._on_end(number, -9)
            return
        rss_bytes = self.rng.choice((0, 2000))
        self._send(
            number, worker_events.ShardDone(number, process.shard, SHARD_SIZE, 1, 0, rss_bytes)
        )
        process.shard = -1

    def _on_end(self, number: int, code: object, machine_lost: bool = False) -> None:
        process = self.processes[number]
        if process.ended:
            return
        assert isinstance(code, int)
        process.ended, process.shard = True, -1
        out_of_memory = code == -9 and not self.size and self.rng.random() < 0.2
        self._send(
            number, worker_events.Exited(number, code, out_of_memory, machine_lost=machine_lost)
        )

    def _on_event(self, number: int, event: object) -> None:
        del number
        self._tell(event)  # type: ignore[arg-type]

    def _on_tick(self, number: int, detail: object) -> None:
        del number, detail
        self._tell(worker_events.Tick())
        self._at(self.now_s + TICK_S, "tick")

    def _on_abort(self, number: int, detail: object) -> None:
        del number, detail
        self._tell(worker_events.Abort(Interrupted("stop")))

    def _tell(self, event: worker_events.Event) -> None:
        self.handling_s -= time.perf_counter()
        actions = self.supervisor.handle(event, self.now_s)
        self.handling_s += time.perf_counter()
        self.events += 1
        self._carry_out(actions)

    def _send(self, number: int, event: worker_events.Event) -> None:
        """Put a message into the pipe; it arrives after those before it."""
        process = self.processes[number]
        process.delivered_s = max(process.delivered_s, self.now_s + self._delay())
        self._at(process.delivered_s, "event", number, event)

    def _is_dead_or_stopped(self, number: int) -> bool:
        process = self.processes[number]
        return process.ended or process.stopped_s is not None

    def _delay(self) -> float:
        return self.rng.choice((0.0, 0.0, 0.01, self.late_s * self.rng.random()))

    def _later(self, most_s: float, what: str, number: int, detail: object = None) -> None:
        self._at(self.now_s + self.rng.uniform(0.0, most_s), what, number, detail)

    def _at(self, time_s: float, what: str, number: int = -1, detail: object = None) -> None:
        self._added += 1
        heapq.heappush(self._agenda, (time_s, self._added, what, number, detail))

    def _happens(self, probability: float) -> bool:
        return self.rng.random() < probability

    def _expect(self, condition: bool, fault: str) -> None:
        assert condition, f"seed {self.seed}, {self.now_s:.1f} s: {fault} ({self.faults})"


def simulate_cluster(workers: int, shards: int, loss: float) -> str:
    """Simulate a run on so many machines, with a minute per shard; returns its figures in words."""
    faults = Faults(loses_machine=loss, dies_at_start=loss, dies_after_commit=loss)
    limits = replace(LIMITS, silence_s=300.0)
    made = Run(0, Supervisor, (shards, workers), faults, sample_s=40.0, late_s=0.1, limits=limits)
    error = made.execute()
    end = "complete" if error is None else f"{type(error).__name__}: {error}"
    return (
        f"{workers} workers, {shards} shards, {made.supervisor.deaths} lost: {end} after "
        f"{made.now_s:.0f} s; {made.busy_s / (workers * made.now_s):.1%} of the workers' time was "
        f"used; the supervisor took {made.handling_s / made.events * 1e6:.0f} us per event, "
        f"{made.handling_s / made.now_s:.2%} of a core"
    )


def main() -> None:
    if sys.argv[1] == "cluster":
        print(simulate_cluster(int(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4])))
        return
    first, count = int(sys.argv[1]), int(sys.argv[2])
    ends: Counter[str] = Counter()
    for seed in range(first, first + count):
        error = Run(seed).execute()
        ends["complete" if error is None else type(error).__name__] += 1
    print(f"{count} runs: {dict(sorted(ends.items()))}")


if __name__ == "__main__":
    main()
