"""What was computed once: on disk by content hash, and in memory within a bound.

A disk entry is one file of plain arrays, written whole or not at all, so that any number of
processes may share a folder. An entry that cannot be read is made anew; a folder that cannot be
written only costs time.

A file is its CRC-32 (of all that follows) and the length of its head, four bytes each, lowest
first; the head, JSON: key and, array by array, name, dtype and shape; the arrays' bytes, each
filled up to a multiple of 64. A scene asks for hundreds, and an ``.npz`` takes far longer to read.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import struct
import tempfile
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.bounded_cache import ByteCache, Sized
from gen_data.generator.core.serialization import canonical_json

S = TypeVar("S", bound=Sized)
T = TypeVar("T")
Arrays = dict[str, NDArray[Any]]

FORMAT = 2
"""Raised whenever the same sources would be stored as other arrays."""
# Little: renderers and physics engines keep what they made of it.
_MEMORY_BYTES = 24 * 1024 * 1024
_FRAME = struct.Struct("<II")
_ALIGNMENT = 64


def content_key(description: Mapping[str, Any]) -> str:
    """sha256, in hexadecimal, of a description of everything that a result depends on."""
    return sha256(canonical_json(description).encode()).hexdigest()


@dataclass(frozen=True)
class DiskCache:
    """Arrays by key.

    Attributes:
        folder: Made when first written to.
    """

    folder: Path

    def arrays(self, key: str, compute: Callable[[], Arrays]) -> Arrays:
        """The arrays stored under a content key, computed and stored if they are not there."""
        path = self.folder / key[:2] / f"{key}.arrays"
        stored = _load(path, key)
        if stored is not None:
            return stored
        arrays = compute()
        # A full disk or a read-only home must not stop a run: it will only be slower.
        with contextlib.suppress(OSError):
            _store(path, key, arrays)
        return arrays

    def load_json(self, name: str) -> dict[str, Any]:
        """A JSON object stored by name; empty if there is none or it is damaged."""
        try:
            value = json.loads((self.folder / name).read_bytes())
        except (OSError, ValueError):
            return {}
        return value if isinstance(value, dict) else {}

    def store_json(self, name: str, value: Mapping[str, Any]) -> None:
        """Store a JSON object by name, if the folder can be written."""
        with contextlib.suppress(OSError):
            _replace(self.folder / name, lambda file: file.write(canonical_json(value).encode()))


@dataclass(frozen=True, eq=False, slots=True)
class _Held:
    """A result and the size of the arrays that it is made of."""

    value: Any
    nbytes: int


class Store:
    """Results by content key, in memory before disk before computing them.

    Memory is bounded by total size; what was used least recently leaves first.
    """

    def __init__(self, disk: DiskCache, max_bytes: int = _MEMORY_BYTES) -> None:
        self._disk = disk
        self._memory: ByteCache[_Held] = ByteCache(max_bytes)

    def get(self, key: str, compute: Callable[[], Arrays], view: Callable[[Arrays], T]) -> T:
        """The result under a key of its own.

        Args:
            key: Content key of everything that the result depends on.
            compute: Makes its arrays when they are nowhere.
            view: Makes the result of its arrays.
        """

        def read() -> _Held:
            arrays = self._disk.arrays(key, compute)
            return _Held(view(arrays), sum(array.nbytes for array in arrays.values()))

        value: T = self._memory.get(key, read).value
        return value

    def computed(self, key: str, compute: Callable[[], S]) -> S:
        """The result under a key of its own, kept in memory only."""

        def make() -> _Held:
            value = compute()
            return _Held(value, value.nbytes)

        value: S = self._memory.get(key, make).value
        return value

    def __len__(self) -> int:
        """How many results are in memory."""
        return len(self._memory)


def _load(path: Path, key: str) -> Arrays | None:
    """The arrays of a file; None if it is not there, not whole, or another key's."""
    try:
        data = path.read_bytes()
        check, size = _FRAME.unpack_from(data)
        if zlib.crc32(memoryview(data)[4:]) != check:
            return None
        head = json.loads(data[_FRAME.size : _FRAME.size + size])
    except (OSError, ValueError, struct.error):
        return None
    if head["key"] != key:
        return None
    arrays, start = {}, _FRAME.size + size
    for name, kind, shape in head["arrays"]:
        # Arrays made from bytes are read-only.
        arrays[name] = np.frombuffer(data, kind, math.prod(shape), start).reshape(shape)
        start += arrays[name].nbytes + _padding(arrays[name].nbytes)
    return arrays


def _store(path: Path, key: str, arrays: Arrays) -> None:
    listed = [[name, array.dtype.str, array.shape] for name, array in arrays.items()]
    head = json.dumps({"key": key, "arrays": listed}).encode()
    head += b" " * _padding(_FRAME.size + len(head))
    body = bytearray(struct.pack("<I", len(head)) + head)
    for array in arrays.values():
        body += array.tobytes() + bytes(_padding(array.nbytes))
    _replace(path, lambda file: file.write(struct.pack("<I", zlib.crc32(body)) + body))


def _padding(size: int) -> int:
    """Bytes that follow so many, so that every array's numbers begin where processors like it."""
    return -size % _ALIGNMENT


def _replace(path: Path, write: Callable[[Any], object]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor, temporary = tempfile.mkstemp(dir=path.parent, suffix=".part")
    try:
        with os.fdopen(descriptor, "wb") as file:
            write(file)
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
