"""Damage in the cache of compiled kernels is found before Warp runs it."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import pytest

from gen_data.generator.renderers.warp.kernel_cache import remove_damaged_modules

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
    """A cache of two modules."""
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
def test_a_damaged_module_is_removed_once_and_alone(
    folder: Path, damage: Callable[[Path], None]
) -> None:
    """Its next user compiles it again; a module of the same name with other bytes is then right."""
    assert remove_damaged_modules(folder) == ()
    damage(folder / MODULES[0] / "m.cpu27.o")

    assert remove_damaged_modules(folder) == (MODULES[0],)

    assert not (folder / MODULES[0]).exists()
    assert (folder / MODULES[1]).exists()
    (folder / MODULES[0]).mkdir()
    (folder / MODULES[0] / "m.cpu27.o").write_bytes(object_file(b"compiled again"))
    assert remove_damaged_modules(folder) == ()


def test_a_module_that_was_never_complete_is_found_without_a_digest(folder: Path) -> None:
    """A power cut while it was written."""
    cut_off(folder / MODULES[1] / "m.cpu27.o")

    assert remove_damaged_modules(folder) == (MODULES[1],)


def test_sources_other_programs_and_compilations_in_progress_do_not_matter(folder: Path) -> None:
    """Only what Warp loads for gen-data is checked."""
    unfinished = folder / f"{MODULES[0]}_p12_t34"
    others = folder / "wp_other_0123abc"
    for path in (unfinished, others):
        path.mkdir()
        (path / "m.o").write_bytes(b"half")
    remove_damaged_modules(folder)
    (folder / MODULES[0] / "m.cpp").write_text("changed")

    assert remove_damaged_modules(folder) == ()
    assert unfinished.exists()
    assert others.exists()
