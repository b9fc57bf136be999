"""What cameras and laser scanners observe of a box of voxels."""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gen_data.annotations.voxel_box import VoxelBox
from gen_data.core.capture import Channel, PointCloud, SensorReading
from gen_data.core.rolling_shutter_projection import world_points
from gen_data.core.scene import Camera, Lidar, Scene
from gen_data.core.se3 import SE3, Array

Mask = NDArray[np.bool_]

PIXELS_PER_VOXEL = 3.0
"""Pixels along the side of a voxel at the far end of the box: of larger images, every n-th pixel in
both directions is enough to hit what is visible."""
STEPS_PER_VOXEL = 2.0
"""Points along the side of a voxel on lines of a scanner: shorter passes are missed."""
EDGE_VOXELS = np.float32(1e-3)
"""What lines keep away from the faces of the box, so that rounding puts no point outside."""
INSTANTS = 33
"""Instants of a sweep at which a moving scanner's place is computed; between them it is linear."""


def seen_by_camera(box: VoxelBox, scene: Scene, reading: SensorReading) -> Mask:
    """Voxels that a camera observes, bool [x, y, z]."""
    camera = reading.camera
    range_m = reading.channels[Channel.RANGE]
    observed = np.zeros(math.prod(box.shape), np.bool_)

    reach_m = _farthest_m(box, camera.T_world_camera)
    focal_px = max(camera.intrinsics.fx_px, camera.intrinsics.fy_px)
    every = max(1, int(focal_px * box.voxel_m / (PIXELS_PER_VOXEL * reach_m)))
    near = range_m[::every, ::every]
    rows, columns = np.nonzero(near < reach_m)
    rays = camera.intrinsics.pixel_rays()[::every, ::every][rows, columns]
    p_camera = rays * near[rows, columns, None].astype(np.float64)
    p_world = world_points(scene, camera, p_camera, rows * every)
    hit = box.numbers(box.T_world_frame.inverse(), p_world)
    observed[hit[hit >= 0]] = True

    numbers, p_camera = _ahead(box, camera)
    pixel = np.floor(camera.intrinsics.project(p_camera))
    height, width = range_m.shape
    inside = (pixel[:, 0] >= 0) & (pixel[:, 0] < width) & (pixel[:, 1] >= 0)
    inside &= pixel[:, 1] < height
    numbers, p_camera, (u, v) = numbers[inside], p_camera[inside], pixel[inside].T.astype(np.intp)
    through = range_m[v, u].astype(np.float64) ** 2 > (p_camera * p_camera).sum(axis=1)
    observed[numbers[through]] = True
    return observed.reshape(box.shape)


def _farthest_m(box: VoxelBox, T_world_camera: SE3) -> float:
    away = box.T_world_frame.apply(box.corners_m) - T_world_camera.translation_m
    return float(np.sqrt((away * away).sum(axis=1)).max())


def _ahead(box: VoxelBox, camera: Camera) -> tuple[NDArray[np.intp], Array]:
    """Numbers of the voxels in a cone around a camera's image, and their centres in its frame."""
    T_camera_frame = camera.T_world_camera.inverse() @ box.T_world_frame
    R = T_camera_frame.rotation() * box.voxel_m
    first = T_camera_frame.apply(np.asarray(box.low_m) + 0.5 * box.voxel_m)
    i, j, k = (np.arange(n, dtype=np.float64) for n in box.shape)
    x, y, z = (
        (first[a] + R[a, 0] * i)[:, None, None] + (R[a, 1] * j)[:, None] + R[a, 2] * k
        for a in range(3)
    )
    edge = camera.intrinsics.pixel_rays()[[0, 0, -1, -1], [0, -1, 0, -1], 2]
    cosine = float(edge.min()) if np.isfinite(edge).all() else -1.0
    squares = x * x + y * y + z * z
    # cos(angle) >= cosine, without a root: by the signs of both.
    kept = (z * np.abs(z) >= cosine * abs(cosine) * squares).reshape(-1)
    numbers = np.flatnonzero(kept)
    return numbers, np.stack([a.reshape(-1)[numbers] for a in (x, y, z)], axis=1)


def seen_by_scanner(box: VoxelBox, scene: Scene, cloud: PointCloud) -> Mask:
    """Voxels that a scanner observes, bool [x, y, z]; the scene is at the middle of its sweep."""
    T_frame_lidar = box.T_world_frame.inverse() @ cloud.lidar.T_world_lidar
    observed = np.zeros(math.prod(box.shape), np.bool_)
    places_m = (
        _origins_m(scene, cloud.lidar, cloud.points["time_s"]),
        cloud.points["position_m"].astype(np.float64),
    )
    start, end = (
        ((T_frame_lidar.apply(p) - box.low_m) / box.voxel_m).astype(np.float32) for p in places_m
    )
    inside = ((end >= 0.0) & (end < box.shape)).all(axis=1)
    x, y, z = end[inside].T.astype(np.intp)
    _, ny, nz = box.shape
    observed[(x * ny + y) * nz + z] = True
    for passed in _points_of_lines(start, end - start, box.shape):
        x, y, z = passed
        x *= ny
        x += y
        x *= nz
        x += z
        observed[x] = True
    return observed.reshape(box.shape)


def _points_of_lines(
    start: NDArray[np.float32], along: NDArray[np.float32], shape: tuple[int, int, int]
) -> Iterator[NDArray[np.int32]]:
    """Voxels [3, n] of points along lines [n, 3] in a box from 0, one of each line at a time."""
    first, last = _within(start, along, shape)
    length = np.sqrt((along * along).sum(axis=1))
    steps = np.ceil((last - first) * length * STEPS_PER_VOXEL).astype(np.intp)
    order = np.argsort(-steps, kind="stable")
    steps, first = steps[order], first[order]
    stride = (last[order] - first) / np.maximum(steps, 1)
    step = np.ascontiguousarray((along[order] * stride[:, None]).T)
    point = np.ascontiguousarray((start[order] + along[order] * first[:, None]).T) + 0.5 * step
    voxel = np.zeros(point.shape, np.int32)
    for number in range(int(steps.max(initial=0))):
        count = int(np.searchsorted(-steps, -number))
        np.copyto(voxel[:, :count], point[:, :count], casting="unsafe")
        yield voxel[:, :count]
        point[:, :count] += step[:, :count]


def _origins_m(scene: Scene, lidar: Lidar, time_s: NDArray[np.float32]) -> Array:
    """Where a scanner was when its pulses left, in the lidar frame [m], [n, 3]."""
    body = lidar.rig and scene.rig(lidar.rig).body
    track = scene.track(body) if body else None
    if track is None:
        return np.zeros((len(time_s), 3))
    T_body_lidar = scene.rig(lidar.rig).T_body_rig @ lidar.T_rig_lidar
    instants_s = np.linspace(-0.5, 0.5, INSTANTS) * lidar.sweep_s
    R, t = track.poses(scene.time_s + instants_s)
    shift = np.asarray(T_body_lidar.translation_m)
    p_world = np.einsum("nij,j->ni", R, shift, optimize=False) + t
    p_lidar = lidar.T_world_lidar.inverse().apply(p_world)
    fired_s = time_s.astype(np.float64) - 0.5 * lidar.sweep_s
    return np.stack([np.interp(fired_s, instants_s, p) for p in p_lidar.T], axis=1)


def _within(
    start: NDArray[np.float32], along: NDArray[np.float32], shape: tuple[int, int, int]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Shares of lines [n, 3] at which they enter and leave a box from 0; equal for none.

    Source: the slab method of Kay and Kajiya, SIGGRAPH 1986.
    """
    tiny = np.where(np.abs(along) < 1e-9, np.float32(1e-9), along)
    low, high = EDGE_VOXELS, np.asarray(shape, np.float32) - EDGE_VOXELS
    one, other = (low - start) / tiny, (high - start) / tiny
    first = np.clip(np.minimum(one, other).max(axis=1), 0.0, 1.0)
    last = np.clip(np.maximum(one, other).min(axis=1), 0.0, 1.0)
    return first, np.maximum(first, last)
