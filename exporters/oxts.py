"""KITTI's navigation rows (OXTS): exact pose and motion of a rig.

Thirty columns, as ``dataformat.txt`` of KITTI's raw data names them (Geiger et al., "Vision meets
Robotics", IJRR 2013): ``lat lon alt roll pitch yaw vn ve vf vl vu ax ay az af al au wx wy wz wf wl
wu pos_accuracy vel_accuracy navstat numsats posmode velmode orimode``.

* World X is east, Y north, Z up; yaw 0 is east and grows to the left.
* Latitude and longitude invert the Mercator projection of KITTI's devkit, on a sphere of radius
  6378137 m: the devkit recovers the world's coordinates.
* ``vf vl vu`` and alike are along the horizontal heading, ``ax ay az`` along the sensor's axes.
  Accelerations are specific forces: a sensor at rest measures gravity, upwards.
"""

import math
from dataclasses import dataclass

import numpy as np

from gen_data.core import errors, se3
from gen_data.core.motion import STILL, Trajectory, Twist
from gen_data.core.reported import reported
from gen_data.core.scene import Scene
from gen_data.exporters.sequences import Mount, mounted_pose

COLUMNS = """\
lat lon:            position [deg], by the Mercator projection of KITTI's devkit
alt:                height [m]
roll pitch yaw:     [rad]; yaw 0 = east, counter-clockwise
vn ve:              velocity to the north and to the east [m/s]
vf vl vu:           velocity forward, leftward and upward, level [m/s]
ax ay az:           acceleration along the unit's axes, gravity included [m/s^2]
af al au:           acceleration forward, leftward and upward, level, gravity included [m/s^2]
wx wy wz:           angular rate about the unit's axes [rad/s]
wf wl wu:           angular rate about the level axes [rad/s]
pos_accuracy vel_accuracy navstat numsats posmode velmode orimode
"""
"""Content of ``dataformat.txt``: the thirty columns in order."""

EARTH_RADIUS_M = 6_378_137.0
GRAVITY_M_S2 = 9.80665
"""Standard acceleration of free fall."""
EXACT = "0 0 4 12 6 6 6"
"""Accuracies of position and velocity, a full solution of 12 satellites in the best mode (6)."""


@dataclass(frozen=True, slots=True)
class RigMotion:
    """Pose and motion of a frame (X forward, Y left, Z up), along world axes."""

    T_world_frame: se3.SE3
    twist: Twist


def navigation_mount(
    scene: Scene, name: str, carrier: str, exporter: str, *, true: bool = False
) -> Mount:
    """Mount of the navigation unit: the device of that name, or the rig itself if it is empty.

    Args:
        scene: Scene with the devices.
        name: Name of a device; empty = none.
        carrier: Rig to use without a device.
        exporter: Name in the error text.
        true: Leave out the error of its calibration.

    Raises:
        ConfigError: there is no such device.
    """
    if not name:
        return Mount(carrier, se3.SE3())
    known = [device.name for device in scene.devices]
    if name not in known:
        raise errors.ConfigError(
            f"exporter '{exporter}': there is no device '{name}' for oxts; expected one of: "
            f"{', '.join(known) or 'none'}{errors.did_you_mean(name, known)}"
        )
    device = scene.device(name)
    device = device if true else reported(device)
    return Mount(device.rig, device.T_rig_device)


def rig_motion(scene: Scene, mount: Mount) -> RigMotion:
    """Motion of a mount: its rig's body along its trajectory, plus the lever arm's part."""
    pose = mounted_pose(scene, mount)
    rig = next((rig for rig in scene.rigs if rig.name == mount.rig), None)
    track = scene.track(rig.body) if rig else None
    if rig is None or track is None:
        return RigMotion(pose, STILL)
    origin_m = scene.body(rig.body).T_world_body.translation_m
    return carried_motion(pose, origin_m, track, scene.time_s)


def carried_motion(
    pose: se3.SE3, origin_m: se3.Vec3, track: Trajectory, time_s: float
) -> RigMotion:
    """Motion of a frame on a body with a place [m] at an instant of its trajectory."""
    x, y, z = (a - b for a, b in zip(pose.translation_m, origin_m, strict=True))
    return RigMotion(pose, track.carried_twist(time_s, (x, y, z)))


def oxts_row(motion: RigMotion, origin_deg: tuple[float, float]) -> str:
    """Format the thirty columns, without a line end.

    Args:
        motion: Motion of the unit.
        origin_deg: Latitude and longitude of the world's origin.
    """
    roll_rad, pitch_rad, yaw_rad = roll_pitch_yaw(motion.T_world_frame.rotation())
    T_level_world = se3.SE3.about_z(yaw_rad).inverse()
    T_unit_world = motion.T_world_frame.inverse()
    velocity = np.array(motion.twist.velocity_m_s)
    force = np.add(motion.twist.acceleration_m_s2, (0.0, 0.0, GRAVITY_M_S2))
    turning = np.array(motion.twist.angular_velocity_rad_s)
    values = [
        *_position(motion.T_world_frame.translation_m, origin_deg),
        *(roll_rad, pitch_rad, yaw_rad),
        *(velocity[1], velocity[0]),
        *(T_level_world.rotate(velocity)),
        *(T_unit_world.rotate(force)),
        *(T_level_world.rotate(force)),
        *(T_unit_world.rotate(turning)),
        *(T_level_world.rotate(turning)),
    ]
    return " ".join(f"{round(float(v), 12) + 0.0:.12f}" for v in values) + " " + EXACT


def roll_pitch_yaw(rotation: se3.Array) -> tuple[float, float, float]:
    """Angles [rad] with ``rotation = Rz(yaw) Ry(pitch) Rx(roll)``."""
    pitch_rad = math.atan2(-rotation[2, 0], math.hypot(rotation[2, 1], rotation[2, 2]))
    roll_rad = math.atan2(rotation[2, 1], rotation[2, 2])
    return roll_rad, pitch_rad, math.atan2(rotation[1, 0], rotation[0, 0])


def _position(
    position_m: tuple[float, float, float], origin_deg: tuple[float, float]
) -> tuple[float, float, float]:
    """Latitude and longitude [deg] and height [m], by the inverse of the devkit's projection."""
    latitude_deg, longitude_deg = origin_deg
    east_m, north_m, up_m = position_m
    radius_m = EARTH_RADIUS_M * math.cos(math.radians(latitude_deg))
    isometric = math.log(math.tan(math.radians(90.0 + latitude_deg) / 2.0)) + north_m / radius_m
    return (
        math.degrees(2.0 * math.atan(math.exp(isometric))) - 90.0,
        longitude_deg + math.degrees(east_m / radius_m),
        up_m,
    )
