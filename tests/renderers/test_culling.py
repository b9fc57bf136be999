"""Culling before rendering removes only hidden bodies, and edges stay in place."""

import numpy as np
import pytest

from gen_data.core import capture, se3
from gen_data.core.scene import Body, Instance, Scene
from gen_data.renderers.warp.device import open_device
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.scene import bvh, device_assets, device_cache
from gen_data.renderers.warp.scene.scene_packing import pack_view, pack_world
from gen_data.renderers.warp.visibility.gbuffer import bodies_within, project_vertices
from tests.renderers import fake_library

MESHES = {
    "box": fake_library.box_mesh(), "sphere": fake_library.sphere_mesh(0.5, rings=12),
    "room": fake_library.room_mesh(),
}  # fmt: skip


def ring_of_boxes() -> Scene:
    """Boxes all around a camera, near and far, above and below."""
    rng = np.random.default_rng(3)
    spots = rng.uniform(-6.0, 6.0, (300, 3))
    bodies = [Body(f"b{k}", "box", se3.SE3(tuple(p)), 0.6, k + 1) for k, p in enumerate(spots)]
    instances = [Instance(k + 1, f"b{k}", "box", 1, "box") for k in range(len(spots))]
    return Scene("test", tuple(bodies), tuple(instances))


@pytest.mark.parametrize("margin", [0.0, 1.0])
def test_a_body_with_a_vertex_in_the_pyramid_is_kept(margin: float) -> None:
    """Vertices are projected by Intrinsics; most bodies are culled all the same."""
    scene, camera = ring_of_boxes(), fake_library.camera_at((0.0, 0.0, 0.0), (1.0, 0.2, 0.1))
    cache = device_cache.DeviceCache(fake_library.FakeLibrary(MESHES), open_device("cpu"))
    kept = set(
        bodies_within(
            pack_world(scene, camera, cache).body_records, pack_view(camera, cache), margin
        )
    )
    size = np.array([camera.intrinsics.width_px, camera.intrinsics.height_px])
    needed = set()
    for number, body in enumerate(scene.bodies):
        vertices = body.T_world_body.apply(MESHES["box"].vertices_m.astype(float) * body.scale)
        image = camera.intrinsics.project(camera.T_world_camera.inverse().apply(vertices))
        inside = (image > -margin * size) & (image < (1.0 + margin) * size)
        if inside.all(axis=-1).any():
            needed.add(number)
    assert needed <= kept
    assert len(kept) < 0.5 * len(scene.bodies)


def slabs_all_around() -> Scene:
    """Long thin boxes, many of which extend from the front of the camera to behind it."""
    rng = np.random.default_rng(5)
    spots, turns = rng.uniform(-5.0, 5.0, (200, 3)), rng.uniform(0.0, 6.3, 200)
    bodies = [
        Body(f"b{k}", "slab", se3.SE3.about_z(float(turn), tuple(spot)), 1.0, k + 1)
        for k, (spot, turn) in enumerate(zip(spots.tolist(), turns, strict=True))
    ]
    instances = [Instance(k + 1, f"b{k}", "slab", 1, "slab") for k in range(len(bodies))]
    return Scene("test", tuple(bodies), tuple(instances))


def test_whatever_is_drawn_was_projected() -> None:
    """Bodies that pass the narrow test but not the wide one must not be drawn."""
    meshes = {"slab": fake_library.box_mesh((8.0, 0.4, 1.0))}
    scene = slabs_all_around()
    cache = device_cache.DeviceCache(fake_library.FakeLibrary(meshes), open_device("cpu"))
    apart = 0
    for target in ((1.0, 0.2, 0.1), (-1.0, 0.4, -0.3), (0.2, 1.0, 0.5)):
        camera = fake_library.camera_at((0.0, 0.0, 0.0), target)
        world, view = pack_world(scene, camera, cache), pack_view(camera, cache)
        projected = project_vertices(world, view, cache)
        narrow = bodies_within(world.body_records, view, 0.0)
        apart += len(np.setdiff1d(narrow, projected.reached))
        assert np.isin(projected.in_view.numpy()["body"], projected.reached).all()
    assert apart > 0


def test_labels_do_not_depend_on_bodies_out_of_view() -> None:
    """The same image and silhouettes with and without bodies behind the camera."""
    scene, camera = ring_of_boxes(), fake_library.camera_at((0.0, 0.0, 0.0), (1.0, 0.2, 0.1))
    forward = camera.T_world_camera.rotation()[:, 2]
    ahead = [b for b in scene.bodies if np.dot(b.T_world_body.translation_m, forward) > -0.6]
    ids = {body.instance_id for body in ahead}
    fewer = Scene("test", tuple(ahead), tuple(i for i in scene.instances if i.instance_id in ids))
    wanted = frozenset({capture.Channel.INSTANCE, capture.Channel.Z_DEPTH, capture.Channel.AMODAL})
    renderer = WarpRenderer(fake_library.FakeLibrary(MESHES), "cpu")

    with_all, without = (renderer.render(s, camera, wanted) for s in (scene, fewer))

    for channel in (capture.Channel.INSTANCE, capture.Channel.Z_DEPTH):
        np.testing.assert_array_equal(with_all.channels[channel], without.channels[channel])
    for instance_id in ids:
        a, b = with_all.silhouettes[instance_id], without.silhouettes[instance_id]
        assert (a.x_px, a.y_px) == (b.x_px, b.y_px)
        np.testing.assert_array_equal(a.mask, b.mask)


@pytest.mark.parametrize("name", sorted(MESHES))
def test_every_face_lies_in_one_of_the_boxes(name: str) -> None:
    """All three corners of each face in the same box."""
    mesh = MESHES[name]
    lows, highs = device_assets.boxes_around(*bvh.face_boxes(mesh.vertices_m, mesh.faces))
    corners = mesh.vertices_m[mesh.faces]
    within = (corners[:, None] >= lows[None, :, None]) & (corners[:, None] <= highs[None, :, None])
    assert within.all(axis=(2, 3)).any(axis=1).all()
    assert len(lows) <= len(mesh.faces)
