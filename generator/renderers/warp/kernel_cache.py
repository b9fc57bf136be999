"""Warp's cache of compiled kernels, checked: Warp runs any machine code that it finds there.

A file with the digests of all compiled modules lies next to them. A module that differs from its
digest, or that is truncated, is removed; its next user compiles it again.

A distribution may bring compiled modules (``kernel_bundle.py``). They enter the cache under the
names given by Warp, which contain the hash of all their inputs, and Warp finds or ignores them like
its own.

A read-only cache, of an image or of another user, is used through a private folder that links its
modules and receives missing ones.
"""

import errno
import json
import os
import re
import shutil
import stat
import struct
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from hashlib import sha256
from pathlib import Path

from gen_data.core.errors import CacheWarning, StorageError

OURS = "wp_gen_data."
SUMS_NAME = "gen-data-sums.json"
SOURCES = frozenset({".cpp", ".cu"})
_SOURCE_PATTERNS = tuple(f"*{suffix}" for suffix in sorted(SOURCES))
UNFINISHED = re.compile(r"_p\d+_t\d+$")
"""Warp compiles in folders with the numbers of process and thread, and renames them."""
ELF = b"\x7fELF"
NEED_BYTES = 16 << 20
"""Free space below which nothing is compiled; the modules of every frame take 8 MB."""


def fill_cache(folder: Path, stamp: str, fill: Callable[[Path], None]) -> Path:
    """Fill a cache with compiled modules, or a private folder if it cannot be written.

    Args:
        folder: The cache.
        stamp: Name of the file in it that marks it as filled.
        fill: Adds missing modules to a folder.

    Returns:
        The folder to be used: ``folder``, or one that links its modules.

    Raises:
        StorageError: modules are missing, and neither folder can be written.

    Warns:
        CacheWarning: modules are missing, and are compiled into the private folder.
    """
    try:
        fill(folder)
        return folder
    except OSError as error:
        reason = f"{error.filename or folder}: {error.strerror or error}"
    is_filled = (folder / stamp).exists() and not _inspect(folder)[1]
    try:
        private = link_modules(folder)
        if is_filled:
            (private / stamp).touch()
        elif not (private / stamp).exists():
            text = f"{reason}; kernels are compiled into {private}. {REMEDY}"
            warnings.warn(text, CacheWarning, stacklevel=2)
        fill(private)
        return private
    except OSError as error:
        if is_filled:
            return folder
        second = f"{error.filename or tempfile.gettempdir()}: {error.strerror or error}"
        raise StorageError(
            f"{reason}; nor can kernels be kept elsewhere: {second}. {REMEDY}"
        ) from error


REMEDY = "Make the cache writable, or point WARP_CACHE_PATH or XDG_CACHE_HOME to another folder"


@contextmanager
def no_private_folder() -> Iterator[None]:
    """Turn an OSError of the block, which needs the private folder, into a StorageError."""
    try:
        yield
    except OSError as error:
        place = error.filename or tempfile.gettempdir()
        raise StorageError(
            f"{place}: compiled kernels cannot be kept there ({error.strerror or error}). {REMEDY}"
        ) from error


def require_space(folder: Path) -> None:
    """Refuse a disk that the compiler would fill. Raises OSError as from a full disk."""
    if shutil.disk_usage(folder).free < NEED_BYTES:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(folder))


def private_folder() -> Path:
    """Folder of kernels of this user alone, below the folder of temporary files; created.

    Raises:
        OSError: it cannot be created, or is not of this user alone: machine code is run from it.
    """
    user = os.getuid() if hasattr(os, "getuid") else 0
    folder = Path(tempfile.gettempdir(), f"gendata-kernels-{user}")
    folder.mkdir(mode=0o700, exist_ok=True)
    status = folder.lstat()
    is_own = not hasattr(os, "getuid") or (status.st_uid == user and not status.st_mode & 0o077)
    if not stat.S_ISDIR(status.st_mode) or not is_own:
        raise OSError(errno.EPERM, "not a folder of this user alone", str(folder))
    return folder


def link_modules(folder: Path) -> Path:
    """A private folder with links to the undamaged modules of a cache.

    Raises:
        OSError: it cannot be created.
    """
    key = sha256(os.fsencode(folder)).hexdigest()[:8]
    private = private_folder() / f"{folder.name}-{key}"
    private.mkdir(exist_ok=True)
    for link in private.iterdir():
        if link.is_symlink() and not link.exists():
            link.unlink(missing_ok=True)
    damaged = _inspect(folder)[1]
    for module in folder.glob(f"{OURS}*"):
        if module not in damaged and not UNFINISHED.search(module.name):
            with suppress(FileExistsError):
                (private / module.name).symlink_to(module, target_is_directory=True)
    return private


def remove_damaged_modules(folder: Path) -> tuple[str, ...]:
    """Remove damaged modules of a cache; record new ones.

    One process at a time may call it.

    Returns:
        Names of the modules that were removed, sorted.
    """
    found, damaged = _inspect(folder)
    for module in damaged:
        if module.is_symlink():
            module.unlink()
        else:
            shutil.rmtree(module)
    kept = {name: digest for name, digest in found.items() if (folder / name).parent not in damaged}
    if kept != _read_sums(folder):
        _write_sums(folder, kept)
    return tuple(sorted(module.name for module in damaged))


def _inspect(folder: Path) -> tuple[dict[str, str], set[Path]]:
    """Digests of all compiled files by name, and the damaged modules; changes nothing."""
    known = _read_sums(folder)
    found: dict[str, str] = {}
    damaged: set[Path] = set()
    for path in _compiled_files(folder):
        name = path.relative_to(folder).as_posix()
        data = path.read_bytes()
        found[name] = sha256(data).hexdigest()
        if found[name] != known.get(name, found[name]) or _is_cut_off(path, data):
            damaged.add(path.parent)
    return found, damaged


def copy_modules(source: Path, target: Path) -> None:
    """Copy the compiled modules of one folder into another that lacks them, without sources.

    Each appears there whole. One process at a time may call it.
    """
    for module in sorted(source.glob(f"{OURS}*")):
        copy = target / module.name
        if copy.exists() or UNFINISHED.search(module.name):
            continue
        unfinished = target / f"{module.name}_p{os.getpid()}_t0"
        shutil.copytree(module, unfinished, ignore=shutil.ignore_patterns(*_SOURCE_PATTERNS))
        try:
            unfinished.rename(copy)
        except OSError:  # A process without the lock has just compiled it.
            shutil.rmtree(unfinished)
            if not copy.exists():
                raise


def _compiled_files(folder: Path) -> Iterator[Path]:
    for module in sorted(folder.glob(f"{OURS}*")):
        if module.is_dir() and not UNFINISHED.search(module.name):
            yield from (path for path in sorted(module.iterdir()) if path.suffix not in SOURCES)


def _is_cut_off(path: Path, data: bytes) -> bool:
    """Whether a file lacks its end: of object files, where ELF keeps the table of sections."""
    if path.suffix != ".o":
        return not data
    if len(data) < 64 or not data.startswith(ELF):
        return True
    (sections_at,) = struct.unpack_from("<Q", data, 0x28)
    size, count = struct.unpack_from("<HH", data, 0x3A)
    return bool(sections_at + size * count > len(data))


def _read_sums(folder: Path) -> dict[str, str]:
    try:
        sums = json.loads((folder / SUMS_NAME).read_bytes())
    except (OSError, ValueError):
        return {}
    return sums if isinstance(sums, dict) else {}


def _write_sums(folder: Path, sums: dict[str, str]) -> None:
    unfinished = folder / f"{SUMS_NAME}.{os.getpid()}"
    unfinished.write_text(json.dumps(sums, indent=0), encoding="utf-8")
    unfinished.replace(folder / SUMS_NAME)
