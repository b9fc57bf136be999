"""Where a sensor is mounted, and how often it reads."""

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
"""Sensors may sink in as deep as this: they are bolted on, and bounds are not the hull."""


class Mounted(Strict):
    """A sensor that may be on a rig.

    Attributes:
        rig: Name of the rig it is on: an ego vehicle's, an arm's wrist; empty = none.
        offset_m: On the rig: forward, left, up.
        yaw_deg, pitch_deg, roll_deg: Turn to the left, then upwards, then clockwise as seen from
            behind, from the rig's forward axis.
        rate_hz: Readings per second; null = one at every step.
        time_offset_s: It reads this much later than the step's instant; what it saw then, and the
            labels of that, belong to the step.
        inside: Whether it may be inside the body that its rig is on.
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
        """Its pose on the rig; both frames are X forward, Y left, Z up."""
        pitch, roll = -0.5 * math.radians(self.pitch_deg), 0.5 * math.radians(self.roll_deg)
        upwards = SE3((0.0, 0.0, 0.0), (math.cos(pitch), 0.0, math.sin(pitch), 0.0))
        leaning = SE3((0.0, 0.0, 0.0), (math.cos(roll), math.sin(roll), 0.0, 0.0))
        turned = SE3.about_z(math.radians(self.yaw_deg), self.offset_m)
        return (turned @ upwards @ leaning).rounded()

    def _camera_info(self, name: str, channels: tuple[Channel, ...], lens: LensModel) -> SensorInfo:
        """Self-description of a camera that writes these channels."""
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
        """Self-description of a device of one of the kinds of ``TABLE_COLUMNS``."""
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
    """A sensor on a rig that reports rows of a table.

    Attributes:
        name: What files call it.
        rig: Name of the rig it is on.
        rate_hz: Readings per second, a whole number per step, or of steps; null = one per step.
    """

    kind: ClassVar[str]
    name: str = Field("instrument", pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")
    rig: str = "ego"

    @property
    def device_model(self) -> str:
        """What it is, for the labels; empty = nothing in particular."""
        return ""

    def describe(self) -> SensorInfo:
        """A device with the columns of its kind."""
        return self._device_info(self.name, self.kind)

    def mount(self, scene: Scene) -> Scene:
        """The scene with this device on its rig.

        Raises:
            ConfigError: there is no such rig, or its rate does not fit the sequence.
        """
        rig = check_rig(scene, self.name, self.rig)
        check_rate(self.name, self.rate_hz, scene.step_s)
        device = Device(self.name, self.kind, rig, self.T_rig_sensor, model=self.device_model)
        return replace(scene, devices=(*scene.devices, device))


def check_rig(scene: Scene, sensor: str, rig: str) -> str:
    """The rig's name, if the scene has it.

    Raises:
        ConfigError: it has not.
    """
    known = [r.name for r in scene.rigs]
    if rig not in known:
        raise ConfigError(
            f"sensor '{sensor}': there is no rig '{rig}'; there is {', '.join(known) or 'none'}"
            + did_you_mean(rig, known)
        )
    return rig


def with_lidar(scene: Scene, sensor: Mounted, lidar: Lidar) -> Scene:
    """The scene with a scanner on its sensor's rig, or else on that of its camera.

    Args:
        scene: With all sensors that are listed before this one.
        sensor: Whose mounting it is.
        lidar: Names the camera that it rides with where there is no rig.

    Raises:
        ConfigError: the scene has no such rig or camera.
    """
    if sensor.rig:
        rig = check_rig(scene, lidar.name, sensor.rig)
        return replace(scene, lidars=(*scene.lidars, replace(lidar, camera="", rig=rig)))
    known_camera(scene, lidar.name, lidar.camera)
    return replace(scene, lidars=(*scene.lidars, lidar))


def known_camera(scene: Scene, sensor: str, camera: str) -> Camera:
    """The camera of that name, if the scene has it.

    Raises:
        ConfigError: it has not.
    """
    known = {c.name: c for c in scene.cameras}
    if camera not in known:
        raise ConfigError(
            f"sensor '{sensor}': camera '{camera}' is no camera listed before it; there"
            f" is {', '.join(known) or 'none'}{did_you_mean(camera, known)}"
        )
    return known[camera]


def check_not_buried(scene: Scene, name: str, assets: AssetIndex) -> None:
    """Refuse a sensor inside the body that carries it, where it sees nothing else.

    Inside is the space within the body's bounding box, more than ``BURIED_M`` from its faces.

    Args:
        scene: With the sensor mounted; without a rig, anything goes.
        name: Of the sensor.
        assets: For the body's bounds.

    Raises:
        ConfigError: it is inside.
    """
    on_rig, T_rig_sensor = mounted_at(scene, name)
    if not on_rig:
        return
    rig = scene.rig(on_rig)
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
            f" '{rig.name}'; move it out (its top is at {top_m:.2f} m on the rig), or say"
            " inside: true"
        )


def mounted_at(scene: Scene, name: str) -> tuple[str, SE3]:
    """Rig and pose on it of a camera, laser scanner or device; an empty name for no rig.

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
    """Every how many steps a sensor reads that is no faster than the sequence.

    Raises:
        ConfigError: its period is no whole number of steps.
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
    """Whether a sensor reads more often than the sequence steps."""
    return rate_hz is not None and rate_hz * step_s > 1.0 + 1e-6


def check_rate(sensor: str, rate_hz: float | None, step_s: float) -> None:
    """Refuse a rate that does not fit the steps of the sequence.

    Raises:
        ConfigError: neither a whole number of readings per step nor of steps per reading.
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
    """Instants of the readings of the step that ends now; at time 0 there is but one."""
    step_s = scene.step_s
    if scene.time_s <= 0.0 or rate_hz is None or not within_steps(rate_hz, step_s):
        return np.array([scene.time_s])
    count = round(rate_hz * step_s)
    last = round(scene.time_s * rate_hz)
    return np.round(np.arange(last - count + 1, last + 1) / rate_hz, TIME_DECIMALS)


def window_s(scene: Scene, rate_hz: float | None) -> tuple[float, float]:
    """The time that a reading now looks back on: a step, or the time since the last reading."""
    period_s = max(scene.step_s, 1.0 / rate_hz if rate_hz else 0.0)
    return max(round(scene.time_s - period_s, TIME_DECIMALS), 0.0), scene.time_s
