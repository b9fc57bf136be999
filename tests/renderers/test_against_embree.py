"""Depth and ids of random scenes against Intel Embree, through Open3D."""

from __future__ import annotations

import numpy as np
import pytest

from generator.core.capture import Channel
from generator.core.scene import Body, Camera, Scene
from generator.core.se3 import SE3
from generator.renderers.warp import WarpRenderer
from tests.renderers.fake_library import (
    FakeLibrary,
    box_mesh,
    camera_at,
    room_mesh,
    sphere_mesh,
)

MESHES = {
    "room": room_mesh(),
    "slab": box_mesh((1.6, 1.2, 0.04)),
    "box": box_mesh((0.2, 0.3, 0.1)),
    "ball": sphere_mesh(0.1, rings=24),
    "egg": sphere_mesh(0.07, rings=9),
}


def random_scene(seed: int) -> tuple[Scene, Camera]:
    """A room with a slab and twenty turned and scaled bodies that may cut each other."""
    rng = np.random.default_rng(seed)
    bodies = [Body("room", "room"), Body("slab", "slab", SE3((0.0, 0.0, 0.7)), instance_id=1)]
    for k in range(20):
        q = rng.normal(size=4)
        w, x, y, z = (float(v) for v in q / np.linalg.norm(q))
        place = tuple(float(v) for v in rng.uniform((-0.8, -0.6, 0.7), (0.8, 0.6, 1.2)))
        asset = str(rng.choice(["box", "ball", "egg"]))
        scale = float(rng.uniform(0.4, 1.8))
        bodies.append(Body(f"b{k}", asset, SE3(place, (w, x, y, z)), scale, instance_id=k + 2))
    eye = tuple(float(v) for v in rng.uniform((1.0, -1.5, 1.0), (2.0, 1.5, 2.2)))
    return Scene("random", tuple(bodies)), camera_at(eye, (0.0, 0.0, 0.8), (320, 240))


def embree(scene: Scene, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """z-depth and instance ids of pixel-centre rays made here, not by the renderer."""
    o3d = pytest.importorskip(
        "open3d", reason="Open3D needs system libraries (libGL, libusb) that are not here",
        exc_type=(ImportError, OSError),
    )  # fmt: skip
    world = o3d.t.geometry.RaycastingScene(nthreads=1)
    ids = {}
    for body in scene.bodies:
        mesh = MESHES[body.asset]
        vertices = body.T_world_body.apply(mesh.vertices_m * body.scale).astype(np.float32)
        key = world.add_triangles(
            o3d.core.Tensor(vertices), o3d.core.Tensor(mesh.faces.astype(np.uint32))
        )
        ids[key] = body.instance_id
    k = camera.intrinsics
    u = (np.arange(k.width_px) + 0.5 - k.cx_px) / k.fx_px
    v = (np.arange(k.height_px) + 0.5 - k.cy_px) / k.fy_px
    # Directions with z = 1 in the camera frame: the hit's parameter is then the z-depth.
    d = np.stack(np.broadcast_arrays(u[None], v[:, None], 1.0), axis=-1)
    rays = np.zeros((*d.shape[:2], 6), np.float32)
    rays[..., :3] = camera.T_world_camera.translation_m
    rays[..., 3:] = camera.T_world_camera.rotate(d)
    answer = world.cast_rays(o3d.core.Tensor(rays), nthreads=1)
    keys = answer["geometry_ids"].numpy()
    table = np.zeros(max(ids) + 1, np.int64)
    table[list(ids)] = list(ids.values())
    nothing = keys == world.INVALID_ID
    return answer["t_hit"].numpy(), np.where(nothing, 0, table[np.where(nothing, 0, keys)])


def assert_as_embree(renderer: WarpRenderer, seed: int) -> None:
    scene, camera = random_scene(seed)
    wanted = frozenset({Channel.Z_DEPTH, Channel.INSTANCE})
    channels = renderer.render(scene, camera, wanted).channels
    depth, ids = embree(scene, camera)

    assert (channels[Channel.INSTANCE] == ids).mean() > 0.999
    assert (np.abs(channels[Channel.Z_DEPTH] - depth) < 1e-4).mean() > 0.999


@pytest.mark.parametrize("seed", range(3))
def test_depth_and_ids_are_those_of_embree(seed: int) -> None:
    """Within 0.1 mm, and the same id, on 99.9 % of the pixels."""
    assert_as_embree(WarpRenderer(FakeLibrary(MESHES), "cpu"), seed)


@pytest.mark.slow
def test_depth_and_ids_of_fifty_scenes_are_those_of_embree() -> None:
    """The same, for what three scenes might miss."""
    renderer = WarpRenderer(FakeLibrary(MESHES), "cpu")
    for seed in range(3, 53):
        assert_as_embree(renderer, seed)
