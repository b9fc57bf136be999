"""Rigid poses in three dimensions.

Composition and application use only ``+ - * / sqrt``: a pose has the same bits on every processor.
``T_world_body`` maps body coordinates to world coordinates.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.core.decimals import round_near

Vec3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SE3:
    """A rotation followed by a translation.

    Attributes:
        translation_m: Origin of the inner frame in the outer frame [m].
        quaternion_wxyz: Unit quaternion, scalar first.
    """

    translation_m: Vec3 = (0.0, 0.0, 0.0)
    quaternion_wxyz: Quaternion = (1.0, 0.0, 0.0, 0.0)

    @classmethod
    def from_matrix(cls, matrix: Array) -> SE3:
        """Pose of a homogeneous matrix, shape [4, 4] or [3, 4]."""
        return cls.from_rotation(matrix[:3, :3], matrix[:3, 3])

    @classmethod
    def from_rotation(
        cls, rotation: Array, translation_m: Sequence[float] | Array = (0.0, 0.0, 0.0)
    ) -> SE3:
        """Pose of a rotation matrix, shape [3, 3], and a translation [m]."""
        x, y, z = (float(v) for v in translation_m)
        return cls((x, y, z), rotation_to_quaternion(rotation))

    @classmethod
    def about_z(cls, yaw_rad: float, translation_m: Vec3 = (0.0, 0.0, 0.0)) -> SE3:
        """Rotation by ``yaw_rad`` about Z, then a translation."""
        half = 0.5 * yaw_rad
        return cls(translation_m, (math.cos(half), 0.0, 0.0, math.sin(half)))

    def rotation(self) -> Array:
        """Rotation matrix, shape [3, 3]."""
        return np.array(_rotation_rows(*self.quaternion_wxyz))

    def matrix(self) -> Array:
        """Homogeneous matrix, shape [4, 4]."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.rotation()
        matrix[:3, 3] = self.translation_m
        return matrix

    def inverse(self) -> SE3:
        """The pose that undoes this one."""
        w, x, y, z = self.quaternion_wxyz
        conjugate = (w, -x, -y, -z)
        tx, ty, tz = self.translation_m
        return SE3(rotate_by_quaternion(conjugate, (-tx, -ty, -tz)), conjugate)

    def __matmul__(self, other: SE3) -> SE3:
        """``T_a_c = T_a_b @ T_b_c``."""
        rx, ry, rz = rotate_by_quaternion(self.quaternion_wxyz, other.translation_m)
        tx, ty, tz = self.translation_m
        product = multiply_quaternions(self.quaternion_wxyz, other.quaternion_wxyz)
        return SE3((tx + rx, ty + ry, tz + rz), product)

    def apply(self, points_m: Array) -> Array:
        """Points mapped to the outer frame [m], shape [..., 3]."""
        return np.asarray(self.rotate(points_m) + self.translation_m)

    def rotate(self, vectors: Array) -> Array:
        """Directions mapped to the outer frame, shape [..., 3]."""
        # einsum keeps one order of summation; BLAS may not (its bits depend on the core type).
        rotated: Array = np.einsum(
            "ij,...j->...i", self.rotation(), np.asarray(vectors, dtype=np.float64), optimize=False
        )
        return rotated

    def rounded(self, decimals: int = 6) -> SE3:
        """The pose on a decimal grid, re-normalised, to pass from physics to labels."""
        tx, ty, tz = self.translation_m
        w, x, y, z = self.quaternion_wxyz
        steps, fine = 10.0**decimals, decimals + 2
        fine_steps = 100.0 * steps
        # Number by number, as all of this class: a scene composes and rounds thousands of poses.
        return SE3(
            (
                round_near(tx, steps, decimals) + 0.0,
                round_near(ty, steps, decimals) + 0.0,
                round_near(tz, steps, decimals) + 0.0,
            ),
            _normalised(
                round_near(w, fine_steps, fine),
                round_near(x, fine_steps, fine),
                round_near(y, fine_steps, fine),
                round_near(z, fine_steps, fine),
            ),
        )


IDENTITY = SE3()


def rotate_by_quaternion(q: Quaternion, v: Vec3) -> Vec3:
    """``v`` rotated by the unit quaternion ``q`` (scalar first)."""
    w, x, y, z = q
    vx, vy, vz = v
    tx, ty, tz = 2 * (y * vz - z * vy), 2 * (z * vx - x * vz), 2 * (x * vy - y * vx)
    return (
        vx + w * tx + y * tz - z * ty,
        vy + w * ty + z * tx - x * tz,
        vz + w * tz + x * ty - y * tx,
    )


def multiply_quaternions(a: Quaternion, b: Quaternion) -> Quaternion:
    """Hamilton product, scalar first, re-normalised."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return _normalised(
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def quaternions_to_rotations(quaternions_wxyz: Array) -> Array:
    """Rotation matrices [n, 3, 3] of quaternions [n, 4] of any length above 0, scalar first."""
    w, x, y, z = quaternions_wxyz.T
    norm = np.sqrt(w * w + x * x + y * y + z * z)
    return unit_quaternions_to_rotations(quaternions_wxyz / norm[:, None])


def unit_quaternions_to_rotations(quaternions_wxyz: Array) -> Array:
    """Rotation matrices [n, 3, 3] of unit quaternions [n, 4], as ``SE3.rotation``."""
    rows = np.array(_rotation_rows(*quaternions_wxyz.T))
    return np.ascontiguousarray(rows.transpose(2, 0, 1))


def _rotation_rows(w: Any, x: Any, y: Any, z: Any) -> list[list[Any]]:
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


def rotation_to_quaternion(rotation: Array) -> Quaternion:
    """Unit quaternion (scalar first, scalar >= 0) of a rotation matrix, shape [3, 3].

    Source: Shepperd, "Quaternion from rotation matrix", J. Guidance and Control 1(3), 1978.
    """
    m = [[float(rotation[i, j]) for j in range(3)] for i in range(3)]
    trace = m[0][0] + m[1][1] + m[2][2]
    k = max(range(4), key=lambda i: trace if i == 0 else m[i - 1][i - 1])
    if k == 0:
        q = [1 + trace, m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]]
    else:
        i, j, l = k - 1, k % 3, (k + 1) % 3  # noqa: E741
        q = [0.0] * 4
        q[0] = m[l][j] - m[j][l]
        q[1 + i] = 1 + m[i][i] - m[j][j] - m[l][l]
        q[1 + j] = m[j][i] + m[i][j]
        q[1 + l] = m[l][i] + m[i][l]
    return _normalised(*(q if q[0] >= 0 else [-v for v in q]))


def turned(origin_m: Vec3, yaw_rad: float, pitch_rad: float, roll_rad: float) -> SE3:
    """Pose of a frame X forward, Y left, Z up after turns from another one's X axis.

    First to the left, then upwards, then clockwise as seen from behind.
    """
    half_pitch, half_roll = -0.5 * pitch_rad, 0.5 * roll_rad
    pitch = SE3((0.0, 0.0, 0.0), (math.cos(half_pitch), 0.0, math.sin(half_pitch), 0.0))
    roll = SE3((0.0, 0.0, 0.0), (math.cos(half_roll), math.sin(half_roll), 0.0, 0.0))
    return SE3.about_z(yaw_rad, origin_m) @ pitch @ roll


def turns_of(pose: SE3) -> tuple[float, float, float]:
    """Yaw, pitch and roll [rad] of a pose: the inverse of ``turned``; roll is 0 at the poles."""
    R = pose.rotation()
    level = math.hypot(R[0, 0], R[1, 0])
    pitch_rad = math.atan2(float(R[2, 0]), level)
    if level < 1e-9:
        return math.atan2(-float(R[0, 1]), float(R[1, 1])), pitch_rad, 0.0
    return math.atan2(R[1, 0], R[0, 0]), pitch_rad, math.atan2(R[2, 1], R[2, 2])


VERTICAL = 0.999999
"""Vertical part of a unit vector from which on a camera that looks along it has no level."""


def look_at(eye_m: Vec3, target_m: Vec3, roll_rad: float = 0.0) -> SE3:
    """``T_world_camera`` of a camera at ``eye_m`` whose Z axis points at ``target_m``.

    The camera's X axis is level when ``roll_rad`` is 0; a positive roll turns the camera
    clockwise about its viewing direction. World is Z up; camera is X right, Y down, Z forward.

    Raises:
        ValueError: if eye and target coincide.
    """
    forward = np.asarray(target_m, dtype=np.float64) - np.asarray(eye_m, dtype=np.float64)
    length = math.sqrt(float((forward * forward).sum()))
    if length < 1e-9:
        raise ValueError("look_at needs a target that differs from the eye")
    forward = forward / length
    # Looking straight up or down leaves "level" undefined: fall back to the world's Y as up.
    up = np.array([0.0, 0.0, 1.0]) if abs(forward[2]) < VERTICAL else np.array([0.0, 1.0, 0.0])
    right = np.cross(forward, up)
    right = right / math.sqrt(float((right * right).sum()))
    down = np.cross(forward, right)
    c, s = math.cos(roll_rad), math.sin(roll_rad)
    columns = [c * right + s * down, c * down - s * right, forward]
    return SE3.from_rotation(np.stack(columns, axis=1), eye_m)


def _normalised(w: float, x: float, y: float, z: float) -> Quaternion:
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    return (w / norm, x / norm, y / norm, z / norm)
