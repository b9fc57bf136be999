"""Packs are installed whole or not at all, from exactly the archive that the table means."""

import multiprocessing
import os
import signal
import stat
from dataclasses import replace
from pathlib import Path

import pytest

from gen_data.assets.installed_packs import installed_packs
from gen_data.assets.library import Library, open_library
from gen_data.core.errors import AssetError, StorageError, VerificationError
from gen_data.packs.install import install, is_installed, remove, verify
from gen_data.packs.pack_table import PACKS, ClientName, Pack, find_pack
from tests.packs.converters import BOX, box_pack, zipped_box


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    return zipped_box(tmp_path / "package-1.0.zip")


@pytest.fixture
def pack(archive: Path) -> Pack:
    return box_pack(archive)


@pytest.fixture
def installed(pack: Pack, archive: Path, tmp_path: Path) -> Path:
    """Folder of packs with this one."""
    install(pack, tmp_path / "packs", archive)
    return tmp_path / "packs"


def fake_client(monkeypatch: pytest.MonkeyPatch, folder: Path, program: str, script: str) -> None:
    """Let a script be the only program on the path."""
    folder.mkdir()
    path = folder / program
    path.write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", str(folder))


def library_with(folder: Path, tmp_path: Path) -> Library:
    return open_library(cache_dir=tmp_path / "cache", packs=folder)


def names_in(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()} - {".lock"}


@pytest.mark.slow
def test_an_installed_pack_joins_the_library(pack: Pack, archive: Path, tmp_path: Path) -> None:
    """Its assets have ids that start with its name, and their own licence and author."""
    record = install(pack, tmp_path / "packs", archive)
    assert {file.path for file in record.files} == {"box.obj", "index.json"}
    library = library_with(tmp_path / "packs", tmp_path)
    asset = library.get("boxes/box")
    assert (asset.category, asset.licence, asset.author) == ("box", "CC-BY-3.0", "A. Modeller")
    assert asset in library.find(("pack", "household"))
    assert library.bounds_m("boxes/box") == ((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))


def test_without_packs_the_library_is_as_before(tmp_path: Path) -> None:
    """A missing folder is fine and is not created."""
    assert library_with(tmp_path / "packs", tmp_path).find(("pack",)) == ()
    assert not (tmp_path / "packs").exists()


def test_another_archive_is_refused_entirely(pack: Pack, archive: Path, tmp_path: Path) -> None:
    """One byte is enough; the message gives both sums."""
    archive.write_bytes(archive.read_bytes() + b"\0")
    with pytest.raises(AssetError, match=f"expected {pack.sha256}"):
        install(pack, tmp_path / "packs", archive)
    assert names_in(tmp_path / "packs") == set()


@pytest.mark.parametrize(
    ("client", "program"), [("pip", "pip"), ("apt", "apt-get"), ("npm", "npm")]
)
def test_the_client_fetches_the_pinned_version(
    client: ClientName, program: str, pack: Pack, archive: Path, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """It is called with package and version, in a separate folder."""
    script = f'/bin/echo "$@" > {tmp_path}/called; /bin/cp {archive} .'
    fake_client(monkeypatch, tmp_path / "bin", program, script)
    install(replace(pack, client=client), tmp_path / "packs")
    called = (tmp_path / "called").read_text(encoding="utf-8")
    assert "package" in called and "1.0" in called
    assert names_in(tmp_path / "packs") == {"boxes"}


def test_missing_clients_are_named(
    pack: Pack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(AssetError, match=r"'npm' is not on PATH.*--from FILE"):
        install(replace(pack, client="npm"), tmp_path / "packs")
    assert names_in(tmp_path / "packs") == set()


@pytest.mark.parametrize(("said", "told"), [
    ("npm error code ENOTFOUND", "found no network"),
    ("E: Could not resolve 'deb.debian.org'", "found no network"),
    ("ERROR: No matching distribution found", "failed: ERROR: No matching distribution"),
])  # fmt: skip
def test_no_network_and_other_failures_are_told_apart(
    said: str, told: str, pack: Pack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The client's message is shown unless the reason is known."""
    fake_client(monkeypatch, tmp_path / "bin", "pip", f'echo "{said}" >&2; exit 1')
    with pytest.raises(AssetError, match=told):
        install(pack, tmp_path / "packs")
    assert names_in(tmp_path / "packs") == set()


def test_an_archive_without_an_end_is_refused(pack: Pack, tmp_path: Path) -> None:
    with pytest.raises(AssetError, match=r"/dev/zero: is not a regular file; expected the archive"):
        install(pack, tmp_path / "packs", Path("/dev/zero"))


def test_a_killed_installation_leaves_nothing(pack: Pack, archive: Path, tmp_path: Path) -> None:
    """No pack is seen, and the next installation sweeps up."""
    folder = tmp_path / "packs"
    dying = replace(pack, converter="tests.packs.converters:killed")
    process = multiprocessing.get_context("fork").Process(
        target=install, args=(dying, folder, archive)
    )
    process.start()
    process.join()
    assert process.exitcode == -signal.SIGKILL
    assert installed_packs(folder) == ()
    assert library_with(folder, tmp_path).find(("pack",)) == ()
    install(pack, folder, archive)
    assert names_in(folder) == {"boxes"}


def test_a_failed_exchange_keeps_the_old_pack(pack: Pack, archive: Path, installed: Path) -> None:
    with pytest.raises(AssetError, match="none of the wanted"):
        install(replace(pack, wanted=("models/*",)), installed, archive)
    verify("boxes", installed)


def test_two_installations_at_once_stay_apart(pack: Pack, archive: Path, tmp_path: Path) -> None:
    import fcntl

    folder = tmp_path / "packs"
    folder.mkdir()
    with (folder / ".lock").open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with pytest.raises(StorageError, match="another process"):
            install(pack, folder, archive)


@pytest.mark.parametrize("damage", ["changed", "missing", "was not installed"])
def test_verify_finds_differences(damage: str, installed: Path) -> None:
    """One byte, one file less, one file more."""
    assert len(verify("boxes", installed).files) == 2
    model = installed / "boxes" / "box.obj"
    if damage == "changed":
        model.write_text(BOX.replace("v 1", "v 2", 1), encoding="utf-8")
    elif damage == "missing":
        model.unlink()
    else:
        model.with_name("more.obj").write_text(BOX, encoding="utf-8")
    with pytest.raises(VerificationError, match=damage):
        verify("boxes", installed)


def test_a_removed_pack_is_gone(installed: Path) -> None:
    remove("boxes", installed)
    assert names_in(installed) == set()
    with pytest.raises(AssetError, match="not installed"):
        remove("boxes", installed)


def test_a_new_conversion_makes_packs_out_of_date(pack: Pack, installed: Path) -> None:
    """An upgrade of gen-data then requires a new installation."""
    assert is_installed(pack, installed)
    assert not is_installed(pack, installed.parent / "none")
    assert not is_installed(replace(pack, revision=pack.revision + 1), installed)


def test_installing_twice_gives_the_same_digest(pack: Pack, archive: Path, tmp_path: Path) -> None:
    digests = {install(pack, tmp_path / name, archive).digest for name in ("one", "two")}
    assert len(digests) == 1


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_rights_is_told(pack: Pack, archive: Path, tmp_path: Path) -> None:
    tmp_path.joinpath("packs").mkdir(mode=0o500)
    with pytest.raises(StorageError, match="GEN_DATA_ASSETS"):
        install(pack, tmp_path / "packs", archive)


def test_a_damaged_record_says_what_to_do(installed: Path) -> None:
    (installed / "boxes" / "pack.json").write_text("{", encoding="utf-8")
    with pytest.raises(AssetError, match="install the pack again"):
        installed_packs(installed)


def test_an_unknown_pack_is_answered_with_the_nearest() -> None:
    with pytest.raises(Exception, match="did you mean 'catalogue'"):
        find_pack("catalog")


def test_every_pack_is_pinned() -> None:
    """A version, a sum of 64 digits, a licence, patterns below a folder."""
    for pack in PACKS:
        assert pack.version and pack.licence
        assert len(bytes.fromhex(pack.sha256)) == 32
        assert all("/" in pattern for pattern in pack.wanted)
