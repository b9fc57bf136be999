"""Returning memory to the system loses no byte."""

import ctypes
import mmap
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from gen_data.runner.resident_memory import release_memory, resident_file_bytes

SIZE = 8 << 20


def pattern() -> np.ndarray:
    return np.arange(SIZE // 4, dtype=np.uint32)


@pytest.mark.slow
def test_pages_of_files_are_returned_and_come_back(tmp_path: Path) -> None:
    """A mapped file of 8 MB: its pages leave the process, its content does not change."""
    path = tmp_path / "file"
    path.write_bytes(pattern().tobytes())
    with path.open("rb") as file:
        seen = np.frombuffer(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ), np.uint32)
    np.testing.assert_array_equal(seen, pattern())
    before = resident_file_bytes()
    release_memory(file_bytes_kept=0)
    assert resident_file_bytes() < before - SIZE // 2
    np.testing.assert_array_equal(seen, pattern())


def test_fewer_pages_than_are_kept_stay(tmp_path: Path) -> None:
    """Nothing is released below the threshold."""
    path = tmp_path / "file"
    path.write_bytes(bytes(SIZE))
    with path.open("rb") as file:
        mapped = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    assert sum(mapped[::4096]) == 0
    before = resident_file_bytes()
    release_memory(file_bytes_kept=before + SIZE)
    assert resident_file_bytes() > before - SIZE // 2


def test_modified_pages_that_became_read_only_are_kept(tmp_path: Path) -> None:
    """Like the relocated data of a library: written once, then protected."""
    path = tmp_path / "file"
    path.write_bytes(bytes(SIZE))
    with path.open("rb") as file:
        mapped = mmap.mmap(file.fileno(), SIZE, flags=mmap.MAP_PRIVATE)
    values = np.frombuffer(mapped, np.uint32)
    values[:] = pattern()
    libc = ctypes.CDLL(None, use_errno=True)
    protected = libc.mprotect(
        ctypes.c_void_p(values.ctypes.data), ctypes.c_size_t(SIZE), mmap.PROT_READ
    )
    assert protected == 0, ctypes.get_errno()
    release_memory(file_bytes_kept=0)
    np.testing.assert_array_equal(values, pattern())


FILL_AND_TRIM = """
import ctypes
from gen_data.runner.resident_memory import (
    HEAP_GROWTH_BYTES, HeapTrimmer, private_bytes
)

libc = ctypes.CDLL(None)
libc.malloc.restype = ctypes.c_void_p
heap = HeapTrimmer()
before = private_bytes()


def fill_and_free(size):
    # Freed blocks of 64 kB below one that is in use.
    blocks = [ctypes.c_void_p(libc.malloc(1 << 16)) for _ in range(size >> 16)]
    for block in blocks:
        ctypes.memset(block, 1, 1 << 16)
    libc.malloc(1 << 16)
    for block in blocks:
        libc.free(block)


fill_and_free(HEAP_GROWTH_BYTES // 2)
heap.trim_if_grown()
print((private_bytes() - before) / HEAP_GROWTH_BYTES)
fill_and_free(2 * HEAP_GROWTH_BYTES)
print((private_bytes() - before) / HEAP_GROWTH_BYTES)
heap.trim_if_grown()
print((private_bytes() - before) / HEAP_GROWTH_BYTES)
"""
"""Prints growth over the threshold: below it, above it, and once trimmed."""


def test_the_heap_is_trimmed_once_it_has_grown_by_the_threshold() -> None:
    """Blocks below one still in use stay in the heap when they are freed, until it is trimmed.

    In a separate process, whose heap has no gaps yet.
    """
    done = subprocess.run(
        [sys.executable, "-c", FILL_AND_TRIM], capture_output=True, text=True, check=True
    )
    kept, grown, trimmed = map(float, done.stdout.split())
    assert kept == pytest.approx(0.5, abs=0.1)
    assert grown > 1.9
    assert trimmed < 0.1
