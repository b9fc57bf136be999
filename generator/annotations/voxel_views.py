"""Voxels of a box that cameras and laser scanners observe."""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gen_data.annotations.voxel_box import VoxelBox, turned
from gen_data.core.capture import Channel, PointCloud, SensorReading
from gen_data.core.rolling_shutter_projection import camera_poses
from gen_data.core.scene import Camera, Lidar, Scene
from gen_data.core.se3 import SE3, Array

Mask = NDArray[np.bool_]

PIXELS_PER_VOXEL = 3.0
"""Pixels along the side of a voxel at the far end of the box: of larger images, every n-th pixel in
both directions is enough to hit the visible voxels."""
STEPS_PER_VOXEL = 2.0
"""Points along the side of a voxel on lines of a scanner: shorter passes are missed."""
EDGE_VOXELS = np.float32(1e-3)
"""Distance of lines from the faces of the box, which keeps rounded points inside."""
BATCH = 8_192
"""Points and lines that are handled at once, as fit into the cache of a core."""
INSTANTS = 33
"""Instants of a sweep at which a moving scanner's place is computed; between them it is linear."""


def seen_by_camera(box: VoxelBox, scene: Scene, reading: SensorReading) -> Mask:
    """Voxels that a camera observes, bool [x, y, z]."""
    camera = reading.camera
    range_m = reading.channels[Channel.RANGE]
    # One more voxel takes the points outside the box.
    observed = np.zeros(box.count + 1, np.bool_)
    reach_m = _farthest_m(box, camera.T_world_camera)
    focal_px = max(camera.intrinsics.fx_px, camera.intrinsics.fy_px)
    every = max(1, int(focal_px * box.voxel_m / (PIXELS_PER_VOXEL * reach_m)))
    near_m = range_m[::every, ::every]
    R, t = (pose[::every] for pose in _row_poses(scene, camera))
    rays = camera.intrinsics.pixel_rays()[::every, ::every]
    rows = max(1, BATCH // near_m.shape[1])
    for first in range(0, len(near_m), rows):
        band = slice(first, first + rows)
        shown = near_m[band] < reach_m
        if shown.any():
            numbers = _hit_voxels(box, R[band], t[band], rays[band], near_m[band])
            observed[numbers[shown]] = True

    height, width = range_m.shape
    for numbers, p_camera in _ahead(box, camera):
        pixel = np.floor(camera.intrinsics.project(p_camera))
        inside = (pixel[:, 0] >= 0) & (pixel[:, 0] < width) & (pixel[:, 1] >= 0)
        inside &= pixel[:, 1] < height
        (u, v), (x, y, z) = pixel[inside].T.astype(np.intp), p_camera[inside].T
        through = range_m[v, u].astype(np.float64) ** 2 > x * x + y * y + z * z
        observed[numbers[inside][through]] = True
    return observed[:-1].reshape(box.shape)


def _row_poses(scene: Scene, camera: Camera) -> tuple[Array, Array]:
    """Rotation and centre of a camera at the instant of every row, world, [h, 3, 3] and [h, 3]."""
    pose, height = camera.T_world_camera, camera.intrinsics.height_px
    if camera.shutter.rolls:
        return camera_poses(scene, camera, camera.shutter.row_delays_s(height))
    R, t = pose.rotation(), np.array(pose.translation_m)
    return np.broadcast_to(R, (height, 3, 3)), np.broadcast_to(t, (height, 3))


def _hit_voxels(
    box: VoxelBox, R: Array, t: Array, rays: Array, range_m: NDArray[np.floating]
) -> NDArray[np.intp]:
    """Voxels of the surfaces in some rows of an image, [h, w]; of no meaning where there is none.

    The rows have poses R [h, 3, 3], t [h, 3]; pixels have rays [h, w, 3].
    """
    far = np.where(np.isfinite(range_m), range_m, 0.0).astype(np.float64)
    p_camera = [rays[..., axis] * far for axis in range(3)]
    p_world = [turned(R[:, k].T[..., None], p_camera) + t[:, k, None] for k in range(3)]
    xyz_m = np.stack(p_world).reshape(3, -1).astype(np.float32)
    numbers = box.numbers(box.map_from(box.T_world_frame.inverse()).places(xyz_m))
    return numbers.reshape(range_m.shape)


def _farthest_m(box: VoxelBox, T_world_camera: SE3) -> float:
    away = box.T_world_frame.apply(box.corners_m) - T_world_camera.translation_m
    return float(np.sqrt((away * away).sum(axis=1)).max())


def _ahead(box: VoxelBox, camera: Camera) -> Iterator[tuple[NDArray[np.intp], Array]]:
    """Numbers of the voxels in a cone around a camera's image, and their centres in its frame.

    Columns of voxels [n] and [n, 3], some columns at a time.
    """
    T_camera_frame = camera.T_world_camera.inverse() @ box.T_world_frame
    R = T_camera_frame.rotation() * box.voxel_m
    first = T_camera_frame.apply(np.asarray(box.low_m) + 0.5 * box.voxel_m)
    i, j, k = (np.arange(n, dtype=np.float64) for n in box.shape)
    edge = camera.intrinsics.pixel_rays()[[0, 0, -1, -1], [0, -1, 0, -1], 2]
    cosine = float(edge.min()) if np.isfinite(edge).all() else -1.0
    foot = np.stack([(first[a] + R[a, 0] * i)[:, None] + R[a, 1] * j for a in range(3)])
    foot = foot.reshape(3, -1)
    nz = box.shape[2]
    columns = _columns_in_cone(foot, R[:, 2] * (nz - 1), cosine, box.voxel_m)
    some = max(1, BATCH // nz)
    for start in range(0, len(columns), some):
        chosen = columns[start : start + some]
        x, y, z = (foot[a, chosen, None] + R[a, 2] * k for a in range(3))
        squares = x * x + y * y + z * z
        # cos(angle) >= cosine, without a root: by the signs of both.
        kept = np.flatnonzero(z * np.abs(z) >= cosine * abs(cosine) * squares)
        numbers = (chosen[:, None] * nz + np.arange(nz)).reshape(-1)[kept]
        yield numbers, np.stack([a.reshape(-1)[kept] for a in (x, y, z)], axis=1)


def _columns_in_cone(
    foot_m: Array, along_m: Array, cosine: float, margin_m: float
) -> NDArray[np.intp]:
    """Columns of points from feet [3, n] along a vector that a cone around Z may contain, [m]."""
    x, y, z = foot_m + 0.5 * along_m[:, None]
    radius_m = 0.5 * float(np.sqrt((along_m * along_m).sum())) + margin_m
    # Distance of a ball's middle from the cone, along the normal of its surface.
    sine = math.sqrt(max(0.0, 1.0 - cosine * cosine))
    return np.flatnonzero(np.sqrt(x * x + y * y) * cosine - z * sine <= radius_m)


def seen_by_scanner(box: VoxelBox, scene: Scene, cloud: PointCloud) -> Mask:
    """Voxels that a scanner observes, bool [x, y, z]; the scene is at the middle of its sweep."""
    T_frame_lidar = box.T_world_frame.inverse() @ cloud.lidar.T_world_lidar
    # One more voxel takes the points outside the box.
    observed = np.zeros(box.count + 1, np.bool_)
    places_m = (
        _origins_m(scene, cloud.lidar, cloud.points["time_s"]),
        cloud.points["position_m"].astype(np.float64).T,
    )
    start, end = (_places(box, T_frame_lidar, p) for p in places_m)
    observed[box.numbers(end)] = True
    for numbers in _voxels_of_lines(box, start, end - start):
        observed[numbers] = True
    return observed[:-1].reshape(box.shape)


def _places(box: VoxelBox, T_frame_points: SE3, xyz_m: Array) -> NDArray[np.float32]:
    """Points [3, n] in voxels from the lowest corner of the box, [3, n]."""
    R = T_frame_points.rotation()
    return np.stack(
        [
            ((turned(row, xyz_m) + t - low) / box.voxel_m).astype(np.float32)
            for row, t, low in zip(R, T_frame_points.translation_m, box.low_m, strict=True)
        ]
    )


def _voxels_of_lines(
    box: VoxelBox, start: NDArray[np.float32], along: NDArray[np.float32]
) -> Iterator[NDArray[np.intp]]:
    """Voxels of points along lines [3, n] in a box from 0, one of each of some lines at a time."""
    first, last = _within(start, along, box.shape)
    x, y, z = along
    length = np.sqrt(x * x + y * y + z * z)
    steps = np.ceil((last - first) * length * STEPS_PER_VOXEL).astype(np.int32)
    order = np.argsort(-steps)
    for begin in range(0, len(order), BATCH):
        lines = order[begin : begin + BATCH]
        number, some = steps[lines], along[:, lines]
        onwards = some * ((last - first)[lines] / np.maximum(number, 1).astype(np.float64))
        here = start[:, lines] + some * first[lines] + 0.5 * onwards
        voxel = np.zeros(here.shape, np.int32)
        # Numbers of lines with more than 0, 1, 2 ... points.
        counts = len(lines) - np.searchsorted(number[::-1], np.arange(number[0]), "right")
        for count in counts.tolist():
            np.copyto(voxel[:, :count], here[:, :count], casting="unsafe")
            yield box.ravel(voxel[:, :count])
            here[:, :count] += onwards[:, :count]


def _origins_m(scene: Scene, lidar: Lidar, time_s: NDArray[np.float32]) -> Array:
    """Where a scanner was when its pulses left, in the lidar frame [m], [3, n]."""
    body = lidar.rig and scene.rig(lidar.rig).body
    track = scene.track(body) if body else None
    if track is None:
        return np.zeros((3, len(time_s)))
    T_body_lidar = scene.rig(lidar.rig).T_body_rig @ lidar.T_rig_lidar
    instants_s = np.linspace(-0.5, 0.5, INSTANTS) * lidar.sweep_s
    R, t = track.poses(scene.time_s + instants_s)
    shift = np.asarray(T_body_lidar.translation_m)
    p_world = np.einsum("nij,j->ni", R, shift, optimize=False) + t
    p_lidar = lidar.T_world_lidar.inverse().apply(p_world)
    # Returns of one firing, which follow one another, share its instant.
    starts = np.flatnonzero(np.diff(time_s, prepend=np.float32(np.nan)) != 0.0)
    fired_s = time_s[starts].astype(np.float64) - 0.5 * lidar.sweep_s
    counts = np.diff(starts, append=len(time_s))
    return np.stack([np.repeat(np.interp(fired_s, instants_s, p), counts) for p in p_lidar.T])


def _within(
    start: NDArray[np.float32], along: NDArray[np.float32], shape: tuple[int, int, int]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Shares of lines [3, n] at which they enter and leave a box from 0; equal for none.

    Source: the slab method of Kay and Kajiya, SIGGRAPH 1986.
    """
    tiny = np.where(np.abs(along) < 1e-9, np.float32(1e-9), along)
    low, high = EDGE_VOXELS, np.array(shape, np.float32)[:, None] - EDGE_VOXELS
    one, other = (low - start) / tiny, (high - start) / tiny
    first = np.clip(np.minimum(one, other).max(axis=0), 0.0, 1.0)
    last = np.clip(np.maximum(one, other).min(axis=0), 0.0, 1.0)
    return first, np.maximum(first, last)
