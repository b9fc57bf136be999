"""Mounting of sensors on rigs and cameras, their rates, and their motion with their carrier."""

import math
import warnings
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator
from typing_extensions import Self

from gen_data.config.base_model import NAME_PATTERN, Strict
from gen_data.core.errors import ConfigError, ConfigWarning, did_you_mean
from gen_data.core.interfaces import AssetIndex, Modality, Sensor, SensorInfo
from gen_data.core.measurement_dtypes import TIME_DECIMALS, Column
from gen_data.core.motion import STILL, Trajectory, Twist
from gen_data.core.scene import Camera, Device, Lidar, Scene
from gen_data.core.scene_time import RIG_AXES
from gen_data.core.se3 import SE3, Array, turned
from gen_data.sensors.sensor_faults import SensorFaults

BURIED_M = 0.05
"""Allowed depth of a sensor inside its body's bounding box, which is larger than the body."""


class Mounting(Strict):
    """A sensor's place on its rig, from the file of a calibration.

    Files of Kalibr, EuRoC, ORB-SLAM, OpenCV (a pair), ROS (transforms in YAML, URDF), Autoware,
    nuScenes and KITTI.

    Attributes:
        file: Its name. The place in it replaces this key in the configuration, as ``offset_m``,
            ``yaw_deg``, ``pitch_deg`` and ``roll_deg``.
        frame: Name of the sensor's frame in it, such as cam1; empty = the only one.
        relative_to: Name of the frame of the rig: its origin, and X forward, Y left, Z up
            (a camera's frame is turned to these axes); empty = the root above ``frame``.
        axes: Axes of ``frame``: optical, X right, Y down, Z forward; or body, X forward, Y left, Z
            up.
            null = as the format has them; by the frame's name for ROS (REP 103).
        relative_axes: The same of ``relative_to``; or hand, Z out of the hand and Y along which its
            fingers open, as of the link of a gripper and a tool's frame (tool0). A rig on a wrist
            needs it.
        rectified: Whether to take the place of the rectified camera, from its projection matrix.
        unit: Unit of lengths in the file.
    """

    file: str
    frame: str = ""
    relative_to: str = ""
    axes: Literal["optical", "body"] | None = None
    relative_axes: Literal["optical", "body", "hand"] | None = None
    rectified: bool = False
    unit: Literal["m", "cm", "mm"] = "m"


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
        mounting: Place on the rig from the file of a calibration, instead of ``offset_m`` and the
            angles.
        inside: Whether it may be inside the body that carries its rig.
        faults: Faults of its readings, whose truth is in the labels; null = none.
    """

    rig: str = ""
    offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw_deg: float = Field(0.0, ge=-180, le=180)
    pitch_deg: float = Field(0.0, ge=-90, le=90)
    roll_deg: float = Field(0.0, ge=-180, le=180)
    rate_hz: float | None = Field(None, gt=0, le=10_000)
    time_offset_s: float = Field(0.0, ge=-10, le=10)
    mounting: Mounting | None = None
    inside: bool = False
    faults: SensorFaults | None = None

    @model_validator(mode="after")
    def _is_placed(self) -> Self:
        if self.mounting is not None:
            raise ValueError("mounting: only a configuration can name a file, and not by a switch")
        return self

    @property
    def T_rig_sensor(self) -> SE3:  # noqa: N802
        """Pose on the rig; both frames are X forward, Y left, Z up."""
        angles = (math.radians(a) for a in (self.yaw_deg, self.pitch_deg, self.roll_deg))
        return turned(self.offset_m, *angles).rounded()

    def _info(self, name: str, modality: Modality, kind: str = "", **more: Any) -> SensorInfo:
        """Description with the rate of its readings; ``more`` are further fields.

        Its carrier may occlude it, unless it may be inside.
        """
        times = {"rate_hz": self.rate_hz, "time_offset_s": self.time_offset_s}
        fields = {"needs_clear_view": not self.inside, **times, **more}
        return SensorInfo(name, modality, kind, **fields)


class Instrument(Mounted):
    """Base of sensors on a rig that report rows of a table.

    Attributes:
        name: Its name in files.
        rig: Name of the rig it is mounted on.
        rate_hz: Readings per second: a whole number per step, or one every few whole steps; null
            = one per step.
    """

    kind: ClassVar[str]
    columns: ClassVar[tuple[Column, ...]]
    view: ClassVar[str] = ""
    name: str = Field("instrument", pattern=NAME_PATTERN)
    rig: str = "ego"

    @property
    def device_model(self) -> str:
        """Name of the device's model in labels, its field ``model``; empty = none."""
        return str(getattr(self, "model", ""))

    def describe(self) -> SensorInfo:
        """Describe a device with its columns and its drawing."""
        own = {"columns": self.columns, "view": self.view, "needs_clear_view": False}
        return self._info(self.name, Modality.DEVICE, self.kind, **own)

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
    """Return the name of an existing rig. Raises ConfigError if the scene has no such rig."""
    known = [r.name for r in scene.rigs]
    if rig not in known:
        raise ConfigError(
            f"sensor '{sensor}': the scene has no rig '{rig}'; its rigs: "
            f"{', '.join(known) or 'none'}{did_you_mean(rig, known)}"
        )
    return rig


def add_lidar(scene: Scene, sensor: Mounted, lidar: Lidar) -> Scene:
    """Add a scanner on its sensor's rig, or at its camera if the sensor has no rig.

    The scene has all sensors that are listed before this one.

    Raises:
        ConfigError: the scene has no such rig or camera.
    """
    if sensor.rig:
        rig = check_rig(scene, lidar.name, sensor.rig)
        return replace(scene, lidars=(*scene.lidars, replace(lidar, camera="", rig=rig)))
    find_camera(scene, lidar.name, lidar.camera)
    return replace(scene, lidars=(*scene.lidars, lidar))


def find_camera(scene: Scene, sensor: str, camera: str) -> Camera:
    """The camera of that name. Raises ConfigError if the scene has no such camera."""
    known = {c.name: c for c in scene.cameras}
    if camera not in known:
        raise ConfigError(
            f"sensor '{sensor}': no camera '{camera}' is listed before it; cameras listed so far: "
            f"{', '.join(known) or 'none'}{did_you_mean(camera, known)}"
        )
    return known[camera]


def check_not_buried(scene: Scene, name: str, assets: AssetIndex) -> None:
    """Refuse a mounted sensor on a rig inside the body that carries it, which would occlude it.

    Inside means in the body's bounding box, more than ``BURIED_M`` from its faces.

    Raises:
        ConfigError: the sensor is inside.
    """
    rig_name, T_rig_sensor = find_mounting(scene, name)
    if not rig_name:
        return
    rig = scene.rig(rig_name)
    if not rig.body:
        return
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
    known = {device.name: (device.rig, device.T_rig_device) for device in scene.devices}
    known |= {lidar.name: (lidar.rig, lidar.T_rig_lidar) for lidar in scene.lidars}
    known |= {c.name: (c.rig, c.T_rig_camera @ RIG_AXES) for c in scene.cameras}
    return known[name]


def warn_of_early_readings(sensors: Iterable[Sensor], steps_per_scene: int) -> None:
    """Warn of sensors that read before the first step of a sequence, when nothing moves.

    Warns:
        ConfigWarning: a sensor has a negative ``time_offset_s``.
    """
    early = {
        sensor.name: sensor.time_offset_s
        for sensor in sensors
        if isinstance(sensor, Mounted) and sensor.time_offset_s < 0.0
    }
    if early and steps_per_scene > 1:
        warnings.warn(
            f"sensors {', '.join(early)}: at the first step they read before anything moves and "
            "all velocities are 0; expected time_offset_s of 0 or more: add "
            f"{-min(early.values()):g} to time_offset_s of every sensor",
            ConfigWarning,
            stacklevel=2,
        )


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


@dataclass(frozen=True, slots=True)
class MountMotion:
    """Motion of a device on a body.

    Attributes:
        track: Trajectory of the body; None = it does not move.
        T_world_body: Pose of the body at the scene's instant.
        T_body_device: Pose of the device on the body.
    """

    track: Trajectory | None
    T_world_body: SE3
    T_body_device: SE3

    def pose(self, time_s: float) -> SE3:
        """``T_world_device`` at an instant."""
        carrier = self.T_world_body if self.track is None else self.track.pose(time_s)
        return carrier @ self.T_body_device

    def velocity_m_s(self, time_s: float) -> Array:
        """Velocity of the device's origin at an instant, world axes, [3]."""
        twist = self.twist(time_s)
        if self.track is None:
            return np.zeros(3)
        lever_m = self.track.pose(time_s).rotate(np.asarray(self.T_body_device.translation_m))
        return np.asarray(velocity_at(twist, lever_m))

    def twist(self, time_s: float) -> Twist:
        """Twist of the body at an instant."""
        return STILL if self.track is None else self.track.twist(time_s)

    def inertial_motion(self, time_s: float) -> tuple[SE3, Array, Array]:
        """Pose, acceleration and angular velocity of the device at an instant.

        Acceleration and angular velocity are central differences over one step of the trajectory,
        which is the bandwidth of an interpolated trajectory. Within a step of its ends, where
        neighbours are missing, they are extrapolated along the device's axes from one and two
        steps from the end; trajectories of fewer than three steps keep one value there.

        Returns:
            ``T_world_device``; acceleration [m/s^2] and angular velocity [rad/s] in the device's
            axes, [3] each; 0 outside the trajectory.
        """
        track = self.track
        pose = self.pose(time_s)
        if track is None or not track.start_s <= time_s <= track.end_s:
            return pose, np.zeros(3), np.zeros(3)
        h = min(track.step_s, 0.5 * (track.end_s - track.start_s))
        middle_s = min(max(time_s, track.start_s + h), track.end_s - h)
        motion = self._central_differences(middle_s, h)
        if time_s != middle_s and len(track.knots) > 3:
            inward = math.copysign(h, middle_s - time_s)
            further = self._central_differences(middle_s + inward, h)
            motion = motion + (motion - further) * ((middle_s - time_s) / inward)
        return pose, motion[0], motion[1]

    def _central_differences(self, time_s: float, h: float) -> Array:
        """Acceleration and angular velocity in the device's axes, [2, 3], of poses ``h`` apart."""
        before, here, after = (self.pose(time_s + k * h) for k in (-1, 0, 1))
        a, b, c = (np.asarray(place.translation_m) for place in (before, here, after))
        turn = rotation_vector(after @ before.inverse()) / (2.0 * h)
        axes = here.inverse()
        return np.stack([axes.rotate((a - 2.0 * b + c) / (h * h)), axes.rotate(turn)])


def mount_motion(scene: Scene, device: str) -> MountMotion:
    """Motion of the device of that name; KeyError if the scene has none."""
    mounted = scene.device(device)
    rig = scene.rig(mounted.rig)
    T_world_body = scene.body(rig.body).T_world_body if rig.body else SE3()
    return MountMotion(scene.track(rig.body), T_world_body, rig.T_body_rig @ mounted.T_rig_device)


def velocity_at(twist: Twist, lever_m: Array) -> Array:
    """Velocity [m/s] of points at ``lever_m`` from the origin of a moving frame, [..., 3]."""
    omega = np.asarray(twist.angular_velocity_rad_s)
    return np.asarray(np.asarray(twist.velocity_m_s) + np.cross(omega, lever_m))


def rotation_vector(turn: SE3) -> Array:
    """Axis times angle [rad] of a rotation, [3]."""
    w, x, y, z = turn.quaternion_wxyz
    sign = 1.0 if w >= 0.0 else -1.0
    axis = sign * np.array([x, y, z])
    sine = float(np.sqrt(axis @ axis))
    angle = 2.0 * float(np.arctan2(sine, sign * w))
    return axis * (angle / sine if sine > 1e-12 else 2.0)


def remove_carrier(scene: Scene, rig: str) -> Scene:
    """The scene without the body that carries a rig, which must not occlude devices."""
    if not scene.rig(rig).body:
        return scene
    carrier = scene.body(scene.rig(rig).body)
    own = carrier.instance_id
    bodies = tuple(
        body
        for body in scene.bodies
        if body.name != carrier.name and not (own and body.instance_id == own)
    )
    return replace(scene, bodies=bodies)
