"""Atomic installation, verification and removal of packs.

All work happens in a scratch folder next to the installed packs and ends with one rename. A lock
prevents concurrent installations; the next one removes scratch folders of killed processes.
"""

import contextlib
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from gen_data.assets.installed_packs import RECORD_NAME, Record, StoredFile, read_record
from gen_data.core import errors, serialization, system_calls
from gen_data.packs import archives, pack_table
from gen_data.packs.fetch import check_archive, fetch, file_digest

_SCRATCH = ".scratch-"
_LOCK = ".lock"


def install(pack: pack_table.Pack, folder: Path, archive: Path | None = None) -> Record:
    """Fetch, convert and install a pack; replace an installed one.

    Args:
        pack: Entry of the table.
        folder: Folder of installed packs; created if missing.
        archive: The package's archive, if it need not be fetched.

    Returns:
        The record of the installed pack.

    Raises:
        AssetError: if it cannot be fetched, is not the pinned archive, or cannot be converted.
        StorageError: if the folder cannot be written, or another process is installing.
    """
    with _storage(folder), _scratch(folder) as scratch:
        return _install(pack, folder, archive, scratch)


def install_once(pack: pack_table.Pack, folder: Path, announce: Callable[[], object]) -> None:
    """Install a pack unless it is installed; wait while another process installs one.

    Args:
        pack: Entry of the table.
        folder: Folder of installed packs; created if missing.
        announce: Called before it is fetched.

    Raises:
        AssetError: if it cannot be fetched, is not the pinned archive, or cannot be converted.
        StorageError: if the folder cannot be written.
    """
    with _storage(folder), _scratch(folder, wait=True) as scratch:
        if not is_installed(pack, folder):
            announce()
            _install(pack, folder, None, scratch)


def _install(pack: pack_table.Pack, folder: Path, archive: Path | None, scratch: Path) -> Record:
    """Fetch, convert and install a pack, by way of an empty folder."""
    if archive is None:
        archive = fetch(pack, _make_folder(scratch / "archive"))
    check_archive(pack, archive)
    source, target = _make_folder(scratch / "source"), _make_folder(scratch / "target")
    archives.extract(archive, pack.wanted, source)
    pack.convert(source, target)
    record = Record(
        name=pack.name,
        version=pack.version,
        revision=pack.revision,
        archive_sha256=pack.sha256,
        licence=pack.licence,
        source=pack.source,
        files=_list_files(target),
    )
    (target / RECORD_NAME).write_text(serialization.canonical_json(record) + "\n", encoding="utf-8")
    # Without a sync, a power cut after the rename may leave a pack of empty files.
    if hasattr(os, "sync"):
        os.sync()
    _exchange(target, folder / pack.name, scratch / "old")
    return record


def is_installed(pack: pack_table.Pack, folder: Path) -> bool:
    """Whether the pack is installed in the table's version and revision."""
    if not (folder / pack.name / RECORD_NAME).exists():
        return False
    record = read_record(folder / pack.name)
    return (record.archive_sha256, record.revision) == (pack.sha256, pack.revision)


def remove(name: str, folder: Path) -> None:
    """Remove an installed pack atomically. Raises AssetError if it is not installed."""
    installed = folder / name
    _require_installed(name, folder)
    with _storage(folder), _scratch(folder) as scratch:
        installed.rename(scratch / "old")


def verify(name: str, folder: Path) -> Record:
    """Hash every file of a pack and compare it with the record.

    Raises:
        AssetError: if the pack is not installed.
        VerificationError: if a file is missing, changed, or was not installed.
    """
    _require_installed(name, folder)
    pack = folder / name
    record = read_record(pack)
    should = {file.path: file for file in record.files}
    found = {file.path: file for file in _list_files(pack) if file.path != RECORD_NAME}
    for path in sorted({*should, *found}):
        expected, actual = should.get(path), found.get(path)
        if expected != actual:
            what = "was not installed" if expected is None else "missing"
            raise errors.VerificationError(
                f"{pack / path}: {'changed' if expected and actual else what}; install the pack "
                f"again: gen-data assets install {name}"
            )
    return record


def _require_installed(name: str, folder: Path) -> None:
    if not (folder / name / RECORD_NAME).is_file():
        raise errors.AssetError(
            f"pack '{name}': not installed in {folder}; gen-data assets install {name}"
        )


def _list_files(folder: Path) -> tuple[StoredFile, ...]:
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    return tuple(
        StoredFile(path.relative_to(folder).as_posix(), path.stat().st_size, file_digest(path))
        for path in paths
    )


def _exchange(new: Path, final: Path, old: Path) -> None:
    if final.exists():
        final.rename(old)
    try:
        new.rename(final)
    except OSError:
        if old.exists():
            old.rename(final)
        raise


@contextlib.contextmanager
def _scratch(folder: Path, wait: bool = False) -> Iterator[Path]:
    """Scratch folder on the same file system, for one process at a time."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / _LOCK).open("a") as lock:
        if wait:
            system_calls.wait_for_lock(lock.fileno())
        elif not system_calls.try_lock(lock.fileno()):
            raise errors.StorageError(
                f"{folder}: another process is installing or removing packs; wait for it"
            )
        for left_behind in sorted(folder.glob(f"{_SCRATCH}*")):
            shutil.rmtree(left_behind)
        scratch = Path(tempfile.mkdtemp(prefix=_SCRATCH, dir=folder))
        try:
            yield scratch
        finally:
            shutil.rmtree(scratch)


@contextlib.contextmanager
def _storage(folder: Path) -> Iterator[None]:
    try:
        yield
    except errors.GenDataError:
        raise
    except OSError as error:
        place = error.filename or folder
        raise errors.StorageError(
            f"{place}: {error.strerror}; make room or set GEN_DATA_ASSETS to another folder"
        ) from None


def _make_folder(folder: Path) -> Path:
    folder.mkdir()
    return folder
