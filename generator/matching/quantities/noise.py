"""Noise: the full-well capacity, which sets the photon noise.

Statistic: variance over level, in linear light, of the flattest blocks: the slope of the noise
level function (Foi et al., "Practical Poissonian-Gaussian noise modeling and fitting for
single-image raw-data", IEEE Transactions on Image Processing 17, 2008). Variances are those of
Immerkaer's mask, which is blind to slopes ("Fast noise variance estimation", Computer Vision and
Image Understanding 64, 1996).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np

from gen_data.generator.core.colorimetry import srgb_decode
from gen_data.generator.matching.indirect_inference import Axis
from gen_data.generator.matching.picture import Picture
from gen_data.generator.matching.quantities.base import CameraQuantity
from gen_data.generator.sensors.camera.image_pipeline import ImagePipeline
from gen_data.generator.sensors.camera.image_sensor import ImageSensor

BLOCK_PX = 8
FLATTEST = 0.15
"""Share of the blocks that counts, those with the smallest gradients after smoothing."""
DARKEST, BRIGHTEST = 40.0, 215.0
"""Grey values between which the tone curve keeps noise."""
_MASK = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32) / 6.0
LEAST = 2e-8
"""Variance over level added before the logarithm: no noise at all has a value."""


def measure(picture: Picture) -> float:
    """Logarithm, base 2, of the linear variance over level in flat blocks; NaN without any."""
    grey = picture.grey
    rough = cv2.filter2D(grey, cv2.CV_32F, _MASK)
    smooth = cv2.GaussianBlur(grey, (0, 0), 2.0)
    gradient = cv2.Laplacian(smooth, cv2.CV_32F)
    level, variance, slope = (_block_means(x) for x in (grey, rough * rough, gradient * gradient))
    usable = (level > DARKEST) & (level < BRIGHTEST)
    if usable.sum() < 20:
        return float("nan")
    flat = usable & (slope <= np.quantile(slope[usable], FLATTEST))
    encoded = level[flat] / 255.0
    linear = srgb_decode(encoded)
    # The slope of sRGB's transfer function turns noise of bytes into that of light.
    steepness = (srgb_decode(encoded + 1e-3) - srgb_decode(encoded - 1e-3)) / 2e-3
    ratio = variance[flat] / 255.0**2 * steepness**2 / linear
    return float(np.log2(np.median(ratio) + LEAST))


def _block_means(image: np.ndarray) -> np.ndarray:
    """Means of the blocks of an image [h, w], float64 [blocks]."""
    rows, columns = (side // BLOCK_PX for side in image.shape)
    whole = image[: rows * BLOCK_PX, : columns * BLOCK_PX]
    blocks = cv2.resize(whole, (columns, rows), interpolation=cv2.INTER_AREA)
    return np.asarray(blocks.ravel(), np.float64)


def _start(pipeline: ImagePipeline) -> float:
    sensor = pipeline.image_sensor or ImageSensor()
    return math.log2(sensor.full_well_e)


def to_electrons(coordinate: float) -> float:
    """Full-well capacity of its logarithm, base 2, to three digits."""
    return float(f"{2.0**coordinate:.3g}")


def _apply(pipeline: ImagePipeline, coordinate: float) -> ImagePipeline:
    sensor = pipeline.image_sensor or ImageSensor()
    changed = sensor.model_copy(update={"full_well_e": 2.0**coordinate})
    return pipeline.model_copy(update={"image_sensor": changed})


def _fields(value: Any) -> Mapping[str, Any]:
    return {"image_sensor.full_well_e": value}


NOISE = CameraQuantity(
    "noise", "electrons", "log2 of linear variance over level in flat blocks",
    "image_pipeline.image_sensor.full_well_e",
    measure, _start, _apply, _fields,
    Axis(math.log2(50.0), math.log2(1e6), step=1.0, plausible=4.0, enough=0.25,
         varies=False),
    to_value=to_electrons,
)  # fmt: skip
