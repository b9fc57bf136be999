"""Laser ranges and labels of random scenes against Intel Embree, and against arithmetic."""

import numpy as np
import pytest

from gen_data.core.capture import LidarHits, LidarRays
from gen_data.core.scene import Body, Instance, Lidar, Scene
from gen_data.core.se3 import SE3
from gen_data.renderers.warp.renderer import WarpRenderer
from tests.embree import RayCaster, placed
from tests.renderers.fake_library import (
    FakeLibrary,
    box_mesh,
    plane_mesh,
    room_mesh,
    scattered_pose,
    sphere_mesh,
)

MESHES = {
    "room": room_mesh((60.0, 60.0, 20.0)), "box": box_mesh((1.8, 4.0, 1.5)),
    "ball": sphere_mesh(0.8, rings=24), "plane": plane_mesh(400.0),
}  # fmt: skip


def random_scene(seed: int) -> tuple[Scene, Lidar]:
    """A hall far from the origin with forty rotated and scaled bodies, and a tilted scanner."""
    rng = np.random.default_rng(seed)
    away = (300.0, -200.0, 5.0)
    bodies = [Body("room", "room", SE3(away))]
    for k in range(40):
        pose = SE3(away) @ scattered_pose(rng, (-25, -25, 0), (25, 25, 6))
        asset, scale = str(rng.choice(["box", "ball"])), float(rng.uniform(0.4, 1.8))
        bodies.append(Body(f"b{k}", asset, pose, scale, instance_id=k + 1))
    things = tuple(Instance(k + 1, f"b{k}", "thing", 1, "box") for k in range(40))
    q = np.array([1.0, *rng.normal(scale=0.05, size=3)])
    eye = tuple(float(v) for v in np.add(away, (0.3, -0.4, 8.0)))
    pose = SE3(eye, tuple(map(float, q / np.linalg.norm(q))))
    return Scene("random", tuple(bodies), things), Lidar("top", "color", T_world_lidar=pose)


def directions(count: int, seed: int) -> np.ndarray:
    v = np.random.default_rng(seed).normal(size=(count, 3))
    return (v / np.linalg.norm(v, axis=1, keepdims=True)).astype(np.float32)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_ranges_and_labels_agree_with_embree(seed: int) -> None:
    """Ranges within a millimetre and labels equal on 99.9 % of 20,000 rays."""
    scene, lidar = random_scene(seed)
    library = FakeLibrary(MESHES)
    rays = directions(20_000, seed)
    in_world = [placed(body, library) for body in scene.bodies]
    to_lidar = lidar.T_world_lidar.inverse()
    hits = RayCaster(*((to_lidar.apply(at), faces) for at, faces in in_world)).cast((0, 0, 0), rays)
    ids = np.array([body.instance_id for body in scene.bodies])[hits.mesh]

    echoes = WarpRenderer(library, "cpu").scan(scene, lidar, LidarRays(rays, 0.0, 1, 200.0))

    assert (np.abs(echoes.range_m[:, 0] - hits.distance) < 1e-3).mean() >= 0.999
    assert (echoes.instance_id[:, 0] == ids).mean() >= 0.999
    assert (echoes.category_id[:, 0] == (ids > 0)).mean() >= 0.999


DOWN = np.array([[0.0, 0.0, -1.0]], np.float32)


def above_a_plane(height_m: float, beams: LidarRays) -> LidarHits:
    """Echoes of a plane with instance id 3."""
    lidar = Lidar("top", "color", T_world_lidar=SE3((10.0, 20.0, height_m)))
    scene = Scene("plane", (Body("plane", "plane", instance_id=3),))
    return WarpRenderer(FakeLibrary(MESHES), "cpu").scan(scene, lidar, beams)


def test_a_ground_plane_is_where_geometry_says() -> None:
    """Range = height / sine of the angle downwards; cosine of incidence = that sine."""
    down = np.radians(np.array([1.0, 2.0, 5.0, 20.0, 60.0, 90.0]))
    rays = np.stack([np.cos(down), np.zeros(6), -np.sin(down)], axis=1).astype(np.float32)
    echoes = above_a_plane(1.73, LidarRays(rays, 0.0, 1, 120.0))

    np.testing.assert_allclose(echoes.range_m[:, 0], 1.73 / np.sin(down), rtol=1e-5)
    np.testing.assert_allclose(echoes.incidence_cos[:, 0], np.sin(down), rtol=1e-4)


def test_nothing_beyond_the_reach_of_beams_is_hit() -> None:
    """Ranges are inf, labels and reflectance 0."""
    near, far = (above_a_plane(30.0, LidarRays(DOWN, 0.0, 1, reach_m)) for reach_m in (29.0, 31.0))

    assert near.range_m[0, 0] == np.inf
    assert near.instance_id[0, 0] == 0 and near.reflectance[0, 0] == 0.0
    assert far.range_m[0, 0] == pytest.approx(30.0)
    assert far.instance_id[0, 0] == 3


def test_rays_of_a_wide_beam_surround_its_axis() -> None:
    """On a plane at normal incidence, the six rays end on the circle of half the beam's light."""
    echoes = above_a_plane(10.0, LidarRays(DOWN, 0.2, 7, 120.0))

    slant_m = 10.0 * np.hypot(1.0, np.tan(0.1) / np.sqrt(2.0))
    np.testing.assert_allclose(echoes.range_m[0], [10.0, *[slant_m] * 6], rtol=1e-5)
