"""PyBullet's renderers: one light without size, its shadows from a shadow map."""

import importlib.util
from collections.abc import Callable, Sequence

import numpy as np
import pybullet

from benchmarks.peers.worlds import Images, World, projection, unproject_depth

Draw = Callable[[World], Images]


def open_tiny(worlds: Sequence[World]) -> Draw:
    """TinyRenderer, on the CPU."""
    return _open(worlds, pybullet.ER_TINY_RENDERER, shadow=True)


def open_tiny_unshadowed(worlds: Sequence[World]) -> Draw:
    """TinyRenderer without the shadow."""
    return _open(worlds, pybullet.ER_TINY_RENDERER, shadow=False)


def open_egl(worlds: Sequence[World]) -> Draw:
    """OpenGL without a display, on the CPU where the driver is a software rasteriser.

    Raises:
        ImportError: there is no driver.
    """
    found = importlib.util.find_spec("eglRenderer")
    if found is None or found.origin is None:
        raise ImportError("pybullet has no EGL plug-in")
    client = pybullet.connect(pybullet.DIRECT)
    if pybullet.loadPlugin(found.origin, "_eglRendererPlugin", physicsClientId=client) < 0:
        raise ImportError("no EGL driver")
    return _open(worlds, pybullet.ER_BULLET_HARDWARE_OPENGL, shadow=True, client=client)


def _open(
    worlds: Sequence[World], renderer: int, *, shadow: bool, client: int | None = None
) -> Draw:
    client = pybullet.connect(pybullet.DIRECT) if client is None else client
    bodies = []
    for path in worlds[0].meshes:
        shape = pybullet.createVisualShape(
            pybullet.GEOM_MESH, fileName=path, rgbaColor=(0.6, 0.6, 0.6, 1), physicsClientId=client
        )
        bodies.append(pybullet.createMultiBody(baseVisualShapeIndex=shape, physicsClientId=client))

    def draw(world: World) -> Images:
        for body, T in zip(bodies, np.array(world.T_world_bodies), strict=True):
            pybullet.resetBasePositionAndOrientation(
                body, T[:3, 3], quaternion_xyzw(T[:3, :3]), physicsClientId=client
            )
        view = np.linalg.inv(world.T_world_gl)
        to_lamp_m = np.array(world.lamps[0].position_m) - world.focus_m
        distance_m = float(np.linalg.norm(to_lamp_m))
        width_px, height_px = world.size_px
        _, _, rgba, depth, found = pybullet.getCameraImage(
            width_px,
            height_px,
            viewMatrix=view.T.ravel().tolist(),
            projectionMatrix=projection(world).T.ravel().tolist(),
            lightDirection=(to_lamp_m / distance_m).tolist(),
            lightDistance=distance_m,
            shadow=int(shadow),
            renderer=renderer,
            physicsClientId=client,
        )
        shape = (height_px, width_px)
        ids = np.zeros(len(bodies) + 1, np.uint16)
        ids[:-1] = world.ids  # -1, nothing, is the last one: 0
        assert bodies == list(range(len(bodies)))
        return Images(
            np.reshape(rgba, (*shape, 4)).astype(np.uint8)[..., :3],
            unproject_depth(np.reshape(depth, shape)),
            ids[np.reshape(found, shape)],
        )

    return draw


def quaternion_xyzw(rotation: np.ndarray) -> list[float]:
    """Unit quaternion of a rotation matrix, by its largest eigenvector (Bar-Itzhack 2000)."""
    m = rotation
    k = np.array(
        [
            [m[0, 0] - m[1, 1] - m[2, 2], 0, 0, 0],
            [m[1, 0] + m[0, 1], m[1, 1] - m[0, 0] - m[2, 2], 0, 0],
            [m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], m[2, 2] - m[0, 0] - m[1, 1], 0],
            [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], np.trace(m)],
        ]
    )
    values, vectors = np.linalg.eigh(k)
    quaternion: list[float] = vectors[:, np.argmax(values)].tolist()
    return quaternion
