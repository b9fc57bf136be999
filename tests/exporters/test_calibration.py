"""Calibrations of data sets in the files of OpenCV, ROS, Kalibr and COLMAP."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml

from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.scene import Camera, Device, Rig, Scene
from gen_data.core.scene_time import RIG_AXES, place_sensors
from gen_data.core.se3 import SE3, turned
from gen_data.exporters.calibration import CalibrationFiles, calibration_texts
from gen_data.exporters.calibration_texts import colmap_camera
from gen_data.sensors.calibration.read_calibration import read_calibration
from tests.exporters.datasets import in_scene

BENT = Lens("brown_conrady", (-0.21, 0.09, 0.0007, -0.0004, 0.0, 0.0, 0.0, 0.0))
STRONG = Lens("brown_conrady", (-0.21, 0.09, 0.0007, -0.0004, -0.012, 0.01, 0.002, 0.0005))
FISHEYE = Lens("kannala_brandt", (0.0034, 0.0007, -0.002, 0.0002))
PINHOLE = Lens()
LENSES = {"bent": BENT, "fisheye": FISHEYE, "pinhole": PINHOLE, "strong": STRONG}
POINTS_M = np.array([[-0.5, 0.3, 2.0], [0.4, -0.2, 1.7], [0.1, 0.1, 3.0]])


def rig_scene() -> Scene:
    cameras = []
    for k, (name, lens) in enumerate(LENSES.items()):
        K = Intrinsics(640, 512, 612.4 + k, 611.9, 319.2 - k, 259.8, lens)
        pose = turned((0.1 * k, -0.06 * k, 0.02), 0.1 * k, -0.05, 0.02) @ RIG_AXES.inverse()
        cameras.append(Camera(name, SE3(), K, None, "rig", pose.rounded()))
    imu = Device("imu", "imu", "rig", turned((0.0, 0.05, -0.1), 0.3, 0.0, 0.0).rounded())
    stand = Rig("rig", "", turned((1.0, 2.0, 1.5), 0.3, -0.7, 0.0).rounded())
    scene = Scene("t", rigs=(stand,), cameras=tuple(cameras), devices=(imu,))
    return place_sensors(scene)


SCENE = rig_scene()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("calibration")
    for name, text in calibration_texts(SCENE, tuple(LENSES)).items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def project_cv(K: Any, D: Any, *, fisheye: bool) -> Any:
    zero = np.zeros(3)
    if fisheye:
        return cv2.fisheye.projectPoints(POINTS_M[:, None], zero, zero, K, D)[0].reshape(-1, 2)
    return cv2.projectPoints(POINTS_M, zero, zero, K, D)[0].reshape(-1, 2)


@pytest.mark.parametrize("name", sorted(LENSES))
def test_opencv_and_ros_project_to_the_same_places(folder: Path, name: str) -> None:
    """Their pixel centres are at integers: half a pixel less."""
    storage = cv2.FileStorage(str(folder / f"opencv/{name}.yml"), cv2.FILE_STORAGE_READ)
    K, D = (storage.getNode(key).mat() for key in ("camera_matrix", "distortion_coefficients"))
    fisheye = storage.getNode("fisheye_model").real() == 1.0
    expected = SCENE.camera(name).intrinsics.project(POINTS_M) - 0.5
    np.testing.assert_allclose(project_cv(K, D, fisheye=fisheye), expected, atol=1e-6)
    size = [storage.getNode(f"image_{side}").real() for side in ("width", "height")]
    assert size == [640, 512]
    # ROS: read by a YAML parser, projected by OpenCV, as image_geometry does.
    info = yaml.safe_load((folder / f"ros/{name}.yaml").read_text())
    K = np.array(info["camera_matrix"]["data"]).reshape(3, 3)
    D = np.array(info["distortion_coefficients"]["data"])
    fisheye = info["distortion_model"] == "equidistant"
    np.testing.assert_allclose(project_cv(K, D, fisheye=fisheye), expected, atol=1e-6)
    lengths = {"plumb_bob": 5, "rational_polynomial": 8, "equidistant": 4}
    assert len(D) == lengths[info["distortion_model"]]
    projection = np.array(info["projection_matrix"]["data"]).reshape(3, 4)
    np.testing.assert_array_equal(projection[:, :3], K)


@pytest.mark.parametrize("name", sorted(LENSES))
def test_files_are_read_back_as_the_same_camera(folder: Path, tmp_path: Path, name: str) -> None:
    """COLMAP has the pixel centres of this project: nothing is subtracted."""
    lens = SCENE.camera(name).intrinsics
    for file in (f"opencv/{name}.yml", f"ros/{name}.yaml"):
        assert_is(read_calibration(folder / file).camera(""), lens)
    (tmp_path / "cameras.txt").write_text(f"4 {colmap_camera(lens)}\n", encoding="utf-8")
    assert f" {lens.cx_px!r} {lens.cy_px!r}" in colmap_camera(lens)
    assert_is(read_calibration(tmp_path / "cameras.txt").camera("4"), lens)


def test_a_chain_of_kalibr_leads_from_camera_to_camera_without_other_lenses(folder: Path) -> None:
    """A point seen by the IMU, the first and the last camera is one point."""
    chain = yaml.safe_load((folder / "kalibr/rig.yaml").read_text())
    point = np.array([0.3, -0.1, 2.5, 1.0])
    names = sorted(LENSES)
    world = SCENE.camera(names[0]).T_world_camera.matrix() @ point
    at = point
    for k, name in enumerate(names):
        if k:
            at = np.array(chain[f"cam{k}"]["T_cn_cnm1"]) @ at
        there = np.linalg.inv(SCENE.camera(name).T_world_camera.matrix()) @ world
        np.testing.assert_allclose(at, there, atol=5e-6)
        from_imu = np.array(chain[f"cam{k}"]["T_cam_imu"])
        imu = np.linalg.inv(SCENE.device("imu").T_world_device.matrix()) @ world
        np.testing.assert_allclose(from_imu @ imu, there, atol=5e-6)
    text = (folder / "kalibr/rig.yaml").read_text()
    chain = yaml.safe_load(text)
    assert "radtan has no k3 to k6" in text
    assert [chain[f"cam{k}"]["distortion_model"] for k in range(4)] == [
        "radtan", "equidistant", "none", "none"
    ]  # fmt: skip


@pytest.mark.parametrize("name", ["bent", "fisheye", "pinhole"])
def test_a_chain_is_read_back_as_the_same_cameras_and_places(folder: Path, name: str) -> None:
    """Places on the rig are as in the scene, relative to the IMU's."""
    calibration = read_calibration(folder / "kalibr/rig.yaml")
    key = f"cam{sorted(LENSES).index(name)}"
    assert_is(calibration.camera(key), SCENE.camera(name).intrinsics)
    T_rig_camera = SCENE.camera(name).T_rig_camera @ RIG_AXES
    expected = SCENE.device("imu").T_rig_device.inverse() @ T_rig_camera
    found = calibration.mount(key, "imu")
    np.testing.assert_allclose(found.matrix(), expected.matrix(), atol=1e-8)


def assert_is(found: Any, lens: Intrinsics) -> None:
    shift = 0.5 if found.pixel_centers == "integers" else 0.0
    assert found.focal_px == (lens.fx_px, lens.fy_px)
    assert found.center_px == pytest.approx((lens.cx_px - shift, lens.cy_px - shift), abs=1e-9)
    assert (found.model, found.coefficients) == (lens.lens.model, lens.lens.coefficients)
    assert found.size_px == (lens.width_px, lens.height_px)


def test_every_photograph_has_its_pose_in_its_model(samples: Any, exported: Any) -> None:
    """COLMAP's poses take the world to the camera; its images are there."""
    folder = exported(CalibrationFiles())
    samples = [s for s in samples if s.scene_index == 0]
    lines = (folder / "colmap/000000/images.txt").read_text().splitlines()[1::2]
    assert len(lines) == sum(len(s.truth) for s in samples)
    first = lines[0].split()
    sample, camera = samples[0], samples[0].scene.camera(first[9].split("/")[0])
    w, x, y, z, *t = (float(v) for v in first[1:8])
    inverse = camera.T_world_camera.inverse()
    assert (w, x, y, z) == pytest.approx(inverse.quaternion_wxyz)
    assert t == pytest.approx(inverse.translation_m)
    assert first[9] == f"{camera.name}/{sample.index:09d}.png"
    assert (folder / "colmap/000000/images" / first[9]).is_file()
    known = (folder / "colmap/000000/cameras.txt").read_text().splitlines()[1:]
    assert [line.split()[0] for line in known] == [str(k + 1) for k in range(len(known))]
    assert int(first[8]) <= len(known)


def test_every_distinct_calibration_has_a_number(world: Any, tmp_path: Path) -> None:
    """Two lenses in turns: two folders, and the table names one for each sample."""
    samples = []
    for k, sample in enumerate(world.samples):
        cameras = tuple(
            replace(c, intrinsics=replace(c.intrinsics, fx_px=500.0 + k % 2))
            for c in sample.scene.cameras
        )
        samples.append(in_scene(sample, cameras=cameras))
    folder = world.export(CalibrationFiles(), world.info(len(samples)), samples, tmp_path)
    rows = (folder / "samples.csv").read_text().splitlines()
    assert rows[0] == "index,split,calibration"
    assert [row.split(",")[2] for row in rows[1:]] == [str(k % 2) for k in range(len(samples))]
    assert sorted(p.name for p in folder.glob("0*")) == ["0000", "0001"]
