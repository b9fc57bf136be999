"""Temporary folders and the processes that own them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from gen_data.core import temporary_folders
from gen_data.core.temporary_folders import remove_abandoned, temporary_folder

OWNER = (
    "import sys, time\n"
    "from gen_data.core.temporary_folders import TemporaryFolder\n"
    "folder = TemporaryFolder('physics')\n"
    "print(folder.path, flush=True)\n"
    "time.sleep(600)\n"
)


def age(path: Path) -> None:
    os.utime(path, (0.0, 0.0))


def test_the_folder_of_a_killed_process_goes_with_the_next(tmp_path: Path) -> None:
    """While its process lives, an old folder stays; afterwards it is removed."""
    process = subprocess.Popen(
        [sys.executable, "-c", OWNER],
        env={**os.environ, "TMPDIR": str(tmp_path)},
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    folder = Path(process.stdout.readline().strip())
    age(folder)
    remove_abandoned(tmp_path)
    assert folder.parent == tmp_path
    assert folder.is_dir()

    process.kill()
    process.communicate()
    remove_abandoned(tmp_path)

    assert not folder.exists()


def test_young_folders_and_those_of_others_stay(tmp_path: Path) -> None:
    """A folder may not be locked yet; other programs have other names; links are not followed."""
    kept = [tmp_path / name for name in ("gen-data-physics-young", "other-program")]
    for folder in kept:
        folder.mkdir()
    age(kept[1])
    target = tmp_path / "target"
    target.mkdir()
    link = tmp_path / "gen-data-link"
    link.symlink_to(target)

    remove_abandoned(tmp_path)

    assert all(folder.is_dir() for folder in (*kept, target))
    assert link.is_symlink()


def test_a_folder_lasts_for_its_block(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(temporary_folders.tempfile, "tempdir", str(tmp_path))

    def fail() -> None:
        with temporary_folder("probe") as folder:
            (folder / "file").write_text("contents")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()

    assert list(tmp_path.iterdir()) == []
