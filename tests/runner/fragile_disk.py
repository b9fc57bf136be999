"""A disk that fails at the k-th operation: by an errno, by a kill, or by a power cut.

Every operation through which the runner changes a folder is counted. A kill freezes the process: no
later operation happens. A power cut also loses changes that no fsync had made durable: bytes of
files, renames, new and removed names; which of them are lost is drawn from a seed, because POSIX
leaves it open.
"""

import errno
import os
import pathlib
import random
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

OPERATIONS = ("fsync", "mkdir", "rename", "replace", "unlink", "link", "rmdir")
ERRNOS = (errno.ENOSPC, errno.EIO, errno.EDQUOT, errno.EROFS, errno.EACCES)


class Killed(BaseException):
    """The process is gone; nothing may catch this."""


@dataclass
class Pending:
    """A change of names that no fsync of ``folder`` has made durable."""

    folder: str
    undo: Callable[[], None]


@dataclass
class FragileDisk:
    """Counts operations under ``root`` and lets one of them fail.

    Attributes:
        fail_at: Number of the operation that fails, from 1; 0 = none.
        errno: The error that it and all later ones give; 0 = the process is killed there.
        before: Called with the number of each operation, before it.
    """

    root: Path
    attic: Path
    fail_at: int = 0
    errno: int = 0
    before: Callable[[int], object] = lambda number: None
    count: int = 0
    healed: bool = False
    pending: list[Pending] = field(default_factory=list)
    synced_bytes: dict[int, int] = field(default_factory=dict)
    synced_folders: set[str] = field(default_factory=set)
    originals: dict[str, Callable[..., Any]] = field(default_factory=dict)

    def install(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Stand between the runner and the operating system."""
        self.attic.mkdir(exist_ok=True)
        for name in OPERATIONS:
            self.originals[name] = getattr(os, name)
            monkeypatch.setattr(os, name, self._wrapped(name))
            # Python 3.10's pathlib took its functions when it was imported.
            accessor = getattr(pathlib, "_NormalAccessor", None)
            if accessor is not None and hasattr(accessor, name):
                monkeypatch.setattr(accessor, name, staticmethod(self._wrapped(name)))

    def _wrapped(self, name: str) -> Callable[..., Any]:
        def operation(*arguments: Any, **options: Any) -> Any:
            path = self._path(arguments[0], options)
            if not path.startswith(str(self.root)):
                return self.originals[name](*arguments, **options)
            self._count(path)
            note = getattr(self, f"_note_{name}", None)
            undo = None if note is None else note(path, *map(self._text, arguments[1:2]))
            result = self.originals[name](*arguments, **options)
            if undo is not None:
                self.pending.append(undo)
            return result

        return operation

    def _count(self, path: str) -> None:
        if self.healed:
            return
        self.count += 1
        self.before(self.count)
        if self.fail_at and self.count >= self.fail_at:
            if self.errno:
                raise OSError(self.errno, os.strerror(self.errno), path)
            raise Killed

    def _path(self, argument: Any, options: dict[str, Any]) -> str:
        if isinstance(argument, int):
            return str(Path(f"/proc/self/fd/{argument}").readlink())
        folder = options.get("dir_fd")
        if folder is not None:
            return f"{Path(f'/proc/self/fd/{folder}').readlink()}/{os.fspath(argument)}"
        return self._text(argument)

    @staticmethod
    def _text(argument: Any) -> str:
        return os.fspath(argument) if isinstance(argument, (str, os.PathLike)) else str(argument)

    def _note_fsync(self, path: str) -> None:
        if Path(path).is_dir():
            self.synced_folders.add(path)
            self.pending = [p for p in self.pending if p.folder != path]
        else:
            status = Path(path).stat()
            self.synced_bytes[status.st_ino] = status.st_size

    def _note_rename(self, source: str, target: str) -> Pending:
        kept = self._keep(target) if Path(target).is_file() else None
        moved = {p for p in self.synced_folders if p == source or p.startswith(f"{source}/")}
        self.synced_folders |= {target + p[len(source) :] for p in moved}

        def undo() -> None:
            if Path(target).exists() and Path(source).parent.is_dir():
                self.originals["rename"](target, source)
            if kept is not None:
                self.originals["rename"](kept, target)

        return Pending(str(Path(target).parent), undo)

    _note_replace = _note_rename

    def _note_mkdir(self, path: str, *_: str) -> Pending | None:
        if path == str(self.root):
            # Its parent is outside the watched folder.
            return None
        return Pending(str(Path(path).parent), lambda: shutil.rmtree(path, ignore_errors=True))

    def _note_unlink(self, path: str, *_: str) -> Pending:
        kept = self._keep(path)

        def undo() -> None:
            if Path(path).parent.is_dir():
                self.originals["rename"](kept, path)

        return Pending(str(Path(path).parent), undo)

    def _keep(self, path: str) -> str:
        kept = str(self.attic / f"{self.count}-{len(self.pending)}-{Path(path).name}")
        self.originals["link"](path, kept)
        return kept

    def cut_power(self, seed: int) -> None:
        """Lose changes that were not durable: some names, newest first, then bytes."""
        self.healed = True
        rng = random.Random(seed)
        share, remains = rng.choice([0.0, 0.5, 1.0]), rng.choice(REMAINS)
        for change in reversed(self.pending):
            if rng.random() < share:
                change.undo()
        self.pending.clear()
        for folder, folders, names in os.walk(self.root):
            if folder == str(self.root) and "run" in folders:
                folders.remove("run")
            for name in names:
                path = Path(folder, name)
                if folder not in self.synced_folders and rng.random() < share:
                    self.originals["unlink"](path)
                elif self.synced_bytes.get(path.stat().st_ino) != path.stat().st_size:
                    path.write_bytes(remains(path.read_bytes()))


REMAINS: tuple[Callable[[bytes], bytes], ...] = (
    lambda data: b"",
    lambda data: data[: len(data) // 2],
    lambda data: b"\0" * len(data),
    lambda data: data,
)
"""A possible remainder of bytes that were not synced."""
