"""Noise: the full-well capacity, which sets the photon noise.

Statistic: variance in linear light of the flattest blocks that are bright, where photons make most
of it. Noise is variance as a function of level, a line of slope and intercept at the sensor (Foi et
al., "Practical Poissonian-Gaussian noise modeling and fitting for single-image raw-data", IEEE
Transactions on Image Processing 17, 2008), which the tone curve bends. Variances come from
``Picture.noise_blocks``.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from gen_data.core.colorimetry import srgb_decode
from gen_data.lab.matching.indirect_inference import Axis
from gen_data.lab.matching.picture import Picture
from gen_data.lab.matching.quantities.base import CameraQuantity
from gen_data.sensors.camera.image_pipeline import ImagePipeline
from gen_data.sensors.camera.image_sensor import ImageSensor

BLOCKS_MIN = 40
"""Smallest number of blocks between the grey values."""
FLATTEST = 0.3
"""Share of the blocks that counts: blocks with the smallest gradients after smoothing."""
DARKEST, BRIGHTEST = 40.0, 215.0
"""Grey values between which the tone curve keeps noise, and photons make most of it."""
USUAL_LEVEL = 0.05
"""Linear level at which photon and read noise of usual cameras are equal. Variances are relative to
the sum of both, which makes them almost independent of the levels in a picture."""
LEAST = 2e-8
"""Relative variance added before the logarithm: no noise at all has a value."""


def noise_between(darkest: float, brightest: float) -> Callable[[Picture], float]:
    """The statistic of blocks between two grey values; NaN where they are too few."""

    def measure_noise(picture: Picture) -> float:
        """Logarithm, base 2, of the linear variance in flat blocks over level + 0.05."""
        level, variance, slope = picture.noise_blocks
        usable = (level > darkest) & (level < brightest)
        if usable.sum() < BLOCKS_MIN:
            return float("nan")
        flat = usable & (slope <= np.quantile(slope[usable], FLATTEST))
        encoded = level[flat] / 255.0
        # The slope of sRGB's transfer function turns noise of bytes into noise of light.
        steepness = (srgb_decode(encoded + 1e-3) - srgb_decode(encoded - 1e-3)) / 2e-3
        linear = variance[flat] / 255.0**2 * steepness**2
        return float(np.log2(np.median(linear / (srgb_decode(encoded) + USUAL_LEVEL)) + LEAST))

    return measure_noise


measure = noise_between(DARKEST, BRIGHTEST)


def _start(pipeline: ImagePipeline) -> float:
    sensor = pipeline.image_sensor or ImageSensor()
    return math.log2(sensor.full_well_e)


def _own(pipeline: ImagePipeline) -> float | None:
    return None if pipeline.image_sensor is None else pipeline.image_sensor.full_well_e


def to_electrons(coordinate: float) -> float:
    """Electrons of their logarithm, base 2, to three digits."""
    return float(f"{2.0**coordinate:.3g}")


def _apply(pipeline: ImagePipeline, coordinate: float) -> ImagePipeline:
    sensor = pipeline.image_sensor or ImageSensor()
    changed = sensor.model_copy(update={"full_well_e": 2.0**coordinate})
    return pipeline.model_copy(update={"image_sensor": changed})


def _fields(value: Any) -> Mapping[str, Any]:
    return {"image_sensor.full_well_e": value}


NOISE = CameraQuantity(
    "noise", "electrons", "log2 of linear variance in flat bright blocks",
    "image_pipeline.image_sensor.full_well_e",
    measure, _start, _apply, _fields,
    Axis(math.log2(50.0), math.log2(1e6), step=1.0, plausible=4.0, enough=0.25,
         varies=False, late=True),
    to_value=to_electrons,
    own=_own,
)  # fmt: skip
