"""Calibrations of a user's own cameras, from the files of common tools.

Expected values are computed by OpenCV (``projectPoints``, ``fisheye``) from the numbers in the
files, or by hand.
"""

import json
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from gen_data.assemble.config import load_config, parse_config
from gen_data.assets.library import open_library
from gen_data.core.errors import ConfigError, ConfigWarning
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.kinematics import link_poses
from gen_data.core.se3 import SE3, Array
from gen_data.core.serialization import canonical_json
from gen_data.scene_templates.robot import make_wrist_rig

K = np.array([[812.4, 0.0, 318.7], [0.0, 811.9, 259.3], [0.0, 0.0, 1.0]])
D5 = np.array([-0.21, 0.09, 0.0007, -0.0004, -0.012])
D8 = np.array([-0.21, 0.09, 0.0007, -0.0004, -0.012, 0.01, 0.002, 0.0005])
D4 = np.array([0.0034, 0.0007, -0.002, 0.0002])
THIN = np.concatenate([D8, np.zeros(4)])
POINTS_M = np.array([[x, y, 2.0] for x in (-0.6, 0.0, 0.5) for y in (-0.45, 0.1, 0.4)])
CONFIG = """\
template: tabletop
sensors:
  - {type: rgb_camera, name: eye, %s}
"""


def sensor(folder: Path, text: str, name: str = "camera.yaml", **files: str) -> Any:
    if files.get("content"):
        (folder / name).write_text(files["content"], encoding="utf-8")
    (folder / "mine.yaml").write_text(CONFIG % text.replace("FILE", name), encoding="utf-8")
    return load_config(str(folder / "mine.yaml")).sensors[0]


def told(folder: Path, text: str, name: str = "camera.yaml", **files: str) -> str:
    with pytest.raises(ConfigError) as refused:
        sensor(folder, text, name, **files)
    return str(refused.value).replace(f"{folder}/", "")


def project_cv(D: Array, *, fisheye: bool = False, matrix: Array = K) -> Array:
    """Pixels as OpenCV projects the points: its centres are at integers."""
    zero = np.zeros(3)
    if fisheye:
        points, _ = cv2.fisheye.projectPoints(POINTS_M[:, None], zero, zero, matrix, D)
    else:
        points, _ = cv2.projectPoints(POINTS_M, zero, zero, matrix, D)
    return np.asarray(points.reshape(-1, 2))


def assert_projects(found: Intrinsics, expected_px: Array) -> None:
    """Pixel coordinates are OpenCV's plus a half, to 1e-6 px."""
    np.testing.assert_allclose(found.project(POINTS_M), expected_px + 0.5, atol=1e-6)


def cv_text(ending: str, folder: Path, values: Mapping[str, Any]) -> str:
    """Values in a file, by OpenCV's own writer."""
    path = folder / f"written{ending}"
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for key, value in values.items():
        storage.write(key, value)
    storage.release()
    return path.read_text(encoding="utf-8")


def opencv_text(D: Array, ending: str, folder: Path, **more: Any) -> str:
    values = {"image_width": 640, "image_height": 512, "camera_matrix": K}
    return cv_text(ending, folder, {**values, "distortion_coefficients": D.reshape(-1, 1), **more})


ROS = """\
image_width: 640
image_height: 512
camera_name: left
camera_matrix: {rows: 3, cols: 3, data: [812.4, 0, 318.7, 0, 811.9, 259.3, 0, 0, 1]}
distortion_model: %s
distortion_coefficients: {rows: 1, cols: %d, data: %s}
"""
MESSAGE = """\
header: {stamp: {sec: 0, nanosec: 0}, frame_id: left_optical}
height: 512
width: 640
distortion_model: plumb_bob
d: [-0.21, 0.09, 0.0007, -0.0004, -0.012]
k: [812.4, 0.0, 318.7, 0.0, 811.9, 259.3, 0.0, 0.0, 1.0]
---
"""
KALIBR = """\
cam0:
  camera_model: pinhole
  intrinsics: [812.4, 811.9, 318.7, 259.3]
  distortion_model: radtan
  distortion_coeffs: [-0.21, 0.09, 0.0007, -0.0004]
  resolution: [640, 512]
cam1:
  camera_model: pinhole
  intrinsics: [190.5, 190.9, 254.9, 256.8]
  distortion_model: equidistant
  distortion_coeffs: [0.0034, 0.0007, -0.002, 0.0002]
  resolution: [512, 512]
  T_cn_cnm1:
  - [0.9998, -0.0199986667, 0.0, -0.06]
  - [0.0199986667, 0.9998, 0.0, 0.001]
  - [0.0, 0.0, 1.0, -0.002]
  - [0.0, 0.0, 0.0, 1.0]
"""
LENS = "lens: {model: calibrated, file: FILE}"


# --- numbers in a configuration ---


def test_intrinsics_are_those_of_opencv() -> None:
    """Different focal lengths, and a principal point whose pixel centres are at integers."""
    from gen_data.sensors.camera.rgb_camera import RgbCamera

    given = {"fx_px": 812.4, "fy_px": 811.9, "cx_px": 318.7, "cy_px": 259.3}
    lens = dict(zip(("k1", "k2", "p1", "p2", "k3"), D5, strict=True))
    camera = RgbCamera.model_validate(
        {"intrinsics": given, "lens": {"model": "brown_conrady", **lens}, "size_px": (640, 512)}
    )

    assert_projects(camera.nominal_intrinsics(), project_cv(D5))


@pytest.mark.parametrize(("more", "center"), [
    ("", (320.5, 240.5)),
    (", pixel_centers: halves", (320.0, 240.0)),
    (", size_px: [1280, 960]", (160.25, 120.25)),
    (", size_px: [1280, 1280]", (160.25, 40.25)),
])  # fmt: skip
def test_a_principal_point_is_shifted_scaled_and_cropped(
    tmp_path: Path, more: str, center: tuple[float, float]
) -> None:
    """By hand: half a pixel more; half of it at half the width; 160 rows less above the middle."""
    text = (
        f"size_px: [640, 480], intrinsics: {{fx_px: 500, fy_px: 510, cx_px: 320, cy_px: 240{more}}}"
    )
    found = sensor(tmp_path, text).nominal_intrinsics()

    scale = 0.5 if "size" in more else 1.0
    assert (found.cx_px, found.cy_px) == center
    assert (found.fx_px, found.fy_px) == (500 * scale, 510 * scale)


# --- files ---


@pytest.mark.parametrize("ending", [".yml", ".xml", ".json"])
@pytest.mark.parametrize("D", [D5[:4], D5, D8, THIN], ids=["4", "5", "8", "12, no thin prism"])
def test_a_file_of_opencv_projects_as_opencv_does(tmp_path: Path, ending: str, D: Array) -> None:
    """In all its formats, as it writes them itself; the image has the calibrated size."""
    content = opencv_text(D, ending, tmp_path)
    stated = LENS.replace("}", ", fisheye: false}")
    found = sensor(tmp_path, stated, f"cam{ending}", content=content)

    assert found.size_px == (640, 512)
    assert_projects(found.nominal_intrinsics(), project_cv(D))


def test_four_coefficients_without_a_stated_lens_are_pointed_out(tmp_path: Path) -> None:
    """OpenCV's ``calibrateCamera`` returns at least five, its fisheye module four."""
    content = opencv_text(D4, ".yml", tmp_path)
    with pytest.warns(ConfigWarning, match="four coefficients count as .*; state fisheye: true"):
        found = sensor(tmp_path, LENS, content=content)
    assert_projects(found.nominal_intrinsics(), project_cv(D4))
    stated = LENS.replace("}", ", fisheye: false}")
    assert sensor(tmp_path, stated) == found
    marked = opencv_text(D4, ".yml", tmp_path, fisheye_model=0)
    assert sensor(tmp_path, LENS, content=marked) == found


def test_four_coefficients_of_a_fisheye_are_so_if_stated(tmp_path: Path) -> None:
    """OpenCV's files do not state the model: its sample writes fisheye_model, others nothing."""
    plain = opencv_text(D4, ".yml", tmp_path)
    marked = opencv_text(D4, ".yml", tmp_path, fisheye_model=1)
    by_key = sensor(tmp_path, LENS.replace("}", ", fisheye: true}"), content=plain)
    by_file = sensor(tmp_path, LENS, content=marked)

    assert_projects(by_key.nominal_intrinsics(), project_cv(D4, fisheye=True))
    assert by_file.nominal_intrinsics() == by_key.nominal_intrinsics()


@pytest.mark.parametrize(("D", "fact"), [
    (np.full(12, 0.01), "12:4: distortion: s1 to s4 (thin prism) other than 0 have no lens here"),
    (np.full(14, 0.01), "12:4: distortion: thin prism and tilted sensor other than 0"),
    (np.zeros(6), "15:10: distortion coefficients: expected 0 or 4 or 5 or 8 or 12 or 14"),
])  # fmt: skip
def test_coefficients_without_a_lens_are_refused(tmp_path: Path, D: Array, fact: str) -> None:
    message = told(tmp_path, LENS, content=opencv_text(D, ".yml", tmp_path))
    assert message.startswith(f"camera.yaml:{fact}")


@pytest.mark.parametrize(("name", "content", "D", "fisheye"), [
    ("camera.yaml", ROS % ("plumb_bob", 5, D5.tolist()), D5, False),
    ("camera.yaml", ROS % ("rational_polynomial", 8, D8.tolist()), D8, False),
    ("camera.yaml", ROS % ("equidistant", 4, D4.tolist()), D4, True),
    ("camera.yaml", KALIBR.partition("cam1:")[0], D5[:4], False),
    # COLMAP's pixel centres are at halves: its principal point is OpenCV's plus a half.
    *(("cameras.txt", f"# cameras\n1 {model} 640 512 812.4 811.9 319.2 259.8 {words}\n", D, fisheye)
      for model, words, D, fisheye in (
        ("PINHOLE", "", np.zeros(4), False),
        ("OPENCV", "-0.21 0.09 0.0007 -0.0004", D5[:4], False),
        ("FULL_OPENCV", " ".join(map(str, D8)), D8, False),
        ("OPENCV_FISHEYE", " ".join(map(str, D4)), D4, True),
    )),
])  # fmt: skip
def test_files_of_ros_kalibr_and_colmap_project_as_opencv_does(
    tmp_path: Path, name: str, content: str, D: Array, fisheye: bool
) -> None:
    found = sensor(tmp_path, LENS, name, content=content)
    assert found.size_px == (640, 512)
    assert_projects(found.nominal_intrinsics(), project_cv(D, fisheye=fisheye))


def test_a_printed_message_of_ros_is_read_and_its_header_is_named(tmp_path: Path) -> None:
    with pytest.warns(ConfigWarning, match=r"camera\.yaml: .*; not used: header$"):
        found = sensor(tmp_path, LENS, content=MESSAGE)
    assert_projects(found.nominal_intrinsics(), project_cv(D5))


def test_a_rectified_camera_is_the_pinhole_of_its_projection(tmp_path: Path) -> None:
    """P of a right camera: 600 px, and 0.12 m to the right, ``-600 * 0.12 = -72``."""
    P = "projection_matrix: [600, 0, 310, -72, 0, 600, 250, 0, 0, 0, 1, 0]"
    content = ROS % ("plumb_bob", 5, D5.tolist()) + P
    text = LENS.replace("}", ", rectified: true}, mounting: {file: FILE, rectified: true}")
    with pytest.warns(ConfigWarning, match="not used: camera_matrix"):
        found = sensor(tmp_path, text, content=content)

    expected = Intrinsics(640, 512, 600.0, 600.0, 310.5, 250.5)
    assert found.nominal_intrinsics() == expected
    assert found.offset_m == (0.0, -0.12, 0.0)
    assert (found.yaw_deg, found.pitch_deg, found.roll_deg) == (0.0, 0.0, 0.0)


REGION = """\
binning_x: 2
binning_y: 4
roi: {x_offset: 100, y_offset: 40, height: 200, width: 300, do_rectify: false}
"""


@pytest.mark.parametrize("rectified", [False, True])
def test_binned_images_of_a_region_of_ros_show_points_where_their_blocks_of_pixels_are(
    tmp_path: Path, rectified: bool
) -> None:
    """Matrices and region refer to all pixels; pixel i is made of pixels 2 i and 2 i + 1, or 4."""
    P = "p: [812.4, 0, 318.7, 0, 0, 811.9, 259.3, 0, 0, 0, 1, 0]\n"
    content = MESSAGE.replace("---", P + REGION)
    text = LENS.replace("}", ", rectified: true}") if rectified else LENS
    with pytest.warns(ConfigWarning, match="not used: header, "):
        found = sensor(tmp_path, text, content=content)

    whole = project_cv(np.zeros(5) if rectified else D5)
    # First pixels of blocks: a point in the middle of a block is at its pixel's centre.
    blocks = (whole - (100, 40) + 0.5) / (2, 4) - 0.5
    assert found.size_px == (150, 50)
    assert_projects(found.nominal_intrinsics(), blocks)


def test_a_message_of_ros_with_an_empty_region_and_no_binning_is_of_all_pixels(
    tmp_path: Path,
) -> None:
    content = MESSAGE.replace("---", REGION.replace("2", "0").replace("4", "0").replace("3", "0"))
    content = content.replace("100", "0").replace("binning_x: 0", "binning_x: 1")
    with pytest.warns(ConfigWarning, match="not used: header$"):
        found = sensor(tmp_path, LENS, content=content)
    assert found.size_px == (640, 512)
    assert_projects(found.nominal_intrinsics(), project_cv(D5))


@pytest.mark.parametrize(("size", "fact"), [
    ("", "lens.file: camera.yaml does not state the size of its images; give size_px"),
    ("size_px: [320, 240], ", "the principal point (318.7, 259.3) is far from the middle of 320 x "
     "240 pixels; expected size_px of the calibrated images, which camera.yaml does not state"),
])  # fmt: skip
def test_images_of_unknown_size_are_refused(tmp_path: Path, size: str, fact: str) -> None:
    """Files of nuScenes and KITTI, and many of OpenCV, do not state it."""
    content = "K: [812.4, 0, 318.7, 0, 811.9, 259.3, 0, 0, 1]\n"
    assert fact in told(tmp_path, size + LENS, content=content)
    found = sensor(tmp_path, "size_px: [640, 512], " + LENS, content=content)
    assert_projects(found.nominal_intrinsics(), project_cv(np.zeros(5)))


@pytest.mark.parametrize("size", ["", "size_px: [640, 480], "])
def test_numbers_of_larger_images_than_the_cameras_are_pointed_out(
    tmp_path: Path, size: str
) -> None:
    """A camera without a size has 640 x 480 pixels, which is wrong if the calibration has more."""
    numbers = "intrinsics: {fx_px: 1400, fy_px: 1400, cx_px: 960, cy_px: 540%s}"
    fact = r"mine\.yaml:3:.*sensors\[0\]\.intrinsics: the principal point \(960, 540\) is far from"
    with pytest.warns(ConfigWarning, match=fact):
        sensor(tmp_path, size + numbers % "")
    sensor(tmp_path, size + numbers % ", size_px: [1920, 1440]")
    sensor(tmp_path, "size_px: [1920, 1080], " + numbers % "")


def test_a_height_before_the_width_is_pointed_out(tmp_path: Path) -> None:
    content = "image_size: [512, 640]\nK: [812.4, 0, 318.7, 0, 811.9, 259.3, 0, 0, 1]\n"
    with pytest.warns(ConfigWarning, match=r"\(318\.7, 259\.3\) is far from the middle of 512 x"):
        sensor(tmp_path, LENS, content=content)


def test_cameras_of_a_kalibr_chain_project_as_opencv_does(tmp_path: Path) -> None:
    first = sensor(tmp_path, LENS.replace("}", ", camera: cam0}"), content=KALIBR)
    other = sensor(tmp_path, LENS.replace("}", ", camera: cam1}"), content=KALIBR)

    assert_projects(first.nominal_intrinsics(), project_cv(D5[:4]))
    matrix = np.array([[190.5, 0, 254.9], [0, 190.9, 256.8], [0, 0, 1.0]])
    expected = project_cv(D4, fisheye=True, matrix=matrix)
    assert_projects(other.nominal_intrinsics(), expected)
    assert other.size_px == (512, 512)


@pytest.mark.parametrize(("line", "expected"), [
    ("1 SIMPLE_PINHOLE 640 512 800 320 256", (800.0, 800.0, ())),
    ("1 SIMPLE_RADIAL 640 512 800 320 256 -0.1", (800.0, 800.0, (-0.1, 0, 0, 0, 0, 0, 0, 0))),
    ("7 RADIAL 640 512 800 320 256 -0.1 0.02", (800.0, 800.0, (-0.1, 0.02, 0, 0, 0, 0, 0, 0))),
    ("1 RADIAL_FISHEYE 640 512 800 320 256 0.1 0.02", (800.0, 800.0, (0.1, 0.02, 0, 0))),
    ("1 SIMPLE_FISHEYE 640 512 800 320 256", (800.0, 800.0, (0, 0, 0, 0))),
    ("1 FISHEYE 640 512 800 790 320 256", (800.0, 790.0, (0, 0, 0, 0))),
])  # fmt: skip
def test_simple_models_of_colmap(tmp_path: Path, line: str, expected: Any) -> None:
    found = sensor(tmp_path, LENS, "cameras.txt", content=line).nominal_intrinsics()
    assert (found.fx_px, found.fy_px, found.lens.coefficients) == expected
    assert (found.cx_px, found.cy_px) == (320.0, 256.0)


def test_a_camera_is_used_next_to_one_whose_lens_has_no_counterpart(tmp_path: Path) -> None:
    """The other one is refused when it is asked for; its place on the rig is usable."""
    lines = "1 PINHOLE 640 512 800 790 320 256\n2 FOV 640 512 800 790 320 256 0.9\n"
    text = LENS.replace("}", ", camera: '%s'}")
    found = sensor(tmp_path, text % 1, "cameras.txt", content=lines)
    assert found.nominal_intrinsics() == Intrinsics(640, 512, 800.0, 790.0, 320.0, 256.0)
    message = told(tmp_path, text % 2, "cameras.txt")
    assert message.startswith("cameras.txt:2:1: MODEL: 'FOV' has no lens here")

    chain = KALIBR.replace("pinhole", "ds").replace("[", "[-0.2, 0.6, ", 1)
    place = sensor(tmp_path, "rig: r, mounting: {file: FILE, frame: cam1}", content=chain)
    np.testing.assert_allclose(rig_pose(place), OPTICAL @ np.linalg.inv(T_C1_C0), atol=1e-6)


@pytest.mark.parametrize(
    "matrix",
    [
        "mtx: [[812.4, 0, 318.7], [0, 811.9, 259.3], [0, 0, 1]]",
        "intrinsic_matrix: [812.4, 0, 0, 0, 811.9, 0, 318.7, 259.3, 1]",
    ],
)
@pytest.mark.parametrize("key", ["dist", "dist_coeff", "dist_coefs", "distortion_coeffs"])
def test_names_of_opencvs_examples_and_the_columns_of_open3d_are_read(
    tmp_path: Path, matrix: str, key: str
) -> None:
    """``PinholeCameraIntrinsic`` of Open3D writes ``intrinsic_matrix`` column by column."""
    content = f"{matrix}\n{key}: [{D5.tolist()}]\nwidth: 640\nheight: 512\n"
    found = sensor(tmp_path, LENS, content=content)
    assert_projects(found.nominal_intrinsics(), project_cv(D5))


def test_the_camera_of_a_view_of_open3d_is_read(tmp_path: Path) -> None:
    """``PinholeCameraParameters``, as its viewer saves them."""
    content = json.dumps({
        "class_name": "PinholeCameraParameters", "extrinsic": np.eye(4).ravel().tolist(),
        "intrinsic": {"width": 640, "height": 512, "intrinsic_matrix": K.T.ravel().tolist()},
    })  # fmt: skip
    with pytest.warns(ConfigWarning, match="not used: class_name, extrinsic$"):
        found = sensor(tmp_path, LENS, "view.json", content=content)
    assert_projects(found.nominal_intrinsics(), project_cv(np.zeros(5)))


def test_json_of_opencv_may_have_comments_and_tabs(tmp_path: Path) -> None:
    """OpenCV writes flags of its sample as a comment: ``// flags: +fix_principal_point``."""
    path = tmp_path / "w.json"
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    storage.write("image_size", np.array([[640.0, 512.0]]))
    storage.writeComment("flags: +fix_principal_point", False)
    storage.write("camera_matrix", K)
    storage.write("distortion_coefficients", D5)
    storage.release()
    content = path.read_text(encoding="utf-8")
    assert "// flags" in content
    found = sensor(tmp_path, LENS, "c.json", content=content.replace("    ", "\t"))
    assert_projects(found.nominal_intrinsics(), project_cv(D5))


def test_the_field_of_a_calibrated_fisheye_can_end_before_its_polynomial_folds(
    tmp_path: Path,
) -> None:
    """As of a circular fisheye: corners of the image are black, and need no valid polynomial."""
    D = np.array([0.0034, 0.0007, -0.02, 0.0002])
    content = (ROS % ("equidistant", 4, D.tolist())).replace("812.4", "190").replace("811.9", "190")
    message = told(tmp_path, LENS, content=content)
    (widest,) = re.findall(r"folds over inside the image.* field_deg of at most ([\d.]+)", message)
    sensor(tmp_path, LENS.replace("}", f", field_deg: {widest}}}"), content=content)
    limited = LENS.replace("}", ", field_deg: 150}")
    found = sensor(tmp_path, limited, content=content).nominal_intrinsics()

    matrix = np.array([[190, 0, 318.7], [0, 190, 259.3], [0, 0, 1.0]])
    assert_projects(found, project_cv(D, fisheye=True, matrix=matrix))
    angles = np.radians([74.9, 75.1])
    image = found.project(np.column_stack([np.sin(angles), 0 * angles, np.cos(angles)]))
    assert np.isnan(image[:, 0]).tolist() == [False, True]
    pinhole = COEFFICIENTS.replace(str(D5.tolist()), "[0, 0, 0, 0, 0]")
    assert "lens.field_deg: a lens 'pinhole'" in told(tmp_path, limited, content=pinhole)
    shipped = "size_px: [512, 512], lens: {model: calibrated, camera: tum_vi_cam0, field_deg: 100}"
    lens = sensor(tmp_path, shipped).nominal_intrinsics().lens
    assert lens.half_field_rad == pytest.approx(math.radians(50))


def test_a_calibration_is_scaled_to_the_size_of_the_image(tmp_path: Path) -> None:
    """Half the width: half of all numbers; the middle 240 of 256 rows."""
    content = ROS % ("plumb_bob", 5, D5.tolist())
    found = sensor(tmp_path, "size_px: [320, 240], " + LENS, content=content).nominal_intrinsics()

    assert (found.fx_px, found.fy_px) == (406.2, 405.95)
    assert (found.cx_px, found.cy_px) == pytest.approx((159.6, 259.8 / 2 - 8.0))


def test_a_plan_holds_the_calibration_and_needs_no_file(tmp_path: Path) -> None:
    made_sensor = sensor(tmp_path, LENS, content=ROS % ("plumb_bob", 5, D5.tolist()))
    made = load_config(str(tmp_path / "mine.yaml"))
    (tmp_path / "camera.yaml").unlink()
    plan = canonical_json({"config": made.resolved, "name": "mine"})
    (tmp_path / "plan.json").write_text(plan, encoding="utf-8")

    assert load_config(str(tmp_path)).sensors == made.sensors == (made_sensor,)


def test_a_calibration_replaces_an_inherited_field_of_view(tmp_path: Path) -> None:
    """Of the camera of a shipped configuration."""
    (tmp_path / "camera.yaml").write_text(ROS % ("plumb_bob", 5, D5.tolist()), encoding="utf-8")
    (tmp_path / "mine.yaml").write_text(
        "extends: bin_picking.yaml\nsensors:\n"
        "  - {name: gantry, lens: {model: calibrated, file: camera.yaml}}\n", "utf-8"
    )  # fmt: skip
    found = load_config(str(tmp_path / "mine.yaml")).sensors[0].nominal_intrinsics()  # type: ignore[attr-defined]
    assert found.fx_px == 812.4


# --- places on a rig ---


def rig_pose(found: Any) -> Array:
    """``T_rig_camera`` of a sensor, camera axes, as a matrix."""
    axes = SE3((0.0, 0.0, 0.0), (0.5, -0.5, 0.5, -0.5))
    return np.asarray((found.T_rig_sensor @ axes).matrix())


def mounted(folder: Path, text: str, name: str, content: str) -> Any:
    return sensor(folder, f"rig: r, mounting: {{file: FILE, {text}}}", name, content=content)


OPTICAL = np.array([[0, 0, 1.0, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""``T_body_optical``: columns are right, down and forward in forward, left, up."""
T_C1_C0 = np.array([[0.9998, -0.0199986667, 0, -0.06], [0.0199986667, 0.9998, 0, 0.001],
                    [0, 0, 1, -0.002], [0, 0, 0, 1]])  # fmt: skip


def test_a_kalibr_chain_places_cameras_from_the_first(tmp_path: Path) -> None:
    """``T_cn_cnm1`` is inverted; the rig's axes are the first camera's, turned to X forward."""
    zero = mounted(tmp_path, "frame: cam0", "chain.yaml", KALIBR)
    one = mounted(tmp_path, "frame: cam1", "chain.yaml", KALIBR)

    np.testing.assert_allclose(rig_pose(zero), OPTICAL, atol=1e-9)
    np.testing.assert_allclose(rig_pose(one), OPTICAL @ np.linalg.inv(T_C1_C0), atol=1e-6)


def long_chain(numbers: Any) -> str:
    """Cameras in a row, each 0.1 m to the right of the one before, listed by the alphabet."""
    text = ""
    for name in sorted(f"cam{k}" for k in numbers):
        camera = KALIBR.partition("cam1:")[0].replace("cam0", name)
        shift = "  T_cn_cnm1: [[1, 0, 0, -0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n"
        text += camera + (shift if name != "cam0" else "")
    return text


@pytest.mark.parametrize(("frame", "y_m"), [("cam2", -0.2), ("cam10", -1.0), ("cam11", -1.1)])
def test_cameras_of_a_kalibr_chain_follow_their_numbers(
    tmp_path: Path, frame: str, y_m: float
) -> None:
    """Kalibr's files list ``cam10`` before ``cam2``."""
    content = long_chain(range(12))
    assert content.index("cam10") < content.index("cam2:")
    found = mounted(tmp_path, f"frame: {frame}", "chain.yaml", content)
    assert found.offset_m == pytest.approx((0.0, y_m, 0.0))


IMU = """\
  T_cam_imu:
  - [0.0, -1.0, 0.0, 0.01]
  - [0.0, 0.0, -1.0, 0.02]
  - [1.0, 0.0, 0.0, 0.03]
  - [0.0, 0.0, 0.0, 1.0]
"""


def test_a_kalibr_chain_places_cameras_from_the_imu(tmp_path: Path) -> None:
    """An IMU X forward, Y left, Z up: the camera is 3 cm behind it, 1 cm left, 2 cm up."""
    content = KALIBR.replace("  resolution: [640, 512]\n", "  resolution: [640, 512]\n" + IMU)
    found = mounted(tmp_path, "frame: cam0, relative_to: imu", "chain.yaml", content)

    assert found.offset_m == pytest.approx((-0.03, 0.01, 0.02))
    assert (found.yaw_deg, found.pitch_deg, found.roll_deg) == pytest.approx((0.0, 0.0, 0.0))


def test_a_pair_of_opencv_is_placed_by_r_and_t(tmp_path: Path) -> None:
    """``stereoCalibrate``: points of camera 2 are R times points of 1, plus T; here in mm."""
    R, _ = cv2.Rodrigues(np.array([0.01, -0.02, 0.03]))
    T = np.array([[-60.0], [0.5], [1.5]])
    more = {"M1": K, "D1": D5, "M2": K, "D2": D5, "R": R, "T": T}
    found = mounted(tmp_path, "frame: '2', unit: mm", "pair.yml", cv_text(".yml", tmp_path, more))

    T_2_1 = np.eye(4)
    T_2_1[:3, :3], T_2_1[:3, 3] = R, T[:, 0] / 1000
    np.testing.assert_allclose(rig_pose(found), OPTICAL @ np.linalg.inv(T_2_1), atol=1e-6)

    # OpenCV's sample writes a file of extrinsics, and one of intrinsics.
    alone = cv_text(".yml", tmp_path, {"R": R, "T": T})
    same = mounted(tmp_path, "frame: '2', unit: mm", "extrinsics.yml", alone)
    np.testing.assert_allclose(rig_pose(same), rig_pose(found), atol=1e-12)
    assert "has no cameras; expected a file that has" in told(
        tmp_path, LENS, "extrinsics.yml", content=alone
    )


def test_a_place_that_is_probably_in_millimetres_is_pointed_out(tmp_path: Path) -> None:
    content = f"R: {np.eye(3).tolist()}\nT: [-60.0, 0.5, 1.5]\n"
    with pytest.warns(ConfigWarning, match=r"mounting: '2' is 60\..* m from '1'; .* unit: mm"):
        found = mounted(tmp_path, "frame: '2'", "pair.yml", content)
    assert found.offset_m == (-1.5, -60.0, 0.5)


TF = """\
transforms:
- header: {stamp: {sec: 0, nanosec: 0}, frame_id: base_link}
  child_frame_id: camera_link
  transform: {translation: {x: 1.0, y: 0.2, z: 0.5}, rotation: {x: 0.0, y: 0.0, z: 0.6, w: 0.8}}
- header: {stamp: {sec: 0, nanosec: 0}, frame_id: camera_link}
  child_frame_id: camera_optical_frame
  transform: {translation: {x: 0.0, y: 0.0, z: 0.0}, rotation: {x: -0.5, y: 0.5, z: -0.5, w: 0.5}}
---
"""
URDF = """\
<robot name="r"><link name="base_link"/><link name="camera_link"/><!-- <calibration> -->
<link name="camera_optical_frame"/>
<joint name="a" type="fixed"><parent link="base_link"/><child link="camera_link"/>
<origin xyz="1.0 0.2 0.5" rpy="0.1 0.2 0.3"/></joint>
<joint name="b" type="fixed"><parent link="camera_link"/><child link="camera_optical_frame"/>
<origin xyz="0 0 0" rpy="-1.57079632679 0 -1.57079632679"/></joint></robot>
"""


AUTOWARE = """\
base_link:
  camera_link: {x: 1.0, y: 0.2, z: 0.5, roll: 0.1, pitch: 0.2, yaw: 0.3}
camera_link:
  camera_optical_frame: {x: 0, y: 0, z: 0, roll: -1.57079632679, pitch: 0, yaw: -1.57079632679}
"""


@pytest.mark.parametrize("frame", ["camera_link", "camera_optical_frame"])
@pytest.mark.parametrize(("name", "content", "angles_deg"), [
    ("kit.yaml", AUTOWARE, tuple(np.degrees([0.3, -0.2, 0.1]))),
    ("tf.yaml", TF, (2.0 * math.degrees(math.atan2(0.6, 0.8)), 0.0, 0.0)),
    # Rz(yaw) Ry(pitch) Rx(roll): a positive pitch looks down.
    ("robot.urdf", URDF, tuple(np.degrees([0.3, -0.2, 0.1]))),
])  # fmt: skip
def test_frames_of_ros_and_links_of_a_urdf_are_optical_by_their_names(
    tmp_path: Path, frame: str, name: str, content: str, angles_deg: tuple[float, ...]
) -> None:
    """Either frame places the camera alike."""
    found = mounted(tmp_path, f"frame: {frame}", name, content)

    assert found.offset_m == pytest.approx((1.0, 0.2, 0.5))
    assert (found.yaw_deg, found.pitch_deg, found.roll_deg) == pytest.approx(angles_deg)


def test_transforms_that_ros_prints_one_after_the_other_are_read_together(tmp_path: Path) -> None:
    """``ros2 topic echo /tf_static`` prints the message of each node that publishes some."""
    first, second = TF.partition("- header")[::2]
    one, other = second.split("- header")
    content = f"{first}- header{one}---\n{first}- header{other}"
    found = mounted(tmp_path, "frame: camera_optical_frame", "tf.yaml", content)
    assert found == mounted(tmp_path, "frame: camera_optical_frame", "tf.yaml", TF)
    broken = content.replace("z: -0.5", "z: one")
    text = "rig: r, mounting: {file: FILE, frame: camera_link}"
    assert told(tmp_path, text, "tf.yaml", content=broken).startswith("tf.yaml:9:")


@pytest.mark.parametrize("suffix", ["optical", "optical_frame", "optical_link"])
def test_suffixes_of_optical_frames_of_ros(tmp_path: Path, suffix: str) -> None:
    content = TF.replace("camera_optical_frame", f"camera_{suffix}")
    found = mounted(tmp_path, f"frame: camera_{suffix}", "tf.yaml", content)
    assert (found.pitch_deg, found.roll_deg) == pytest.approx((0.0, 0.0))


def test_axes_can_be_stated_where_a_name_misleads(tmp_path: Path) -> None:
    content = TF.replace("camera_optical_frame", "camera_eye")
    found = mounted(tmp_path, "frame: camera_eye, axes: optical", "tf.yaml", content)
    assert found.pitch_deg == pytest.approx(0.0)
    assert mounted(tmp_path, "frame: camera_eye", "tf.yaml", content).roll_deg == pytest.approx(-90)


def test_a_camera_of_nuscenes_is_placed_on_the_ego_vehicle(tmp_path: Path) -> None:
    """A camera that looks ahead: the rotation takes Z forward to X forward."""
    (tmp_path / "sensor.json").write_text(json.dumps([
        {"token": "s", "channel": "CAM_FRONT", "modality": "camera"},
        {"token": "l", "channel": "LIDAR_TOP", "modality": "lidar"},
    ]), "utf-8")  # fmt: skip
    records = [
        {"token": "a", "sensor_token": "s", "translation": [1.7, 0.016, 1.51],
         "rotation": [0.5, -0.5, 0.5, -0.5],
         "camera_intrinsic": [[1266.4, 0, 816.3], [0, 1266.4, 491.5], [0, 0, 1]]},
        {"token": "b", "sensor_token": "l", "translation": [0.94, 0.0, 1.84],
         "rotation": [math.sqrt(0.5), 0, 0, -math.sqrt(0.5)], "camera_intrinsic": []},
    ]  # fmt: skip
    text = ("size_px: [1600, 900], rig: r,"
            " lens: {model: calibrated, file: FILE, camera: CAM_FRONT},"
            " mounting: {file: FILE, frame: CAM_FRONT}")  # fmt: skip
    (tmp_path / "c.json").write_text(json.dumps(records), "utf-8")
    found = sensor(tmp_path, text, "c.json")

    assert found.offset_m == (1.7, 0.016, 1.51)
    assert (found.yaw_deg, found.pitch_deg, found.roll_deg) == (0.0, 0.0, 0.0)
    assert found.nominal_intrinsics() == Intrinsics(1600, 900, 1266.4, 1266.4, 816.8, 492.0)
    # nuImages: its images are undistorted.
    records[0]["camera_distortion"] = [-0.36, 0.2, 0.001, 0.0001, -0.05]
    with pytest.warns(ConfigWarning, match="of nuScenes; not used: camera_distortion$"):
        scanner = mounted(tmp_path, "frame: LIDAR_TOP", "c.json", json.dumps(records))
    # Its frame has Y ahead: facing -90 degrees, Y is the vehicle's X.
    assert (scanner.yaw_deg, scanner.pitch_deg, scanner.roll_deg) == (0.0, 0.0, 0.0)


OBJECT = """\
P0: 721.5 0 609.5 0 0 721.5 172.8 0 0 0 1 0
P2: 721.5 0 609.5 44.85728 0 721.5 172.8 0.2163791 0 0 1 0.002745884
R0_rect: 1 0 0 0 1 0 0 0 1
Tr_velo_to_cam: 0 -1 0 -0.004 0 0 -1 -0.076 1 0 0 -0.27

"""


@pytest.mark.parametrize(("name", "content"), [
    ("000000.txt", OBJECT),
    ("0000.txt", OBJECT.replace("R0_rect:", "R_rect").replace("velo_to_cam:", "velo_cam")),
    ("calib.txt",
     OBJECT.replace("Tr_velo_to_cam", "Tr").replace("R0_rect: 1 0 0 0 1 0 0 0 1\n", "")),
])  # fmt: skip
def test_a_kitti_calibration_places_from_the_scanner(
    tmp_path: Path, name: str, content: str
) -> None:
    """Points of the scanner through Tr, R0_rect and P2 are where the placed camera sees them.

    Files of the object, tracking and odometry benchmarks; the last one has no R0_rect.
    """
    text = ("size_px: [1242, 375], lens: {model: calibrated, file: FILE, camera: camera_2}, rig: r,"
            " mounting: {file: FILE, frame: camera_2, relative_to: velodyne}")  # fmt: skip
    found = sensor(tmp_path, text, name, content=content)

    points = np.array([[12.0, 1.5, -0.5, 1.0], [30.0, -4.0, 0.2, 1.0]])
    P = np.array([721.5, 0, 609.5, 44.85728, 0, 721.5, 172.8, 0.2163791, 0, 0, 1, 0.002745884])
    Tr = np.array([0, -1, 0, -0.004, 0, 0, -1, -0.076, 1, 0, 0, -0.27, 0, 0, 0, 1.0])
    image = points @ (P.reshape(3, 4) @ Tr.reshape(4, 4)).T
    eye = np.linalg.inv(rig_pose(found)) @ points.T
    np.testing.assert_allclose(
        found.nominal_intrinsics().project(eye[:3].T), image[:, :2] / image[:, 2:] + 0.5, atol=0.01
    )


RAW = """\
S_rect_02: 1.242e+03 3.75e+02
R_rect_00: 9.999239e-01 9.837760e-03 -7.445048e-03 -9.869795e-03 9.999421e-01 -4.278459e-03 \
7.402527e-03 4.351614e-03 9.999631e-01
P_rect_02: 7.215377e+02 0 6.095593e+02 4.485728e+01 0 7.215377e+02 1.728540e+02 2.163791e-01 \
0 0 1 2.745884e-03
"""
VELODYNE = """\
R: 7.533745e-03 -9.999714e-01 -6.166020e-04 1.480249e-02 7.280733e-04 -9.998902e-01 9.998621e-01 \
7.523790e-03 1.480755e-02
T: -4.069766e-03 -7.631618e-02 -2.717806e-01
"""


def test_rectified_cameras_and_the_scanner_of_kittis_raw_data_are_placed_in_one_frame(
    tmp_path: Path,
) -> None:
    """Points of the scanner through ``P_rect_02 R_rect_00 Tr`` are where the camera sees them.

    Two files, as KITTI has them; without R_rect_00, which turns by 0.75 degrees, they miss by 5 px.
    """
    text = ("rig: r, lens: {model: calibrated, file: FILE, camera: camera_2, rectified: true},"
            " mounting: {file: FILE, frame: camera_2, rectified: true}")  # fmt: skip
    eye = sensor(tmp_path, text, "calib_cam_to_cam.txt", content=RAW)
    scanner = mounted(tmp_path, "frame: velodyne", "calib_velo_to_cam.txt", VELODYNE)

    P, rect, R, T = (
        np.array([float(word) for word in line.split()[1:]])
        for line in (*(RAW.splitlines()[k] for k in (2, 1)), *VELODYNE.splitlines())
    )
    points_m = np.array([[12.0, 1.5, -0.5], [30.0, -4.0, 0.2], [8.0, 2.0, -1.5]])
    in_camera_0 = points_m @ R.reshape(3, 3).T + T
    rectified = np.column_stack([in_camera_0 @ rect.reshape(3, 3).T, np.ones(3)])
    expected = rectified @ P.reshape(3, 4).T
    in_rig = scanner.T_rig_sensor.apply(points_m)
    seen = np.linalg.inv(rig_pose(eye)) @ np.column_stack([in_rig, np.ones(3)]).T
    np.testing.assert_allclose(
        eye.nominal_intrinsics().project(seen[:3].T),
        expected[:, :2] / expected[:, 2:] + 0.5,
        atol=0.01,
    )


HAND = """\
<robot name="r">
<link name="base"><visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual></link>
<link name="flange"><visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual></link>
<link name="hand"><visual><geometry><box size="0.1 0.2 0.1"/></geometry></visual></link>
<link name="eye_link"/><link name="eye_optical_frame"/>
<joint name="a" type="revolute"><parent link="base"/><child link="flange"/><axis xyz="0 0 1"/>
<origin xyz="0.1 0.2 0.5" rpy="0.3 0.2 0.1"/><limit lower="-1" upper="1"/></joint>
<joint name="b" type="fixed"><parent link="flange"/><child link="hand"/>
<origin xyz="0 0 0.1" rpy="0 0 0.785"/></joint>
<joint name="c" type="fixed"><parent link="hand"/><child link="eye_link"/>
<origin xyz="0.07 0.02 0.03" rpy="0.1 -1.4 0.2"/></joint>
<joint name="d" type="fixed"><parent link="eye_link"/><child link="eye_optical_frame"/>
<origin xyz="0 0.015 0" rpy="-1.57079632679 0 -1.57079632679"/></joint></robot>
"""


def rpy_matrix(xyz: tuple[float, ...], rpy: tuple[float, ...]) -> Array:
    """Of an origin of URDF: ``Rz(yaw) Ry(pitch) Rx(roll)``."""
    turns = [cv2.Rodrigues(a * np.eye(3)[k])[0] for k, a in enumerate(rpy)]
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turns[2] @ turns[1] @ turns[0], xyz
    return matrix


def test_a_camera_on_a_hand_is_where_the_links_of_its_robot_have_it(tmp_path: Path) -> None:
    """The rig on a wrist has X out of the hand, the link Z: the camera has the URDF's place."""
    (tmp_path / "assets.yaml").write_text(
        "robots: [{id: arm, file: arm.urdf, gripper: {link: hand, finger_joints: [], "
        "grasp_offset_m: 0.1, stroke_m: 0.08}}]\n"
    )
    (tmp_path / "arm.urdf").write_text(HAND)
    robot = open_library([tmp_path], tmp_path / "cache", tmp_path).robot("user/arm")
    rig = make_wrist_rig("arm_wrist", "arm", robot)
    text = "rig: arm_wrist, mounting: {file: FILE, frame: eye_optical_frame, relative_to: hand, %s}"
    with pytest.warns(ConfigWarning, match="joint a"):
        found = sensor(tmp_path, text % "relative_axes: hand", "arm.urdf")

    angle = 0.7
    carrier = link_poses(robot, SE3(), (angle,))[rig.body.partition("/")[2]]
    axes = SE3((0.0, 0.0, 0.0), (0.5, -0.5, 0.5, -0.5))
    eye = carrier @ rig.T_body_rig @ found.T_rig_sensor @ axes
    chain = [
        rpy_matrix((0.1, 0.2, 0.5), (0.3, 0.2, 0.1)),
        rpy_matrix((0, 0, 0), (0, 0, angle)),
        rpy_matrix((0, 0, 0.1), (0, 0, 0.785)),
        rpy_matrix((0.07, 0.02, 0.03), (0.1, -1.4, 0.2)),
        rpy_matrix((0, 0.015, 0), (-math.pi / 2, 0, -math.pi / 2)),
    ]
    np.testing.assert_allclose(eye.matrix(), np.linalg.multi_dot(chain), atol=1e-6)

    with pytest.warns(ConfigWarning, match="joint a"):
        message = told(tmp_path, text.replace(", %s", ""), "arm.urdf")
    assert "mounting.relative_axes: the rig 'arm_wrist' has X out of the hand; state" in message


def test_only_rigs_of_robots_need_the_axes_of_the_hand(tmp_path: Path) -> None:
    """Whatever the names of others: a stand has X ahead, as links have."""
    (tmp_path / "arm.urdf").write_text(HAND)
    config = CONFIG % "rig: %s, mounting: {file: arm.urdf, frame: eye_link, relative_to: hand}"
    stand = config % "pole_wrist" + "elements: [{type: stand, name: pole_wrist}]"
    robot = config % "left_wrist" + "elements: [{type: robot, name: left, on: table}]"
    with pytest.warns(ConfigWarning, match="joint a"):
        found = parse_config(stand, str(tmp_path / "mine.yaml"), "mine").sensors[0]
    assert (found.rig, found.offset_m) == ("pole_wrist", (0.07, 0.02, 0.03))
    refusal = "mounting.relative_axes: the rig 'left_wrist' has X out of the hand"
    with pytest.warns(ConfigWarning, match="joint a"), pytest.raises(ConfigError, match=refusal):
        parse_config(robot, str(tmp_path / "mine.yaml"), "mine")


INTRINSICS = "intrinsics: {fx_px: 500, fy_px: 500, cx_px: 1"
COEFFICIENTS = ROS % ("plumb_bob", 5, D5.tolist())
FIRST, _, _ = KALIBR.partition("cam1:")
UNDISTORTED = "are not 0, but the lens is 'none'"
CONTRADICTIONS = [
    ("hfov_deg: 60, intrinsics: {fx_px: 5, fy_px: 5, cx_px: 320, cy_px: 240}",
     "intrinsics: excludes hfov_deg"),
    (INTRINSICS + "}", "missing key 'cy_px'"),
    ("intrinsics: {fx_px: 0, fy_px: 500, cx_px: 320, cy_px: 240}", "0 is not"),
    (INTRINSICS + ", cy_px: 1, size_px: [640, 400]}", "is taller than the calibrated 640 x 400"),
    ("hfov_deg: 60, lens: {model: calibrated, camera: euroc_cam0}", "leave out hfov_deg"),
    ("lens: {model: calibrated, camera: euroc}", "expected one of euroc_cam0"),
    (LENS, "there is no file 'camera.yaml'"),
    (INTRINSICS + ", cy_px: 1, size_px: [0, 480]}", "intrinsics.size_px[0]: 0 is not >= 1"),
    (INTRINSICS + ", cy_px: 1, size_px: [640, -480]}", "intrinsics.size_px[1]: -480 is not >= 1"),
]  # fmt: skip
LENSES = [
    ("K: [812.4, 0, 0, 0, 811.9, 0, 318.7, 259.3, 1]",
     "camera.yaml:1:4: camera matrix: its third row is 318.7 259.3 1, expected 0 0 1; transpose "
     "it; of MATLAB, subtract 1 from cx and cy too: its first pixel is (1, 1)"),
    ("K: [812.4, 0, 318.7, 0, 811.9, 259.3, 0, 0, 2]", "its third row is 0 0 2, expected 0 0 1"),
    ("K: [812.4, 0, 318.7, 1.5, 811.9, 259.3, 0, 0, 1]", "skew 1.5 has no place in a camera here; "
     "expected 0: calibrate without skew (OpenCV: CALIB_FIX_SKEW)"),
    ("K: [812.4, 0, 318.7, 0, 811.9, 259.3, 0, 0, 1]\nxi: 1.2\nD: [0.1, 0.2, 0, 0]",
     "camera.yaml:2:5: xi: omnidirectional lenses have no lens here"),
    (ROS % ("none", 5, D5.tolist()), UNDISTORTED),
    *((MESSAGE.replace("---", f"roi: {{x_offset: {x}, y_offset: 0, width: {w}, height: {h}}}"),
       f"camera.yaml:7:6: roi: {fact} is not inside the image of 640 x 512 pixels")
      for x, w, h, fact in ((600, 41, 9, "41 x 9 at (600, 0)"), (9, 0, 0, "640 x 512 at (9, 0)"))),
    (MESSAGE.replace("---", "binning_x: 1.5"), "binning_x: expected a whole number"),
    (FIRST.replace("radtan", "none"), UNDISTORTED),
    (FIRST.replace("pinhole", "ds"),
     "camera.yaml:2:17: camera_model: 'ds' has no lens here; expected pinhole, or omni with xi 0"),
    (FIRST.replace("radtan", "fov"),
     "yaml:4:21: distortion_model: 'fov' has no lens here; expected radtan, equidistant or none"),
    (FIRST.replace(", 318.7, 259.3", ""), "yaml:3:15: intrinsics: expected 4 numbers, got 2"),
    (FIRST.replace("811.9", "-811.9"),
     "camera.yaml:3:15: intrinsics: focal lengths must be positive, got 812.4 and -811.9"),
    (FIRST.replace("811.9", "one"), "camera.yaml:3:23: intrinsics: expected a number, got 'one'"),
    ("a: 1\n", "camera.yaml:1:1: no camera found; expected a camera matrix"),
    (ROS % ("thin", 5, D5.tolist()), "'thin' is not a known lens; expected one of plumb_bob"),
    (COEFFICIENTS + "k: [\n", "not valid YAML"),
    (COEFFICIENTS.replace("812.4, 0,", "812.4, 2,"), "skew 2"),
    (COEFFICIENTS.replace("distortion_coefficients", "coefficients"),
     "camera.yaml:1:1: distortion coefficients: has none, but the lens is 'plumb_bob'; expected"),
    (COEFFICIENTS.replace("512", "512.5"),
     "camera.yaml:1:14: image size: expected whole numbers, got 640 x 512.5"),
    (COEFFICIENTS.replace("[-0.21, 0.09, 0.0007, -0.0004, -0.012]", "$base64$MWQg"),
     "distortion coefficients: expected a number, got '$base64$MWQg'; write it without Base64"),
    (KALIBR, "has several cameras: name one; expected one of cam0, cam1"),
]  # fmt: skip
PLACES = [
    ("frame: cam9", "chain.yaml", KALIBR, "has no frame 'cam9'; expected one of cam0, cam1"),
    ("frame: cam1, relative_to: imu", "chain.yaml", KALIBR, "has no frame 'imu'"),
    ("frame: cam1, axes: sideways", "chain.yaml", KALIBR, "expected one of optical, body"),
    ("frame: cam1", "chain.yaml", KALIBR.replace("0.9998", "0.7"), "T_cn_cnm1: is not a rotation"),
    ("frame: cam3", "chain.yaml", long_chain((0, 1, 3)),
     "cam3.T_cn_cnm1: refers to cam2, which the file lacks"),
    ("frame: a", "tf.yaml", TF.replace("w: 0.8", "w: 1.8"), "is not a unit quaternion"),
    ("frame: a", "r.urdf", URDF.replace('rpy="0.1', 'rpy="'), "expected three numbers"),
    ("frame: a", "kit.yaml", AUTOWARE.replace("0.3", "left"), "kit.yaml:2:69: yaw: expected"),
    ("frame: a", "kit.yaml", AUTOWARE + AUTOWARE.partition("\ncamera")[0].replace("base", "other"),
     "kit.yaml:6:16: camera_link: has two parents"),
    ("frame: a", "r.urdf", "<sdf/>", "its root element is <sdf>, not <opencv_storage>; give a file "
     "of OpenCV, or a URDF"),
    ("frame: a", "r.urdf", URDF.replace('rpy="0.1', 'rpy="nan'),
     "r.urdf:3:1: joint 'a': origin: expected three numbers each in xyz and rpy (nan is not a fin"),
    ("frame: a", "r.urdf", URDF.replace('parent link="base_link"', 'parent link="base"'),
     "r.urdf:3:1: joint 'a': there is no link 'base'; expected parent and child"),
    ("frame: a", "r.urdf", URDF.replace('child link="camera_o', 'child link="camera_link" a="o'),
     "r.urdf:5:1: joint 'b': the link 'camera_link' has two parents"),
    ("frame: cam1", "chain.yaml", KALIBR.replace("[0.0, 0.0, 0.0, 1.0]", "[1, 0, 0, 1]"),
     "T_cn_cnm1: its last row is 1 0 0 1, expected 0 0 0 1; is the matrix transposed?"),
    ("frame: velodyne", "calib.txt", OBJECT.replace("-0.27", "nan"),
     "calib.txt:4:1: Tr_velo_to_cam: expected a number, got 'nan'"),
    ("frame: velodyne", "calib.txt", OBJECT.replace("R0_rect: 1 0", "R0_rect: 1 1e308"),
     "calib.txt:3:1: R0_rect: 1e+308 is too large, expected at most 1e+09"),
    ("frame: velodyne", "calib.txt", OBJECT + OBJECT,
     "calib.txt:6:1: P0: is stated twice, first in line 1"),
    ("frame: cam1, rectified: true", "chain.yaml", KALIBR,
     "mounting.rectified: selects nothing in chain.yaml, a camera chain of Kalibr; leave it out"),
]  # fmt: skip
FAULTS = [
    *((text, "camera.yaml", "", fact) for text, fact in CONTRADICTIONS),
    *((LENS, "camera.yaml", content, fact) for content, fact in LENSES),
    *((f"rig: r, mounting: {{file: FILE, {text}}}", *rest) for text, *rest in PLACES),
    (LENS, "cameras.txt", "1 FOV 640 512 800 800 320 256 0.9\n",
     "cameras.txt:1:1: MODEL: 'FOV' has no lens here; expected one of"),
    *((LENS, "cameras.txt", f"1 OPENCV 640 512 800 800 {words} 0 0 0\n",
       f"cameras.txt:1:1: expected numbers after the model ({word} is not a finite number)")
      for words, word in (("nan 256 0.1", "nan"), ("320 256 -inf", "-inf"))),
    (LENS, "a.xml", "<opencv_storage><K>1 2</K>\n <K>1 2</K></opencv_storage>",
     "a.xml:2:2: K: is stated twice"),
    *((LENS, "cameras.txt", f"1 SIMPLE_PINHOLE {words} 320 256\n", f"cameras.txt:1:1: {fact}")
      for words, fact in (("640 512 -800", "PARAMS: focal lengths must be positive, got -800"),
                          ("640 0 800", "the size must be positive, got 640 x 0"))),
    (LENS, "cameras.txt", 2 * "1 PINHOLE 640 512 800 800 320 256\n",
     "cameras.txt:2:1: CAMERA_ID: there are two cameras 1"),
    (LENS.replace("}", ", fisheye: true}"), "camera.yaml", ROS % ("plumb_bob", 4, D4.tolist()),
     "camera.yaml:5:19: distortion_model: is 'plumb_bob', but fisheye: true is stated too"),
    (LENS.replace("}", ", fisheye: true}"), "cameras.txt", "1 PINHOLE 640 512 800 800 320 256\n",
     "lens.fisheye: selects nothing in cameras.txt, cameras of COLMAP; leave it out"),
    (LENS + ", hfov_deg: 60", "camera.yaml", "a: 1",
     "hfov_deg: the file that lens names gives it: leave it out"),
    (LENS.replace("}", ", camera: cam2}"), "camera.yaml", KALIBR,
     "has no camera 'cam2'; expected one of cam0, cam1"),
    ("offset_m: [0, 0, 1], mounting: {file: FILE, frame: cam1}", "camera.yaml", KALIBR,
     "offset_m: the file that mounting names gives it"),
    (LENS.replace("file", "fil"), "camera.yaml", "a: 1\n", "unknown key 'fil'"),
    (LENS.replace("}", ", rectified: true}"), "camera.yaml", COEFFICIENTS,
     "camera.yaml:1:1: no camera found; expected a projection matrix such as P or P1; of other"),
    (LENS.replace("}", ", fishy: 1}"), "camera.yaml", "a: 1\n", "unknown key 'fishy'"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "name", "content", "fact"), FAULTS)
def test_files_and_settings_that_no_camera_here_has_are_refused(
    tmp_path: Path, text: str, name: str, content: str, fact: str
) -> None:
    assert fact in told(tmp_path, text, name, content=content)
