"""Colour: saturation.

Statistic: mean distance of colours from grey of their luminance, over mean luminance, after a
scaling of the channels to equal means: the tint of the light is the white balance's matter.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from gen_data.config.distributions import Constant
from gen_data.core.colorimetry import luminance
from gen_data.lab.matching.indirect_inference import Axis
from gen_data.lab.matching.picture import FLOOR, Picture
from gen_data.lab.matching.quantities.base import CameraQuantity, typical
from gen_data.sensors.camera.image_pipeline import ImagePipeline


def measure(picture: Picture) -> float:
    """Logarithm, base 2, of mean colourfulness over mean luminance; NaN without usable pixels."""
    colors = picture.colors
    if not len(colors):
        return float("nan")
    means = colors.mean(axis=0, dtype=np.float64) + FLOOR
    colors = colors * (means.mean() / means).astype(np.float32)
    level = luminance(colors)
    red, _, blue = colors.T
    chroma = np.hypot(red - level, blue - level)
    return float(np.log2((chroma.mean() + FLOOR) / (level.mean() + FLOOR)))


def _start(pipeline: ImagePipeline) -> float:
    return typical(pipeline.saturation)


def _apply(pipeline: ImagePipeline, factor: float) -> ImagePipeline:
    return pipeline.model_copy(update={"saturation": Constant(factor)})


def _fields(value: Any) -> Mapping[str, Any]:
    return {"saturation": value}


SATURATION = CameraQuantity(
    "saturation", "factor", "log2 of distance from grey", "image_pipeline.saturation",
    measure, _start, _apply, _fields,
    Axis(0.1, 2.5, step=0.15, plausible=0.5, enough=0.05),
)  # fmt: skip
