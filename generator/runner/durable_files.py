"""Durable file operations: after a crash a file is there with all its bytes, or not at all.

Every call here that changes a disk is followed by the fsync that makes it last. POSIX promises
nothing about a rename that no fsync of the folder followed (Pillai et al., "All file systems are
not created equal", OSDI 2014).
"""

from __future__ import annotations

import errno
import hashlib
import os
import shutil
import stat
from collections.abc import Container, Iterator
from contextlib import contextmanager
from pathlib import Path

from gen_data.generator.core.errors import StorageError

CHUNK_BYTES = 1 << 20
Inode = tuple[int, int]
IRREGULAR = -1
"""The "size" of a directory entry that is neither a file nor a folder."""


def hash_file(path: Path) -> str:
    """Hexadecimal digest of a file's bytes."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while chunk := file.read(CHUNK_BYTES):
            digest.update(chunk)
    return digest.hexdigest()


def sync_path(path: Path) -> None:
    """Make a file's bytes, or a folder's entries, survive a power cut."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def sync_tree(folder: Path, synced: Container[Inode] = ()) -> None:
    """Sync every file and every folder under ``folder``, itself last.

    ``synced`` are the inodes of files whose bytes are known to be on disk.
    """
    for inner, _, names in os.walk(folder, topdown=False):
        for name in names:
            path = Path(inner, name)
            if get_inode(path) not in synced:
                sync_path(path)
        sync_path(Path(inner))


def get_inode(path: Path) -> Inode:
    """What all hard links to one file have in common."""
    status = path.lstat()
    return (status.st_dev, status.st_ino)


def write_durably(path: Path, data: bytes, scratch: Path) -> None:
    """Create or replace a file in one step; ``scratch`` holds the unfinished one.

    ``scratch`` must be on the same file system.
    """
    unfinished = scratch / f"{path.name}.part"
    with unfinished.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    unfinished.replace(path)
    sync_path(path.parent)


def move_durably(source: Path, target: Path) -> None:
    """Rename a file or folder, so that both parents remember it after a power cut.

    Raises:
        OSError: also when ``target`` is a folder that holds something: rename(2) never replaces
            one.
    """
    source.rename(target)
    sync_path(target.parent)
    sync_path(source.parent)


def make_folder(path: Path) -> None:
    """Create a folder and its missing parents, each one durable; existing ones are fine."""
    missing = []
    while not path.is_dir():
        missing.append(path)
        path = path.parent
    for folder in reversed(missing):
        folder.mkdir(exist_ok=True)
        sync_path(folder.parent)


def tree_sizes(folder: Path) -> dict[str, int]:
    """``{path relative to folder: bytes}`` of everything in it, sorted; empty if it is missing.

    What is neither file nor folder, such as a symbolic link, has the size IRREGULAR.
    """
    sizes: dict[str, int] = {}
    for inner, folders, names in os.walk(folder):
        links = [name for name in folders if Path(inner, name).is_symlink()]
        for name in (*names, *links):
            path = Path(inner, name)
            status = path.lstat()
            regular = stat.S_ISREG(status.st_mode)
            sizes[path.relative_to(folder).as_posix()] = status.st_size if regular else IRREGULAR
    return dict(sorted(sizes.items()))


def free_bytes(path: Path) -> int:
    """Bytes that this user may still write to the file system of the nearest existing parent."""
    while not path.exists():
        path = path.parent
    return shutil.disk_usage(path).free


@contextmanager
def storage_errors(folder: Path, resume_command: str) -> Iterator[None]:
    """Turn an OSError of the block into a StorageError that says what, where and how to go on."""
    try:
        yield
    except OSError as error:
        raise storage_error(error, folder, resume_command) from error


def storage_error(error: OSError, folder: Path, resume_command: str) -> StorageError:
    """The message for a failed file operation somewhere in ``folder``."""
    path = os.fsdecode(error.filename) if error.filename is not None else str(folder)
    name = errno.errorcode.get(error.errno or 0, type(error).__name__)
    try:
        free = f"{free_bytes(folder):,} bytes free"
    except OSError:
        free = "free space unknown"
    message = f"{path}: {error.strerror or error} ({name}); {free}."
    if not resume_command:
        return StorageError(message)
    advice = (
        "What is finished stays. After the cause is gone, go on with"
        if _is_folder(folder)
        else "Nothing was written. Choose another folder with --out, or after the cause is gone try"
    )
    return StorageError(f"{message}\n  {advice}:\n    {resume_command}")


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:
        # A name that is too long, or a loop of links.
        return False
