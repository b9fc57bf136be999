"""Dropout: returns that are missing, by the transmittance of the scanner's window.

Statistic: the number of points of a sweep. Light passes the window twice: distant and dark surfaces
are lost first.
"""

import math

from gen_data.lab.matching import indirect_inference, recordings
from gen_data.lab.matching.quantities.base import LidarQuantity, power_of_two, round_digits
from gen_data.sensors.lidar.lidar_sensor import LidarSensor


def measure(scan: recordings.Scan) -> float:
    """Logarithm, base 2, of the number of points."""
    return math.log2(len(scan.range_m))


def _start(sensor: LidarSensor) -> float:
    return math.log2(sensor.window)


def _apply(sensor: LidarSensor, coordinate: float) -> LidarSensor:
    return sensor.model_copy(update={"window": round_digits(2.0**coordinate)})


DROPOUT = LidarQuantity(
    "dropout", "transmittance", "log2 of points per sweep", "window", measure, _start, _apply,
    indirect_inference.Axis(-4.0, 0.0, step=0.25, plausible=1.0, enough=0.05, varies=False),
    to_value=power_of_two,
)  # fmt: skip
