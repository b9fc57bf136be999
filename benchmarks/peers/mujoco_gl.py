"""MuJoCo's OpenGL renderer: two lights without size, shadows from shadow maps."""

import os
from collections.abc import Callable, Sequence

import numpy as np

from benchmarks.peers.worlds import FAR_M, NEAR_M, Images, World

os.environ.setdefault("MUJOCO_GL", "egl")


def open_renderer(worlds: Sequence[World]) -> Callable[[World], Images]:
    """A model of all bodies, moved for each world; colour, depth and ids are three passes.

    Raises:
        ImportError: MuJoCo or an EGL driver is missing.
    """
    import mujoco

    first = worlds[0]
    width_px, height_px = first.size_px
    spec = mujoco.MjSpec()
    spec.visual.global_.offwidth, spec.visual.global_.offheight = first.size_px
    spec.visual.quality.shadowsize = 2048
    for k, path in enumerate(first.meshes):
        spec.add_mesh(name=f"mesh{k}", file=path)
        body = spec.worldbody.add_body(name=f"body{k}", mocap=True)
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"mesh{k}")
    for lamp in first.lamps:
        spec.worldbody.add_light(
            type=mujoco.mjtLightType.mjLIGHT_SPOT, cutoff=60, castshadow=True, pos=lamp.position_m
        )
    spec.worldbody.add_camera(name="camera", resolution=first.size_px)
    model = spec.compile()
    data = mujoco.MjData(model)
    model.vis.map.znear = NEAR_M / model.stat.extent
    model.vis.map.zfar = FAR_M / model.stat.extent
    bodies_of_geoms = np.append(model.geom_bodyid, 0)  # -1, nothing, is the last one
    try:
        renderer = mujoco.Renderer(model, height_px, width_px)
    except Exception as error:  # each platform of PyOpenGL raises different errors
        raise ImportError(f"no EGL driver: {error}") from error

    def draw(world: World) -> Images:
        for k, T in enumerate(np.array(world.T_world_bodies)):
            mocap = model.body(f"body{k}").mocapid[0]
            data.mocap_pos[mocap] = T[:3, 3]
            mujoco.mju_mat2Quat(data.mocap_quat[mocap], T[:3, :3].ravel())
        model.cam_pos[0] = world.T_world_gl[:3, 3]
        mujoco.mju_mat2Quat(model.cam_quat[0], world.T_world_gl[:3, :3].ravel())
        model.cam_fovy[0] = np.degrees(world.vfov_rad)
        for k, lamp in enumerate(world.lamps):
            direction = world.focus_m - lamp.position_m
            model.light_pos[k] = lamp.position_m
            model.light_dir[k] = direction / np.linalg.norm(direction)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_camlight(model, data)
        renderer.update_scene(data, camera="camera")
        rgb = renderer.render()
        renderer.enable_depth_rendering()
        depth_m = renderer.render()
        renderer.disable_depth_rendering()
        renderer.enable_segmentation_rendering()
        geoms = renderer.render()[..., 0]
        renderer.disable_segmentation_rendering()
        ids = np.array([0, *world.ids])  # body 0 is the world
        return Images(rgb, depth_m, ids[bodies_of_geoms[geoms]])

    return draw
