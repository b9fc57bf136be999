"""Memory of this process: reading it, and returning unused memory to the system.

The module imports nothing heavy, because workers import it first. Without Linux's procfs, it does
nothing.
"""

import ctypes
import gc
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from gen_data.core.mapped_files import drop_pages, limit_mapped_pages, read_statm

HEAP_GROWTH_BYTES = 48 * 1024 * 1024
"""Private memory that may be freed but not returned; trimming takes some milliseconds."""
FILE_BYTES_KEPT = 96 * 1024 * 1024
"""Pages of files that stay mapped between shards; releasing them takes some milliseconds."""

_COLLECTIONS_OF_NEW = 16
"""Collections among new objects until the next one among all."""


def resident_bytes() -> int:
    """Resident memory of this process; 0 without procfs."""
    return read_statm(1)


def resident_file_bytes() -> int:
    """The part of it that consists of pages of files, which other processes may share."""
    return read_statm(2)


def private_bytes() -> int:
    """Resident memory of this process without pages of files; 0 without procfs."""
    return resident_bytes() - resident_file_bytes()


@dataclass
class HeapTrimmer:
    """Returns freed memory to the system whenever private memory has grown.

    glibc keeps the gaps between arrays in use, which hold large temporary arrays of past samples.
    """

    _kept_bytes: int = field(default_factory=private_bytes)

    def trim_if_grown(self) -> None:
        """Trim the heap if private memory has grown by ``HEAP_GROWTH_BYTES`` since last time."""
        if private_bytes() > self._kept_bytes + HEAP_GROWTH_BYTES:
            _trim_heap()
            self._kept_bytes = private_bytes()


def _trim_heap() -> None:
    """Return the free pages of the heap to the system, where the C library can."""
    # Of the GNU C library; Windows has no library of all symbols.
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)


def release_memory(file_bytes_kept: int = FILE_BYTES_KEPT) -> None:
    """Return freed memory, and unmodified pages of files, to the system.

    glibc keeps the gaps between cached arrays otherwise. Most pages of libraries are read once,
    when they are loaded, and assets that were seen long ago are not read either; pages that are
    still needed come back from the page cache of the system without reading the disk.
    """
    _collect_garbage()
    _trim_heap()
    limit_mapped_pages(file_bytes_kept)
    # Listing all maps takes tens of milliseconds, and most pages of libraries are gone after once.
    if resident_file_bytes() <= file_bytes_kept:
        return
    with suppress(OSError):
        for start, end in list(_unmodified_files(Path("/proc/self/smaps").read_text())):
            drop_pages(start, end - start)


def _collect_garbage() -> None:
    """Collect unreachable objects: mostly among new objects only.

    Looking at all objects takes tens of milliseconds, and very few old ones are part of a cycle.
    """
    _, _, collections_of_new = gc.get_count()
    gc.collect(2 if collections_of_new >= _COLLECTIONS_OF_NEW else 1)


def _unmodified_files(smaps: str) -> Iterator[tuple[int, int]]:
    """First and last address of each mapping of a file that cannot be, and never was, written.

    Relocated data of libraries are read-only but modified: they would be lost, and are left alone.
    """
    place, is_candidate = (0, 0), False
    for line in smaps.splitlines():
        word, _, rest = line.partition(" ")
        if not word.endswith(":"):
            low, _, high = word.partition("-")
            place = int(low, 16), int(high, 16)
            flags, _, _, inode, *_ = rest.split()
            is_candidate = inode != "0" and "w" not in flags
        elif word == "Anonymous:" and is_candidate and rest.split()[0] == "0":
            yield place
