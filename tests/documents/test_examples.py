"""The scripts of ``examples/`` run, and its plug-in package works."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"


def run(folder: Path, *arguments: str, path: str = "") -> str:
    """Output of Python in a folder, with another folder of packages."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), path])}
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_the_first_data_set_is_drawn(tmp_path: Path) -> None:
    """One line per box, and a picture."""
    lines = run(tmp_path, str(EXAMPLES / "first_dataset.py")).splitlines()

    assert len(lines) > 4
    assert (tmp_path / "first_dataset.png").stat().st_size > 10_000


@pytest.mark.slow
def test_the_loader_reads_every_sample_in_each_epoch(tmp_path: Path) -> None:
    """Two epochs of two batches, with the same number of boxes in another order."""
    lines = run(tmp_path, str(EXAMPLES / "train_loader.py")).splitlines()
    boxes = [int(line.split()[-2]) for line in lines if line.startswith("epoch")]

    assert len(boxes) == 4
    assert sum(boxes[:2]) == sum(boxes[2:]) > 0


@pytest.mark.slow
def test_the_randomizer_is_found_by_its_entry_point(tmp_path: Path) -> None:
    """Installed offline and used by the configuration beside it."""
    package = tmp_path / "package"
    target = tmp_path / "site"
    package.mkdir()
    for file in (EXAMPLES / "custom_randomizer").rglob("*"):
        if file.is_file() and "__pycache__" not in file.parts:
            copy = package / file.relative_to(EXAMPLES / "custom_randomizer")
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(file.read_bytes())
    options = ("--quiet", "--no-index", "--no-deps", "--no-build-isolation")
    run(tmp_path, "-m", "pip", "install", *options, "--target", str(target), str(package))
    sheet = ("contact-sheet", str(package / "dark_table.yaml"), "--n", "1", "--out", "sheet.png")
    run(tmp_path, "-m", "gen_data", *sheet, path=str(target))

    assert (tmp_path / "sheet.png").exists()
