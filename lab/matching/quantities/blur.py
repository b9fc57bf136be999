"""Blur: the standard deviation of the point spread function.

Statistic: the blur of sharp edges, from their gradients at two scales (Zhuo and Sim, "Defocus map
estimation from a single image", Pattern Recognition 44, 2011). A step blurred by ``s`` and filtered
with a Gaussian of ``a`` has its peak gradient in proportion to ``1 / sqrt(s^2 + a^2)``: the ratio
at two scales gives ``s``. Blurs add in quadrature: the coordinate is the square.
"""

import math
from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np

from gen_data.config.distributions import Constant
from gen_data.lab.matching.indirect_inference import Axis
from gen_data.lab.matching.picture import Picture
from gen_data.lab.matching.quantities.base import CameraQuantity, typical
from gen_data.sensors.camera.image_pipeline import ImagePipeline

FINE_PX, COARSE_PX = 0.8, 1.6
EDGES = 0.02
"""Share of the pixels, by largest gradients, among which edges lie."""
SHARPEST = 70.0
"""Percentile of sharpness among edges: shadows and round objects are blurred by themselves."""
LEAST_GRADIENT = 2.0
"""Smallest gradient of an edge [grey values per pixel]."""


def measure(picture: Picture) -> float:
    """Squared blur of sharp edges [px^2]; NaN without edges. Sharpened edges may be below 0."""
    fine, coarse = (_gradients(picture, stddev_px) for stddev_px in (FINE_PX, COARSE_PX))
    squares = []
    for axis in (0, 1):
        # Nearly upright or level edges, at the ridge of their gradient.
        across, along = np.abs(coarse[axis]), np.abs(coarse[1 - axis])
        least = max(float(np.quantile(across[::4, ::4], 1.0 - EDGES)), LEAST_GRADIENT)
        ridge = (across >= np.roll(across, 1, axis)) & (across > np.roll(across, -1, axis))
        edge = ridge & (across >= least) & (along < 0.5 * across)
        edge[:4], edge[-4:], edge[:, :4], edge[:, -4:] = False, False, False, False
        ratio2 = np.square(fine[axis][edge] / coarse[axis][edge]).astype(np.float64)
        # A ratio of 1 is an edge without end, one of COARSE / FINE a perfect step.
        ratio2 = np.maximum(ratio2, 1.02)
        squares.append((COARSE_PX**2 - ratio2 * FINE_PX**2) / (ratio2 - 1.0))
    found = np.concatenate(squares)
    return float(np.percentile(found, 100.0 - SHARPEST)) if len(found) > 20 else float("nan")


def _gradients(picture: Picture, stddev_px: float) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives along columns and rows of the picture blurred by a Gaussian."""
    smooth = cv2.GaussianBlur(picture.grey, (0, 0), stddev_px)
    kernel = np.array([-0.5, 0.0, 0.5])
    one = np.ones(1)
    down = cv2.sepFilter2D(smooth, cv2.CV_32F, one, kernel)
    right = cv2.sepFilter2D(smooth, cv2.CV_32F, kernel, one)
    return down, right


def _start(pipeline: ImagePipeline) -> float:
    return max(typical(pipeline.blur_px), 0.4) ** 2


def _apply(pipeline: ImagePipeline, square_px2: float) -> ImagePipeline:
    return pipeline.model_copy(update={"blur_px": Constant(to_px(square_px2))})


def to_px(square_px2: float) -> float:
    """Standard deviation of a variance; 0 below 0."""
    return math.sqrt(max(square_px2, 0.0))


def _fields(value: Any) -> Mapping[str, Any]:
    return {"blur_px": value}


BLUR = CameraQuantity(
    "blur", "px", "squared blur of sharp edges", "image_pipeline.blur_px",
    measure, _start, _apply, _fields,
    Axis(0.0, 64.0, step=0.3, plausible=4.0, enough=0.1),
    to_value=to_px,
    own=lambda pipeline: typical(pipeline.blur_px),
)  # fmt: skip
