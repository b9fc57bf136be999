"""Reported values of sensors, where faults make them differ from the true ones.

The truth is in the fields of a reading; its ``faults`` state the reported values.
"""

from dataclasses import replace
from typing import Any, TypeVar

from gen_data.core.capture import Measurements, PointCloud, SensorReading
from gen_data.core.measurement_dtypes import TIME_DECIMALS
from gen_data.core.scene import Camera, Device, Lidar

Mounted = TypeVar("Mounted", bound=Camera | Lidar | Device)
POSES = {
    Camera: ("T_rig_camera", "T_world_camera"),
    Lidar: ("T_rig_lidar", "T_world_lidar"),
    Device: ("T_rig_device", "T_world_device"),
}
"""Fields of the poses of a sensor on its rig and in the world."""

CLOCK = "clock"
"""Key of the record of a clock in ``faults``; see ``sensors.sensor_faults.Clock``."""
DELIVERY = "delivery"
"""Key of the record of a reading's delivery; see ``sensors.sensor_faults.Delivery``."""


def clock_error_s(reading: SensorReading | PointCloud | Measurements) -> float:
    """Reported minus true instant of a reading [s]; 0 with a true clock."""
    clock = reading.faults.get(CLOCK)
    return 0.0 if clock is None else float(clock["reported_s"]) - reading.time_s


def reported_s(reading: SensorReading | PointCloud | Measurements) -> float:
    """Stamp of a reading [s]: ``time_s``, unless the sensor's clock is wrong."""
    return delayed_s(reading.time_s, clock_error_s(reading))


def arrived_s(reading: SensorReading | PointCloud | Measurements) -> float:
    """Instant [s], by a true clock, at which a reading arrives: ``time_s``, unless it is late."""
    return float(reading.faults.get(DELIVERY, {}).get("arrived_s", reading.time_s))


def copies(reading: SensorReading | PointCloud | Measurements) -> int:
    """How many times a reading arrives, from 0."""
    record = reading.faults.get(DELIVERY, {})
    return 0 if record.get("lost") else 2 if record.get("doubled") else 1


def delayed_s(time_s: float, error_s: float) -> float:
    """An instant with an error [s], rounded; the same instant without one."""
    return round(time_s + error_s, TIME_DECIMALS) if error_s else time_s


def reported(sensor: Mounted) -> Mounted:
    """A sensor where its calibration states it to be, on its rig and in the world."""
    error = sensor.T_sensor_reported
    if error is None:
        return sensor
    on_rig, in_world = POSES[type(sensor)]
    poses: dict[str, Any] = {
        on_rig: (getattr(sensor, on_rig) @ error).rounded(9),
        in_world: (getattr(sensor, in_world) @ error).rounded(),
    }
    return replace(sensor, T_sensor_reported=None, **poses)


def mounted_of(reading: SensorReading | PointCloud | Measurements) -> Camera | Lidar | Device:
    """The camera, laser scanner or device of a reading."""
    if isinstance(reading, SensorReading):
        return reading.camera
    return reading.lidar if isinstance(reading, PointCloud) else reading.device
