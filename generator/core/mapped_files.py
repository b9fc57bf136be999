"""Read-only views of files, which processes share and the system may drop.

``mmap.mmap`` keeps a descriptor open for as long as the map lives; a street maps more files than
the 1,024 descriptors that most systems allow a process. Maps made here keep none.
"""

import ctypes
import mmap
import weakref
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

_FAILED = ctypes.c_void_p(-1).value
_MADV_DONTNEED = getattr(mmap, "MADV_DONTNEED", 4)

_mapped: dict[int, int] = {}
"""Size of each map by its address [bytes]."""


def map_file(descriptor: int, size: int) -> memoryview:
    """The content of an open file, mapped; the descriptor may be closed.

    The map lives as long as views of it. The file must not become shorter meanwhile.

    Args:
        descriptor: Descriptor of a file that can be read.
        size: File size [bytes], not 0.

    Raises:
        OSError: the system cannot map the file.
    """
    libc = _libc()
    if libc is None:
        return memoryview(mmap.mmap(descriptor, size, access=mmap.ACCESS_READ))
    pages = -(-size // mmap.PAGESIZE)
    length = pages * mmap.PAGESIZE
    address = libc.mmap(None, length, mmap.PROT_READ, mmap.MAP_SHARED, descriptor, 0)
    if address == _FAILED:
        number = ctypes.get_errno()
        raise OSError(number, "cannot map a file")
    # Whole pages: ctypes keeps the key of every array type, and so of every length.
    content = (ctypes.c_ubyte * length).from_address(address)
    _mapped[address] = length
    # At exit, the system unmaps everything; other threads may still read.
    weakref.finalize(content, _unmap, address, length).atexit = False
    return memoryview(content).cast("B")[:size].toreadonly()


def owned_bytes(*arrays: Any) -> int:
    """Bytes of NumPy arrays that are not views of mapped files."""
    return sum(array.nbytes for array in arrays if not _is_mapped(array))


def _is_mapped(array: Any) -> bool:
    while isinstance(array, np.ndarray):
        array = array.base
    return isinstance(array, memoryview) and isinstance(array.obj, ctypes.Array | mmap.mmap)


def release_mapped_pages() -> None:
    """Drop the pages of all maps from this process; they come back when they are read."""
    for address, length in _joined(sorted(_mapped.items())):
        drop_pages(address, length)


def _joined(maps: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Addresses and lengths of maps, neighbours as one: there are a thousand of them."""
    joined: list[tuple[int, int]] = []
    for address, length in maps:
        start, before = joined[-1] if joined else (0, 0)
        if start + before == address:
            joined[-1] = start, before + length
        else:
            joined.append((address, length))
    return joined


def drop_pages(address: int, length: int) -> None:
    """Drop the pages of a map of an unmodified file; locked ones simply stay."""
    libc = _libc()
    if libc is not None:
        libc.madvise(address, length, _MADV_DONTNEED)


def limit_mapped_pages(kept_bytes: int) -> None:
    """Drop the pages of all maps if more bytes of files than these are resident."""
    if read_statm(2) > kept_bytes:
        release_mapped_pages()


class PageLimiter:
    """Drops the pages of all maps whenever many have been read.

    Pages of libraries are not counted: with them in the sum, pages that a scene's views share would
    be dropped.
    """

    def __init__(self) -> None:
        self._remained_bytes = read_statm(2)

    def limit_growth(self, growth_bytes: int) -> None:
        """Drop the pages if so many bytes of files were read since they were last dropped."""
        self._remained_bytes = min(self._remained_bytes, read_statm(2))
        limit_mapped_pages(self._remained_bytes + growth_bytes)


def read_statm(column: int) -> int:
    """A column of procfs's ``statm`` of this process [bytes]; 0 without procfs.

    Column 1 is the resident memory, column 2 the part of it that consists of pages of files.
    """
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[column])
    except OSError:
        return 0
    return pages * mmap.PAGESIZE


def _unmap(address: int, length: int) -> None:
    _mapped.pop(address, None)
    libc = _libc()
    assert libc is not None
    libc.munmap(address, length)


@cache
def _libc() -> Any:
    """The C library; None where it has no ``mmap``."""
    try:
        libc = ctypes.CDLL(None, use_errno=True)
        number, size, place = ctypes.c_int, ctypes.c_size_t, ctypes.c_void_p
        libc.mmap.argtypes = (place, size, number, number, number, ctypes.c_long)
        libc.mmap.restype = place
        libc.munmap.argtypes = (place, size)
        libc.madvise.argtypes = (place, size, number)
    except (AttributeError, OSError, TypeError):
        return None
    return libc
