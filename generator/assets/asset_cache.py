"""Cache of computed arrays: on disk by content hash, in memory up to a size.

A disk entry is one file of plain arrays, written atomically: any number of processes may
share a folder. Unreadable entries are computed again; an unwritable folder only costs time.

A file holds its CRC-32 (of all bytes that follow) and the length of its header, four bytes each,
little-endian; the header, JSON: key and, per array, name, dtype and shape; the arrays' bytes, each
padded to a multiple of 64. This is much faster to read than ``.npz``; a scene reads hundreds.

Arrays of large files are views of the mapped file: processes share its pages, and only pages that
are read occupy memory. Entries are replaced or removed, never changed in place.
"""

import contextlib
import json
import math
import os
import struct
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

import numpy as np
from deflate import crc32
from numpy.typing import NDArray

from gen_data.core.bounded_cache import ByteCache, CountCache, Sized
from gen_data.core.mapped_files import map_file, owned_bytes
from gen_data.core.recent_files import remove_least_recent
from gen_data.core.serialization import canonical_json

S = TypeVar("S", bound=Sized)
T = TypeVar("T")
Arrays = dict[str, NDArray[Any]]

MAX_BYTES = 20_000_000_000
"""Bound of the files of one folder; all shipped assets take about 8 GB."""
_CHECKED_KEYS = 512
"""The size is measured after one write in so many, which keys choose: it takes about a second."""
FORMAT = 3
"""Increased whenever the same sources are stored as different arrays."""
# Small, since renderers and physics engines keep their own copies.
_MEMORY_BYTES = 12 * 1024 * 1024
"""Of results that are stored, and as much of others, which their scene alone has."""
_RESULTS = 1024
"""Results kept in memory, a few kilobytes each in addition to their arrays."""
_PREFIX = struct.Struct("<II")
_ALIGNMENT = 64
# A mapping occupies whole pages, and a process may have 65,530 mappings.
_MAPPED_BYTES_MIN = 64 * 1024
_CHUNK_BYTES = 256 * 1024
_INTACT_FILES = 16_384
_CHECKED = "user.gen_data.checked"
"""Attribute of a large file: its version whose checksum was found right, and when."""
_BOOT_ID = Path("/proc/sys/kernel/random/boot_id")
"""Of Linux: differs after each start of the machine."""


def content_key(description: Mapping[str, Any]) -> str:
    """Hexadecimal sha256 of a description of everything that a result depends on."""
    return sha256(canonical_json(description).encode()).hexdigest()


@dataclass(frozen=True)
class DiskCache:
    """Arrays by key in a folder.

    Attributes:
        folder: Created by the first write.
        max_bytes: Bound of all files together, earlier formats included; the least
            recently used ones are removed.
    """

    folder: Path
    max_bytes: int = MAX_BYTES
    _intact: CountCache[None] = field(
        default_factory=lambda: CountCache(_INTACT_FILES), init=False, repr=False, compare=False
    )

    def arrays(self, key: str, compute: Callable[[], Arrays]) -> Arrays:
        """Load the arrays of a content key, read-only; compute and store them if missing."""
        path = self._path(key)
        stored = _load(path, key, self._intact)
        if stored is not None:
            return stored
        arrays = compute()
        # A full disk or a read-only home only makes a run slower.
        with contextlib.suppress(OSError):
            _store(path, key, arrays)
            self._make_room(key)
            if sum(array.nbytes for array in arrays.values()) >= _MAPPED_BYTES_MIN:
                return _load(path, key, self._intact) or arrays
        return arrays

    def _make_room(self, written: str) -> None:
        if int(written[:8], 16) % _CHECKED_KEYS == 0:
            remove_least_recent(self.folder.glob("format-*"), self.max_bytes)

    def find(self, key: str) -> Arrays | None:
        """Load the arrays of a content key; None if they are not stored."""
        return _load(self._path(key), key, self._intact)

    def _path(self, key: str) -> str:
        # Versions of this program that store other arrays may share the folder. As text: a scene
        # reads hundreds of files, and a Path takes longer than opening one.
        return f"{self.folder}/format-{FORMAT}/{key[:2]}/{key}.arrays"

    def load_json(self, name: str) -> dict[str, Any]:
        """Load a JSON object by name; empty if it is missing or damaged."""
        try:
            value = json.loads((self.folder / name).read_bytes())
        except (OSError, ValueError):
            return {}
        return value if isinstance(value, dict) else {}

    def store_json(self, name: str, value: Mapping[str, Any]) -> None:
        """Store a JSON object by name; ignore an unwritable folder."""
        with contextlib.suppress(OSError):
            _write_atomically(
                self.folder / name, lambda file: file.write(canonical_json(value).encode())
            )


@dataclass(frozen=True, eq=False, slots=True)
class _CachedValue:
    """A result and the total size of its arrays."""

    value: Any
    nbytes: int


class Store:
    """Results by content key, looked up in memory, then on disk, else computed.

    Memory is bounded by number and total size, views of mapped files aside; the least recently used
    results are evicted first.
    """

    def __init__(self, disk: DiskCache, max_bytes: int = _MEMORY_BYTES) -> None:
        self._disk = disk
        self._memory: ByteCache[_CachedValue] = ByteCache(max_bytes, _RESULTS)
        self._passing: ByteCache[_CachedValue] = ByteCache(max_bytes, _RESULTS)

    def get(self, key: str, compute: Callable[[], Arrays], view: Callable[[Arrays], T]) -> T:
        """Look up or compute a result.

        Args:
            key: Content key of everything that the result depends on.
            compute: Computes the arrays if they are not stored.
            view: Builds the result from its arrays.
        """

        def read() -> _CachedValue:
            arrays = self._disk.arrays(key, compute)
            return _CachedValue(view(arrays), owned_bytes(*arrays.values()))

        value: T = self._memory.get(key, read).value
        return value

    def computed(self, key: str, compute: Callable[[], S]) -> S:
        """Look up or compute a result that is kept in memory only."""

        def make() -> _CachedValue:
            value = compute()
            return _CachedValue(value, value.nbytes)

        value: S = self._passing.get(key, make).value
        return value

    def __len__(self) -> int:
        """Number of results in memory."""
        return len(self._memory) + len(self._passing)


def encode_arrays(key: str, arrays: Arrays) -> bytes:
    """Encode arrays in the format of a cache file."""
    return b"".join(_encode_parts(key, arrays))


def _encode_parts(key: str, arrays: Arrays) -> list[bytes | memoryview]:
    """The parts of a cache file; arrays are not copied."""
    listed = [[name, array.dtype.str, array.shape] for name, array in arrays.items()]
    head = json.dumps({"key": key, "arrays": listed}).encode()
    head += b" " * _padding(_PREFIX.size + len(head))
    parts: list[bytes | memoryview] = [struct.pack("<I", len(head)) + head]
    for array in arrays.values():
        parts += [_bytes_of(array), bytes(_padding(array.nbytes))]
    checksum = 0
    for part in parts:
        checksum = crc32(part, checksum)
    return [struct.pack("<I", checksum), *parts]


def _bytes_of(array: NDArray[Any]) -> memoryview:
    """Bytes of an array in C order."""
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8).data


def decode_arrays(data: bytes, key: str) -> Arrays | None:
    """Decode the arrays of a cache file; None if they are damaged or have another key.

    Arrays hold numbers only: data of any origin can be decoded.
    """
    if len(data) < _PREFIX.size or not _matches_checksum(memoryview(data)[4:], data[:4]):
        return None
    return _decode_checked(data, key)


def _matches_checksum(body: memoryview, checksum: bytes) -> bool:
    return crc32(body) == int.from_bytes(checksum, "little")


def _decode_checked(data: bytes | memoryview, key: str) -> Arrays | None:
    """Decode the arrays of a file whose checksum is right; None if they have another key."""
    _, size = _PREFIX.unpack_from(data)
    try:
        head = json.loads(bytes(data[_PREFIX.size : _PREFIX.size + size]))
    except ValueError:
        return None
    if head["key"] != key:
        return None
    arrays, start = {}, _PREFIX.size + size
    for name, kind, shape in head["arrays"]:
        # Views of bytes, and of a file mapped for reading, are read-only.
        arrays[name] = np.frombuffer(data, kind, math.prod(shape), start).reshape(shape)
        start += arrays[name].nbytes + _padding(arrays[name].nbytes)
    return arrays


def _load(path: str, key: str, intact: CountCache[None]) -> Arrays | None:
    """Load the arrays of a file; None if it is missing, damaged, or has another key.

    Large files with a right checksum are noted in ``intact``, and on themselves for other
    processes until the machine starts again, since a loss of power may damage files: later loads,
    of which there are hundreds per scene, need not read them as a whole again unless they have
    changed.
    """
    try:
        with open(path, "rb") as file:  # noqa: PTH123
            facts = os.fstat(file.fileno())
            version = f"{key} {facts.st_ino} {facts.st_size} {facts.st_mtime_ns}"
            if facts.st_size < _MAPPED_BYTES_MIN:
                return decode_arrays(file.read(), key)
            if version not in intact:
                if not _is_noted(file, version):
                    if not _is_intact(file):
                        return None
                    _note(file, version)
                intact.get(version, lambda: None)
            return _decode_checked(map_file(file.fileno(), facts.st_size), key)
    except OSError:
        return None


def _is_noted(file: BinaryIO, version: str) -> bool:
    """Whether the file states that this version of it was checked; False where it cannot."""
    try:
        return os.getxattr(file.fileno(), _CHECKED) == f"{version} {_boot()}".encode()
    except (OSError, AttributeError):
        # Not noted, or no attributes: on this file system, or at all, as on macOS.
        return False


def _note(file: BinaryIO, version: str) -> None:
    with contextlib.suppress(OSError, AttributeError):
        os.setxattr(file.fileno(), _CHECKED, f"{version} {_boot()}".encode())


@cache
def _boot() -> str:
    return _BOOT_ID.read_text("ascii").strip()


def _is_intact(file: BinaryIO) -> bool:
    """Whether the checksum of a cache file is right; read through a buffer, not through a map.

    Pages that are read through a map would count as memory of this process.
    """
    expected = int.from_bytes(file.read(4), "little")
    actual, buffer = 0, bytearray(_CHUNK_BYTES)
    while size := file.readinto(buffer):  # type: ignore[attr-defined]
        actual = crc32(memoryview(buffer)[:size], actual)
    return actual == expected


def _store(path: str, key: str, arrays: Arrays) -> None:
    parts = _encode_parts(key, arrays)
    _write_atomically(Path(path), lambda file: file.writelines(parts))


def _padding(size: int) -> int:
    """Number of padding bytes after ``size`` bytes, for every array to start aligned."""
    return -size % _ALIGNMENT


def _write_atomically(path: Path, write: Callable[[Any], object]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor, temporary = tempfile.mkstemp(dir=path.parent, suffix=".part")
    try:
        with os.fdopen(descriptor, "wb") as file:
            write(file)
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
