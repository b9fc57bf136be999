"""A renderer that remembers the channels it was asked for."""

from typing import Any

import numpy as np

from gen_data.core.capture import Channel, SensorReading
from gen_data.core.scene import Camera, Scene


class Recorder:
    """Gives one radiance [cd/m^2] and 2 in all other channels."""

    def __init__(self, radiance: Any = 50.0) -> None:
        self.radiance = radiance
        self.camera: Camera | None = None
        self.asked: frozenset[Channel] = frozenset()

    def render(self, scene: Scene, camera: Camera, channels: frozenset[Channel]) -> SensorReading:
        self.camera, self.asked = camera, channels
        shape = (camera.intrinsics.height_px, camera.intrinsics.width_px)
        images = {channel: np.full(shape, 2.0, np.float32) for channel in channels}
        if Channel.RADIANCE in channels:
            light = np.broadcast_to(np.asarray(self.radiance, np.float32), (*shape, 3))
            images[Channel.RADIANCE] = light.copy()
        return SensorReading(camera.name, camera, images, ev100=8.0)

    def scan(self, *_: Any) -> Any:
        raise NotImplementedError
