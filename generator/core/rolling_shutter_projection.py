"""Projection with a rolling shutter: every point at the instant of the row that shows it."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gen_data.core.scene import Camera, Instance, Scene
from gen_data.core.se3 import IDENTITY, SE3, Array

_ITERATIONS = 5
"""The row of a point depends on its instant and vice versa. Each fixed-point iteration shrinks the
error by the ratio of the image's speed to the readout's, a factor of ten or more."""


def project_rolling_shutter(
    scene: Scene, camera: Camera, points_m: Array, instance: Instance | None = None
) -> tuple[Array, Array]:
    """Project points [n, 3] at the instants of the rows that show them.

    They are in the frame of the instance that carries them, or fixed in the world without one.

    Returns:
        Points in the camera frame of their instant [m], [n, 3], and their image coordinates [px],
        [n, 2]; NaN for points outside the lens's field.
    """
    p_frame = np.asarray(points_m, np.float64)

    def world(delays_s: Array) -> Array:
        if instance is None:
            return p_frame
        carrier = _find_carrier(scene, instance)
        R, t = _poses(scene, carrier, instance.T_world_instance, IDENTITY, delays_s)
        return np.asarray(np.einsum("nij,nj->ni", R, p_frame, optimize=False) + t)

    p_camera, image_px, _ = project_moving_points(scene, camera, world, len(p_frame))
    return p_camera, image_px


def project_moving_points(
    scene: Scene, camera: Camera, world: Callable[[Array], Array], count: int
) -> tuple[Array, Array, Array]:
    """Project moving points at the instants of the rows that show them.

    Args:
        scene: At the image's instant.
        camera: Camera of the image.
        world: World coordinates [m] of the points, [n, 3], at their delays from that instant [n].
        count: Number of points.

    Returns:
        As ``project_rolling_shutter``, and the delay of each point [s], [n].
    """
    shutter, lens = camera.shutter, camera.intrinsics
    delays_s = np.zeros(count)
    for _ in range(_ITERATIONS if shutter.rolls else 1):
        R, t = camera_poses(scene, camera, delays_s)
        p_camera = np.einsum("nji,nj->ni", R, world(delays_s) - t, optimize=False)
        image_px = lens.project(p_camera)
        seen_s, v = delays_s, np.clip(image_px[:, 1], 0.0, lens.height_px)
        delays_s = np.where(np.isfinite(v), shutter.delay_s(v, lens.height_px), delays_s)
    return p_camera, image_px, seen_s


def world_points(
    scene: Scene, camera: Camera, p_camera_m: Array, rows: NDArray[np.integer]
) -> Array:
    """World coordinates [m] of points that are visible in some rows, [n, 3].

    ``p_camera_m`` [n, 3] is in the camera frame of each row's instant, the scene at the image's.
    """
    if not camera.shutter.rolls:
        return camera.T_world_camera.apply(p_camera_m)
    delays_s = camera.shutter.row_delays_s(camera.intrinsics.height_px)
    R, t = camera_poses(scene, camera, delays_s)
    return np.asarray(np.einsum("nij,nj->ni", R[rows], p_camera_m, optimize=False) + t[rows])


def _find_carrier(scene: Scene, instance: Instance) -> str:
    """Name of the body that defines an instance's frame; empty for robots, whose base is fixed."""
    if any(a.instance_id == instance.instance_id for a in scene.articulations):
        return ""
    own = (body.name for body in scene.bodies if body.instance_id == instance.instance_id)
    return next(own, "")


def camera_poses(scene: Scene, camera: Camera, delays_s: Array) -> tuple[Array, Array]:
    """Rotations [n, 3, 3] and centres [n, 3] of a camera, world, at delays from the instant [n]."""
    if not camera.rig:
        return _poses(scene, "", camera.T_world_camera, IDENTITY, delays_s)
    rig = scene.rig(camera.rig)
    T_body_camera = rig.T_body_rig @ camera.T_rig_camera
    return _poses(scene, rig.body, camera.T_world_camera, T_body_camera, delays_s)


def _poses(
    scene: Scene, body: str, at_rest: SE3, T_body_frame: SE3, delays_s: Array
) -> tuple[Array, Array]:
    """World rotations [n, 3, 3] and origins [n, 3] of a frame on a body, at several instants.

    The instants are relative to the scene's, [n]; ``at_rest`` is the pose of the frame if the body
    does not move.
    """
    track = scene.track(body) if body else None
    n = len(delays_s)
    if track is None:
        R_world_frame = np.broadcast_to(at_rest.rotation(), (n, 3, 3))
        return R_world_frame, np.broadcast_to(np.asarray(at_rest.translation_m), (n, 3))
    R, t = track.poses(scene.time_s + delays_s)
    shift = np.asarray(T_body_frame.translation_m)
    origin = np.einsum("nij,j->ni", R, shift, optimize=False) + t
    return np.einsum("nij,jk->nik", R, T_body_frame.rotation(), optimize=False), origin
