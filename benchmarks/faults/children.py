"""Forked children that make the tiny data set, and system calls at which they fail."""

import os
import pickle
import re
import signal
import subprocess
import traceback
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, TypeVar

from benchmarks.faults.recorded_run import record
from gen_data.core.errors import GenDataError

T = TypeVar("T")
U = TypeVar("U")

UNEXPECTED = 99
"""Exit code of a child with an error that is not a GenDataError."""

WRITING_CALLS = [
    "mkdir", "openat", "write", "pwrite64", "fsync", "fdatasync", "rename", "renameat", "renameat2",
    "link", "linkat", "unlink", "unlinkat", "rmdir", "ftruncate", "close",
]  # fmt: skip


@dataclass(frozen=True)
class Ended:
    """End of a child: exit code, or the negative number of a signal, and its message."""

    code: int
    message: str


@dataclass(frozen=True)
class Call:
    """The ``number``-th call of a system call in a run, from 1."""

    name: str
    number: int


def fork_run(out: Path, message: Path, *, stopped: bool = False, **options: float) -> int:
    """Start a child that makes the data set in ``out``, in a separate process group.

    Args:
        out: Folder of the data set.
        message: File for the message of an error.
        stopped: Let it stop before the run, for a tracer; it goes on at SIGCONT.
        options: See ``Recording.make``.

    Returns:
        Its process id.
    """
    recording = record()
    pid = os.fork()
    if pid:
        return pid
    code = UNEXPECTED
    try:
        os.setpgid(0, 0)
        if stopped:
            os.kill(os.getpid(), signal.SIGSTOP)
        recording.make(out, **options)  # type: ignore[arg-type]
        code = 0
    except GenDataError as error:
        message.write_text(str(error), "utf-8")
        code = error.exit_code
    except BaseException:
        message.write_text(traceback.format_exc(), "utf-8")
    finally:
        os._exit(code)


def wait(pid: int, message: Path) -> Ended:
    """Wait for the end of a child."""
    _, status = os.waitpid(pid, 0)
    text = message.read_text("utf-8") if message.exists() else ""
    message.unlink(missing_ok=True)
    return Ended(os.waitstatus_to_exitcode(status), text)


def trace(out: Path, *options: str) -> Ended:
    """Make the data set under ``strace``, with these options."""
    message = out.with_name(f"{out.name}.message")
    pid = fork_run(out, message, stopped=True)
    os.waitpid(pid, os.WUNTRACED)
    arguments = ["strace", "-p", str(pid), *options]
    with subprocess.Popen(arguments, stderr=subprocess.PIPE, text=True) as tracer:
        assert tracer.stderr is not None
        for line in tracer.stderr:
            if "attached" in line:
                break
        os.kill(pid, signal.SIGCONT)
        ended = wait(pid, message)
        tracer.stderr.read()
    return ended


def writing_calls(folder: Path) -> list[Call]:
    """Every system call of a run that changes files of the data set, in order."""
    out, log = folder / "traced", folder / "strace.log"
    names = ",".join(WRITING_CALLS)
    trace(out, "-y", "-s", "4096", "-o", str(log), "-e", f"trace={names}")
    return list(_parse_log(log.read_text(errors="replace"), str(out)))


def _parse_log(text: str, out: str) -> Iterator[Call]:
    counts: Counter[str] = Counter()
    for line in text.splitlines():
        match = re.match(r"(\w+)\((.*)", line)
        if match is None:
            continue
        name, rest = match.groups()
        counts[name] += 1
        reads = name == "openat" and not re.search("O_CREAT|O_WRONLY|O_RDWR", rest)
        if out in rest and not reads:
            yield Call(name, counts[name])


def spread(function: Callable[[T], U], tasks: Sequence[T]) -> Iterator[U]:
    """Results of a function for all tasks, in order, from one forked process per core.

    Processes are killed at the end, as runs that they are in the middle of would ignore SIGTERM.
    """
    count = len(os.sched_getaffinity(0))
    workers = [_fork_worker(function, tasks[first::count]) for first in range(count)]
    try:
        for number in range(len(tasks)):
            yield pickle.load(workers[number % count][1])
    finally:
        for pid, results in workers:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
            results.close()


def _fork_worker(function: Callable[[T], U], tasks: Sequence[T]) -> tuple[int, BinaryIO]:
    """Process id of a child that does the tasks, and the pickled results."""
    reader, writer = os.pipe()
    pid = os.fork()
    if pid:
        os.close(writer)
        return pid, os.fdopen(reader, "rb")
    try:
        os.close(reader)
        with os.fdopen(writer, "wb") as file:
            for task in tasks:
                pickle.dump(function(task), file)
                file.flush()
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(0)
