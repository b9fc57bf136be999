"""Wheel odometer: distance, speed, yaw rate, steering angle and wheel speeds.

Example, for a scene with a rig ``ego`` at the middle of the rear axle::

    sensors:
      - type: odometer
        name: wheels
        rig: ego
        rate_hz: 50

``sample.measurements["wheels"]`` then holds the readings since the last step, with the fields
``time_s``, ``distance_m``, ``speed_m_s``, ``yaw_rate_rad_s``, ``steering_rad`` and the rim speeds
``wheel_rear_left_m_s`` ... ``wheel_front_right_m_s``.

Wheels roll without slip, with Ackermann geometry at the front; the steering angle follows the
bicycle model, ``atan(wheelbase * yaw rate / speed)``.
"""

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from gen_data.config.base_model import NAME_PATTERN
from gen_data.core.capture import Channel, Measurements
from gen_data.core.interfaces import Renderer
from gen_data.core.measurement_dtypes import TIME, Column, table_rows
from gen_data.core.scene import Scene
from gen_data.core.se3 import Array
from gen_data.core.streams import Rng
from gen_data.sensors.mounting import Instrument, MountMotion, mount_motion, reading_times

COLUMNS = (
    TIME,
    Column("distance_m", "<f8", "travelled since the beginning; backwards counts down"),
    Column("speed_m_s", "<f4", "forward"),
    Column("yaw_rate_rad_s", "<f4", "to the left"),
    Column("steering_rad", "<f4", "of the front wheels, to the left; 0 below walking pace"),
    Column("wheel_rear_left_m_s", "<f4", "speed of the wheel's rim"),
    Column("wheel_rear_right_m_s", "<f4", "speed of the wheel's rim"),
    Column("wheel_front_left_m_s", "<f4", "speed of the wheel's rim"),
    Column("wheel_front_right_m_s", "<f4", "speed of the wheel's rim"),
)
WALKING_M_S = 0.5
"""Below this speed the steering angle is not observable and reported as 0."""
CHORDS = 4
"""Chords per reading that approximate the driven curve."""


class Odometer(Instrument):
    """A wheel odometer: distance, speed, yaw rate, steering angle and the speed of every wheel.

    Attributes:
        wheelbase_m: Distance from the rear axle, where it is mounted, to the front axle.
        track_m: Distance between left and right wheels.
        scale_error: Standard deviation of the relative error of all speeds and distances, caused
            by worn or soft tyres; drawn once per sequence.
        distance_step_m: Distance per pulse of the wheels' encoder; 0 = exact.
        speed_noise_m_s, yaw_rate_noise_rad_s, steering_noise_rad: Standard deviations of white
            noise.
        yaw_rate_bias_rad_s: Standard deviation of a bias that is drawn once per sequence.
    """

    kind: ClassVar[str] = "odometer"
    columns: ClassVar[tuple[Column, ...]] = COLUMNS
    type: Literal["odometer"] = "odometer"
    name: str = Field("odometer", pattern=NAME_PATTERN)
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
        """Read the odometer at the instants since the last step."""
        del renderer, channels
        times_s = reading_times(scene, self.rate_hz)
        motion = mount_motion(scene, self.name)
        scale, bias = rng.of_sequence().standard_normal(2)
        scale, bias = 1.0 + self.scale_error * scale, self.yaw_rate_bias_rad_s * bias
        speeds, rates = _speeds_and_yaw_rates(motion, times_s)
        rate_hz = self.rate_hz or 1.0 / scene.step_s
        distance_m = scale * _measure_distance_m(motion, times_s, rate_hz)
        if self.distance_step_m > 0.0:
            # The offset keeps a distance that ends on a pulse from being rounded below it.
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
        rows = table_rows(COLUMNS, len(times_s), time_s=times_s, **columns)
        return Measurements(self.name, scene.device(self.name), rows, scene.time_s)

    def _steering(self, speeds: Array, rates: Array) -> Array:
        """Steering angle of the bicycle model [rad], [n]."""
        rolling = np.abs(speeds) > WALKING_M_S
        curvature = np.divide(rates, speeds, out=np.zeros_like(rates), where=rolling)
        return np.arctan(self.wheelbase_m * curvature)

    def _wheels(self, speeds: Array, rates: Array) -> Array:
        """Rim speeds [m/s]: rear left and right, front left and right, [4, n]."""
        half = 0.5 * self.track_m * rates
        rear = np.stack([speeds - half, speeds + half])
        front = np.copysign(np.hypot(rear, self.wheelbase_m * rates), rear)
        return np.concatenate([rear, front])


def _speeds_and_yaw_rates(motion: MountMotion, times_s: Array) -> tuple[Array, Array]:
    """Forward speed [m/s] and yaw rate to the left [rad/s], [n] each."""
    speeds, rates = [], []
    for time_s in times_s:
        axes = motion.pose(float(time_s)).inverse()
        speeds.append(axes.rotate(motion.velocity_m_s(float(time_s)))[0])
        angular_velocity = np.asarray(motion.twist(float(time_s)).angular_velocity_rad_s)
        rates.append(axes.rotate(angular_velocity)[2])
    return np.array(speeds), np.array(rates)


def _measure_distance_m(motion: MountMotion, times_s: Array, rate_hz: float) -> Array:
    """Signed distance travelled since time 0, [n]; reversing counts down.

    Measured from time 0 at every step, to let each step be generated alone.
    """
    count = round(float(times_s[-1]) * rate_hz) * CHORDS
    poses = [motion.pose(k / (rate_hz * CHORDS)) for k in range(count + 1)]
    places_m = np.array([pose.translation_m for pose in poses])
    forward = np.array([pose.rotation()[:, 0] for pose in poses])
    steps = np.diff(places_m, axis=0)
    lengths_m = np.sqrt(np.sum(steps**2, axis=1))
    signed = np.copysign(lengths_m, np.sum(steps * forward[:-1], axis=1))
    distance_m = np.concatenate([[0.0], np.cumsum(signed)])
    rows = [round(float(t) * rate_hz) * CHORDS for t in times_s]
    return distance_m[rows]
