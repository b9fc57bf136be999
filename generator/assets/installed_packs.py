"""Asset packs that are installed: what is where, and what it should be.

A pack is a folder of ``packs_dir()`` with a record of its own, ``pack.json``, and, if it offers
assets by id, an index: the document of ``assets.yaml`` as JSON, which is read a hundred times as
fast. Installing is ``gen_data.generator.packs``' business.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from pydantic import ValidationError

from gen_data.generator.assets.folder_index import FolderIndex, IndexedAsset, list_assets
from gen_data.generator.core.errors import AssetError
from gen_data.generator.core.serialization import canonical_json, from_plain

RECORD_NAME = "pack.json"
INDEX_NAME = "index.json"
TAG = "pack"
"""Every asset of a pack carries it."""


@dataclass(frozen=True, slots=True)
class StoredFile:
    """What one installed file should be.

    Attributes:
        path: Below the pack's folder.
    """

    path: str
    size: int
    sha256: str


@dataclass(frozen=True, slots=True)
class Record:
    """What was installed.

    Attributes:
        version: Of the package it comes from.
        revision: Of the conversion, raised whenever the same package gives other files.
        archive_sha256: Of the package's archive.
        files: All files but the record itself, sorted by path.
    """

    name: str
    version: str
    revision: int
    archive_sha256: str
    licence: str
    source: str
    files: tuple[StoredFile, ...]

    @property
    def digest(self) -> str:
        """sha256, in hexadecimal, of everything that was installed."""
        return sha256(canonical_json(self.files).encode()).hexdigest()

    @property
    def size(self) -> int:
        """Bytes of all files."""
        return sum(file.size for file in self.files)


def installed_packs(folder: Path) -> tuple[Record, ...]:
    """Records of the packs in a folder, sorted by name; none if there is no such folder.

    Raises:
        AssetError: if a record cannot be read.
    """
    return tuple(read_record(path.parent) for path in sorted(folder.glob(f"[!.]*/{RECORD_NAME}")))


def read_record(pack: Path) -> Record:
    """The record in a pack's folder. Raises AssetError if it is damaged."""
    path = pack / RECORD_NAME
    try:
        return from_plain(Record, json.loads(path.read_bytes()))
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        raise AssetError(
            f"{path}: unreadable ({error}); install the pack again: "
            f"gen-data assets install {pack.name}"
        ) from None


def pack_assets(folder: Path) -> Iterator[IndexedAsset]:
    """The assets of all packs in a folder under their ids ``<pack>/<id>``.

    Raises:
        AssetError: if a pack's index is damaged.
    """
    for path in sorted(folder.glob(f"[!.]*/{INDEX_NAME}")):
        try:
            # Lists stand for tuples, since JSON has no other; all else is read as declared.
            index = FolderIndex.model_validate_json(path.read_bytes())
        except (OSError, ValidationError) as error:
            raise AssetError(
                f"{path}: unreadable ({str(error).splitlines()[0]}); install the pack again: "
                f"gen-data assets install {path.parent.name}"
            ) from None
        yield from list_assets(index, path.parent, f"{path.parent.name}/")
