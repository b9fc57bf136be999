"""Light in photometric units, against closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from gen_data.core.asset_types import Float32, Material, MeshData, TextureData
from gen_data.core.capture import Channel
from gen_data.core.scene import Body, Camera, Environment, Light, Scene
from gen_data.core.se3 import SE3, Vec3
from gen_data.renderers.warp.device import open_device
from gen_data.renderers.warp.scene.brdf_albedo_lut import lobe_albedo
from gen_data.renderers.warp.scene.kernels.brdf import make_brdf, specular_lobe
from gen_data.renderers.warp.settings import RenderSettings
from tests.renderers.fake_library import (
    DARK,
    MATTE,
    FakeLibrary,
    box_mesh,
    camera_at,
    ground,
    plane_mesh,
    sphere_mesh,
)
from tests.renderers.images import OPEN, drawn, seen

WHITE = (1.0, 1.0, 1.0)


def from_above(size_px: tuple[int, int] = (48, 36)) -> Camera:
    return camera_at((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), size_px, hfov_deg=20.0)


@pytest.mark.parametrize("angle_deg", [60.0, 82.0])
def test_a_matte_plane_under_a_sun_has_luminance_e_rho_over_pi(angle_deg: float) -> None:
    """Lambert: 2000 lx at 60 degrees on an albedo of 0.5 is 159 cd/m^2; no acne when grazing."""
    s, c = math.sin(math.radians(angle_deg)), math.cos(math.radians(angle_deg))
    sun = Light("sun", "sun", direction=(s, 0.0, -c), illuminance_lux=2000.0)
    scene = Scene("t", (Body("p", "plane"),), lights=(sun,), environment=DARK)

    luminance = drawn(scene, from_above(), ground())

    np.testing.assert_allclose(luminance, 2000.0 * c * 0.5 / math.pi, rtol=0.012)


def test_a_lamp_falls_off_with_the_square_of_its_distance() -> None:
    """I cos / d^2: 800 cd at 2 m straight above is 200 lx below, less at the sides."""
    lamp = Light("lamp", "sphere", (0.0, 0.0, 2.0), intensity_cd=800.0, radius_m=0.02)
    scene = Scene("t", (Body("p", "plane"),), lights=(lamp,), environment=DARK)
    camera = camera_at((0.0, 0.0, 1.9), (0.0, 0.0, 0.0), (48, 36), hfov_deg=90.0)

    measured = drawn(scene, camera, ground())[..., 1]

    x = (np.arange(48) + 0.5 - 24.0) / 24.0 * 1.9
    y = (np.arange(36) + 0.5 - 18.0) / 24.0 * 1.9
    d2 = x[None] ** 2 + y[:, None] ** 2 + 4.0
    expected = 800.0 * 2.0 / d2**1.5 * 0.5 / math.pi
    assert np.abs(measured / expected - 1.0).max() < 0.03


def test_a_lamp_that_is_faint_everywhere_is_left_out() -> None:
    """A candle far below half a step of eight bits, next to a sun: not one bit of the image."""
    sun = Light("sun", "sun", direction=(0.6, 0.0, -0.8), illuminance_lux=50_000.0)
    candle = Light("candle", "sphere", (0.0, 0.0, 1.5), intensity_cd=1.0, radius_m=0.02)
    bodies = (Body("p", "plane"), Body("b", "box", SE3((0.1, 0.0, 0.2)), 0.3))
    alone, beside = (
        drawn(Scene("t", bodies, lights=lights, environment=DARK), from_above((96, 72)), ground())
        for lights in ((sun,), (candle, sun))
    )

    assert alone.max() > 0.0
    np.testing.assert_array_equal(beside, alone)


def test_a_spot_lights_its_cone_and_nothing_else() -> None:
    """Full within 0.8 of its half angle, dark beyond it."""
    spot = Light(
        "spot", "spot", (0.0, 0.0, 2.0), (0.0, 0.0, -1.0), intensity_cd=800.0, cone_rad=0.2
    )
    scene = Scene("t", (Body("p", "plane"),), lights=(spot,), environment=DARK)

    luminance = drawn(scene, from_above((192, 36)), ground())[18, :, 1]

    # 192 px over 2 * 3 * tan(10 degrees) = 1.058 m; the cone's edge is at 2 * tan(0.2) = 0.405 m.
    x_m = (np.arange(192) + 0.5 - 96.0) * (6.0 * math.tan(math.radians(10.0)) / 192.0)
    assert luminance[np.abs(x_m) > 0.42].max() < 0.5
    centre = luminance[np.abs(x_m) < 2.0 * math.tan(0.16) - 0.02]
    cosine = 2.0 / np.sqrt(x_m[np.abs(x_m) < 2.0 * math.tan(0.16) - 0.02] ** 2 + 4.0)
    np.testing.assert_allclose(centre, 200.0 * cosine**3 * 0.5 / math.pi, rtol=0.03)


@pytest.mark.parametrize(("material", "expected"), [
    *((Material(base_color=albedo, roughness=1.0, specular=0.0), albedo)
      for albedo in ((0.2, 0.5, 0.8), (0.9, 0.9, 0.9))),
    *((Material(WHITE, roughness, metallic=1.0), WHITE) for roughness in (0.1, 0.4, 0.7, 1.0)),
])  # fmt: skip
def test_balls_under_a_uniform_sky_show_their_albedo(material: Material, expected: Vec3) -> None:
    """At any orientation; with multiple scattering a white metal, however rough, vanishes."""
    library = FakeLibrary({"ball": sphere_mesh(0.5, 32, (material,))})
    scene = Scene("t", (Body("b", "ball"),), environment=Environment(luminance_cd_m2=200.0))
    camera = camera_at((2.0, 0.0, 0.5), (0.0, 0.0, 0.0), (48, 36), hfov_deg=20.0)

    share = drawn(scene, camera, library)[12:24, 16:32] / 200.0

    np.testing.assert_allclose(share, np.broadcast_to(expected, share.shape), rtol=0.012)


@wp.kernel(enable_backward=False)
def _lobe_albedo(  # noqa: ANN202
    table: wp.array(dtype=wp.vec2, ndim=2),
    roughness: float,
    specular: float,
    metallic: float,
    n_v: float,
    fitted: wp.array(dtype=float),
    summed: wp.array(dtype=float),
):
    """Directional albedo of the specular layer: by the table, and by summing over directions."""
    s = make_brdf(table, wp.vec3(1.0, 1.0, 1.0), roughness, metallic, specular, n_v)
    n = wp.vec3(0.0, 0.0, 1.0)
    v = wp.vec3(wp.sqrt(1.0 - n_v * n_v), 0.0, n_v)
    total = wp.float32(0.0)
    for i in range(400):
        # Equal steps in sin^2 of the polar angle weight by the cosine.
        sine2 = (float(i) + 0.5) / 400.0
        sine = wp.sqrt(sine2)
        cosine = wp.sqrt(1.0 - sine2)
        for j in range(400):
            a = (float(j) + 0.5) / 400.0 * 2.0 * wp.pi
            light = wp.vec3(sine * wp.cos(a), sine * wp.sin(a), cosine)
            total += specular_lobe(s, n, v, light, cosine, 0.0)[0]
    fitted[0] = s.gloss[0]
    summed[0] = total * wp.pi / 160000.0


@pytest.mark.parametrize("n_v", [0.3, 0.6, 0.95])
@pytest.mark.parametrize("roughness", [0.3, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("metallic", [0.0, 1.0])
def test_lamps_and_sky_see_one_reflectance(roughness: float, metallic: float, n_v: float) -> None:
    """The GGX lobe that lamps use sums to the albedo that the sky uses; white metal to 1."""
    open_device("cpu")
    fitted, summed = wp.zeros(1, device="cpu"), wp.zeros(1, device="cpu")

    table = wp.array(lobe_albedo(), dtype=wp.vec2, device="cpu")
    inputs = [table, roughness, 0.5, metallic, n_v]
    wp.launch(_lobe_albedo, 1, inputs, [fitted, summed], device="cpu")

    tolerance = 0.02 if metallic else 0.004
    assert abs(float(summed.numpy()[0]) - float(fitted.numpy()[0])) < tolerance
    if metallic:
        assert abs(float(fitted.numpy()[0]) - 1.0) < 1e-4


LAMP = Light("lamp", "sphere", (0.0, 0.0, 2.0), intensity_cd=800.0, radius_m=0.2)
OVERHEAD = Light("s", "sun", direction=(0.0, 0.0, -1.0), illuminance_lux=400.0,
                 angular_radius_rad=math.radians(3.0))  # fmt: skip


def shadow_profile(light: Light, settings: RenderSettings = OPEN) -> tuple[np.ndarray, np.ndarray]:
    """Luminance on the ground along x past the edge of a slab 0.52 m up.

    Relative to the luminance without the slab.
    """
    library = FakeLibrary({"plane": plane_mesh(20.0, (MATTE,)), "slab": box_mesh((0.6, 4.0, 0.02))})
    bodies = (Body("p", "plane"), Body("slab", "slab", SE3((0.0, 0.0, 0.51))))
    scene = Scene("t", bodies, lights=(light,), environment=DARK)
    camera = camera_at((0.4, 0.0, 8.0), (0.4, 0.0, 0.0), (320, 60), hfov_deg=7.0)
    luminance = drawn(scene, camera, library, settings)[30, :, 1]
    x = 0.4 + ((np.arange(320) + 0.5) / 320.0 - 0.5) * 16.0 * math.tan(math.radians(3.5))
    lux = 400.0 if light.kind == "sun" else 800.0 * 2.0 / (x**2 + 4.0) ** 1.5
    return x, luminance / (lux * 0.5 / math.pi)


def disc_beyond(s: np.ndarray) -> np.ndarray:
    """Share of a disc of radius 1 on one side of a line at -1 to 1."""
    s = np.clip(s, -1.0, 1.0)
    return np.asarray(1.0 - (np.arccos(s) - s * np.sqrt(1.0 - s * s)) / math.pi)


def test_the_penumbra_of_a_ball_has_the_width_of_similar_triangles() -> None:
    """Edge at x = 0.3 and z = 0.52, lamp of radius 0.2 at z = 2: half shadow at x = 0.405.

    The penumbra is 2 * 0.2 * 0.52 / 1.48 = 0.141 m wide; the part of a disc beyond a line gives
    its profile. Smoothing over 12 px = 0.037 m rounds its ends off.
    """
    x, visible = shadow_profile(LAMP)

    expected = disc_beyond((x - 0.3 * 2.0 / 1.48) / (0.2 * 0.52 / 1.48))
    on_ground = x > 0.33
    assert np.abs(visible - expected)[on_ground].max() < 0.05
    assert visible[on_ground & (x < 0.33 + 0.003)].max() < 0.03
    assert visible[x > 0.49].min() > 0.97


def test_the_penumbra_of_a_sun_has_the_width_of_its_disc() -> None:
    """Edge 0.52 m up, sun of radius 3 degrees overhead: 2 * 0.52 * tan(3 degrees) = 5.45 cm.

    The share of a disc beyond a line gives the profile; smoothing over 3.7 cm rounds its ends off.
    """
    x, visible = shadow_profile(OVERHEAD)

    expected = disc_beyond((x - 0.3) / (0.51 * math.tan(math.radians(3.0))))
    on_ground = x > 0.325
    assert np.abs(visible - expected)[on_ground].max() < 0.13
    assert abs((visible - expected)[on_ground].mean()) < 0.01
    assert visible[x > 0.36].min() > 0.98


def test_hard_shadows_have_no_penumbra() -> None:
    """The same lamp as a point: from dark to light within the smoothing window."""
    x, visible = shadow_profile(LAMP, OPEN.model_copy(update={"shadows": "hard"}))

    on_ground = x > 0.33
    assert visible[on_ground & (x < 0.38)].max() < 0.03
    assert visible[x > 0.43].min() > 0.97


def test_a_shadow_touches_what_throws_it() -> None:
    """A box on the ground, sun at 45 degrees: dark right behind the box, light right before it."""
    sun = Light("sun", "sun", direction=(0.7071068, 0.0, -0.7071068), illuminance_lux=2000.0)
    bodies = (Body("p", "plane"), Body("b", "box", SE3((0.0, 0.0, 0.1)), 0.2))
    scene = Scene("t", bodies, lights=(sun,), environment=DARK)
    camera = camera_at((0.0, -0.02, 4.0), (0.0, 0.0, 0.0), (320, 240), hfov_deg=12.0)

    channels = seen(scene, camera, ground(), Channel.RADIANCE, Channel.Z_DEPTH)

    p = camera.T_world_camera.apply(camera.intrinsics.unproject(channels[Channel.Z_DEPTH]))
    luminance = channels[Channel.RADIANCE][..., 1]
    floor = (p[..., 2] < 1e-3) & (np.abs(p[..., 1]) < 0.05)
    behind = floor & (p[..., 0] > 0.108) & (p[..., 0] < 0.22)
    before = floor & (p[..., 0] < -0.115)
    assert behind.any()
    assert luminance[behind].max() < 0.1 * luminance[before].min()


def checkers() -> TextureData:
    tiles = np.indices((64, 64)).sum(axis=0) % 2 * 255
    return TextureData(np.repeat(tiles[..., None], 3, axis=-1).astype(np.uint8))


def test_a_texture_seen_from_afar_is_its_mean() -> None:
    """Black and white texels far below a pixel's size are half as bright as white, not noise."""
    material = Material((1.0, 1.0, 1.0), 1.0, specular=0.0, texture="t", texture_scale_m=0.1)
    library = FakeLibrary({"plane": plane_mesh(40.0, (material,))}, {"t": checkers()})
    sun = Light("sun", "sun", direction=(0.0, 0.0, -1.0), illuminance_lux=400.0 * math.pi)
    scene = Scene("t", (Body("p", "plane"),), lights=(sun,), environment=DARK)

    luminance = drawn(scene, from_above(), library)

    np.testing.assert_allclose(luminance, 0.5 * 400.0, rtol=0.02)


def halves(size: int = 64) -> TextureData:
    image = np.zeros((size, size, 3), np.uint8)
    image[:, : size // 2] = (255, 0, 0)
    image[: size // 2, size // 2 :] = (0, 255, 0)
    image[size // 2 :, size // 2 :] = (0, 0, 255)
    return TextureData(image)


TEXTURED = Material(WHITE, 1.0, specular=0.0, texture="t")


def strongest_channel(mesh: MeshData) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """X and y on a plane of 2 m with ``halves``, and the number of the brightest colour there.

    Borders are left out.
    """
    library = FakeLibrary({"plane": mesh}, {"t": halves()})
    scene = Scene("t", (Body("p", "plane"),), environment=Environment(luminance_cd_m2=200.0))
    camera = camera_at((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), (64, 64), hfov_deg=28.0)
    channels = seen(scene, camera, library, Channel.RADIANCE, Channel.Z_DEPTH)
    p = camera.T_world_camera.apply(camera.intrinsics.unproject(channels[Channel.Z_DEPTH]))
    clear = np.isfinite(p).all(axis=-1) & (np.abs(p[..., :2]) > 0.1).all(axis=-1)
    clear &= (np.abs(p[..., :2]) < 0.9).all(axis=-1)
    return p[clear][:, 0], p[clear][:, 1], channels[Channel.RADIANCE].argmax(axis=-1)[clear]


def test_mesh_uvs_put_v_0_at_the_bottom_of_the_image() -> None:
    """Left half red, right half green above blue: u grows to the right, v upwards."""
    x, y, strongest = strongest_channel(plane_mesh(2.0, (TEXTURED,)))

    assert (strongest == np.where(x < 0, 0, np.where(y > 0, 1, 2))).all()


def test_uvs_along_a_line_show_the_texture_along_that_line() -> None:
    """A plane whose u is 3/4 everywhere, without an area in UV space, shows green above blue."""
    mesh = plane_mesh(2.0, (TEXTURED,))
    line = np.stack([np.full(4, 0.75), mesh.uvs[:, 1]], axis=-1, dtype=np.float32)
    _, y, strongest = strongest_channel(replace(mesh, uvs=line))

    assert (strongest == np.where(y > 0, 1, 2)).all()


def pointing_sky(direction: Vec3) -> Float32:
    """A sky that is bright within ten degrees of a direction."""
    height = 64
    polar = math.pi * (np.arange(height) + 0.5) / height
    # Column 0 is -X, the centre +X, columns grow clockwise seen from above (towards -Y).
    clockwise = 2.0 * math.pi * (np.arange(2 * height) + 0.5) / (2 * height)
    x = -np.sin(polar)[:, None] * np.cos(clockwise)[None]
    y = np.sin(polar)[:, None] * np.sin(clockwise)[None]
    z = np.broadcast_to(np.cos(polar)[:, None], x.shape)
    d = np.stack([x, y, z], axis=-1)
    bright = (d * np.asarray(direction)).sum(axis=-1) > math.cos(math.radians(10.0))
    return np.repeat(np.where(bright, 100.0, 0.1)[..., None], 3, axis=-1).astype(np.float32)


@pytest.mark.parametrize(("direction", "yaw_rad", "shown"), [
    ((1.0, 0.0, 0.0), 0.0, (1.0, 0.0, 0.0)),
    ((0.0, 1.0, 0.0), 0.0, (0.0, 1.0, 0.0)),
    ((0.0, 0.0, 1.0), 0.0, (0.0, 0.0, 1.0)),
    ((1.0, 0.0, 0.0), math.pi / 2, (0.0, 1.0, 0.0)),
])  # fmt: skip
@pytest.mark.parametrize("roughness", [0.05, 0.3])
def test_the_sky_is_seen_and_mirrored_where_it_is(
    direction: Vec3, yaw_rad: float, shown: Vec3, roughness: float
) -> None:
    """Its bright spot, rotated about Z, appears in the image and in a metal ball's reflection."""
    metal = Material((1.0, 1.0, 1.0), roughness, 1.0)
    library = FakeLibrary(
        {"ball": sphere_mesh(0.5, 64, (metal,))}, environments={"s": pointing_sky(direction)}
    )
    scene = Scene("t", (Body("b", "ball"),), environment=Environment("s", 20.0, yaw_rad))
    # A mirror that faces half-way between eye and spot shows it: here the eye is at 90 degrees.
    side = np.roll(shown, 1)
    eye = tuple(float(v) for v in 4.0 * side)
    camera = camera_at(eye, (0.0, 0.0, 0.0), (96, 96), hfov_deg=16.0)

    channels = seen(scene, camera, library, Channel.RADIANCE, Channel.NORMALS)

    brightness = channels[Channel.RADIANCE][..., 1].astype(float)
    normals = camera.T_world_camera.rotate(channels[Channel.NORMALS])
    on_ball = np.abs(normals).sum(axis=-1) > 0
    weights = np.where(on_ball & (brightness > 0.9 * brightness[on_ball].max()), 1.0, 0.0)
    mean = (normals * weights[..., None]).sum(axis=(0, 1)) / weights.sum()
    halfway = (np.asarray(shown) + side) / math.sqrt(2.0)
    assert mean @ halfway / np.linalg.norm(mean) > math.cos(math.radians(6.0))
