"""Scenes of a finished data set, rendered again: pairs with a single difference."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import gen_data as package
from gen_data.api.repair import repair
from gen_data.core.errors import ConfigError, ConfigWarning
from tests.end_to_end.running import digest, gen_data


def test_without_a_change_every_sample_has_the_same_bytes(dataset: Path, tmp_path: Path) -> None:
    """Images, labels and scenes; only the plan differs between the two data sets."""
    done = gen_data("rerender", str(dataset), "--out", "again", "--workers", "1", cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    first, again = digest(dataset), digest(tmp_path / "again")
    assert first.keys() == again.keys()
    differing = {path for path in first if first[path] != again[path]}
    assert differing == {"plan.json", "manifest.json", "SHA256SUMS", "croissant.json"}


@pytest.fixture(scope="module")
def dark_dataset(dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("dark") / "dark"
    package.rerender(dataset, out, overrides=["lamps.illuminance_lux=40"], workers=0)
    return out


@pytest.mark.slow
def test_it_is_repaired_from_the_scenes_that_it_has(dataset: Path, dark_dataset: Path) -> None:
    """Without the data set of the scenes it cannot be."""
    before = digest(dark_dataset)
    (dark_dataset / "shards/000002.json").unlink()

    with pytest.raises(ConfigError, match=r"come from another data set.*--source"):
        repair(dark_dataset, workers=0)
    repair(dark_dataset, source=dataset, workers=0)

    assert digest(dark_dataset) == before


@pytest.mark.slow
def test_other_light_changes_colours_and_nothing_else(dataset: Path, dark_dataset: Path) -> None:
    """Ids, depth, boxes and poses are equal: a counterfactual pair."""
    bright, dark = package.open(dataset), package.open(dark_dataset)

    for one, other in zip(bright, dark, strict=True):
        a, b = one.cameras["color"], other.cameras["color"]
        assert np.array_equal(a.instance_ids, b.instance_ids)
        assert np.array_equal(a.depth_m, b.depth_m)
        assert (a.boxes2d, a.boxes3d) == (b.boxes2d, b.boxes3d)
        assert not np.array_equal(a.rgb, b.rgb)


@pytest.mark.slow
def test_other_cameras_see_the_same_scenes(dataset: Path, tmp_path: Path) -> None:
    """The camera of the same name keeps its pose, a new one has it too."""
    (tmp_path / "rig.yaml").write_text(
        "sensors:\n"
        "  - {type: rgb_camera, name: color, size_px: [80, 60], hfov_deg: 60}\n"
        "  - {type: rgb_camera, name: wide, size_px: [80, 80], hfov_deg: 110}\n"
        "  - {type: pseudo_lidar}\n"
    )
    done = gen_data(
        "rerender", str(dataset), "--out", "rig", "--sensors", "rig.yaml", "--workers", "2",
        cwd=tmp_path,
    )  # fmt: skip

    assert done.returncode == 0, done.stderr
    for one, other in zip(package.open(dataset), package.open(tmp_path / "rig"), strict=True):
        old, new, wide = one.cameras["color"], other.cameras["color"], other.cameras["wide"]
        assert np.array_equal(old.T_world_camera, new.T_world_camera)
        assert np.array_equal(old.T_world_camera, wide.T_world_camera)
        assert new.rgb.shape == (60, 80, 3)
        assert one.scene.bodies == other.scene.bodies
        assert one.scene.instances == other.scene.instances


@pytest.mark.parametrize(("arguments", "text"), [
    (("--set", "views_per_scene=2"), "views_per_scene: cannot change, as rerender keeps"),
    (("--redraw", "lamp"), "--redraw lamp: there is no such randomizer.*'lamps'"),
    (("--set", "clutter.count=3", "--workers", "1"), "randomizers.clutter: moves, adds or"),
    (("--set", "lamps.count=-1"), "lamps.*count"),
    (("--sensors", "empty.yaml"), "empty.yaml: sensors: missing"),
])  # fmt: skip
def test_what_would_change_the_scenes_is_refused(
    dataset: Path, tmp_path: Path, arguments: tuple[str, ...], text: str
) -> None:
    (tmp_path / "empty.yaml").write_text("seed: 1\n")
    done = gen_data("rerender", str(dataset), "--out", "out", *arguments, cwd=tmp_path)

    assert done.returncode == 2, done.stderr
    assert re.search(text, done.stderr), done.stderr


def test_a_single_sample_has_its_bytes_in_the_data_set(dataset: Path, tmp_path: Path) -> None:
    """Images, laser scans and labels, and a folder per format."""
    done = gen_data("sample", str(dataset), "--index", "7", "--out", "one", cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    whole = dataset / "shards/000001"
    for path in ("color/rgb/000000007.png", "color/depth/000000007.png",
                 "pseudo_lidar/points/000000007.npy"):  # fmt: skip
        assert (tmp_path / "one/sample" / path).read_bytes() == (whole / path).read_bytes()
    line = (whole / "labels.jsonl").read_text().splitlines()[2]
    assert (tmp_path / "one/sample/labels.jsonl").read_text() == line + "\n"
    label = "kitti/training/label_2/000007.txt"
    assert (tmp_path / "one" / label).read_bytes() == (dataset / label).read_bytes()
    again = gen_data("sample", str(dataset), "--index", "7", "--out", "one", cwd=tmp_path)
    assert again.returncode == 4
    assert "one: is not empty" in again.stderr


@pytest.mark.slow
def test_attributes_state_what_the_new_scenes_show(tmp_path: Path) -> None:
    """A changed shared value is the new one; one that no longer holds is left out."""
    config = tmp_path / "lit.yaml"
    config.write_text(
        "extends: tabletop.yaml\nshared: {lux: {choice: [300, 400]}}\n"
        "randomizers: [{type: lighting, name: lamps, illuminance_lux: $shared.lux}]\n"
        "sensors: [{type: rgb_camera, name: color, size_px: [64, 48]}]\n"
        "exporters: [{type: coco}]\nsplits: {val: 0.0, test: 0.0, train: 1.0}\n"
    )
    source = tmp_path / "lit"
    package.generate(config, n=2, out=source, workers=0)
    assert dict(package.open(source)[0].scene.shared)["lux"] in (300, 400)

    package.rerender(source, tmp_path / "dim", overrides=["shared.lux=40"], workers=0)
    own = ["lamps.illuminance_lux=40"]
    with pytest.warns(ConfigWarning, match=r"shared\.lux: .* --set shared\.lux="):
        package.rerender(source, tmp_path / "own", overrides=own, workers=0)

    for name, lux in (("dim", 40), ("own", None)):
        assert dict(package.open(tmp_path / name)[0].scene.shared).get("lux") == lux
        rows = json.loads((tmp_path / name / "coco/annotations/instances_train.json").read_text())
        assert rows["images"][0]["attributes"].get("lux") == lux
