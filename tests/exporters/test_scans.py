"""Laser scans in files: KITTI, SemanticKITTI, PLY and PCD, read back by other means."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gen_data.core.asset_types import SURFACES
from gen_data.core.capture import POINT
from gen_data.core.errors import StorageError
from gen_data.exporters.kitti import (
    Kitti,
    label_rows,
    official_type,
    point_labels,
    point_members,
    upright_box,
    without_returns,
)
from gen_data.exporters.point_cloud_io import read_points
from gen_data.exporters.pointclouds import PointClouds
from gen_data.exporters.semantickitti import SemanticKitti
from tests.exporters.datasets import made_of, scanned_street
from tests.exporters.drives import calibration, read_ply
from tests.exporters.label_readers import json_lines
from tests.wheels import needs_open3d

POINT_FIELDS = [*("x", "y", "z", "intensity", "time", "ring", "instance", "category", "surface"),
                *("return_number", "return_count")]  # fmt: skip


kitti = made_of(Kitti(far_m=100.0), scanned_street)
semantic = made_of(SemanticKitti(), scanned_street)
ply = made_of(PointClouds(), scanned_street)
pcd = made_of(PointClouds(format="pcd"), scanned_street)


def bins(path: Path) -> np.ndarray:
    return np.frombuffer(path.read_bytes(), "<f4").reshape(-1, 4)


def labels(path: Path) -> tuple[np.ndarray, np.ndarray]:
    value = np.frombuffer(path.read_bytes(), "<u4")
    return value & 0xFFFF, value >> 16


def test_the_native_file_holds_every_field_and_nothing_else(world: Any, kitti: Path) -> None:
    """All that was captured is read; a missing file is told."""
    shard = kitti.parent / "shards/000000"
    kept = read_points(shard, "top", 1)
    assert kept.tobytes() == world.samples[1].capture.clouds["top"].points.tobytes()
    with pytest.raises(StorageError, match="generate the data set again"):
        read_points(shard, "top", 99)


def test_kitti_points_are_the_scanners_with_labels_naming_the_row(kitti: Path, world: Any) -> None:
    """All points: x y z and reflectance in [0, 1].

    The upper half of a label is the row of its instance from 1, the lower half the category.
    """
    checked = 0
    for sample in world.samples:
        points = sample.capture.clouds["top"].points
        written = bins(kitti / f"training/velodyne/{sample.index:06d}.bin")
        np.testing.assert_array_equal(written[:, :3], points["position_m"])
        np.testing.assert_array_equal(written[:, 3], points["intensity"])
        category, row = labels(kitti / f"training/velodyne_labels/{sample.index:06d}.label")
        np.testing.assert_array_equal(category, points["category_id"])
        text = (kitti / f"training/label_2/{sample.index:06d}.txt").read_text().splitlines()
        for number in np.unique(row[row > 0]):
            (instance_id,) = np.unique(points["instance_id"][row == number])
            expected = official_type(sample.scene.instance(int(instance_id)))
            assert text[number - 1].split(" ")[0] in (expected, "DontCare")
            checked += 1
    assert checked > 10


def test_the_calibration_takes_points_onto_the_objects_pixels(kitti: Path, world: Any) -> None:
    """P2 Tr x: points of an instance fall on its mask or within two pixels of it, if visible."""
    sample = world.samples[0]
    rows = calibration(kitti / "training/calib/000000.txt")
    tr, p2 = rows["Tr_velo_to_cam"].reshape(3, 4), rows["P2"].reshape(3, 4)[:, :3]
    points = sample.capture.clouds["top"].points
    seen = {t.instance.instance_id: t for t in sample.truth["color"].objects}
    checked = 0
    for number, thing in seen.items():
        mine = points[points["instance_id"] == number]["position_m"]
        uv = (tr[:, :3] @ mine.T + tr[:, 3:]).T @ p2.T
        uv = uv[uv[:, 2] > 0]
        uv = uv[:, :2] / uv[:, 2:]
        box = thing.amodal_box
        inside = (uv[:, 0] > box.x_min - 2) & (uv[:, 0] < box.x_max + 2)
        inside &= (uv[:, 1] > box.y_min - 2) & (uv[:, 1] < box.y_max + 2)
        assert inside.all()
        checked += len(uv)
    assert checked > 20


def test_kitti_objects_are_what_lies_in_their_boxes(world: Any) -> None:
    """Noise of 3 cm is forgiven, more is not; road that reaches into the box is in it.

    Four points of the first car: on it, 2 cm and 4 cm before it, and road 4 cm inside.
    """
    truth = world.samples[0].truth["color"]
    alone = replace(truth, objects=truth.objects[:1])
    box = upright_box(truth.objects[0].box3d_camera)
    ahead = np.array([math.cos(box.heading_rad), 0.0, -math.sin(box.heading_rad)])
    face = np.asarray(box.bottom_m) - (0.0, 0.5, 0.0) + ahead * 0.5 * box.size_hwl_m[2]
    middle = np.asarray(box.bottom_m) - (0.0, 0.04, 0.0)
    points = np.zeros(4, POINT)
    points["position_m"] = [face, face + 0.02 * ahead, face + 0.04 * ahead, middle]
    points["instance_id"] = points["category_id"] = [1, 1, 1, 0]
    rows = label_rows(alone, Kitti(far_m=100.0))
    members, unseen = point_members(points, alone, rows, np.eye(3, 4))
    assert unseen == frozenset()
    both = point_labels(points, members, rows)
    np.testing.assert_array_equal(both & 0xFFFF, points["category_id"])
    np.testing.assert_array_equal(both >> 16, [1, 1, 0, 1])
    # With none of its points in the box, it is DontCare; with one, a Car.
    T_camera_velo = np.array([[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0]], float)
    _, unseen = point_members(points[:0], alone, rows, T_camera_velo)
    assert unseen == {1}
    ((changed, _),) = without_returns(rows, unseen, alone)
    assert changed.startswith("DontCare -1 -1 -10 ")
    assert rows[0][0].startswith("Car ")


def test_semantic_scans_are_in_official_splits_with_classes_and_ids_of_all_scenes(
    semantic: Path, world: Any
) -> None:
    """Train is sequence 00, val is 08; points, labels, poses and times agree in number."""
    counts = {"00": 5, "08": 2}
    assert sorted(p.name for p in (semantic / "sequences").iterdir()) == sorted(counts)
    for name, count in counts.items():
        folder = semantic / "sequences" / name
        stems = [f"{k:06d}" for k in range(count)]
        assert [p.stem for p in sorted((folder / "velodyne").iterdir())] == stems
        assert [p.stem for p in sorted((folder / "labels").iterdir())] == stems
        for text in ("poses.txt", "times.txt", "scans.txt"):
            assert len((folder / text).read_text().splitlines()) == count
        first = np.array((folder / "poses.txt").read_text().splitlines()[0].split(), float)
        np.testing.assert_allclose(first.reshape(3, 4), np.eye(3, 4), atol=1e-9)
    # Cars 10, people 30 with an instance; crates 99 and the road 40 without.
    folder = semantic / "sequences/00"
    sample = world.samples[0]
    points = sample.capture.clouds["top"].points
    classes, things = labels(folder / "labels/000000.label")
    ids = points["instance_id"]
    for number, expected in {1: 10, 2: 30, 3: 99, 7: 30}.items():
        assert set(classes[ids == number]) <= {expected}
    assert set(classes[ids == 0]) == {40}
    assert (things[np.isin(classes, [10, 30])] > 0).all()
    assert (things[np.isin(classes, [99, 40])] == 0).all()
    assert {10, 30, 99, 40} <= set(classes)
    # Instance ids never come back with another scene.
    seen: set[int] = set()
    for path in sorted((semantic / "sequences/00/labels").iterdir()):
        _, things = labels(path)
        mine = set(things[things > 0].tolist())
        assert not mine & seen
        seen |= mine
    assert len(seen) > 5


@needs_open3d
@pytest.mark.parametrize("kind", ["ply", "pcd"])
def test_open3d_reads_point_clouds(
    kind: str, world: Any, open3d: Any, request: pytest.FixtureRequest
) -> None:
    """All positions and all scalar fields, as written."""
    folder = request.getfixturevalue(kind)
    points = world.samples[2].capture.clouds["top"].points
    read = open3d.t.io.read_point_cloud(str(folder / f"top/000000002.{kind}"))
    np.testing.assert_array_equal(read.point["positions"].numpy(), points["position_m"])
    for name, field in (("intensity", "intensity"), ("instance", "instance_id")):
        np.testing.assert_array_equal(read.point[name].numpy()[:, 0], points[field])


def test_a_ply_file_is_what_its_header_says_and_points_in_boxes(world: Any, ply: Path) -> None:
    """Parsed by hand: one record per point, in the order of the properties."""
    records = read_ply(ply / "top/000000000.ply")
    points = world.samples[0].capture.clouds["top"].points
    assert list(records.dtype.names) == POINT_FIELDS
    np.testing.assert_array_equal(records["category"], points["category_id"])
    np.testing.assert_array_equal(records["instance"], points["instance_id"])
    np.testing.assert_array_equal(records["z"], points["position_m"][:, 2])
    # ``poses.jsonl`` lists boxes; every labelled point is in its own, to a millimetre.
    rows = json_lines(ply / "top/poses.jsonl")
    assert [row["index"] for row in rows] == list(range(7))
    checked = 0
    for row, sample in zip(rows, world.samples, strict=True):
        points = sample.capture.clouds["top"].points
        for box in row["boxes"]:
            w, *xyz = box["quaternion_wxyz"]
            rotation = Rotation.from_quat([*xyz, w]).as_matrix()
            mine = points[points["instance_id"] == box["instance"]]["position_m"]
            local = (mine - np.array(box["center_m"])) @ rotation
            assert (np.abs(local) <= 0.5 * np.array(box["size_m"]) + 1e-3).all()
            checked += len(mine)
    assert checked > 100


def test_a_pcd_file_is_what_its_header_says(world: Any, pcd: Path) -> None:
    """Parsed by hand by PCL's description: sizes, types and number of points."""
    header, body = (pcd / "top/000000000.pcd").read_bytes().split(b"DATA binary\n", 1)
    lines = dict(line.split(" ", 1) for line in header.decode("ascii").splitlines())
    kinds = zip(lines["TYPE"].lower().split(), lines["SIZE"].split(), strict=True)
    points = world.samples[0].capture.clouds["top"].points
    assert lines["FIELDS"].split() == POINT_FIELDS
    dtype = np.dtype(list(zip(POINT_FIELDS, (f"<{t}{n}" for t, n in kinds), strict=True)))
    records = np.frombuffer(body, dtype)
    assert len(records) == int(lines["POINTS"]) == len(points)
    np.testing.assert_array_equal(records["category"], points["category_id"])
    np.testing.assert_array_equal(records["z"], points["position_m"][:, 2])


def test_air_and_ground_have_surfaces_with_names() -> None:
    """Numbers in files never move: the first and the second are fixed."""
    assert SURFACES[:3] == ("", "air", "asphalt")
    assert len(set(SURFACES)) == len(SURFACES) < 256
