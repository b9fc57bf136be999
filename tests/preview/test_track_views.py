"""Tracked points on contact sheets and in Rerun."""

import numpy as np

from gen_data.core.capture import Capture, Channel, SensorReading
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.sample import EgoTruth, ImageTruth, PointTracks, Sample, SensorTracks
from gen_data.core.scene import Camera, Scene
from gen_data.core.se3 import SE3
from gen_data.exporters.label_colors import id_color
from gen_data.preview.contact_sheet import make_tiles
from gen_data.preview.rerun_recording import Recorder

CAMERA = Camera("color", SE3(), Intrinsics(80, 60, 50.0, 50.0, 40.0, 30.0))
VISIBLE, OCCLUDED, OUTSIDE = 0, 2, 3


def sample(step: int, u: float = 20.5) -> Sample:
    """A visible point at (u + 12 step, 20.5), a hidden one at (40.5, 45.5), another one outside."""
    places = np.array([[u + 12 * step, 20.5], [40.5, 45.5], [-9.0, 5.0]], np.float32)
    state = np.array([VISIBLE, OCCLUDED, OUTSIDE], np.uint8)
    seen = SensorTracks(np.ones((3, 3), np.float32), places, state, np.zeros(3, np.uint16))
    p_world = np.arange(9, dtype=np.float32).reshape(3, 3)
    tracks = PointTracks(np.zeros(3, np.uint16), p_world, {"color": seen})
    grey = {Channel.RGB: np.full((60, 80, 3), 90, np.uint8)}
    reading = SensorReading("color", CAMERA, grey)
    return Sample(
        step, 0, 0, "train", Scene("s", cameras=(CAMERA,)), Capture({"color": reading}),
        {"color": ImageTruth(CAMERA, ())}, step_index=step, frame=EgoTruth(tracks=tracks),
    )  # fmt: skip


def test_visible_points_are_filled_hidden_ones_rings_and_ways_lead_back() -> None:
    """Points are in the colours of their numbers; what is outside is not drawn."""
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


class _Stream:
    def __init__(self) -> None:
        self.logged: dict[str, tuple[object, ...]] = {}

    def log(self, path: str, *values: object, static: bool = False) -> None:
        self.logged[path] = values

    def set_time(self, *_: object, **__: object) -> None:
        """Times do not matter here."""

    def send_blueprint(self, blueprint: object) -> None:
        """Nor does the layout."""


def test_rerun_has_the_points_in_the_world_and_in_the_image() -> None:
    stream = _Stream()
    Recorder(stream, None, DatasetInfo("t", 1, 1, 1, (), ())).record(sample(0))  # type: ignore[arg-type]
    (world,) = stream.logged["world/tracks"]
    assert world.positions.as_arrow_array().to_pylist() == [  # type: ignore[attr-defined]
        [0, 1, 2], [3, 4, 5], [6, 7, 8],
    ]  # fmt: skip
    (image,) = stream.logged["world/cameras/color/image/tracks"]
    assert image.positions.as_arrow_array().to_pylist() == [  # type: ignore[attr-defined]
        [20.5, 20.5], [40.5, 45.5],
    ]  # fmt: skip
    assert image.radii.as_arrow_array().to_pylist() == [-3.0, -1.5]  # type: ignore[attr-defined]
