"""Temporary folders that do not outlive their process for long, even if it is killed.

A process holds a lock on each of its folders, which the kernel releases when the process ends in
any way. Folders without a holder are removed when the next one is made. Windows has no locks on
folders: there, a file in it that is open cannot be removed.
"""

import os
import shutil
import stat
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from gen_data.core.system_calls import try_lock

PREFIX = "gen-data-"
_LOCKS_FOLDERS = hasattr(os, "O_DIRECTORY")
_LOCK_NAME = ".lock"
YOUNG_S = 60.0
"""Age up to which a folder without a holder stays: its process may be about to lock it."""


class TemporaryFolder:
    """A new folder below the system's folder for temporary files.

    Args:
        purpose: Part of its name.

    Attributes:
        path: Path of the folder.
    """

    def __init__(self, purpose: str) -> None:
        remove_abandoned(Path(tempfile.gettempdir()))
        self.path = Path(tempfile.mkdtemp(prefix=f"{PREFIX}{purpose}-"))
        self._lock = _open_lock(self.path)
        with suppress(OSError):  # A file system without locks; nothing is removed there.
            try_lock(self._lock)

    def remove(self) -> None:
        """Remove the folder with its contents."""
        if not _LOCKS_FOLDERS:
            os.close(self._lock)
        shutil.rmtree(self.path, ignore_errors=True)
        if _LOCKS_FOLDERS:
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
    is_own = not hasattr(os, "getuid") or status.st_uid == os.getuid()
    if not is_own or not stat.S_ISDIR(status.st_mode) or time.time() - status.st_mtime < YOUNG_S:
        return
    descriptor = _open_lock(path)
    try:
        is_abandoned = try_lock(descriptor)
        if is_abandoned and _LOCKS_FOLDERS:
            shutil.rmtree(path, ignore_errors=True)
    finally:
        os.close(descriptor)
    if is_abandoned and not _LOCKS_FOLDERS:
        shutil.rmtree(path, ignore_errors=True)


def _open_lock(folder: Path) -> int:
    """Descriptor to lock for a folder: its own, or where that cannot be, of a file in it."""
    if _LOCKS_FOLDERS:
        return os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    return os.open(folder / _LOCK_NAME, os.O_RDWR | os.O_CREAT)
