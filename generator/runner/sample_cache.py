"""Rendered samples on disk, by the content of their plan: whole and intact, or made again.

One file holds all files of a sample. It begins with the SHA-256 of its key and of the rest: a
length [4 bytes, little-endian], that many bytes of JSON, ``{path: bytes}``, and the contents. It is
written next to its place and renamed, is read as a whole, and is never changed; any number of
processes may share the folder.
"""

import json
import os
import struct
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from gen_data.core.recent_files import remove_least_recent
from gen_data.core.serialization import canonical_json
from gen_data.runner.plan import Plan

MAX_BYTES = 20_000_000_000
CHECKS = 8
"""The size is measured again after an eighth of the free space: as many processes may fill it."""

Files = Mapping[str, bytes | memoryview]
"""Contents by path, relative to the folder of a shard."""

_LENGTH = struct.Struct("<I")
_DIGEST_BYTES = 32


def sample_cache_dir() -> Path:
    """Folder of the samples of recipes."""
    import platformdirs

    return Path(platformdirs.user_cache_path("gen-data")) / "samples"


def content_of(plan: Plan) -> str:
    """SHA-256 of everything in a plan that its samples depend on; their number is not among it."""
    values = {k: getattr(plan, k) for k in ("config", "seed", "versions", "assets", "scenes_of")}
    return sha256(canonical_json(values).encode()).hexdigest()


@dataclass
class SampleCache:
    """Samples of one plan.

    Attributes:
        content: See ``content_of``.
        max_bytes: Bound of all plans' samples in ``root`` together.
        root: Created by the first write.
    """

    content: str
    max_bytes: int
    root: Path
    _unmeasured: int = 0
    _room: float = 0.0

    def path(self, index: int) -> Path:
        """File of a sample, which need not exist."""
        return self.root / self.content / f"{index:09d}"

    def find(self, index: int) -> Files | None:
        """Files of a sample; None if it is missing, cut or changed."""
        path = self.path(index)
        try:
            data = path.read_bytes()
            os.utime(path)
        except OSError:
            return None
        return _decode(data, self._key(index))

    def add(self, index: int, folder: Path) -> Files:
        """Store a sample from a folder with its files, and return it.

        A full disk or a folder that cannot be written only costs time.
        """
        found = {p.relative_to(folder).as_posix(): p for p in folder.rglob("*") if p.is_file()}
        files = {name: found[name].read_bytes() for name in sorted(found)}
        data, path = _encode(files, self._key(index)), self.path(index)
        with suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            descriptor, unfinished = tempfile.mkstemp(".part", dir=path.parent)
            try:
                with os.fdopen(descriptor, "wb") as file:
                    file.write(data)
                Path(unfinished).replace(path)
            except BaseException:
                Path(unfinished).unlink(missing_ok=True)
                raise
            self._make_room(len(data))
        return files

    def _key(self, index: int) -> bytes:
        return f"{self.content}/{index}".encode()

    def _make_room(self, added: int) -> None:
        """Remove the least recently used files if the folder may have grown above its bound."""
        self._unmeasured += added
        if self._unmeasured <= self._room:
            return
        total = remove_least_recent([self.root], self.max_bytes)
        self._unmeasured, self._room = 0, (self.max_bytes - total) / CHECKS


def _encode(files: Mapping[str, bytes], key: bytes) -> bytes:
    head = json.dumps({name: len(data) for name, data in files.items()}).encode()
    body = b"".join((_LENGTH.pack(len(head)), head, *files.values()))
    return sha256(key + body).digest() + body


def _decode(data: bytes, key: bytes) -> Files | None:
    """The inverse of ``_encode``; None if the digest is another one."""
    body = memoryview(data)[_DIGEST_BYTES:]
    digest = sha256(key)
    digest.update(body)
    if digest.digest() != data[:_DIGEST_BYTES]:
        return None
    (size,) = _LENGTH.unpack_from(body)
    start = _LENGTH.size + size
    files = {}
    for name, length in json.loads(bytes(body[_LENGTH.size : start])).items():
        files[name] = body[start : start + length]
        start += length
    return files
