"""Pictures of the live page that share their drawing with previews."""

import cv2
import numpy as np
import pytest

from gen_data.core.capture import Capture, Channel, SensorReading
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.sample import BorderTruth, ImageTruth, Sample
from gen_data.core.scene import Camera, Scene
from gen_data.core.se3 import SE3
from gen_data.exporters.label_colors import color_ids
from gen_data.exporters.label_parts import BORDER_COLORS
from gen_data.lab.edit.overlays import View, draw_view
from gen_data.lab.edit.samples import Order, Studio

CAMERA = Camera("color", SE3(), Intrinsics(80, 60, 50.0, 50.0, 40.0, 30.0))
EDGE = BorderTruth("a:right", "edge", ((60.5, 50.5), (60.5, 10.5)), (True, True))
LAYERS = np.stack([np.eye(60, 80, dtype=np.uint16) * k for k in (3, 5)], axis=-1)


def sample() -> Sample:
    """A grey image with the edge of a carriageway, two layers, and a mirror."""
    channels = {
        Channel.RGB: np.full((60, 80, 3), 90, np.uint8),
        Channel.INSTANCE_LAYERS: LAYERS,
        Channel.SEEN_IN_MIRROR: LAYERS[..., 1],
    }
    reading = SensorReading("color", CAMERA, channels)
    truth = {"color": ImageTruth(CAMERA, (), borders=(EDGE,))}
    scene = Scene("s", cameras=(CAMERA,))
    return Sample(0, 0, 0, "train", scene, Capture({"color": reading}), truth)


def test_borders_of_lanes_are_drawn_where_they_are_chosen() -> None:
    view = View(sensor="color", layers=frozenset({"lanes"}))
    image = draw_view(sample(), view, {}, 1.0)
    np.testing.assert_array_equal(image[12:48, 60], np.tile(BORDER_COLORS["edge"], (36, 1)))
    plain = draw_view(sample(), View(sensor="color", layers=frozenset()), {}, 1.0)
    assert (plain == 90).all()


def test_layers_are_side_by_side_and_mirrors_show_their_instances() -> None:
    layers = draw_view(sample(), View("layers", "color"), {}, 1.0)
    expected = color_ids(np.concatenate([LAYERS[..., 0], LAYERS[..., 1]], axis=1))
    np.testing.assert_array_equal(layers, expected)
    mirrors = draw_view(sample(), View("mirrors", "color"), {}, 1.0)
    np.testing.assert_array_equal(mirrors, color_ids(LAYERS[..., 1]))


@pytest.mark.slow
def test_the_studio_renders_lanes_and_layers_on_demand() -> None:
    """Of a text that names neither; layers of a street are four images side by side."""
    text = "extends: street.yaml\nannotations: []\nexporters: []\n"
    view = View(layers=frozenset({"lanes"}))
    studio = Studio()
    shown = studio.show(Order(text, "x.yaml", 0, view, width_px=310))
    plain = studio.show(Order(text, "x.yaml", 0, View(layers=frozenset()), width_px=310))
    layers = studio.show(Order(text, "x.yaml", 0, View("layers"), width_px=310))
    assert shown.jpeg != plain.jpeg
    sizes = [cv2.imdecode(np.frombuffer(one.jpeg, np.uint8), cv2.IMREAD_COLOR).shape[1]
             for one in (shown, layers)]  # fmt: skip
    assert sizes == [310, 4 * 310]
