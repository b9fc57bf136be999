"""Images of points by OpenCV; principal points and image points have the same coordinates."""

from typing import Any

import cv2
import numpy as np

from gen_data.core.intrinsics import Intrinsics
from gen_data.core.se3 import Array


def project(points_m: Array, K: Array, coefficients: Any, *, fisheye: bool) -> Array:
    """Image points [n, 2] of points [..., 3] in the frame of a camera."""
    module, still = cv2.fisheye if fisheye else cv2, np.zeros(3)
    points = np.reshape(points_m, (-1, 1, 3))
    found, _ = module.projectPoints(points, still, still, K, np.asarray(coefficients))
    return np.asarray(found[:, 0])


def places(camera: Intrinsics, points_m: Array) -> Array:
    """Image points [n, 2] through a pinhole, ``brown_conrady`` or ``kannala_brandt`` lens."""
    lens = camera.lens
    coefficients = lens.coefficients or (0.0,) * 4
    fisheye = lens.model == "kannala_brandt"
    return project(points_m, camera.matrix(), coefficients, fisheye=fisheye)
