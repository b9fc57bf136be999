"""Durable file operations: after a crash, a file exists with all its bytes or not at all.

Every change is followed by an fsync. POSIX guarantees nothing about a rename without an fsync of
its folder (Pillai et al., "All file systems are not created equal", OSDI 2014).
"""

import errno
import hashlib
import os
import shutil
import stat
import sys
from collections.abc import Container, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from gen_data.core.errors import StorageError

FULL = frozenset({errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC)})
IS_WINDOWS = sys.platform == "win32"
CHUNK_BYTES = 1 << 20
SYNC_THREADS = 16
Inode = tuple[int, int]
IRREGULAR = -1
"""The "size" of a directory entry that is neither a file nor a folder."""


def hash_file(path: Path | str) -> str:
    """Hexadecimal SHA-256 of a file."""
    digest = hashlib.sha256()
    with Path(path).open("rb") as file:
        while chunk := file.read(CHUNK_BYTES):
            digest.update(chunk)
    return digest.hexdigest()


def sync_path(path: Path | str) -> None:
    """Flush the bytes of a file, or the entries of a folder, to the disk.

    Windows opens no folders, and flushes only files that are open for writing.
    """
    if IS_WINDOWS and Path(path).is_dir():
        return
    descriptor = os.open(path, os.O_RDWR if IS_WINDOWS else os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def sync_tree(folder: Path, synced: Container[Inode] = ()) -> None:
    """Flush every file, then every folder in ``folder``, itself last.

    ``synced`` are the inodes of files that are already on the disk. Files are flushed together:
    a file system writes its journal once for several that wait.
    """
    # Paths are text: for thousands of small files, objects cost as much as the flushes.
    folders, files = [], []
    for inner, _, names in os.walk(folder, topdown=False):
        folders.append(inner)
        paths = (f"{inner}/{name}" for name in names)
        files += [path for path in paths if get_inode(path) not in synced]
    with ThreadPoolExecutor(SYNC_THREADS) as pool:
        for _ in pool.map(_sync_paths, (files[k::SYNC_THREADS] for k in range(SYNC_THREADS))):
            pass
    _sync_paths(folders)


def _sync_paths(paths: Iterable[str]) -> None:
    for path in paths:
        sync_path(path)


def get_inode(path: Path | str) -> Inode:
    """Device and inode number, equal for all hard links to one file."""
    status = os.lstat(path)
    return (status.st_dev, status.st_ino)


def write_durably(path: Path, data: bytes, scratch: Path) -> None:
    """Create or replace a file atomically.

    ``scratch`` is a folder for the unfinished file, on the same file system.
    """
    unfinished = scratch / f"{path.name}.part"
    with unfinished.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    unfinished.replace(path)
    sync_path(path.parent)


def move_durably(source: Path, target: Path) -> None:
    """Rename a file or folder durably.

    Raises:
        OSError: among others, ``target`` is a folder with contents, which rename(2) never replaces.
    """
    source.rename(target)
    sync_path(target.parent)
    sync_path(source.parent)


def make_folder(path: Path) -> None:
    """Create a folder and its missing parents durably; existing folders are not an error."""
    missing = []
    while not path.is_dir():
        missing.append(path)
        path = path.parent
    for folder in reversed(missing):
        folder.mkdir(exist_ok=True)
        sync_path(folder.parent)


Contents = tuple[dict[str, int], tuple[str, ...]]
"""Sizes of files by path, and empty folders; see ``scan_tree``."""


def tree_sizes(folder: Path, without: str = "") -> dict[str, int]:
    """``{path relative to folder: bytes}`` of its contents, sorted; empty if it does not exist.

    Anything but files and folders, such as a symbolic link, has the size IRREGULAR. The folder
    named ``without`` directly in ``folder`` is left out.
    """
    return scan_tree(folder, without)[0]


def scan_tree(folder: Path, without: str = "") -> Contents:
    """``tree_sizes`` and ``empty_folders`` in one pass; nothing is said of unreadable folders."""
    sizes: dict[str, int] = {}
    empty: list[str] = []
    unread = [""]
    while unread:
        prefix = unread.pop()
        try:
            with os.scandir(f"{folder}/{prefix}") as listed:
                entries = list(listed)
        except OSError:
            continue
        for entry in entries:
            if not prefix and entry.name == without and entry.is_dir():
                continue
            if entry.is_dir(follow_symlinks=False):
                unread.append(f"{prefix}{entry.name}/")
            else:
                status = entry.stat(follow_symlinks=False)
                regular = stat.S_ISREG(status.st_mode)
                sizes[prefix + entry.name] = status.st_size if regular else IRREGULAR
        if prefix and not entries:
            empty.append(prefix.rstrip("/"))
    return dict(sorted(sizes.items())), tuple(sorted(empty))


def empty_folders(folder: Path, without: str = "") -> tuple[str, ...]:
    """Paths, relative to ``folder``, of the folders in it that contain nothing at all; sorted.

    The folder named ``without`` directly in ``folder`` is left out.
    """
    return scan_tree(folder, without)[1]


def format_bytes(size: float) -> str:
    """A size with its unit: ``1.2 GB``."""
    for factor, unit in ((1e12, "TB"), (1e9, "GB"), (1e6, "MB")):
        if size >= factor:
            return f"{size / factor:.1f} {unit}"
    return f"{size / 1e3:.1f} kB"


def free_bytes(path: Path) -> int:
    """Free bytes for this user on the file system of the nearest existing parent."""
    return shutil.disk_usage(nearest_folder(path)).free


def nearest_folder(path: Path) -> Path:
    """The path, or its nearest parent that exists."""
    while not path.exists():
        path = path.parent
    return path


@contextmanager
def storage_errors(folder: Path, resume_command: str) -> Iterator[None]:
    """Turn an OSError of the block into a StorageError with path, cause and resume command."""
    try:
        yield
    except OSError as error:
        raise storage_error(error, folder, resume_command) from error


def storage_error(error: OSError, folder: Path, resume_command: str) -> StorageError:
    """Error for a failed file operation in ``folder``."""
    path = os.fsdecode(error.filename) if error.filename is not None else str(folder)
    name = errno.errorcode.get(error.errno or 0, type(error).__name__)
    message = f"{path}: {error.strerror or error} ({name})"
    if error.errno in FULL:
        message += f"; {_describe_free_space(folder)}"
    message += "."
    if not resume_command:
        return StorageError(message)
    advice = (
        "Finished shards are kept. After removing the cause, resume with"
        if _is_folder(folder)
        else "Nothing was written. Choose another folder with --out, or remove the cause and run"
    )
    return StorageError(f"{message}\n  {advice}:\n    {resume_command}")


def _describe_free_space(folder: Path) -> str:
    try:
        return f"{format_bytes(free_bytes(folder))} are free"
    except OSError:
        return "the free space is unknown"


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:
        # A name that is too long, or a loop of links.
        return False
