"""Occupancy, lanes, tracks and layers in reports.

Voxels by state and class are counted on paper, as is their view from above.
"""

import base64
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from gen_data.core.asset_types import SURFACES
from gen_data.core.capture import Capture, Channel, SensorReading
from gen_data.core.interfaces import DatasetInfo, Modality, SensorInfo
from gen_data.core.sample import (
    BorderTruth,
    EgoTruth,
    ImageTruth,
    Occupancy,
    PointTracks,
    Sample,
    SensorTracks,
)
from gen_data.core.scene import Scene
from gen_data.core.se3 import IDENTITY
from gen_data.exporters.label_colors import SURFACE_COLORS, UNLABELLED, color_ids, id_color
from gen_data.exporters.label_parts import BORDER_COLORS
from gen_data.preview.voxel_view import UNSEEN, view_from_above
from gen_data.report.report_data import describe_dataset, without_pictures
from gen_data.report.sample_browser import browser_images
from tests.report.handmade import CAMERA, make_image, make_object, write_dataset

FREE, SURFACE, INTERIOR = range(3)
ASPHALT = SURFACES.index("asphalt")
CAR = 1


def make_grid(number: int = CAR) -> Occupancy:
    """Columns of 4 voxels: road with a car in one corner, below a roof in another.

    The camera sees the air and the road of the first row, and the car; the scanner the car alone.
    """
    state = np.zeros((2, 3, 4), np.uint8)
    instance, surface = np.zeros(state.shape, np.uint16), np.zeros(state.shape, np.uint8)
    state[..., 0] = INTERIOR
    state[..., 1], surface[..., 1] = SURFACE, ASPHALT
    state[0, 0, 2], instance[0, 0, 2] = SURFACE, number
    state[0, 2, 3] = SURFACE
    camera, scanner = np.zeros((2, *state.shape), np.bool_)
    camera[0, :, 1:] = True
    scanner[0, 0, 2] = True
    seen = {"color": camera, "top": scanner}
    return Occupancy(IDENTITY, (0.0, 0.0, 0.0), 0.5, state, instance, surface, seen)


BORDERS = (
    BorderTruth("a:left", "edge", ((5.2, 40.0), (20.0, 30.4), (30.0, 20.0)), (True, True, False)),
)


def make_frame(number: int = CAR) -> EgoTruth:
    """The grid, and three tracked points: seen, hidden, and outside the image."""
    places = np.array([[20.4, 20.6], [40.0, 45.0], [-9.0, 5.0]], np.float32)
    states = np.array([0, 2, 3], np.uint8)
    seen = SensorTracks(np.ones((3, 3), np.float32), places, states, np.zeros(3, np.uint16))
    position = np.zeros((3, 3), np.float32)
    tracks = PointTracks(np.zeros(3, np.uint16), position, {"color": seen})
    return EgoTruth(occupancy=make_grid(number), tracks=tracks)


def shaded(color: Any, share: float) -> list[int]:
    return [int(value * share) for value in color]


def test_the_view_from_above_looks_below_roofs_and_is_dark_where_no_sensor_sees() -> None:
    """X upwards and Y to the left: the car is at the lower right. The roof has no air above it."""
    grid = make_grid()
    scene = Scene("street", instances=(make_object(CAR, "car").instance,))
    view = view_from_above(grid, scene)
    road, car = SURFACE_COLORS["asphalt"], id_color(1)

    dark = [shaded(road, UNSEEN)] * 3
    # The camera sees the roof, above which the box ends.
    assert view.tolist() == [dark, [list(UNLABELLED), list(road), list(car)]]


def test_a_ceiling_hides_the_floor_only_where_no_sensor_sees_it() -> None:
    state = np.zeros((1, 2, 5), np.uint8)
    state[..., [0, 3]] = SURFACE
    state[..., 4] = INTERIOR
    surface = np.zeros(state.shape, np.uint8)
    surface[..., 0] = ASPHALT
    seen = np.zeros(state.shape, np.bool_)
    seen[0, 0, :4] = True
    grid = Occupancy(
        IDENTITY, (0.0, 0.0, 0.0), 1.0, state, np.zeros(state.shape, np.uint16), surface,
        {"color": seen},
    )  # fmt: skip
    view = view_from_above(grid, Scene("room"))
    assert view.tolist() == [[shaded(UNLABELLED, UNSEEN), list(SURFACE_COLORS["asphalt"])]]


def test_an_unobserved_grid_without_sensors_is_not_dark_and_empty_columns_are_black() -> None:
    state = np.zeros((1, 2, 2), np.uint8)
    state[0, 1, 0] = SURFACE
    zeros = np.zeros(state.shape, np.uint8)
    grid = Occupancy(IDENTITY, (0, 0, 0), 1.0, state, zeros.astype(np.uint16), zeros, {})
    assert view_from_above(grid, Scene("room")).tolist() == [[list(UNLABELLED), [0, 0, 0]]]


@pytest.fixture(scope="module")
def described(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    image = make_image(np.random.default_rng(6))
    folder = tmp_path_factory.mktemp("grids") / "set"
    samples = [[make_object(CAR, "car")]] * 2
    return describe_dataset(
        write_dataset(folder, samples, ("car",), [image], [make_frame()], BORDERS), scenes_max=0
    )


def rows(described: dict[str, Any], title: str) -> dict[str, dict[str, str]]:
    (table,) = (t for t in described["tables"] if t["title"] == title)
    return {row[0]: dict(zip(table["header"], row, strict=True)) for row in table["rows"]}


def test_tables_count_voxels_by_state_class_and_sensor(described: dict[str, Any]) -> None:
    states = rows(described, "Occupancy")
    # 24 voxels: 6 below the road, 6 of the road, 1 of the car, 1 of the roof.
    columns = ("voxels", "share", "observed", "color", "top")
    assert {name: [row[column] for column in columns] for name, row in states.items()} == {
        "free": ["10.0", "41.7 %", "40.0 %", "40.0 %", "0.0 %"],
        "surface": ["8.0", "33.3 %", "62.5 %", "62.5 %", "12.5 %"],
        "interior": ["6.0", "25.0 %", "0.0 %", "0.0 %", "0.0 %"],
    }
    classes = rows(described, "Voxels with a surface")
    assert list(classes) == ["asphalt", "car", "other"]
    assert classes["asphalt"] == {"class or surface": "asphalt", "voxels": "6.0",
                                  "share": "75.0 %", "observed": "50.0 %"}  # fmt: skip
    assert classes["car"]["observed"] == "100.0 %"


def test_each_image_of_the_page_has_the_view_and_numbers_of_its_sample(
    described: dict[str, Any],
) -> None:
    for shown in described["browser"]:
        assert shown["occupancy"] == {"shape": [2, 3, 4], "voxel_m": 0.5, "free": 10, "surface": 8,
                                      "interior": 6, "observed_surface": 5,
                                      "sensors": ["color", "top"]}  # fmt: skip
        encoded = base64.b64decode(shown["pictures"]["occupancy"].partition(",")[2])
        pixels = cv2.imdecode(np.frombuffer(encoded, np.uint8), cv2.IMREAD_COLOR)
        assert pixels[1, 2, ::-1].tolist() == list(id_color(1))
    assert "base64" not in str(without_pictures(described))


def test_lanes_and_tracked_points_of_an_image_are_data_of_the_page(
    described: dict[str, Any],
) -> None:
    """In whole pixels, hidden parts and points apart; the figures of ``report.json`` have none."""
    for shown in described["browser"]:
        color = "#{:02x}{:02x}{:02x}".format(*BORDER_COLORS["edge"])
        assert shown["lanes"] == [
            [color, True, [5, 40, 20, 30]], [color, False, [20, 30, 30, 20]],
        ]  # fmt: skip
        one, two = ("#{:02x}{:02x}{:02x}".format(*id_color(k)) for k in (1, 2))
        assert shown["tracks"] == [[one, True, 20, 21], [two, False, 40, 45]]
    assert "lanes" not in without_pictures(described)["browser"][0]


def test_layers_and_mirrors_are_pictures_below_one_another() -> None:
    """Two layers of ids, of a mirror one: a third of the height each, in the colours of the ids."""
    ids = np.repeat(np.arange(8, dtype=np.uint16), 8 * 48).reshape(64, 48).T
    channels = {
        Channel.RGB: np.zeros((48, 64, 3), np.uint8),
        Channel.INSTANCE_LAYERS: np.stack([ids, np.zeros_like(ids)], axis=-1),
        Channel.SEEN_IN_MIRROR: ids[:, ::-1],
    }
    reading = SensorReading("color", CAMERA, channels)
    sample = Sample(
        0, 0, 0, "train", Scene("hand"), Capture({"color": reading}),
        {"color": ImageTruth(CAMERA, ())},
    )  # fmt: skip
    info = DatasetInfo(
        "hand", 0, 1, 1, (), (SensorInfo("color", Modality.CAMERA, channels=tuple(channels)),)
    )
    stored = SimpleNamespace(info=info, n=1, indices=[0], labelled=lambda index: sample)
    (image,) = browser_images(stored, 10**6)  # type: ignore[arg-type]

    assert image.facts["layers"] == ["instance_layers", "seen_in_mirror"]
    encoded = base64.b64decode(image.pictures["layers"].partition(",")[2])
    shown = cv2.imdecode(np.frombuffer(encoded, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
    expected = color_ids(np.concatenate([ids, np.zeros_like(ids), ids[:, ::-1]]))
    assert shown.shape == expected.shape
    # JPEG changes colours next to edges.
    inner = (np.arange(3)[:, None] * 48 + np.arange(16, 32)).ravel()
    assert np.abs(shown[inner, 4::8].astype(int) - expected[inner, 4::8]).max() < 24


def test_a_data_set_without_grids_has_no_tables_of_them(tmp_path: Path) -> None:
    image = make_image(np.random.default_rng(6))
    plain = describe_dataset(write_dataset(tmp_path / "set", [[]], ("car",), [image]), scenes_max=0)
    assert not any("ccupancy" in table["title"] for table in plain["tables"])
    assert not {"occupancy", "lanes", "tracks", "layers"} & plain["browser"][0].keys()
