"""Objects in mirrors: closed forms of plane mirrors, and Intel Embree along reflected rays."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gen_data.core.asset_types import Material
from gen_data.core.capture import MIRRORED, Channel
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.scene import Body, Camera, Scene
from gen_data.core.scene_time import scene_at
from gen_data.core.se3 import SE3, look_at
from gen_data.core.shutter import INSTANT, Shutter
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.settings import RenderSettings
from tests.embree import RayCaster, placed
from tests.renderers.embree import near_edges
from tests.renderers.fake_library import FakeLibrary, box_mesh, plane_mesh, room_mesh, sphere_mesh
from tests.renderers.moving import world

SILVER = Material((0.9, 0.9, 0.9), 0.02, metallic=1.0)
GLASS = Material(transmission=1.0)
LIBRARY = FakeLibrary(
    {
        "mirror": plane_mesh(2.0, (SILVER,)), "wide": plane_mesh(60.0, (SILVER,)),
        "brushed": plane_mesh(2.0, (replace(SILVER, roughness=0.3),)),
        "film": plane_mesh(60.0, (GLASS,)), "wall": plane_mesh(60.0), "room": room_mesh(),
        "box": box_mesh((0.4, 0.3, 0.5)), "ball": sphere_mesh(0.2, 16),
        "speck": box_mesh((1e-3, 1e-3, 1e-3)),
    }
)  # fmt: skip
ALL = frozenset(MIRRORED) | {Channel.INSTANCE, Channel.Z_DEPTH}
PINHOLE = Intrinsics(32, 24, 20.0, 20.0, 16.0, 12.0)


@pytest.fixture(scope="module")
def renderer() -> WarpRenderer:
    return WarpRenderer(LIBRARY, "cpu")


def body(asset: str, z_m: float, number: int, x_m: float = 0.0) -> Body:
    return Body(f"{asset} {z_m}", asset, SE3((x_m, 0.0, z_m)), instance_id=number)


def ahead(lens: Intrinsics = PINHOLE) -> Camera:
    """A camera at the origin that looks along Z."""
    return Camera("camera", SE3(), lens)


def test_a_mirror_ahead_shows_the_wall_behind_the_camera(renderer: WarpRenderer) -> None:
    """It is 3 m ahead and the wall 2 m behind: rays are 8 m long, and go straight on sidewards."""
    scene = Scene("s", (body("mirror", 3.0, 1), body("wall", -2.0, 2)))
    images = renderer.render(scene, ahead(), ALL).channels
    ids, places = images[Channel.SEEN_IN_MIRROR], images[Channel.MIRRORED_POSITION]
    mirror = images[Channel.INSTANCE] == 1
    v, u = np.mgrid[0:24, 0:32] + 0.5
    expected = np.stack([(u - 16.0) / 20.0 * 8.0, (v - 12.0) / 20.0 * 8.0, 0.0 * u - 2.0], axis=-1)

    assert (ids == np.where(mirror, 2, 0)).all()
    assert mirror.any() and not mirror.all()
    np.testing.assert_allclose(places[mirror], expected[mirror], atol=1e-4)
    assert np.isnan(places[~mirror]).all()


@pytest.mark.parametrize("film_m", [1.0, 2.5])
def test_mirrors_behind_glass_and_objects_behind_it_are_told_apart(
    renderer: WarpRenderer, film_m: float
) -> None:
    """Mirrors are found through glass; glass in a mirror is the object seen in it."""
    scene = Scene("s", (body("wide", 3.0, 1), body("wall", -2.0, 2), body("film", film_m, 3)))
    images = renderer.render(scene, ahead(), ALL).channels
    assert (images[Channel.INSTANCE] == 3).all()
    assert (images[Channel.SEEN_IN_MIRROR] == 3).all()
    np.testing.assert_allclose(images[Channel.MIRRORED_POSITION][..., 2], film_m, atol=1e-4)


@pytest.mark.parametrize("bodies", [
    (body("brushed", 3.0, 1), body("wall", -2.0, 2)), (body("wall", 3.0, 1), body("wall", -2.0, 2)),
    (body("wide", 3.0, 1),),
], ids=["brushed metal", "a wall", "the sky in a mirror"])  # fmt: skip
def test_other_surfaces_and_the_sky_show_no_instance(
    renderer: WarpRenderer, bodies: tuple[Body, ...]
) -> None:
    images = renderer.render(Scene("s", bodies), ahead(), ALL).channels
    assert (images[Channel.SEEN_IN_MIRROR] == 0).all()
    assert np.isnan(images[Channel.MIRRORED_POSITION]).all()


def test_a_wide_lens_sees_the_same_in_a_mirror(renderer: WarpRenderer) -> None:
    """Along its own rays: the wall 5 m behind the mirror, 8 m along the axis."""
    lens = Intrinsics(40, 40, 15.0, 15.0, 20.0, 20.0, Lens("kannala_brandt", (0.003, 0.001, 0, 0)))
    scene = Scene("s", (body("mirror", 3.0, 1), body("wall", -2.0, 2)))
    images = renderer.render(scene, ahead(lens), ALL).channels
    mirror = images[Channel.SEEN_IN_MIRROR] == 2
    rays = lens.pixel_rays()
    expected = rays / rays[..., 2:] * [8.0, 8.0, 0.0] - [0.0, 0.0, 2.0]

    assert (mirror == (images[Channel.INSTANCE] == 1)).all() and mirror.any()
    found = images[Channel.MIRRORED_POSITION][mirror]
    np.testing.assert_allclose(found, expected[mirror], atol=1e-3)


def test_mirrors_of_a_rolling_shutter_show_each_row_at_its_instant() -> None:
    """A camera passes a mirror, and in it a ball, by 40 px while rows are read."""
    renderer = WarpRenderer(LIBRARY, "cpu")
    ball = replace(body("ball", -1.5, 2), scale=3.0)
    shutter = Shutter(readout_s=0.05)
    scene = world(
        body("mirror", 2.0, 1), ball, camera_velocity_m_s=(20.0, 0.0, 0.0), shutter=shutter,
        time_s=0.0,
    )  # fmt: skip
    ids = renderer.render(scene, scene.cameras[0], ALL).channels[Channel.SEEN_IN_MIRROR]

    for row in range(25, 39, 3):
        then = scene_at(scene, 0.05 * ((row + 0.5) / 64 - 0.5))
        camera = replace(then.cameras[0], shutter=INSTANT)
        expected = renderer.render(then, camera, ALL).channels[Channel.SEEN_IN_MIRROR][row]
        # Rows share an instant in bands of a quarter of a pixel: its two ends may differ.
        assert np.count_nonzero(ids[row] != expected) <= 2
        assert (expected == 2).any()


@pytest.mark.parametrize("method", ["raster", "rays"])
@pytest.mark.parametrize("seed", range(2))
def test_mirrors_in_a_room_agree_with_embree(method: str, seed: int) -> None:
    """Ids are equal off silhouettes of mirrors and in them, and places within 1e-4 of the way."""
    rng = np.random.default_rng(seed)
    bodies = [Body("room", "room", instance_id=1)]
    for k, angle in enumerate((0.4, 1.7, 5.7)):
        x, y = 2.2 * math.cos(angle), 2.2 * math.sin(angle)
        # Its normal +Z turns towards the middle of the room.
        pose = look_at(
            (x, y, 1.2), (float(rng.uniform(-0.5, 0.5)), 0.0, float(rng.uniform(0.8, 1.6)))
        )
        bodies.append(Body(f"m{k}", "mirror", pose, instance_id=k + 2))
    for k in range(12):
        place = tuple(float(v) for v in rng.uniform((-1.2, -1.2, 0.3), (1.2, 1.2, 2.0)))
        asset = ("box", "ball")[k % 2]
        pose = SE3.about_z(float(rng.uniform(0, 6)), place)
        bodies.append(Body(f"b{k}", asset, pose, instance_id=k + 5))
    scene = Scene("room", tuple(bodies))
    pose = look_at((-2.4, -2.2, 1.8), (0.6, 0.6, 1.1))
    camera = Camera("camera", pose, Intrinsics.from_hfov(320, 240, 1.4))
    images = WarpRenderer(LIBRARY, "cpu", RenderSettings(visibility=method)).render(
        scene, camera, ALL
    ).channels  # fmt: skip

    caster = RayCaster(*(placed(b, LIBRARY) for b in scene.bodies))
    eye = np.array(camera.T_world_camera.translation_m)
    rays = camera.T_world_camera.rotate(camera.intrinsics.pixel_rays())
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    first = caster.cast(eye, rays)
    is_mirror = np.array([b.asset == "mirror" for b in scene.bodies])[first.mesh]
    n = first.normal
    reflected = rays - 2.0 * np.sum(rays * n, axis=-1, keepdims=True) * n
    at = eye + first.distance[..., None] * rays
    second = caster.cast(at + 1e-4 * reflected, reflected)
    ids = np.array([b.instance_id for b in scene.bodies])
    expected = np.where(is_mirror, ids[second.mesh], 0)
    length = first.distance + second.distance + 1e-4
    places = at + (second.distance + 1e-4)[..., None] * reflected

    edges = near_edges(ids[first.mesh], first.distance)
    edges |= near_edges(expected, np.where(is_mirror, length, 1.0))
    inside = ~edges
    assert inside.mean() > 0.7
    np.testing.assert_array_equal(images[Channel.SEEN_IN_MIRROR][inside], expected[inside])
    shown = inside & is_mirror
    off = np.linalg.norm(images[Channel.MIRRORED_POSITION] - places, axis=-1)
    assert (off[shown] < 1e-4 * length[shown]).all()
    assert np.isnan(images[Channel.MIRRORED_POSITION][inside & ~is_mirror]).all()
    assert shown.mean() > 0.03 and len(np.unique(expected[shown])) > 4
