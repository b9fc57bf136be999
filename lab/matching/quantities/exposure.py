"""Exposure: how far pictures are from the camera's metered exposure.

Statistic: the mean logarithm of luminance, which automatic exposure keeps about constant from scene
to scene (Reinhard et al., "Photographic tone reproduction for digital images", 2002).
"""

from collections.abc import Mapping
from typing import Any

from gen_data.config.distributions import Constant
from gen_data.lab.matching.indirect_inference import Axis
from gen_data.lab.matching.picture import Picture
from gen_data.lab.matching.quantities.base import CameraQuantity, typical
from gen_data.sensors.camera.image_pipeline import ImagePipeline


def measure(picture: Picture) -> float:
    """Mean logarithm of luminance [stops below saturation]."""
    return float(picture.log_luminance.mean())


def _start(pipeline: ImagePipeline) -> float:
    return typical(pipeline.exposure_compensation_ev) + typical(pipeline.exposure_error_ev)


def _apply(pipeline: ImagePipeline, ev: float) -> ImagePipeline:
    return pipeline.model_copy(
        update={"exposure_compensation_ev": Constant(ev), "exposure_error_ev": Constant(0.0)}
    )


def _fields(value: Any) -> Mapping[str, Any]:
    return {"exposure_compensation_ev": value, "exposure_error_ev": 0}


EXPOSURE = CameraQuantity(
    "exposure", "EV", "mean log2 of luminance", "image_pipeline.exposure_compensation_ev",
    measure, _start, _apply, _fields,
    Axis(-6.0, 6.0, step=0.25, plausible=3.0, enough=0.1),
)  # fmt: skip
