"""Files of a user's folder, and the asset ids and categories that follow from their paths."""

from __future__ import annotations

import os
from fnmatch import fnmatchcase
from pathlib import Path, PurePosixPath

from gen_data.generator.core.errors import AssetError

MAX_ENTRIES = 100_000
"""Bound on files and folders visited; more suggest a whole disk instead of an asset folder."""


def list_files(root: Path) -> tuple[str, ...]:
    """List all files below a folder, relative to it, sorted part by part.

    Hidden files and folders (leading dot) and links to folders are skipped.

    Raises:
        AssetError: if a folder cannot be read, or there are more than ``MAX_ENTRIES`` entries.
    """
    found: list[PurePosixPath] = []
    visited = 0
    for folder, names, files in os.walk(root, onerror=_raise_unreadable):
        names[:] = [name for name in names if not name.startswith(".")]
        visited += len(names) + len(files)
        if visited > MAX_ENTRIES:
            raise AssetError(
                f"{root}: holds more than {MAX_ENTRIES} files and folders; "
                "give the folder that holds the assets only"
            )
        below = PurePosixPath(Path(folder).relative_to(root).as_posix())
        found += [below / name for name in files if not name.startswith(".")]
    return tuple(str(path) for path in sorted(found, key=lambda path: path.parts))


def is_pattern(file: str) -> bool:
    """Whether a path contains wildcards."""
    return any(character in file for character in "*?[")


def match_files(pattern: str, files: tuple[str, ...]) -> tuple[str, ...]:
    """Select files that match a pattern part by part; ``**`` matches any number of folders."""
    parts = PurePosixPath(pattern).parts
    return tuple(file for file in files if _matches(PurePosixPath(file).parts, parts))


def asset_id_from_path(file: str) -> str:
    """Asset id of a file: its path without suffix, in permitted characters."""
    path = PurePosixPath(file)
    return "/".join(
        sanitize_word(part).lstrip("-") or "_" for part in (*path.parent.parts, path.stem)
    )


def category_from_path(root: Path, file: str) -> str:
    """Name of the folder that holds a file."""
    return PurePosixPath(file).parent.name or root.resolve().name


def sanitize_word(text: str) -> str:
    """Replace all characters that a tag may not hold by ``_``."""
    return "".join(c if c.isascii() and (c.isalnum() or c in "_-") else "_" for c in text) or "_"


def _matches(parts: tuple[str, ...], patterns: tuple[str, ...]) -> bool:
    if not patterns:
        return not parts
    if patterns[0] == "**":
        return any(_matches(parts[k:], patterns[1:]) for k in range(len(parts) + 1))
    return bool(parts) and fnmatchcase(parts[0], patterns[0]) and _matches(parts[1:], patterns[1:])


def _raise_unreadable(error: OSError) -> None:
    raise AssetError(
        f"{error.filename}: {error.strerror}; all folders inside an asset folder must be readable"
    ) from None
