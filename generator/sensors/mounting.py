"""Mounting of sensors on rigs and cameras, and their rates."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar

import numpy as np
from pydantic import Field

from gen_data.generator.config.base_model import Strict
from gen_data.generator.core.capture import Channel
from gen_data.generator.core.errors import ConfigError, did_you_mean
from gen_data.generator.core.interfaces import AssetIndex, Modality, SensorInfo
from gen_data.generator.core.lens import LensModel
from gen_data.generator.core.measurement_dtypes import TABLE_COLUMNS, TIME_DECIMALS
from gen_data.generator.core.scene import Camera, Device, Lidar, Scene
from gen_data.generator.core.scene_time import RIG_AXES
from gen_data.generator.core.se3 import SE3, Array

BURIED_M = 0.05
"""Allowed depth of a sensor inside its body's bounding box, which is larger than the body."""


class Mounted(Strict):
    """Base of sensors that may be mounted on a rig.

    Attributes:
        rig: Name of the rig it is mounted on: an ego vehicle's, an arm's wrist; empty = none.
        offset_m: Position on the rig: forward, left, up.
        yaw_deg, pitch_deg, roll_deg: Rotation from the rig's forward axis: to the left, then
            upwards, then clockwise as seen from behind.
        rate_hz: Readings per second; null = one per step.
        time_offset_s: Delay of its readings after the step's instant; the reading and its labels
            belong to the step.
        inside: Whether it may be inside the body that carries its rig.
    """

    rig: str = ""
    offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw_deg: float = Field(0.0, ge=-180, le=180)
    pitch_deg: float = Field(0.0, ge=-90, le=90)
    roll_deg: float = Field(0.0, ge=-180, le=180)
    rate_hz: float | None = Field(None, gt=0, le=10_000)
    time_offset_s: float = Field(0.0, ge=-10, le=10)
    inside: bool = False

    @property
    def T_rig_sensor(self) -> SE3:  # noqa: N802
        """Pose on the rig; both frames are X forward, Y left, Z up."""
        half_pitch, half_roll = (
            -0.5 * math.radians(self.pitch_deg),
            0.5 * math.radians(self.roll_deg),
        )
        pitch = SE3((0.0, 0.0, 0.0), (math.cos(half_pitch), 0.0, math.sin(half_pitch), 0.0))
        roll = SE3((0.0, 0.0, 0.0), (math.cos(half_roll), math.sin(half_roll), 0.0, 0.0))
        yaw = SE3.about_z(math.radians(self.yaw_deg), self.offset_m)
        return (yaw @ pitch @ roll).rounded()

    def _camera_info(self, name: str, channels: tuple[Channel, ...], lens: LensModel) -> SensorInfo:
        """Description of a camera that writes these channels."""
        return SensorInfo(
            name,
            Modality.CAMERA,
            channels=channels,
            lens=lens,
            rate_hz=self.rate_hz,
            time_offset_s=self.time_offset_s,
            needs_clear_view=not self.inside,
        )

    def _device_info(self, name: str, kind: str, needs_clear_view: bool = False) -> SensorInfo:
        """Description of a device of one of the kinds in ``TABLE_COLUMNS``."""
        return SensorInfo(
            name,
            Modality.DEVICE,
            kind,
            columns=TABLE_COLUMNS[kind],
            rate_hz=self.rate_hz,
            time_offset_s=self.time_offset_s,
            needs_clear_view=needs_clear_view,
        )


class Instrument(Mounted):
    """Base of sensors on a rig that report rows of a table.

    Attributes:
        name: Its name in files.
        rig: Name of the rig it is mounted on.
        rate_hz: Readings per second: a whole number per step, or one every few whole steps; null
            = one per step.
    """

    kind: ClassVar[str]
    name: str = Field("instrument", pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")
    rig: str = "ego"

    @property
    def device_model(self) -> str:
        """Name of the device's model in labels; empty = none."""
        return ""

    def describe(self) -> SensorInfo:
        """Describe a device with the columns of its kind."""
        return self._device_info(self.name, self.kind)

    def mount(self, scene: Scene) -> Scene:
        """Add this device to its rig.

        Raises:
            ConfigError: the rig does not exist, or the rate does not fit the sequence.
        """
        rig = check_rig(scene, self.name, self.rig)
        check_rate(self.name, self.rate_hz, scene.step_s)
        device = Device(self.name, self.kind, rig, self.T_rig_sensor, model=self.device_model)
        return replace(scene, devices=(*scene.devices, device))


def check_rig(scene: Scene, sensor: str, rig: str) -> str:
    """Return the name of an existing rig.

    Raises:
        ConfigError: the scene has no such rig.
    """
    known = [r.name for r in scene.rigs]
    if rig not in known:
        raise ConfigError(
            f"sensor '{sensor}': the scene has no rig '{rig}'; its rigs: "
            f"{', '.join(known) or 'none'}{did_you_mean(rig, known)}"
        )
    return rig


def add_lidar(scene: Scene, sensor: Mounted, lidar: Lidar) -> Scene:
    """Add a scanner on its sensor's rig, or at its camera if the sensor has no rig.

    Args:
        scene: With all sensors that are listed before this one.
        sensor: The sensor's mounting.
        lidar: Names the camera to mount it at if there is no rig.

    Raises:
        ConfigError: the scene has no such rig or camera.
    """
    if sensor.rig:
        rig = check_rig(scene, lidar.name, sensor.rig)
        return replace(scene, lidars=(*scene.lidars, replace(lidar, camera="", rig=rig)))
    find_camera(scene, lidar.name, lidar.camera)
    return replace(scene, lidars=(*scene.lidars, lidar))


def find_camera(scene: Scene, sensor: str, camera: str) -> Camera:
    """The camera of that name.

    Raises:
        ConfigError: the scene has no such camera.
    """
    known = {c.name: c for c in scene.cameras}
    if camera not in known:
        raise ConfigError(
            f"sensor '{sensor}': no camera '{camera}' is listed before it; cameras listed so far: "
            f"{', '.join(known) or 'none'}{did_you_mean(camera, known)}"
        )
    return known[camera]


def check_not_buried(scene: Scene, name: str, assets: AssetIndex) -> None:
    """Refuse a sensor on a rig inside the body that carries the rig, which would occlude it.

    Inside means in the body's bounding box, more than ``BURIED_M`` from its faces.

    Args:
        scene: With the sensor mounted.
        name: Of the sensor.
        assets: Source of the body's bounds.

    Raises:
        ConfigError: the sensor is inside.
    """
    rig_name, T_rig_sensor = find_mounting(scene, name)
    if not rig_name:
        return
    rig = scene.rig(rig_name)
    body = scene.body(rig.body)
    low_m, high_m = assets.bounds_m(body.asset)
    place_m = (rig.T_body_rig @ T_rig_sensor).translation_m
    depth_m = min(
        min(at - body.scale * low, body.scale * high - at)
        for at, low, high in zip(place_m, low_m, high_m, strict=True)
    )
    if depth_m > BURIED_M:
        top_m = body.scale * high_m[2] - rig.T_body_rig.translation_m[2]
        raise ConfigError(
            f"sensor '{name}': offset_m is {depth_m:.2f} m inside '{rig.body}', which carries rig"
            f" '{rig.name}'; move it out (the body's top is at {top_m:.2f} m on the rig), or set"
            " inside: true"
        )


def find_mounting(scene: Scene, name: str) -> tuple[str, SE3]:
    """Rig of a camera, laser scanner or device, and its pose on it; empty name = no rig.

    Raises:
        KeyError: the scene has no sensor of that name.
    """
    for camera in scene.cameras:
        if camera.name == name:
            return camera.rig, camera.T_rig_camera @ RIG_AXES
    for lidar in scene.lidars:
        if lidar.name == name:
            return lidar.rig, lidar.T_rig_lidar
    for device in scene.devices:
        if device.name == name:
            return device.rig, device.T_rig_device
    raise KeyError(name)


def stride(sensor: str, rate_hz: float | None, step_s: float) -> int:
    """Steps from one reading to the next of a sensor that is not faster than the sequence.

    Raises:
        ConfigError: the period is not a whole number of steps.
    """
    if rate_hz is None:
        return 1
    steps = 1.0 / (rate_hz * step_s)
    if steps < 0.999 or abs(steps - round(steps)) > 1e-6 * steps:
        k = max(1, round(steps))
        raise ConfigError(
            f"sensor '{sensor}': rate_hz {rate_hz:g} does not fit step_s {step_s:g}; expected a"
            f" whole number of steps between readings, such as {1.0 / (k * step_s):g} Hz"
        )
    return round(steps)


def within_steps(rate_hz: float | None, step_s: float) -> bool:
    """Whether a sensor reads several times per step."""
    return rate_hz is not None and rate_hz * step_s > 1.0 + 1e-6


def check_rate(sensor: str, rate_hz: float | None, step_s: float) -> None:
    """Refuse a rate that does not fit the steps of the sequence.

    Raises:
        ConfigError: it is neither a whole number of readings per step nor of steps per reading.
    """
    if rate_hz is None or not within_steps(rate_hz, step_s):
        stride(sensor, rate_hz, step_s)
        return
    readings = rate_hz * step_s
    if abs(readings - round(readings)) > 1e-6 * readings:
        raise ConfigError(
            f"sensor '{sensor}': rate_hz {rate_hz:g} does not fit step_s {step_s:g}; expected a"
            f" whole number of readings per step, such as {round(readings) / step_s:g} Hz"
        )


def reading_times(scene: Scene, rate_hz: float | None) -> Array:
    """Instants [s] of the readings in the step that ends at the scene's instant, [n].

    A single one at time 0.
    """
    step_s = scene.step_s
    if scene.time_s <= 0.0 or rate_hz is None or not within_steps(rate_hz, step_s):
        return np.array([scene.time_s])
    count = round(rate_hz * step_s)
    last = round(scene.time_s * rate_hz)
    return np.round(np.arange(last - count + 1, last + 1) / rate_hz, TIME_DECIMALS)


def window_s(scene: Scene, rate_hz: float | None) -> tuple[float, float]:
    """Start and end [s] of the interval that a reading covers: a step, or a longer period."""
    period_s = max(scene.step_s, 1.0 / rate_hz if rate_hz else 0.0)
    return max(round(scene.time_s - period_s, TIME_DECIMALS), 0.0), scene.time_s
