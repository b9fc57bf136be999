"""Storage of a data set in a folder.

Nothing is inferred from the files in a folder: a shard either matches its record or is generated
again.
"""

import json
import os
import shlex
import shutil
import socket
from array import array
from collections.abc import Callable, Container, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

from gen_data.core.errors import ConfigError, DeterminismError, StorageError
from gen_data.core.system_calls import try_lock
from gen_data.runner.durable_files import (
    Inode,
    free_bytes,
    hash_file,
    make_folder,
    move_durably,
    scan_tree,
    storage_errors,
    sync_path,
    sync_tree,
    write_durably,
)
from gen_data.runner.failed_sample import FailedSample
from gen_data.runner.layout import (
    CERTIFICATE_NAMES,
    LICENCES_NAME,
    MANIFEST_NAME,
    PLAN_NAME,
    RUN_NAME,
    SHARDS_NAME,
    SUMS_NAME,
    record_path,
    shard_path,
)
from gen_data.runner.plan import Plan, compare_plans, load_plan, plan_bytes, write_plan
from gen_data.runner.shard_record import ShardRecord, parse_record

REMEDY = "choose another folder with --out"
SCRATCH_FOLDERS_MAX = 1_000_000
RUN_NAMES = frozenset({"lock", "tmp", "tmp-doomed", PLAN_NAME})
"""Contents of ``run`` before ``plan.json`` is written."""


class FolderState(Enum):
    """State of an output folder."""

    NEW = "nothing yet"
    STARTED = "an unfinished data set of this plan"
    FINISHED = "a finished data set of this plan"


@dataclass(frozen=True)
class Scan:
    """Result of reading all records.

    Attributes:
        missing: Shards to generate, ascending. A ``range`` for a new data set, to save memory.
        samples, bytes, rejections: Sums over the committed shards.
        failed: Samples that these do not have.
    """

    missing: Sequence[int]
    samples: int = 0
    bytes: int = 0
    rejections: int = 0
    failed: tuple[FailedSample, ...] = ()

    def within(self, shards: range | None) -> "Scan":
        """The same result with those missing shards only that lie in a range; None = all."""
        if shards is None:
            return self
        if isinstance(self.missing, range):
            return replace(self, missing=self.missing[shards.start : shards.stop])
        return replace(self, missing=[shard for shard in self.missing if shard in shards])


@dataclass(frozen=True)
class LocalStore:
    """The folder of a data set on a local file system. Only data: every process may have one.

    Attributes:
        root: The folder.
        resume_command: Command that error messages give for resuming.
    """

    root: Path
    resume_command: str = ""

    @property
    def run_dir(self) -> Path:
        """Folder of everything that is not part of the data set."""
        return self.root / RUN_NAME

    @property
    def manifest_path(self) -> Path:
        """Path of the manifest of a finished data set."""
        return self.root / MANIFEST_NAME

    @property
    def _shards_dir(self) -> Path:
        return self.root / SHARDS_NAME

    @property
    def _lock_path(self) -> Path:
        return self.run_dir / "lock"

    @property
    def scratch_root(self) -> Path:
        """Folder of unfinished and temporary files; cleared before and after a run."""
        return self.run_dir / "tmp"

    def shard_dir(self, shard: int) -> Path:
        """Path of the folder of a committed shard."""
        return shard_path(self.root, shard)

    def record_path(self, shard: int) -> Path:
        """Path of the record of a committed shard."""
        return record_path(self.root, shard)

    @property
    def place(self) -> str:
        """The data set's place in messages."""
        return str(self.root)

    def free_bytes(self) -> int:
        """Free space for shards."""
        return free_bytes(self.root)

    def fetch_shards(self, plan: Plan, with_files: bool) -> None:
        """Make records, and files if wanted, of all shards available in ``root``: they are."""

    def publish(self) -> None:
        """Put the merged and sealed data set in its place: it is there."""

    def is_intact(self, extra_matters: bool, on_progress: Callable[[float], None]) -> bool:
        """Whether a finished data set is undamaged, with or without additional files.

        ``on_progress`` is called with the share of bytes that were hashed, where it is known.
        """
        from gen_data.runner.verify import find_deviations

        del on_progress
        found = find_deviations(self.root, full=True)
        return not found or (
            not extra_matters and all(finding.kind == "extra" for finding in found)
        )

    def read_manifest(self) -> bytes:
        """The bytes of the manifest of a finished data set."""
        return self.manifest_path.read_bytes()

    def read_documents(self, names: Iterable[str]) -> dict[str, bytes]:
        """``{name: bytes}`` of files at the root of the data set; none of missing files."""
        paths = {name: self.root / name for name in names}
        return {name: path.read_bytes() if path.is_file() else b"" for name, path in paths.items()}

    def read_run_file(self, name: str) -> bytes:
        """The bytes of a file about the run; none if it does not exist."""
        path = self.run_dir / name
        return path.read_bytes() if path.is_file() else b""

    def create_run_file(self, name: str, data: bytes) -> None:
        """Write a file about the run, unless there is one: of several workers, the first wins."""
        path = self.run_dir / name
        if path.exists():
            return
        unfinished = self.scratch_dir() / name
        unfinished.write_bytes(data)
        sync_path(unfinished)
        try:
            os.link(unfinished, path)
        except FileExistsError:
            return
        sync_path(path.parent)

    def append_run_file(self, name: str, data: bytes) -> None:
        """Append to a file about the run."""
        with (self.run_dir / name).open("ab") as file:
            file.write(data)

    def has_shards(self) -> bool:
        """Whether the folder of shards exists."""
        return os.path.lexists(self._shards_dir)

    def reproduce_command(self, index: int) -> str:
        """Command that generates one sample of this data set by itself."""
        return f"gen-data repro {shlex.quote(str(self.root))} --index {index}"

    def errors(self) -> AbstractContextManager[None]:
        """Context that turns OSErrors into StorageErrors with the resume command."""
        return storage_errors(self.root, self.resume_command)

    def state(self, plan: Plan) -> FolderState:
        """Determine the state of the folder; changes nothing.

        Raises:
            StorageError: the folder has other contents, or a data set of another plan.
        """
        if not self.root.exists():
            self._check_parents()
            return FolderState.NEW
        if not self.root.is_dir():
            raise StorageError(f"{self.root}: is not a folder; {REMEDY}")
        names = {path.name for path in self.root.iterdir()}
        if PLAN_NAME in names:
            grows = self._check_plan(plan)
            is_finished = MANIFEST_NAME in names and not grows
            return FolderState.FINISHED if is_finished else FolderState.STARTED
        if names - {RUN_NAME} or not _is_run_dir(self.run_dir):
            raise StorageError(
                f"{self.root}: not empty and not a gen-data data set; "
                "nothing was changed. Choose another folder with --out, or empty this one."
            )
        return FolderState.NEW

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Lock the folder; the kernel releases the lock when the process ends in any way.

        Raises:
            ConfigError: another process holds the lock; the message names host and pid.
        """
        with self.errors():
            make_folder(self.run_dir)
            descriptor = os.open(self._lock_path, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            with self.errors():
                self._lock(descriptor)
            yield
        finally:
            os.close(descriptor)

    def check_unlocked(self) -> None:
        """Refuse a folder in which another run is writing, before anything else is loaded.

        Raises:
            ConfigError: another process holds the lock; the message names host and pid.
        """
        try:
            descriptor = os.open(self._lock_path, os.O_RDWR)
        except OSError:
            # Never written to, or not writable: found out later, with a message.
            return
        try:
            self._acquire(descriptor)
        finally:
            os.close(descriptor)

    def prepare(self, plan: Plan) -> None:
        """Prepare the folder for shards: remove unfinished files, write the plan and its copy.

        An existing manifest is removed: call this only if shards are missing.
        """
        with self.errors():
            self.clear_scratch()
            make_folder(self.scratch_root)
            self._clear_places()
            path, copy = self.root / PLAN_NAME, self.run_dir / PLAN_NAME
            if not path.exists() or path.read_bytes() != plan_bytes(plan):
                # Sums of fewer samples would not belong to this plan.
                (self.root / SUMS_NAME).unlink(missing_ok=True)
            # The copy first: repair takes it for the plan when the two differ.
            for kept in (copy, path):
                if not kept.exists() or kept.read_bytes() != plan_bytes(plan):
                    write_plan(plan, kept.parent, self.scratch_root)
            make_folder(self._shards_dir)
            if self.manifest_path.exists():
                self.manifest_path.unlink()
                # The certified data set no longer exists.
                for name in CERTIFICATE_NAMES:
                    (self.root / name).unlink(missing_ok=True)
                sync_path(self.root)

    def _clear_places(self) -> None:
        """Quarantine whatever is in the place of a file or folder and is none."""
        for name in (PLAN_NAME, MANIFEST_NAME, SUMS_NAME, LICENCES_NAME):
            path = self.root / name
            if os.path.lexists(path) and (path.is_symlink() or not path.is_file()):
                self.set_aside(path)
        folder = self._shards_dir
        if os.path.lexists(folder) and (folder.is_symlink() or not folder.is_dir()):
            self.set_aside(folder)

    def clear_scratch(self) -> None:
        """Remove unfinished files. The folder is renamed first, out of reach of late writers."""
        if self.scratch_root.exists():
            doomed = self.run_dir / "tmp-doomed"
            shutil.rmtree(doomed, ignore_errors=True)
            self.scratch_root.rename(doomed)
            shutil.rmtree(doomed, ignore_errors=True)

    def scratch_dir(self) -> Path:
        """Create an empty folder for unfinished files, on the file system of the data set."""
        for number in range(SCRATCH_FOLDERS_MAX):
            folder = self.scratch_root / f"{os.getpid()}-{number}"
            try:
                folder.mkdir()
            except FileExistsError:
                continue
            return folder
        raise StorageError(f"{self.scratch_root}: {SCRATCH_FOLDERS_MAX} unfinished folders")

    def commit(self, folder: Path, record: ShardRecord, synced: Container[Inode] = ()) -> None:
        """Publish a finished shard: files, then folder, then record, each synced before the next.

        ``synced`` are the inodes of files that are already on the disk.

        Publishing the same bytes twice changes nothing.

        Raises:
            DeterminismError: the shard was committed before, with other bytes.
        """
        committed = self.record(record.shard)
        if committed is not None:
            self._expect_equal(committed, record, folder)
            return
        sync_tree(folder, synced)
        # A kill between the two steps below leaves a folder without a record.
        self.quarantine(record.shard)
        move_durably(folder, self.shard_dir(record.shard))
        write_durably(self.record_path(record.shard), record.to_bytes(), self.scratch_root)

    def record(self, shard: int) -> ShardRecord | None:
        """Read the record of a shard; None if it is missing or damaged."""
        path = self.record_path(shard)
        return parse_record(path.read_bytes()) if path.is_file() else None

    def scan(self, plan: Plan, full: bool = False, whole_only: bool = False) -> Scan:
        """Check every record and the sizes of its files, or their digests when ``full``.

        Damaged shards, and with ``whole_only`` those without some of their samples, are moved to
        ``run/quarantine`` and count as missing.
        """
        with self.errors():
            if next(self._shards_dir.iterdir(), None) is None:
                return Scan(missing=range(plan.shard_count))
            missing = array("q")
            samples, size, rejections = 0, 0, 0
            failed: list[FailedSample] = []
            for shard in range(plan.shard_count):
                record = self._intact_record(plan, shard, full)
                if record is None or (whole_only and record.failed):
                    self.quarantine(shard)
                    missing.append(shard)
                else:
                    samples += record.samples
                    failed += record.failed
                    size += record.size_bytes
                    rejections += record.rejections
            return Scan(missing, samples, size, rejections, tuple(failed))

    def quarantine_damaged(self, plan: Plan, shards: Iterable[int]) -> list[int]:
        """Hash the files of these shards, and quarantine files that differ from their records.

        Returns:
            The quarantined shards.
        """
        with self.errors():
            damaged = [s for s in shards if self._intact_record(plan, s, full=True) is None]
            for shard in damaged:
                self.quarantine(shard)
        return damaged

    def quarantine(self, shard: int) -> None:
        """Move the record and the folder of a shard, if they exist, out of the data set."""
        # The record first: without it, the folder is not a shard.
        for path in (self.record_path(shard), self.shard_dir(shard)):
            if os.path.lexists(path):
                self.set_aside(path)

    def replace_file(self, name: str, data: bytes, scratch: Path) -> None:
        """Write a file of the data set as a whole; a folder in its place is set aside."""
        path = self.root / name
        if path.is_dir() and not path.is_symlink():
            self.set_aside(path)
        write_durably(path, data, scratch)

    def set_aside(self, path: Path) -> Path:
        """Move a file or folder to ``run/quarantine``; returns its new path."""
        folder = self.run_dir / "quarantine"
        make_folder(folder)
        taken = {entry.name for entry in folder.iterdir()}
        number = next(i for i in range(len(taken) + 1) if f"{i}-{path.name}" not in taken)
        kept = folder / f"{number}-{path.name}"
        move_durably(path, kept)
        return kept

    def _intact_record(self, plan: Plan, shard: int, full: bool) -> ShardRecord | None:
        record = self.record(shard)
        if record is None:
            return None
        folder, indices = self.shard_dir(shard), plan.samples_of(shard)
        if (record.shard, record.first, record.end) != (shard, indices.start, indices.stop):
            return None
        if folder.is_symlink():
            return None
        declared = {file.path: file.bytes for file in record.files}
        if scan_tree(folder) != (declared, record.empty_folders):
            return None
        if full and any(hash_file(folder / f.path) != f.sha256 for f in record.files):
            return None
        return record

    def _expect_equal(self, committed: ShardRecord, again: ShardRecord, folder: Path) -> None:
        if committed == again:
            shutil.rmtree(folder)
            return
        kept = self.set_aside(folder)
        first = {file.path: file.sha256 for file in committed.files}
        second = {file.path: file.sha256 for file in again.files}
        paths = sorted(p for p in {*first, *second} if first.get(p) != second.get(p))
        raise DeterminismError(
            f"shard {committed.shard} came out differently the second time: "
            f"{', '.join(paths[:3]) or 'its record'}{' ...' if len(paths) > 3 else ''}.\n"
            f"  Compare: gen-data diff {shlex.quote(str(self.shard_dir(committed.shard)))} "
            f"{shlex.quote(str(kept))}"
        )

    def _check_parents(self) -> None:
        for path in (self.root, *self.root.parents):
            if path.is_symlink() and not path.exists():
                target = path.readlink()
                raise StorageError(f"{path}: links to {target}, which does not exist; {REMEDY}")
            if path.exists() and not path.is_dir():
                raise StorageError(f"{path}: is not a folder; {REMEDY}")

    def _stored_plan(self) -> Plan:
        return load_plan(self.root)

    def _check_plan(self, plan: Plan) -> bool:
        """Compare with the plan of the folder; return whether this one only has more samples.

        A data set may grow, as its samples do not depend on their number.
        """
        old = self._stored_plan()
        differences = compare_plans(old, plan)
        if len(differences) == 1 and plan.n != old.n:
            if plan.n > old.n:
                return True
            raise StorageError(
                f"{self.place}: holds {old.n} samples; nothing was changed. Expected --n "
                f"{old.n} or more, which extends the data set; or choose another folder with --out."
            )
        if differences:
            listed = "\n".join(f"  {line}" for line in differences[:20])
            more = f"\n  and {len(differences) - 20} more" if len(differences) > 20 else ""
            raise StorageError(
                f"{self.place}: holds a data set of another plan; nothing was changed:\n"
                f"{listed}{more}\n"
                "  Choose another folder with --out, or use the old configuration."
            )
        return False

    def _lock(self, descriptor: int) -> None:
        self._acquire(descriptor)
        os.ftruncate(descriptor, 0)
        owner = json.dumps({"host": socket.gethostname(), "pid": os.getpid()})
        os.write(descriptor, f"{owner}\n".encode())

    def _acquire(self, descriptor: int) -> None:
        if not try_lock(descriptor):
            raise ConfigError(
                f"{self.root}: another run is writing here: {_describe_owner(descriptor)}. "
                "Wait for it, stop it, or choose another folder with --out."
            )


def _describe_owner(descriptor: int) -> str:
    """Host and pid that the holder of a lock wrote into its file."""
    try:
        owner = json.loads(os.read(descriptor, 4096))
        return f"process {owner['pid']} on host {owner['host']}"
    except (ValueError, KeyError, TypeError):
        return "a process that has just started"


def _is_run_dir(folder: Path) -> bool:
    """Whether a folder is absent, or left by a run that was killed before it wrote its plan."""
    if not folder.exists():
        return True
    return folder.is_dir() and {p.name for p in folder.iterdir()} <= RUN_NAMES
