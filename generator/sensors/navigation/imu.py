"""An inertial unit: specific force and angular rate.

The errors of each axis are a bias that is there when it is switched on, a random walk of the bias,
and white noise, the three terms by which data sheets and calibrations describe them (IEEE Std 952;
Woodman, "An introduction to inertial navigation", 2007). White noise of density ``n`` read at rate
``f`` has a deviation of ``n sqrt(f)``; a walk of density ``w`` grows by ``w / sqrt(f)`` a reading.
"""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import AfterValidator, Field

from gen_data.generator.config.base_model import Strict
from gen_data.generator.core.capture import Channel, Measurements
from gen_data.generator.core.interfaces import Renderer
from gen_data.generator.core.measurement_dtypes import IMU, table_rows
from gen_data.generator.core.scene import Scene
from gen_data.generator.core.se3 import Array
from gen_data.generator.core.streams import Rng
from gen_data.generator.sensors.device_presets import check_preset, load_preset
from gen_data.generator.sensors.mount_kinematics import mount_motion
from gen_data.generator.sensors.mounting import Instrument, reading_times

MAKES = "gen_data.generator.sensors.navigation.imu_presets"
GRAVITY_M_S2 = 9.80665
AXES = tuple(column.name for column in IMU[1:])


class Errors(Strict):
    """How the three axes of an accelerometer [m/s^2] or a gyroscope [rad/s] err.

    Attributes:
        noise: Density of the white noise, unit per root hertz.
        bias: Standard deviation of the bias when it is switched on.
        bias_random_walk: Density of the bias's random walk, unit per second and root hertz.
        full_scale: The largest value that it can tell.
    """

    noise: float = Field(ge=0)
    bias: float = Field(ge=0)
    bias_random_walk: float = Field(ge=0)
    full_scale: float = Field(gt=0)


class ImuModel(Strict):
    """A make of inertial unit."""

    accelerometer: Errors
    gyroscope: Errors


class Imu(Instrument):
    """An inertial unit: specific force and angular rate, several readings per step.

    Attributes:
        model: ``RT3003``, ``ADIS16448`` or ``BMI088``; a file of
            ``generator/sensors/navigation/imu_presets``.
        noise: Factor on the model's errors; 0 = an ideal device.
    """

    kind: ClassVar[str] = "imu"
    type: Literal["imu"] = "imu"
    name: str = Field("imu", pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")
    model: Annotated[str, AfterValidator(lambda name: check_preset(MAKES, name))] = "RT3003"
    rate_hz: float | None = Field(100.0, gt=0, le=10_000)
    noise: float = Field(1.0, ge=0)

    @property
    def device_model(self) -> str:
        """What it is, for the labels."""
        return self.model

    def capture(
        self, scene: Scene, renderer: Renderer, channels: frozenset[Channel], rng: Rng
    ) -> Measurements:
        """The readings since the last step."""
        del renderer, channels
        times_s = reading_times(scene, self.rate_hz)
        true = _felt(scene, self.name, times_s)
        make = load_preset(MAKES, self.model, ImuModel)
        rate_hz = self.rate_hz or 1.0 / scene.step_s
        read = true + self.noise * _errors(make, times_s, rate_hz, rng)
        if self.noise > 0.0:
            limits = _of_axes(make, "full_scale")
            read = np.clip(read, -limits, limits)
        columns = dict(zip(AXES, np.round(read, 9).T, strict=True))
        rows = table_rows("imu", len(times_s), time_s=times_s, **columns)
        return Measurements(self.name, scene.device(self.name), rows, scene.time_s)


def _felt(scene: Scene, name: str, times_s: Array) -> Array:
    """True specific force and angular rate in the device's axes, [n, 6]."""
    ride = mount_motion(scene, name)
    felt = []
    for time_s in times_s:
        T_world_device, acceleration, rate = ride.felt(float(time_s))
        upward = T_world_device.inverse().rotate(np.array([0.0, 0.0, GRAVITY_M_S2]))
        felt.append(np.concatenate([acceleration + upward, rate]))
    return np.array(felt)


def _errors(make: ImuModel, times_s: Array, rate_hz: float, rng: Rng) -> Array:
    """What is added to the truth, [n, 6]: bias, its walk since time 0, and white noise.

    The walk is drawn from the beginning at every step, so that any instant can be made alone.
    """
    shared = rng.of_sequence()
    bias = _of_axes(make, "bias") * shared.standard_normal(6)
    last = round(float(times_s[-1]) * rate_hz)
    walked = np.cumsum(shared.standard_normal((last + 1, 6)), axis=0)
    rows = np.rint(times_s * rate_hz).astype(int)
    walk = _of_axes(make, "bias_random_walk") / math.sqrt(rate_hz) * walked[rows]
    white = _of_axes(make, "noise") * math.sqrt(rate_hz) * rng.standard_normal((len(times_s), 6))
    errors: Array = bias + walk + white
    return errors


def _of_axes(make: ImuModel, field: str) -> Array:
    """A figure of both triads, by axis, [6]."""
    return np.repeat([getattr(make.accelerometer, field), getattr(make.gyroscope, field)], 3)
