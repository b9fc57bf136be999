"""Calibrations of nerfstudio, ORB-SLAM, camodocal, EuRoC and COLMAP's binary files; other formats.

Expected values are computed by OpenCV from the same numbers, or by hand.
"""

import json
import struct
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from gen_data.assemble.config import parse_config
from gen_data.core.errors import ConfigWarning
from gen_data.core.se3 import Array
from tests.sensors.test_calibration_files import (
    D4,
    D5,
    LENS,
    assert_projects,
    project_cv,
    rig_pose,
    sensor,
    told,
)

BROWN = dict(zip(("k1", "k2", "p1", "p2", "k3"), D5.tolist(), strict=True))
FISHEYE = dict(zip(("k1", "k2", "k3", "k4"), D4.tolist(), strict=True))
FOCAL = {"fx": 812.4, "fy": 811.9, "cx": 318.7, "cy": 259.3}
POSE = np.eye(4)
POSE[:3, :3], POSE[:3, 3] = cv2.Rodrigues(np.array([0.3, -1.2, 0.7]))[0], (0.1, -0.02, 0.05)
RIGHT = np.eye(4)
RIGHT[:3, :3], RIGHT[:3, 3] = cv2.Rodrigues(np.array([0.01, 0.02, -0.03]))[0], (0.11, 0.002, 0.001)


def nerf(model: str, **coefficients: float) -> str:
    """COLMAP's and nerfstudio's pixel centres are at halves: the principal point is 0.5 greater."""
    return json.dumps({
        "camera_model": model, "fl_x": 812.4, "fl_y": 811.9, "cx": 319.2, "cy": 259.8,
        "w": 640, "h": 512, **coefficients, "frames": [{"file_path": "a.png"}],
    }, indent="\t")  # fmt: skip


def slam(prefix: str, lens: str, **coefficients: float) -> str:
    values = {**FOCAL, **coefficients}
    text = "".join(f"{prefix}.{key}: {value}\n" for key, value in values.items())
    size = "Camera.width: 640\nCamera.height: 512\t# [px]\n"
    return f'%YAML:1.0\n\nCamera.type: "{lens}"\n{text}{size}ORBextractor.nLevels: 8\n'


def camodocal(model: str, **groups: dict[str, float]) -> str:
    head = f"%YAML:1.0\n---\nmodel_type: {model}\ncamera_name: c\nimage_width: 640\n"
    return head + f"image_height: 512\n{json.dumps(groups)[1:-1]}\n".replace("}, ", "}\n")


STELLA = (
    f"Camera: {json.dumps({'model': 'perspective', **FOCAL, **BROWN, 'cols': 640, 'rows': 512})}"
)
SHIFTED = dict(zip(("k2", "k3", "k4", "k5"), D4.tolist(), strict=True))
MU = dict(zip(("mu", "mv", "u0", "v0"), FOCAL.values(), strict=True))


@pytest.mark.filterwarnings("ignore:.*not used")
@pytest.mark.parametrize(("name", "content", "D", "fisheye"), [
    ("transforms.json", nerf("OPENCV", **BROWN), D5, False),
    ("transforms.json", nerf("OPENCV_FISHEYE", **FISHEYE, p1=0.1), D4, True),
    # instant-ngp's colmap2nerf states the lens by a flag.
    ("transforms.json", nerf("", **FISHEYE, is_fisheye=True), D4, True),
    ("transforms.json", nerf("", **BROWN, is_fisheye=False), D5, False),
    ("slam.yaml", slam("Camera1", "PinHole", **BROWN), D5, False),
    ("slam.yaml", slam("Camera", "PinHole", **BROWN), D5, False),
    ("slam.yaml", slam("Camera1", "KannalaBrandt8", **FISHEYE), D4, True),
    ("stella.yaml", STELLA.replace('"', ""), D5, False),
    ("vins.yaml", camodocal("PINHOLE", distortion_parameters=BROWN, projection_parameters=FOCAL),
     D5, False),
    ("vins.yaml", camodocal("KANNALA_BRANDT", projection_parameters={**SHIFTED, **MU}), D4, True),
])  # fmt: skip
def test_cameras_whose_numbers_have_names_project_as_opencv_does(
    tmp_path: Path, name: str, content: str, D: Array, fisheye: bool
) -> None:
    found = sensor(tmp_path, LENS, name, content=content)
    assert found.size_px == (640, 512)
    assert_projects(found.nominal_intrinsics(), project_cv(D, fisheye=fisheye))


@pytest.mark.parametrize(("content", "unused"), [
    (nerf("OPENCV_FISHEYE", **FISHEYE, p1=0.1), "p1, frames"),
    (slam("Camera1", "PinHole", **BROWN) + "Camera1.fps: 20\nORBextractor.scale: 1\n",
     "ORBextractor, Camera1.fps"),
])  # fmt: skip
def test_other_entries_of_these_files_are_named(tmp_path: Path, content: str, unused: str) -> None:
    """Groups of settings without any of the camera by the name of their group."""
    with pytest.warns(ConfigWarning, match=f"not used: {unused}$"):
        sensor(tmp_path, LENS, content=content)


def test_a_file_of_nerfstudio_may_have_thousands_of_images(tmp_path: Path) -> None:
    content = json.dumps({**json.loads(nerf("OPENCV", **BROWN)), "frames": 50_001 * [0]})
    with pytest.warns(ConfigWarning, match="not used: frames$"):
        found = sensor(tmp_path, LENS, "transforms.json", content=content)
    assert_projects(found.nominal_intrinsics(), project_cv(D5))


def matrix(name: str, values: Array) -> str:
    rows = f"  rows: 4\n  cols: 4\n  dt: f\n  data: {values.ravel().tolist()}\n"
    return f"{name}: !!opencv-matrix\n{rows}"


PAIR = (
    slam("Camera1", "PinHole")
    + "".join(f"Camera2.{key}: {value}\n" for key, value in FOCAL.items())
    + matrix("IMU.T_b_c1", POSE)
    + matrix("Stereo.T_c1_c2", RIGHT)
)
EUROC = f"""\
sensor_type: camera
T_BS:
  cols: 4
  rows: 4
  data: {POSE.ravel().tolist()}
rate_hz: 20
resolution: [640, 512]
camera_model: pinhole
intrinsics: [812.4, 811.9, 318.7, 259.3] #fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: [-0.21, 0.09, 0.0007, -0.0004]
"""


@pytest.mark.filterwarnings("ignore:.*not used")
@pytest.mark.parametrize(("name", "content", "frame", "pose"), [
    ("slam.yaml", PAIR, "1", POSE),
    ("slam.yaml", PAIR, "2", POSE @ RIGHT),
    ("old.yaml", slam("Camera", "PinHole") + matrix("Tbc", POSE) + matrix("Tlr", RIGHT[:3]),
     "2", POSE @ RIGHT),
    ("vins.yaml", matrix("body_T_cam0", POSE) + matrix("body_T_cam1", RIGHT), "cam1", RIGHT),
    ("sensor.yaml", EUROC, "camera", POSE),
])  # fmt: skip
def test_cameras_of_orb_slam_and_euroc_are_placed_from_the_body(
    tmp_path: Path, name: str, content: str, frame: str, pose: Array
) -> None:
    """``T_b_c1``, ``T_c1_c2`` and ``T_BS`` take points of the camera to the body or camera 1."""
    text = f"rig: r, mounting: {{file: FILE, frame: '{frame}', relative_to: body}}"
    found = sensor(tmp_path, text, name, content=content)
    np.testing.assert_allclose(rig_pose(found), pose, atol=1e-6)


def test_a_sensor_of_euroc_projects_as_opencv_does(tmp_path: Path) -> None:
    with pytest.warns(ConfigWarning, match="a sensor of EuRoC; not used: rate_hz$"):
        found = sensor(tmp_path, LENS, content=EUROC)
    assert found.size_px == (640, 512)
    assert_projects(found.nominal_intrinsics(), project_cv(D5[:4]))


def test_an_imu_of_euroc_is_placed_by_its_sensor_file(tmp_path: Path) -> None:
    content = EUROC.partition("resolution")[0].replace("camera", "imu")
    text = "{type: imu, name: imu, rig: r, mounting: {file: imu.yaml}}"
    (tmp_path / "imu.yaml").write_text(content, encoding="utf-8")
    config = f"template: tabletop\nsensors: [{text}]\n"
    with pytest.warns(ConfigWarning, match="not used: rate_hz$"):
        found: Any = parse_config(config, str(tmp_path / "mine.yaml"), "mine").sensors[0]
    np.testing.assert_allclose(found.T_rig_sensor.matrix(), POSE, atol=1e-6)


def binary(*cameras: tuple[int, int, list[float]], count: int = 0) -> bytes:
    """COLMAP's ``cameras.bin``: number, model, size and parameters, little-endian."""
    parts = [struct.pack("<Q", count or len(cameras))]
    for number, model, values in cameras:
        parts.append(struct.pack(f"<IiQQ{len(values)}d", number, model, 640, 512, *values))
    return b"".join(parts)


@pytest.mark.parametrize(("model", "D", "fisheye"), [(4, D5[:4], False), (5, D4, True)])
def test_binary_cameras_of_colmap_project_as_opencv_does(
    tmp_path: Path, model: int, D: Array, fisheye: bool
) -> None:
    """Models 4 and 5 are OPENCV and OPENCV_FISHEYE, 10 is a thin prism, which has no lens here."""
    values = [812.4, 811.9, 319.2, 259.8, *D]
    data = binary((3, 10, [1.0] * 12), (7, model, values))
    (tmp_path / "cameras.bin").write_bytes(data)
    text = LENS.replace("}", ", camera: '%d'}")
    found = sensor(tmp_path, text % 7, "cameras.bin")
    assert_projects(found.nominal_intrinsics(), project_cv(D, fisheye=fisheye))
    assert "'THIN_PRISM_FISHEYE' has no lens here" in told(tmp_path, text % 3, "cameras.bin")


UNREAD: list[Any] = [
    ("cameras.bin", binary((1, 1, [1.0] * 4), count=2), "is not a cameras.bin of COLMAP (unpack"),
    ("cameras.bin", binary((1, 99, [])), "is not a cameras.bin of COLMAP (the model 99 is not"),
    ("cameras.bin", b"", "is not a cameras.bin of COLMAP (unpack_from requires"),
    ("ost.txt", b"# oST version 5.0 parameters\n\n\n[image]\n\nwidth\n640\n", "give ost.yaml"),
    ("a.ini", b"[image]\n\n# comment\nwidth\n640\n", "is a calibration of ROS as INI, which"),
    ("SN1.conf", b"[LEFT_CAM_HD]\nfx=700.1\n", "is an INI file, as of ZED cameras, which is not"),
    ("results-cam.txt", b"Calibration results\n===\n", ":1:1: expected CAMERA_ID MODEL WIDTH"),
    ("cam_to_pose.txt", b"image_00: 0.03 -0.09 0.99 1.5\n", ":1:1: expected CAMERA_ID MODEL WIDTH"),
    ("a.npz", b"PK\x03\x04\x00", "is an archive of NumPy or Python, which is not read here; write"),
    ("a.mat", b"MATLAB 5.0 MAT-file, Platform", "is a MAT-file, which is not read here; use"),
    ("a.xml", b"<?xml version='1.0'?>\n<calibration><f>1</f></calibration>", "XML of Metashape"),
    ("a.cal", b"ParGroup: Cam1: CameraParameters;\n", "is a file of HALCON, which is not read"),
    ("a.json", b'{"value0": {"T_imu_cam": []}}', "is JSON of Basalt, which is not read here;"),
    ("a.usda", b'#usda 1.0\ndef Camera "c" {}\n', "is an OpenUSD stage, which is not read here"),
    ("a.feather", b"ARROW1\x00\x00", "is a table of Arrow, as of Argoverse, which is not read"),
    ("a.json", b'{"beam_altitude_angles": [1.0]}', "is metadata of an Ouster scanner, which"),
    ("a.yaml", b"%YAML:1.0\n---\nmodel_type: MEI\n", "camodocal without a lens here, which is not"),
    ("a.yaml", b"a: 1\n", "no camera found; expected a camera matrix such as K, camera_matrix or M1"
     ", or R and T of a pair; of other formats, type fx_px, fy_px, cx_px, cy_px as intrinsics"),
    ("a.json", json.dumps({**FOCAL, **BROWN}).encode(), "a.json:1:1: no camera found; expected"),
    ("a.json", nerf("EQUIRECTANGULAR").encode(), "a.json:2:18: camera_model: 'EQUIRECTANGULAR' has "
     "no lens here; expected one of OPENCV, PINHOLE"),
    ("a.json", nerf("OPENCV", k4=0.1).encode(), "a.json:9:8: k4: other than 0 has no lens here"),
    ("a.yaml", slam("Camera", "PinHole").replace("812.4", "-1").encode(),
     "a.yaml:4:12: Camera.fx: focal lengths must be positive, got -1 and 811.9"),
    ("a.yaml", EUROC.replace("0.0, 0.0, 1.0]", "0.0, 0.0, 2.0]").encode(),
     "a.yaml:3:3: T_BS: its last row is 0 0 0 2, expected 0 0 0 1"),
]  # fmt: skip


@pytest.mark.filterwarnings("ignore:.*not used")
@pytest.mark.parametrize(("name", "data", "fact"), UNREAD)
def test_other_files_are_refused_by_the_name_of_their_format_with_a_remedy(
    tmp_path: Path, name: str, data: bytes, fact: str
) -> None:
    (tmp_path / name).write_bytes(data)
    message = told(tmp_path, LENS, name)
    assert message.startswith(name)
    assert fact in message
