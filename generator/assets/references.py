"""Which files an asset is made of: what its content hash covers."""

from __future__ import annotations

import contextlib
import json
import re
from collections.abc import Iterator
from pathlib import PurePosixPath
from urllib.parse import unquote

from generator.assets.folder import Folder
from generator.assets.urdf import read_urdf
from generator.core.errors import AssetError
from generator.usd.reading import SUFFIXES, layer_references

_MTLLIB = re.compile(rb"^[ \t]*mtllib[ \t]+(.+?)[ \t\r]*$", re.MULTILINE)
_MAP = re.compile(rb"^[ \t]*(?:map_\w+|norm|bump)[ \t]+(?:.*[ \t])?(\S+?)[ \t\r]*$", re.MULTILINE)
_MAX_FILES = 2000


def files_of(folder: Folder, relative: str) -> tuple[str, ...]:
    """The file and everything it refers to that exists, sorted.

    Raises:
        AssetError: if the file itself is missing, or an unreadable URDF.
    """
    found: set[str] = set()
    pending = [relative]
    while pending:
        name = pending.pop()
        if name in found or (name != relative and not folder.exists(name)):
            continue
        found.add(name)
        if len(found) > _MAX_FILES:
            raise AssetError(
                f"{folder.root / relative}: refers to more than {_MAX_FILES} files; split it"
            )
        for reference in _references(folder, name):
            # A reference that leaves the folder is the reader's to refuse, if it needs it.
            with contextlib.suppress(AssetError):
                pending.append(folder.refer(name, reference))
    return tuple(sorted(found))


def _references(folder: Folder, name: str) -> Iterator[str]:
    suffix = PurePosixPath(name).suffix.lower()
    if suffix == ".urdf":
        depth = len(PurePosixPath(name).parent.parts)
        yield from ("../" * depth + file for file in read_urdf(folder, name).files())
    elif suffix in (".obj", ".mtl"):
        pattern = _MTLLIB if suffix == ".obj" else _MAP
        for reference in pattern.findall(folder.read(name)):
            yield reference.decode("utf-8", errors="replace")
    elif suffix == ".gltf":
        yield from (unquote(uri) for uri in _uris(folder.read(name)))
    elif suffix in SUFFIXES:
        yield from layer_references(folder.path(name))


def _uris(data: bytes) -> list[str]:
    """The URIs of files in a glTF document; none if it is malformed, which its reader will tell."""
    try:
        tree = json.loads(data)
        items = [*tree.get("buffers", []), *tree.get("images", [])]
        uris = [item["uri"] for item in items if "uri" in item]
    except (ValueError, TypeError, AttributeError, RecursionError):
        return []
    return [uri for uri in uris if isinstance(uri, str) and not uri.startswith("data:")]
