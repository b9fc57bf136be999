"""Inertial measurement unit (IMU): accelerometer and gyroscope.

Example, for a scene with a rig ``ego``::

    sensors:
      - type: imu
        name: imu
        rig: ego
        model: ADIS16448
        rate_hz: 100

``sample.measurements["imu"]`` then holds the readings since the last step, with the fields
``time_s``, ``force_x_m_s2`` ... ``force_z_m_s2`` (specific force) and ``rate_x_rad_s`` ...
``rate_z_rad_s`` (angular rate), axes X forward, Y left, Z up. At rest ``force_z_m_s2`` is 9.8.

The errors of each axis are a turn-on bias, a random walk of the bias, and white noise, the terms
of data sheets and calibrations (IEEE Std 952; Woodman, "An introduction to inertial navigation",
2007). White noise of density ``n`` sampled at rate ``f`` has standard deviation ``n sqrt(f)``; a
random walk of density ``w`` has increments of ``w / sqrt(f)``.
"""

import math
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import AfterValidator, Field

from gen_data.config.base_model import NAME_PATTERN, Strict
from gen_data.core.capture import Channel, Measurements
from gen_data.core.interfaces import Renderer
from gen_data.core.measurement_dtypes import TIME, Column, table_rows
from gen_data.core.scene import Scene
from gen_data.core.se3 import Array
from gen_data.core.streams import Rng
from gen_data.sensors.device_presets import check_preset, load_preset
from gen_data.sensors.mounting import Instrument, mount_motion, reading_times
from gen_data.sensors.navigation.navigation_faults import ImuFaults

COLUMNS = (
    TIME,
    Column("force_x_m_s2", "<f8", "specific force forward: acceleration minus gravity"),
    Column("force_y_m_s2", "<f8", "to the left"),
    Column("force_z_m_s2", "<f8", "upward; 9.8 at rest"),
    Column("rate_x_rad_s", "<f8", "angular rate about the forward axis"),
    Column("rate_y_rad_s", "<f8", "about the left axis"),
    Column("rate_z_rad_s", "<f8", "about the upward axis"),
)
PRESETS = "gen_data.sensors.navigation.imu_presets"
GRAVITY_M_S2 = 9.80665
AXES = tuple(column.name for column in COLUMNS[1:])


class Errors(Strict):
    """Errors of the axes of an accelerometer (unit m/s^2) or a gyroscope (unit rad/s).

    Attributes:
        noise: Density of the white noise, unit per root hertz.
        bias: Standard deviation of the turn-on bias.
        bias_random_walk: Density of the bias's random walk, unit per second and root hertz.
        full_scale: Largest value that it reports.
    """

    noise: float = Field(ge=0)
    bias: float = Field(ge=0)
    bias_random_walk: float = Field(ge=0)
    full_scale: float = Field(gt=0)


class ImuModel(Strict):
    """Data sheet of an IMU."""

    accelerometer: Errors
    gyroscope: Errors


class Imu(Instrument):
    """An IMU: specific force and angular rate, several readings per step.

    Attributes:
        model: ``RT3003``, ``ADIS16448`` or ``BMI088``; a file of
            ``generator/sensors/navigation/imu_presets``.
        noise: Factor on the model's errors; 0 = an ideal device.
        faults: Steps of the biases; null = none.
    """

    kind: ClassVar[str] = "imu"
    columns: ClassVar[tuple[Column, ...]] = COLUMNS
    type: Literal["imu"] = "imu"
    name: str = Field("imu", pattern=NAME_PATTERN)
    model: Annotated[str, AfterValidator(lambda name: check_preset(PRESETS, name))] = "RT3003"
    rate_hz: float | None = Field(100.0, gt=0, le=10_000)
    noise: float = Field(1.0, ge=0)
    faults: ImuFaults | None = None

    def capture(
        self, scene: Scene, renderer: Renderer, channels: frozenset[Channel], rng: Rng
    ) -> Measurements:
        """Read force and rate at the instants since the last step."""
        del renderer, channels
        times_s = reading_times(scene, self.rate_hz)
        truth = _true_readings(scene, self.name, times_s)
        model = load_preset(PRESETS, self.model, ImuModel)
        rate_hz = self.rate_hz or 1.0 / scene.step_s
        readings = truth + self.noise * _draw_errors(model, times_s, rate_hz, rng)
        if self.noise > 0.0:
            limits = _per_axis(model, "full_scale")
            readings = np.clip(readings, -limits, limits)
        columns = dict(zip(AXES, np.round(readings, 9).T, strict=True))
        rows = table_rows(COLUMNS, len(times_s), time_s=times_s, **columns)
        read = Measurements(self.name, scene.device(self.name), rows, scene.time_s)
        return read if self.faults is None else self.faults.apply(read, AXES, rng)


def _true_readings(scene: Scene, name: str, times_s: Array) -> Array:
    """Specific force and angular rate without errors, device axes, [n, 6]."""
    motion = mount_motion(scene, name)
    readings = []
    for time_s in times_s:
        T_world_device, acceleration, rate = motion.inertial_motion(float(time_s))
        # Specific force is acceleration minus gravity, which points down.
        upward = T_world_device.inverse().rotate(np.array([0.0, 0.0, GRAVITY_M_S2]))
        readings.append(np.concatenate([acceleration + upward, rate]))
    return np.array(readings)


def _draw_errors(model: ImuModel, times_s: Array, rate_hz: float, rng: Rng) -> Array:
    """Bias, its random walk since time 0, and white noise, [n, 6].

    The walk is drawn from time 0 at every step, to let each step be generated alone.
    """
    shared = rng.of_sequence()
    bias = _per_axis(model, "bias") * shared.standard_normal(6)
    last = round(float(times_s[-1]) * rate_hz)
    walks = np.cumsum(shared.standard_normal((last + 1, 6)), axis=0)
    rows = np.rint(times_s * rate_hz).astype(int)
    walk = _per_axis(model, "bias_random_walk") / math.sqrt(rate_hz) * walks[rows]
    white = _per_axis(model, "noise") * math.sqrt(rate_hz) * rng.standard_normal((len(times_s), 6))
    return np.asarray(bias + walk + white)


def _per_axis(model: ImuModel, field: str) -> Array:
    """A value of the data sheet for each axis: three of force, three of rate, [6]."""
    return np.repeat([getattr(model.accelerometer, field), getattr(model.gyroscope, field)], 3)
