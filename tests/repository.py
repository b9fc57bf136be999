"""Files of the repository, without git: archives of it and bare systems have none."""

import os
from collections.abc import Iterator
from fnmatch import fnmatch
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]


@cache
def repository_files() -> tuple[str, ...]:
    return tuple(sorted(_below(ROOT, (ROOT / ".gitignore").read_text("utf-8").split())))


def _below(folder: Path, ignored: list[str]) -> Iterator[str]:
    for entry in os.scandir(folder):
        path = Path(entry).relative_to(ROOT).as_posix()
        if entry.name == ".git" or any(_matches(path, pattern) for pattern in ignored):
            continue
        if entry.is_dir(follow_symlinks=False):
            yield from _below(Path(entry), ignored)
        elif entry.is_file():
            yield path


def _matches(path: str, pattern: str) -> bool:
    """Whether a line of ``.gitignore`` means a path: its name, or all of it after a slash."""
    compared = f"/{path}" if pattern.startswith("/") else path.rpartition("/")[2]
    return fnmatch(compared, pattern.rstrip("/"))
