"""Six-degree-of-freedom poses of objects."""

from dataclasses import replace
from typing import ClassVar, Literal

from gen_data.config.base_model import Strict
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.sample import ObjectTruth
from gen_data.core.scene import Scene


class Poses(Strict):
    """Pose of the instance frame in the camera frame (X right, Y down, Z forward)."""

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE})
    type: Literal["poses"] = "poses"

    def annotate(self, scene: Scene, reading: SensorReading, truth: ObjectTruth) -> ObjectTruth:
        """Fill in ``T_camera_object``."""
        T_camera_world = reading.camera.T_world_camera.inverse()
        return replace(truth, T_camera_object=T_camera_world @ truth.instance.T_world_instance)
