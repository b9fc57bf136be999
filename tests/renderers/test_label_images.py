"""Label channels on scenes whose answers are known in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Body, Camera, Instance, Scene
from gen_data.core.se3 import SE3, look_at
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.settings import RenderSettings
from tests.renderers.fake_library import FakeLibrary, box_mesh, plane_mesh, sphere_mesh

LENS = Intrinsics(64, 48, 60.0, 60.0, 32.0, 24.0)
DOWN = Camera("top", look_at((0.0, 0.0, 3.0), (0.0, 0.0, 0.0)), LENS)
ALL = frozenset(Channel)


@pytest.fixture(scope="module")
def library() -> FakeLibrary:
    return FakeLibrary(
        {"box": box_mesh(), "ball": sphere_mesh(0.5, rings=64), "plane": plane_mesh()}
    )


@pytest.fixture(scope="module", params=["raster", "rays"])
def renderer(library: FakeLibrary, request: pytest.FixtureRequest) -> WarpRenderer:
    return WarpRenderer(library, "cpu", RenderSettings(visibility=request.param))


def scene_of(*bodies: Body) -> Scene:
    instances = tuple(
        Instance(
            b.instance_id, b.name, "thing", 7, b.asset,
            T_world_instance=b.T_world_body,
            box_min_m=(-0.5 * b.scale,) * 3, box_max_m=(0.5 * b.scale,) * 3,
        )
        for b in bodies
        if b.instance_id
    )  # fmt: skip
    return Scene("test", bodies=bodies, instances=instances)


PLANE = Body("plane", "plane")
BOX = Body("box", "box", SE3((0.0, 0.0, 0.5)), instance_id=1)


def test_depth_of_a_facing_plane_is_its_distance_at_every_pixel(renderer: WarpRenderer) -> None:
    """z-depth is constant over a fronto-parallel plane, corners included; range is not."""
    reading = renderer.render(scene_of(PLANE), DOWN, ALL)

    np.testing.assert_allclose(reading.channels[Channel.Z_DEPTH], 3.0, atol=1e-5)
    v, u = np.mgrid[0:48, 0:64] + 0.5
    slant = np.sqrt(((u - 32) / 60) ** 2 + ((v - 24) / 60) ** 2 + 1.0)
    np.testing.assert_allclose(reading.channels[Channel.RANGE], 3.0 * slant, rtol=1e-5)


def test_normals_are_in_the_camera_frame_and_face_the_camera(renderer: WarpRenderer) -> None:
    """A plane seen from above has the normal (0, 0, -1): the camera looks along its Z."""
    normals = renderer.render(scene_of(PLANE), DOWN, ALL).channels[Channel.NORMALS]

    np.testing.assert_allclose(normals, np.broadcast_to([0, 0, -1], normals.shape), atol=1e-5)


def test_sphere_has_its_closed_form_depth(renderer: WarpRenderer) -> None:
    """Ray-sphere intersection within the tessellation's sagitta, away from the silhouette."""
    scene = scene_of(Body("ball", "ball", instance_id=1))
    depth_m = renderer.render(scene, DOWN, ALL).channels[Channel.Z_DEPTH].astype(float)
    v, u = np.mgrid[0:48, 0:64] + 0.5
    d = np.stack([(u - 32) / 60, (v - 24) / 60, np.ones_like(u)], axis=-1)
    a, b, c = (d * d).sum(-1), -2 * 3.0 * d[..., 2], 3.0**2 - 0.5**2
    root = b * b - 4 * a * c
    expected_m = np.where(root > 0, (-b - np.sqrt(np.maximum(root, 0))) / (2 * a), np.inf)
    inside = root > 0.4  # where the surface is not seen at a grazing angle

    sagitta_m = 0.5 * (1 - math.cos(math.pi / 128))
    assert np.abs(depth_m[inside] - expected_m[inside]).max() < 4 * sagitta_m
    assert np.isinf(depth_m[root < -0.1]).all()


def test_nothing_has_the_stated_values(renderer: WarpRenderer) -> None:
    """A camera without anything in view: infinite depth, zero otherwise, empty silhouettes."""
    away = Camera("away", look_at((0.0, 0.0, 3.0), (0.0, 0.0, 9.0)), LENS)
    reading = renderer.render(scene_of(PLANE, BOX), away, ALL)

    assert np.isinf(reading.channels[Channel.Z_DEPTH]).all()
    assert np.isinf(reading.channels[Channel.RANGE]).all()
    for channel in (Channel.INSTANCE, Channel.PART, Channel.CATEGORY, Channel.NORMALS):
        assert not reading.channels[channel].any()
    assert reading.silhouettes[1].mask.size == 0


def test_pixel_belongs_to_what_its_centre_sees(renderer: WarpRenderer) -> None:
    """An edge at 22.45 px leaves pixel 22 (centre 22.5) inside; an edge at 22.55 px does not."""
    for edge_px, first in ((22.45, 22), (22.55, 23)):
        # The box's top is 2 m below the camera: 1 px is 2 / 60 m.
        left_m = (edge_px - 32.0) * 2.0 / 60.0
        box = Body("box", "box", SE3((left_m + 0.5, 0.0, 0.5)), instance_id=1)
        ids = renderer.render(scene_of(box), DOWN, ALL).channels[Channel.INSTANCE]

        assert np.flatnonzero(ids[24])[0] == first


def test_ids_name_instance_part_and_category(renderer: WarpRenderer) -> None:
    """Instance ids reach 65535; parts and categories follow the body's instance."""
    link = Body("arm/link", "box", SE3((0.0, 0.0, 0.5)), instance_id=65535, part_id=3)
    channels = renderer.render(scene_of(PLANE, link), DOWN, ALL).channels

    assert set(np.unique(channels[Channel.INSTANCE])) == {0, 65535}
    seen = channels[Channel.INSTANCE] == 65535
    assert (channels[Channel.PART][seen] == 3).all()
    assert (channels[Channel.CATEGORY][seen] == 7).all()
    assert (channels[Channel.CATEGORY][~seen] == 0).all()


def test_object_coordinates_are_positions_in_the_box(renderer: WarpRenderer) -> None:
    """On the top face z is 1; x and y run from 0 to 1 with the pixel."""
    channels = renderer.render(scene_of(BOX), DOWN, ALL).channels
    coordinates = channels[Channel.OBJECT_COORDINATES]
    seen = channels[Channel.INSTANCE] == 1
    rows, columns = np.nonzero(seen)
    p_camera = DOWN.intrinsics.unproject(channels[Channel.Z_DEPTH])[rows, columns]
    expected = DOWN.T_world_camera.apply(p_camera) - [-0.5, -0.5, 0.0]

    np.testing.assert_allclose(coordinates[seen], expected, atol=1e-4)
    assert not coordinates[~seen].any()


def test_silhouette_holds_hidden_and_outlying_parts(renderer: WarpRenderer) -> None:
    """A box half outside the image and half behind another has the silhouette of a box alone."""
    hidden = Body("hidden", "box", SE3((1.1, 0.0, 0.5)), instance_id=2)
    cover = Body("cover", "box", SE3((0.9, 0.0, 1.6)), scale=0.5, instance_id=3)
    reading = renderer.render(scene_of(BOX, hidden, cover), DOWN, ALL)
    silhouette = reading.silhouettes[2]
    visible = reading.channels[Channel.INSTANCE] == 2

    # Its near face spans 0.6..1.6 m at a distance of 2 m: 50..80 px, beyond the image's 64.
    assert silhouette.x_px + silhouette.mask.shape[1] == 80
    alone = renderer.render(scene_of(hidden), DOWN, ALL).channels[Channel.INSTANCE] == 2
    rows = slice(silhouette.y_px, silhouette.y_px + silhouette.mask.shape[0])
    inside = silhouette.mask[:, : 64 - silhouette.x_px]
    assert np.array_equal(alone[rows, silhouette.x_px :], inside)
    assert visible.sum() < alone.sum()


def test_raster_and_rays_agree(library: FakeLibrary) -> None:
    """Away from edges ids are equal, and depth has the same bits: both use one formula."""
    raster = WarpRenderer(library, "cpu", RenderSettings(visibility="raster"))
    rays = WarpRenderer(library, "cpu", RenderSettings(visibility="rays"))
    camera = Camera("c", look_at((1.9, -1.4, 1.7), (0.0, 0.0, 0.4), 0.2), LENS)
    ball = Body("ball", "ball", SE3((0.9, 0.5, 0.5)), instance_id=2)
    scene = scene_of(PLANE, BOX, ball)

    a, b = (r.render(scene, camera, ALL).channels for r in (raster, rays))

    same = a[Channel.INSTANCE] == b[Channel.INSTANCE]
    assert same.mean() > 0.99
    equal_depth = a[Channel.Z_DEPTH] == b[Channel.Z_DEPTH]
    assert equal_depth.mean() > 0.97


def test_surface_through_the_camera_plane_is_clipped_not_lost(renderer: WarpRenderer) -> None:
    """Standing in the middle of a large plane, half of it lies behind the camera."""
    camera = Camera("c", look_at((0.0, 0.0, 0.5), (1.0, 0.0, 0.2)), LENS)
    depth_m = renderer.render(scene_of(PLANE), camera, ALL).channels[Channel.Z_DEPTH]
    v = np.arange(48) + 0.5
    d_world = camera.T_world_camera.rotate(
        np.stack([np.zeros(48), (v - 24) / 60, np.ones(48)], axis=-1)
    )
    expected_m = np.where(d_world[:, 2] < -0.13, -0.5 / d_world[:, 2], np.nan)
    known = np.isfinite(expected_m)

    np.testing.assert_allclose(depth_m[known, 32], expected_m[known], rtol=2e-3)
    assert np.isfinite(depth_m[-1]).all()


def test_unknown_device_is_refused(library: FakeLibrary) -> None:
    with pytest.raises(ConfigError, match="cuda:9"):
        WarpRenderer(library, "cuda:9")
