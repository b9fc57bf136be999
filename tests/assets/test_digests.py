"""Cached digests of files are never used when a file may have changed."""

import os
import shutil
import time
from hashlib import sha256
from pathlib import Path

import pytest

from gen_data.assets import content_hashes
from gen_data.assets.asset_cache import DiskCache
from gen_data.assets.asset_folder import Folder
from gen_data.assets.content_hashes import ContentHashes, find_referenced_files

OLD = b"o " + b"a" * 40 + b"\n"
NEW = b"o " + b"b" * 40 + b"\n"


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    """A folder with one file that is an hour old and of known bytes."""
    root = tmp_path / "props"
    root.mkdir()
    (root / "a.obj").write_bytes(OLD)
    os.utime(root / "a.obj", (1_000_000_000, 1_000_000_000))
    return Folder(root)


@pytest.fixture
def settled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every digest is computed an hour after the last change of the files."""
    now_ns = time.time_ns
    monkeypatch.setattr(content_hashes, "_now_ns", lambda: now_ns() + 3_600_000_000_000)


def digest_of(folder: Folder, cache: Path) -> str:
    known = ContentHashes(DiskCache(cache))
    found = known.of(Folder(folder.root), "a.obj")["a.obj"]
    known.save()
    return found


def rewrite(path: Path, data: bytes) -> None:
    status = path.stat()
    path.write_bytes(data)
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))


def replace(path: Path, data: bytes) -> None:
    """Another file in its place, of the same size and modification time (as rsync -t does)."""
    other = path.with_suffix(".new")
    other.write_bytes(data)
    shutil.copystat(path, other)
    other.replace(path)


@pytest.mark.usefixtures("settled")
@pytest.mark.parametrize("change", [rewrite, replace])
def test_changed_bytes_are_noticed_always(folder: Folder, tmp_path: Path, change: object) -> None:
    """The original file, restored in the same way, has its original digest again."""
    path = folder.root / "a.obj"
    assert digest_of(folder, tmp_path / "cache") == sha256(OLD).hexdigest()
    for data in (NEW, OLD, NEW):
        change(path, data)  # type: ignore[operator]
        assert digest_of(folder, tmp_path / "cache") == sha256(data).hexdigest()


@pytest.mark.usefixtures("settled")
def test_a_file_that_did_not_change_is_not_read_again(
    folder: Folder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A new modification time alone does not change the digest."""
    before = digest_of(folder, tmp_path / "cache")
    with monkeypatch.context() as patch:
        patch.setattr(Folder, "read", lambda *_: pytest.fail("read again"))
        assert digest_of(folder, tmp_path / "cache") == before
    (folder.root / "a.obj").touch()
    assert digest_of(folder, tmp_path / "cache") == before


def test_a_file_as_young_as_its_digest_is_read_again(folder: Folder, tmp_path: Path) -> None:
    """File system clocks are coarse: the file may change again within one tick."""
    assert digest_of(folder, tmp_path / "cache") == sha256(OLD).hexdigest()
    stored = DiskCache(tmp_path / "cache").load_json("digests.json")
    ((name, rows),) = stored.items()
    assert rows[0][-1] == sha256(OLD).hexdigest()
    rows[0][-1] = "0" * 64
    DiskCache(tmp_path / "cache").store_json("digests.json", {name: rows})
    assert digest_of(folder, tmp_path / "cache") == sha256(OLD).hexdigest()


@pytest.mark.usefixtures("settled")
def test_a_file_that_was_missing_and_came_changes_the_asset(folder: Folder, tmp_path: Path) -> None:
    """A material library that is put next to its mesh later."""
    (folder.root / "a.obj").write_bytes(b"mtllib a.mtl\n")
    known = ContentHashes(DiskCache(tmp_path / "cache"))
    assert set(known.of(folder, "a.obj")) == {"a.obj"}
    known.save()
    (folder.root / "a.mtl").write_bytes(b"newmtl x\n")
    again = ContentHashes(DiskCache(tmp_path / "cache"))
    assert set(again.of(folder, "a.obj")) == {"a.mtl", "a.obj"}


@pytest.mark.usefixtures("settled")
def test_records_of_files_that_are_gone_are_dropped_when_there_are_many(
    folder: Folder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Others stay, and so do all of them below the limit."""
    shutil.copytree(folder.root, tmp_path / "gone")
    digest_of(Folder(tmp_path / "gone"), tmp_path / "cache")
    shutil.rmtree(tmp_path / "gone")
    cache = DiskCache(tmp_path / "cache")
    gone, kept = (str(tmp_path / name / "a.obj") for name in ("gone", "props"))
    digest_of(folder, tmp_path / "cache")
    assert set(cache.load_json("digests.json")) == {gone, kept}
    monkeypatch.setattr(content_hashes, "_ASSETS_KEPT", 1)
    rewrite(folder.root / "a.obj", NEW)
    assert digest_of(folder, tmp_path / "cache") == sha256(NEW).hexdigest()
    assert set(cache.load_json("digests.json")) == {kept}


@pytest.mark.parametrize("blank", ["mtllib a{}b\n", "mtllib{}\n", "{}mtllib a\n", "mtllib a{}\n"])
def test_lines_full_of_blanks_are_read_in_linear_time(folder: Folder, blank: str) -> None:
    """Two million blanks; a pattern that tries every split of them would not end."""
    (folder.root / "a.obj").write_text(blank.format(" " * 2_000_000))
    assert find_referenced_files(folder, "a.obj") == ("a.obj",)


def test_the_last_word_of_a_map_is_its_file(folder: Folder) -> None:
    """Options stand before it; blanks in a library's name belong to it."""
    (folder.root / "a.obj").write_text("mtllib  my a.mtl \r\n")
    (folder.root / "my a.mtl").write_text("newmtl x\n map_Kd -s 1 1 1\tw.png\nbump" + " " * 10**6)
    (folder.root / "w.png").write_bytes(b"x")
    assert find_referenced_files(folder, "a.obj") == ("a.obj", "my a.mtl", "w.png")
