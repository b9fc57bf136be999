"""A third-party package with one plug-in of every kind, installed and run from the command line.

It is written from the Protocols of ``gen_data.core.interfaces`` and inherits nothing but
``Strict``; ``mypy`` checks it with the rest of the project (``pyproject.toml``).
"""

import json
import os
import re
import shutil
import subprocess
import sys
from importlib.metadata import distributions
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from gen_data.assemble.plugin_tables import CONTENT_KINDS, TABLES
from gen_data.preview.contact_sheet import GAP_PX
from tests.end_to_end.running import ROOT, command

PACKAGE = Path(__file__).parent / "stranger"
CONFIG = """
seed: 3
elements:
  - {type: surface, name: table}
  - {type: room_layout, name: room, kind: stranger_gallery, annotate: false}
  - {type: stranger_pedestal, name: cup, at_m: [0.0, 0.0, 1.0]}
randomizers:
  - {type: furnish, name: furniture}
  - {type: stranger_swap, name: swap, target: cup, tags: [mug]}
  - {type: textures, name: cover, targets: [table], textures: [stranger_pattern], probability: true}
  - {type: camera_pose, name: orbit, stage: view}
sensors:
  - {type: rgb_camera, name: color, size_px: [96, 72]}
  - {type: stranger_light_meter, name: meter, noise: 0.0}
annotations: [boxes2d]
exporters:
  - {type: stranger_lines}
  - {type: tables}
  - {type: coco}
render: {renderer: stranger_boxes, luminance_cd_m2: 250.0}
"""


def run(*arguments: str, path: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run ``gen-data`` with a folder of installed packages on its path."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), path])}
    return subprocess.run(
        command(*arguments),
        cwd=cwd,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )


@pytest.fixture(scope="session")
def installed(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Folder into which the package was installed, offline."""
    folder = tmp_path_factory.mktemp("stranger")
    source, target = folder / "source", folder / "site"
    shutil.copytree(PACKAGE, source, ignore=shutil.ignore_patterns("__pycache__"))
    pip = (sys.executable, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps")
    done = subprocess.run(
        [*pip, "--no-build-isolation", "--target", str(target), str(source)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return str(target)


@pytest.fixture(scope="session")
def dataset(installed: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("strangers-data")
    (folder / "strange.yaml").write_text(CONFIG)
    arguments = ("--config", "strange.yaml", "--n", "2", "--workers", "1", "--out", "out")
    done = run(*arguments, path=installed, cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "out"


def scenes(dataset: Path) -> list[dict[str, object]]:
    paths = sorted(dataset.glob("shards/*/scenes.jsonl"))
    return [json.loads(line)["scene"] for path in paths for line in path.read_text().splitlines()]


def lines(dataset: Path) -> list[dict[str, object]]:
    text = (dataset / "stranger_lines/objects.jsonl").read_text()
    return [json.loads(line) for line in text.splitlines()]


def test_each_kind_of_plug_in_takes_one_file_and_one_line(installed: str) -> None:
    """Files and entry points of the package correspond one to one; no file imports another."""
    (package,) = distributions(path=[installed])
    files = {path.stem: path.read_text() for path in PACKAGE.glob("src/stranger/[!_]*.py")}
    assert sorted(entry.module for entry in package.entry_points) == sorted(
        f"stranger.{name}" for name in files
    )
    assert {entry.group for entry in package.entry_points} == {
        f"gen_data.{kind}" for kind in (*TABLES, *CONTENT_KINDS)
    }
    assert not [name for name, text in files.items() if "import stranger" in text]
    assert not [name for name, text in files.items() if "from stranger" in text]


@pytest.mark.slow
def test_the_room_has_the_pieces_of_its_type_at_the_places_of_its_rule(dataset: Path) -> None:
    """Two blocks in a room 6 m long, a quarter of it from its middle, on a striped floor."""
    for scene in scenes(dataset):
        bodies = {body["name"]: body for body in scene["bodies"]}  # type: ignore[attr-defined]
        blocks = [bodies[f"room/0/stranger_block_{k}"] for k in range(2)]
        assert all(block["asset"].startswith("stranger_block?seed=") for block in blocks)
        places = [block["T_world_body"]["translation_m"] for block in blocks]
        assert places == [[-1.5, 0.0, 0.0], [1.5, 0.0, 0.0]]
        (material,) = bodies["room/0/floor"]["materials"]
        assert material["texture"].startswith("texture/stranger_stripes?seed=")


@pytest.mark.slow
def test_the_contact_sheet_shows_the_drawing_of_the_device(dataset: Path, installed: str) -> None:
    """The last tile is white up to the share of 50 cd/m^2 that the device measured."""
    arguments = ("contact-sheet", "strange.yaml", "-n", "1", "--channels", "written")
    done = run(*arguments, "--tile-px", "96", "--columns", "1", path=installed, cwd=dataset.parent)
    assert done.returncode == 0, done.stderr
    row = (dataset / "tables/meter/000000.csv").read_text().splitlines()[1]
    sheet = np.array(Image.open(dataset.parent / "contact-sheet.png"))
    bar = sheet[-GAP_PX - 72 : -GAP_PX, GAP_PX:-GAP_PX]
    white = round(96 * float(row.split(",")[2]) / 50.0)
    assert 0 < white < 96
    assert (bar == np.where(np.arange(96) < white, 255, 0)[:, None]).all()


def test_the_data_set_verifies(dataset: Path, installed: str) -> None:
    done = run("verify", str(dataset), "--full", path=installed, cwd=dataset)
    assert done.returncode == 0, done.stderr


def test_the_element_and_the_texture_are_in_every_scene_and_the_plan(dataset: Path) -> None:
    """A mug 1 m above the floor; the plan names every mug that might have been drawn."""
    for scene in scenes(dataset):
        (cup,) = (body for body in scene["bodies"] if body["name"] == "cup")  # type: ignore[attr-defined]
        assert cup["asset"].startswith("mug?seed=")
        assert cup["T_world_body"]["translation_m"] == [0.0, 0.0, 1.0]
    planned = json.loads((dataset / "plan.json").read_text())["assets"]
    assert len([name for name in planned if name.startswith("mug?")]) > 1
    # It is selected by its tag.
    for scene in scenes(dataset):
        (table,) = (body for body in scene["bodies"] if body["name"] == "table")  # type: ignore[attr-defined]
        textures = {material["texture"] for material in table["materials"]}
        assert all(name.startswith("texture/stranger_stripes?seed=") for name in textures)
    licences = (dataset / "LICENSES-ASSETS.md").read_text()
    names = "stranger_block, texture/stranger_stripes"
    assert f"| stranger | CC0-1.0 | A stranger | {names} |" in licences
    # Another release may change every byte and is not resumed.
    assert json.loads((dataset / "plan.json").read_text())["versions"]["stranger"] == "1.0"


def test_the_sensor_measures_the_images_and_the_exporter_writes_the_labels(dataset: Path) -> None:
    """A box is 250 cd/m^2, the background black: the light meter reads their mean.

    The camera meters the boxes to middle grey: 18 %, which is 118 in sRGB.
    """
    for index in range(2):
        image = np.array(Image.open(next(dataset.glob(f"shards/*/color/rgb/{index:09d}.png"))))
        black, grey = np.unique(image)
        assert black == 0
        assert grey == pytest.approx(118, abs=2)
        share = (image[..., 0] == grey).mean()
        row = (dataset / f"tables/meter/{index:06d}.csv").read_text().splitlines()[1]
        assert float(row.split(",")[2]) == pytest.approx(250.0 * share, rel=1e-6)
    columns = json.loads((dataset / "tables/columns.json").read_text())["meter"]["columns"]
    assert [column["name"] for column in columns] == ["sample", "time_s", "luminance_cd_m2"]
    # Each distance is the one from the camera to the mug.
    cups = [line for line in lines(dataset) if line["category"] == "mug"]
    for line, scene in zip(cups, scenes(dataset), strict=True):
        (camera,) = scene["cameras"]  # type: ignore[misc]
        eye_m = np.array(camera["T_world_camera"]["translation_m"])
        assert line["distance_m"] == pytest.approx(np.linalg.norm(eye_m - [0, 0, 1]), abs=1e-5)


@pytest.mark.slow
def test_describe_and_schema_include_the_plug_ins(installed: str, tmp_path: Path) -> None:
    """Fields and docstrings of third parties appear like those of the project."""
    done = run("describe", "stranger_boxes", path=installed, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "renderer stranger_boxes" in done.stdout
    assert "Luminance of every box; the background is black." in done.stdout
    schema = json.loads(run("schema", path=installed, cwd=tmp_path).stdout)
    assert {f"{kind}.stranger_{name}" for kind, name in (
        ("element", "pedestal"), ("randomizer", "swap"), ("sensor", "light_meter"),
        ("exporter", "lines"), ("renderer", "boxes"),
    )} <= set(schema["$defs"])  # fmt: skip


def test_an_unknown_field_is_refused_at_its_place(installed: str, tmp_path: Path) -> None:
    """With file, line, column, and the field that was probably meant."""
    (tmp_path / "strange.yaml").write_text(CONFIG.replace("luminance_cd_m2", "luminance"))
    done = run("--config", "strange.yaml", "--n", "1", path=installed, cwd=tmp_path)
    assert done.returncode != 0
    assert "strange.yaml:20:36: render.luminance: unknown key" in done.stderr
    assert "luminance_cd_m2" in done.stderr


def test_the_examples_of_the_contributors_guide_are_those_of_the_package() -> None:
    """Each code block that names a file in its first line is part of that file."""
    guide = (ROOT / "CONTRIBUTING.md").read_text()
    blocks = re.findall(r"^```\w+\n# (tests/\S+)\n(.*?)^```$", guide, re.MULTILINE | re.DOTALL)
    assert len(blocks) == 10
    for path, text in blocks:
        assert text.rstrip() in (ROOT / path).read_text(), path
