"""WebDataset export, judged by the package webdataset."""

import tarfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.core.capture import POINT, Channel
from gen_data.exporters.webdataset import WebDataset
from tests.exporters.datasets import made_of, scanned_street
from tests.exporters.label_readers import tar_samples

dataset = made_of(WebDataset(samples_per_tar=2), scanned_street)


def same_columns(matrix: NDArray[Any], columns: list[str], truth: Any) -> bool:
    """Whether a matrix of float32 has every number of the records of a scan under its name."""
    points = truth.capture.clouds["top"].points
    named = {f"position_m[{k}]": points["position_m"][:, k] for k in range(3)}
    named |= {name: points[name] for name in POINT.names or () if name != "position_m"}
    return (
        matrix.dtype == np.float32
        and columns == list(named)
        and all(np.array_equal(matrix[:, k], named[name]) for k, name in enumerate(columns))
    )


def faults(folder: Path, world: Any) -> list[str]:
    found = []
    expected = [s for s in world.samples if s.split == folder.name]
    samples = tar_samples(folder)
    keys = [sample["__key__"] for sample in samples]
    if keys != [f"{s.index:09d}" for s in expected]:
        return [f"keys {keys}"]
    for sample, truth in zip(samples, expected, strict=True):
        fields = {name for name in sample if not name.startswith("__")}
        pngs = {f"color.{c}.png" for c in ("rgb", "depth", "instance", "category")}
        if fields != {"json", "top.points.npy", "imu.rows.npy", *pngs}:
            found.append(f"fields {fields}")
            continue
        labels = sample["json"]
        rgb = truth.capture.readings["color"].channels[Channel.RGB]
        if not np.array_equal(np.asarray(sample["color.rgb.png"]), rgb):
            found.append("photograph")
        if not same_columns(sample["top.points.npy"], labels["columns"]["top.points.npy"], truth):
            found.append("points")
    return found


@pytest.mark.slow
def test_samples_are_read_back_with_all_fields_by_hugging_face_too(
    dataset: Path, world: Any
) -> None:
    """Images, scans, rows and labels under one key; each split has a folder."""
    assert faults(dataset / "train", world) == []
    assert faults(dataset / "val", world) == []
    assert sorted(p.name for p in (dataset / "train").iterdir()) == [
        f"street-{k:06d}.tar" for k in range(3)
    ]
    # Its reader refuses arrays of records.
    datasets = pytest.importorskip("datasets")
    files = sorted(map(str, (dataset / "train").glob("*.tar")))
    loaded = datasets.load_dataset("webdataset", data_files=files, split="train", streaming=True)
    expected = [s for s in world.samples if s.split == "train"]
    for row, sample in zip(loaded, expected, strict=True):
        columns = row["json"]["columns"]["top.points.npy"]
        assert same_columns(np.array(row["top.points.npy"], np.float32), columns, sample)


def test_tar_files_show_nothing_of_the_machine_and_hold_bytes_of_the_shards(dataset: Path) -> None:
    """Time, owner and mode are constant; members are regular files, sorted."""
    for path in dataset.rglob("*.tar"):
        with tarfile.open(path) as tar:
            members = tar.getmembers()
        assert {(m.mtime, m.uid, m.gid, m.uname, m.gname, m.mode) for m in members} == {
            (0, 0, 0, "", "", 0o644)
        }
        assert all(m.isfile() for m in members)
        assert [m.name for m in members] == sorted(m.name for m in members)
    # They are not encoded a second time.
    shard = dataset.parent / "shards/000001"
    with tarfile.open(dataset / "train/street-000001.tar") as tar:
        member = tar.extractfile("000000003.color.depth.png")
        assert member is not None
        assert member.read() == (shard / "color/depth/000000003.png").read_bytes()


@pytest.mark.slow
def test_sensors_that_do_not_read_have_no_field(world: Any, slow: Any, tmp_path: Path) -> None:
    """The right camera and the scanner read at every second step."""
    info = world.info(8, ("left", "right"), ("top",), devices={}, steps_per_scene=4)
    folder = world.export(WebDataset(), info, slow, tmp_path)
    fields = [
        {n for n in s if n.endswith((".rgb.png", ".npy"))} for s in tar_samples(folder / "train")
    ]
    whole, less = {"left.rgb.png", "right.rgb.png", "top.points.npy"}, {"left.rgb.png"}
    assert fields == [whole, less, whole, less]
