"""Faults outside a data set's own folder: at URLs, in caches, in foreign and derived data sets."""

import errno
import hashlib
import os
import random
import shutil
import tempfile
import warnings
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import fsspec

from benchmarks.faults.recorded_run import record, reference_digest, tree_digest
from benchmarks.faults.results import Result, Scale
from gen_data.core.capture import Channel
from gen_data.core.errors import CacheWarning, ConfigWarning, GenDataError, NoLabels, StorageError
from gen_data.renderers.warp.kernel_cache import OURS, fill_cache
from gen_data.runner import object_store, shard_record, store, stored

URL = "memory://faults/set"


def objects(scale: Scale, folder: Path) -> Result:
    """Exchange, cut or remove one to three objects at a URL; repeat the command."""
    result = Result()
    rng = random.Random(scale.seed)
    digest = reference_digest(folder)
    os.environ["XDG_CACHE_HOME"] = str(folder / "cache")
    system, place = fsspec.filesystem("memory"), object_store.ObjectFolder(URL)
    record().make(URL)
    names = sorted(name for name in place.tree() if not name.startswith("run/"))
    for number in result.until_end(scale, range(scale.pick(300, 10))):
        damaged = rng.sample(names, rng.randint(1, 3))
        for name in damaged:
            path = f"{URL}/{name}"
            data = bytearray(system.cat_file(path))
            kind = rng.choice(["flip", "flip", "cut", "remove"])
            if kind == "flip" and data:
                data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
            if kind == "remove":
                system.rm_file(path)
            else:
                system.pipe_file(path, bytes(data[: len(data) // 2] if kind == "cut" else data))
        problem = _repeat(place, folder / f"copy-{number}", digest)
        result.add(not problem, f"{', '.join(damaged)}: {problem}")
        if problem:
            system.rm(URL, recursive=True)
            record().make(URL)
    result.notes.append(f"1 to 3 of {len(names)} objects")
    system.rm(URL, recursive=True)
    return result


def _repeat(place: object_store.ObjectFolder, copy: Path, digest: str) -> str:
    """Run the command again; the fault, or nothing."""
    try:
        record().make(URL)
    except GenDataError as error:
        return str(error)
    names = [name for name in place.tree() if not name.startswith("run/")]
    place.download({name: copy / name for name in names})
    same = tree_digest(copy) == digest
    shutil.rmtree(copy)
    return "" if same else "other bytes"


NAMES = ("../x", "a/../../x", "/x", "a\\..\\x", "C:x", "a//x", "\x00", "..", "a/\n/x", "~/../x")
"""Paths that lead out of a folder, or that no file has."""


def foreign(scale: Scale, folder: Path) -> Result:
    """Records of somebody else that name files outside; media of another kind."""
    result = Result()
    reference_digest(folder)
    source = store.LocalStore(folder / "reference")
    first = source.record(0)
    assert first is not None
    for name in result.until_end(scale, NAMES):
        file = shard_record.FileRecord("name", 1, hashlib.sha256(b"x").hexdigest())
        # Bypasses the check of its constructor, as foreign code might.
        object.__setattr__(file, "path", name)
        data = replace(first, files=(*first.files, file)).to_bytes()
        result.add(_is_refused(data), f"record with {name!r}")
    path = next((source.root / "shards").rglob("depth/000000000.png"))
    whole = path.read_bytes()
    other = next((source.root / "shards").rglob("rgb/000000000.png")).read_bytes()
    for kind, data in (("an RGB image", other), ("half a file", whole[:60]), ("nothing", b"")):
        path.unlink()
        path.write_bytes(data)
        try:
            _ = (
                stored.StoredSamples(source.root)
                .sample(0)
                .capture.readings["color"]
                .channels[Channel.Z_DEPTH]
            )
        except GenDataError:
            result.add(True, "")
        except Exception as error:
            result.add(False, f"{kind}: {type(error).__name__}: {error}")
        else:
            result.add(False, f"{kind} was read as depth")
    return result


def _is_refused(data: bytes) -> bool:
    try:
        return shard_record.parse_record(data) is None
    except GenDataError:
        return True


def derived(scale: Scale, folder: Path) -> Result:
    """Flip a bit of a source: it is exported without the damage, or not at all."""
    result = Result()
    rng = random.Random(scale.seed)
    reference_digest(folder)
    source = folder / "reference"
    files = sorted(p for p in source.rglob("*") if p.is_file() and "run" not in p.parts)
    files = [path for path in files if path.stat().st_size]
    _export(source, folder / "good")
    good = tree_digest(folder / "good")
    for number in result.until_end(scale, range(scale.pick(200, 5))):
        path, out = rng.choice(files), folder / f"out-{number}"
        whole = path.read_bytes()
        bit = rng.randrange(8 * len(whole))
        data = bytearray(whole)
        data[bit // 8] ^= 1 << bit % 8
        _overwrite(path, bytes(data))
        problem = ""
        try:
            _export(source, out)
            problem = "" if tree_digest(out) == good else "exported with the damage"
        except GenDataError:
            pass
        except Exception as error:
            problem = f"{type(error).__name__}: {error}"
        _overwrite(path, whole)
        shutil.rmtree(out, ignore_errors=True)
        result.add(not problem, f"{path.relative_to(source)}, bit {bit}: {problem}")
    return result


def _export(source: Path, out: Path) -> None:
    """Export as YOLO; at this size of image, there may be no label to write."""
    from gen_data import export

    with suppress(NoLabels), warnings.catch_warnings():
        warnings.simplefilter("ignore", ConfigWarning)
        export(source, ["yolo"], out, workers=0)


def _overwrite(path: Path, data: bytes) -> None:
    with path.open("r+b") as file:
        file.write(data)


def caches(scale: Scale, folder: Path) -> Result:
    """A cache of kernels that cannot be written, filled or not, whole or damaged."""
    result = Result()
    rng = random.Random(scale.seed)
    numbers = (errno.EROFS, errno.EACCES, errno.ENOSPC, errno.EDQUOT, errno.EPERM, errno.EIO)
    tasks = range(scale.pick(500, 20))
    kept, tempfile.tempdir = tempfile.tempdir, str(folder)
    try:
        for number in result.until_end(scale, tasks):
            cache = folder / f"cache-{number}"
            filled, can_write = rng.random() < 0.5, rng.random() < 0.8
            for name in rng.sample("abcdef", rng.randint(0, 5)):
                (cache / f"{OURS}{name}").mkdir(parents=True)
                (cache / f"{OURS}{name}" / "m.meta").write_text(rng.choice(["{}", "{}", ""]))
            cache.mkdir(exist_ok=True)
            if filled:
                (cache / "stamp").touch()
            problem = _use(cache, rng.choice(numbers), can_write)
            result.add(not problem, f"cache {number}: {problem}")
            shutil.rmtree(cache)
    finally:
        tempfile.tempdir = kept
    return result


def _use(cache: Path, number: int, can_write_elsewhere: bool) -> str:
    """Use a cache that refuses every write; the fault, or nothing."""
    before = sorted(cache.rglob("*"))

    def fill(chosen: Path) -> None:
        if chosen == cache or not can_write_elsewhere:
            raise OSError(number, os.strerror(number), str(chosen))
        (chosen / "stamp").touch()

    whole = (cache / "stamp").exists() and all(p.stat().st_size for p in cache.rglob("m.meta"))
    try:
        with warnings.catch_warnings(record=True) as shown:
            warnings.simplefilter("always", CacheWarning)
            used = fill_cache(cache, "stamp", fill)
    except StorageError as error:
        expected = not can_write_elsewhere and not whole and "\n" not in str(error)
        return "" if expected else str(error)
    links = {path.name for path in used.iterdir() if path.is_symlink()}
    good = {p.parent.name for p in cache.rglob("m.meta") if p.stat().st_size}
    if sorted(cache.rglob("*")) != before:
        return "the cache was changed"
    if used != cache and links != good:
        return f"links {sorted(links)}; expected {sorted(good)}"
    return "" if len(shown) == (not whole) else f"{len(shown)} warnings"
