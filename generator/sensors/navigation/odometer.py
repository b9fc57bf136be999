"""What the wheels tell: distance, speed, yaw rate and steering.

Mounted at the middle of the rear axle. Wheels roll without slipping, and the front wheels point
across the line to the centre of the turn (Ackermann); the steering angle is that of the bicycle
model, ``atan(wheelbase * yaw rate / speed)``.
"""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from gen_data.generator.core.capture import Channel, Measurements
from gen_data.generator.core.interfaces import Renderer
from gen_data.generator.core.measurement_dtypes import table_rows
from gen_data.generator.core.scene import Scene
from gen_data.generator.core.se3 import Array
from gen_data.generator.core.streams import Rng
from gen_data.generator.sensors.mount_kinematics import MountMotion, mount_motion
from gen_data.generator.sensors.mounting import Instrument, reading_times

WALKING_M_S = 0.5
"""Below it a turn says nothing about the front wheels."""
PARTS = 4
"""Chords per reading by which distance is measured."""


class Odometer(Instrument):
    """Wheels and yaw rate: distance, speed, steering, and the speed of every wheel.

    Attributes:
        wheelbase_m: From the rear axle, where it is mounted, to the front axle.
        track_m: From left to right wheels.
        scale_error: Standard deviation of the share by which all speeds and distances are wrong:
            tyres that are worn or soft; drawn once per sequence.
        distance_step_m: Way per pulse of the wheels' encoder; 0 = exact.
        speed_noise_m_s, yaw_rate_noise_rad_s, steering_noise_rad: Standard deviations of white
            noise.
        yaw_rate_bias_rad_s: Standard deviation of a bias that is drawn once per sequence.
    """

    kind: ClassVar[str] = "odometer"
    type: Literal["odometer"] = "odometer"
    name: str = Field("odometer", pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")
    wheelbase_m: float = Field(2.7, gt=0, le=20)
    track_m: float = Field(1.55, gt=0, le=10)
    scale_error: float = Field(0.005, ge=0, le=0.5)
    distance_step_m: float = Field(0.04, ge=0, le=1)
    speed_noise_m_s: float = Field(0.02, ge=0)
    yaw_rate_noise_rad_s: float = Field(0.002, ge=0)
    yaw_rate_bias_rad_s: float = Field(0.001, ge=0)
    steering_noise_rad: float = Field(0.002, ge=0)

    def capture(
        self, scene: Scene, renderer: Renderer, channels: frozenset[Channel], rng: Rng
    ) -> Measurements:
        """The readings since the last step."""
        del renderer, channels
        times_s = reading_times(scene, self.rate_hz)
        ride = mount_motion(scene, self.name)
        scale, bias = rng.of_sequence().standard_normal(2)
        scale, bias = 1.0 + self.scale_error * scale, self.yaw_rate_bias_rad_s * bias
        speeds, rates = _forward(ride, times_s)
        distance_m = scale * _travelled(ride, times_s, self.rate_hz or 1.0 / scene.step_s)
        if self.distance_step_m > 0.0:
            distance_m = np.floor(distance_m / self.distance_step_m + 1e-6) * self.distance_step_m
        noise = rng.standard_normal((7, len(times_s)))
        wheels = scale * self._wheels(speeds, rates) + self.speed_noise_m_s * noise[3:]
        columns = {
            "distance_m": np.round(distance_m, 6),
            "speed_m_s": scale * speeds + self.speed_noise_m_s * noise[0],
            "yaw_rate_rad_s": rates + bias + self.yaw_rate_noise_rad_s * noise[1],
            "steering_rad": self._steering(speeds, rates) + self.steering_noise_rad * noise[2],
            "wheel_rear_left_m_s": wheels[0],
            "wheel_rear_right_m_s": wheels[1],
            "wheel_front_left_m_s": wheels[2],
            "wheel_front_right_m_s": wheels[3],
        }
        rows = table_rows("odometer", len(times_s), time_s=times_s, **columns)
        return Measurements(self.name, scene.device(self.name), rows, scene.time_s)

    def _steering(self, speeds: Array, rates: Array) -> Array:
        """Angle of the front wheels, [n]."""
        rolling = np.abs(speeds) > WALKING_M_S
        curvature = np.divide(rates, speeds, out=np.zeros_like(rates), where=rolling)
        return np.arctan(self.wheelbase_m * curvature)

    def _wheels(self, speeds: Array, rates: Array) -> Array:
        """Speeds of the rims: rear left and right, front left and right, [4, n]."""
        half = 0.5 * self.track_m * rates
        rear = np.stack([speeds - half, speeds + half])
        front = np.copysign(np.hypot(rear, self.wheelbase_m * rates), rear)
        return np.concatenate([rear, front])


def _forward(ride: MountMotion, times_s: Array) -> tuple[Array, Array]:
    """Speed forward and rate of turning to the left, [n] each."""
    speeds, rates = [], []
    for time_s in times_s:
        axes = ride.pose(float(time_s)).inverse()
        speeds.append(axes.rotate(ride.velocity_m_s(float(time_s)))[0])
        turning = np.asarray(ride.twist(float(time_s)).angular_velocity_rad_s)
        rates.append(axes.rotate(turning)[2])
    return np.array(speeds), np.array(rates)


def _travelled(ride: MountMotion, times_s: Array, rate_hz: float) -> Array:
    """Way since time 0, backwards counted down, [n]; measured anew at every step."""
    count = round(float(times_s[-1]) * rate_hz) * PARTS
    poses = [ride.pose(k / (rate_hz * PARTS)) for k in range(count + 1)]
    places_m = np.array([pose.translation_m for pose in poses])
    forward = np.array([pose.rotation()[:, 0] for pose in poses])
    steps = np.diff(places_m, axis=0)
    lengths_m = np.sqrt(np.sum(steps**2, axis=1))
    signed = np.copysign(lengths_m, np.sum(steps * forward[:-1], axis=1))
    way_m = np.concatenate([[0.0], np.cumsum(signed)])
    rows = [round(float(t) * rate_hz) * PARTS for t in times_s]
    return way_m[rows]
