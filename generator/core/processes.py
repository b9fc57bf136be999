"""Settings of processes: one thread for sums, no child outlives its parent, no stray output."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

SINGLE_THREADED = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)
"""Environment variables that limit threads, read when numpy is imported.

Sums in BLAS depend on the number of threads, and with them the last bits of a pose.
"""

PR_SET_PDEATHSIG = 1  # <linux/prctl.h>


def end_with_parent(parent_pid: int) -> None:
    """Make the kernel kill this process when its parent ends, for whatever reason.

    The setting survives ``exec``. Call it first in a new process; where the system is not Linux,
    only a parent that has already ended is noticed.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent_pid:
        # The parent ended before the call above.
        os._exit(1)


def tie(command: Sequence[str]) -> list[str]:
    """Command that runs another one, which ends with this process and ignores Ctrl-C itself.

    Start it with SIGINT blocked (``interrupts_blocked``): Ctrl-C may come before it is ignored.
    """
    return [sys.executable, "-P", __file__, str(os.getpid()), *command]


@contextmanager
def interrupts_blocked() -> Iterator[None]:
    """Block SIGINT: a new process inherits the mask until it ignores SIGINT itself."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def ignore_interrupts() -> None:
    """Ignore SIGINT, also in later programs of this process, and unblock it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


@contextmanager
def silence_stdio() -> Iterator[None]:
    """Discard the output of native code on standard output and standard error.

    Some libraries print a banner on import, or warn about missing hardware, bypassing Python's
    streams. Exceptions are not affected.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    kept = [(fd, os.dup(fd)) for fd in (1, 2)]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for fd, _ in kept:
            os.dup2(nowhere, fd)
        yield
    finally:
        for fd, copy in kept:
            os.dup2(copy, fd)
            os.close(copy)
        os.close(nowhere)


if __name__ == "__main__":
    end_with_parent(int(sys.argv[1]))
    ignore_interrupts()
    os.execvp(sys.argv[2], sys.argv[2:])
