"""Installed asset packs: their records and indices.

A pack is a folder below ``packs_dir()`` with a record, ``pack.json``, and, if it offers assets by
id, an index: the content of ``assets.yaml`` as JSON, which loads a hundred times faster.
``gen_data.packs`` installs packs.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from pydantic import ValidationError

from gen_data.assets.folder_index import FolderIndex, IndexedAsset, list_assets
from gen_data.core import errors, serialization

RECORD_NAME = "pack.json"
INDEX_NAME = "index.json"
TAG = "pack"
"""Tag of every asset of a pack."""


@dataclass(frozen=True, slots=True)
class StoredFile:
    """Expected state of one installed file.

    Attributes:
        path: Relative to the pack's folder.
    """

    path: str
    size: int
    sha256: str


@dataclass(frozen=True, slots=True)
class Record:
    """Record of an installed pack.

    Attributes:
        version: Version of the source package.
        revision: Revision of the conversion, increased whenever it makes different files.
        archive_sha256: Hash of the package's archive.
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
        """Hexadecimal sha256 of the list of all files."""
        return sha256(serialization.canonical_json(self.files).encode()).hexdigest()

    @property
    def size(self) -> int:
        """Total size of all files [bytes]."""
        return sum(file.size for file in self.files)


def installed_packs(folder: Path) -> tuple[Record, ...]:
    """Read the records of the packs in a folder, sorted by name; none if it does not exist.

    Raises:
        AssetError: if a record cannot be read.
    """
    return tuple(read_record(path.parent) for path in sorted(folder.glob(f"[!.]*/{RECORD_NAME}")))


def read_record(pack: Path) -> Record:
    """Read the record in a pack's folder. Raises AssetError if it is damaged."""
    path = pack / RECORD_NAME
    try:
        return serialization.from_plain(Record, json.loads(path.read_bytes()))
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        raise errors.AssetError(
            f"{path}: unreadable ({error}); install the pack again: "
            f"gen-data assets install {pack.name}"
        ) from None


def write_index(folder: Path, index: FolderIndex) -> None:
    """Write the index of a pack's folder."""
    text = index.model_dump_json(exclude_defaults=True)
    (folder / INDEX_NAME).write_text(text, encoding="utf-8")


def pack_assets(folder: Path) -> Iterator[IndexedAsset]:
    """Yield the assets of all packs in a folder, with ids ``<pack>/<id>``.

    Raises:
        AssetError: if a pack's index is damaged.
    """
    for path in sorted(folder.glob(f"[!.]*/{INDEX_NAME}")):
        try:
            # JSON mode accepts lists for tuples; all other types stay strict.
            index = FolderIndex.model_validate_json(path.read_bytes())
        except (OSError, ValidationError) as error:
            raise errors.AssetError(
                f"{path}: unreadable ({str(error).splitlines()[0]}); install the pack again: "
                f"gen-data assets install {path.parent.name}"
            ) from None
        yield from list_assets(index, path.parent, f"{path.parent.name}/")
