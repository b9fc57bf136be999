"""Reflectance gain: the intensity that a scanner reports for white.

Statistic: mean of the middle half of the intensities above 0, which neither missing returns nor
retro-reflectors move.
"""

import math

import numpy as np

from gen_data.lab.matching import indirect_inference, recordings
from gen_data.lab.matching.quantities import base
from gen_data.sensors.lidar.lidar_sensor import LidarSensor


def measure(scan: recordings.Scan) -> float:
    """Logarithm, base 2, of the interquartile mean of intensities; NaN if all are 0."""
    lit = np.sort(scan.intensity[scan.intensity > 0.0])
    middle = lit[len(lit) // 4 : len(lit) - len(lit) // 4]
    return float(np.log2(middle.mean())) if len(middle) else float("nan")


def _start(sensor: LidarSensor) -> float:
    return math.log2(sensor.device.white_intensity)


def _apply(sensor: LidarSensor, coordinate: float) -> LidarSensor:
    return base.with_model(sensor, white_intensity=base.round_digits(2.0**coordinate))


REFLECTANCE = base.LidarQuantity(
    "reflectance gain", "intensity of white", "log2 of mean intensity of the middle half",
    "model.white_intensity", measure, _start, _apply,
    indirect_inference.Axis(-7.0, 0.0, step=0.3, plausible=1.5, enough=0.1, varies=False),
    to_value=base.power_of_two,
)  # fmt: skip
