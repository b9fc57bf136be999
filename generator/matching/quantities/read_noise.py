"""Read noise: what the readout of each pixel adds, whatever its light.

Statistic: variance in linear light of flat blocks in the dark, where few photons let read noise be
seen: the intercept of the noise level function, whose slope is that of ``noise``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gen_data.generator.config.distributions import Constant
from gen_data.generator.matching.indirect_inference import Axis
from gen_data.generator.matching.picture import Picture
from gen_data.generator.matching.quantities.base import CameraQuantity, typical
from gen_data.generator.matching.quantities.noise import measure_flat_blocks
from gen_data.generator.sensors.camera.image_pipeline import ImagePipeline
from gen_data.generator.sensors.camera.image_sensor import ImageSensor

DARKEST, BRIGHTEST = 6.0, 64.0
"""Grey values of dark blocks: below, clipping at black takes half of the noise; up to middle tones,
as most pictures have only few darker blocks."""
LEAST = 1e-10
"""Variance added before the logarithm: no noise at all has a value."""
LEAST_E = 0.25
"""Smallest read noise to be fitted [electrons]: that of the best sensors there are."""


def measure(picture: Picture) -> float:
    """Logarithm, base 2, of the linear variance in flat dark blocks; NaN without any."""
    found = measure_flat_blocks(picture, DARKEST, BRIGHTEST)
    return float("nan") if found is None else float(np.log2(np.median(found[1]) + LEAST))


def _start(pipeline: ImagePipeline) -> float:
    own_e = typical((pipeline.image_sensor or ImageSensor()).read_noise_e)
    return math.log2(max(own_e, LEAST_E))


def _apply(pipeline: ImagePipeline, coordinate: float) -> ImagePipeline:
    sensor = pipeline.image_sensor or ImageSensor()
    changed = sensor.model_copy(update={"read_noise_e": Constant(to_electrons(coordinate))})
    return pipeline.model_copy(update={"image_sensor": changed})


def to_electrons(coordinate: float) -> float:
    """Standard deviation of its logarithm, base 2, to three digits."""
    return float(f"{2.0**coordinate:.3g}")


def _fields(value: Any) -> Mapping[str, Any]:
    return {"image_sensor.read_noise_e": value}


# Pictures tell the ratio to the full-well capacity: as logarithms, the two have a linear relation.
READ_NOISE = CameraQuantity(
    "read noise", "electrons", "log2 of linear variance in flat dark blocks",
    "image_pipeline.image_sensor.read_noise_e",
    measure, _start, _apply, _fields,
    Axis(math.log2(LEAST_E), 8.0, step=0.5, plausible=2.0, enough=0.5, varies=False),
    to_value=to_electrons,
)  # fmt: skip
