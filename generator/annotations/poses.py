"""Six-degree-of-freedom poses."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from generator.core.capture import Channel, Reading
from generator.core.sample import ObjectTruth
from generator.core.scene import Scene


@dataclass(frozen=True, slots=True)
class Poses:
    """Pose of the instance frame in the camera frame (X right, Y down, Z forward)."""

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE})

    def annotate(self, scene: Scene, reading: Reading, truth: ObjectTruth) -> ObjectTruth:
        """Fill in ``T_camera_object``."""
        T_camera_world = reading.camera.T_world_camera.inverse()
        return replace(truth, T_camera_object=T_camera_world @ truth.instance.T_world_instance)
