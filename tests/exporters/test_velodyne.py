"""KITTI's scans have X ahead, whichever way the scanner is mounted, because readers rely on it."""

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gen_data.core.sample import Sample
from gen_data.core.se3 import SE3
from gen_data.exporters.kitti import Kitti
from gen_data.exporters.kitti_raw import KittiRaw
from gen_data.exporters.kitti_tracking import KittiTracking
from gen_data.exporters.semantickitti import SemanticKitti
from gen_data.exporters.velodyne import turn_ahead
from tests.exporters.drives import calibration, drive_info

NUMBER = r"-?\d+(?:\.\d+)?(?:e[-+]\d+)?"
EXPORTERS = {
    "kitti": Kitti(camera="left", low_px=4),
    "kitti_raw": KittiRaw(image_02="left", image_03="right"),
    "kitti_tracking": KittiTracking(camera="left", low_px=4),
    "semantickitti": SemanticKitti(camera="left"),
}


def with_turned_scanner(sample: Sample, yaw_rad: float) -> Sample:
    """The sample as a scanner measures it that is turned about its z axis in the same world."""
    turn = SE3.about_z(yaw_rad)
    cloud = sample.capture.clouds["top"]
    lidar = replace(
        cloud.lidar,
        T_rig_lidar=cloud.lidar.T_rig_lidar @ turn,
        T_world_lidar=cloud.lidar.T_world_lidar @ turn,
    )
    points = cloud.points.copy()
    points["position_m"] = turn.inverse().apply(points["position_m"].astype(np.float64))
    clouds = {"top": replace(cloud, lidar=lidar, points=points)}
    capture = replace(sample.capture, clouds=clouds)
    return replace(sample, scene=replace(sample.scene, lidars=(lidar,)), capture=capture)


def exported(world: Any, name: str, yaw_rad: float, folder: Path) -> Path:
    samples = [with_turned_scanner(sample, yaw_rad) for sample in world.drive()]
    path: Path = world.export(EXPORTERS[name], drive_info(world), samples, folder)
    return path


def scan(path: Path) -> np.ndarray:
    return np.frombuffer(path.read_bytes(), "<f4").reshape(-1, 4)


def numbers(path: Path) -> np.ndarray:
    return np.array([float(w) for w in re.findall(NUMBER, path.read_text())])


@pytest.mark.parametrize("yaw_deg", [-90.0, 55.0, 180.0])
@pytest.mark.parametrize("name", EXPORTERS)
def test_a_turned_scanner_has_the_files_of_one_that_looks_ahead(
    name: str, yaw_deg: float, world: Any, tmp_path: Path
) -> None:
    """The devkit of nuScenes turns its scans by a quarter, as their x points right."""
    ahead = exported(world, name, 0.0, tmp_path / "ahead")
    turned = exported(world, name, math.radians(yaw_deg), tmp_path / "turned")
    files = sorted(p.relative_to(ahead) for p in ahead.rglob("*") if p.is_file())
    assert files == sorted(p.relative_to(turned) for p in turned.rglob("*") if p.is_file())
    scans = [f for f in files if f.suffix == ".bin"]
    texts = [f for f in files if f.suffix in (".txt", ".xml") and f.name != "README.txt"]
    assert len(scans) == 8
    for file in scans:
        np.testing.assert_allclose(scan(turned / file), scan(ahead / file), atol=1e-5)
    for file in texts:
        np.testing.assert_allclose(numbers(turned / file), numbers(ahead / file), atol=2e-6)


@pytest.mark.parametrize("yaw_deg", [-90.0, 55.0])
def test_boxes_that_trainers_make_in_the_scanners_frame_hold_the_objects_points(
    yaw_deg: float, world: Any, tmp_path: Path
) -> None:
    """OpenPCDet 0.6 and MMDetection3D 1.4.

    The bottom's centre goes to the scanner's frame by the inverse of ``Tr_velo_to_cam`` and up by
    half the height along z; the yaw about z is ``-(rotation_y + pi / 2)``.
    """
    folder = exported(world, "kitti", math.radians(yaw_deg), tmp_path) / "training"
    found = 0
    for path in sorted((folder / "label_2").iterdir()):
        points = scan(folder / f"velodyne/{path.stem}.bin")[:, :3]
        rows = np.fromfile(folder / f"velodyne_labels/{path.stem}.label", "<u4") >> 16
        T_camera_velo = np.eye(4)
        T_camera_velo.flat[:12] = calibration(folder / f"calib/{path.stem}.txt")["Tr_velo_to_cam"]
        for number, line in enumerate(path.read_text().splitlines(), 1):
            if line.startswith("DontCare"):
                continue
            height, width, length, x, y, z, rotation_y = map(float, line.split(" ")[8:15])
            center = np.linalg.solve(T_camera_velo, [x, y, z, 1.0])[:3]
            center[2] += 0.5 * height
            yaw = -(rotation_y + 0.5 * math.pi)
            mine = points[rows == number] - center
            along = mine[:, 0] * math.cos(yaw) + mine[:, 1] * math.sin(yaw)
            across = mine[:, 1] * math.cos(yaw) - mine[:, 0] * math.sin(yaw)
            half = 0.5 * np.array([length, width, height]) + 0.05
            assert (np.abs(np.stack([along, across, mine[:, 2]], axis=1)) <= half).all()
            found += len(mine)
    assert found > 50


@pytest.mark.parametrize(("yaw_deg", "turned"), [(0.0, False), (2.9, False), (3.1, True)])
def test_errors_of_mounting_are_left_as_they_are(yaw_deg: float, turned: bool) -> None:
    """KITTI's own scanner is turned by 0.4 degrees against its cameras (drives of 26 September)."""
    yaw_rad = math.radians(yaw_deg)
    forward = np.array([math.cos(yaw_rad), math.sin(yaw_rad), 0.02])
    cosine, sine = turn_ahead(forward)
    assert (sine != 0.0) == turned
    assert cosine == pytest.approx(math.cos(yaw_rad) if turned else 1.0)
