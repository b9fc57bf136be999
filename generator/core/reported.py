"""Reported values of sensors, where faults make them differ from the true ones.

The truth is in the fields of a reading; its ``faults`` state what the sensor reports instead.
"""

from gen_data.core.capture import Measurements, PointCloud, SensorReading
from gen_data.core.measurement_dtypes import TIME_DECIMALS

CLOCK = "clock"
"""Key of the record of a clock in ``faults``; see ``sensors.sensor_faults.Clock``."""


def clock_error_s(reading: SensorReading | PointCloud | Measurements) -> float:
    """Reported minus true instant of a reading [s]; 0 with a true clock."""
    clock = reading.faults.get(CLOCK)
    return 0.0 if clock is None else float(clock["reported_s"]) - reading.time_s


def reported_s(reading: SensorReading | PointCloud | Measurements) -> float:
    """Stamp of a reading [s]: ``time_s``, unless the sensor's clock is wrong."""
    return delayed_s(reading.time_s, clock_error_s(reading))


def delayed_s(time_s: float, error_s: float) -> float:
    """An instant with an error [s], rounded; the same instant without one."""
    return round(time_s + error_s, TIME_DECIMALS) if error_s else time_s
