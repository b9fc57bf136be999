"""Wanted members out of archives nobody has looked into: zip, tar, deb, and archives inside them.

Nothing is ever extracted wholesale. Members are streamed one by one below the target folder, as
plain files; a wanted member that is a link or a device, or whose path leaves the folder, is
refused, and so is an archive that inflates beyond the limits.
"""

from __future__ import annotations

import gzip
import io
import lzma
import shutil
import stat
import tarfile
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import IO, cast

from gen_data.generator.core.errors import AssetError

_CHUNK = 1 << 20
_INNER = (".sh3f", ".zip")
"""Members that are archives themselves and are looked into."""
_MAX_DEPTH = 2
_AR_MAGIC = b"!<arch>\n"
# What the readers of the standard library raise on damaged, encrypted or exotic archives.
_UNREADABLE = (tarfile.TarError, zipfile.BadZipFile, lzma.LZMAError, gzip.BadGzipFile, zlib.error,
               EOFError, NotImplementedError, RuntimeError, ValueError)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Limits:
    """How much an archive may hold.

    Attributes:
        members: Entries, wanted or not.
        file_bytes: Of one member.
        total_bytes: Of all wanted members.
        ratio: Inflated bytes per byte of the archive.
    """

    members: int = 50_000
    file_bytes: int = 256 * 1024 * 1024
    total_bytes: int = 2 * 1024 * 1024 * 1024
    ratio: float = 100.0


@dataclass
class _Extraction:
    """One archive on its way into a folder, and what it has cost so far."""

    archive: Path
    target: Path
    wanted: tuple[str, ...]
    limits: Limits
    archive_bytes: int
    members: int = 0
    inflated: int = 0
    written: int = 0
    names: list[str] = field(default_factory=list)

    def refuse(self, what: str) -> AssetError:
        """An error about this archive."""
        return AssetError(f"{self.archive}: {what}; nothing was installed")

    def count(self, size: int) -> None:
        """Account for a member before it is looked at."""
        self.members += 1
        self.inflated += size
        limits = self.limits
        if self.members > limits.members:
            raise self.refuse(f"holds more than {limits.members} members")
        if self.inflated > limits.ratio * self.archive_bytes + _CHUNK:
            raise self.refuse(f"inflates to more than {limits.ratio:g} times its size")

    def wants(self, name: str) -> bool:
        """Whether any pattern fits a member's path."""
        return any(fnmatchcase(name, pattern) for pattern in self.wanted)

    def write(self, name: str, size: int, stream: IO[bytes]) -> None:
        """A wanted member to its place. What it claims as its size is not believed."""
        limits = self.limits
        if size > limits.file_bytes:
            raise self.refuse(f"member '{name[:120]}' has {size} bytes, at most "
                              f"{limits.file_bytes} are taken")  # fmt: skip
        path = self.place(name)
        path.parent.mkdir(parents=True, exist_ok=True)
        taken = 0
        try:
            with path.open("xb") as file:
                while chunk := stream.read(_CHUNK):
                    taken += len(chunk)
                    self.written += len(chunk)
                    if taken > size or self.written > limits.total_bytes:
                        raise self.refuse(f"member '{name[:120]}' is larger than it claims, or all "
                                          f"exceed {limits.total_bytes} bytes")  # fmt: skip
                    file.write(chunk)
        except FileExistsError:
            raise self.refuse(f"holds '{name[:120]}' twice") from None
        self.names.append(name)

    def place(self, name: str) -> Path:
        """Where a member goes, inside the target. Raises AssetError if it would leave it."""
        parts = name.split("/")
        bad = {"", ".", ".."} & set(parts)
        if bad or "\\" in name or "\0" in name or len(name) > 1024:
            raise self.refuse(f"member {name[:120]!r} lies outside its folder")
        return self.target.joinpath(*parts)


def extract(
    archive: Path, wanted: tuple[str, ...], target: Path, limits: Limits | None = None
) -> tuple[str, ...]:
    """Write the wanted members of an archive below a folder.

    Args:
        archive: A zip, a tar (plain, gzip, bzip2, xz) or a Debian package.
        wanted: Patterns as ``fnmatch`` has them; ``*`` also stands for slashes.
        target: A folder; members keep their paths below it.
        limits: By default, fit for asset packages.

    Returns:
        Paths of the members written, in the order of the archive.

    Raises:
        AssetError: if it is unreadable, holds none of the wanted members, or must be refused.
    """
    job = _Extraction(archive, target, wanted, limits or Limits(), archive.stat().st_size)
    try:
        with archive.open("rb") as file:
            _walk(job, file, "", 0)
    except _UNREADABLE as error:
        raise job.refuse(f"unreadable archive ({error})") from None
    if not job.names:
        raise job.refuse("holds none of the wanted members")
    return tuple(job.names)


def _walk(job: _Extraction, file: IO[bytes], prefix: str, depth: int) -> None:
    head = file.read(len(_AR_MAGIC))
    file.seek(0)
    if head == _AR_MAGIC:
        _walk_tar(job, _debian_data(job, file), prefix, depth)
    elif head[:4] == b"PK\x03\x04":
        _walk_zip(job, file, prefix, depth)
    else:
        _walk_tar(job, file, prefix, depth)


def _walk_zip(job: _Extraction, file: IO[bytes], prefix: str, depth: int) -> None:
    with zipfile.ZipFile(file) as archive:
        for info in archive.infolist():
            name = prefix + info.filename
            mode = info.external_attr >> 16
            # Archives made on other systems have no mode at all.
            plain = not info.is_dir() and (stat.S_IFMT(mode) in (0, stat.S_IFREG))
            job.count(info.file_size)
            if not info.is_dir():
                _take(job, name, info.file_size, plain, partial(archive.open, info), depth)


def _walk_tar(job: _Extraction, file: IO[bytes], prefix: str, depth: int) -> None:
    with tarfile.open(fileobj=file, mode="r|*") as archive:
        for info in archive:
            name = prefix + info.name.removeprefix("./")
            job.count(info.size)
            if not info.isdir():
                _take(job, name, info.size, info.isreg(), partial(_opened, archive, info), depth)


def _opened(archive: tarfile.TarFile, info: tarfile.TarInfo) -> IO[bytes]:
    stream = archive.extractfile(info)
    return stream if stream is not None else io.BytesIO()


def _take(
    job: _Extraction,
    name: str,
    size: int,
    plain: bool,
    opened: Callable[[], IO[bytes]],
    depth: int,
) -> None:
    """A member to its place; an archive inside the archive member by member."""
    if plain and depth < _MAX_DEPTH and any(fnmatchcase(name, p) for p in _inner(job.wanted)):
        with tempfile.TemporaryFile() as spool:
            with opened() as stream:
                shutil.copyfileobj(stream, spool, _CHUNK)
            spool.seek(0)
            _walk(job, spool, f"{name}/", depth + 1)
    elif job.wants(name):
        if not plain:
            raise job.refuse(f"member '{name[:120]}' is no plain file but a link or a device")
        with opened() as stream:
            job.write(name, size, stream)


def _inner(wanted: tuple[str, ...]) -> Iterator[str]:
    """Patterns of the archives that wanted members lie in."""
    for pattern in wanted:
        for suffix in _INNER:
            outer, slash, _ = pattern.partition(f"{suffix}/")
            if slash:
                yield outer + suffix


def _debian_data(job: _Extraction, file: IO[bytes]) -> IO[bytes]:
    """The tar with the files of a Debian package.

    Source: deb(5), ar(5): 60-byte headers with the name in bytes 0-15 and the size in 48-57;
    members start at even offsets.
    """
    file.seek(len(_AR_MAGIC))
    while len(header := file.read(60)) == 60:
        name, size = header[:16].decode("ascii").strip().rstrip("/"), int(header[48:58])
        if name.startswith("data.tar"):
            return cast(IO[bytes], _Window(file, size))
        file.seek(size + size % 2, io.SEEK_CUR)
    raise job.refuse("holds no data.tar and is no Debian package")


class _Window(io.RawIOBase):
    """The next bytes of a file as a file of their own."""

    def __init__(self, file: IO[bytes], size: int) -> None:
        self._file, self._left = file, size

    def readable(self) -> bool:
        """It is."""
        return True

    def read(self, size: int = -1) -> bytes:
        """At most that many bytes, none at its end."""
        data = self._file.read(self._left if size < 0 else min(size, self._left))
        self._left -= len(data)
        return data
