"""Tone: contrast, the power of the tone curve about middle grey.

Statistic: the distance of the 10th and 90th percentiles of logarithmic luminance, which a power
multiplies.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from gen_data.config.distributions import Constant
from gen_data.lab.matching.indirect_inference import Axis
from gen_data.lab.matching.picture import Picture
from gen_data.lab.matching.quantities.base import CameraQuantity, typical
from gen_data.sensors.camera.image_pipeline import CONTRASTS, ImagePipeline


def measure(picture: Picture) -> float:
    """Stops between the 10th and the 90th percentile of luminance."""
    low, high = np.percentile(picture.log_luminance, [10.0, 90.0])
    return float(high - low)


def _start(pipeline: ImagePipeline) -> float:
    return typical(pipeline.contrast)


def _apply(pipeline: ImagePipeline, contrast: float) -> ImagePipeline:
    return pipeline.model_copy(update={"contrast": Constant(contrast)})


def _fields(value: Any) -> Mapping[str, Any]:
    return {"contrast": value}


CONTRAST = CameraQuantity(
    "tone", "power", "stops between 10 % and 90 % of luminance", "image_pipeline.contrast",
    measure, _start, _apply, _fields,
    Axis(0.5, 3.0, step=0.1875, plausible=0.6, enough=0.1, grid=1.0 / CONTRASTS),
)  # fmt: skip
