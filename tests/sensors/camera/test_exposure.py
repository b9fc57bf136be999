"""Exposure values and metering."""

import math

import numpy as np
import pytest

from gen_data.sensors.camera.exposure import (
    ExposureControl,
    meter_ev100,
    meter_mean_ev100,
    reachable_ev100,
    saturation_cd_m2,
)


@pytest.mark.parametrize("luminance", [0.5, 40.0, 9000.0])
def test_metering_puts_a_uniform_view_at_middle_grey(luminance: float) -> None:
    """Whatever the light, its log-average becomes 0.18 of white."""
    view = np.full((48, 64, 3), luminance, np.float32)

    exposed = luminance / saturation_cd_m2(meter_ev100(view))

    assert exposed == pytest.approx(0.18, rel=0.002)


def test_metering_takes_the_logarithmic_mean_with_weight_in_the_centre() -> None:
    """Two halves of 10 and 1000 cd/m^2 meter like 100; a lamp in the corner less than ahead."""
    view = np.full((64, 64, 3), 10.0, np.float32)
    view[:, 32:] = 1000.0
    even = meter_ev100(np.full((64, 64, 3), 100.0, np.float32))
    corner, centre = (np.full((64, 64, 3), 10.0, np.float32) for _ in range(2))
    corner[:16, :16] = 1000.0
    centre[24:40, 24:40] = 1000.0

    assert meter_ev100(view) == pytest.approx(even, abs=0.2)
    assert meter_ev100(corner) < meter_ev100(centre)


def test_black_pixels_are_not_metered_and_darkness_is_finite() -> None:
    """A missing background does not brighten the picture."""
    view = np.full((64, 64, 3), 50.0, np.float32)
    half = view.copy()
    half[:32] = 0.0

    assert meter_ev100(half) == meter_ev100(view)

    assert meter_ev100(np.zeros((4, 4, 3), np.float32)) == 1.0


@pytest.mark.parametrize("mean", [0.18, 0.36, 0.6])
def test_metering_of_the_mean_reaches_it(mean: float) -> None:
    """The mean of the sensor's values: 1 where it saturates; within a step of 1/256 EV."""
    view = np.repeat(np.geomspace(3.0, 30_000.0, 4096).reshape(64, 64, 1), 3, axis=2)

    exposed = view / saturation_cd_m2(meter_mean_ev100(view.astype(np.float32), mean))

    assert np.minimum(exposed[::4, ::4], 1.0).mean() == pytest.approx(mean, rel=0.004)


def test_metering_of_the_mean_keeps_sunlit_ground_below_white() -> None:
    """A street, half of it in shade: the log-average, brightened by 0.8 stops, loses its road.

    By hand: 0.4 road of 5000, 0.1 sky of 8000, 0.5 shade of 300 cd/m^2 have a mean of 0.36 at a
    white of 8194 cd/m^2.
    """
    view = np.full((80, 80, 3), 300.0, np.float32)
    view[:32], view[32:40] = 5000.0, 8000.0

    white = saturation_cd_m2(meter_mean_ev100(view, 0.36))

    assert white == pytest.approx((0.4 * 5000 + 0.1 * 8000 + 0.5 * 300) / 0.36, rel=0.004)
    assert saturation_cd_m2(meter_ev100(view) - 0.8) < 5000.0 < white


def test_metering_of_the_mean_stops_before_too_much_saturates() -> None:
    """Sunlit snow of 9000 cd/m^2 on 0.3 of a dark view stays below white if 0.2 may saturate."""
    view = np.full((80, 80, 3), 200.0, np.float32)
    view[:24] = 9000.0

    white = saturation_cd_m2(meter_mean_ev100(view, 0.36, clipped=0.2))

    assert saturation_cd_m2(meter_mean_ev100(view, 0.36)) < 9000.0
    assert white == pytest.approx(9000.0, rel=0.003)
    assert white > 9000.0


def test_metering_stops_where_the_camera_does() -> None:
    """ISO 12232 by hand: f/2, 1/32 s and ISO 6400 reach log2(4 * 32 / 64) = 1."""
    limits = reachable_ev100(
        ExposureControl(f_number=2.0, time_s=(1 / 8192, 1 / 32), iso=(100, 6400))
    )
    dark, endless = np.full((8, 8, 3), 1e-6, np.float32), np.full((8, 8, 3), 1e9, np.float32)

    assert limits == pytest.approx((1.0, 15.0))
    assert meter_ev100(dark, limits) == meter_mean_ev100(dark, 0.36, 1.0, limits) == 1.0
    assert meter_ev100(endless, limits) == meter_mean_ev100(endless, 0.36, 1.0, limits) == 15.0

    assert meter_mean_ev100(np.zeros((8, 8, 3), np.float32), 0.36) == 1.0
    assert meter_mean_ev100(np.full((8, 8, 3), 1e9, np.float32), 0.36) == 17.0


@pytest.mark.parametrize("lux", [2.5, 2500.0, 80_000.0])
def test_exposure_values_are_those_of_a_light_meter(lux: float) -> None:
    """An incident-light meter, E = 2.5 lx 2^EV (ISO 2720, C = 250): grey is between grey and white.

    A card of 18 % under that light, exposed by the meter, is 0.12 of saturation: 0.18 * 2.5 / pi /
    1.2, which is where cameras put it, three stops below white.
    """
    grey_cd_m2 = 0.18 * lux / math.pi

    exposed = grey_cd_m2 / saturation_cd_m2(math.log2(lux / 2.5))

    assert exposed == pytest.approx(0.18 * 2.5 / math.pi / 1.2)
