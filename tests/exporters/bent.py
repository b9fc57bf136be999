"""The street of ``conftest.py`` through bent lenses, whose rays are OpenCV's."""

from dataclasses import replace
from typing import Any

import cv2
import numpy as np

from gen_data.annotations.annotate import Thresholds
from gen_data.core.capture import Capture, SensorReading
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.scene import Camera, Scene
from tests.exporters import conftest

BROWN = Intrinsics(
    160, 120, 118.0, 117.0, 81.5, 58.7,
    Lens("brown_conrady", (-0.28, 0.09, 0.003, -0.004, -0.012, 0.0, 0.0, 0.0)),
)  # fmt: skip
FISHEYE = Intrinsics(
    160, 120, 95.0, 95.0, 80.0, 60.0, Lens("kannala_brandt", (0.02, -0.01, 0.003, 0.0))
)
LENSES = {"brown_conrady": BROWN, "kannala_brandt": FISHEYE}


def opencv_matrix(k: Intrinsics) -> Any:
    """K with the centres of pixels at whole numbers."""
    return np.array([[k.fx_px, 0, k.cx_px - 0.5], [0, k.fy_px, k.cy_px - 0.5], [0, 0, 1.0]])


def opencv_rays(k: Intrinsics, u: Any, v: Any) -> Any:
    """Directions with z = 1 of OpenCV's image points, [..., 3]."""
    points = np.stack([u, v], -1).reshape(-1, 1, 2).astype(np.float64)
    K, D = opencv_matrix(k), np.array(k.lens.coefficients)
    if k.lens.model == "kannala_brandt":
        plane = cv2.fisheye.undistortPoints(points, K, D)
    else:
        criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 100, 1e-12)
        plane = cv2.undistortPoints(points, K, D, R=np.eye(3), P=np.eye(3), criteria=criteria)
    plane = plane.reshape(*u.shape, 2)
    return np.concatenate([plane, np.ones((*u.shape, 1))], -1)


def opencv_maps(source: Intrinsics, target: Intrinsics) -> Any:
    """OpenCV's maps of a rectification, [2, height, width]."""
    size = (target.width_px, target.height_px)
    module = cv2.fisheye if source.lens.model == "kannala_brandt" else cv2
    return np.stack(
        module.initUndistortRectifyMap(
            opencv_matrix(source),
            np.array(source.lens.coefficients),
            np.eye(3),
            opencv_matrix(target),
            size,
            cv2.CV_32FC1,
        )
    )


def bent_reading(scene: Scene, camera: Camera) -> SensorReading:
    """Labels of a bent camera, whose silhouettes end with the image."""
    k = camera.intrinsics
    u, v = np.meshgrid(np.arange(k.width_px), np.arange(k.height_px))
    return conftest.read_rays(scene, camera, opencv_rays(k, u, v))


def bent_samples(world: Any, model: str, count: int = 2) -> list[Any]:
    """Samples of the street whose only camera has a bent lens; everything is annotated."""
    bent = []
    for sample in world.samples[:count]:
        camera = replace(world.camera(), intrinsics=LENSES[model])
        readings = {"color": bent_reading(sample.scene, camera)}
        scene = replace(sample.scene, cameras=(camera,))
        truth = conftest.annotated(scene, readings, Thresholds())
        capture = Capture(readings, sample.capture.clouds, sample.capture.tables)
        bent.append(replace(sample, scene=scene, capture=capture, truth=truth))
    return bent
