"""Damage in the cache of compiled kernels is found before Warp runs it."""

import errno
import os
import stat
import struct
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest

from gen_data.core.errors import CacheWarning, StorageError
from gen_data.renderers.warp import kernel_cache

MODULES = ("wp_gen_data.kernels.a_0123abc", "wp_gen_data.kernels.b_0123abc")


def object_file(code: bytes) -> bytes:
    """A minimal ELF file: header, code, table of one section (64 bytes)."""
    header = bytearray(64)
    header[:4] = b"\x7fELF"
    struct.pack_into("<Q", header, 0x28, 64 + len(code))
    struct.pack_into("<HH", header, 0x3A, 64, 1)
    return bytes(header) + code + bytes(64)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in MODULES:
        (tmp_path / name).mkdir()
        (tmp_path / name / "m.cpu27.o").write_bytes(object_file(name.encode()))
        (tmp_path / name / "m.meta").write_text("{}")
        (tmp_path / name / "m.cpp").write_text("source")
    return tmp_path


def flip_bit(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[70] ^= 1
    path.write_bytes(data)


def cut_off(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:100])


def empty(path: Path) -> None:
    path.write_bytes(b"")


@pytest.mark.parametrize("damage", [flip_bit, cut_off, empty])
def test_a_damaged_module_is_removed_alone(folder: Path, damage: Callable[[Path], None]) -> None:
    """Its next user compiles it again; a module of the same name with other bytes is then right."""
    assert kernel_cache.remove_damaged_modules(folder) == ()
    damage(folder / MODULES[0] / "m.cpu27.o")

    assert kernel_cache.remove_damaged_modules(folder) == (MODULES[0],)

    assert not (folder / MODULES[0]).exists()
    assert (folder / MODULES[1]).exists()
    (folder / MODULES[0]).mkdir()
    (folder / MODULES[0] / "m.cpu27.o").write_bytes(object_file(b"compiled again"))
    assert kernel_cache.remove_damaged_modules(folder) == ()


def test_a_module_that_was_never_complete_is_found_without_a_digest(folder: Path) -> None:
    """A power cut while it was written."""
    cut_off(folder / MODULES[1] / "m.cpu27.o")

    assert kernel_cache.remove_damaged_modules(folder) == (MODULES[1],)


def test_sources_other_programs_and_compilations_in_progress_do_not_matter(folder: Path) -> None:
    """Only files that Warp loads for gen-data are checked."""
    unfinished = folder / f"{MODULES[0]}_p12_t34"
    others = folder / "wp_other_0123abc"
    for path in (unfinished, others):
        path.mkdir()
        (path / "m.o").write_bytes(b"half")
    kernel_cache.remove_damaged_modules(folder)
    (folder / MODULES[0] / "m.cpp").write_text("changed")

    assert kernel_cache.remove_damaged_modules(folder) == ()
    assert unfinished.exists()
    assert others.exists()


STAMP = "gen-data-0123-cpu"


@pytest.fixture
def temporary(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path_factory.mktemp("temporary")
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


def refusing(*refused: Path, number: int = errno.EROFS) -> Callable[[Path], None]:
    """Fills a folder with a module, or fails as a folder that cannot be written."""

    def fill(folder: Path) -> None:
        if folder in refused or any(one in folder.parents for one in refused):
            raise OSError(number, os.strerror(number), str(folder / "gen-data.lock"))
        if not (folder / STAMP).exists():
            (folder / "wp_gen_data.new").mkdir()
            (folder / STAMP).touch()

    return fill


@pytest.mark.parametrize("number", [errno.EROFS, errno.EACCES, errno.ENOSPC, errno.EDQUOT])
def test_a_filled_cache_that_cannot_be_written_is_linked_in_silence(
    folder: Path, temporary: Path, number: int
) -> None:
    """Modules that are missing from it are compiled next to the links."""
    kernel_cache.remove_damaged_modules(folder)
    (folder / STAMP).touch()

    used = kernel_cache.fill_cache(folder, STAMP, refusing(folder, number=number))

    assert used.parent == temporary / f"gendata-kernels-{os.getuid()}"
    assert stat.S_IMODE(used.parent.stat().st_mode) == 0o700
    assert {path.name: path.readlink() for path in used.iterdir() if path.is_symlink()} == {
        name: folder / name for name in MODULES
    }
    assert kernel_cache.remove_damaged_modules(used) == ()


def test_missing_and_damaged_kernels_of_such_a_cache_are_compiled_elsewhere(
    folder: Path, temporary: Path
) -> None:
    kernel_cache.remove_damaged_modules(folder)
    (folder / STAMP).touch()
    flip_bit(folder / MODULES[0] / "m.cpu27.o")

    with pytest.warns(CacheWarning, match=rf"gen-data\.lock: Read-only .* into {temporary}") as got:
        used = kernel_cache.fill_cache(folder, STAMP, refusing(folder))

    assert len(got) == 1
    assert {path.name for path in used.iterdir()} == {MODULES[1], "wp_gen_data.new", STAMP}
    # The second run is silent.
    assert kernel_cache.fill_cache(folder, STAMP, refusing(folder)) == used


def test_a_filled_cache_suffices_if_nothing_is_written(folder: Path, temporary: Path) -> None:
    (folder / STAMP).touch()
    assert kernel_cache.fill_cache(folder, STAMP, refusing(folder, temporary)) == folder


def test_unkeepable_kernels_are_an_error_with_the_remedy(folder: Path, temporary: Path) -> None:
    with pytest.warns(CacheWarning), pytest.raises(StorageError) as caught:
        kernel_cache.fill_cache(folder, STAMP, refusing(folder, temporary, number=errno.ENOSPC))
    assert "No space left" in str(caught.value) and "\n" not in str(caught.value)
    assert "WARP_CACHE_PATH or XDG_CACHE_HOME" in str(caught.value)


def test_a_private_folder_that_others_can_write_is_not_used(temporary: Path) -> None:
    """Machine code is run from it."""
    kernel_cache.private_folder().chmod(0o755)
    with pytest.raises(PermissionError, match="not a folder of this user alone"):
        kernel_cache.private_folder()
    private_folder_path = temporary / f"gendata-kernels-{os.getuid()}"
    private_folder_path.rmdir()
    private_folder_path.symlink_to(temporary)
    with pytest.raises(PermissionError, match="not a folder of this user alone"):
        kernel_cache.private_folder()


def test_links_to_removed_modules_are_removed(folder: Path, temporary: Path) -> None:
    used = kernel_cache.link_modules(folder)
    (folder / MODULES[0]).rename(folder / "elsewhere")

    assert kernel_cache.link_modules(folder) == used
    assert [path.name for path in used.iterdir()] == [MODULES[1]]
