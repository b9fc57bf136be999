"""One file with a user's assets: equal bytes for equal content, checked before it is unpacked."""

import os
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from gen_data.cli.main import cli
from gen_data.core.errors import AssetError, StorageError
from gen_data.packs import own_pack
from gen_data.packs.own_pack import unpacked, write_pack

FILES = {"block.obj": b"v 0 0 0\n" * 200, "maps/\u00e4.png": bytes(range(256)), "empty.txt": b""}
SHA256 = "373e954448c1e36fbd72b0b72bc1646adf5c1d2439717c8f8c8ef7b902db1250"
"""Of the pack of FILES, with every release of Python and zlib."""


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(own_pack, "default_cache_dir", lambda: tmp_path / "cache")
    return tmp_path / "cache" / "own-packs"


def make_folder(folder: Path, names: list[str]) -> Path:
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(FILES[name])
    return folder


def make_pack(tmp_path: Path) -> tuple[Path, str]:
    pack = tmp_path / "meshes.zip"
    return pack, write_pack(make_folder(tmp_path / "meshes", list(FILES)), pack)


def contents(folder: Path) -> dict[str, bytes]:
    found = {p.relative_to(folder).as_posix(): p for p in folder.rglob("*") if p.is_file()}
    return {name: path.read_bytes() for name, path in found.items()}


def test_equal_contents_give_equal_bytes(tmp_path: Path) -> None:
    """Whatever the order of writing, times, rights, hidden files, and empty folders."""
    one = make_folder(tmp_path / "one", list(FILES))
    other = make_folder(tmp_path / "other", list(reversed(FILES)))
    (other / ".DS_Store").write_text("hidden")
    (other / "nothing").mkdir()
    (other / "block.obj").chmod(0o755)
    os.utime(other / "block.obj", (0, 0))

    digests = [write_pack(folder, tmp_path / f"{folder.name}.zip") for folder in (one, other)]

    assert digests == [SHA256, SHA256]
    assert (tmp_path / "one.zip").read_bytes() == (tmp_path / "other.zip").read_bytes()
    with zipfile.ZipFile(tmp_path / "one.zip") as archive:
        assert archive.testzip() is None
        assert {name: archive.read(name) for name in archive.namelist()} == FILES


def test_a_pack_is_unpacked_once(tmp_path: Path, cache: Path) -> None:
    pack, digest = make_pack(tmp_path)

    folder = unpacked(pack, digest)
    pack.unlink()

    assert contents(folder) == FILES
    assert unpacked(pack, digest) == folder
    assert folder == cache / SHA256 / "meshes"
    assert list(cache.glob("*/*")) == [folder]


def test_a_pack_may_lie_in_its_folder(tmp_path: Path) -> None:
    folder = make_folder(tmp_path / "meshes", list(FILES))

    assert write_pack(folder, folder / "meshes.zip") == SHA256
    assert write_pack(folder, folder / "meshes.zip") == SHA256


@pytest.mark.parametrize(
    ("change", "fact"),
    [
        (lambda pack: pack.unlink(), "is missing"),
        (lambda pack: os.truncate(pack, 900), "was changed or cut off: its digest is"),
        (lambda pack: os.truncate(pack, 0), "was changed or cut off: its digest is"),
        (lambda pack: pack.write_bytes(pack.read_bytes() + b"x"), "was changed or cut off"),
    ],
)
def test_a_pack_that_is_missing_cut_or_changed_is_refused(
    tmp_path: Path, cache: Path, change: Callable[[Path], object], fact: str
) -> None:
    pack, digest = make_pack(tmp_path)
    change(pack)

    with pytest.raises(AssetError, match=f"meshes.zip: {fact}"):
        unpacked(pack, digest)
    assert not cache.exists()


def foreign(path: Path, comment: bytes, names: list[str]) -> str:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.comment = comment
        for name in names:
            archive.writestr(name, bytes(20_000_000))
    return own_pack.file_digest(path)


@pytest.mark.parametrize(
    ("comment", "names", "fact"),
    [
        (b"gen-data assets, format 2", ["a"], "is of format 2, newer than this gen-data; exp"),
        (b"", ["a"], "is not a pack; expected one that gen-data assets pack wrote"),
        (b"gen-data assets, format 1", ["a"], "inflates to more than 1 times its size"),
        (b"gen-data assets, format 1", ["../a"], "lies outside its folder|inflates"),
    ],
)
def test_a_foreign_archive_with_the_right_digest_is_refused(
    tmp_path: Path, cache: Path, comment: bytes, names: list[str], fact: str
) -> None:
    digest = foreign(tmp_path / "meshes.zip", comment, names)

    with pytest.raises(AssetError, match=fact):
        unpacked(tmp_path / "meshes.zip", digest)
    assert not list(cache.glob("*/*"))
    assert not (tmp_path / "cache" / "a").exists()


def test_links_out_of_the_folder_are_not_packed(tmp_path: Path) -> None:
    folder = make_folder(tmp_path / "meshes", ["block.obj"])
    (tmp_path / "secret").write_text("key")
    (folder / "link.obj").symlink_to(tmp_path / "secret")

    with pytest.raises(AssetError, match="lies outside"):
        write_pack(folder, tmp_path / "meshes.zip")
    assert not (tmp_path / "meshes.zip").exists()


def test_the_command_prints_the_digest_and_replaces_nothing_unasked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    make_folder(tmp_path / "meshes", list(FILES))

    cli.main(["assets", "pack", "meshes"], standalone_mode=False)
    assert f"meshes.zip: 0.0 MB, sha256 {SHA256}" in capsys.readouterr().out

    with pytest.raises(StorageError, match=r"meshes\.zip: exists; choose another --out"):
        cli.main(["assets", "pack", "meshes"], standalone_mode=False)
    cli.main(["assets", "pack", "meshes", "--force"], standalone_mode=False)
