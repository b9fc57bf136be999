"""Light and exposure, against photometry's closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gen_data.core.asset_types import Material
from gen_data.core.capture import Channel
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Body, Camera, Environment, Light, Scene
from gen_data.core.se3 import SE3, look_at
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.settings import RenderSettings
from tests.renderers.fake_library import FakeLibrary, box_mesh, plane_mesh, sphere_mesh

RADIANCE = frozenset({Channel.RADIANCE})
LENS = Intrinsics(64, 48, 60.0, 60.0, 32.0, 24.0)
DOWN = Camera("top", look_at((0.0, 0.0, 3.0), (0.0, 0.0, 0.0)), LENS)
CHALK = (Material(base_color=(0.5, 0.5, 0.5), roughness=1.0, specular=0.0),)
PLAIN = RenderSettings(ambient_occlusion_radius_m=0.0)
DARK = Environment(luminance_cd_m2=0.0)


@pytest.fixture(scope="module")
def library() -> FakeLibrary:
    return FakeLibrary(
        {
            "plane": plane_mesh(materials=CHALK),
            "ball": sphere_mesh(0.5, rings=48, materials=CHALK),
            "box": box_mesh(materials=CHALK),
        }
    )


@pytest.fixture(scope="module")
def renderer(library: FakeLibrary) -> WarpRenderer:
    return WarpRenderer(library, "cpu", PLAIN)


def test_sun_on_chalk_has_the_luminance_of_lamberts_law(renderer: WarpRenderer) -> None:
    """L = rho * E * cos / pi."""
    tilt = math.radians(40.0)
    direction = (math.sin(tilt), 0.0, -math.cos(tilt))
    sun = Light("sun", "sun", direction=direction, illuminance_lux=900.0)
    scene = Scene("t", bodies=(Body("plane", "plane"),), lights=(sun,), environment=DARK)

    radiance = renderer.render(scene, DOWN, RADIANCE).channels[Channel.RADIANCE]

    expected = 0.5 * 900.0 * math.cos(tilt) / math.pi
    np.testing.assert_allclose(radiance[..., 1], expected, rtol=0.02)


def test_lamp_obeys_the_inverse_square_law(renderer: WarpRenderer) -> None:
    """Straight below a lamp of 500 cd at 2 m: E = 125 lx; at a slant E = I cos / d^2."""
    lamp = Light("lamp", "sphere", (0.0, 0.0, 2.0), intensity_cd=500.0, radius_m=0.001)
    scene = Scene("t", bodies=(Body("plane", "plane"),), lights=(lamp,), environment=DARK)

    shown = renderer.render(scene, DOWN, RADIANCE).channels[Channel.RADIANCE][..., 1]

    x_m = (np.arange(64) + 0.5 - 32) / 60 * 3.0
    d2 = x_m**2 + (0.5 / 60 * 3.0) ** 2 + 4.0
    expected = 0.5 / math.pi * 500.0 * (2.0 / np.sqrt(d2)) / d2
    np.testing.assert_allclose(shown[24], expected, rtol=0.03)


def test_chalk_in_an_even_environment_shows_its_albedo(renderer: WarpRenderer) -> None:
    """A ball under uniform luminance from all directions reflects rho * L at every point."""
    around = Environment(luminance_cd_m2=100.0, visible=False)
    scene = Scene("t", bodies=(Body("ball", "ball"),), environment=around)

    radiance = renderer.render(scene, DOWN, RADIANCE).channels[Channel.RADIANCE]

    shown = radiance[20:28, 28:36, 1]
    np.testing.assert_allclose(shown, 50.0, rtol=0.04)


@pytest.mark.parametrize("roughness", [0.2, 0.5, 0.9])
def test_white_metal_reflects_all_light_but_what_it_shades(roughness: float) -> None:
    """White furnace: a white GGX metal may lose some energy with roughness, and gains none."""
    metal = (Material(base_color=(1.0, 1.0, 1.0), roughness=roughness, metallic=1.0),)
    library = FakeLibrary({"ball": sphere_mesh(0.5, rings=48, materials=metal)})
    around = Environment(luminance_cd_m2=100.0, visible=False)
    scene = Scene("t", bodies=(Body("ball", "ball"),), environment=around)

    radiance = WarpRenderer(library, "cpu", PLAIN).render(scene, DOWN, RADIANCE)

    shown = radiance.channels[Channel.RADIANCE][20:28, 28:36][..., 1]
    assert shown.max() < 104.0
    assert shown.min() > 60.0


def test_invisible_environment_is_black_and_visible_one_has_its_luminance(
    renderer: WarpRenderer,
) -> None:
    up = Camera("up", look_at((0.0, 0.0, 1.0), (0.0, 0.0, 5.0)), LENS)
    seen = Scene("t", environment=Environment(luminance_cd_m2=60.0))
    hidden = Scene("t", environment=Environment(luminance_cd_m2=60.0, visible=False))

    shown = renderer.render(seen, up, RADIANCE).channels[Channel.RADIANCE][..., 1]
    np.testing.assert_allclose(shown, 60.0, rtol=0.02)
    assert not renderer.render(hidden, up, RADIANCE).channels[Channel.RADIANCE].any()


def test_shadow_touches_its_box_and_has_a_penumbra_of_similar_triangles(
    library: FakeLibrary,
) -> None:
    """A ball of light 4 m up beside a 1 m box: umbra, penumbra and full light where they belong."""
    radius_m = 0.3
    lamp = Light("lamp", "sphere", (-3.0, 0.0, 4.0), intensity_cd=9000.0, radius_m=radius_m)
    box = Body("box", "box", SE3((0.0, 0.0, 0.5)))
    scene = Scene("t", bodies=(Body("plane", "plane"), box), lights=(lamp,), environment=DARK)
    lens = Intrinsics(320, 240, 260.0, 260.0, 160.0, 120.0)
    camera = Camera("c", look_at((1.0, 0.0, 5.0), (1.0, 0.001, 0.0)), lens)

    reading = WarpRenderer(library, "cpu", PLAIN).render(scene, camera, RADIANCE)
    radiance = reading.channels[Channel.RADIANCE]

    # The top edge at x = 0.5, z = 1 is seen from the lamp's centre under a slope of 3.5 / 3.
    middle_m = 0.5 + 3.5 / 3.0
    spread_m = radius_m * math.hypot(3.5, 3.0) / 3.0 * (math.hypot(3.5, 3.0) / 3.0) / 3.0
    p = np.array(
        [[x, 0.0, 0.0] for x in (0.53, middle_m - 1.6 * spread_m, middle_m + 1.6 * spread_m)]
    )
    u, v = camera.intrinsics.project(camera.T_world_camera.inverse().apply(p)).astype(int).T
    at_box, umbra, lit = (float(radiance[b, a, 1]) for a, b in zip(u, v, strict=True))

    assert at_box < 0.2
    assert umbra < 0.2
    assert lit > 15.0
    middle = camera.T_world_camera.inverse().apply(np.array([[middle_m, 0.0, 0.0]]))
    a, b = camera.intrinsics.project(middle).astype(int)[0]
    penumbra = radiance[b - 2 : b + 3, a - 2 : a + 3, 1].mean()
    full = lit
    assert 0.25 < penumbra / full < 0.75


def test_flat_lit_plane_has_no_acne(renderer: WarpRenderer) -> None:
    """A plane alone has no shadows on itself, not even in grazing light."""
    direction = (math.cos(math.radians(8.0)), 0.0, -math.sin(math.radians(8.0)))
    sun = Light("sun", "sun", direction=direction, illuminance_lux=3000.0)
    scene = Scene("t", bodies=(Body("plane", "plane"),), lights=(sun,), environment=DARK)

    radiance = renderer.render(scene, DOWN, RADIANCE).channels[Channel.RADIANCE]

    np.testing.assert_allclose(radiance, 0.5 * 3000.0 * -direction[2] / math.pi, rtol=0.01)


def test_radiance_grows_with_the_light(library: FakeLibrary) -> None:
    """Ten times the light gives ten times the radiance, on edges too."""
    renderer = WarpRenderer(library, "cpu")
    bodies = (Body("plane", "plane"), Body("ball", "ball", SE3((0.2, 0.1, 0.5))))
    images = []
    for strength in (1.0, 10.0):
        lamp = Light("lamp", "sphere", (1.0, 1.0, 3.0), intensity_cd=400.0 * strength)
        around = Environment(luminance_cd_m2=20.0 * strength)
        scene = Scene("t", bodies=bodies, lights=(lamp,), environment=around)
        images.append(renderer.render(scene, DOWN, RADIANCE).channels[Channel.RADIANCE])

    np.testing.assert_allclose(images[1], 10.0 * images[0], rtol=1e-3)
    assert images[0].min() > 0.0


def test_antialiasing_changes_edges_only(library: FakeLibrary) -> None:
    """Pixels away from an edge are the same with and without; edge pixels are in between."""
    box = Body("box", "box", SE3.about_z(0.4, (0.0, 0.0, 0.5)))
    lamp = Light("lamp", "sphere", (0.5, -1.0, 4.0), intensity_cd=4000.0)
    scene = Scene("t", bodies=(box,), lights=(lamp,), environment=Environment(visible=False))
    images = []
    for samples in (1, 4):
        settings = RenderSettings(antialias=samples, ambient_occlusion_radius_m=0.0)
        renderer = WarpRenderer(library, "cpu", settings)
        images.append(renderer.render(scene, DOWN, RADIANCE).channels[Channel.RADIANCE])
    bright = images[0].max()
    changed = np.abs(images[0] - images[1]).max(axis=-1) > 0.01 * bright

    assert 0.005 < changed.mean() < 0.2
    partial = (images[1][..., 1] > 0.02 * bright) & (images[1][..., 1] < 0.98 * bright)
    assert partial.sum() > changed.sum() / 2


def test_picture_does_not_depend_on_what_was_rendered_before(library: FakeLibrary) -> None:
    renderer = WarpRenderer(library, "cpu")
    lamp = Light("lamp", "sphere", (1.0, 1.0, 3.0), intensity_cd=900.0)

    def scene_at(x: float) -> Scene:
        bodies = (Body("plane", "plane"), Body("ball", "ball", SE3((x, 0.0, 0.5)), instance_id=1))
        return Scene("t", bodies=bodies, lights=(lamp,))

    channels = frozenset({Channel.RADIANCE, Channel.Z_DEPTH, Channel.INSTANCE})
    first = renderer.render(scene_at(0.0), DOWN, channels).channels
    kept = {channel: image.copy() for channel, image in first.items()}
    for step in range(20):
        renderer.render(scene_at(0.05 * step), DOWN, channels)

    for again in (renderer, WarpRenderer(library, "cpu")):
        images = again.render(scene_at(0.0), DOWN, channels).channels
        for channel in channels:
            assert np.array_equal(images[channel], kept[channel]), channel


def test_returned_images_are_not_overwritten_by_the_next_render(library: FakeLibrary) -> None:
    """The arrays of a reading belong to the caller."""
    renderer = WarpRenderer(library, "cpu")
    channels = frozenset({Channel.RADIANCE, Channel.Z_DEPTH})
    scene = Scene("t", bodies=(Body("plane", "plane"),))
    reading = renderer.render(scene, DOWN, channels)
    kept = {channel: image.copy() for channel, image in reading.channels.items()}

    renderer.render(Scene("t", bodies=(Body("ball", "ball"),)), DOWN, channels)

    for channel in channels:
        assert np.array_equal(reading.channels[channel], kept[channel])


def test_empty_scene_in_the_dark_is_black(library: FakeLibrary) -> None:
    """No bodies, no lights, no environment: black, not NaN."""
    dark = Scene("t", environment=Environment(luminance_cd_m2=0.0))

    reading = WarpRenderer(library, "cpu").render(dark, DOWN, RADIANCE)

    assert not reading.channels[Channel.RADIANCE].any()
