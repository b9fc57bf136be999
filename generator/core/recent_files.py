"""Folders of files below a size: the least recently used files go first."""

import os
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

KEPT_SHARE = 0.9
"""Share of the bound that remains after a removal."""


def remove_least_recent(folders: Iterable[Path], max_bytes: int) -> int:
    """Remove the least recently used files in subfolders of ``folders`` above a size together.

    Unfinished files of killed processes are removed as others. Files that another process removes
    or prevents from being removed are skipped.

    Returns:
        Bytes of the files that remain.
    """
    kept = sorted(entry for folder in folders for entry in _entries(folder))
    total = sum(size for _, size, _ in kept)
    if total > max_bytes:
        for _, size, path in kept:
            if total <= KEPT_SHARE * max_bytes:
                break
            with suppress(OSError):
                os.unlink(path)  # noqa: PTH108
                total -= size
    return total


def _entries(folder: Path) -> Iterator[tuple[int, int, str]]:
    """Time of last use [ns], size [bytes] and path of every file in a subfolder.

    File systems note reading once a day, or never (``relatime``, ``noatime``): writing counts too.
    """
    for path in [*folder.glob("*")]:
        with suppress(OSError), os.scandir(path) as listed:
            for entry in listed:
                with suppress(FileNotFoundError):
                    facts = entry.stat(follow_symlinks=False)
                    yield max(facts.st_atime_ns, facts.st_mtime_ns), facts.st_size, entry.path
