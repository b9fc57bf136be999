"""Returning memory to the system loses no byte."""

from __future__ import annotations

import ctypes
import mmap
from pathlib import Path

import numpy as np

from gen_data.generator.runner.resident_memory import release_memory, resident_file_bytes

SIZE = 8 << 20


def pattern() -> np.ndarray:
    """Eight megabytes without a repeated page."""
    return np.arange(SIZE // 4, dtype=np.uint32)


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
