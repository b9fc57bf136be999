"""TUM's and ScanNet's RGB-D sequences: points from their files alone lie on the scene."""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from gen_data.core.capture import Channel
from gen_data.core.sample import Sample
from gen_data.exporters.scannet import ScanNet
from gen_data.exporters.tum_rgbd import TumRgbd
from tests.exporters.datasets import drive, made_of
from tests.exporters.label_readers import pixels

NYU40 = {"pedestrian": 31, "crate": 29, "car": 0}
"""Numbers of person and box in NYU's list; it has no cars."""


tum = made_of(TumRgbd(), drive)
scannet = made_of(ScanNet(), drive)


def table(path: Path) -> list[list[str]]:
    """Columns of all lines but comments."""
    return [row.split() for row in path.read_text().splitlines() if not row.startswith("#")]


def heights_m(depth_m: Any, pinhole: Sequence[float], pose: Any) -> Any:
    """World Z of the point at every pixel, whose centres are at whole numbers, [h, w]."""
    fx, fy, cx, cy = pinhole
    v, u = np.indices(depth_m.shape)
    points = np.stack([(u - cx) / fx * depth_m, (v - cy) / fy * depth_m, depth_m], -1)
    return (points @ pose[:3, :3].T + pose[:3, 3])[..., 2]


def assert_on_scene(height_m: Any, depth_m: Any, sample: Sample, depth_step_m: float) -> None:
    """The ground is at height 0, and objects reach from it to the top of their box."""
    channels = sample.capture.readings["left"].channels
    ids, seen = channels[Channel.INSTANCE], depth_m > 0.0
    margin_m = depth_step_m + 1e-6
    ground = seen & (ids == 0)
    assert ground.sum() > 1000
    assert np.abs(height_m[ground]).max() <= margin_m
    for thing in sample.scene.instances:
        on_thing = height_m[seen & (ids == thing.instance_id)]
        assert ((on_thing >= -margin_m) & (on_thing <= thing.box_max_m[2] + margin_m)).all()


def read_units(path: Path, units: float) -> Any:
    """Values of a 16-bit image in units, such as metres; 0 = none."""
    raw = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert raw is not None
    assert raw.dtype == np.uint16
    return raw / units


def sequence(samples: Sequence[Sample], number: int) -> Sequence[Sample]:
    return samples[4 * number : 4 * number + 4]


def test_tum_points_lie_on_the_scene_and_are_listed(tum: Path, samples: Sequence[Sample]) -> None:
    """Depth at 5000 units per metre, quaternions with the scalar last, and associated times.

    In the order of their times; the photographs are as in the data set.
    """
    for number, split in enumerate(("train", "val")):
        folder = tum / split / f"{number:06d}"
        pinhole = [float(v) for v in table(folder / "calibration.txt")[0]]
        poses = {row[0]: np.array(row[1:], float) for row in table(folder / "groundtruth.txt")}
        frames = zip(sequence(samples, number), table(folder / "depth.txt"), strict=True)
        for sample, (time, name) in frames:
            pose = np.eye(4)
            pose[:3, 3] = poses[time][:3]
            pose[:3, :3] = Rotation.from_quat(poses[time][3:]).as_matrix()
            assert abs(float(time) - sample.scene.time_s) <= 1e-6
            depth_m = read_units(folder / name, 5000.0)
            exact = sample.capture.readings["left"].channels[Channel.Z_DEPTH]
            assert (depth_m[np.isfinite(exact) & (exact < 13.0)] > 0.0).all()
            assert_on_scene(heights_m(depth_m, pinhole, pose), depth_m, sample, 0.0006)
        for kind in ("rgb", "depth"):
            rows = table(folder / f"{kind}.txt")
            assert [name for _, name in rows] == [f"{kind}/{time}.png" for time, _ in rows]
            assert {p.name for p in (folder / kind).iterdir()} == {f"{row[0]}.png" for row in rows}
            assert [float(row[0]) for row in rows] == sorted(float(row[0]) for row in rows)
        names = [name for _, name in table(folder / "rgb.txt")]
        for sample, name in zip(sequence(samples, number), names, strict=True):
            rgb = sample.capture.readings["left"].channels[Channel.RGB]
            assert np.array_equal(pixels(folder / name), rgb)


def test_tum_accelerometer_has_the_readings_of_the_imu(world: Any, tmp_path: Path) -> None:
    """Three readings per sample, in metres per second squared, gravity included."""
    folder = world.export(TumRgbd(), world.info(2), world.samples[:2], tmp_path)
    for index in range(2):
        rows = np.array(table(folder / f"train/{index:06d}/accelerometer.txt"), float)
        assert np.allclose(rows[:, 0], 0.1 * index + 0.01 * np.arange(3), atol=1e-6)
        assert np.allclose(rows[:, 1], [0.0, 1.0 / 3.0, -2.5e-7], atol=1e-8)
        assert np.allclose(rows[:, 3], 9.80665, atol=1e-6)


def scan_folder(scannet: Path, number: int) -> Path:
    return scannet / f"scans/scene{number:04d}_00"


def test_scannet_points_lie_on_the_scene(scannet: Path, samples: Sequence[Sample]) -> None:
    """Depth in millimetres, poses from the camera to the world."""
    for number in range(2):
        folder = scan_folder(scannet, number)
        matrix = np.loadtxt(folder / "intrinsic/intrinsic_depth.txt")
        assert matrix.shape == (4, 4)
        assert np.array_equal(np.loadtxt(folder / "intrinsic/extrinsic_depth.txt"), np.eye(4))
        pinhole = matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]
        for k, sample in enumerate(sequence(samples, number)):
            pose = np.loadtxt(folder / f"pose/{k}.txt")
            depth_m = read_units(folder / f"depth/{k}.png", 1000.0)
            assert_on_scene(heights_m(depth_m, pinhole, pose), depth_m, sample, 0.0005)
            forward_m = pose[:3, 3] - sample.truth["left"].camera.T_world_camera.translation_m
            assert np.abs(forward_m).max() < 1e-8


def test_scannet_labels_are_nyu40_of_instances_in_scans_listed_by_split(
    scannet: Path, samples: Sequence[Sample]
) -> None:
    """And instances have the ids of the data set wherever there is a class."""
    with (scannet / "scannetv2-labels.combined.tsv").open(encoding="utf-8") as file:
        classes = {int(row["id"]): row for row in csv.DictReader(file, delimiter="\t")}
    assert classes[31]["nyu40class"] == "person"
    assert {k: int(row["nyu40id"]) for k, row in classes.items()} == {k: k for k in range(1, 41)}
    for number in range(2):
        folder = scan_folder(scannet, number)
        for k, sample in enumerate(sequence(samples, number)):
            ids = sample.capture.readings["left"].channels[Channel.INSTANCE]
            labels, instances = (
                read_units(folder / f"{kind}-filt/{k}.png", 1.0) for kind in ("label", "instance")
            )
            expected = np.zeros(ids.shape, int)
            for thing in sample.scene.instances:
                expected[ids == thing.instance_id] = NYU40[thing.category]
            assert np.array_equal(labels, expected)
            assert np.array_equal(instances, np.where(expected > 0, ids, 0))
            # Every frame has the photograph of the data set, in JPEG.
            read = pixels(folder / f"color/{k}.jpg").astype(float)
            rgb = sample.capture.readings["left"].channels[Channel.RGB]
            assert np.abs(read - rgb).mean() < 6.0
    assert (scannet / "scannetv2_train.txt").read_text() == "scene0000_00\n"
    assert (scannet / "scannetv2_val.txt").read_text() == "scene0001_00\n"
