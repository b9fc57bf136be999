"""The colour wheel of flow, against the published one's corners."""

import colorsys
import math

import numpy as np
import pytest

from gen_data.core.capture import Channel, SensorReading
from gen_data.core.interfaces import DatasetInfo, Modality, SensorInfo
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Camera
from gen_data.core.se3 import IDENTITY
from gen_data.preview.overlay import channel_image
from gen_data.preview.palette import color_flow
from tests.preview.recorded import photograph, recorded


def color_of_flow(u: float, v: float) -> tuple[int, int, int]:
    """The colour of one direction in an image whose longest flow is 10 px."""
    flow = np.zeros((1, 1000, 2), np.float32)
    flow[0, 20:] = (10.0, 0.0)
    flow[0, 0] = (u, v)
    red, green, blue = color_flow(flow)[0, 0].tolist()
    return red, green, blue


def test_what_stands_still_is_white_and_the_saturation_is_the_length() -> None:
    """The middle of the wheel; and flow that is not on it."""
    assert color_of_flow(0.0, 0.0) == (255, 255, 255)
    assert color_of_flow(math.nan, math.nan) == (0, 0, 0)
    assert (color_of_flow(5.0, 0.0), color_of_flow(20.0, 0.0)) == ((255, 127, 127), (191, 0, 0))


@pytest.mark.parametrize(
    ("direction", "hue_deg"),
    # Of the 55 colours from red clockwise, 15 to yellow, 6, 4, 11 to blue, 13 to magenta, 6, these
    # have the numbers 0, 13.5, 27 and 40.5.
    [((10.0, 0.0), 0.0), ((0.0, 10.0), 54.0), ((-10.0, 0.0), 190.9), ((0.0, -10.0), 260.8)],
)
def test_the_hue_is_the_direction(direction: tuple[float, float], hue_deg: float) -> None:
    """Red to the right, yellow downwards, blue to the left, violet upwards."""
    red, green, blue = color_of_flow(*direction)
    hue, saturation, value = colorsys.rgb_to_hsv(red / 255, green / 255, blue / 255)
    assert 360.0 * hue == pytest.approx(hue_deg, abs=1.0)
    assert saturation > 0.99
    assert value > 0.99


@pytest.mark.parametrize(
    ("channel", "depth"),
    [(Channel.FLOW_BACKWARD, 2), (Channel.SCENE_FLOW, 3), (Channel.FLOW_OCCLUDED_FORWARD, 0)],
)
def test_every_channel_of_flow_can_be_looked_at(channel: Channel, depth: int) -> None:
    shape = (4, 6, depth) if depth else (4, 6)
    data = np.ones(shape, np.float32 if depth else np.uint8)
    camera = Camera("c", IDENTITY, Intrinsics(6, 4, 5.0, 5.0, 3.0, 2.0))
    image = channel_image(SensorReading("c", camera, {channel: data}), channel)
    assert (image.shape, image.dtype) == ((4, 6, 3), np.uint8)
    assert image.max() == 255


def test_a_recording_has_flow_beside_the_image_of_its_camera() -> None:
    """As a picture in a tab; a camera without flow has no tabs."""
    camera = Camera("c", IDENTITY, Intrinsics(6, 4, 5.0, 5.0, 3.0, 2.0))
    taken = photograph({Channel.FLOW_FORWARD: np.ones((4, 6, 2), np.float32)}, camera)
    sensor = SensorInfo("c", Modality.CAMERA, channels=(Channel.RGB, Channel.FLOW_FORWARD))
    stream = recorded(taken, info=DatasetInfo("t", 1, 1, 1, (), (sensor,)))
    assert stream.at("channels/c/flow_forward")
    (blueprint,) = stream.blueprints
    (tabs,) = blueprint.root_container.contents[1].contents
    assert [view.origin for view in tabs.contents] == [
        "world/cameras/c/image",
        "channels/c/flow_forward",
    ]
