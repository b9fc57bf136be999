"""Content hashes of assets' files, remembered until a file may have changed."""

from __future__ import annotations

import time
from hashlib import sha256
from os import stat_result
from typing import Any

from gen_data.generator.assets.asset_cache import DiskCache
from gen_data.generator.assets.asset_folder import Folder
from gen_data.generator.assets.file_references import references_of

_NAME = "digests.json"
_MISSING = ""
_TICK_NS = 2_000_000_000
"""No file system's clock is coarser (FAT's counts two seconds)."""


class ContentHashes:
    """``{file: sha256}`` of everything that an asset consists of.

    A digest is trusted while the file's inode, size, modification and change times are those that
    it had when it was hashed. Programs can set the modification time, so the change time counts,
    which they cannot. A file that was changed within a tick of the clock before it was hashed may
    have changed once more in that tick: it is hashed again.
    """

    def __init__(self, cache: DiskCache) -> None:
        self._cache = cache
        self._known: dict[str, Any] | None = None
        self._changed = False

    def of(self, folder: Folder, relative: str) -> dict[str, str]:
        """Hash of each file of an asset, by its path below the folder's root.

        Raises:
            AssetError: if the asset's own file is missing or a reference leaves the folder.
        """
        if self._known is None:
            self._known = self._cache.load_json(_NAME)
        name = str(folder.root / relative)
        rows = self._known.get(name)
        if not (isinstance(rows, list) and rows and all(_is_current(folder, r) for r in rows)):
            rows = [
                _hash(folder, file) if exists else [file, [], _MISSING]
                for file, exists in references_of(folder, relative).items()
            ]
            self._known[name] = rows
            self._changed = True
        return {file: digest for file, _, digest in rows if digest != _MISSING}

    def save(self) -> None:
        """Write down what was learnt, if anything."""
        if self._changed and self._known is not None:
            # Other processes may have learnt something else meanwhile.
            self._cache.store_json(_NAME, {**self._cache.load_json(_NAME), **self._known})
            self._changed = False


def _hash(folder: Folder, file: str) -> list[Any]:
    """Name, state and digest of a file. The state is read first: changes later than that count."""
    state, now_ns = _state(folder.path(file).stat()), _now_ns()
    if max(state[3:]) > now_ns - _TICK_NS:
        state = []
    return [file, state, sha256(folder.read(file)).hexdigest()]


def _is_current(folder: Folder, row: Any) -> bool:
    """Whether a row's digest is still that of its file."""
    try:
        file, state, digest = row
        if digest == _MISSING:
            return not folder.exists(file)
        return bool(state == _state((folder.root / file).stat())) and isinstance(digest, str)
    except (OSError, TypeError, ValueError):
        return False


def _state(status: stat_result) -> list[int]:
    """Device, inode, size [bytes], modification and change time [ns] of a file."""
    return [
        status.st_dev,
        status.st_ino,
        status.st_size,
        status.st_mtime_ns,
        status.st_ctime_ns,
    ]


def _now_ns() -> int:
    """Time [ns] by the clock that files' times are taken from."""
    return time.time_ns()
