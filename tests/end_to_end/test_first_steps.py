"""The first five minutes: init, plan, formats, describe, completion."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import pytest
import trimesh

from gen_data.exporters import TABLE
from gen_data.generator.assemble.config import load_config
from gen_data.generator.cli.init_command import guess_unit
from tests.end_to_end.running import gen_data

SHIPPED = ("tabletop", "street", "pedestrians", "bin_picking", "kitti_rig", "shelf")


@pytest.mark.parametrize("name", SHIPPED)
def test_init_writes_a_configuration_and_its_template(name: str, tmp_path: Path) -> None:
    """They read as the shipped ones, beside each other in an empty folder."""
    done = gen_data("init", "--template", name, cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    assert f"gen-data --config {name}.yaml --n 100" in done.stdout
    own, shipped = load_config(str(tmp_path / f"{name}.yaml")), load_config(name)
    assert own.resolved["elements"] == shipped.resolved["elements"]
    assert own.resolved["randomizers"] == shipped.resolved["randomizers"]
    assert f"template: {name}_scene.yaml" in (tmp_path / f"{name}.yaml").read_text()


def test_init_never_overwrites(tmp_path: Path) -> None:
    """Exit code 2, and the file stays."""
    (tmp_path / "tabletop_scene.yaml").write_text("mine")
    done = gen_data("init", cwd=tmp_path)

    assert done.returncode == 2
    assert "tabletop_scene.yaml: exists already" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["tabletop_scene.yaml"]


@pytest.mark.slow
def test_init_with_a_mesh_gives_a_data_set_of_that_class(tmp_path: Path) -> None:
    """Unit guessed as millimetres; the object is in the scenes, and the only label."""
    trimesh.creation.box((80.0, 40.0, 30.0)).export(tmp_path / "widget.stl")
    done = gen_data(
        "init", "--mesh", "widget.stl", "--class", "gizmo", "--out", "new", cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    index = (tmp_path / "new/assets/assets.yaml").read_text()
    assert "unit: mm" in index
    assert "80 x 40 x 30 units" in index

    made = gen_data(
        "--config", "new/tabletop.yaml", "--n", "5", "--workers", "1", "--out", "out",
        "--set", "sensors[0].size_px=[160, 120]", cwd=tmp_path,
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    (path, *_) = sorted((tmp_path / "out/coco/annotations").glob("*.json"))
    data = json.loads(path.read_text())
    assert [c["name"] for c in data["categories"]] == ["gizmo"]
    assert len(data["annotations"]) > 5


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (("--template", "tabeltop"), 2, "unknown configuration.*did you mean 'tabletop'"),
        (("--mesh", "none.stl"), 3, "none.stl: no such file"),
        (("--mesh", "junk.stl"), 3, "junk.stl: holds no triangles"),
        (("--mesh", "junk.xyz"), 3, "junk.xyz: cannot be read as a mesh"),
        (("--template", "kitti_rig", "--mesh", "junk.stl"), 2, "take no objects of your own"),
    ],
)
def test_init_refuses_what_it_cannot_write(
    tmp_path: Path, arguments: tuple[str, ...], code: int, text: str
) -> None:
    """And writes nothing."""
    (tmp_path / "junk.stl").write_bytes(b"solid\n")
    (tmp_path / "junk.xyz").write_bytes(b"nonsense\n")
    done = gen_data("init", *arguments, "--out", "new", cwd=tmp_path)

    assert done.returncode == code, done.stderr
    assert re.search(text, done.stderr), done.stderr
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    ("longest", "unit"), [(0.12, "m"), (2.0, "m"), (120.0, "mm"), (12.0, "mm"), (3500.0, "mm")]
)
def test_units_are_guessed_for_objects_of_a_hand_to_a_table(longest: float, unit: str) -> None:
    """A part of 12 units is 12 mm rather than 12 m; 3 cm to 3 m is usual."""
    assert guess_unit(longest) in ({unit, "cm"} if longest == 12.0 else {unit})


def test_plan_counts_without_rendering(tmp_path: Path) -> None:
    """Scenes, shards, categories, formats; a format that cannot hold the data set is refused."""
    done = gen_data("plan", "tabletop.yaml", "--n", "10000", cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    for text in ("2000 of 5 views", "mug", "export coco", "export kitti", "train 80%", "GB of"):
        assert text in done.stdout, text
    assert not list(tmp_path.iterdir())
    refused = gen_data(
        "plan", "tabletop.yaml", "--n", "10", "--set", "exporters=[{type: kitti_stereo}]",
        cwd=tmp_path,
    )  # fmt: skip
    assert refused.returncode == 2
    assert "exporter 'kitti_stereo'" in refused.stderr


def test_formats_lists_every_exporter(tmp_path: Path) -> None:
    """With what it is."""
    lines = gen_data("formats", cwd=tmp_path).stdout.splitlines()

    for name in TABLE:
        assert any(line.split()[:1] == [name] and len(line.split()) > 3 for line in lines), name


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("log_uniform", "log"),
        ("kitti", "far_m"),
        ("street_sequence", "extends"),
        ("tabletop", "template tabletop"),
    ],
)
def test_describe_knows_everything_that_a_configuration_names(
    name: str, text: str, tmp_path: Path
) -> None:
    """Plug-ins, distributions, templates, configurations."""
    done = gen_data("describe", name, cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    assert text in done.stdout


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_prints_a_script(shell: str, tmp_path: Path) -> None:
    """One that completes gen-data; bash can parse it."""
    done = gen_data("completion", shell, cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    assert "_GEN_DATA_COMPLETE" in done.stdout
    if shell == "bash":
        subprocess.run(["bash", "-n"], input=done.stdout, text=True, check=True)
