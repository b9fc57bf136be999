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
from gen_data.lab.edit.overlays import View, draw_view, find_empty
from gen_data.lab.edit.samples import Order, Studio
from gen_data.preview.depth_scale import draw_depth_scale, scale_labels
from gen_data.preview.palette import color_depth

CAMERA = Camera("color", SE3(), Intrinsics(80, 60, 50.0, 50.0, 40.0, 30.0))
EDGE = BorderTruth("a:right", "edge", ((60.5, 50.5), (60.5, 10.5)), (True, True))
LAYERS = np.stack([np.eye(60, 80, dtype=np.uint16) * k for k in (3, 5)], axis=-1)


def sample() -> Sample:
    """A grey image with the edge of a carriageway, two layers, and a mirror."""
    channels = {
        Channel.RGB: np.full((60, 80, 3), 90, np.uint8),
        Channel.INSTANCE_LAYERS: LAYERS.copy(),
        Channel.SEEN_IN_MIRROR: LAYERS[..., 1].copy(),
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


def test_layers_of_which_a_sample_has_nothing_are_named() -> None:
    """Borders are there, boxes and words are not; a second layer and a mirror are."""
    view = View(sensor="color", layers=frozenset({"lanes", "boxes", "text"}))
    assert find_empty(sample(), view) == {"boxes", "text"}
    assert find_empty(sample(), View("layers", "color")) == set()
    assert find_empty(sample(), View("mirrors", "color")) == set()
    assert find_empty(sample(), View("depth", "color")) == {"depth"}
    plain = sample()
    plain.capture.readings["color"].channels[Channel.SEEN_IN_MIRROR][:] = 0  # type: ignore[index]
    plain.capture.readings["color"].channels[Channel.INSTANCE_LAYERS][..., 1] = 0  # type: ignore[index]
    assert find_empty(plain, View("mirrors", "color")) == {"mirrors"}
    assert find_empty(plain, View("layers", "color")) == {"layers"}


def test_a_depth_image_has_a_scale_in_metres() -> None:
    """Of the 1st to the 99th percentile: bright is near; nothing has none."""
    depth_m = np.tile(np.linspace(1.0, 21.0, 200, dtype=np.float32), (100, 1))
    assert scale_labels(depth_m) == ("1.2 m", "21 m")
    image = color_depth(depth_m)
    draw_depth_scale(image, depth_m, 1.0)
    bar = image[-2].astype(int)  # Below the letters.
    assert (np.diff(bar[:, 0]) <= 0).all()
    assert (bar[0, 0], bar[-1, 0]) == (255, 40)
    np.testing.assert_array_equal(image[:-13], color_depth(depth_m)[:-13])
    nothing = np.full((100, 200), np.inf, np.float32)
    assert scale_labels(nothing) == ("", "")
    image = color_depth(nothing)
    draw_depth_scale(image, nothing, 1.0)
    assert not image.any()


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
