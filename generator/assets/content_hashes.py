"""The files that assets consist of, and their content hashes.

Hashes are cached until a file may have changed.
"""

import contextlib
import json
import os
import re
import time
from collections.abc import Iterator
from hashlib import sha256
from os import stat_result
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import unquote

from gen_data.assets.asset_cache import DiskCache
from gen_data.assets.asset_folder import Folder
from gen_data.assets.parsing import parse_described_files, parse_layer_references, unpack_value
from gen_data.assets.readers import mesh_source, obj, ply
from gen_data.assets.robot_formats import is_description, is_foreign, read_description
from gen_data.assets.sandbox import run_sandboxed
from gen_data.core.errors import AssetError
from gen_data.usd.stage_reader import SUFFIXES

_NAME = "digests.json"
_MISSING = ""
_TICK_NS = 2_000_000_000
"""Coarsest resolution of a file system's time stamps (FAT: two seconds)."""
_DAE_IMAGE = re.compile(rb"<(?:init_from|ref)>([^<]{1,1024})")
_MAX_FILES = 2000
_ASSETS_KEPT = 4000
"""Above this number of recorded assets, those whose files are gone are dropped.

Every process reads all records, and folders of users come and go.
"""


class ContentHashes:
    """``{file: sha256}`` of all files of an asset.

    A digest stays valid while the file's device, inode, size, modification and change times are
    those recorded with it. The change time is included because programs can set the modification
    time but not the change time. A file that changed less than one clock tick before it was hashed
    may change again within that tick without a new time stamp, so it is always hashed again.
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
        name = f"{folder.root}/{relative}"
        rows = self._known.get(name)
        if not (isinstance(rows, list) and rows and all(_is_current(folder, r) for r in rows)):
            rows = [
                _hash(folder, file) if exists else [file, [], _MISSING]
                for file, exists in find_references(folder, relative).items()
            ]
            self._known[name] = rows
            self._changed = True
        return {file: digest for file, _, digest in rows if digest != _MISSING}

    def save(self) -> None:
        """Store new digests on disk, if there are any."""
        if self._changed and self._known is not None:
            # Merge: other processes may have stored digests meanwhile.
            rows = {**self._cache.load_json(_NAME), **self._known}
            if len(rows) > _ASSETS_KEPT:
                rows = {name: row for name, row in rows.items() if _exists(name)}
            self._cache.store_json(_NAME, rows)
            self._changed = False


def _exists(name: str) -> bool:
    """Whether a file exists, as far as this process may know."""
    try:
        return Path(name).exists()
    except (OSError, ValueError):
        return False


def _hash(folder: Folder, file: str) -> list[Any]:
    """Name, state and digest of a file.

    The state is read before the content: a later change invalidates the digest.
    """
    state, now_ns = _state(folder.path(file).stat()), _now_ns()
    if max(state[3:]) > now_ns - _TICK_NS:
        state = []
    return [file, state, sha256(folder.read(file)).hexdigest()]


def _is_current(folder: Folder, row: Any) -> bool:
    try:
        file, state, digest = row
        if digest == _MISSING:
            return not folder.exists(file)
        # As text: a start checks thousands of files, and a Path takes longer than the system.
        status = os.stat(f"{folder.root}/{file}")  # noqa: PTH116
        return bool(state == _state(status)) and isinstance(digest, str)
    except (OSError, TypeError, ValueError):
        return False


def _state(status: stat_result) -> list[int]:
    """Device, inode, size [bytes], modification and change time [ns] of a file."""
    return [status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns]


def _now_ns() -> int:
    """Current time [ns] of the clock that file time stamps use."""
    return time.time_ns()


def find_referenced_files(folder: Folder, relative: str) -> tuple[str, ...]:
    """Find a file and all existing files it refers to, directly or not, sorted by name.

    Raises:
        AssetError: if the file itself is missing, or an unreadable description of a robot.
    """
    return tuple(name for name, exists in find_references(folder, relative).items() if exists)


def find_references(folder: Folder, relative: str) -> dict[str, bool]:
    """Find a file and everything it refers to: ``{name: whether it exists}``, sorted by name.

    Raises:
        AssetError: if the file itself is missing, or an unreadable description of a robot.
    """
    found: dict[str, bool] = {}
    pending = [relative]
    while pending:
        name = pending.pop()
        if name in found:
            continue
        found[name] = name == relative or folder.exists(name)
        if not found[name]:
            continue
        if len(found) > _MAX_FILES:
            raise AssetError(
                f"{folder.root / relative}: refers to more than {_MAX_FILES} files; split it"
            )
        if is_description(name) and name != relative:
            # Part of the description that includes it, which has named all its files.
            continue
        for reference in _references(folder, name):
            # References that leave the folder are skipped here; the reader refuses those it needs.
            with contextlib.suppress(AssetError):
                # The file that is named may appear later; another one may stand in for it.
                pending.append(mesh_source.locate_file(folder, name, reference))
                pending.append(folder.refer(name, reference))
    return dict(sorted(found.items()))


def _references(folder: Folder, name: str) -> Iterator[str]:
    suffix = PurePosixPath(name).suffix.lower()
    if is_description(name):
        depth = len(PurePosixPath(name).parent.parts)
        if is_foreign(name):
            arrays = run_sandboxed(parse_described_files, folder.root, {name: _MISSING}, name)
            files = unpack_value(tuple[str, ...], arrays)
        else:
            files = read_description(folder, name).files()
        yield from ("../" * depth + file for file in files)
    elif suffix == ".obj":
        yield from obj.obj_references(folder.read(name))
    elif suffix == ".mtl":
        yield from obj.mtl_references(folder.read(name))
    elif suffix == ".ply":
        yield from ply.ply_references(folder.read(name))
    elif suffix == ".gltf":
        yield from (unquote(uri) for uri in _uris(folder.read(name)))
    elif suffix == ".dae":
        found = (
            uri.strip().decode("utf-8", "replace") for uri in _DAE_IMAGE.findall(folder.read(name))
        )
        yield from (unquote(uri.removeprefix("file://")) for uri in found)
    elif suffix in SUFFIXES:
        arrays = run_sandboxed(parse_layer_references, folder.root, {name: _MISSING}, name)
        yield from unpack_value(tuple[str, ...], arrays)


def _uris(data: bytes) -> list[str]:
    """URIs of files in a glTF document; none if it is malformed, which its reader reports."""
    try:
        tree = json.loads(data)
        items = [*tree.get("buffers", []), *tree.get("images", [])]
        uris = [item["uri"] for item in items if "uri" in item]
    except (ValueError, TypeError, AttributeError, RecursionError):
        return []
    return [uri for uri in uris if isinstance(uri, str) and not uri.startswith("data:")]
