"""Annotation: distance from the camera to every object."""

from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np

from gen_data.config.base_model import Strict
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.interfaces import Annotator
from gen_data.core.sample import ObjectTruth
from gen_data.core.scene import Scene


class Distance(Strict):
    """Distance from the camera to the origin of each object, in ``extra``."""

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE})
    type: Literal["stranger_distance"] = "stranger_distance"

    def annotate(self, scene: Scene, reading: SensorReading, truth: ObjectTruth) -> ObjectTruth:
        """Fill in ``extra["stranger_distance"]`` [m]."""
        eye_m = np.array(reading.camera.T_world_camera.translation_m)
        origin_m = np.array(truth.instance.T_world_instance.translation_m)
        distance_m = round(float(np.linalg.norm(origin_m - eye_m)), 6)
        return replace(truth, extra={**truth.extra, self.type: distance_m})


PLUGIN: type[Annotator] = Distance
