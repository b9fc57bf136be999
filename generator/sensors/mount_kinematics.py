"""Motion of a device with the body that carries it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gen_data.generator.core.motion import STILL, Trajectory, Twist
from gen_data.generator.core.scene import Scene
from gen_data.generator.core.se3 import SE3, Array


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
        which is the bandwidth of an interpolated trajectory. Within two steps of its ends, where
        neighbours are missing, they keep the values of two steps from the end, device axes.

        Returns:
            ``T_world_device``; acceleration [m/s^2] and angular velocity [rad/s] in the device's
            axes, [3] each; 0 outside the trajectory.
        """
        track = self.track
        pose = self.pose(time_s)
        if track is None or not track.start_s <= time_s <= track.end_s:
            return pose, np.zeros(3), np.zeros(3)
        half_s = 0.5 * (track.end_s - track.start_s)
        h, margin_s = min(track.step_s, half_s), min(2.0 * track.step_s, half_s)
        middle_s = min(max(time_s, track.start_s + margin_s), track.end_s - margin_s)
        before, here, after = (self.pose(middle_s + k * h) for k in (-1, 0, 1))
        a, b, c = (np.asarray(place.translation_m) for place in (before, here, after))
        axes = here.inverse()
        acceleration = axes.rotate((a - 2.0 * b + c) / (h * h))
        return (
            pose,
            acceleration,
            axes.rotate(rotation_vector(after @ before.inverse())) / (2.0 * h),
        )


def mount_motion(scene: Scene, device: str) -> MountMotion:
    """Motion of the device of that name; KeyError if the scene has none."""
    mounted = scene.device(device)
    rig = scene.rig(mounted.rig)
    body = scene.body(rig.body)
    return MountMotion(
        scene.track(rig.body), body.T_world_body, rig.T_body_rig @ mounted.T_rig_device
    )


def velocity_at(twist: Twist, lever_m: Array) -> Array:
    """Velocity [m/s] of points at ``lever_m`` from the origin of a moving frame, [..., 3]."""
    omega = np.asarray(twist.angular_velocity_rad_s)
    velocity: Array = np.asarray(twist.velocity_m_s) + np.cross(omega, lever_m)
    return velocity


def rotation_vector(turn: SE3) -> Array:
    """Axis times angle [rad] of a rotation, [3]."""
    w, x, y, z = turn.quaternion_wxyz
    sign = 1.0 if w >= 0.0 else -1.0
    axis = sign * np.array([x, y, z])
    sine = float(np.sqrt(axis @ axis))
    angle = 2.0 * float(np.arctan2(sine, sign * w))
    return axis * (angle / sine if sine > 1e-12 else 2.0)


def remove_carrier(scene: Scene, rig: str) -> Scene:
    """The scene without the body that carries a rig, so that it does not occlude devices."""
    carrier = scene.body(scene.rig(rig).body)
    own = carrier.instance_id
    bodies = tuple(
        body
        for body in scene.bodies
        if body.name != carrier.name and not (own and body.instance_id == own)
    )
    return replace(scene, bodies=bodies)
