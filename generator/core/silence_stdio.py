"""Keeping native libraries from writing where only the command line may."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def silence_stdio() -> Iterator[None]:
    """Drop what native code prints on standard output and standard error.

    Some libraries greet on import, or warn about hardware that nobody asked for, past Python's
    own streams; exceptions still tell of real faults.
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
