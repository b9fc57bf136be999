"""Storage of a data set at a URL: S3, Google Cloud Storage, Azure Blob Storage, by ``fsspec``.

The layout is the same as in a folder. An object appears as a whole or not at all: a shard is
committed by single PUTs of its files and then of its record; the manifest comes last. Shards and
merged files are staged in a local folder, from which they vanish once they are stored.

Runs on several machines may write to one URL at the same time: a shard that two of them make has
the same bytes.
"""

import hashlib
import shutil
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike, fspath
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from gen_data.core.distribution import install_command
from gen_data.core.errors import ConfigError, GenDataError, StorageError
from gen_data.core.path_names import check_inner_path
from gen_data.core.urls import is_url
from gen_data.runner import failed_sample, layout, seal
from gen_data.runner.durable_files import (
    Inode,
    format_bytes,
    free_bytes,
    get_inode,
    hash_file,
    make_folder,
    tree_sizes,
)
from gen_data.runner.plan import Plan, parse_plan, plan_bytes
from gen_data.runner.shard_record import FileRecord, ShardRecord, parse_record
from gen_data.runner.store import FolderState, LocalStore, Scan

BATCH = 1000
"""Number of objects that one request to ``fsspec`` reads or writes."""
BATCH_BYTES = 256 << 20
"""Size of the objects that are copied at a time to be hashed, unless one is larger."""


def open_store(out: str | PathLike[str], resume_command: str = "") -> LocalStore:
    """Open the storage of a data set: a folder, or a URL."""
    if not is_url(out):
        return LocalStore(Path(out).absolute(), resume_command)
    import platformdirs

    url = fspath(out).rstrip("/")
    name = hashlib.sha256(url.encode()).hexdigest()[:16]
    root = Path(platformdirs.user_cache_path("gen-data")) / "staging" / name
    return ObjectStore(root, resume_command, ObjectFolder(url))


@dataclass(frozen=True)
class ObjectFolder:
    """Objects whose names begin with the path of a URL; picklable.

    Attributes:
        url: Without a slash at its end.
    """

    url: str

    @cached_property
    def _opened(self) -> tuple[Any, str]:
        """The file system of ``fsspec``, and the path of the folder in it."""
        try:
            from fsspec.core import url_to_fs

            opened: tuple[Any, str] = url_to_fs(self.url)
        except (ImportError, ValueError) as error:
            raise ConfigError(
                f"{self.url}: cannot be opened ({error}); expected s3://, gs://, az:// or another "
                f"URL of fsspec, and its library: {install_command('cloud')} for s3://, "
                "gcsfs for gs://, adlfs for az://"
            ) from None
        except Exception as error:
            # Some file systems connect at once.
            fact = " ".join(str(error).split()) or type(error).__name__
            raise StorageError(f"{self.url}: {fact} ({type(error).__name__})") from error
        return opened

    def __getstate__(self) -> dict[str, str]:
        """Pickle the URL: connections belong to a process."""
        return {"url": self.url}

    def path(self, name: str) -> str:
        """Path of an object in the file system."""
        return f"{self._opened[1]}/{name}"

    @contextmanager
    def errors(self, advice: str = "") -> Iterator[Any]:
        """The file system; any error of its library becomes a StorageError.

        The libraries of providers have error classes without a common base.
        """
        try:
            yield self._opened[0]
        except GenDataError:
            raise
        except Exception as error:
            fact = " ".join(str(error).split()) or type(error).__name__
            raise StorageError(f"{self.url}: {fact} ({type(error).__name__}){advice}") from error

    def names(self, inner: str = "") -> dict[str, int]:
        """``{name: bytes}`` of the entries directly in a folder; -1 for folders."""
        with self.errors() as system:
            system.invalidate_cache()
            try:
                listed = system.ls(self.path(inner).rstrip("/"), detail=True)
            except FileNotFoundError:
                return {}
        return {
            entry["name"].rstrip("/").rpartition("/")[2]: -1
            if entry["type"] == "directory"
            else int(entry["size"])
            for entry in listed
        }

    def tree(self, inner: str = "") -> dict[str, int]:
        """``{path relative to the folder: bytes}`` of all objects in it, sorted."""
        start = len(self.path(""))
        with self.errors() as system:
            system.invalidate_cache()
            found = system.find(self.path(inner).rstrip("/"), detail=True)
        sizes = {path[start:]: int(entry["size"]) for path, entry in sorted(found.items())}
        for name in sizes:
            self.check_name(name)
        return sizes

    def check_name(self, name: str) -> str:
        """Return a name if it can name a file in a folder.

        Raises:
            StorageError: as a path, it would lead out of the folder.
        """
        try:
            return check_inner_path(name)
        except ValueError as error:
            raise StorageError(f"{self.url}: {error}; the data set is not read") from None

    def read(self, names: Iterable[str]) -> dict[str, bytes]:
        """``{name: bytes}`` of the objects that exist."""
        found: dict[str, bytes] = {}
        for batch in _batches(list(names)):
            paths = [self.path(name) for name in batch]
            with self.errors() as system:
                contents = system.cat(paths, on_error="return")
                for name, path in zip(batch, paths, strict=True):
                    value = contents[path]
                    if isinstance(value, bytes):
                        found[name] = value
                    elif not isinstance(value, FileNotFoundError):
                        raise value
        return found

    def put(self, name: str, data: bytes) -> None:
        """Write one object."""
        with self.errors() as system:
            system.pipe_file(self.path(name), data)

    def create(self, name: str, data: bytes) -> None:
        """Write one object unless it exists."""
        with self.errors() as system:
            try:
                system.pipe_file(self.path(name), data, mode="create")
            except FileExistsError:
                return

    def upload(self, files: dict[str, Path]) -> None:
        """Write ``{name: file}``."""
        for batch in _batches(sorted(files)):
            with self.errors() as system:
                system.put([str(files[name]) for name in batch], [self.path(n) for n in batch])

    def download(self, files: dict[str, Path]) -> None:
        """Read ``{name: file}``."""
        for path in files.values():
            path.parent.mkdir(parents=True, exist_ok=True)
        for batch in _batches(sorted(files)):
            with self.errors() as system:
                system.get([self.path(n) for n in batch], [str(files[name]) for name in batch])

    def digests(
        self,
        sizes: Mapping[str, int],
        scratch: Path,
        on_progress: Callable[[float], None] = lambda _: None,
    ) -> dict[str, str]:
        """``{name: sha256}`` of objects; their bytes are read.

        Args:
            sizes: ``{name: bytes}`` of the objects.
            scratch: Existing folder, in which copies of ``BATCH_BYTES`` at a time lie.
            on_progress: Called with the share of bytes that were hashed.

        Raises:
            StorageError: an object cannot be read.
        """
        found: dict[str, str] = {}
        total, done = sum(sizes.values()), 0
        for batch in _batches_of_bytes(sizes):
            with TemporaryDirectory(dir=scratch) as folder:
                copies = {name: Path(folder, str(number)) for number, name in enumerate(batch)}
                self.download(copies)
                found |= {name: hash_file(path) for name, path in copies.items()}
            done += sum(sizes[name] for name in batch)
            on_progress(done / max(total, 1))
        return found

    def copy(self, names: dict[str, str]) -> None:
        """Copy ``{new name: name}`` within the storage."""
        with self.errors() as system:
            for new, name in sorted(names.items()):
                system.cp_file(self.path(name), self.path(new))

    def remove(self, names: Iterable[str]) -> None:
        """Remove objects."""
        with self.errors() as system:
            for name in names:
                system.rm_file(self.path(name))


@dataclass(frozen=True)
class ObjectStore(LocalStore):
    """The objects of a data set at a URL; ``root`` is the folder in which they are staged.

    A damaged shard loses its record and is generated again over its objects: there is no
    quarantine at a URL.

    Attributes:
        objects: At the URL.
    """

    objects: ObjectFolder = field(default_factory=lambda: ObjectFolder(""))

    @property
    def place(self) -> str:
        """The URL."""
        return self.objects.url

    @contextmanager
    def errors(self) -> Iterator[None]:
        """Turn OSErrors of the staging folder into StorageErrors with a remedy."""
        try:
            with super().errors():
                yield
        except StorageError as error:
            if not isinstance(error.__cause__, OSError):
                raise
            raise StorageError(
                f"{str(error).splitlines()[0]} Shards are staged there; point XDG_CACHE_HOME to a "
                f"folder with room and repeat:\n    {self.resume_command}"
            ) from error.__cause__

    def free_bytes(self) -> int:
        """Object storage is never full; the staging folder needs room for shards in progress."""
        return 1 << 62

    def state(self, plan: Plan) -> FolderState:
        """Determine the state of the URL; changes nothing."""
        names = self.objects.names()
        if layout.PLAN_NAME in names or self._was_sealed_with(plan):
            grows = self._check_plan(plan)
            is_finished = layout.MANIFEST_NAME in names and not grows
            return FolderState.FINISHED if is_finished else FolderState.STARTED
        if {*names} - {layout.RUN_NAME, ""}:
            raise StorageError(
                f"{self.place}: not empty and not a gen-data data set; nothing was changed. "
                "Choose another URL with --out, or empty this one."
            )
        return FolderState.NEW

    def _was_sealed_with(self, plan: Plan) -> bool:
        """Whether the sums belong to this plan, although ``plan.json`` may be damaged."""
        sums = seal.parse_sums(self.read_documents([layout.SUMS_NAME])[layout.SUMS_NAME])
        return sums.digests.get(layout.PLAN_NAME) == hashlib.sha256(plan_bytes(plan)).hexdigest()

    def _check_plan(self, plan: Plan) -> bool:
        return not self._was_sealed_with(plan) and super()._check_plan(plan)

    def _stored_plan(self) -> Plan:
        data = self.objects.read([layout.PLAN_NAME])[layout.PLAN_NAME]
        return parse_plan(data, Path(self.place))

    def prepare(self, plan: Plan) -> None:
        """Empty the staging folder, remove an existing manifest, and write the plan."""
        make_folder(self.root)
        self._clear_staging()
        super().prepare(plan)
        names = self.objects.names()
        sealed = [layout.MANIFEST_NAME, *layout.CERTIFICATE_NAMES]
        if not self._was_sealed_with(plan):
            sealed.append(layout.SUMS_NAME)
        self.objects.remove(name for name in sealed if name in names)
        self.objects.put(layout.PLAN_NAME, plan_bytes(plan))

    def _clear_staging(self) -> None:
        with self.errors():
            for entry in self.root.iterdir():
                if entry.name == layout.RUN_NAME:
                    continue
                if entry.is_dir():
                    shutil.rmtree(entry)
                else:
                    entry.unlink()

    def scan(self, plan: Plan, full: bool = False, whole_only: bool = False) -> Scan:
        """Read every record; with ``full``, also hash the objects of all shards.

        Shards that differ from their records count as missing, and with ``whole_only`` those
        without some of their samples.
        """
        records = self._pull_records(plan)
        if full:
            for shard in self._drop_damaged(records):
                del records[shard]
        failed: list[failed_sample.FailedSample] = []
        missing, samples, size, rejections = [], 0, 0, 0
        for shard in range(plan.shard_count):
            record = records.get(shard)
            if record is not None and whole_only and record.failed:
                # Without its record, the shard is not committed.
                self.objects.remove([_record_name(shard)])
                self.record_path(shard).unlink()
                record = None
            if record is None:
                missing.append(shard)
                continue
            samples += record.samples
            failed += record.failed
            size += record.size_bytes
            rejections += record.rejections
        whole = range(plan.shard_count)
        if len(missing) == len(whole):
            return Scan(whole)
        return Scan(missing, samples, size, rejections, tuple(failed))

    def _pull_records(self, plan: Plan) -> dict[int, ShardRecord]:
        """Copy the records that are not staged; returns all that belong to the plan."""
        listed = {name for name in self.objects.names(layout.SHARDS_NAME) if name.endswith(".json")}
        wanted = [
            shard
            for shard in range(plan.shard_count)
            if f"{shard:06d}.json" in listed and not self.record_path(shard).exists()
        ]
        for batch in _batches(wanted):
            found = self.objects.read(_record_name(shard) for shard in batch)
            with self.errors():
                for shard in batch:
                    data = found.get(_record_name(shard), b"")
                    record, indices = parse_record(data), plan.samples_of(shard)
                    if record and (record.shard, record.first, record.end) == (
                        shard,
                        indices.start,
                        indices.stop,
                    ):
                        self.record_path(shard).write_bytes(data)
        every = ((shard, self.record(shard)) for shard in range(plan.shard_count))
        return {shard: record for shard, record in every if record is not None}

    def commit(self, folder: Path, record: ShardRecord, synced: Container[Inode] = ()) -> None:
        """Store the files of a shard, then its record.

        Raises:
            DeterminismError: the shard was committed before, with other bytes.
        """
        del synced
        name = _record_name(record.shard)
        committed = parse_record(self.objects.read([name]).get(name, b""))
        # The last shard may hold fewer samples than in a data set that grows.
        if committed is not None and committed.end == record.end:
            self._expect_equal(committed, record, folder)
        else:
            prefix = f"{layout.SHARDS_NAME}/{record.shard:06d}"
            self.objects.upload({f"{prefix}/{f.path}": folder / f.path for f in record.files})
            self.objects.put(name, record.to_bytes())

    def quarantine_damaged(self, plan: Plan, shards: Iterable[int]) -> list[int]:
        """Hash the objects of these shards, and remove records that do not match.

        Returns:
            The damaged shards.
        """
        chosen = frozenset(shards)
        records = self._pull_records(plan)
        return self._drop_damaged({s: record for s, record in records.items() if s in chosen})

    def _drop_damaged(self, records: Mapping[int, ShardRecord]) -> list[int]:
        """Remove the records of shards whose objects differ from them; returns the shards."""
        sizes = self.objects.tree(layout.SHARDS_NAME)
        whole = {s: record for s, record in records.items() if _has_sizes(record, sizes)}
        wanted = {
            name: file.bytes
            for record in whole.values()
            for name, file in _objects_of(record).items()
        }
        with self.errors():
            make_folder(self.scratch_root)
            found = self.objects.digests(wanted, self.scratch_root)
        damaged = [
            shard
            for shard, record in records.items()
            if shard not in whole
            or any(found[name] != file.sha256 for name, file in _objects_of(record).items())
        ]
        # Without its record, a shard is not committed.
        self.objects.remove(map(_record_name, damaged))
        for shard in damaged:
            self.record_path(shard).unlink()
        return damaged

    def fetch_shards(self, plan: Plan, with_files: bool) -> None:
        """Copy the records of all shards, and their files if wanted, to the staging folder.

        Raises:
            StorageError: the disk is too small for the files, or an object is damaged.
        """
        records = self._pull_records(plan)
        if not with_files:
            return
        need, free = sum(r.size_bytes for r in records.values()), free_bytes(self.root)
        if free < need:
            raise StorageError(
                f"{self.root}: exporters merge all shards here, which need {format_bytes(need)}, "
                f"and {format_bytes(free)} are free.\n  Make room and repeat the command; or leave "
                "out all exporters, and export parts of the finished data set"
            )
        for shard, record in records.items():
            fetch_shard(self.objects, record, self.shard_dir(shard))

    def publish(self) -> None:
        """Store the merged files, then the manifest; empties the staging folder."""
        with self.errors():
            names = [n for n in tree_sizes(self.root, without=layout.RUN_NAME) if not _is_shard(n)]
            linked = {
                get_inode(path): path.relative_to(self.root).as_posix()
                for path in (self.root / layout.SHARDS_NAME).rglob("*")
                if path.is_file()
            }
            copies = {n: linked.get(get_inode(self.root / n), "") for n in names}
        self.objects.copy({name: source for name, source in copies.items() if source})
        others = (n for n, source in copies.items() if not source and n != layout.MANIFEST_NAME)
        self.objects.upload({name: self.root / name for name in others})
        stale = {n for n in self.objects.tree() if not _is_shard(n)} - {*names}
        self.objects.remove(sorted(n for n in stale if not n.startswith(f"{layout.RUN_NAME}/")))
        self.objects.put(layout.MANIFEST_NAME, self.manifest_path.read_bytes())
        self._clear_staging()

    def is_intact(self, extra_matters: bool, on_progress: Callable[[float], None]) -> bool:
        """Whether a finished data set is undamaged: every object is read and hashed."""
        from gen_data.runner.verify import find_deviations

        make_folder(self.scratch_root)
        folder = self.scratch_dir()
        try:
            outline = folder / "outline"
            copy_outline(self.objects, outline)
            sizes = tree_sizes(outline, without=layout.RUN_NAME)
            digests = self.objects.digests(sizes, folder, on_progress)
            found = find_deviations(outline, full=True, digests=digests)
        finally:
            shutil.rmtree(folder)
        return not found or (not extra_matters and all(f.kind == "extra" for f in found))

    def read_manifest(self) -> bytes:
        """The bytes of the manifest of a finished data set."""
        return self.objects.read([layout.MANIFEST_NAME])[layout.MANIFEST_NAME]

    def read_documents(self, names: Iterable[str]) -> dict[str, bytes]:
        """``{name: bytes}`` of objects at the root of the data set; none of missing ones."""
        wanted = list(names)
        return {**dict.fromkeys(wanted, b""), **self.objects.read(wanted)}

    def read_run_file(self, name: str) -> bytes:
        """The bytes of an object about the run, which all machines share."""
        path = f"{layout.RUN_NAME}/{name}"
        return self.objects.read([path]).get(path, b"")

    def create_run_file(self, name: str, data: bytes) -> None:
        """Write an object about the run unless it exists."""
        self.objects.create(f"{layout.RUN_NAME}/{name}", data)

    def append_run_file(self, name: str, data: bytes) -> None:
        """Append to an object about the run."""
        self.objects.put(f"{layout.RUN_NAME}/{name}", self.read_run_file(name) + data)

    def reproduce_command(self, index: int) -> str:
        """Command that generates one sample by itself."""
        return f"the command of this run with --workers 0, for sample {index}"


def fetch_shard(objects: ObjectFolder, record: ShardRecord, folder: Path) -> None:
    """Copy the files of a shard to a folder, and hash them.

    Raises:
        StorageError: an object does not have the digest of its record.
    """
    prefix = f"{layout.SHARDS_NAME}/{record.shard:06d}"
    paths = {f"{prefix}/{file.path}": folder / file.path for file in record.files}
    for inner in record.empty_folders:
        (folder / inner).mkdir(parents=True, exist_ok=True)
    objects.download(paths)
    for file in record.files:
        if hash_file(folder / file.path) != file.sha256:
            raise StorageError(
                f"{objects.url}/{prefix}/{file.path}: its sha256 differs from the shard's "
                "record. The command that made the data set replaces the shard"
            )


def copy_outline(objects: ObjectFolder, folder: Path) -> None:
    """Make a folder that looks like a data set at a URL, with the contents of its documents only.

    Plan, sums, manifest and records are copied; all other files have the right size and no
    contents (they are sparse). ``verify`` without ``full`` reads nothing else.
    """
    sizes = {n: s for n, s in objects.tree().items() if not n.startswith(f"{layout.RUN_NAME}/")}
    documents = (layout.PLAN_NAME, layout.MANIFEST_NAME, layout.SUMS_NAME, layout.CERTIFICATE_NAME)
    read = {n for n in sizes if n in documents or _is_record(n)}
    found = objects.read(sorted(read))
    for name, size in sizes.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("wb") as file:
            file.write(found.get(name, b""))
            file.truncate(size)
    for name in sorted(filter(_is_record, read)):
        record = parse_record(found[name])
        if record is not None:
            for inner in record.empty_folders:
                (folder / name.removesuffix(".json") / inner).mkdir(parents=True)
    manifest = seal.parse_object(found.get(layout.MANIFEST_NAME, b"")) or {}
    for inner in manifest.get("empty_folders", []):
        (folder / objects.check_name(str(inner))).mkdir(parents=True, exist_ok=True)


def _has_sizes(record: ShardRecord, sizes: dict[str, int]) -> bool:
    return all(sizes.get(name) == file.bytes for name, file in _objects_of(record).items())


def _objects_of(record: ShardRecord) -> dict[str, FileRecord]:
    prefix = f"{layout.SHARDS_NAME}/{record.shard:06d}"
    return {f"{prefix}/{file.path}": file for file in record.files}


def _record_name(shard: int) -> str:
    return f"{layout.SHARDS_NAME}/{shard:06d}.json"


def _is_shard(name: str) -> bool:
    return name.startswith(f"{layout.SHARDS_NAME}/")


def _is_record(name: str) -> bool:
    return _is_shard(name) and name.count("/") == 1 and name.endswith(".json")


def _batches_of_bytes(sizes: Mapping[str, int]) -> Iterator[list[str]]:
    """Names of objects of ``BATCH_BYTES`` together, or of one that is larger."""
    batch: list[str] = []
    left = BATCH_BYTES
    for name, size in sizes.items():
        if batch and (size > left or len(batch) == BATCH):
            yield batch
            batch, left = [], BATCH_BYTES
        batch.append(name)
        left -= size
    if batch:
        yield batch


def _batches(items: list[Any]) -> Iterator[list[Any]]:
    for start in range(0, len(items), BATCH):
        yield items[start : start + BATCH]
