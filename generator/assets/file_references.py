"""Which files an asset is made of: what its content hash covers."""

from __future__ import annotations

import contextlib
import json
import re
from collections.abc import Iterator
from pathlib import PurePosixPath
from urllib.parse import unquote

from gen_data.generator.assets.asset_folder import Folder
from gen_data.generator.assets.urdf import read_urdf
from gen_data.generator.core.errors import AssetError
from gen_data.generator.usd.stage_reader import SUFFIXES, layer_references

# Each takes the rest of its line whole: patterns that divide it need quadratic time.
_MTLLIB = re.compile(rb"^[ \t]*mtllib[ \t]([^\n]*)", re.MULTILINE)
_MAP = re.compile(rb"^[ \t]*(?:map_\w+|norm|bump)[ \t]([^\n]*)", re.MULTILINE)
_MAX_FILES = 2000


def find_referenced_files(folder: Folder, relative: str) -> tuple[str, ...]:
    """The file and everything it refers to that exists, sorted.

    Raises:
        AssetError: if the file itself is missing, or an unreadable URDF.
    """
    return tuple(name for name, exists in references_of(folder, relative).items() if exists)


def references_of(folder: Folder, relative: str) -> dict[str, bool]:
    """The file and everything it refers to, sorted by name, with whether it exists.

    Raises:
        AssetError: if the file itself is missing, or an unreadable URDF.
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
        for reference in _references(folder, name):
            # A reference that leaves the folder is the reader's to refuse, if it needs it.
            with contextlib.suppress(AssetError):
                pending.append(folder.refer(name, reference))
    return dict(sorted(found.items()))


def _references(folder: Folder, name: str) -> Iterator[str]:
    suffix = PurePosixPath(name).suffix.lower()
    if suffix == ".urdf":
        depth = len(PurePosixPath(name).parent.parts)
        yield from ("../" * depth + file for file in read_urdf(folder, name).files())
    elif suffix in (".obj", ".mtl"):
        data = folder.read(name)
        if suffix == ".obj":
            references = [rest.strip() for rest in _MTLLIB.findall(data)]
        else:
            # Options stand before the file's name.
            references = [rest.split()[-1] for rest in _MAP.findall(data) if rest.strip()]
        yield from (reference.decode("utf-8", errors="replace") for reference in references)
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
