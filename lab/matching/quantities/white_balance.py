"""White balance: its error between red and blue.

Statistic: mean red over mean blue, in linear light, of pixels that are not clipped (grey world;
Buchsbaum, "A spatial processor model for object colour perception", 1980).
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from gen_data.config.distributions import Constant
from gen_data.lab.matching.indirect_inference import Axis
from gen_data.lab.matching.picture import FLOOR, Picture
from gen_data.lab.matching.quantities.base import CameraQuantity, typical
from gen_data.sensors.camera.image_pipeline import ImagePipeline


def measure(picture: Picture) -> float:
    """Mean red over mean blue [stops]; NaN if all pixels are black or clipped."""
    if not len(picture.colors):
        return float("nan")
    red, _, blue = picture.colors.mean(axis=0, dtype=np.float64)
    return float(np.log2((red + FLOOR) / (blue + FLOOR)))


def _start(pipeline: ImagePipeline) -> float:
    return typical(pipeline.warmth_ev)


def _apply(pipeline: ImagePipeline, ev: float) -> ImagePipeline:
    return pipeline.model_copy(update={"warmth_ev": Constant(ev)})


def _fields(value: Any) -> Mapping[str, Any]:
    return {"warmth_ev": value}


WHITE_BALANCE = CameraQuantity(
    "white balance", "EV", "log2 of mean red over mean blue", "image_pipeline.warmth_ev",
    measure, _start, _apply, _fields,
    Axis(-2.5, 2.5, step=0.2, plausible=1.0, enough=0.1),
)  # fmt: skip
