"""Every command and every block of code in ``docs/tutorials/`` runs, at a small size.

A block whose first line is a comment with a path is a file; other Python blocks of a page share
their names. Commands run in the order of the page, ``gen-data`` in this process.
"""

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import click
import pytest
import yaml

from docs import pictures
from gen_data.cli.main import cli

ROOT = Path(__file__).parents[2]
PAGES = {path.stem: path for path in sorted(ROOT.glob("docs/tutorials/*.md"))}
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"# ([\w./-]+\.(?:py|toml|yaml))\n")

SMALLER = {
    "my_calibration": {"--n 200": "--n 1 "},
    "my_own_objects": {"--n 2000": "--n 2", "--n 6 ": "--n 1 "},
    "my_own_template": {"--n 300": "--n 3", "--n 6 ": "--n 1 ", "[640, 480]": "[96, 72]"},
    "photo_plates": {
        "--n 20": "--n 1 --set sensors.color.size_px=[96,60]",
        "--index 0 --out": "--index 0 --set sensors.color.size_px=[96,60] --out",
    },
    "my_first_plugin": {"--n 20 ": "--n 1 ", "[320, 240]": "[96, 72]"},
    "read_labels": {
        "tabletop.yaml --n 20": "tabletop.yaml --n 5 --set sensors.color.size_px=[96,72] "
        "--set 'splits={train: 1, val: 0, test: 0}'"
    },
    "render_while_training": {"--n 200": "--n 2", "[320, 240]": "[96, 72]"},
    "street_rig": {
        "steps_per_scene: 20": "steps_per_scene: 2", "shard_size: 20": "shard_size: 2",
        "--n 200": "--n 2", "[960, 540]": "[192, 108]",
    },
    "train_a_detector": {
        "examples/detector.yaml": "examples/detector.yaml --set sensors.color.size_px=[160,120]",
        "--n 1000": "--n 8",
        "{train: 0.8, val: 0.2, test: 0}": "{train: 0.5, val: 0.5, test: 0, assign: round_robin}",
        "--n 800": "--n 8", "--n 200": "--n 4",
        "--steps 2400 --minutes 60": "--steps 2 --size 96 --workers 0",
    },
}  # fmt: skip
"""Texts of each page that are replaced, so that it runs within seconds."""

SETUP = (
    "python3 -m venv .venv && . .venv/bin/activate",
    "pip install . torch==2.13.0",
    "pip install . ultralytics-opencv-headless",
)
"""Commands that make the environment in which the tests already run."""


def shortened(name: str) -> str:
    """The text of a page with small sizes; each replaced text is still in it."""
    text = PAGES[name].read_text("utf-8")
    for long, short in SMALLER[name].items():
        assert long in text, f"{name}: '{long}' is not in the page"
        text = text.replace(long, short)
    return text


@pytest.mark.parametrize("page", PAGES.values(), ids=PAGES)
def test_pages_are_short_and_tested(page: Path) -> None:
    """40 to 120 lines of text; files of a package and code that runs are not counted."""
    text = page.read_text("utf-8")
    prose = BLOCK.sub("", text)

    assert page.stem in SMALLER
    assert len(prose.splitlines()) <= 120
    assert {kind for kind, _ in BLOCK.findall(text)} <= {"bash", "python", "yaml", "toml", "text"}


@pytest.mark.parametrize("name", PAGES)
def test_the_page_shows_its_result(name: str) -> None:
    """A picture that docs/pictures.py draws from the page itself, of at most 150 kB."""
    assert f"](../pictures/tutorial/{name}.webp)" in PAGES[name].read_text("utf-8")
    assert (ROOT / f"docs/pictures/tutorial/{name}.webp").stat().st_size <= 150_000
    assert pictures.read_sheets(pictures.TUTORIAL)[name].until in PAGES[name].read_text("utf-8")


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("name", PAGES)
def test_the_page_runs(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the first block to the last one, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    for module in stand_ins():
        monkeypatch.setitem(sys.modules, module.__name__, module)
    names: dict[str, Any] = {"__name__": name}
    for kind, block in BLOCK.findall(shortened(name)):
        file = FILE.match(block)
        if file:
            path = tmp_path / file[1]
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block.removeprefix(file[0]) if kind == "python" else block)
        elif kind == "python":
            exec(compile(block, f"{name}.md", "exec"), names)
        elif kind == "bash":
            for line in block.splitlines():
                if line not in SETUP:
                    run(shlex.split(line, comments=True), tmp_path)


def run(words: list[str], folder: Path) -> None:
    site = folder / "site-packages"
    command, *arguments = words
    if command == "gen-data" and not site.exists():
        if words[1].startswith("--config") or words[1] in ("export", "rerender"):
            arguments += ["--workers", "0"]  # worker processes only cost time here
        try:
            cli.main(arguments, prog_name="gen-data", standalone_mode=False)
        except click.ClickException as error:
            raise AssertionError(f"{shlex.join(words)}: {error.format_message()}") from error
        return
    if command == "pip" and arguments[0] == "install":
        options = ["--quiet", "--no-index", "--no-deps", "--no-build-isolation"]
        words = ["-m", "pip", "install", *options, "--target", str(site), *arguments[1:]]
    elif command == "gen-data":  # with installed plug-ins: a new process finds their entry points
        words = ["-m", "gen_data", *arguments]
    elif command == "python":
        words = arguments
    elif command in ("ln", "mkdir"):
        subprocess.run(words, check=True)
        return
    elif command == "yolo":
        run_yolo(*arguments)
        return
    else:
        raise AssertionError(f"unknown command: {shlex.join(words)}")
    path = os.pathsep.join([str(ROOT), str(site)])
    done = subprocess.run(
        [sys.executable, *words], env={**os.environ, "PYTHONPATH": path}, capture_output=True,
        text=True, check=False, timeout=600,
    )  # fmt: skip
    assert done.returncode == 0, f"{shlex.join(words)}:\n{done.stdout}{done.stderr}"


def stand_ins() -> Iterator[ModuleType]:
    """Modules in place of large trainers; they check that they could train on these arguments."""
    for names, attribute, value in (
        ("ultralytics", "YOLO", YoloStandIn),
        ("detectron2.data.datasets", "register_coco_instances", register_coco_instances),
        ("torchvision.models.detection", "fasterrcnn_mobilenet_v3_large_320_fpn", build_detector),
    ):
        parts = names.split(".")
        for count in range(1, len(parts) + 1):
            module = ModuleType(".".join(parts[:count]))
            if count == len(parts):
                setattr(module, attribute, value)
            yield module


def run_yolo(task: str, mode: str, *settings: str) -> None:
    """Stand in for the command ``yolo``, which trains for minutes."""
    values = dict(setting.split("=") for setting in settings)
    known = {"model", "data", "imgsz", "epochs", "optimizer", "lr0", "plots", "val"}
    assert task == "detect" and values.keys() <= known
    if mode == "train":
        model = YoloStandIn(values["model"])
        model.train(data=values["data"], epochs=int(values["epochs"]), imgsz=int(values["imgsz"]))
    else:
        assert mode == "val" and values["model"] == "runs/detect/train/weights/last.pt"
        YoloStandIn.read_labels(values["data"], "val")


class YoloStandIn:
    """Reads the data set as Ultralytics does: images from ``data.yaml``, labels beside them."""

    def __init__(self, model: str) -> None:
        assert model == "yolo11n.yaml"

    def train(self, *, data: str, epochs: int, imgsz: int) -> None:
        assert epochs > 0 and imgsz > 0
        self.read_labels(data, "train")

    @staticmethod
    def read_labels(data: str, split: str) -> None:
        """Every image of a split has a label file of normalised boxes of known classes."""
        content = yaml.safe_load(Path(data).read_text())
        images = sorted((Path(data).parent / content[split]).glob("*.png"))
        assert images
        rows = []
        for image in images:
            label = Path(str(image.with_suffix(".txt")).replace("/images/", "/labels/"))
            rows += [list(map(float, line.split())) for line in label.read_text().splitlines()]
        assert rows
        assert all(row[0] in content["names"] and max(row[1:]) <= 1.0 for row in rows)


def register_coco_instances(name: str, metadata: dict[str, Any], path: str, folder: str) -> None:
    """Detectron2's signature; every image of the file is in the folder."""
    from pycocotools.coco import COCO

    coco = COCO(path)
    assert coco.anns
    assert all((Path(folder) / image["file_name"]).is_file() for image in coco.imgs.values())


def build_detector(*, weights: None, weights_backbone: None, num_classes: int) -> Any:
    """A module that accepts inputs which torchvision's detectors accept; weights are downloads."""
    import torch

    assert weights is None and weights_backbone is None

    class Checking(torch.nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.weight = torch.nn.Parameter(torch.zeros(()))

        def forward(self, images: list[Any], targets: list[dict[str, Any]]) -> dict[str, Any]:
            for image, target in zip(images, targets, strict=True):
                boxes, labels = target["boxes"], target["labels"]
                assert image.shape[0] == 3 and image.dtype == torch.float32 and image.max() <= 1.0
                assert boxes.shape == (len(labels), 4) and boxes.dtype == torch.float32
                assert (boxes[:, 2:] > boxes[:, :2]).all()
                assert labels.dtype == torch.int64
                assert ((labels >= 1) & (labels < num_classes)).all()
            return {"loss": self.weight * len(images)}

    return Checking()
