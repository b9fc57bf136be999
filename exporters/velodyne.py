"""The frame of KITTI's laser scanner: X ahead, Y left, Z up.

Readers rely on these axes, whatever ``Tr_velo_to_cam`` states. OpenPCDet and MMDetection3D make the
yaw of a label's box about the scanner's z as ``-(rotation_y + pi / 2)`` and keep points with x > 0;
monodepth2 drops points with x < 0 as behind the camera. The scanner of nuScenes has X to the right:
its devkit (1.2.0) turns scans by a quarter when it exports KITTI.

A scan is turned about the scanner's z until x points ahead: along the optical axis of the camera
whose labels go with it, or along the X axis of the rig. Tilts remain. Angles of up to 3 degrees
remain too: KITTI's scanner and cameras differ by half a degree.
"""

import math

import numpy as np
from numpy.typing import NDArray

from gen_data.core.scene import Scene
from gen_data.core.se3 import SE3, Array
from gen_data.exporters import sequences

Turn = tuple[float, float]
"""Cosine and sine of the angle about Z from a scanner's frame to the frame of its files."""

UNTURNED: Turn = (1.0, 0.0)
COSINE_ALIKE = math.cos(math.radians(3.0))


def turn_ahead(forward: Array) -> Turn:
    """Turn to x ahead; ``forward`` is that direction in the scanner's frame, [3]."""
    x, y = float(forward[0]), float(forward[1])
    # Square roots and quotients have the same bits on all machines.
    length = math.sqrt(x * x + y * y)
    if length < 1e-6 or x >= COSINE_ALIKE * length:
        return UNTURNED
    return x / length, y / length


def turn_to_camera(scene: Scene, lidar: str, camera: str) -> Turn:
    """Turn of a scanner's files next to the images of a camera, by their true mounts."""
    T_camera_lidar = sequences.relative_pose(
        scene,
        sequences.camera_mount(scene, camera, true=True),
        sequences.lidar_mount(scene, lidar, true=True),
    )
    return turn_ahead(T_camera_lidar.rotation()[2])


def turn_to_rig(scene: Scene, lidar: str) -> Turn:
    """Turn of a scanner's files of a drive: x is the rig's X axis."""
    mount = sequences.lidar_mount(scene, lidar, true=True)
    return turn_ahead(mount.T_rig_sensor.rotation()[0])


def turned_mount(scene: Scene, lidar: str, turn: Turn) -> sequences.Mount:
    """Mount of the frame of a scanner's files, as calibrations state it."""
    mount = sequences.lidar_mount(scene, lidar)
    return sequences.Mount(mount.rig, turned_pose(mount.T_rig_sensor, turn))


def turned_pose(pose: SE3, turn: Turn) -> SE3:
    """``T_frame_files`` of a scanner with the pose ``T_frame_lidar``."""
    if turn == UNTURNED:
        return pose
    cosine, sine = turn
    w = math.sqrt(0.5 * max(1.0 + cosine, 0.0))
    z = math.copysign(math.sqrt(0.5 * max(1.0 - cosine, 0.0)), sine)
    return pose @ SE3((0.0, 0.0, 0.0), (w, 0.0, 0.0, z))


def scan_bytes(points: NDArray[np.void], turn: Turn = UNTURNED) -> bytes:
    """Encode records of ``POINT`` as KITTI's ``.bin``: little-endian float32 x, y, z, intensity."""
    x, y, z = points["position_m"].T
    if turn != UNTURNED:
        cosine, sine = turn
        x, y = x.astype(np.float64), y.astype(np.float64)
        x, y = cosine * x + sine * y, cosine * y - sine * x
    return np.column_stack([x, y, z, points["intensity"]]).astype("<f4").tobytes()
