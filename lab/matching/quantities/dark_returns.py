"""Dark returns: surfaces whose signal is too weak for the scanner to report an intensity.

Statistic: the share of the points of a sweep whose intensity is 0.
"""

from gen_data.lab.matching import indirect_inference, recordings
from gen_data.lab.matching.quantities.base import LidarQuantity, identity, round_digits, with_model
from gen_data.sensors.lidar.lidar_sensor import LidarSensor

LEAST = 0.1
"""Smallest signal at which the search begins: one below all surfaces shows in no scan."""


def measure(scan: recordings.Scan) -> float:
    """Share of the points with intensity 0."""
    return float((scan.intensity <= 0.0).mean())


def _start(sensor: LidarSensor) -> float:
    response = sensor.device.response
    return 0.0 if response is None else response.dark


def _apply(sensor: LidarSensor, dark: float) -> LidarSensor:
    response = sensor.device.response
    assert response is not None
    changed = response.model_copy(update={"dark": round_digits(dark)})
    return with_model(sensor, response=changed)


DARK_RETURNS = LidarQuantity(
    "dark returns", "signal that reads 0", "share of points with intensity 0",
    "model.response.dark", measure, _start, _apply,
    indirect_inference.Axis(0.0, 1.0, step=0.05, plausible=0.3, enough=0.03, varies=False),
    to_value=identity,
)  # fmt: skip
