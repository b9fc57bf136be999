"""Sheets of sensors: their contents, and the sheets of the documentation."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gen_data.assemble.config import load_config
from gen_data.core.capture import Capture, Channel, Measurements, SensorReading
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.measurement_dtypes import table_rows
from gen_data.core.sample import ImageTruth, Sample
from gen_data.core.scene import Camera, Device, Instance, Scene
from gen_data.core.se3 import SE3
from gen_data.preview.contact_sheet import CAPTION_PX, Tile, make_tiles, render_tiles
from gen_data.preview.sensor_views import BRIGHTER, DARKER, GREY, event_view, radar_view
from gen_data.sensors.event_camera.event_camera import COLUMNS, VIEW
from gen_data.sensors.radar.radar_sensor import Radar

VIEWS = {"radar": Radar.view, "events": VIEW}
DOCS = Path(__file__).parents[2] / "docs"
SHEETS = sorted((DOCS / "sheets").glob("*.yaml"))
CAR = Instance(1, "car", "car", 1, "car", box_min_m=(-2, -1, 0), box_max_m=(2, 1, 1.5))


def radar_table(**columns: object) -> Measurements:
    """Detections of a radar at the world's origin."""
    device = Device("radar", "radar", "ego", T_world_device=SE3())
    return Measurements("radar", device, table_rows(Radar.columns, 1, **columns))  # type: ignore[arg-type]


def event_table() -> Measurements:
    """Three events: one pixel twice, first brighter, then darker."""
    rows = table_rows(COLUMNS, 3, time_s=[0.1, 0.2, 0.3], x_px=[9, 3, 9], y_px=[7, 2, 7])
    rows["polarity"] = [1, 1, -1]
    return Measurements("events", Device("events", "event_camera", "ego"), rows)


def sample() -> Sample:
    lens = Intrinsics(32, 24, 30.0, 30.0, 16.0, 12.0)
    color, depth = Camera("color", SE3(), lens), Camera("depth", SE3(), lens)
    images = {Channel.RGB: np.full((24, 32, 3), 90, np.uint8),
              Channel.Z_DEPTH: np.full((24, 32), 2.0, np.float32)}  # fmt: skip
    readings = {c.name: SensorReading(c.name, c, images) for c in (color, depth)}
    tables = {"radar": radar_table(range_m=10.0), "events": event_table()}
    truth = {c.name: ImageTruth(c, ()) for c in (color, depth)}
    scene = Scene("t", cameras=(color, depth))
    return Sample(0, 0, 0, "train", scene, Capture(readings, tables=tables), truth)


def test_layers_have_a_tile_each_in_the_same_colours() -> None:
    """Near is bright: 1 m in the first layer, 2 m in the second, and black without a third."""
    taken = sample()
    reading = taken.capture.readings["color"]
    depth_m = np.full((24, 32, 3), (1.0, 2.0, np.inf), np.float32)
    images = {Channel.DEPTH_LAYERS: depth_m}
    capture = Capture({"color": replace(reading, channels=images)})
    shown = list(
        make_tiles([replace(taken, capture=capture)], {"color": tuple(images)}, labels=False)
    )
    assert [t.caption for t in shown] == [f"color depth_layers {k}" for k in range(3)]
    assert [t.image.shape for t in shown] == [(24, 32, 3)] * 3
    assert [int(t.image.mean()) for t in shown] == [255, 40, 0]


def test_every_sensor_shows_what_it_writes_and_captions_stand_below() -> None:
    """Captions name the sensor, and the channel where it has several."""
    channels = {"color": (Channel.RGB,), "depth": (Channel.RGB, Channel.Z_DEPTH)}
    shown = list(make_tiles([sample()], channels, labels=False, views=VIEWS))
    assert [t.caption for t in shown] == ["color", "depth rgb", "depth depth", "events", "radar"]
    without = make_tiles([sample()], channels, labels=True)
    assert [t.caption for t in without] == ["color", "depth rgb", "depth depth"]
    # The picture is not covered; without captions it is all there is.
    tile = Tile("camera", np.full((30, 40, 3), 200, np.uint8))
    (plain,) = render_tiles([tile], 80, captions=False)
    (named,) = render_tiles([tile], 80, captions=True)
    assert plain.shape == (60, 80, 3)
    assert named.shape == (60 + CAPTION_PX, 80, 3)
    assert np.array_equal(named[:60], plain)
    assert named[60:].max() > 150


def test_the_last_event_of_a_pixel_decides_its_colour_and_radars_outline_objects() -> None:
    """Red where it became darker at last, blue where brighter, grey where nothing came."""
    view = event_view(event_table(), Scene("t"), 1.0)
    assert view.shape == (8, 10, 3)
    assert (tuple(view[7, 9]), tuple(view[2, 3])) == (DARKER, BRIGHTER)
    assert (view[0] == GREY).all()
    # A car of 4 m by 2 m at the origin: 38 by 19 pixels.
    view = radar_view(radar_table(range_m=49.0), Scene("t", instances=(CAR,)), 1.0)
    rows, columns = np.nonzero(view[:, :600].any(axis=2))
    assert columns.max() - columns.min() == pytest.approx(4.0 * 9.6, abs=3)
    assert rows.max() - rows.min() == pytest.approx(2.0 * 9.6, abs=3)


@pytest.mark.parametrize(("velocity", "channel"), [(-20.0, 2), (0.0, 1), (20.0, 0)])
def test_detections_are_seen_from_above_by_their_speed(velocity: float, channel: int) -> None:
    """10 m ahead and 10 m to the left: a fifth of 50 m right of and above the middle."""
    table = radar_table(
        range_m=10.0 * 2.0**0.5, azimuth_rad=np.pi / 4, velocity_compensated_m_s=velocity,
        snr_db=30.0,
    )  # fmt: skip
    view = radar_view(table, Scene("t", instances=(replace(CAR, annotated=False),)), 1.0)
    assert view.shape == (960, 960, 3)
    assert view[480 - 96, 480 + 96].argmax() == channel
    assert view[480 - 96, 480 + 96].max() == 255
    assert not view[480:].any()


@pytest.mark.parametrize("path", SHEETS, ids=lambda path: path.stem)
def test_sheets_of_the_documentation_are_valid_and_tell_their_command(path: Path) -> None:
    """Each is read without a fault; the picture that its command makes is there."""
    text = path.read_text("utf-8")
    assert load_config(str(path)).sensors
    source = path.with_name("sensors.yaml").read_text("utf-8") if path.stem == "depth" else text
    (out,) = re.findall(r"--out docs/(\S+)", source)
    assert (DOCS / out).exists()
    assert f"docs/sheets/{path.name}" in source
