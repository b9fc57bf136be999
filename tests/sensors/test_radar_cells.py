"""Cells of a radar and the peaks that are reported."""

import math

import numpy as np
import pytest

from gen_data.sensors.device_presets import load_preset
from gen_data.sensors.radar.radar_detection import Cells, Echo, find_peaks, make_cells, merge_echoes
from gen_data.sensors.radar.radar_sensor import PRESETS, RadarModel

NEAR = load_preset(PRESETS, "ARS408-21", RadarModel).looks[0]


def rays(
    range_m: list[float], azimuth_deg: list[float], rcs_m2: list[float], ids: list[int]
) -> Echo:
    zeros = np.zeros(len(range_m))
    return Echo(
        np.array(range_m),
        np.radians(azimuth_deg),
        zeros,
        zeros,
        np.array(rcs_m2),
        zeros,
        np.array(ids),
        np.array(ids),
    )


def keyed(keys: list[tuple[int, int, int, int]]) -> Cells:
    empty = rays([], [], [], [])
    return Cells(empty, np.array(keys))


def test_rays_of_one_cell_are_one_echo_in_their_middle() -> None:
    """Cross sections add, places are weighted by them, and the stronger gives its label."""
    cells = make_cells(rays([20.0, 20.2], [1.0, 2.0], [1.0, 3.0], [7, 9]), NEAR)

    assert len(cells.echo.range_m) == 1
    assert cells.echo.range_m[0] == pytest.approx(20.15)
    assert math.degrees(cells.echo.azimuth_rad[0]) == pytest.approx(1.75)
    assert cells.echo.rcs_m2[0] == 4.0
    assert cells.echo.instance_id[0] == 9


def test_cells_grow_towards_the_sides_and_never_fold_back() -> None:
    """3.2 degrees ahead, 12.3 at the side: rays in order of azimuth are cells in that order."""
    azimuth_deg = np.linspace(-59.9, 59.9, 400)
    count = len(azimuth_deg)
    cells = make_cells(rays([20.0] * count, azimuth_deg.tolist(), [1.0] * count, [1] * count), NEAR)
    middles = np.degrees(cells.echo.azimuth_rad)
    order = np.argsort(cells.keys[:, 1])
    widths = np.diff(middles[order])

    assert (widths > 0.0).all()
    ahead = np.abs(middles[order][:-1]) < 15.0
    assert widths[ahead].max() < 4.0
    assert widths.max() > 7.0


def test_neighbours_flow_to_the_same_peak() -> None:
    """A slope of four cells has one peak, a valley between two slopes parts them."""
    slope = keyed([(k, 0, 0, 0) for k in range(5)])

    assert find_peaks(slope, np.array([1.0, 2.0, 3.0, 4.0, 5.0])).tolist() == [0] * 5
    assert find_peaks(slope, np.array([5.0, 2.0, 1.0, 3.0, 4.0])).tolist() == [0, 0, 1, 1, 1]


def test_cells_apart_are_peaks_and_nothing_has_none() -> None:
    """In any of the four directions, and also where numbers are negative."""
    for axis in range(4):
        near, far = [0, 0, 0, 0], [0, 0, 0, 0]
        near[axis], far[axis] = -1, 1
        apart = keyed([tuple(near), tuple(far)])  # type: ignore[list-item]
        assert len(set(find_peaks(apart, np.array([1.0, 2.0])).tolist())) == 2
    touching = keyed([(-1, -1, 0, -1), (0, 0, 0, 0)])
    assert len(set(find_peaks(touching, np.array([1.0, 2.0])).tolist())) == 1

    empty = rays([], [], [], [])

    assert len(find_peaks(make_cells(empty, NEAR), np.zeros(0))) == 0
    assert len(merge_echoes(empty, np.zeros(0, np.int64), np.zeros(0)).range_m) == 0
