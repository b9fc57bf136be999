"""Files that appear with all their bytes, or not at all: a full disk leaves no half of one."""

import errno
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from gen_data.core.errors import StorageError


def check_place(path: Path, option: str) -> None:
    """Find out, before long work for a file, whether it can be written; missing folders may be.

    Raises:
        StorageError: the path is a folder, or its folder cannot be made or written to; ``option``
            chooses another one.
    """
    try:
        folder = next(parent for parent in path.absolute().parents if parent.exists())
        if path.is_dir():
            raise OSError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        if not folder.is_dir():
            raise OSError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(folder))
        if not os.access(folder, os.W_OK | os.X_OK):
            raise OSError(errno.EACCES, os.strerror(errno.EACCES), str(folder))
    except OSError as error:
        fact = f"{error.filename}: {error.strerror}; choose another {option}"
        raise StorageError(fact) from error


def check_new(paths: Iterable[Path], *, force: bool) -> None:
    """Find out, before long work for the files of ``--out``, whether they can be written.

    Raises:
        StorageError: see ``check_place``; or a file exists, and ``force`` does not replace it.
    """
    for path in paths:
        check_place(path, "--out")
        if path.exists() and not force:
            raise StorageError(f"{path}: exists; choose another --out, or replace it with --force")


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Provide the name of a new file next to ``path``, which it replaces after the block.

    Missing folders are created. After an error, ``path`` is as it was.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    # The same suffix: encoders choose the format by it.
    unfinished = path.with_name(f".{os.getpid()}-unfinished-{path.name}"[-255:])
    try:
        yield unfinished
        unfinished.replace(path)
    except BaseException:
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)
        raise


def write_whole(files: Mapping[Path, bytes]) -> None:
    """Write files that belong together; none is replaced unless all have their bytes.

    Raises:
        OSError: a file cannot be written.
    """
    if not files:
        return
    (path, data), *others = files.items()
    with whole_file(path) as unfinished:
        unfinished.write_bytes(data)
        write_whole(dict(others))
