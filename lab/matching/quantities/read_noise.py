"""Read noise: noise of the readout of each pixel, whatever its light.

Statistic: variance in linear light of flat dark blocks, where few photons let read noise be seen:
the intercept of the noise level function, whose slope ``noise`` measures.

Contrast bends that function: an error of 0.1 in contrast is one of a factor of 1.8 in read noise.
So both kinds of noise are ``late``, after contrast, which depends on them little.
"""

import math
from collections.abc import Mapping
from typing import Any

from gen_data.config.distributions import Constant
from gen_data.lab.matching.indirect_inference import Axis
from gen_data.lab.matching.quantities import base, noise
from gen_data.sensors.camera.image_pipeline import ImagePipeline
from gen_data.sensors.camera.image_sensor import ImageSensor

DARKEST, BRIGHTEST = 6.0, 64.0
"""Grey values of dark blocks: below, clipping at black takes half of the noise; up to middle tones,
as most pictures have only few darker blocks."""
LEAST_E = 0.25
"""Smallest read noise to be fitted [electrons]: the noise of the best sensors there are."""

measure = noise.noise_between(DARKEST, BRIGHTEST)


def _start(pipeline: ImagePipeline) -> float:
    own_e = base.typical((pipeline.image_sensor or ImageSensor()).read_noise_e)
    return math.log2(max(own_e, LEAST_E))


def _own(pipeline: ImagePipeline) -> float | None:
    sensor = pipeline.image_sensor
    return None if sensor is None else base.typical(sensor.read_noise_e)


def _apply(pipeline: ImagePipeline, coordinate: float) -> ImagePipeline:
    sensor = pipeline.image_sensor or ImageSensor()
    changed = sensor.model_copy(update={"read_noise_e": Constant(noise.to_electrons(coordinate))})
    return pipeline.model_copy(update={"image_sensor": changed})


def _fields(value: Any) -> Mapping[str, Any]:
    return {"image_sensor.read_noise_e": value}


# Pictures tell the ratio to the full-well capacity: as logarithms, the two have a linear relation.
READ_NOISE = base.CameraQuantity(
    "read noise", "electrons", "log2 of linear variance in flat dark blocks",
    "image_pipeline.image_sensor.read_noise_e",
    measure, _start, _apply, _fields,
    Axis(math.log2(LEAST_E), 8.0, step=0.5, plausible=2.0, enough=0.5, varies=False, late=True),
    to_value=noise.to_electrons,
    own=_own,
)  # fmt: skip
