"""Photographs by the image pipeline alone, without a renderer."""

import json
from typing import Any

import numpy as np

from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Camera, Weather
from gen_data.core.se3 import SE3
from gen_data.core.streams import Rng, Streams
from gen_data.sensors.camera.image_pipeline import ImagePipeline, Photograph, develop, take_shot

LENS = Intrinsics(64, 48, 60.0, 60.0, 32.0, 24.0)
EYE = Camera("eye", SE3(), LENS, ev100=8.0)
IDEAL, FAIR = ImagePipeline(), Weather()
WHITE_CD_M2 = 1.2 * 2.0**8
"""Luminance that ``EYE`` shows as white."""


def rng(name: str = "test") -> Rng:
    return Streams(seed=5, scene=0).rng(name)


def made(**values: Any) -> ImagePipeline:
    """A pipeline as configurations state it."""
    return ImagePipeline.model_validate_json(json.dumps(values))


def photo(
    radiance: Any,
    pipeline: ImagePipeline = IDEAL,
    camera: Camera = EYE,
    *,
    depth_m: Any = None,
    weather: Weather = FAIR,
    stream: Rng | None = None,
) -> Photograph:
    """The photograph of a radiance [cd/m^2, h, w, 3]."""
    image = np.asarray(radiance, np.float32)
    return develop(take_shot(image, depth_m, camera, weather, pipeline, stream or rng()))
