"""The RGB camera: what it mounts, what it asks a renderer for."""

import numpy as np

from gen_data.core.capture import Channel, SensorReading
from gen_data.core.scene import Camera, Scene
from gen_data.core.streams import Rng, Streams
from gen_data.sensors.camera.rgb_camera import RgbCamera


class Asked:
    """A renderer that remembers what it was asked for."""

    def __init__(self) -> None:
        self.camera: Camera | None = None
        self.channels: frozenset[Channel] = frozenset()

    def render(self, scene: Scene, camera: Camera, channels: frozenset[Channel]) -> SensorReading:
        del scene
        self.camera, self.channels = camera, channels
        shape = (camera.intrinsics.height_px, camera.intrinsics.width_px, 3)
        return SensorReading(camera.name, camera, {Channel.RADIANCE: np.ones(shape, np.float32)})


def rng() -> Rng:
    return Streams(seed=0, scene=0).rng("sensor")


def test_a_mounted_camera_stays_and_renders_its_channels_and_those_asked_for() -> None:
    """A pose that is already in the scene is kept."""
    sensor = RgbCamera(name="eye")
    scene = sensor.mount(Scene("t"))

    assert sensor.mount(scene) is scene

    sensor = RgbCamera(name="eye", channels=("rgb", "depth"))
    scene = RgbCamera(name="other").mount(sensor.mount(Scene("t")))
    renderer = Asked()

    reading = sensor.capture(scene, renderer, frozenset({Channel.AMODAL}), rng())

    assert renderer.channels == {Channel.RADIANCE, Channel.Z_DEPTH, Channel.AMODAL}
    assert renderer.camera == scene.camera("eye")
    assert reading.sensor == "eye"
