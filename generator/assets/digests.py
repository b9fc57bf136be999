"""Content hashes of assets' files, remembered as long as no file's size or time changes."""

from __future__ import annotations

from hashlib import sha256
from typing import Any

from generator.assets.cache import DiskCache
from generator.assets.folder import Folder
from generator.assets.references import files_of

_NAME = "digests.json"


class Digests:
    """``{file: sha256}`` of everything that an asset consists of.

    Hashing a thousand small meshes takes a second; looking at their sizes and times takes a tenth
    of it.
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
        known = self._known.get(name)
        if isinstance(known, list) and known and all(_unchanged(folder, row) for row in known):
            return {row[0]: row[3] for row in known}
        rows: list[list[Any]] = []
        for file in files_of(folder, relative):
            status = folder.path(file).stat()
            digest = sha256(folder.read(file)).hexdigest()
            rows.append([file, status.st_size, status.st_mtime_ns, digest])
        self._known[name] = rows
        self._changed = True
        return {row[0]: row[3] for row in rows}

    def save(self) -> None:
        """Write down what was learnt, if anything."""
        if self._changed and self._known is not None:
            # Other processes may have learnt something else meanwhile.
            self._cache.store_json(_NAME, {**self._cache.load_json(_NAME), **self._known})
            self._changed = False


def _unchanged(folder: Folder, row: Any) -> bool:
    try:
        status = (folder.root / row[0]).stat()
        return bool(row == [row[0], status.st_size, status.st_mtime_ns, str(row[3])])
    except (OSError, TypeError, IndexError):
        return False
