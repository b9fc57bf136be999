"""Extract selected members from untrusted archives: zip, tar, deb, and archives inside them.

Members are streamed one by one below the target folder as regular files. An archive is refused if a
wanted member is a link or a device, or leaves the folder, or if the archive exceeds a limit.
``tarfile``'s ``data`` filter is too lenient for this: it follows links inside the folder and strips
leading slashes silently.
"""

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
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import IO

from gen_data.core.errors import AssetError

_INNER = (".sh3f", ".zip")
"""Suffixes of members that are archives themselves and are searched too."""
_MAX_DEPTH = 2
_RATIO_MARGIN_BYTES = 1 << 20
"""Small archives may inflate by this much more, whatever their ratio."""
_AR_MAGIC = b"!<arch>\n"
# Raised by the standard library's readers on damaged, encrypted or exotic archives.
_UNREADABLE = (tarfile.TarError, zipfile.BadZipFile, lzma.LZMAError, gzip.BadGzipFile, zlib.error,
               EOFError, NotImplementedError, RuntimeError, ValueError)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Limits:
    """Upper bounds on an archive's content.

    Attributes:
        members: Entries, wanted or not.
        file_bytes: Size of one wanted member.
        total_bytes: Size of all wanted members.
        ratio: Inflated bytes per byte of the archive.
    """

    members: int = 50_000
    file_bytes: int = 256 * 1024 * 1024
    total_bytes: int = 2 * 1024 * 1024 * 1024
    ratio: float = 100.0


@dataclass(frozen=True, slots=True)
class _Member:
    """Entry of an archive.

    Attributes:
        size: Its stated size [bytes]; ``open`` yields no more than that.
        regular: False for folders, links and devices.
        open: None for entries that are never written: folders, and archives that are searched.
    """

    name: str
    size: int
    regular: bool
    open: Callable[[], AbstractContextManager[IO[bytes]]] | None


def extract(
    archive: Path, wanted: tuple[str, ...], target: Path, limits: Limits | None = None
) -> tuple[str, ...]:
    """Write the wanted members of an archive below a folder.

    Args:
        archive: A zip, a tar (plain, gzip, bzip2, xz) or a Debian package.
        wanted: ``fnmatch`` patterns; ``*`` also matches slashes. Members of an archive inside the
            archive follow its path and a slash.
        target: A folder; members keep their paths below it.
        limits: By default, suitable for asset packages.

    Returns:
        Paths of the members written, in the order of the archive.

    Raises:
        AssetError: if it is unreadable, holds none of the wanted members, or must be refused.
    """
    try:
        with archive.open("rb") as file:
            names = tuple(_extract(archive, file, wanted, target, limits or Limits()))
    except _UNREADABLE as error:
        raise _refusal(archive, f"unreadable archive ({error})") from None
    if not names:
        raise _refusal(archive, "holds none of the wanted members")
    return names


def _extract(
    archive: Path, file: IO[bytes], wanted: tuple[str, ...], target: Path, limits: Limits
) -> Iterator[str]:
    inflated = written = 0
    inflated_max = limits.ratio * archive.stat().st_size + _RATIO_MARGIN_BYTES
    for number, member in enumerate(_members(file, _containers(wanted))):
        # Unwanted members count too: skipping them in a compressed stream costs as much time.
        inflated += member.size
        if number >= limits.members:
            raise _refusal(archive, f"holds more than {limits.members} members")
        if inflated > inflated_max:
            raise _refusal(archive, f"inflates to more than {limits.ratio:g} times its size")
        if member.open is None or not any(fnmatchcase(member.name, p) for p in wanted):
            continue
        shown = f"member {member.name[:120]!r}"
        written += member.size
        if not member.regular:
            raise _refusal(archive, f"{shown} is a link or a device, not a regular file")
        if member.size > limits.file_bytes:
            raise _refusal(
                archive, f"{shown} has {member.size} bytes, more than {limits.file_bytes}"
            )
        if written > limits.total_bytes:
            raise _refusal(archive, f"the wanted members exceed {limits.total_bytes} bytes")
        if not _is_inside(member.name):
            raise _refusal(archive, f"{shown} lies outside its folder")
        path = target / member.name
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            with path.open("xb") as output, member.open() as stream:
                shutil.copyfileobj(stream, output)
        except FileExistsError:
            raise _refusal(archive, f"holds {member.name[:120]!r} twice") from None
        yield member.name


def _members(
    file: IO[bytes], containers: tuple[str, ...], prefix: str = "", depth: int = 0
) -> Iterator[_Member]:
    """All entries, each archive inside followed by its own; read lazily, in file order."""
    head = file.read(len(_AR_MAGIC))
    file.seek(0)
    if head == _AR_MAGIC:
        _seek_debian_data(file)
    for entry in (_zip_members if head.startswith(b"PK\x03\x04") else _tar_members)(file):
        member = replace(entry, name=prefix + entry.name)
        if not (
            member.open is not None
            and member.regular
            and depth < _MAX_DEPTH
            and any(fnmatchcase(member.name, pattern) for pattern in containers)
        ):
            yield member
            continue
        yield replace(member, open=None)
        with tempfile.TemporaryFile() as spool:
            with member.open() as stream:
                shutil.copyfileobj(stream, spool)
            spool.seek(0)
            yield from _members(spool, containers, f"{member.name}/", depth + 1)


def _zip_members(file: IO[bytes]) -> Iterator[_Member]:
    with zipfile.ZipFile(file) as archive:
        for info in archive.infolist():
            # The upper half holds the Unix mode; archives made on other systems have none.
            kind = stat.S_IFMT(info.external_attr >> 16)
            opener = None if info.is_dir() else partial(archive.open, info)
            yield _Member(info.filename, info.file_size, kind in (0, stat.S_IFREG), opener)


def _tar_members(file: IO[bytes]) -> Iterator[_Member]:
    with tarfile.open(fileobj=file, mode="r|*") as archive:
        for info in archive:
            opener = None if info.isdir() else partial(_open_tar_member, archive, info)
            yield _Member(info.name.removeprefix("./"), info.size, info.isreg(), opener)


def _open_tar_member(archive: tarfile.TarFile, info: tarfile.TarInfo) -> IO[bytes]:
    return archive.extractfile(info) or io.BytesIO()


def _containers(wanted: tuple[str, ...]) -> tuple[str, ...]:
    """Patterns of the archives that hold wanted members."""
    splits = ((p.partition(f"{suffix}/"), suffix) for p in wanted for suffix in _INNER)
    return tuple(outer + suffix for (outer, slash, _), suffix in splits if slash)


def _is_inside(name: str) -> bool:
    """Whether a member's path stays below the folder it is written to."""
    bad_parts = {"", ".", ".."} & set(name.split("/"))
    return not (bad_parts or "\\" in name or "\0" in name or len(name) > 1024)


def _seek_debian_data(file: IO[bytes]) -> None:
    """Move to the tar with the files of a Debian package; that tar marks its own end.

    Source: deb(5), ar(5): 60-byte headers with the name in bytes 0-15 and the size in 48-57;
    members start at even offsets.
    """
    file.seek(len(_AR_MAGIC))
    while len(header := file.read(60)) == 60:
        name, size = header[:16].decode("ascii").strip(), int(header[48:58])
        if name.startswith("data.tar"):
            return
        file.seek(size + size % 2, io.SEEK_CUR)
    raise ValueError("no data.tar, hence no Debian package")


def _refusal(archive: Path, reason: str) -> AssetError:
    return AssetError(f"{archive}: {reason}; nothing was installed")
