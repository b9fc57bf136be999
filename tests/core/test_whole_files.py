"""Files are written as a whole, also on a full disk."""

import errno
import os
from pathlib import Path

import numpy as np
import pytest

from gen_data.cli import report_command
from gen_data.core.errors import StorageError
from gen_data.core.whole_files import check_place, whole_file, write_whole
from gen_data.preview.contact_sheet import write_sheet


@pytest.fixture
def full_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk with room for 100 bytes of each file."""

    def write(self: Path, data: bytes) -> int:
        with self.open("wb") as file:
            file.write(data[:100])
        if len(data) > 100:
            raise OSError(errno.ENOSPC, "No space left on device", str(self))
        return len(data)

    def write_text(self: Path, text: str, **options: object) -> int:
        return write(self, text.encode())

    monkeypatch.setattr(Path, "write_bytes", write)
    monkeypatch.setattr(Path, "write_text", write_text)


def test_files_that_belong_together_are_replaced_together(tmp_path: Path, full_disk: None) -> None:
    one, other = tmp_path / "new" / "one.json", tmp_path / "other.html"
    other.write_bytes(b"old")
    with pytest.raises(OSError, match="No space left"):
        write_whole({one: b"new", other: bytes(1000)})

    assert [path for path in tmp_path.rglob("*") if path.is_file()] == [other]
    assert other.read_bytes() == b"old"

    write_whole({one: b"new", other: b"newer"})
    assert (one.read_bytes(), other.read_bytes()) == (b"new", b"newer")


def test_an_interrupted_file_leaves_nothing(tmp_path: Path) -> None:
    def interrupt() -> None:
        with whole_file(tmp_path / "x.png") as unfinished:
            unfinished.write_bytes(b"half")
            assert unfinished.suffix == ".png"
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupt()
    assert not list(tmp_path.iterdir())


def test_a_full_disk_leaves_no_half_of_a_report_or_contact_sheet(
    tmp_path: Path, full_disk: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    noise = np.random.default_rng(1).integers(0, 256, (64, 64, 3), np.uint8)
    with pytest.raises(StorageError, match="No space left"):
        write_sheet(noise, tmp_path / "sheet.png")
    assert not list(tmp_path.iterdir())

    monkeypatch.setattr("gen_data.report.html_page.format_page", lambda sets: "<p>" * 1000)
    with pytest.raises(StorageError, match="No space left"):
        report_command._write(tmp_path / "report.html", [])
    assert not list(tmp_path.iterdir())


def test_places_of_files_are_checked_before_long_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is made there; folders that are missing are none of the faults."""
    (tmp_path / "file").write_text("")
    check_place(tmp_path / "new/folder/page.html", "--html")
    check_place(tmp_path / "file", "--html")
    monkeypatch.setattr(os, "access", lambda path, _: path != tmp_path / "closed")
    (tmp_path / "closed").mkdir()
    for name, fact in (
        (".", f"{tmp_path}: Is a directory"),
        ("file/a/page.html", f"{tmp_path / 'file'}: Not a directory"),
        ("closed/page.html", f"{tmp_path / 'closed'}: Permission denied"),
    ):
        with pytest.raises(StorageError) as caught:
            check_place(tmp_path / name, "--html")
        assert str(caught.value) == f"{fact}; choose another --html"
    assert not (tmp_path / "new").exists()
