"""The RGB camera: what it mounts, what it asks a renderer for."""

from gen_data.core.capture import Channel
from gen_data.core.scene import Scene
from gen_data.core.streams import Rng, Streams
from gen_data.sensors.camera.rgb_camera import RgbCamera
from tests.sensors.recorder import Recorder


def rng() -> Rng:
    return Streams(seed=0, scene=0).rng("sensor")


def test_a_mounted_camera_stays_and_renders_its_channels_and_those_asked_for() -> None:
    """A pose that is already in the scene is kept."""
    sensor = RgbCamera(name="eye")
    scene = sensor.mount(Scene("t"))

    assert sensor.mount(scene) is scene

    sensor = RgbCamera(name="eye", channels=("rgb", "depth"))
    scene = RgbCamera(name="other").mount(sensor.mount(Scene("t")))
    renderer = Recorder()

    reading = sensor.capture(scene, renderer, frozenset({Channel.AMODAL}), rng())

    assert renderer.asked == {Channel.RADIANCE, Channel.Z_DEPTH, Channel.AMODAL}
    assert renderer.camera == scene.camera("eye")
    assert reading.sensor == "eye"
