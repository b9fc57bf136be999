"""pyrender: OpenGL, two spots without size, shadows from shadow maps."""

import os
from collections.abc import Callable, Sequence

os.environ.setdefault("PYOPENGL_PLATFORM", "egl")

import numpy as np
import pyrender
import trimesh

from benchmarks.peers.worlds import FAR_M, NEAR_M, Images, World


def open_renderer(worlds: Sequence[World]) -> Callable[[World], Images]:
    """A scene of all bodies, moved for each world; ids are a second pass."""
    first = worlds[0]
    scene = pyrender.Scene(ambient_light=(0.1, 0.1, 0.1))
    bodies = [
        scene.add(pyrender.Mesh.from_trimesh(trimesh.load(path, process=False)))
        for path in first.meshes
    ]
    camera = scene.add(pyrender.PerspectiveCamera(first.vfov_rad, znear=NEAR_M, zfar=FAR_M))
    lamps = [
        scene.add(pyrender.SpotLight(intensity=20, innerConeAngle=0.5, outerConeAngle=1.0))
        for _ in first.lamps
    ]
    renderer = pyrender.OffscreenRenderer(*first.size_px)

    def draw(world: World) -> Images:
        for node, T in zip(bodies, world.T_world_bodies, strict=True):
            scene.set_pose(node, np.array(T))
        scene.set_pose(camera, world.T_world_gl)
        for node, lamp in zip(lamps, world.lamps, strict=True):
            scene.set_pose(node, _aim(np.array(lamp.position_m), world.focus_m))
        rgb, depth_m = renderer.render(scene, flags=pyrender.RenderFlags.SHADOWS_SPOT)
        colors = {node: (0, 0, number) for node, number in zip(bodies, world.ids, strict=True)}
        ids, _ = renderer.render(scene, flags=pyrender.RenderFlags.SEG, seg_node_map=colors)
        return Images(rgb, np.where(depth_m == 0, np.inf, depth_m), ids[..., 2])

    return draw


def _aim(position_m: np.ndarray, target_m: np.ndarray) -> np.ndarray:
    """Pose whose -Z axis points at the target."""
    z = (position_m - target_m) / np.linalg.norm(position_m - target_m)
    x = np.cross((0.0, 1.0, 0.0), z)
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    T[:3, 3] = position_m
    return T
