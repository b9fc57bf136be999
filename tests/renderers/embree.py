"""Views of cameras by Embree, from the same bodies and rays."""

import numpy as np

from gen_data.core.interfaces import AssetLibrary
from gen_data.core.scene import Camera, Scene
from tests.embree import RayCaster, placed


def pixel_ways(camera: Camera) -> np.ndarray:
    """Directions through pixel centres in the world, [h, w, 3]; z = 1 in the camera frame."""
    k = camera.intrinsics
    v, u = np.mgrid[0 : k.height_px, 0 : k.width_px] + 0.5
    along = np.stack([(u - k.cx_px) / k.fx_px, (v - k.cy_px) / k.fy_px, np.ones_like(u)], axis=-1)
    return np.asarray(camera.T_world_camera.rotate(along))


def cast(scene: Scene, assets: AssetLibrary, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """z-depth [m] (inf = nothing) and instance id (0 = nothing) at every pixel centre.

    Embree's parameter, which counts in lengths of the direction, is the z-depth.
    """
    caster = RayCaster(*(placed(body, assets) for body in scene.bodies))
    hits = caster.cast(camera.T_world_camera.translation_m, pixel_ways(camera))
    # The last id is for NOTHING.
    ids = np.array([*(body.instance_id for body in scene.bodies), 0], np.uint16)
    return hits.distance, ids[hits.mesh]


def cast_layers(
    scene: Scene, assets: AssetLibrary, camera: Camera, layers: int
) -> tuple[np.ndarray, np.ndarray]:
    """z-depth [m] and instance id of the first surfaces of a pinhole, [h, w, layers].

    Rays end at the first material that neither transmits light nor is partly transparent; their
    meshes have one material each.
    """
    caster = RayCaster(*(placed(body, assets) for body in scene.bodies))
    materials = [assets.mesh(body.asset).materials[0] for body in scene.bodies]
    clear = np.array([*(m.transmission > 0 or m.opacity < 1 for m in materials), False])
    ids = np.array([*(body.instance_id for body in scene.bodies), 0], np.uint16)
    ways = pixel_ways(camera)
    begin, going = np.zeros(ways.shape[:2]), np.ones(ways.shape[:2], bool)
    depths_m, numbers = [], []
    for _ in range(layers):
        starts = camera.T_world_camera.translation_m + begin[..., None] * ways
        hits = caster.cast(starts, ways)
        met = going & (hits.mesh >= 0)
        depth_m = np.where(met, begin + hits.distance, np.inf)
        depths_m.append(depth_m)
        numbers.append(np.where(met, ids[hits.mesh], 0))
        going = met & clear[hits.mesh]
        begin = np.where(going, depth_m + 3e-5, 0.0)
    return np.stack(depths_m, axis=-1), np.stack(numbers, axis=-1)


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
