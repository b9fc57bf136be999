"""Models of laser scanners against the numbers of their manuals."""

import numpy as np
import pytest
from pydantic import ValidationError

from gen_data.core.errors import ConfigError
from gen_data.sensors.device_presets import preset_names
from gen_data.sensors.lidar.scan_pattern import PRESETS, LidarModel, lidar_model, make_sweep


def angles_deg(name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Elevation, azimuth and ring of every pulse of a sweep."""
    sweep = make_sweep(lidar_model(name), 0.0)
    x, y, z = sweep.directions.astype(np.float64).T
    return np.degrees(np.arcsin(z)), np.degrees(np.arctan2(y, x)), sweep.ring


def test_the_hdl64_has_two_blocks_of_lasers() -> None:
    """Upper 32 from +2 to -8.33 degrees in thirds, lower 32 from -8.83 to -24.33 in halves."""
    elevation, _, ring = angles_deg("HDL-64E")
    table = np.array([elevation[ring == k].mean() for k in range(64)])

    np.testing.assert_allclose(table[:32], 2.0 - np.arange(32) / 3.0, atol=1e-4)
    np.testing.assert_allclose(table[32:], -(8.0 + 5.0 / 6.0) - np.arange(32) / 2.0, atol=1e-4)
    assert max(np.ptp(elevation[ring == k]) for k in range(64)) < 1e-4


def test_beams_of_the_hdl64_pass_beside_their_axis_at_two_heights() -> None:
    """0.026 m from it, left and right in turn; other beams start at the origin."""
    sweep = make_sweep(lidar_model("HDL-64E"), 0.0)
    assert sweep.origins_m is not None
    origins, directions = sweep.origins_m.astype(float), sweep.directions.astype(float)
    x, y = directions[:, 0], directions[:, 1]
    # z of (direction x origin) over the level part: distance from the axis, to the left.
    left = (x * origins[:, 1] - y * origins[:, 0]) / np.hypot(x, y)
    even = sweep.ring % 2 == 0

    np.testing.assert_allclose(left, np.where(even, -0.026, 0.026), atol=1e-6)
    heights = [origins[sweep.ring == k, 2].mean() for k in (0, 31, 32, 63)]
    np.testing.assert_allclose(heights, [0.209, 0.1956, 0.1243, 0.1052], atol=1e-5)
    assert make_sweep(lidar_model("VLP-16"), 0.0).origins_m is None

    device = lidar_model("HDL-64E").with_beams([(1.0, 0.0), (-5.0, 0.0)])

    assert make_sweep(device, 0.0).origins_m is None


@pytest.mark.parametrize(("name", "rings", "top", "bottom", "pulses"), [
    ("VLP-16", 16, 15.0, -15.0, 28_935),
    ("HDL-32E", 32, 32 / 3, -92 / 3, 69_440),
    ("HDL-64E", 64, 2.0, -73 / 3, 133_331),
    ("OS1-64", 64, 22.5, -22.5, 65_536),
    ("RPLIDAR-A1", 1, 0.0, 0.0, 1_454),
    ("OS1-128", 128, 22.5, -22.5, 131_072),
    ("carla", 32, 15.0, -25.0, 2_250),
])  # fmt: skip
def test_rings_and_pulses_are_those_of_the_data_sheet(
    name: str, rings: int, top: float, bottom: float, pulses: int
) -> None:
    """Rings from the top; pulses of a sweep within one column of rate / rotation."""
    elevation, _, ring = angles_deg(name)

    assert ring.max() + 1 == rings
    assert elevation[ring == 0].mean() == pytest.approx(top, abs=1e-3)
    assert elevation[ring == rings - 1].mean() == pytest.approx(bottom, abs=1e-3)
    assert len(ring) == pytest.approx(pulses, abs=rings)


@pytest.mark.parametrize("name", preset_names(PRESETS))
def test_every_direction_is_a_unit_vector_and_time_rises_within_a_sweep(name: str) -> None:
    """From 0 to one rotation."""
    model = lidar_model(name)
    sweep = make_sweep(model, 1.25)

    assert np.abs(np.linalg.norm(sweep.directions, axis=1) - 1.0).max() < 1e-6
    assert (np.diff(sweep.time_s) >= 0).all()
    assert sweep.time_s[0] >= 0.0 and sweep.time_s[-1] <= 1.0 / model.rotation_hz


def test_azimuths_turn_clockwise_evenly_and_lasers_of_an_os1_are_staggered() -> None:
    """From behind over the left and ahead in the middle; four columns, 2.1 degrees apart."""
    _, azimuth, ring = angles_deg("VLP-16")
    of_one = azimuth[ring == 3]
    steps = np.diff(of_one)

    np.testing.assert_allclose(steps, -360.0 / len(of_one), atol=1e-3)
    assert abs(of_one[len(of_one) // 2]) < 360.0 / len(of_one)

    _, azimuth, ring = angles_deg("OS1-64")
    first = {k: azimuth[ring == k][300] for k in range(8)}

    assert first[0] - first[1] == pytest.approx(2.109, abs=1e-3)
    assert first[0] - first[3] == pytest.approx(6.328, abs=1e-3)
    assert first[4] == pytest.approx(first[0], abs=1e-3)


def test_a_rosette_fills_its_round_view_and_never_repeats() -> None:
    """Within 19.2 degrees of its axis; the next sweep shares few directions."""
    model = lidar_model("livox")
    one, next_ = make_sweep(model, 10.0), make_sweep(model, 10.1)
    away = np.degrees(np.arccos(np.clip(one.directions[:, 0].astype(float), -1, 1)))

    assert away.max() == pytest.approx(19.2, abs=0.05)
    assert away.min() < 0.1
    assert np.linalg.norm(one.directions - next_.directions, axis=1).mean() > 0.05


def test_an_unknown_or_impossible_model_is_refused() -> None:
    """A scanner has lasers or prisms; ranges must rise."""
    with pytest.raises(ConfigError, match=r"VLP-16.*did you mean 'HDL-64E'"):
        lidar_model("HDL-64")

    plain = lidar_model("VLP-16").model_dump()
    with pytest.raises(ValidationError, match="elevations_deg or prisms"):
        LidarModel.model_validate({**plain, "elevations_deg": ()})
    with pytest.raises(ValidationError, match="must rise"):
        LidarModel.model_validate({**plain, "range_m": (100.0, 1.0)})
    old = lidar_model("HDL-64E").model_dump()
    with pytest.raises(ValidationError, match="range_exponent needs near_m"):
        LidarModel.model_validate({**old, "near_m": 0.0})
    for far in ({"reflectance": 0.8, "range_m": 40.0}, {"reflectance": 0.1, "range_m": 120.0}):
        with pytest.raises(ValidationError, match="seen_far must be farther and brighter"):
            LidarModel.model_validate({**old, "seen_far": far})


@pytest.mark.parametrize("name", ["HDL-64E", "OS1-64", "VLP-16"])
def test_pulses_in_the_order_of_a_sweep_are_neighbours(name: str) -> None:
    """Every pulse once, and the first hundred of each tile within a few degrees."""
    sweep = make_sweep(lidar_model(name), 0.0)
    assert sweep.order is not None
    np.testing.assert_array_equal(np.sort(sweep.order), np.arange(len(sweep.ring)))

    runs = sweep.directions[sweep.order][: len(sweep.order) // 128 * 128].reshape(-1, 128, 3)
    middle = runs.mean(axis=1, keepdims=True)
    apart = np.degrees(np.arccos(np.clip((runs * middle).sum(axis=2), -1.0, 1.0)))
    assert np.median(apart.max(axis=1)) < 9.0


def test_a_sweep_that_is_shared_cannot_be_written_to() -> None:
    """It is made once for each model."""
    sweep = make_sweep(lidar_model("VLP-16"), 0.0)
    assert make_sweep(lidar_model("VLP-16"), 5.0) is sweep
    with pytest.raises(ValueError, match="read-only"):
        sweep.directions[0] = 0.0
