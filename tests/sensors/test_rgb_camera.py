"""The RGB camera: what it mounts, what it asks a renderer for."""

import numpy as np
import pytest

from gen_data.core.capture import Channel, SensorReading
from gen_data.core.scene import Camera, Region, Scene
from gen_data.core.streams import Rng, Streams
from gen_data.sensors.camera.rgb_camera import RgbCamera

FOCUS = Region((0.5, -0.2, 0.75), (1.2, 0.8, 0.4))


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


def corners(region: Region) -> np.ndarray:
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return np.asarray(region.center_m) + 0.5 * signs * np.asarray(region.size_m)


@pytest.mark.parametrize("hfov_deg", [30.0, 60.0, 90.0])
def test_the_mounted_camera_has_the_whole_focus_in_view(hfov_deg: float) -> None:
    """All corners of the region lie inside the image, and its centre in the middle."""
    sensor = RgbCamera(name="eye", size_px=(640, 480), hfov_deg=hfov_deg)

    camera = sensor.mount(Scene("t", focus=FOCUS)).camera("eye")

    p_camera = camera.T_world_camera.inverse().apply(corners(FOCUS))
    image = camera.intrinsics.project(p_camera)
    assert ((image > 0) & (image < [640, 480])).all()
    centre = camera.T_world_camera.inverse().apply(np.asarray(FOCUS.center_m))
    np.testing.assert_allclose(camera.intrinsics.project(centre), [320, 240], atol=0.01)


def test_mounting_leaves_a_camera_of_that_name_alone() -> None:
    """A pose that is already in the scene is kept."""
    sensor = RgbCamera(name="eye")
    scene = sensor.mount(Scene("t"))

    assert sensor.mount(scene) is scene


def test_a_capture_renders_its_own_channels_and_those_asked_for() -> None:
    sensor = RgbCamera(name="eye", channels=("rgb", "depth"))
    scene = RgbCamera(name="other").mount(sensor.mount(Scene("t")))
    renderer = Asked()

    reading = sensor.capture(scene, renderer, frozenset({Channel.AMODAL}), rng())

    assert renderer.channels == {Channel.RADIANCE, Channel.Z_DEPTH, Channel.AMODAL}
    assert renderer.camera == scene.camera("eye")
    assert reading.sensor == "eye"
