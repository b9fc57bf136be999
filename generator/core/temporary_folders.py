"""Temporary folders that do not outlive their process for long, even if it is killed.

A process holds a lock on each of its folders, which the kernel releases when the process ends in
any way. Folders without a holder are removed when the next one is made.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

PREFIX = "gen-data-"
YOUNG_S = 60.0
"""Age up to which a folder without a holder stays: its process may be about to lock it."""


class TemporaryFolder:
    """A new folder below the system's folder for temporary files.

    Args:
        purpose: Part of its name.

    Attributes:
        path: Of the folder.
    """

    def __init__(self, purpose: str) -> None:
        remove_abandoned(Path(tempfile.gettempdir()))
        self.path = Path(tempfile.mkdtemp(prefix=f"{PREFIX}{purpose}-"))
        self._lock = os.open(self.path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        with suppress(OSError):  # A file system without locks; nothing is removed there.
            fcntl.flock(self._lock, fcntl.LOCK_EX)

    def remove(self) -> None:
        """Remove the folder with its contents."""
        shutil.rmtree(self.path, ignore_errors=True)
        os.close(self._lock)


@contextmanager
def temporary_folder(purpose: str) -> Iterator[Path]:
    """Provide a new folder in the block; ``purpose`` is part of its name."""
    folder = TemporaryFolder(purpose)
    try:
        yield folder.path
    finally:
        folder.remove()


def remove_abandoned(parent: Path) -> None:
    """Remove this user's temporary folders in ``parent`` whose processes have ended."""
    for path in parent.glob(f"{PREFIX}*"):
        try:
            _remove_if_abandoned(path)
        except OSError:
            # In use, just removed by another process, or on a file system without locks.
            continue


def _remove_if_abandoned(path: Path) -> None:
    status = path.lstat()
    if status.st_uid != os.getuid() or time.time() - status.st_mtime < YOUNG_S:
        return
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        shutil.rmtree(path, ignore_errors=True)
    finally:
        os.close(descriptor)
