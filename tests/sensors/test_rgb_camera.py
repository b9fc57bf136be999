"""The RGB camera: its mounting, and its requests to a renderer."""

import pytest

from gen_data.core.capture import Channel
from gen_data.core.scene import Scene
from gen_data.core.serialization import from_plain, to_plain
from gen_data.core.streams import Rng, Streams
from gen_data.sensors.camera.rgb_camera import RgbCamera
from gen_data.sensors.depth.depth_camera import DepthCamera
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


@pytest.mark.parametrize("kind", [RgbCamera, DepthCamera])
def test_a_camera_states_its_layers_where_it_writes_any(
    kind: type[RgbCamera] | type[DepthCamera],
) -> None:
    """Scenes of other cameras stay as they are, also in files."""
    plain = kind(name="eye").mount(Scene("t"))
    assert plain.camera("eye").layers == 0
    assert "layers" not in to_plain(plain)["cameras"][0]

    usual = kind(name="eye", channels=("depth_layers",))
    more = kind(name="eye", channels=("instance_layers",), layers=7)
    assert usual.mount(Scene("t")).camera("eye").layers == 4
    # Also at a camera that is already in the scene.
    assert more.mount(plain).camera("eye").layers == 7
    assert from_plain(Scene, to_plain(more.mount(plain))).camera("eye").layers == 7
