"""Range: the largest that a scanner reports.

Statistic: the range of 99.9 % of the points of a sweep.
"""

import math

import numpy as np

from gen_data.lab.matching import indirect_inference, recordings
from gen_data.lab.matching.quantities import base
from gen_data.sensors.lidar.lidar_sensor import LidarSensor

SHARE = 99.9


def measure(scan: recordings.Scan) -> float:
    """Logarithm, base 2, of the range that 99.9 % of the points are within."""
    return float(np.log2(max(float(np.percentile(scan.range_m, SHARE)), 1e-3)))


def _start(sensor: LidarSensor) -> float:
    return math.log2(sensor.device.range_m[1])


def _apply(sensor: LidarSensor, coordinate: float) -> LidarSensor:
    nearest_m = sensor.device.range_m[0]
    return base.with_model(
        sensor, range_m=(nearest_m, max(base.round_digits(2.0**coordinate), 1.01 * nearest_m))
    )


RANGE = base.LidarQuantity(
    "range", "m", "log2 of the range of 99.9 % of the points", "model.range_m",
    measure, _start, _apply,
    indirect_inference.Axis(0.0, 10.0, step=0.1, plausible=1.0, enough=0.05, varies=False),
    to_value=base.power_of_two,
)  # fmt: skip
