"""The scripts of ``examples/`` run, and its plug-in package works."""

from __future__ import annotations

import json
import os
import re
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
def test_both_loaders_give_the_same_batches(tmp_path: Path) -> None:
    """Two epochs of two batches, every sample once per epoch, in an order of its own."""
    lines = run(tmp_path, str(EXAMPLES / "train_loader.py")).splitlines()
    finished = [line.removeprefix("finished, ") for line in lines if line.startswith("finished")]
    rendered = [line.removeprefix("rendered, ") for line in lines if line.startswith("rendered")]
    numbers = [json.loads(re.search(r"\[.*\]", line)[0]) for line in finished]

    assert finished == rendered
    assert len(finished) == 4
    assert sorted(numbers[0] + numbers[1]) == sorted(numbers[2] + numbers[3]) == list(range(8))
    assert numbers[:2] != numbers[2:]


@pytest.mark.slow
def test_the_detector_learns_what_it_has_seen(tmp_path: Path) -> None:
    """Half a minute on twenty images: boxes of one class are found again on the same images."""
    options = (
        "--n", "20", "--workers", "1", "--seed", "4", "--out", "set",
        "--set", "sensors.color.size_px=[160, 120]", "--set", "splits={train: 1, val: 0, test: 0}",
        "--set", "labels.map={classes: {thing: [mug, bowl, cup, bottle, plate, can, jar, apple, "
        "banana, orange, book, vase, carton]}}",
    )  # fmt: skip
    run(tmp_path, "-m", "gen_data", "--config", "tabletop.yaml", *options)
    script = str(EXAMPLES / "train_detector.py")
    training = ("--split", "train", "--minutes", "0.5", "--size", "128", "--bootstrap", "20")
    lines = run(
        tmp_path,
        script,
        "set",
        "--eval",
        "set/coco",
        *training,
        "--workers",
        "0",
        "--out",
        "ap.json",
    ).splitlines()

    assert [line.split()[0] for line in lines[-2:]] == ["AP", "AP50"]
    low, high = (float(v) for v in re.findall(r"\d\.\d+", lines[-1])[1:3])
    assert low <= json.loads((tmp_path / "ap.json").read_text())["ap50"] <= high
    assert json.loads((tmp_path / "ap.json").read_text())["ap50"] > 0.05


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
