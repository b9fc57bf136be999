"""CAN bus expansion of nuScenes: motion of the ego vehicle between the instants of the steps.

::

    can_bus/scene-2000_pose.json                 50 Hz: pos, orientation; vel, accel, rotation_rate
    can_bus/scene-2000_ms_imu.json               100 Hz: q, linear_accel, rotation_rate
    can_bus/scene-2000_steeranglefeedback.json   100 Hz: value, while the vehicle drives
    can_bus/scene-2000_vehicle_monitor.json      2 Hz: vehicle_speed [km/h], yaw_rate [deg/s]

Each message has ``utime`` [us], in the clock of the tables. ``pos`` is in the global frame, vectors
are along the axes of the ego. Accelerations are specific forces: at rest they are gravity, upwards.
The IMU is at the origin of the ego, below the middle of the rear axle, and its reference frame is
the global one. ``value`` is the angle of the steering wheel [rad], positive to the right: the angle
of the front wheels on the ego's circle, times ``STEERING_RATIO``.

Absent, because a simulated vehicle does not have them: all other fields of ``vehicle_monitor``
(battery, pedals, indicators, gear), ``zoesensors`` and ``zoe_veh_info``; and the derived messages
``meta`` and ``route``.

Reference: README of the CAN bus expansion in nuscenes-devkit.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from gen_data.core import se3
from gen_data.core.interfaces import AssetLibrary
from gen_data.core.motion import STILL
from gen_data.core.scene import Scene
from gen_data.exporters.nuscenes_frames import pose_row, rig_pose_at
from gen_data.exporters.oxts import GRAVITY_M_S2, RigMotion, carried_motion
from gen_data.traffic.axles import find_axles

RATES_HZ = {"pose": 50, "ms_imu": 100, "steeranglefeedback": 100, "vehicle_monitor": 2}
"""Rate of each message."""
FIRST_SCENE, SCENES_MAX = 2000, 8000
"""The devkit requires names of four digits; official ones end with scene-1110."""
STEERING_RATIO = 15.0
"""Turns of the steering wheel per turn of the front wheels (assumed; cars have 14 to 17)."""
DRIVES_M_S = 0.5
"""Speed from which on the motion determines the angle of the wheels."""

Row = dict[str, Any]


def scene_name(sequence: int) -> str:
    """Name of the scene of a sequence, as the devkit requires; in no official split."""
    return f"scene-{FIRST_SCENE + sequence:04d}"


def can_messages(
    scene: Scene,
    rig: str,
    span_s: tuple[float, float],
    T_global_world: se3.SE3,
    assets: AssetLibrary,
) -> dict[str, list[Row]]:
    """Messages from the start of a span to before its end, by name; ``time_s`` is the scene's."""
    body = scene.body(scene.rig(rig).body)
    wheelbase_m = find_axles(assets, body.asset, body.scale).wheelbase_m
    write: dict[str, Callable[[RigMotion], Row]] = {
        "pose": lambda motion: _pose(motion, T_global_world),
        "ms_imu": lambda motion: _imu(motion, T_global_world),
        "steeranglefeedback": lambda motion: _steering(motion, wheelbase_m),
        "vehicle_monitor": _monitor,
    }
    return {
        name: [
            {"time_s": time_s, **row}
            for time_s in _instants(span_s, RATES_HZ[name])
            if (row := write[name](motion_at(scene, rig, time_s)))
        ]
        for name in RATES_HZ
    }


def motion_at(scene: Scene, rig: str, time_s: float) -> RigMotion:
    """Motion of a rig at an instant of its scene."""
    track = scene.track(scene.rig(rig).body)
    pose = rig_pose_at(scene, rig, time_s)
    if track is None:
        return RigMotion(pose, STILL)
    origin_m = track.pose(time_s).rounded().translation_m
    return carried_motion(pose, origin_m, track, time_s)


def stamped(
    messages: Sequence[Mapping[str, Any]], time_us: Callable[[float], int]
) -> Iterator[Row]:
    """Messages with the time of the tables instead of the scene's."""
    for message in messages:
        yield {"utime": time_us(message["time_s"])} | {
            key: value for key, value in message.items() if key != "time_s"
        }


def _instants(span_s: tuple[float, float], rate_hz: int) -> list[float]:
    first, end = (math.ceil(round(t * rate_hz, 6)) for t in span_s)
    return [round(k / rate_hz, 9) for k in range(first, end)]


def _pose(motion: RigMotion, T_global_world: se3.SE3) -> Row:
    row = pose_row(T_global_world @ motion.T_world_frame)
    return {
        "pos": row["translation"],
        "orientation": row["rotation"],
        "vel": _own(motion, motion.twist.velocity_m_s),
        "accel": _force(motion),
        "rotation_rate": _own(motion, motion.twist.angular_velocity_rad_s),
    }


def _imu(motion: RigMotion, T_global_world: se3.SE3) -> Row:
    return {
        "q": pose_row(T_global_world @ motion.T_world_frame)["rotation"],
        "linear_accel": _force(motion),
        "rotation_rate": _own(motion, motion.twist.angular_velocity_rad_s),
    }


def _steering(motion: RigMotion, wheelbase_m: float) -> Row:
    """Angle of the steering wheel; empty while the vehicle stands."""
    ahead_m_s = _own(motion, motion.twist.velocity_m_s)[0]
    if abs(ahead_m_s) < DRIVES_M_S:
        return {}
    turn = _own(motion, motion.twist.angular_velocity_rad_s)[2]
    wheels = math.atan2(wheelbase_m * turn / ahead_m_s, 1.0)
    return {"value": round(-STEERING_RATIO * wheels, 6) + 0.0}


def _monitor(motion: RigMotion) -> Row:
    speed_m_s = math.sqrt(sum(v * v for v in motion.twist.velocity_m_s))
    turn = _own(motion, motion.twist.angular_velocity_rad_s)[2]
    return {
        "vehicle_speed": round(3.6 * speed_m_s, 2),
        "yaw_rate": round(math.degrees(turn), 1) + 0.0,
    }


def _force(motion: RigMotion) -> list[float]:
    """Specific force along the axes of the ego [m/s^2]."""
    return _own(motion, np.add(motion.twist.acceleration_m_s2, (0.0, 0.0, GRAVITY_M_S2)))


def _own(motion: RigMotion, vector: Sequence[float] | se3.Array) -> list[float]:
    """A vector of the world along the axes of the ego."""
    own = motion.T_world_frame.inverse().rotate(np.asarray(vector, np.float64))
    return [round(float(v), 6) + 0.0 for v in own]
