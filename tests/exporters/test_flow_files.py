"""Flow in files, read back as the KITTI development kit reads it: by OpenCV, 16 bits a colour."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.core.capture import Channel
from gen_data.core.shutter import Shutter
from gen_data.exporters.coco import Coco
from gen_data.exporters.image_files import encode_channel

H, W = 7, 9


def read(data: bytes) -> NDArray[np.uint16]:
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    return image[..., ::-1] if image.ndim == 3 else image


@pytest.mark.parametrize("channel", [Channel.FLOW_FORWARD, Channel.FLOW_BACKWARD])
def test_flow_is_kittis(channel: Channel) -> None:
    """U and v are (value - 2^15) / 64, the third states whether there is any."""
    flow = np.random.default_rng(1).uniform(-500.0, 500.0, (H, W, 2)).astype(np.float32)
    flow[2, 3] = np.nan
    flow[4, 5] = (3.0, np.nan)
    values = read(encode_channel(channel, flow, 0.001)).astype(np.float64)
    known = values[..., 2] == 1
    assert np.array_equal(~known, np.isnan(flow).any(axis=-1))
    back = (values[..., :2] - 32768.0) / 64.0
    assert np.abs(back - flow)[known].max() <= 0.5 / 64.0
    assert (values[~known] == 0).all()


@pytest.mark.parametrize("beyond_px", [512.0, -512.0, 1e6, np.inf])
def test_flow_beyond_what_the_file_can_hold_is_none(beyond_px: float) -> None:
    """A point that stands still is valid, and 2^15 in both coordinates."""
    flow = np.zeros((H, W, 2), np.float32)
    flow[1, 1, 0] = beyond_px
    expected = np.tile([32768, 32768, 1], (H, W, 1))
    expected[1, 1] = 0
    assert np.array_equal(read(encode_channel(Channel.FLOW_FORWARD, flow, 0.001)), expected)


def test_scene_flow_is_in_units_of_depth_and_occlusion_is_white() -> None:
    """Signed, from 2^15; nothing is 0 in all three."""
    flow = np.random.default_rng(2).uniform(-30.0, 30.0, (H, W, 3)).astype(np.float32)
    flow[0, 0] = np.nan
    flow[0, 1, 2] = 33.0
    values = read(encode_channel(Channel.SCENE_FLOW, flow, 0.001)).astype(np.float64)
    assert (values[0, 0] == 0).all()
    assert (values[0, 1] == 0).all()
    assert np.abs((values[1:] - 32768.0) * 0.001 - flow[1:]).max() <= 0.0005 + 1e-6
    # 255 where a point cannot be seen, 0 where it can.
    hidden = (np.arange(H * W).reshape(H, W) % 2).astype(np.uint8)
    values = read(encode_channel(Channel.FLOW_OCCLUDED_BACKWARD, hidden, 0.001))
    assert values.dtype == np.uint8
    assert np.array_equal(values, 255 * hidden)


def test_mirrored_positions_are_in_eight_units_of_depth() -> None:
    """A depth image of 0.1 mm reaches 6.5 m; positions reach 26 m to every side."""
    places = np.random.default_rng(3).uniform(-26.0, 26.0, (H, W, 3)).astype(np.float32)
    places[0, 0], places[0, 1, 2] = np.nan, 27.0
    values = read(encode_channel(Channel.MIRRORED_POSITION, places, 0.0001)).astype(np.float64)
    assert (values[0, :2] == 0).all()
    assert np.abs((values[1:] - 32768.0) * 0.0008 - places[1:]).max() <= 0.0004 + 1e-6


def test_coco_tells_how_long_and_when_rows_were_exposed(world: Any, tmp_path: Path) -> None:
    """Of cameras with a shutter; the images of others say nothing about it."""
    shutter = Shutter(0.008, -0.025)
    cameras = [replace(world.camera("dash"), shutter=shutter), world.camera("color")]
    sample = world.sample(0, [world.instance(1, "car", 12.0, 0.0, 0.3)], cameras)
    info = world.info(1, ("color", "dash"))
    folder = world.export(Coco(), info, [sample], tmp_path)
    images = json.loads((folder / "annotations/instances_train.json").read_text())["images"]
    rows = {image["sensor"]: image for image in images}
    assert (rows["dash"]["exposure_s"], rows["dash"]["readout_s"]) == (0.008, -0.025)
    assert not {"exposure_s", "readout_s"} & rows["color"].keys()
