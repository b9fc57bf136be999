"""Safe access to a folder of assets; all asset files are opened through it.

Every path is resolved, including symbolic links, and must stay inside the folder. Only regular
files of bounded size are read. The digest of every file read is recorded, to detect files that
change between hashing and parsing.
"""

from __future__ import annotations

import os
import re
import stat
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path, PurePosixPath

from gen_data.generator.core.errors import AssetError

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
            descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
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
