"""Moving bodies during a laser scan, whose pulses are emitted one after another."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.generator.core.capture import LidarRays
from gen_data.generator.core.motion import interpolate_poses
from gen_data.generator.core.scene import Body, Lidar, Scene
from gen_data.generator.core.se3 import Array
from gen_data.generator.renderers.warp.device_cache import DeviceCache
from gen_data.generator.renderers.warp.lidar.kernels import lidar_rays as kernels
from gen_data.generator.renderers.warp.scene.scene_packing import PackedWorld

KEYS = 9
"""Poses over a sweep, interpolated linearly: within 0.2 mm at 10 m/s^2 and 0.1 s."""

SLACK_M = 2e-3
"""Margin by which a body may leave its boxes between keys."""


@dataclass(frozen=True, eq=False, slots=True)
class Mover:
    """A moving body: its number, rotation matrices [KEYS, 3, 3] and positions [KEYS, 3]."""

    number: int
    body: Body
    R_world_mesh: Array
    t_world_mesh: Array


def pack_moving_bodies(
    scene: Scene, lidar: Lidar, beams: LidarRays, world: PackedWorld, cache: DeviceCache
) -> tuple[PackedWorld, kernels.BodyMotion]:
    """The world with boxes around the bodies' whole motion, and that motion."""
    device = cache.device
    motion = kernels.BodyMotion()
    motion.keys = 0
    movers = _find_movers(scene, beams.time_s)
    if beams.time_s is None or not (movers or beams.origins_m is not None):
        return world, motion
    rows = np.full(max(len(scene.bodies), 1), -1, np.int32)
    rows[[mover.number for mover in movers]] = np.arange(len(movers))
    start_s, end_s = float(beams.time_s.min()), float(beams.time_s.max())
    phases = (beams.time_s - start_s) * np.float32((KEYS - 1) / max(end_s - start_s, 1e-9))
    origins_m = beams.origins_m
    if origins_m is None:
        origins_m = np.zeros((len(beams.time_s), 3), np.float32)
    B_mesh_lidar, eye_mesh = _lidar_in_mesh_frames(lidar, movers)
    motion.keys = KEYS
    motion.rows = wp.array(rows, dtype=int, device=device)
    motion.B_mesh_lidar = wp.array(B_mesh_lidar, dtype=wp.mat33, device=device)
    motion.eye_mesh = wp.array(eye_mesh, dtype=wp.vec3, device=device)
    motion.phases = wp.array(phases, dtype=float, device=device, copy=False)
    motion.origins_m = wp.array(origins_m, dtype=wp.vec3, device=device, copy=False)
    return _enclose(world, movers, cache), motion


def _find_movers(scene: Scene, time_s: NDArray[np.float32] | None) -> list[Mover]:
    """Bodies whose pose changes during the scan."""
    if time_s is None or not scene.tracks:
        return []
    keys_s = scene.time_s + np.linspace(float(time_s.min()), float(time_s.max()), KEYS)
    numbers = {body.name: k for k, body in enumerate(scene.bodies)}
    tracks = [
        track
        for track in scene.tracks
        if track.end_s > keys_s[0] and track.start_s < keys_s[-1] and track.body in numbers
    ]
    R, t = interpolate_poses(tracks, keys_s)
    moves = (t != t[:, :1]).any(axis=(1, 2)) | (R[:, :1] != R).any(axis=(1, 2, 3))
    moving = sorted((numbers[tracks[k].body], int(k)) for k in np.flatnonzero(moves))
    return [Mover(number, scene.bodies[number], R[k], t[k]) for number, k in moving]


def _lidar_in_mesh_frames(
    lidar: Lidar, movers: list[Mover]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Directions and origin of the lidar frame in each mover's mesh frame, at each key."""
    if not movers:
        return np.zeros((1, KEYS, 3, 3), np.float32), np.zeros((1, KEYS, 3), np.float32)
    R_world_lidar = lidar.T_world_lidar.rotation()
    R = np.stack([mover.R_world_mesh for mover in movers])
    t = np.stack([mover.t_world_mesh for mover in movers])
    scale = np.array([mover.body.scale for mover in movers])[:, None, None]
    away = np.asarray(lidar.T_world_lidar.translation_m) - t
    B = np.einsum("nkji,jl->nkil", R, R_world_lidar, optimize=False) / scale[..., None]
    eye = np.einsum("nkji,nkj->nki", R, away, optimize=False) / scale
    return B.astype(np.float32), eye.astype(np.float32)


def _enclose(world: PackedWorld, movers: list[Mover], cache: DeviceCache) -> PackedWorld:
    """The world with boxes that contain the movers at all keys."""
    if not movers:
        return world
    low_m, high_m = world.body_records["low_m"].copy(), world.body_records["high_m"].copy()
    numbers = [mover.number for mover in movers]
    meshes = [cache.mesh(mover.body.asset) for mover in movers]
    scale = np.array([mover.body.scale for mover in movers])[:, None]
    low, high = (
        np.stack(corner) for corner in zip(*((m.low_m, m.high_m) for m in meshes), strict=True)
    )
    R = np.stack([mover.R_world_mesh for mover in movers])
    t = np.stack([mover.t_world_mesh for mover in movers])
    centre = t + np.einsum("nkij,nj->nki", R, 0.5 * (low + high) * scale, optimize=False)
    half = 0.5 * (high - low) * scale
    reach = np.einsum("nkij,nj->nki", np.abs(R), half, optimize=False) + SLACK_M
    low_m[numbers] = (centre - reach).min(axis=1)
    high_m[numbers] = (centre + reach).max(axis=1)
    lows_m, highs_m = (
        wp.array(corner, dtype=wp.vec3, device=cache.device) for corner in (low_m, high_m)
    )
    return replace(world, lows_m=lows_m, highs_m=highs_m)
