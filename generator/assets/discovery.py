"""The files of a user's folder: a bounded walk, and the names that follow from paths."""

from __future__ import annotations

import os
from fnmatch import fnmatchcase
from pathlib import Path, PurePosixPath

from gen_data.generator.core.errors import AssetError

MAX_ENTRIES = 100_000
"""Files and folders that are looked at; more are not a folder of assets but a whole disk."""


def files_below(root: Path) -> tuple[str, ...]:
    """All files in a folder and the folders below it, relative to it, sorted part by part.

    Folders and files whose names begin with a dot, and links to folders, are passed over.

    Raises:
        AssetError: if a folder cannot be read, or there are more than ``MAX_ENTRIES`` entries.
    """
    found: list[PurePosixPath] = []
    visited = 0
    for folder, names, files in os.walk(root, onerror=_refuse):
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
    """Whether a path stands for all files that match it."""
    return any(character in file for character in "*?[")


def matching(pattern: str, files: tuple[str, ...]) -> tuple[str, ...]:
    """Files that match a pattern, part by part; ``**`` stands for any number of folders."""
    parts = PurePosixPath(pattern).parts
    return tuple(file for file in files if _matches(PurePosixPath(file).parts, parts))


def id_of(file: str) -> str:
    """The asset id that a path without its suffix makes."""
    path = PurePosixPath(file)
    return "/".join(word_of(part).lstrip("-") or "_" for part in (*path.parent.parts, path.stem))


def category_of(root: Path, file: str) -> str:
    """The name of the folder that holds a file."""
    return PurePosixPath(file).parent.name or root.resolve().name


def word_of(text: str) -> str:
    """A text with everything replaced by ``_`` that a tag may not hold."""
    return "".join(c if c.isascii() and (c.isalnum() or c in "_-") else "_" for c in text) or "_"


def _matches(parts: tuple[str, ...], patterns: tuple[str, ...]) -> bool:
    if not patterns:
        return not parts
    if patterns[0] == "**":
        return any(_matches(parts[k:], patterns[1:]) for k in range(len(parts) + 1))
    return bool(parts) and fnmatchcase(parts[0], patterns[0]) and _matches(parts[1:], patterns[1:])


def _refuse(error: OSError) -> None:
    raise AssetError(
        f"{error.filename}: {error.strerror}; a folder of assets must be readable with all that "
        "is in it"
    ) from None
