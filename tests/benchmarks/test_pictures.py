"""Counts of cars and people in pictures, on label files written by hand."""

import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchmarks.bench_pictures import (
    FOCAL_PX,
    REAL,
    Grey,
    Labelled,
    as_kitti,
    grey_in_boxes,
    grey_levels,
    pictures_of_kitti,
    summarise,
)
from gen_data.assemble.config import load_config
from gen_data.core.se3 import SE3
from gen_data.sensors.camera.rgb_camera import RgbCamera

ROWS = """\
Car 0.00 0 0.00 100.00 150.00 160.00 190.00 1.50 1.60 4.00 3.00 1.70 4.00 0.00
Car 0.00 2 0.00 100.00 150.00 120.00 160.00 1.60 1.70 3.00 -30.00 1.60 40.00 0.00
Pedestrian 0.00 0 0.00 200.00 100.00 240.00 200.00 1.80 0.60 0.90 6.00 1.65 8.00 0.00
Van 0.00 0 0.00 300.00 100.00 500.00 300.00 2.00 1.90 5.00 1.00 1.65 9.00 0.00
DontCare -1 -1 -10 500.00 160.00 520.00 170.00 -1 -1 -1 -1000 -1000 -1000 -10
"""


def test_figures_of_label_files_are_those_of_a_count_by_hand(tmp_path: Path) -> None:
    """Two pictures, one of them empty: a car 40 px and one 10 px high, a person of 100 px."""
    (tmp_path / "label_2").mkdir()
    (tmp_path / "label_2/000000.txt").write_text(ROWS)
    (tmp_path / "label_2/000001.txt").write_text("")

    figures = summarise(list(pictures_of_kitti(tmp_path, 2)))

    assert {name for name, value in figures.items() if value == 0.5 and " px" in name} == {
        "cars < 25 px", "cars 25-48 px", "people 96-192 px"
    }  # fmt: skip
    assert (figures["cars"], figures["people"], figures["cyclists"]) == (1.0, 0.5, 0.0)
    assert figures["people: width / height, p50"] == 0.4
    assert figures["people: distance, p50 [m]"] == pytest.approx(10.0)
    assert figures["cars: length, p50 [m]"] == pytest.approx(3.5)
    assert math.isnan(figures["people: mean grey in boxes"])
    assert set(figures) == set(REAL)


def test_grey_levels_are_of_pixels_in_boxes_of_people_each_counted_once() -> None:
    """Two boxes of 2 x 2 pixels share one: seven pixels, of which one is dark; the rest is red."""
    grey = np.full((4, 6), 50.0)
    grey[1, 1] = 24.9
    rows = [
        "Pedestrian 0 0 0 1.00 1.00 2.00 2.00 1.8 0.6 0.9 6 1.6 8 0",
        "Pedestrian 0 0 0 2.00 2.00 3.00 3.00 1.8 0.6 0.9 6 1.6 8 0",
        "Car 0 0 0 0.00 0.00 5.00 3.00 1.8 0.6 0.9 6 1.6 8 0",
    ]

    assert grey_in_boxes(grey, rows) == Grey(7, 1, 24.9 + 6 * 50.0)
    red = np.zeros((1, 1, 3), np.uint8)
    red[..., 0] = 200
    assert grey_levels(red)[0, 0] == pytest.approx(59.8)


def test_the_greys_of_real_pictures_are_read_next_to_their_labels(tmp_path: Path) -> None:
    """A picture of grey 40: all of its person's 41 x 101 pixels are 40, and none is dark."""
    (tmp_path / "label_2").mkdir()
    (tmp_path / "image_2").mkdir()
    (tmp_path / "label_2/000000.txt").write_text(ROWS)
    Image.new("RGB", (600, 300), (40, 40, 40)).save(tmp_path / "image_2/000000.png")

    figures = summarise(list(pictures_of_kitti(tmp_path, 1)))

    assert figures["people: mean grey in boxes"] == pytest.approx(40.0)
    assert figures["people: dark pixels in boxes"] == 0.0


def test_boxes_of_small_pictures_are_in_the_pixels_of_kitti_s_camera() -> None:
    """A third of its size: 20 x 30 pixels are 60 x 90."""
    found = Labelled.of("Car 0 0 0 10.0 20.0 30.0 50.0 1.5 1.6 4.0 3 1.7 4 0", 3.0)

    assert found is not None
    assert found.size_px == (60.0, 90.0)


@pytest.mark.parametrize("name", ["street.yaml", "kitti_rig.yaml", "nuscenes_rig.yaml"])
def test_every_configuration_is_counted_as_kitti_s_camera_would_see_it(name: str) -> None:
    """Focal length and field of view of P_rect_02, 1.65 m above the ground, level, straight on."""
    camera = next(s for s in load_config(name).sensors if isinstance(s, RgbCamera))
    config = load_config(name, overrides=as_kitti(camera, 3))
    seen = next(s for s in config.sensors if isinstance(s, RgbCamera))

    assert seen.size_px == (414, 125)
    assert 3.0 * seen.nominal_intrinsics().fx_px == pytest.approx(FOCAL_PX, abs=0.5)
    assert (seen.offset_m[:2], seen.image_pipeline) == (camera.offset_m[:2], camera.image_pipeline)
    if camera.rig:
        assert seen.T_rig_sensor == SE3((*camera.offset_m[:2], 1.65))
