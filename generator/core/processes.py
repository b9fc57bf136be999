"""Settings of processes: one thread for sums, no child outlives its parent, no stray output."""

import ctypes
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress

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
WATCH_S = 0.5
"""Interval at which a parent is checked where the kernel does not signal its end [s]."""


def end_with_parent(parent_pid: int) -> None:
    """End this process when its parent ends, for whatever reason. Call it first in a new process.

    On Linux the kernel kills it, also after ``exec``; elsewhere a thread watches the parent.
    """
    if _has_death_signal():
        ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    else:
        threading.Thread(target=_watch_parent, args=(parent_pid,), daemon=True).start()
    if not _is_parent(parent_pid):
        # The parent ended before the call above.
        os._exit(1)


def forbid_core_dumps() -> None:
    """Let a crash of this process write no core file, on systems that write any."""
    with suppress(ImportError):
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def tie(command: Sequence[str], variables: Mapping[str, str] | None = None) -> list[str]:
    """Command that runs another one, which ends with this process and ignores Ctrl-C itself.

    Start it with SIGINT blocked (``interrupts_blocked``): Ctrl-C may come before it is ignored.

    Args:
        command: Program and arguments.
        variables: Added to its environment.
    """
    # Python 3.10 does not know -P, which keeps the folder of this file from the module path.
    options = ["-P"] if sys.version_info >= (3, 11) else []
    added = [f"{name}={value}" for name, value in (variables or {}).items()]
    return [sys.executable, *options, __file__, str(os.getpid()), *added, "--", *command]


@contextmanager
def interrupts_blocked() -> Iterator[None]:
    """Block SIGINT: a new process inherits the mask until it ignores SIGINT itself."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def ignore_interrupts() -> None:
    """Ignore SIGINT, also in later programs of this process, and unblock it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
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


def _has_death_signal() -> bool:
    return sys.platform == "linux"


def _is_parent(pid: int) -> bool:
    # Windows keeps the number of a parent that has ended; opening its handle reveals the end.
    return os.getppid() == pid and (not hasattr(os, "startfile") or _is_running(pid))


def _is_running(pid: int) -> bool:
    kernel = ctypes.windll.kernel32  # type: ignore[attr-defined]
    synchronize, timeout = 0x0010_0000, 0x102  # <winnt.h>, <winerror.h>
    handle = kernel.OpenProcess(synchronize, False, pid)
    runs = bool(handle) and kernel.WaitForSingleObject(handle, 0) == timeout
    if handle:
        kernel.CloseHandle(handle)
    return runs


def _watch_parent(pid: int) -> None:
    while _is_parent(pid):
        time.sleep(WATCH_S)
    os._exit(1)


def _run_tied(pid: int, command: Sequence[str]) -> int:
    """Run a command where ``exec`` would end the thread that watches; its exit status."""
    with subprocess.Popen(command) as child:
        while _is_parent(pid):
            with suppress(subprocess.TimeoutExpired):
                return child.wait(WATCH_S)
        child.kill()
    return 1


def _main(pid: int, arguments: list[str]) -> None:
    ignore_interrupts()
    end = arguments.index("--")
    command = arguments[end + 1 :]
    for variable in arguments[:end]:
        # The next program inherits the variables of the C library.
        os.putenv(*variable.split("=", 1))
    if not _has_death_signal():
        sys.exit(_run_tied(pid, command))
    end_with_parent(pid)
    os.execvp(command[0], command)


if __name__ == "__main__":
    _main(int(sys.argv[1]), sys.argv[2:])
