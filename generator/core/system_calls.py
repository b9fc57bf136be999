"""System calls that not every platform has, and their replacements.

POSIX systems lack some calls of Linux, Windows lacks most of them. Each function here tests for the
call itself, not for the name of the system.
"""

import ctypes
import os
import signal
import socket
import tempfile
import time
from contextlib import suppress
from functools import cache
from importlib import import_module
from typing import Any

try:
    _fcntl: Any = import_module("fcntl")
except ImportError:
    _fcntl = None

READ_FLAGS = os.O_RDONLY
"""Flags to open a file for reading: no wait for a writer, no inheritance, no change of bytes."""
for _name in ("O_NONBLOCK", "O_CLOEXEC", "O_BINARY"):
    READ_FLAGS |= getattr(os, _name, 0)

CAN_PASS_FILES = hasattr(os, "fork")
"""Whether new processes can be given open files, as workers need."""
KILLED = -int(getattr(signal, "SIGKILL", 9))
"""Exit status of a process that was killed."""
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # of glibc's malloc.h
_LOCKED_BYTE = 1 << 30
"""Windows locks bytes, which nobody else may read then: one beyond the content."""


_HEAP_ARRAY_BYTES = 32 << 20
_HEAP_FREE_BYTES = 128 << 20


@cache
def keep_freed_memory() -> None:
    """Let this process use the memory of freed arrays again, instead of new pages of the system.

    By default, glibc unmaps arrays of 128 kB and more when they are freed and trims the heap; every
    temporary image then costs one page fault per 4 kB. ``malloc_trim`` still returns everything.
    The two sizes limit arrays on the heap, as far as glibc allows, and the free memory at its end.
    Other C libraries have no such settings.
    """
    with suppress(AttributeError, OSError, TypeError):
        libc = ctypes.CDLL(None)
        for parameter, size in (
            (_M_MMAP_THRESHOLD, _HEAP_ARRAY_BYTES),
            (_M_TRIM_THRESHOLD, _HEAP_FREE_BYTES),
        ):
            libc.mallopt(parameter, size)


def stop_signals() -> tuple[signal.Signals, ...]:
    """The signals that ask a program to end."""
    names = ("SIGINT", "SIGTERM", "SIGHUP")
    return tuple(signal.Signals[name] for name in names if hasattr(signal, name))


def usable_cores() -> int:
    """Number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def try_lock(descriptor: int) -> bool:
    """Lock an open file for this process; False if another process holds the lock.

    The system releases the lock when the process ends in any way.

    Raises:
        OSError: the file system has no locks.
    """
    try:
        if _fcntl is not None:
            _fcntl.flock(descriptor, _fcntl.LOCK_EX | _fcntl.LOCK_NB)
        else:
            os.lseek(descriptor, _LOCKED_BYTE, os.SEEK_SET)
            _msvcrt().locking(descriptor, _msvcrt().LK_NBLCK, 1)
            os.lseek(descriptor, 0, os.SEEK_SET)
    except (BlockingIOError, PermissionError):
        return False
    return True


def wait_for_lock(descriptor: int) -> None:
    """Lock an open file as soon as no other process holds the lock."""
    if _fcntl is not None:
        _fcntl.flock(descriptor, _fcntl.LOCK_EX)
        return
    while not try_lock(descriptor):
        # Windows itself waits for ten seconds at most.
        time.sleep(0.1)


def anonymous_file(name: str) -> int:
    """Descriptor of a new file without a path, which ends with its last descriptor."""
    if hasattr(os, "memfd_create"):
        return os.memfd_create(name)
    with tempfile.TemporaryFile(prefix=name) as file:
        return os.dup(file.fileno())


def wake_channel() -> tuple[socket.socket, socket.socket]:
    """A reader and a writer, neither of which blocks: for signal handlers and waits."""
    pair = socket.socketpair()
    for end in pair:
        end.setblocking(False)
    return pair


def read_binary(*descriptors: int) -> None:
    """Keep Windows from changing line ends and ends of files on descriptors."""
    if hasattr(os, "O_BINARY"):
        for descriptor in descriptors:
            _msvcrt().setmode(descriptor, os.O_BINARY)


def _msvcrt() -> Any:
    return import_module("msvcrt")
