"""The scripts of ``examples/`` run, and its plug-in package works."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"


def run(folder: Path, *arguments: str, path: str = "", code: int = 0) -> str:
    """Its output; its errors, if it ends with another code than 0."""
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
    assert done.returncode == code, done.stdout + done.stderr
    return done.stderr if code else done.stdout


@pytest.mark.slow
def test_the_first_data_set_is_drawn(tmp_path: Path) -> None:
    """One line per box, and a picture."""
    assert len(run(tmp_path, str(EXAMPLES / "first_dataset.py")).splitlines()) > 4
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
    assert sorted(numbers[0] + numbers[1]) == sorted(numbers[2] + numbers[3]) == list(range(1, 9))
    assert numbers[:2] != numbers[2:]


@pytest.mark.slow
def test_the_detector_learns_and_is_stored(tmp_path: Path) -> None:
    """It overfits eight images, as a detector without faults does, and a stored one is the same.

    The data set also holds depth and label images, whose names are those of the photographs.
    """
    import torch

    options = (
        "--n", "8", "--workers", "0", "--seed", "4", "--out", "set",
        "--set", "sensors.color.size_px=[160, 120]", "--set", "splits={train: 1, val: 0, test: 0}",
        "--set", "labels.map={classes: {thing: [mug, bowl, cup, bottle, plate, can, jar, apple, "
        "banana, orange, book, vase, carton]}, min_visible_fraction: 0.3, min_box_px: 8, "
        "below: ignore}",
    )  # fmt: skip
    run(tmp_path, "-m", "gen_data", "--config", "tabletop.yaml", *options)
    script = str(EXAMPLES / "train_detector.py")
    training = ("--steps", "200", "--batch", "4", "--size", "160", "--workers", "0")
    judged = ("--eval", "set/coco", "--bootstrap", "20", "--out", "ap.json")
    lines = run(tmp_path, script, "set", *training, "--save", "detector.pt", *judged).splitlines()
    again = run(tmp_path, script, "--load", "detector.pt", *judged).splitlines()

    assert [line.split()[0] for line in lines[-3:]] == ["AP", "AP50", "AP50"]
    assert again == lines[-3:]
    low, high = (float(v) for v in re.findall(r"\d\.\d+", lines[-2])[1:3])
    ap50 = json.loads((tmp_path / "ap.json").read_text())["ap50"]
    assert low <= ap50 <= high
    assert ap50 > 0.8
    losses = [float(line.split()[-1]) for line in lines if ": loss " in line]
    assert len(losses) == 10
    assert losses[-1] < 0.5 * losses[0]

    # Trained further at another size, it keeps its features; options without an effect are errors.
    more = ("--load", "detector.pt", "--eval", "set/coco", "--bootstrap", "20")
    run(tmp_path, script, "set", *more, "--size", "96", "--steps", "2", "--workers", "0", "--save",
        "small.pt")  # fmt: skip
    stored = [torch.load(tmp_path / name) for name in ("detector.pt", "small.pt")]
    assert [file["size_px"] for file in stored] == [160, 96]
    assert stored[0]["width"] == stored[1]["width"] == 16
    for wrong, named in (
        (("set", "--width", "24"), "leave out --pretrained and --width"),
        (("set", "--pretrained"), "leave out --pretrained and --width"),
        (("--size", "96"), "give a source to train on"),
    ):
        message = run(tmp_path, script, *wrong, *more, code=2)
        assert named in message


NOTEBOOK = {"[320, 240]": "[96, 72]", "N = 20": "N = 5", "MOST_STEPS = 20": "MOST_STEPS = 2"}
"""Sizes in the notebook, and small ones."""


def test_the_notebook_is_stored_without_outputs() -> None:
    """They would grow with every change, and state results of an older version."""
    cells = json.loads((EXAMPLES / "quickstart.ipynb").read_text())["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]

    assert len(code) > 5
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code)


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_the_notebook_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every cell, with small sizes; the cells that show something have pictures and results."""
    import nbformat
    from nbclient import NotebookClient

    text = (EXAMPLES / "quickstart.ipynb").read_text()
    for long, short in NOTEBOOK.items():
        assert long in text, long
        text = text.replace(long, short)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    notebook = nbformat.reads(text, as_version=4)
    NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(tmp_path)}}).execute()

    kinds = [out.get("data", {}) for cell in notebook.cells for out in cell.get("outputs", ())]
    assert sum("image/png" in kind for kind in kinds) == 2
    assert any("'manifest.json'" in kind.get("text/plain", "") for kind in kinds)
    (last,) = notebook.cells[-2].outputs
    assert re.fullmatch(r"loss \d\.\d+ -> \d\.\d+\n", last["text"])


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
