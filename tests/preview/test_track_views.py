"""Tracked points on contact sheets and in Rerun."""

from dataclasses import replace

import numpy as np

from gen_data.core.capture import Channel
from gen_data.core.sample import EgoTruth, PointTracks, Sample, SensorTracks
from gen_data.exporters.label_colors import id_color
from gen_data.preview.contact_sheet import make_tiles
from tests.preview.recorded import photograph, recorded

VISIBLE, OCCLUDED, OUTSIDE = 0, 2, 3


def sample(step: int, u: float = 20.5) -> Sample:
    """A visible point at (u + 12 step, 20.5), a hidden one at (40.5, 45.5), another one outside."""
    places = np.array([[u + 12 * step, 20.5], [40.5, 45.5], [-9.0, 5.0]], np.float32)
    state = np.array([VISIBLE, OCCLUDED, OUTSIDE], np.uint8)
    seen = SensorTracks(np.ones((3, 3), np.float32), places, state, np.zeros(3, np.uint16))
    p_world = np.arange(9, dtype=np.float32).reshape(3, 3)
    tracks = PointTracks(np.zeros(3, np.uint16), p_world, {"color": seen})
    return replace(photograph(), index=step, step_index=step, frame=EgoTruth(tracks=tracks))


def test_visible_points_are_filled_hidden_ones_rings_and_ways_lead_back() -> None:
    """Points are in the colours of their numbers; points outside are not drawn."""
    channels = {"color": (Channel.RGB,)}
    first, second = (t.image for t in make_tiles([sample(0), sample(1)], channels, labels=True))
    one, two = (np.array(id_color(k)) for k in (1, 2))
    assert (first[20, 20] == one).all()
    assert (first[45, 40] == 90).all()
    assert (np.abs(first[45, 36:45].astype(int) - two).sum(axis=-1) < 120).any()
    assert (second[20, 32] == one).all()
    assert (np.abs(second[20, 22:31].astype(int) - one).sum(axis=-1) < 60).all()
    assert (first[20, 26:] == 90).all()
    assert (second[:12] == 90).all()


def test_rerun_has_the_points_in_the_world_and_in_the_image() -> None:
    stream = recorded(sample(0))
    (world,) = stream.at("world/tracks")
    assert world.positions.as_arrow_array().to_pylist() == [[0, 1, 2], [3, 4, 5], [6, 7, 8]]
    (image,) = stream.at("world/cameras/color/image/tracks")
    assert image.positions.as_arrow_array().to_pylist() == [[20.5, 20.5], [40.5, 45.5]]
    assert image.radii.as_arrow_array().to_pylist() == [-3.0, -1.5]
