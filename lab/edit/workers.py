"""Processes that render for the page: new jobs of a tab replace its waiting ones.

A job that has become obsolete may run on for a moment, because most jobs take less time than the
start of a process; then its process is ended. A crash of a process costs one picture.
"""

from __future__ import annotations

import gc
import os
import pickle
import subprocess
import sys
import threading
import time
import traceback
from collections import OrderedDict, deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

from gen_data.core import activity, errors, processes
from gen_data.core.system_calls import KILLED

if TYPE_CHECKING:
    from pathlib import Path

    from gen_data.lab.edit.samples import Studio

GRACE_S = 1.5
"""Time that a job may run on after it was replaced."""
LIMIT_S = 120.0
"""Longest time of a job."""
ACTIVITY_S = 0.25
"""Smallest time between two reported activities."""
TRIES = 2
"""A job whose process crashes is tried once more: the kernel may have run out of memory."""
MEMORY_BYTES = 3 << 30
"""Resident memory from which a process is replaced between two jobs."""
NICENESS = 0
"""Niceness of the processes: the page and the browser have priority."""

_START = (
    "import os, sys; scratch, *sys.path[:] = sys.argv[1:]; "
    "os.environ.update({'TMPDIR': scratch} if scratch else {}); "
    f"os.environ.update(dict.fromkeys({processes.SINGLE_THREADED!r}, '1')); "
    "from gen_data.lab.edit.workers import work; work()"
)


class Job(Protocol):
    """Work for a process; picklable."""

    def run(self, studio: Studio) -> Any:
        """Do the work with the engines of the process."""
        ...


@dataclass(frozen=True)
class Ready:
    """A job that reports that the process has finished its imports."""

    def run(self, studio: Studio) -> None:
        """Nothing."""


@dataclass(frozen=True)
class Ticket:
    """A job of a tab.

    Attributes:
        client: Key of the tab, or of one of its tasks.
        slot: Place of the result.
        tries: How often its process has ended.
    """

    client: str
    slot: int
    job: Job
    tries: int = 0


@dataclass(frozen=True)
class Refused:
    """Result of a job without one: the message of its error."""

    text: str


@dataclass(frozen=True)
class Reply:
    """Answer of a process: the result, and its resident memory in bytes (0 = unknown)."""

    result: Any
    memory_bytes: int


@dataclass(frozen=True)
class Activity:
    """A message of a process before its reply: its activity, and the number of earlier ones."""

    text: str
    count: int


@dataclass
class Queue:
    """Waiting jobs by tab; tabs take turns.

    Attributes:
        later: Clients whose jobs run after the jobs of all others.
    """

    waiting: OrderedDict[str, deque[Ticket]] = field(default_factory=OrderedDict)
    current: dict[str, frozenset[Ticket]] = field(default_factory=dict)
    later: set[str] = field(default_factory=set)

    def replace(self, client: str, tickets: Sequence[Ticket], *, later: bool = False) -> None:
        """Replace all jobs of a client; running ones become outdated."""
        (self.later.add if later and tickets else self.later.discard)(client)
        self.current[client] = frozenset(tickets)
        self.waiting.pop(client, None)
        if tickets:
            self.waiting[client] = deque(tickets)
        else:
            self.current.pop(client)

    def put_back(self, ticket: Ticket, again: Ticket) -> None:
        """Try a job once more, before the others of its client."""
        self.current[ticket.client] = self.current[ticket.client] - {ticket} | {again}
        self.waiting.setdefault(ticket.client, deque()).appendleft(again)

    def take(self) -> Ticket | None:
        """The next job, from the least recently served client; None if none waits.

        Clients in ``later`` come last.
        """
        if not self.waiting:
            return None
        soon = (name for name in self.waiting if name not in self.later)
        client = next(soon, next(iter(self.waiting)))
        tickets = self.waiting.pop(client)
        ticket = tickets.popleft()
        if tickets:
            self.waiting[client] = tickets
        return ticket

    def is_current(self, ticket: Ticket) -> bool:
        """Whether the result is still needed."""
        return ticket in self.current.get(ticket.client, ())


class Workers:
    """Processes and the jobs that wait for them. A context manager that ends every process.

    Args:
        count: Number of processes.
        deliver: Receives each ticket that is current, and its result; called in threads.
        hear: Receives each ticket that is current, and the activities of its process.
        scratch: Folder for temporary files, which killed processes leave; None = the usual one.
    """

    def __init__(
        self,
        count: int,
        deliver: Callable[[Ticket, Any], None],
        hear: Callable[[Ticket, Activity], None] = lambda *_: None,
        scratch: Path | None = None,
    ) -> None:
        self._scratch = str(scratch or "")
        self._deliver, self._hear = deliver, hear
        self._queue = Queue()
        self._changed = threading.Condition()
        self._closed = False
        self._running: dict[int, tuple[Ticket, subprocess.Popen[bytes]]] = {}
        self._children: dict[int, subprocess.Popen[bytes]] = {}
        self._threads = [
            threading.Thread(target=self._serve, args=(number,), daemon=True)
            for number in range(count)
        ]

    def __enter__(self) -> Workers:
        """Start the processes, which import while the page opens."""
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *exception: object) -> None:
        """End all processes."""
        with self._changed:
            self._closed = True
            children = list(self._children.values())
            self._changed.notify_all()
        for child in children:
            child.kill()
        for thread in self._threads:
            thread.join(5.0)

    def submit(self, client: str, jobs: Sequence[Job], *, later: bool = False) -> None:
        """Replace all jobs of a client by new ones; none forgets the client.

        Args:
            client: Key of a tab, or of one of its tasks.
            jobs: In their order.
            later: They wait for the jobs of all other clients.
        """
        with self._changed:
            tickets = [Ticket(client, k, job) for k, job in enumerate(jobs)]
            self._queue.replace(client, tickets, later=later)
            outdated = [r for r in self._running.values() if not self._queue.is_current(r[0])]
            self._changed.notify_all()
        for ticket, child in outdated:
            self._end_later(ticket, child, GRACE_S)

    @property
    def process_ids(self) -> list[int]:
        """Ids of the processes."""
        return [child.pid for child in self._children.values()]

    def _serve(self, number: int) -> None:
        """Loop of the thread of one process."""
        child = self._start(number)
        while (ticket := self._wait(number, child)) is not None:
            ended = self._end_later(ticket, child, LIMIT_S)
            reply = _ask(child, ticket.job, partial(self._tell, ticket))
            with self._changed:
                self._running.pop(number, None)
                is_current = self._queue.is_current(ticket) and not self._closed
                if reply is None and is_current and ticket.tries + 1 < TRIES and not ended.is_set():
                    self._queue.put_back(ticket, replace(ticket, tries=ticket.tries + 1))
                    self._changed.notify_all()
                    is_current = False
            if reply is None or reply.memory_bytes > MEMORY_BYTES:
                child.kill()
                status = child.wait()
                child = self._start(number)
            if is_current:
                self._deliver(ticket, reply.result if reply else Refused(_describe(status)))

    def _tell(self, ticket: Ticket, heard: Activity) -> None:
        if self._queue.is_current(ticket):
            self._hear(ticket, heard)

    def _wait(self, number: int, child: subprocess.Popen[bytes]) -> Ticket | None:
        """The next job; None when the workers are closed."""
        with self._changed:
            while not self._closed:
                ticket = self._queue.take()
                if ticket is not None:
                    self._running[number] = ticket, child
                    return ticket
                self._changed.wait()
        return None

    def _end_later(
        self, ticket: Ticket, child: subprocess.Popen[bytes], delay_s: float
    ) -> threading.Event:
        """End a process if it still does this job after a time; the event is then set."""
        ended = threading.Event()

        def end() -> None:
            with self._changed:
                runs = any(t is ticket and c is child for t, c in self._running.values())
            if runs:
                ended.set()
                child.kill()

        timer = threading.Timer(delay_s, end)
        timer.daemon = True
        timer.start()
        return ended

    def _start(self, number: int) -> subprocess.Popen[bytes]:
        command = processes.tie([sys.executable, "-c", _START, self._scratch, *sys.path])
        with self._changed:
            with processes.interrupts_blocked():
                child = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
            self._children[number] = child
            if self._closed:
                child.kill()
        _ask(child, Ready(), lambda _: None)  # Others take the jobs while this one imports.
        return child


def _ask(
    child: subprocess.Popen[bytes], job: Job, hear: Callable[[Activity], None]
) -> Reply | None:
    """Reply of a process to a job, after its activities; None if the process ends."""
    assert child.stdin is not None
    assert child.stdout is not None
    try:
        pickle.dump(job, child.stdin)
        child.stdin.flush()
        while isinstance(reply := pickle.load(child.stdout), Activity):
            hear(reply)
    except (OSError, EOFError, pickle.UnpicklingError):
        return None
    found: Reply = reply
    return found


def _describe(status: int) -> str:
    if status == KILLED:
        return (
            f"the process of this picture was ended: it took longer than {LIMIT_S:g} s, or the "
            "machine ran out of memory; the page goes on with another process"
        )
    return f"the process of this picture crashed (exit status {status}); the page goes on"


def work() -> None:
    """Loop of a process: jobs from standard input, replies to standard output."""
    from gen_data.lab.edit.samples import Studio

    with suppress(AttributeError, OSError):  # Windows has no nice.
        os.nice(NICENESS)
    processes.forbid_core_dumps()
    # Scenes are many objects that stay: Python searches them for garbage at every 700 new ones.
    gc.set_threshold(50_000, 20, 100)
    source, replies = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    # Output of native code must not mix with the replies.
    os.dup2(2, 1)
    studio = Studio()
    activity.listen(_Reporter(replies).tell)
    while True:
        try:
            job: Job = pickle.load(source)
        except EOFError:
            return
        pickle.dump(Reply(_run(job, studio), _memory_bytes()), replies)
        replies.flush()


class _Reporter:
    """Sends activities, at most a few per second."""

    def __init__(self, replies: Any) -> None:
        self._replies, self._lock = replies, threading.Lock()
        self._count, self._next_s = 0, 0.0

    def tell(self, text: str) -> None:
        """Send an activity, unless the last one was just sent."""
        with self._lock:
            self._count += 1
            if time.monotonic() >= self._next_s:
                self._next_s = time.monotonic() + ACTIVITY_S
                pickle.dump(Activity(text, self._count), self._replies)
                self._replies.flush()


def _run(job: Job, studio: Studio) -> Any:
    try:
        return job.run(studio)
    except errors.GenDataError as refused:
        return Refused(str(refused))
    except MemoryError:
        raise
    except Exception as error:
        traceback.print_exc()
        lacking = errors.lack_of_memory(error)
        return Refused(lacking or f"{type(error).__name__}: {error} (a fault of gen-data)")


def _memory_bytes() -> int:
    """Resident memory of this process; 0 where the system has no such file."""
    try:
        with open("/proc/self/statm", encoding="ascii") as file:  # noqa: PTH123
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return 0
