"""Shadows of panoramas: the brightest parts become lamps, and light is conserved."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gen_data.core import asset_types, se3
from gen_data.core.capture import Channel
from gen_data.core.scene import Body, Environment, Light, Region, Scene
from gen_data.renderers.warp.device import open_device
from gen_data.renderers.warp.scene import environment_maps
from gen_data.renderers.warp.settings import RenderSettings
from tests import embree, tiers
from tests.renderers import fake_library
from tests.renderers.images import SHARP, drawn, seen

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
OFF = SHARP.model_copy(update={"environment_shadow": "off"})
MEAN_CD_M2 = 500.0


def directions(height: int) -> tuple[np.ndarray, np.ndarray]:
    """Unit directions and solid angles of texels: zenith first, +X in the middle column."""
    polar = np.pi * (np.arange(height) + 0.5) / height
    turn = np.pi * (1.0 - (np.arange(2 * height) + 0.5) / height)
    level = np.sin(polar)[:, None]
    up = np.repeat(np.cos(polar)[:, None], 2 * height, axis=1)
    d = np.stack([level * np.cos(turn), level * np.sin(turn), up], axis=-1)
    solid = np.repeat(level * (np.pi / height) ** 2, 2 * height, axis=1)
    return d, solid


def panorama(*lights: tuple[se3.Vec3, float, float], height: int = 256) -> asset_types.Float32:
    """A grey sky, brighter above, with disks: direction, radius [rad], factor on the sky."""
    d, solid = directions(height)
    image = np.repeat(0.6 + 0.4 * d[..., 2:], 3, axis=2) * (0.9, 1.0, 1.2)
    for towards, radius_rad, luminance in lights:
        unit = np.asarray(towards) / np.linalg.norm(towards)
        inside = d @ unit > math.cos(radius_rad)
        image[inside] += luminance * np.array((1.2, 1.0, 0.7))
    mean = ((image @ LUMINANCE) * solid).sum() / (4.0 * np.pi)
    return (image / mean).astype(np.float32)


def irradiance(image: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Of surfaces with normals [n, 3] under a panorama, linear RGB [n, 3], by summing texels."""
    d, solid = directions(image.shape[0])
    cosine = np.maximum(normals @ d.reshape(-1, 3).T, 0.0)
    return np.asarray(cosine @ (solid[..., None] * image).reshape(-1, 3))


def disc_irradiance(lamp: environment_maps.SkyLamp, normals: np.ndarray) -> np.ndarray:
    """Irradiance of a uniform disk in the sky, by summation over 4000 points."""
    k = np.arange(4000) + 0.5
    cosine = 1.0 - (1.0 - math.cos(lamp.angular_radius_rad)) * k / 4000
    sine, turn = np.sqrt(1.0 - cosine**2), k * 2.399963
    z = np.asarray(lamp.towards)
    x = np.cross(z, (0.3, 0.8, 0.52))
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    d = cosine[:, None] * z + sine[:, None] * (
        np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * y
    )
    share = np.maximum(normals @ d.T, 0.0).mean(axis=1) / cosine.mean()
    return share[:, None] * np.asarray(lamp.power)


def every_normal() -> np.ndarray:
    d, _ = directions(12)
    return d.reshape(-1, 3)


SKIES = {
    "sun": (((0.6, 0.3, 0.7), 0.012, 20000.0),), "window": (((0.9, -0.2, 0.25), 0.3, 25.0),),
    "two soft boxes": (((0.5, 0.5, 0.6), 0.25, 40.0), ((-0.8, 0.1, 0.4), 0.15, 60.0)),
    "sun in its halo": (((0.7, -0.3, 0.5), 0.02, 6000.0), ((0.7, -0.3, 0.5), 0.25, 12.0)),
    "at the seam": (((-1.0, 0.01, 0.4), 0.1, 100.0),),
    "at the zenith": (((0.02, 0.01, 1.0), 0.12, 80.0),),
}  # fmt: skip


@pytest.mark.parametrize("sky", tiers.sampled(SKIES, 3))
def test_lamps_and_the_rest_give_the_irradiance_of_the_panorama(sky: str) -> None:
    """On surfaces of any orientation, to 1 % of the brightest one's irradiance."""
    image, normals = panorama(*SKIES[sky]), every_normal()

    rest, lamps = environment_maps.remove_peaks(image)

    whole = irradiance(image, normals)
    parts = irradiance(rest, normals) + sum(disc_irradiance(lamp, normals) for lamp in lamps)
    assert 1 <= len(lamps) <= 3
    assert np.abs(parts - whole).max() < 0.01 * whole.max()
    assert rest.min() >= 0.0
    assert rest.max() < 0.5 * image.max()


@pytest.mark.parametrize(("radius_rad", "luminance"), [(0.03, 3000.0), (0.1, 200.0), (0.3, 30.0)])
@pytest.mark.parametrize("towards", [(0.6, 0.3, 0.7), (-1.0, 0.0, 0.5), (0.1, 0.0, 1.0)])
def test_a_disc_in_the_sky_is_found_where_and_as_large_as_it_is(
    towards: se3.Vec3, radius_rad: float, luminance: float
) -> None:
    """To half a degree and a twelfth of its size; texels are 0.7 degrees wide."""
    _, lamps = environment_maps.remove_peaks(panorama((towards, radius_rad, luminance)))

    unit = np.asarray(towards) / np.linalg.norm(towards)
    assert len(lamps) == 1
    assert math.acos(min(float(unit @ lamps[0].towards), 1.0)) < 0.01
    assert lamps[0].angular_radius_rad == pytest.approx(radius_rad, rel=0.08, abs=0.003)
    red, green, blue = lamps[0].power
    assert (red / green, blue / green) == pytest.approx((1.2, 0.7), rel=0.03)


@pytest.mark.slow
def test_a_fine_panorama_is_lit_and_mirrored_like_a_coarse_one() -> None:
    """1200 rows: the reflected image and the lamps together have the panorama's light."""
    image = panorama(((0.6, 0.3, 0.7), 0.05, 900.0), height=1200)
    device = open_device("cpu")

    split = environment_maps.upload_split(image, environment_maps.upload_environment(image, device))

    (lamp,) = split.lamps
    normals = every_normal()[::25]
    whole = irradiance(image, normals)
    parts = irradiance(split.rest.numpy(), normals) + disc_irradiance(lamp, normals)
    assert split.rest.shape == (1200, 2400)
    assert np.abs(parts - whole).max() < 0.01 * whole.max()
    np.testing.assert_array_equal(split.image.numpy(), image)


def test_even_and_cloudy_skies_stay_as_they_are() -> None:
    """Nothing outstanding in the panorama: no lamp, and the same image."""
    for image in (panorama(), panorama(((0.5, 0.5, 0.6), 0.6, 3.0))):
        rest, lamps = environment_maps.remove_peaks(image)

        assert lamps == ()
        assert rest is image


def scene_under(
    environment: Environment, *bodies: Body, lights: tuple[Light, ...] = ()
) -> tuple[Scene, fake_library.FakeLibrary]:
    library = fake_library.FakeLibrary(
        {
            "plane": fake_library.plane_mesh(20.0, (fake_library.MATTE,)),
            "box": fake_library.box_mesh((1.0, 1.0, 1.0), (fake_library.MATTE,)),
            "ball": fake_library.sphere_mesh(0.5, 24, (fake_library.MATTE,)),
            "room": fake_library.room_mesh((6.0, 6.0, 3.0), (fake_library.MATTE,)),
        },
        environments={name: panorama(*lights, height=128) for name, lights in SKIES.items()},
    )
    focus = Region((0.0, 0.0, 0.2), (1.0, 1.0, 0.8))
    everything = (Body("p", "plane"), *bodies)
    return Scene("t", everything, lights=lights, environment=environment, focus=focus), library


def luminance_of(
    scene: Scene, library: fake_library.FakeLibrary, settings: RenderSettings = SHARP
) -> tuple[np.ndarray, np.ndarray]:
    """Luminance on the ground seen from above, linear RGB, and where that is."""
    camera = fake_library.camera_at((0.0, -0.01, 6.0), (0.0, 0.0, 0.0), (320, 240), hfov_deg=20.0)
    scene = replace(scene, cameras=(camera,))
    channels = seen(scene, camera, library, Channel.RADIANCE, Channel.Z_DEPTH, settings=settings)
    p = camera.T_world_camera.apply(camera.intrinsics.unproject(channels[Channel.Z_DEPTH]))
    return channels[Channel.RADIANCE][::8, ::8], p[::8, ::8]


@pytest.mark.parametrize("name", SKIES)
def test_open_ground_is_as_bright_with_shadows_as_without(name: str) -> None:
    """Without occlusion the sum is the panorama's irradiance, to 2 %, in every channel."""
    scene, library = scene_under(Environment(name, MEAN_CD_M2, yaw_rad=0.7))

    lit, _ = luminance_of(scene, library)

    up = irradiance(library.environment(name), np.array([[0.0, 0.0, 1.0]]))[0]
    expected = up * MEAN_CD_M2 * 0.5 / math.pi
    np.testing.assert_allclose(lit, np.broadcast_to(expected, lit.shape), rtol=0.02)


@pytest.mark.parametrize("name", ["sun", "window", "two soft boxes"])
@pytest.mark.parametrize("yaw_rad", [0.0, 2.0])
def test_a_block_throws_the_shadow_that_the_panorama_implies(name: str, yaw_rad: float) -> None:
    """Against Embree: visibility of every texel of the bright parts from every fourth pixel.

    The rest of the sky is taken as unshaded on both sides: it throws no shadow here.
    """
    block = Body("b", "box", se3.SE3.about_z(0.3, (0.0, 0.0, 0.15)), 0.3)
    scene, library = scene_under(Environment(name, MEAN_CD_M2, yaw_rad=yaw_rad), block)

    lit, p = luminance_of(scene, library)

    image = library.environment(name)
    d, solid = directions(image.shape[0])
    luminance = image @ LUMINANCE
    bright = luminance > 6.0 * np.median(luminance)
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    towards = d[bright] @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    weights = luminance[bright] * solid[bright] * np.maximum(towards[:, 2], 0.0)
    on_ground = (p[..., 2] < 1e-3).reshape(-1)
    ground = p.reshape(-1, 3)[on_ground]
    caster = embree.RayCaster(embree.placed(block, library))
    hidden = caster.is_blocked(ground[:, None], towards[None], near=1e-3)
    whole = irradiance(image, np.array([[0.0, 0.0, 1.0]]))[0] @ LUMINANCE
    expected = (whole - hidden @ weights) / whole
    measured = (lit.reshape(-1, 3)[on_ground] @ LUMINANCE) / (whole * MEAN_CD_M2 * 0.5 / math.pi)
    error = measured - expected
    shaded = expected < 0.9
    assert shaded.sum() > 20
    # Edges of shadows are smoothed over 15 pixels.
    assert np.abs(error[shaded]).mean() < 0.11
    assert np.abs(error[~shaded]).mean() < 0.03
    assert abs(error.mean()) < 0.01


def test_shadows_can_be_switched_off() -> None:
    """Then the whole panorama is light without shadows, as it is when other lamps outshine it."""
    block = Body("b", "ball", se3.SE3((0.0, 0.0, 0.6)), 0.4)
    scene, library = scene_under(Environment("sun", MEAN_CD_M2), block)

    with_shadow, p = luminance_of(scene, library)
    without, _ = luminance_of(scene, library, OFF)

    ground = p[..., 2] < 1e-3
    shaded, plain = with_shadow[ground][:, 1], without[ground][:, 1]
    assert plain.min() > 0.95 * plain.max()
    assert shaded.min() < 0.5 * shaded.max()


@pytest.mark.parametrize(
    "what", ["another sun", "walls all around", "lamps that drown it", "an even sky"]
)
def test_nothing_changes_where_no_shadow_would_be_seen(what: str) -> None:
    """The same bytes as without: light in a closed room does not come from the sky."""
    environment = Environment("sun", MEAN_CD_M2)
    block = Body("b", "box", se3.SE3((0.0, 0.0, 0.15)), 0.3)
    scene, library = scene_under(environment, block)
    if what == "another sun":
        sun = Light("s", "sun", direction=(0.6, 0.0, -0.8), illuminance_lux=1000.0)
        scene = replace(scene, lights=(sun,))
    elif what == "walls all around":
        scene = replace(scene, bodies=(*scene.bodies, Body("room", "room")))
    elif what == "lamps that drown it":
        lamp = Light("l", "sphere", (0.5, 0.0, 2.0), intensity_cd=4e5)
        scene = replace(scene, lights=(lamp,))
    else:
        scene = replace(scene, environment=replace(environment, image="environment/neutral?seed=0"))
    camera = fake_library.camera_at((1.5, -1.0, 1.2), (0.0, 0.0, 0.1), (64, 48), hfov_deg=50.0)
    scene = replace(scene, cameras=(camera,))
    with_shadows, without = (drawn(scene, camera, library, s) for s in (SHARP, OFF))

    np.testing.assert_array_equal(with_shadows, without)


TO_THE_SUN = fake_library.camera_at(
    (0.0, 0.0, 0.5), (6.0, 3.0, 7.0), (33, 25), hfov_deg=20.0, ev100=8.0
)


def test_the_sun_of_a_panorama_is_seen_where_it_is() -> None:
    """Background pixels show the image itself, with the sun in it."""
    scene, library = scene_under(Environment("sun", MEAN_CD_M2))
    scene = replace(scene, cameras=(TO_THE_SUN,))
    with_shadows, without = (drawn(scene, TO_THE_SUN, library, s) for s in (SHARP, OFF))

    np.testing.assert_array_equal(with_shadows, without)
    assert without.max() > 100.0 * np.median(without)


def test_the_sun_of_a_panorama_is_seen_through_a_pane() -> None:
    """Clear glass transmits 0.92 of it; the part that a lamp represents stays visible."""
    pane = asset_types.Material((1.0, 1.0, 1.0), 0.0, transmission=1.0)
    scene, library = scene_under(Environment("sun", MEAN_CD_M2))
    library.meshes["sheet"] = fake_library.plane_mesh(6.0, (pane,))
    behind = replace(scene, bodies=(*scene.bodies, Body("s", "sheet", se3.SE3((0.0, 0.0, 2.0)))))
    open_air, through = (drawn(one, TO_THE_SUN, library, SHARP) for one in (scene, behind))

    brightest = np.unravel_index(int(open_air[..., 1].argmax()), open_air.shape[:2])
    assert through[brightest][1] > 0.7 * open_air[brightest][1]


def test_a_large_low_sun_lights_walls_that_it_has_half_set_for() -> None:
    """A disc of 5 degrees in the horizon of a wall: L r^3 2 / 3 instead of none.

    By integrating its upper half: E = L * 2 / 3 r^3, with L = E_n / (pi r^2), for small r.
    """
    r = math.radians(5.0)
    sun = Light("s", "sun", direction=(-1.0, 0.0, 0.0), illuminance_lux=9e4, angular_radius_rad=r)
    dark = Environment(luminance_cd_m2=0.0, visible=False)
    scene, library = scene_under(dark, lights=(sun,))

    lit, _ = luminance_of(scene, library)

    expected = 9e4 * 2.0 * r / (3.0 * math.pi) * 0.5 / math.pi
    np.testing.assert_allclose(lit[..., 1], expected, rtol=0.03)
