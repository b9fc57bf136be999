"""Files of an asset folder: safe reading, listing, and facts derived from their paths.

All asset files are opened through ``Folder``. Every path is resolved, including symbolic links, and
must stay inside the folder. Only regular files of bounded size are read. The digest of every file
read is recorded, to detect files that change between hashing and parsing.
"""

import os
import re
import stat
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from hashlib import sha256
from pathlib import Path, PurePosixPath

from gen_data.core.errors import AssetError
from gen_data.core.system_calls import READ_FLAGS

MAX_FILE_BYTES = 512 * 1024 * 1024
_MAX_REFERENCE = 1024
_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:")


@dataclass
class Folder:
    """Reader of files below ``root``.

    Attributes:
        root: The folder; nothing outside it is ever opened.
        digests: ``{path relative to the root: sha256}`` of the files read through this object.
    """

    root: Path
    digests: dict[str, str] = field(default_factory=dict)

    def read(self, relative: str) -> bytes:
        """Read the bytes of a file.

        Raises:
            AssetError: if it is missing, unreadable, too large, outside, or not a regular file.
        """
        path = self.path(relative)
        try:
            # Non-blocking, because opening a FIFO for reading otherwise waits for a writer.
            descriptor = os.open(path, READ_FLAGS)
            with os.fdopen(descriptor, "rb") as file:
                status = os.fstat(file.fileno())
                if not stat.S_ISREG(status.st_mode):
                    raise AssetError(f"{path}: not a regular file; give a file")
                if status.st_size > MAX_FILE_BYTES:
                    raise AssetError(
                        f"{path}: {status.st_size} bytes; at most {MAX_FILE_BYTES} are read, "
                        "decimate or split it"
                    )
                # A fixed size: reading to the end of a file that grows meanwhile has no bound.
                data = file.read(status.st_size)
        except OSError as error:
            raise AssetError(f"{path}: {error.strerror}; check the path and its rights") from None
        self.digests[relative] = sha256(data).hexdigest()
        return data

    def path(self, relative: str) -> Path:
        """Resolve the path of a file. Raises AssetError if it is outside the folder."""
        shown = self.root / relative[:80]
        if "\0" in relative or len(relative) > _MAX_REFERENCE:
            raise AssetError(f"{str(shown)!r}: not a usable file name; rename it")
        root = self.root.resolve()
        try:
            path = (root / relative).resolve()
        except (OSError, RuntimeError):
            raise AssetError(f"{shown}: cannot be resolved; remove the link loop") from None
        if not path.is_relative_to(root):
            raise AssetError(f"{shown}: lies outside {self.root}; move the file into that folder")
        return path

    def exists(self, relative: str) -> bool:
        """Whether the folder holds a regular file of that name."""
        try:
            return self.path(relative).is_file()
        except AssetError:
            return False

    def refer(self, base: str, reference: str) -> str:
        """Resolve a reference in the file ``base`` to a path relative to the root.

        Raises:
            AssetError: if it is a URL, absolute, or leaves the folder.
        """
        reference = reference.strip().replace("\\", "/")
        if _SCHEME.match(reference) or reference.startswith("/") or not reference:
            raise AssetError(
                f"{self.root / base}: refers to '{reference[:80]}'; "
                "only relative paths inside the asset folder are followed"
            )
        parts: list[str] = []
        for part in (*PurePosixPath(base).parent.parts, *PurePosixPath(reference).parts):
            if part == "..":
                if not parts:
                    raise AssetError(
                        f"{self.root / base}: refers to '{reference[:80]}' outside {self.root}; "
                        "move the file into that folder"
                    )
                parts.pop()
            elif part != ".":
                parts.append(part)
        return "/".join(parts)


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
    """Select files that match a pattern part by part; ``**`` matches any number of folders.

    Suffixes match in any case: cameras write ``.JPG``.
    """
    parts = PurePosixPath(pattern).parts
    return tuple(file for file in files if _matches(PurePosixPath(file).parts, parts))


def asset_id_from_path(file: str) -> str:
    """Asset id of a file: its path without suffix, in permitted characters."""
    path = PurePosixPath(file)
    return "/".join(
        sanitize_word(part).lstrip("-") or "_" for part in (*path.parent.parts, path.stem)
    )


def category_from_path(root: Path, file: str) -> str:
    """Name of the folder that holds a file.

    Folders that only sort files (``meshes``, ``google_16k``, ``visual``) and hashes are passed over
    in favour of the folder above, as in YCB, Google Scanned Objects and ShapeNet; in folders of BOP
    models, every ``obj_000001`` is a category.
    """
    path = PurePosixPath(file)
    if _BOP_MODEL.fullmatch(path.stem):
        return path.stem
    names = [part for part in reversed(path.parent.parts) if not _SORTING.fullmatch(part.lower())]
    return next(iter(names), "") or path.parent.name or root.resolve().name


_BOP_MODEL = re.compile(r"obj_\d{6}")
_SORTING = re.compile(
    r"mesh(es)?|models?(_\w+)?|google_\d+k|poisson|tsdf|clouds|visuals?|collisions?|textures?|"
    r"materials|assets|obj|stl|ply|dae|glb|gltf|usd|usdz|textured(_\w+)?|nontextured|"
    r"(?=\w*\d)[0-9a-f]{24,40}"
)
"""Names of folders that do not describe their contents."""


def sanitize_word(text: str) -> str:
    """Replace all characters that a tag may not hold by ``_``."""
    return "".join(c if c.isascii() and (c.isalnum() or c in "_-") else "_" for c in text) or "_"


def _matches(parts: tuple[str, ...], patterns: tuple[str, ...]) -> bool:
    if not patterns:
        return not parts
    if patterns[0] == "**":
        return any(_matches(parts[k:], patterns[1:]) for k in range(len(parts) + 1))
    if len(parts) == len(patterns) == 1:
        return fnmatchcase(_lower_suffix(parts[0]), _lower_suffix(patterns[0]))
    return bool(parts) and fnmatchcase(parts[0], patterns[0]) and _matches(parts[1:], patterns[1:])


def _lower_suffix(name: str) -> str:
    stem, dot, suffix = name.rpartition(".")
    return f"{stem}.{suffix.lower()}" if dot else name


def _raise_unreadable(error: OSError) -> None:
    raise AssetError(
        f"{error.filename}: {error.strerror}; all folders inside an asset folder must be readable"
    ) from None
