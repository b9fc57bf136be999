"""Bounding volume hierarchies and their traversal, against brute force and Embree."""

import numpy as np
import pytest
import trimesh
import warp as wp

from gen_data.core.scene import Body, Scene
from gen_data.core.se3 import SE3
from gen_data.renderers.warp.device import open_device
from gen_data.renderers.warp.scene.bvh import body_tree, face_boxes, mesh_tree
from gen_data.renderers.warp.scene.device_cache import DeviceCache
from gen_data.renderers.warp.scene.kernels.bvh_traverse import any_in_mesh, first_in_mesh
from gen_data.renderers.warp.scene.kernels.ray_queries import (
    closest_hit,
    is_intersected,
    path_along,
)
from gen_data.renderers.warp.scene.kernels.records import HOLES, World
from gen_data.renderers.warp.scene.scene_packing import pack_world
from tests.embree import NOTHING, RayCaster, placed
from tests.renderers.fake_library import FakeLibrary, box_mesh, forward_camera, sphere_mesh

WIDTH = 8
REACH = 1e3
STACK = 128
"""Half of a ray's stack: one tree over bodies and one over a body's faces share it."""


@wp.kernel
def trace_mesh(
    tree: wp.array(dtype=wp.float32),
    origins: wp.array(dtype=wp.vec3),
    ways: wp.array(dtype=wp.vec3),
    reach: float,
    points: wp.array(dtype=wp.vec3),
    faces: wp.array(dtype=wp.vec2i),
) -> None:
    i = wp.tid()
    found = first_in_mesh(tree, origins[i], ways[i], reach)
    points[i] = wp.vec3(float(found[0]), float(found[1]), float(found[2]))
    blocked = any_in_mesh(tree, origins[i], ways[i], reach)
    faces[i] = wp.vec2i(int(found[3]), wp.where(blocked, 1, 0))


@wp.kernel
def trace_world(
    world: World,
    origins: wp.array(dtype=wp.vec3),
    ways: wp.array(dtype=wp.vec3),
    reach: float,
    t: wp.array(dtype=float),
    bodies: wp.array(dtype=int),
    blocked: wp.array(dtype=int),
) -> None:
    i = wp.tid()
    met = closest_hit(world, origins[i], ways[i], reach, HOLES)
    t[i] = met.t
    bodies[i] = met.at[0]
    blocked[i] = wp.where(
        is_intersected(world, path_along(origins[i], ways[i] * reach), HOLES), 1, 0
    )


def tree_of(vertices: np.ndarray, faces: np.ndarray, *, quick: bool = False) -> np.ndarray:
    return mesh_tree(vertices, faces, *face_boxes(vertices, faces), quick=quick)


def traced(
    tree: np.ndarray, origins: np.ndarray, ways: np.ndarray, reach: float = REACH
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Parameters, weights of first and second corners, faces (-1 = none), any-hit results."""
    device, n = open_device("cpu"), len(origins)
    o, d = (wp.array(a.astype(np.float32), dtype=wp.vec3, device=device) for a in (origins, ways))
    out = [wp.zeros(n, dtype=kind, device=device) for kind in (wp.vec3, wp.vec2i)]
    inputs = [wp.array(tree, dtype=float, device=device), o, d, reach]
    wp.launch(trace_mesh, n, inputs, out, device=device)
    points, faces = (a.numpy() for a in out)
    return points[:, 0], points[:, 1:], faces[:, 0], faces[:, 1] == 1


def by_every_face(
    corners: np.ndarray, origins: np.ndarray, ways: np.ndarray, reach: float = REACH
) -> tuple[np.ndarray, np.ndarray]:
    """Parameter of the first hit, float64 (Moeller and Trumbore 1997), and whether it is clear.

    It is not where the ray passes the edge of a face so closely that 32 bits cannot tell, or lies
    in a face's plane.
    """
    # Faces on top of each other are met where one of them is.
    different = np.unique(corners, axis=0)
    a, b, c = (different[None, :, k].astype(np.float64) for k in range(3))
    o, d = (v.astype(np.float32).astype(np.float64)[:, None] for v in (origins, ways))
    e1, e2, s = b - a, c - a, o - a
    p, q = np.cross(d, e2), np.cross(s, e1)
    det = (e1 * p).sum(-1)
    size = np.linalg.norm(np.cross(e1, e2), axis=-1)
    with np.errstate(all="ignore"):
        u, v, t = (s * p).sum(-1) / det, (d * q).sum(-1) / det, (e2 * q).sum(-1) / det
        inside = np.minimum(np.minimum(u, v), 1.0 - u - v)
        cosine = np.abs(det) / (size * np.linalg.norm(d, axis=-1))
        longest = np.sqrt(np.maximum((e1 * e1).sum(-1), (e2 * e2).sum(-1)))
        doubtful = ~(np.abs(inside) * size * cosine > 1e-5 * longest) & (size > 0.0)
        hits = (inside >= 0.0) & (t >= 0.0) & (t < reach)
    return np.where(hits, t, np.inf).min(axis=1), ~doubtful.any(axis=1)


def soup(seed: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Scattered faces, some large, some axis-aligned, some degenerate."""
    rng = np.random.default_rng(seed)
    middles = rng.uniform(-1, 1, (count, 1, 3))
    size = 10.0 ** rng.uniform(-3, 0, (count, 1, 1))
    corners = middles + size * rng.normal(size=(count, 3, 3))
    flat = rng.random(count) < 0.3
    corners[flat, :, 2] = corners[flat, :1, 2]
    corners[11::17, 1] = corners[11::17, 0]
    return corners.reshape(-1, 3).astype(np.float32), np.arange(3 * count, dtype=np.int32).reshape(
        -1, 3
    )


def rays(seed: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Origins outside and inside, directions of several lengths, many along axes."""
    rng = np.random.default_rng(seed)
    origins = rng.uniform(-2, 2, (count, 3))
    ways = rng.uniform(-1, 1, (count, 3)) - 0.5 * origins
    ways[::3] *= np.eye(3)[rng.integers(3, size=len(ways[::3]))]
    ways[(ways == 0).all(axis=1)] = (0.0, 0.0, -1.0)
    return origins, ways * 10.0 ** rng.uniform(-2, 2, (count, 1))


def walked(tree: np.ndarray, leaf_groups: int) -> tuple[list[int], int]:
    """Faces or bodies in a tree, and the maximum size of the stack if every box is entered.

    Asserts that whatever is in a lane lies in the lane's box.
    """
    groups, codes = tree.reshape(-1, WIDTH), tree.view(np.int32).reshape(-1, WIDTH)
    found: list[int] = []

    def visit(code: int, low: np.ndarray, high: np.ndarray, waiting: int) -> int:
        if code < 0 and leaf_groups == 0:
            found.append(-1 - code)
            return waiting
        if code < 0:
            numbers = codes[-code + 9]
            points = groups[-code : -code + 9].reshape(3, 3, WIDTH)[..., numbers >= 0]
            assert (points >= low[:, None, None]).all()
            assert (points <= high[:, None, None]).all()
            found.extend(numbers[numbers >= 0].tolist())
            return waiting
        sides = groups[code : code + 6].reshape(3, 2, WIDTH)
        lanes = np.flatnonzero((sides[:, 0] <= sides[:, 1]).all(axis=0))
        assert (sides[:, 0, lanes] >= low[:, None]).all()
        assert (sides[:, 1, lanes] <= high[:, None]).all()
        waiting += len(lanes) - 1
        inner = [visit(codes[code + 6, k], sides[:, 0, k], sides[:, 1, k], waiting) for k in lanes]
        return max([waiting, *inner])

    everywhere = np.full(3, np.inf, np.float32)
    deepest = visit(int(codes[0, 0]), -everywhere, everywhere, 1)
    return found, deepest


def geometric_series(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Faces, each half as large and half as far from the corner as the one before."""
    size = 0.5 ** np.arange(count)[:, None, None]
    corners = size * (1.0 + np.array([[0, 0, 0], [0.4, 0, 0], [0, 0.4, 0]])[None])
    faces = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    return corners.reshape(-1, 3).astype(np.float32), faces


MESHES = {
    "one face": soup(0, 1), "eight faces": soup(1, 8), "nine faces": soup(2, 9),
    "a soup": soup(3, 700), "a geometric series": geometric_series(100),
    "faces on top of each other": (soup(4, 1)[0], np.tile(np.int32([[0, 1, 2]]), (3000, 1))),
}  # fmt: skip


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize("name", MESHES)
def test_a_tree_holds_every_face_once_in_boxes_around_it(name: str, quick: bool) -> None:
    vertices, faces = MESHES[name]

    found, waiting = walked(tree_of(vertices, faces, quick=quick), leaf_groups=10)

    assert sorted(found) == list(range(len(faces)))
    assert waiting <= STACK


@pytest.mark.parametrize("count", [0, 1, 2, 8, 9, 500])
def test_a_tree_over_bodies_holds_every_body_once(count: int) -> None:
    lows = np.random.default_rng(count).uniform(-50, 50, (count, 3)).astype(np.float32)

    found, waiting = walked(body_tree(lows, lows + np.float32(2.0)), leaf_groups=0)

    assert sorted(found) == list(range(count))
    assert waiting <= STACK


def test_the_same_mesh_gives_the_same_tree() -> None:
    vertices, faces = soup(5, 400)

    assert tree_of(vertices, faces).tobytes() == tree_of(vertices, faces).tobytes()


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize("name", MESHES)
def test_rays_meet_the_face_that_testing_every_face_finds(name: str, quick: bool) -> None:
    vertices, faces = MESHES[name]
    origins, ways = rays(11, 3000)
    # Some that surely hit something.
    aims = vertices[faces].mean(axis=1)[np.arange(1000) % len(faces)]
    ways[:1000] = aims - origins[:1000]

    t, weights, face, blocked = traced(tree_of(vertices, faces, quick=quick), origins, ways)
    expected, clear = by_every_face(vertices[faces], origins, ways)

    hit = face >= 0
    assert clear.mean() > 0.5
    assert np.array_equal(hit[clear], np.isfinite(expected[clear]))
    assert np.array_equal(blocked, hit)
    assert (t[~hit] == np.float32(REACH)).all()
    both = clear & hit
    length = np.linalg.norm(ways, axis=1)
    assert np.abs((t - expected)[both] * length[both]).max() < 1e-4
    # The weights give the point back.
    u, v = weights[hit].astype(np.float64).T
    share = np.stack([u, v, 1.0 - u - v], axis=-1)[..., None]
    there = (vertices[faces[face[hit]]] * share).sum(axis=1)
    along = origins[hit] + t[hit, None] * ways[hit]
    assert np.abs(there - along).max() < 2e-4


def test_a_ray_ends_at_its_reach() -> None:
    vertices, faces = soup(3, 700)
    origins, ways = rays(12, 3000)
    t, _, face, _ = traced(tree_of(vertices, faces), origins, ways)
    origins, ways, t = (a[face >= 0] for a in (origins, ways, t))
    # One ray each: its reach is in its length.
    before, *_ = traced(tree_of(vertices, faces), origins, ways * (t * 0.999)[:, None], 1.0)
    after, *_ = traced(tree_of(vertices, faces), origins, ways * (t * 1.001)[:, None], 1.0)

    assert len(t) > 1000
    assert (before == 1.0).all()
    assert (after < 1.0).all()


def test_no_ray_leaves_a_closed_mesh() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3)
    vertices, faces = ball.vertices.astype(np.float32), ball.faces.astype(np.int32)
    corners = vertices[faces].astype(np.float64)
    origins = np.concatenate(
        [np.zeros((1, 3)), np.random.default_rng(0).uniform(-0.2, 0.2, (9, 3))]
    )
    # At every corner, at the middle of every edge, and along the axes.
    edges = 0.5 * (corners + np.roll(corners, 1, axis=1))
    aims = np.concatenate([corners.reshape(-1, 3), edges.reshape(-1, 3), np.eye(3), -np.eye(3)])
    o, aim = (a.reshape(-1, 3) for a in np.broadcast_arrays(origins[:, None], aims[None]))

    _, _, face, blocked = traced(tree_of(vertices, faces), o, aim - o)

    assert (face >= 0).all()
    assert blocked.all()


@pytest.mark.parametrize("count", [1, 8, 60])
def test_rays_meet_the_body_that_embree_finds(count: int) -> None:
    rng = np.random.default_rng(count)
    library = FakeLibrary({"box": box_mesh((0.2, 0.3, 0.1)), "ball": sphere_mesh(0.15, rings=17)})
    bodies = []
    for k in range(count):
        turn = rng.normal(size=4)
        pose = SE3(tuple(rng.uniform(-1, 1, 3)), tuple(turn / np.linalg.norm(turn)))
        scale = float(rng.uniform(0.3, 2.0))
        bodies.append(Body(f"body {k}", ("box", "ball")[k % 2], pose, scale=scale))
    scene = Scene("t", tuple(bodies))
    origins, ways = rays(13, 4000)
    ways[::2] = (
        np.array([body.T_world_body.translation_m for body in bodies])[np.arange(2000) % count]
        - origins[::2]
    )

    device = open_device("cpu")
    world = pack_world(scene, forward_camera(), DeviceCache(library, device))
    o, d = (wp.array(a.astype(np.float32), dtype=wp.vec3, device=device) for a in (origins, ways))
    out = [wp.zeros(4000, dtype=kind, device=device) for kind in (float, int, int)]
    wp.launch(trace_world, 4000, [world.record, o, d, REACH], out, device=device)
    t, body, blocked = (a.numpy() for a in out)

    hits = RayCaster(*(placed(body, library) for body in bodies)).cast(origins, ways)
    expected = hits.distance
    number = np.where(expected > REACH, NOTHING, hits.mesh)

    # All but rays through edges.
    assert (body == number).mean() >= 0.999
    assert np.array_equal(blocked == 1, body >= 0)
    both = (body == number) & (body >= 0)
    assert both.sum() > 1500
    assert np.abs((t - expected)[both] * np.linalg.norm(ways, axis=1)[both]).max() < 1e-4
