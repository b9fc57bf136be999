"""Borders of lanes on contact sheets and in Rerun."""

from dataclasses import replace
from typing import Any

import numpy as np

from gen_data.core.capture import Channel
from gen_data.core.lane_geometry import LaneBorder
from gen_data.core.sample import BorderTruth, EgoTruth, Sample
from gen_data.exporters.label_parts import BORDER_COLORS, HIDDEN, LIFT_M, split_border
from gen_data.preview.contact_sheet import make_tiles
from tests.preview.recorded import photograph, recorded

PATH = "world/cameras/color/image/lanes"
PLACES = ((10.5, 50.5), (10.5, 40.5), (10.5, 30.5), (10.5, 20.5), (10.5, 10.5))
HALF_HIDDEN = BorderTruth("a:left", "lane", PLACES, (True, True, False, False, True))
EDGE = BorderTruth("a:right", "edge", ((60.5, 50.5), (60.5, 10.5)), (True, True))
WORLD = (
    LaneBorder("a:left", "lane", ((0, 2, 1), (9, 2, 3))),
    LaneBorder("a:right", "edge", ((0, -2, 1), (9, -2, 3))),
)


def sample(index: int = 0, world: tuple[LaneBorder, ...] | None = WORLD) -> Sample:
    """A border of which the middle is hidden, and an edge, in a grey image."""
    borders = None if world is None else (HALF_HIDDEN, EDGE)
    return replace(photograph(borders=borders), index=index, frame=EgoTruth(borders=world))


def test_a_border_is_split_where_it_disappears() -> None:
    """The segment to a hidden point is hidden; parts meet."""
    assert list(split_border(HALF_HIDDEN)) == [(True, PLACES[:2]), (False, PLACES[1:])]
    assert list(split_border(replace(HALF_HIDDEN, visible=(True,) * 5))) == [(True, PLACES)]


def test_sheets_show_borders_in_the_colours_of_their_kinds_and_hidden_parts_darker() -> None:
    (tile,) = make_tiles([sample()], {"color": (Channel.RGB,)}, labels=True)
    image = tile.image
    np.testing.assert_array_equal(image[42:50, 10], np.tile(BORDER_COLORS["lane"], (8, 1)))
    dark = np.rint(HIDDEN * np.array(BORDER_COLORS["lane"]))
    # A smooth line of one pixel covers a tenth less of its pixels, a fifth less where parts meet.
    shares = (image[12:36, 10] - 90.0) / (dark - 90.0)
    assert (shares > 0.8).all()
    assert (shares <= 1.0).all()
    np.testing.assert_array_equal(image[12:48, 60], np.tile(BORDER_COLORS["edge"], (36, 1)))
    assert (image[:, 15:55] == 90).all()
    (plain,) = make_tiles([sample()], {"color": (Channel.RGB,)}, labels=False)
    assert (plain.image == 90).all()


def test_rerun_has_borders_in_the_world_and_their_visible_and_hidden_parts_in_the_image() -> None:
    """Strips in the world are just above the ground."""
    stream = recorded(sample())
    (world,) = stream.at("world/lanes")
    strips = np.array(world.strips.as_arrow_array().to_pylist())
    np.testing.assert_allclose(strips, [np.add(b.points_m, (0, 0, LIFT_M)) for b in WORLD])
    assert colors_of(world) == [BORDER_COLORS["lane"], BORDER_COLORS["edge"]]

    (image,) = stream.at(PATH)
    lines = image.strips.as_arrow_array().to_pylist()
    parts = [PLACES[:2], PLACES[1:], EDGE.points_px]
    assert lines == [[list(place) for place in part] for part in parts]
    dark = tuple(round(HIDDEN * value) for value in BORDER_COLORS["lane"])
    assert colors_of(image) == [BORDER_COLORS["lane"], dark, BORDER_COLORS["edge"]]
    assert image.radii.as_arrow_array().to_pylist() == [-1.5, -0.75, -1.5]


def colors_of(strips: Any) -> list[tuple[int, ...]]:
    """Colours without their alpha, which is 255."""
    packed = strips.colors.as_arrow_array().to_pylist()
    assert all(color & 255 == 255 for color in packed)
    return [(color >> 24, color >> 16 & 255, color >> 8 & 255) for color in packed]


def test_rerun_gets_lanes_of_the_world_once_per_scene_and_none_without_the_annotation() -> None:
    without = sample(0, world=None)
    assert not recorded(without).at("world/lanes") + recorded(without).at(PATH)
    stream = recorded(without, sample(1), sample(2), sample(3, world=WORLD[:1]))
    assert [len(world.strips.as_arrow_array()) for world in stream.at("world/lanes")] == [2, 1]
    assert len(stream.at(PATH)) == 3
