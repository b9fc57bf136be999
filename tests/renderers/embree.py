"""An independent ray caster: Open3D's Embree scene with the same bodies and rays."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gen_data.generator.core.interfaces import AssetLibrary
from gen_data.generator.core.scene import Camera, Scene


def open3d_or_skip() -> Any:
    """The module; the test is skipped, with the remedy, where system libraries are missing."""
    try:
        import open3d
    except (ImportError, OSError) as error:
        pytest.skip(
            f"open3d cannot be loaded ({error}): apt-get install libusb-1.0-0 libgl1 libegl1"
        )
    return open3d


def cast(scene: Scene, assets: AssetLibrary, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """z-depth [m] (inf = nothing) and instance id (0 = nothing) at every pixel centre.

    Rays have z = 1 in the camera frame, so Embree's parameter, which counts in lengths of the
    direction, is the z-depth.
    """
    o3d = open3d_or_skip()
    caster = o3d.t.geometry.RaycastingScene(nthreads=1)
    instance_of = {}
    for body in scene.bodies:
        mesh = assets.mesh(body.asset)
        vertices = body.T_world_body.apply(mesh.vertices_m.astype(np.float64) * body.scale)
        number = caster.add_triangles(
            o3d.core.Tensor(vertices.astype(np.float32)),
            o3d.core.Tensor(mesh.faces.astype(np.uint32)),
        )
        instance_of[number] = body.instance_id
    k = camera.intrinsics
    v, u = np.mgrid[0 : k.height_px, 0 : k.width_px] + 0.5
    along = np.stack([(u - k.cx_px) / k.fx_px, (v - k.cy_px) / k.fy_px, np.ones_like(u)], axis=-1)
    directions = camera.T_world_camera.rotate(along)
    origin = np.broadcast_to(camera.T_world_camera.translation_m, directions.shape)
    rays = np.concatenate([origin, directions], axis=-1).astype(np.float32)
    hit = caster.cast_rays(o3d.core.Tensor(rays))
    numbers = hit["geometry_ids"].numpy()
    ids = np.zeros(numbers.shape, np.uint16)
    for number, instance_id in instance_of.items():
        ids[numbers == number] = instance_id
    return hit["t_hit"].numpy(), ids


def near_edges(ids: np.ndarray, depth_m: np.ndarray) -> np.ndarray:
    """Pixels that touch a silhouette: another id or a jump in depth among the 8 neighbours."""
    edge = np.zeros(ids.shape, bool)
    filled = np.where(np.isfinite(depth_m), depth_m, 1e3)
    padded_ids, padded_m = np.pad(ids, 1, mode="edge"), np.pad(filled, 1, mode="edge")
    height, width = ids.shape
    for dy in range(3):
        for dx in range(3):
            other = padded_ids[dy : dy + height, dx : dx + width]
            other_m = padded_m[dy : dy + height, dx : dx + width]
            edge |= (other != ids) | (np.abs(other_m - filled) > 0.02 * filled)
    return edge
