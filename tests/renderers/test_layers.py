"""Surfaces along rays: closed forms of flat panes, and Intel Embree on scenes with many bodies."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gen_data.core.asset_types import LAYER_MATERIALS, Material
from gen_data.core.capture import LAYERS, Channel
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.scene import Body, Camera, Scene
from gen_data.core.scene_time import scene_at
from gen_data.core.se3 import SE3
from gen_data.core.shutter import INSTANT, Shutter
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.settings import RenderSettings
from tests.renderers.embree import cast_layers, near_edges
from tests.renderers.fake_library import (
    FakeLibrary,
    box_mesh,
    camera_at,
    plane_mesh,
    scattered_pose,
    sphere_mesh,
)
from tests.renderers.moving import world
from tests.renderers.test_alpha_cutouts import GRATE, grate_texture

GLASS = Material((1, 1, 1), 0.0, transmission=1.0, role="glass")
SMOKED = Material((0.2, 0.2, 0.2), 0.1, opacity=0.9)
SILVER = Material((0.9, 0.9, 0.9), 0.02, metallic=1.0)
FISHEYE = Lens("kannala_brandt", (0.0034824, 0.00071503, -0.0020532, 0.00020294))
LIBRARY = FakeLibrary(
    {
        "pane": box_mesh((4.0, 4.0, 0.01), (GLASS,)), "film": plane_mesh(60.0, (SMOKED,)),
        "mirror": plane_mesh(60.0, (SILVER,)), "grate": plane_mesh(1.0, (GRATE,)),
        "road": plane_mesh(60.0, (Material(role="asphalt"),)), "box": box_mesh((0.3, 0.2, 0.4)),
        "flask": sphere_mesh(0.2, 12, (GLASS,)), "case": box_mesh((0.3, 0.4, 0.2), (SMOKED,)),
        "ball": sphere_mesh(0.15, 12),
    },
    {"grate": grate_texture()},
)  # fmt: skip
ALL = frozenset(LAYERS) | {Channel.Z_DEPTH, Channel.INSTANCE}
PINHOLE = Intrinsics(24, 16, 20.0, 20.0, 12.0, 8.0)
INF = math.inf


@pytest.fixture(scope="module")
def renderer() -> WarpRenderer:
    return WarpRenderer(LIBRARY, "cpu")


def ahead(layers: int = 0, lens: Intrinsics = PINHOLE) -> Camera:
    """A camera at the origin that looks along Z."""
    return Camera("camera", SE3(), lens, layers=layers)


def body(asset: str, z_m: float, number: int = 0) -> Body:
    return Body(f"{asset} {z_m}", asset, SE3((0.0, 0.0, z_m)), instance_id=number)


STACK = Scene("stack", (
    body("pane", 1.0, 1), body("film", 2.0, 2), body("mirror", 3.0, 3), body("road", 4.0, 4),
))  # fmt: skip
"""A pane 1 cm thick, a film, and a mirror before a road."""


def test_rays_pass_panes_and_films_and_end_at_a_mirror(renderer: WarpRenderer) -> None:
    """Both sides of the pane, the film, the mirror; the road behind it is in no layer."""
    images = renderer.render(STACK, ahead(6), ALL).channels
    depth_m, ids = images[Channel.DEPTH_LAYERS], images[Channel.INSTANCE_LAYERS]
    names = np.array(LAYER_MATERIALS)[images[Channel.MATERIAL_LAYERS]]

    assert depth_m.shape == (16, 24, 6)
    expected_m = np.broadcast_to([0.995, 1.005, 2.0, 3.0, INF, INF], depth_m.shape)
    np.testing.assert_allclose(depth_m, expected_m, atol=1e-5)
    assert (ids == [1, 1, 2, 3, 0, 0]).all()
    assert (names == ["see_through", "see_through", "see_through", "mirror", "", ""]).all()


def test_as_many_layers_as_the_camera_states_and_four_without_a_number(
    renderer: WarpRenderer,
) -> None:
    for stated, given in ((0, 4), (1, 1), (2, 2), (8, 8)):
        images = renderer.render(STACK, ahead(stated), ALL).channels
        for channel in LAYERS:
            assert images[channel].shape == (16, 24, given)
        assert (images[Channel.INSTANCE_LAYERS] == [1, 1, 2, 3, 0, 0, 0, 0][:given]).all()


@pytest.mark.parametrize("channel", LAYERS)
def test_each_channel_alone_is_the_same_as_with_others(
    renderer: WarpRenderer, channel: Channel
) -> None:
    alone = renderer.render(STACK, ahead(), frozenset({channel})).channels
    together = renderer.render(STACK, ahead(), ALL).channels
    assert set(alone) == {channel}
    np.testing.assert_array_equal(alone[channel], together[channel])


def test_roads_have_their_role_and_other_materials_none(renderer: WarpRenderer) -> None:
    scene = Scene("s", (body("road", 2.0), body("ball", 1.0)))
    shown = renderer.render(scene, ahead(), ALL).channels[Channel.MATERIAL_LAYERS][..., 0]
    assert {LAYER_MATERIALS[k] for k in np.unique(shown)} == {"asphalt", "other"}


def test_holes_of_cutouts_are_passed_and_their_solid_parts_are_opaque(
    renderer: WarpRenderer,
) -> None:
    """Behind glass, stripes of a grate hide the road, and its holes show it."""
    scene = Scene("s", (body("film", 1.0, 1), body("grate", 2.0, 2), body("road", 3.0, 3)))
    lens = Intrinsics(64, 4, 256.0, 256.0, 32.0, 2.0)
    ids = renderer.render(scene, ahead(3, lens), ALL).channels[Channel.INSTANCE_LAYERS]

    assert (ids[..., 0] == 1).all()
    # The image is the middle half of the grate: stripes of 16 pixels.
    x_m = (np.arange(64) + 0.5 - 32.0) / 256.0 * 2.0
    solid = np.floor((x_m + 0.5) * 8.0) % 2 == 0
    assert (ids[..., 1] == np.where(solid, 2, 3)).all()
    assert (ids[..., 2] == 0).all()


def test_a_wide_lens_measures_layers_along_its_axis(renderer: WarpRenderer) -> None:
    """Parallel films have one depth each wherever the lens sees them, also 80 degrees aside."""
    lens = Intrinsics(48, 48, 15.0, 15.0, 24.0, 24.0, FISHEYE)
    scene = Scene("s", (body("film", 0.5, 1), body("road", 1.0, 2)))
    images = renderer.render(scene, ahead(2, lens), ALL).channels
    depth_m, ids = images[Channel.DEPTH_LAYERS], images[Channel.INSTANCE_LAYERS]

    np.testing.assert_array_equal(depth_m[..., 0], images[Channel.Z_DEPTH])
    assert (np.isfinite(depth_m) == (ids > 0)).all()
    assert (ids[..., 1] > 0).mean() > 0.6
    np.testing.assert_allclose(depth_m[ids == 1], 0.5, rtol=1e-4)
    np.testing.assert_allclose(depth_m[ids == 2], 1.0, rtol=1e-4)


def test_layers_of_a_rolling_shutter_are_those_of_each_row() -> None:
    """A camera passes a flask before a ball by 40 px while rows are read."""
    meshes = {**LIBRARY.meshes, "speck": box_mesh((1e-3, 1e-3, 1e-3))}
    renderer = WarpRenderer(FakeLibrary(meshes), "cpu")
    flask, ball = body("flask", 2.0, 1), body("ball", 3.0, 2)
    shutter = Shutter(readout_s=0.05)
    scene = world(flask, ball, camera_velocity_m_s=(20.0, 0.0, 0.0), shutter=shutter, time_s=0.0)
    images = renderer.render(scene, scene.cameras[0], ALL).channels
    ids = images[Channel.INSTANCE_LAYERS]

    np.testing.assert_array_equal(images[Channel.DEPTH_LAYERS][..., 0], images[Channel.Z_DEPTH])
    np.testing.assert_array_equal(ids[..., 0], images[Channel.INSTANCE])
    shifted = 0
    for row in range(20, 45, 3):
        then = scene_at(scene, 0.05 * ((row + 0.5) / 64 - 0.5))
        camera = replace(then.cameras[0], shutter=INSTANT)
        expected = renderer.render(then, camera, ALL).channels[Channel.INSTANCE_LAYERS][row]
        # Rows share an instant in bands of a quarter of a pixel: its two ends may differ.
        assert np.count_nonzero((ids[row] != expected).any(axis=-1)) <= 4
        shifted += np.count_nonzero((ids[63 - row] != expected).any(axis=-1))
    assert (ids[32] == [1, 1, 2, 0]).all(axis=-1).any()
    assert shifted > 40


def random_scene(seed: int) -> tuple[Scene, Camera]:
    """Thirty rotated bodies of glass, film and opaque materials, which cut each other, in a row."""
    rng = np.random.default_rng(seed)
    bodies = [Body("road", "road", SE3((0.0, 0.0, -0.5)), instance_id=1)]
    for k in range(30):
        pose = scattered_pose(rng, (-1.5, -0.4, -0.2), (1.5, 0.4, 0.3))
        asset = ("flask", "case", "flask", "box", "ball")[k % 5]
        bodies.append(Body(f"b{k}", asset, pose, instance_id=k + 2))
    camera = camera_at((3.0, 0.3, 0.4), (0.0, 0.0, 0.0), (160, 100), 40.0)
    return Scene("random", tuple(bodies)), replace(camera, layers=6)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("method", ["raster", "rays"])
def test_layers_of_many_bodies_agree_with_embree(seed: int, method: str) -> None:
    """Off silhouettes, ids are equal in every layer and depths within 1e-4 of themselves."""
    scene, camera = random_scene(seed)
    renderer = WarpRenderer(LIBRARY, "cpu", RenderSettings(visibility=method))
    images = renderer.render(scene, camera, ALL).channels
    depth_m, ids = images[Channel.DEPTH_LAYERS], images[Channel.INSTANCE_LAYERS]
    expected_m, expected_ids = cast_layers(scene, LIBRARY, camera, 6)

    np.testing.assert_array_equal(depth_m[..., 0], images[Channel.Z_DEPTH])
    np.testing.assert_array_equal(ids[..., 0], images[Channel.INSTANCE])
    edges = np.zeros(ids.shape[:2], bool)
    for layer in range(6):
        edges |= near_edges(expected_ids[..., layer], expected_m[..., layer])
        inside = ~edges
        np.testing.assert_array_equal(ids[inside, layer], expected_ids[inside, layer])
        there = inside & np.isfinite(expected_m[..., layer])
        np.testing.assert_allclose(depth_m[there, layer], expected_m[there, layer], rtol=1e-4)
    assert (ids[..., 5] > 0).mean() > 0.02
    assert edges.mean() < 0.6
