"""Export of a finished data set in other formats."""

import io
import json
import os
import re
import shutil
import tarfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import gen_data as package
from gen_data.core.errors import StorageError
from gen_data.runner import exports, store
from gen_data.runner.stored import StoredSamples
from tests.end_to_end.running import digest, gen_data


def test_an_export_equals_generation_with_the_same_exporters(dataset: Path, tmp_path: Path) -> None:
    """Byte for byte, identity included, by two workers."""
    one = gen_data(
        "export", str(dataset), "--format", "coco", "--out", "one", "--workers", "1", cwd=tmp_path
    )
    both = gen_data("export", "one", "-f", "kitti", "-f", "coco", "-o", "both", cwd=tmp_path)

    assert one.returncode == both.returncode == 0, one.stderr + both.stderr
    assert not (tmp_path / "one/kitti").exists()
    made, exported = digest(dataset), digest(tmp_path / "both")
    # The order of exporters is part of the plan, which card and metadata describe.
    differing = {path for path in made if exported.get(path) != made[path]}
    described = {"README.md", "croissant.json"}
    assert differing == {"plan.json", "manifest.json", "SHA256SUMS"} | described
    again = gen_data("export", "one", "-f", "coco", "-f", "kitti", "-o", "all", cwd=tmp_path)
    assert again.returncode == 0, again.stderr
    assert digest(tmp_path / "all") == made


def test_images_are_hard_links(dataset: Path, tmp_path: Path) -> None:
    package.export(dataset, ["kitti"], tmp_path / "out", workers=0)

    image = Path("shards/000000/color/rgb/000000000.png")
    assert (dataset / image).samefile(tmp_path / "out" / image)


SCANNED = """\
elements:
  - {type: room, name: room, size_m: [6, 5, 2.8]}
  - {type: surface, name: table, asset: table}
  - {type: objects, name: glasses, on: table, count: 2, assets: {tags: [glassware]}}
sensors:
  - {type: rgb_camera, name: color, size_px: [160, 120], channels: [rgb]}
  - {type: lidar, name: top, model: VLP-16, origins: true}
exporters: [{type: webdataset}]
"""


@pytest.mark.slow
def test_origins_of_points_are_stored_and_linked(tmp_path: Path) -> None:
    """As long as the scan, in the data set, in its export, and in the files of exporters."""
    (tmp_path / "scanned.yaml").write_text(SCANNED)
    package.generate(tmp_path / "scanned.yaml", n=1, out=tmp_path / "made", workers=0)
    package.export(tmp_path / "made", ["webdataset"], tmp_path / "out", workers=0)

    for folder in (tmp_path / "made", tmp_path / "out"):
        (sample,) = package.open(folder)
        cloud = sample.lidars["top"]
        assert cloud.origins is not None and len(cloud.origins) == len(cloud.points) > 20_000
        place = cloud.lidar.T_world_lidar.apply(cloud.points["position_m"].astype(float))
        off_m = np.linalg.norm(cloud.origins["true_position_m"] - place, axis=1)
        # The noise of its ranges has a standard deviation of 1 to 2 cm.
        assert 0.001 < np.median(off_m[cloud.origins["path"] == 0]) < 0.03
        with tarfile.open(next(folder.glob("webdataset/*/*.tar"))) as tar:
            stored = tar.extractfile("000000000.top.origins.npy")
            assert stored is not None
            assert len(np.load(io.BytesIO(stored.read()))) == len(cloud.points)


def test_a_label_map_makes_a_data_set_of_the_users_classes(dataset: Path, tmp_path: Path) -> None:
    """With the ids of their order, also in exports of the export, and in Python."""
    (tmp_path / "map.yaml").write_text(
        "classes: {kitchen: [mug, bowl, cup, plate, bottle], arm: robot_arm}\n"
    )
    done = gen_data(
        "export", str(dataset), "-f", "{type: coco, amodal: false}",
        "--label-map", "map.yaml", "-o", "out", cwd=tmp_path,
    )  # fmt: skip

    assert done.returncode == 0, done.stderr
    form = {"type": "coco", "amodal": False}
    package.export(tmp_path / "out", [form], tmp_path / "again", workers=0)
    files = sorted((tmp_path / "out/coco/annotations").glob("*.json"))
    data = json.loads(files[0].read_text())
    names = ["kitchen", "arm"]
    assert [(c["id"], c["name"]) for c in data["categories"]] == [*enumerate(names, 1)]
    assert (tmp_path / "again/coco/annotations" / files[0].name).read_bytes() == (
        files[0].read_bytes()
    )
    assert package.open(tmp_path / "out").relabelled().categories == tuple(names)


@pytest.mark.parametrize(("arguments", "code", "text"), [
    (("-f", "coconut"), 2, "unknown exporter 'coconut'.*did you mean 'coco'"),
    (("-f", "kitti_stereo"), 2, "camera"),
    (("-f", "birdseye"), 2, "reads the annotations .*which the data set does not have"),
    (("-f", "coco", "--label-map", "bad.yaml"), 2, "bad.yaml:1:9: others: unknown value"),
])  # fmt: skip
def test_what_cannot_be_exported_is_refused_before_anything_is_written(
    dataset: Path, tmp_path: Path, arguments: tuple[str, ...], code: int, text: str
) -> None:
    """Place, fact, remedy, and no folder."""
    (tmp_path / "bad.yaml").write_text("others: away\n")
    done = gen_data("export", str(dataset), *arguments, "-o", "out", cwd=tmp_path)

    assert done.returncode == code
    assert re.search(text, done.stderr), done.stderr
    assert not (tmp_path / "out").exists()


def test_a_foreign_or_damaged_folder_is_named(dataset: Path, tmp_path: Path) -> None:
    foreign = gen_data("export", str(tmp_path), "-f", "coco", "-o", "out", cwd=tmp_path)
    damaged = tmp_path / "damaged"
    shutil.copytree(dataset, damaged)
    labels = damaged / "shards/000001/labels.jsonl"
    labels.write_text(labels.read_text()[:-200])
    broken = gen_data("export", str(damaged), "-f", "coco", "-o", "out", cwd=tmp_path)

    assert foreign.returncode == broken.returncode == 4
    assert "is not a gen-data data set" in foreign.stderr
    assert "shards/000001/labels.jsonl (samples 5 to 9)" in broken.stderr
    assert f"gen-data repair {damaged}" in broken.stderr


def _digit(path: Path, before: str, after: str) -> None:
    text = path.read_text("utf-8")
    assert before in text
    assert len(before) == len(after)
    path.unlink()
    path.write_text(text.replace(before, after, 1), "utf-8")


def _flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.unlink()
    path.write_bytes(data)


DAMAGES: dict[str, Callable[[Path], None]] = {
    "plan.json": lambda root: _digit(root / "plan.json", '"seed":1', '"seed":2'),
    "labels.jsonl": lambda root: _digit(
        root / "shards/000001/labels.jsonl", '"split":"train"', '"split":"trail"'
    ),
    "000000007.png": lambda root: _flip(root / "shards/000001/color/rgb/000000007.png"),
}
"""Damages that change no size, by the file that is named."""


@pytest.fixture(params=DAMAGES)
def damaged(request: pytest.FixtureRequest, dataset: Path, tmp_path: Path) -> tuple[Path, str]:
    folder = tmp_path / "damaged"
    shutil.copytree(dataset, folder, copy_function=os.link)
    DAMAGES[request.param](folder)
    return folder, request.param


def test_nothing_is_made_of_a_damaged_data_set(damaged: tuple[Path, str], tmp_path: Path) -> None:
    """Its export would have right checksums of wrong contents."""
    folder, name = damaged

    with pytest.raises(StorageError, match=rf"(?s){name}.*gen-data repair"):
        package.export(folder, ["yolo"], tmp_path / "out", workers=0)
    if name != "000000007.png":  # Images are rendered anew.
        with pytest.raises(StorageError, match=rf"(?s){name}.*gen-data repair"):
            package.rerender(folder, tmp_path / "again", workers=0)

    assert not (tmp_path / "out/manifest.json").exists()
    assert not (tmp_path / "again/manifest.json").exists()


def test_a_damaged_copy_differs_from_its_original(damaged: tuple[Path, str], dataset: Path) -> None:
    """Although the records and checksums of both are equal."""
    folder, name = damaged

    done = gen_data("diff", str(dataset), str(folder), cwd=folder.parent)

    said = {
        "plan.json": "seed: was 1, now 2",
        "labels.jsonl": 'split: was "train", now "trail"',
        "000000007.png": "000000007.png: cannot be decoded",
    }
    assert said[name] in done.stdout + done.stderr
    assert (done.returncode == 0) == (name == "plan.json")  # Which both plans say openly.


DEEP = "[" * 100_000
S = "shards/000000"


@pytest.mark.parametrize(("name", "text"), [
    ("plan.json", None),
    ("plan.json", ""),
    ("plan.json", "[]"),
    ("plan.json", DEEP),
    ("plan.json", "a folder"),
    ("plan.json", '"format_version":99'),
    ("manifest.json", None),
    ("manifest.json", "{}"),
    ("manifest.json", '{"info": [], "dataset_id": ""}'),
    ("manifest.json", DEEP),
    ("manifest.json", "a folder"),
    (f"{S}/labels.jsonl", None),
    (f"{S}/labels.jsonl", ""),
    (f"{S}/labels.jsonl", "null\n"),
    (f"{S}/labels.jsonl", "{}\n"),
    (f"{S}/labels.jsonl", DEEP + "\n"),
    (f"{S}/scenes.jsonl", None),
    (f"{S}/scenes.jsonl", "{}\n"),
    (f"{S}/scenes.jsonl", "NaN\n"),
], ids=lambda value: str(value)[:30])  # fmt: skip
def test_damaged_files_are_named(
    dataset: Path, tmp_path: Path, name: str, text: str | None
) -> None:
    """By one typed error, whatever is in the file; None removes it."""
    folder = tmp_path / "copy"
    shutil.copytree(dataset, folder, copy_function=os.link)
    path = folder / name
    whole = path.read_text("utf-8")
    path.unlink()
    if text == "a folder":
        path.mkdir()
    elif text is not None and "format_version" in text:
        path.write_text(re.sub(r'"format_version":\d+', text, whole), "utf-8")
    elif text is not None:
        path.write_text(text, "utf-8")

    with pytest.raises(StorageError) as error:
        StoredSamples(folder).sample(0)

    assert str(error.value).startswith(f"{path}: ")


@pytest.mark.slow
def test_sensors_at_other_instants_export_the_same_bytes(tmp_path: Path) -> None:
    """Boxes of a delayed scanner are at its own instant, in a later export, too."""
    made = gen_data(
        "--config", "tabletop_sequence.yaml", "--n", "2", "--workers", "1", "--out", "made",
        "--set", "steps_per_scene=2", "--set", "splits={train: 1, val: 0, test: 0}",
        "--set", "sensors=[{type: rgb_camera, name: color, size_px: [96, 72]}, "
        "{type: pseudo_lidar, time_offset_s: 0.15}]",
        "--set", "exporters=[{type: pointclouds}]", cwd=tmp_path,
    )  # fmt: skip
    assert made.returncode == 0, made.stderr

    done = gen_data("export", "made", "-f", "pointclouds", "-o", "again", cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    assert digest(tmp_path / "again") == digest(tmp_path / "made")


def test_exports_and_rerenderings_that_will_not_fit_are_refused(
    dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Copies of images on another disk and new images need space; hard links do not."""
    monkeypatch.setattr(store, "free_bytes", lambda path: 1_000_000)

    assert package.export(dataset, ["coco"], tmp_path / "linked", workers=0).made == 15

    with pytest.raises(StorageError, match=r"(?s)15 samples need about .* with --force"):
        package.rerender(dataset, tmp_path / "night", overrides=["render.shadows=hard"], workers=0)
    monkeypatch.setattr(exports, "_is_same_disk", lambda one, other: False)
    with pytest.raises(StorageError, match=r"(?s)15 samples need about .* with --force"):
        package.export(dataset, ["coco"], tmp_path / "copied", workers=0)
    assert not (tmp_path / "night/shards").exists()
    assert not (tmp_path / "copied/shards").exists()
    assert package.export(dataset, ["coco"], tmp_path / "copied", workers=0, force=True).made == 15
