"""The seal of a data set: ``SHA256SUMS`` names every file, the manifest's id names the sums."""

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from gen_data.core.errors import DeterminismError
from gen_data.runner.layout import MANIFEST_NAME, SHARDS_NAME, SUMS_NAME

SUM_LINE = re.compile(r"([0-9a-f]{64})  (\S.*)")


@dataclass(frozen=True, slots=True)
class Entry:
    """One file of the data set as a whole; ``path`` is relative to its root."""

    path: str
    bytes: int
    sha256: str


def sums_text(entries: Sequence[Entry]) -> str:
    """The format of ``sha256sum``."""
    return "".join(f"{entry.sha256}  {entry.path}\n" for entry in entries)


def dataset_id(sums: str) -> str:
    """Identity of a data set: sha256 of ``SHA256SUMS`` without the manifest's own line.

    ``grep -v '  manifest.json$' SHA256SUMS | sha256sum`` prints it.
    """
    return hashlib.sha256(sums.encode()).hexdigest()


@dataclass(frozen=True)
class Sums:
    """Contents of ``SHA256SUMS``.

    Attributes:
        digests: ``{path: sha256}`` of the lines that can be read; empty without the file.
        damaged: Some line cannot be read, or is there twice.
        dataset_id: Id of the data set with these files, excluding the manifest's line.
    """

    digests: Mapping[str, str]
    damaged: bool
    dataset_id: str


def read_sums(folder: Path) -> Sums:
    """Read the sums of the data set in ``folder``."""
    return parse_sums(read_or_empty(folder / SUMS_NAME))


def parse_sums(data: bytes) -> Sums:
    """Parse the contents of ``SHA256SUMS``."""
    lines = data.decode(errors="replace").splitlines()
    matches = [SUM_LINE.fullmatch(line) for line in lines]
    digests = {match[2]: match[1] for match in matches if match}
    others = "".join(f"{line}\n" for line in lines if not line.endswith(f"  {MANIFEST_NAME}"))
    damaged = None in matches or len(digests) != len(lines)
    return Sums(digests, damaged, dataset_id(others))


def read_or_empty(path: Path) -> bytes:
    """The bytes of a file; none if it is missing or not a regular file."""
    return path.read_bytes() if path.is_file() else b""


def parse_object(data: bytes) -> dict[str, Any] | None:
    """Parse a JSON object; None if it is none."""
    try:
        value = json.loads(data)
    except ValueError:
        return None
    return value if isinstance(value, dict) else None


class Expectation(Protocol):
    """Requirements for sealing a data set."""

    def expect(self, entries: Sequence[Entry]) -> None:
        """Raise DeterminismError if it is another one; its files are sorted by path."""
        ...


@dataclass(frozen=True)
class SealedBefore:
    """Seal of a data set that was damaged since.

    Attributes:
        ids: Ids of the data set: from its manifest and from its sums. They differ if
            one of the two files is damaged.
        sums: ``{path: sha256}``.
    """

    ids: frozenset[str]
    sums: Mapping[str, str]

    def expect(self, entries: Sequence[Entry]) -> None:
        """Compare with the files of the repaired data set, sorted by path.

        Raises:
            DeterminismError: they differ; the message names the first files.
        """
        if not self.ids or dataset_id(sums_text(entries)) in self.ids:
            return
        now = {entry.path: entry.sha256 for entry in entries}
        was = {path: digest for path, digest in self.sums.items() if path != MANIFEST_NAME}
        paths = [path for path in sorted({*was, *now}) if was.get(path) != now.get(path)]
        # Shards first: exporters make the other files from them.
        paths.sort(key=lambda path: not path.startswith(f"{SHARDS_NAME}/"))
        raise DeterminismError(
            f"{len(paths)} file(s) differ from {SUMS_NAME} and {MANIFEST_NAME}: "
            f"{', '.join(paths[:3])}{' ...' if len(paths) > 3 else ''}; nothing was sealed.\n"
            f"  The replaced files are in run/quarantine. If {SUMS_NAME} itself is damaged, delete "
            "it and repeat the command"
        )


def parse_seal(sums_data: bytes, manifest_data: bytes) -> SealedBefore:
    """Parse sums and manifest of a data set; no ids if both are empty."""
    sums = parse_sums(sums_data)
    manifest = parse_object(manifest_data) or {}
    ids = {str(manifest["dataset_id"])} if "dataset_id" in manifest else set()
    if sums.digests:
        ids.add(sums.dataset_id)
    return SealedBefore(frozenset(ids), sums.digests)
