"""Cameras of a user's own calibration show points where OpenCV projects them.

The points come from the label images; they are projected by OpenCV alone, with the numbers in the
file of Kalibr, and must be back at the centres of their pixels.
"""

from pathlib import Path
from typing import Any

import cv2
import numpy as np

import gen_data
from gen_data.core.capture import Channel
from gen_data.core.se3 import Array
from tests import opencv

K0 = np.array([[203.1, 0.0, 79.4], [0.0, 202.7, 64.8], [0.0, 0.0, 1.0]])
K1 = np.array([[201.3, 0.0, 81.7], [0.0, 202.2, 62.1], [0.0, 0.0, 1.0]])
D0 = np.array([-0.21, 0.09, 0.0007, -0.0004])
D1 = np.array([0.02, -0.01, 0.004, -0.001])
R10, _ = cv2.Rodrigues(np.array([0.004, -0.02, 0.007]))
T10 = np.array([-0.0598, 0.0004, -0.0007])

CONFIG = """\
template: bin_picking
elements: {pair: {type: stand}}
randomizers:
  - {type: objects, name: parts, count: 12}
  - {type: camera_pose, name: orbit, rig: pair, distance_m: {uniform: [0.7, 0.9]}}
sensors:
  - {type: rgb_camera, name: left, rig: pair, lens: {model: calibrated, file: chain.yaml, camera: cam0}, mounting: {file: chain.yaml, frame: cam0}, channels: [object_coordinates, instance]}
  - {type: rgb_camera, name: right, rig: pair, lens: {model: calibrated, file: chain.yaml, camera: cam1}, mounting: {file: chain.yaml, frame: cam1}, channels: [object_coordinates, instance]}
annotations: [boxes3d, poses, visibility]
"""  # noqa: E501


def chain_text() -> str:
    """Kalibr's camera chain: a Brown-Conrady camera, and a fisheye to its right."""
    rows = np.vstack([np.column_stack([R10, T10]), [0, 0, 0, 1]]).tolist()
    text = ""
    for name, K, model, D in (("cam0", K0, "radtan", D0), ("cam1", K1, "equidistant", D1)):
        numbers = [K[0, 0], K[1, 1], K[0, 2], K[1, 2]]
        text += (
            f"{name}:\n  camera_model: pinhole\n  intrinsics: {[float(v) for v in numbers]}\n"
            f"  distortion_model: {model}\n  distortion_coeffs: {D.tolist()}\n"
            "  resolution: [160, 128]\n"
        )
    return text + f"  T_cn_cnm1: {rows}\n"


def seen_points_m(sample: Any, camera: str) -> tuple[Array, Array]:
    """Pixels (column, row) that show objects, and the points there in the world [m]."""
    images = sample.core.capture.readings[camera].channels
    scene = sample.core.scene
    pixels, points = [], []
    for instance in scene.instances:
        rows, columns = np.nonzero(images[Channel.INSTANCE] == instance.instance_id)
        if not len(rows) or not instance.annotated:
            continue
        share = images[Channel.OBJECT_COORDINATES][rows, columns].astype(float)
        low, high = np.array(instance.box_min_m), np.array(instance.box_max_m)
        points.append(instance.T_world_instance.apply(low + share * (high - low)))
        pixels.append(np.column_stack([columns, rows]))
    return np.concatenate(pixels), np.concatenate(points)


def test_labels_of_a_calibrated_pair_are_where_opencv_projects_them(tmp_path: Path) -> None:
    """To a hundredth of a pixel, in both cameras; the right one by R and t of the file."""
    (tmp_path / "chain.yaml").write_text(chain_text(), encoding="utf-8")
    (tmp_path / "pair.yaml").write_text(CONFIG, encoding="utf-8")
    sample = gen_data.Dataset(str(tmp_path / "pair.yaml"))[0]
    T_left_world = sample.core.scene.camera("left").T_world_camera.inverse()

    pixels, points_m = seen_points_m(sample, "left")
    image = opencv.project(T_left_world.apply(points_m), K0, D0, fisheye=False)
    assert len(pixels) > 300
    np.testing.assert_allclose(image, pixels, atol=0.01)

    pixels, points_m = seen_points_m(sample, "right")
    there_m = T_left_world.apply(points_m) @ R10.T + T10
    image = opencv.project(there_m, K1, D1, fisheye=True)
    assert len(pixels) > 300
    np.testing.assert_allclose(image, pixels, atol=0.01)
