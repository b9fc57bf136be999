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
    grey_in_boxes,
    grey_levels,
    least_sizes,
    pictures_of_kitti,
    summarise,
)
from gen_data.core.se3 import turned

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


def test_ground_below_cars_is_counted_from_a_level_camera_in_the_height_of_kitti_s() -> None:
    """On level ground, 40 m ahead of a camera at 1.5 m that looks 0.5 degrees down: 1.65 m."""
    down = math.radians(0.5)
    T_rig_camera = turned((1.7, 0.0, 1.5), 0.0, -down, 0.0)
    y = 1.5 * math.cos(down) - 40.0 * math.sin(down)
    z = 40.0 * math.cos(down) + 1.5 * math.sin(down)
    row = f"Car 0 0 0 100 150 160 190 1.5 1.6 4 -3 {y} {z} 0"

    as_seen = Labelled.of(row, FOCAL_PX, 187.5)
    as_kitti = Labelled.of(row, FOCAL_PX, 187.5, T_rig_camera)

    assert as_seen is not None
    assert as_seen.below_m == pytest.approx(1.151, abs=1e-3)
    assert as_kitti is not None
    assert as_kitti.below_m == pytest.approx(1.65, abs=1e-9)


def test_near_cars_are_cut_off_where_the_image_of_kitti_ends() -> None:
    """Four metres ahead of a camera at 1.2 m; its image is higher than KITTI's.

    From 1.65 m the car's top of 1.56 m is 16 px below the middle, 187.5 px above the lowest row.
    """
    near = "Car 0 0 0 100 {} 400 {} 1.56 1.6 4 1 1.2 4 0"
    row = near.format(450 - 1443 * (1.56 - 1.2) / 4, 450 + 1443 * 1.2 / 4)

    car = Labelled.of(row, 1443.0, 450.0, turned((1.7, 0.0, 1.2), 0.0, 0.0, 0.0))

    assert car is not None
    assert car.size_px == pytest.approx((150.0, 187.5 - 721.5 * 0.09 / 4))


@pytest.mark.parametrize(
    ("px", "visible_px", "side_px"), [(1.0, 16, 3), (1.0 / 3.0, 1, 1), (1266.0 / 721.5, 49, 5)]
)
def test_least_sizes_of_labels_are_the_same_angles_under_every_lens(
    px: float, visible_px: int, side_px: int
) -> None:
    """KITTI's camera, a third of its size, and the front camera of nuScenes."""
    assert least_sizes(px) == {"min_visible_px": visible_px, "min_box_px": side_px}


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


@pytest.mark.parametrize(
    ("top", "bottom", "height_px"),
    [(100.0, 400.0, 275.0), (200.0, 300.0, 100.0), (380.0, 600.0, None)],
)
def test_boxes_end_where_the_images_of_kitti_do(
    top: float, bottom: float, height_px: float | None
) -> None:
    """375 rows around row 187.5 end at 375; here everything is twice as large and 200 px lower."""
    row = f"Car 0 0 0 0.0 {2 * top + 200} 60.0 {2 * bottom + 200} 1.5 1.6 4.0 3 1.7 4 0"

    found = Labelled.of(row, 2 * FOCAL_PX, 2 * 187.5 + 200)

    assert (None if found is None else found.size_px[1]) == height_px
