"""The first five minutes: init, plan, formats, describe, completion."""

import errno
import json
import re
import shlex
import subprocess
from pathlib import Path

import pytest
import trimesh
from trimesh.exchange.gltf import export_gltf

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.assets.library import open_library
from gen_data.cli.init_command import TAKE_MESHES, init
from gen_data.cli.own_meshes import guess_unit
from gen_data.core.asset_types import Asset
from gen_data.core.errors import StorageError
from gen_data.exporters import TABLE
from tests.end_to_end.running import gen_data
from tests.tiers import sampled

SHIPPED = ("tabletop", "street", "pedestrians", "bin_picking", "kitti_rig", "shelf")


@pytest.mark.parametrize("name", sampled(SHIPPED, 6))
def test_init_writes_a_configuration_and_its_template(name: str, tmp_path: Path) -> None:
    """They read as the shipped ones, next to each other in an empty folder."""
    done = gen_data("init", "--template", name, cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    assert f"gen-data --config {name}.yaml --n 100" in done.stdout
    own, shipped = load_config(str(tmp_path / f"{name}.yaml")), load_config(name)
    assert own.resolved["elements"] == shipped.resolved["elements"]
    assert own.resolved["randomizers"] == shipped.resolved["randomizers"]
    assert f"template: {name}_scene.yaml" in (tmp_path / f"{name}.yaml").read_text()


def test_init_never_overwrites(tmp_path: Path) -> None:
    (tmp_path / "tabletop_scene.yaml").write_text("mine")
    done = gen_data("init", cwd=tmp_path)

    assert done.returncode == 2
    assert "tabletop_scene.yaml: exists already" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["tabletop_scene.yaml"]


@pytest.mark.parametrize("out", ["/proc/new/deep", "file", "file/deep"])
def test_init_names_a_folder_that_cannot_be_written(out: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    done = gen_data("init", "--out", out, cwd=tmp_path)

    assert done.returncode == 4, done.stderr
    (line,) = done.stderr.splitlines()
    assert re.fullmatch(r"gen-data: (/proc/new|file)\S*: .+; choose another folder .*", line)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_init_leaves_nothing_on_a_disk_that_became_full(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first file is whole, the second one is cut off."""
    copied: list[Path] = []

    def copy(source: Path, target: Path) -> None:
        target.write_bytes(source.read_bytes()[: 10 if copied else None])
        copied.append(target)
        if len(copied) == 2:
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("gen_data.cli.init_command.shutil.copyfile", copy)
    with pytest.raises(StorageError, match=r"new: No space left on device; choose another"):
        init.main(["--out", str(tmp_path / "old/new")], standalone_mode=False)

    assert len(copied) == 2
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("template", TAKE_MESHES)
def test_templates_for_meshes_take_them(
    template: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trimesh.creation.box((80.0, 40.0, 30.0)).export(tmp_path / "widget.stl")
    done = gen_data("init", "-t", template, "--mesh", "widget.stl", cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    monkeypatch.chdir(tmp_path)
    factory = PipelineFactory(load_config(f"{template}.yaml"), n=1)
    assert "user/widget" in {a for s in factory.nominal for g in s.groups for a in g.assets}


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


def textured_obj(folder: Path, name: str, rgb: tuple[int, int, int]) -> None:
    from PIL import Image

    (folder / "images").mkdir(parents=True, exist_ok=True)
    Image.new("RGB", (2, 2), rgb).save(folder / "images/color.png")
    (folder / "scene.mtl").write_text("newmtl m\nmap_Kd images/color.png\n")
    (folder / f"{name}.obj").write_text(
        "mtllib scene.mtl\nv 0 0 0\nv 0.1 0 0\nv 0 0.1 0.1\nvt 0 0\nvt 1 0\nvt 0 1\n"
        "usemtl m\nf 1/1 2/2 3/3\n"
    )


@pytest.mark.slow
def test_init_takes_every_mesh_with_the_files_that_it_refers_to(tmp_path: Path) -> None:
    """Files and folders; material libraries of one name and different content; spaces."""
    textured_obj(tmp_path / "a", "red duck", (255, 0, 0))
    textured_obj(tmp_path / "b", "blue", (0, 0, 255))
    box = trimesh.creation.box((0.1, 0.05, 0.03))
    for name, data in export_gltf(trimesh.Scene(box)).items():  # with a buffer beside it
        (tmp_path / "b" / name.replace("model", "loose")).write_bytes(data)
    box.export(tmp_path / "bolt.ply")
    box.export(tmp_path / "bolt.stl")
    done = gen_data(
        "init", "--mesh", "a/red duck.obj", "--mesh", "b", "--mesh", "bolt.ply",
        "--mesh", "bolt.stl", "--out", "my parts", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr

    config = load_config(str(tmp_path / "my parts/tabletop.yaml"))
    (group,) = [e for e in config.resolved["elements"] if e["name"] == "clutter"]
    classes = ["red duck", "blue", "loose", "bolt"]
    assert [*config.general.labels.map.classes_of] == classes
    assets = {i: library_asset(tmp_path / "my parts/assets", i) for i in group["assets"]["ids"]}
    assert [asset.category for asset in assets.values()] == [*classes, "bolt"]
    albedos = [asset_albedo(tmp_path / "my parts/assets", i) for i in list(assets)[:2]]
    assert albedos == [(255, 0, 0), (0, 0, 255)]
    commands = re.findall(r"(?m)^    (gen-data .*)$", done.stdout)
    assert [shlex.split(c)[-1] for c in commands] == ["my parts/assets", "6", "100"]
    assert shlex.split(commands[1])[2] == "my parts/tabletop.yaml"


def library_asset(folder: Path, asset_id: str) -> Asset:
    return open_library([folder]).get(asset_id)


def asset_albedo(folder: Path, asset_id: str) -> tuple[int, ...]:
    library = open_library([folder])
    material = library.mesh(asset_id).materials[0]
    return tuple(library.texture(material.texture).albedo[0, 0].tolist())


@pytest.mark.slow
@pytest.mark.parametrize("template", ["tabletop", "bin_picking"])
def test_the_comments_of_init_tell_how_to_omit_the_robot(template: str, tmp_path: Path) -> None:
    """Done as they say, the configuration is valid and its scenes have no robot."""
    trimesh.creation.box((0.1, 0.05, 0.03)).export(tmp_path / "part.stl")
    done = gen_data("init", "--template", template, "--mesh", "part.stl", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    file, scene = (tmp_path / f"{template}{end}.yaml" for end in ("", "_scene"))
    text = file.read_text()
    named = {kind: re.findall(rf"the {kind} '(\w+)'", text) for kind in ("randomizer", "element")}
    for path, names in ((file, named["randomizer"]), (scene, named["element"])):
        lines = path.read_text().splitlines(keepends=True)
        kept = [k for k in lines if not any(re.search(rf"name: {n}\b", k) for n in names)]
        path.write_text("".join(kept))

    (probe, *_) = PipelineFactory(load_config(str(file)), 1).nominal
    assert probe.articulations == ()
    assert ("'arm'" in text) == (template == "tabletop")


@pytest.mark.parametrize(("arguments", "code", "text"), [
    (("--template", "tabeltop"), 2, "unknown configuration.*did you mean 'tabletop'"),
    (("--mesh", "none.stl"), 3, "none.stl: no such file"),
    (("--mesh", "junk.stl"), 3, "junk.stl: cut off"),
    (("--mesh", "junk.xyz"), 3, "junk.xyz: is not a readable mesh; expected one of .*obj"),
    (("--mesh", "box.off"), 3, "box.off: is not a readable mesh"),
    (("--mesh", "empty"), 3, "empty: has no mesh"),
    (("--mesh", "bare.obj"), 3, r"bare.obj: .*missing file bare.mtl"),
    (("--mesh", "box.stl", "--class", "a", "--class", "b"), 2, "2 names for 1 mesh"),
    (("--class", "a"), 2, "expected --mesh with it"),
    (("--template", "kitti_rig", "--mesh", "junk.stl"), 2, "take no objects of your own"),
    (("--template", "closeup", "--mesh", "box.stl"), 2, "'closeup' has its own 'labels', .*"
     "shelf or wrist_camera; or a .*'extends: closeup' .*elements.clutter.assets"),
    (("--template", "handheld", "--mesh", "box.stl"), 2, "'handheld' has its own 'elements', "),
])  # fmt: skip
def test_init_refuses_what_it_cannot_write(
    tmp_path: Path, arguments: tuple[str, ...], code: int, text: str
) -> None:
    (tmp_path / "junk.stl").write_bytes(b"solid\n")
    (tmp_path / "junk.xyz").write_bytes(b"nonsense\n")
    (tmp_path / "empty").mkdir()
    (tmp_path / "bare.obj").write_text(
        "mtllib bare.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n"
    )
    for suffix in ("off", "stl"):
        trimesh.creation.box((80.0, 40.0, 30.0)).export(tmp_path / f"box.{suffix}")
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
    texts = ["2,000 scenes x 5 views x 1 instant", "mug", "train 80%", "GB of"]
    for text in (*texts, "export coco", "export kitti"):
        assert text in done.stdout, text
    assert not list(tmp_path.iterdir())
    refused = gen_data(
        "plan", "tabletop.yaml", "--n", "10", "--set", "exporters=[{type: kitti_stereo}]",
        cwd=tmp_path,
    )  # fmt: skip
    assert refused.returncode == 2
    assert "exporter 'kitti_stereo'" in refused.stderr


def test_formats_lists_every_exporter(tmp_path: Path) -> None:
    lines = gen_data("formats", cwd=tmp_path).stdout.splitlines()

    for name in TABLE:
        assert any(line.split()[:1] == [name] and len(line.split()) > 3 for line in lines), name


@pytest.mark.parametrize(("name", "text"), [
    ("log_uniform", "log"),
    ("kitti", "far_m"),
    ("street_sequence", "extends"),
    ("tabletop", "template tabletop"),
])  # fmt: skip
def test_describe_knows_all_that_is_configured(name: str, text: str, tmp_path: Path) -> None:
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
