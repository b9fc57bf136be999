"""Coats, glass, mirrors and further maps, against closed forms and independent ray tracing."""

import math
from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from gen_data.core.asset_types import Material, TextureData
from gen_data.core.capture import Channel
from gen_data.core.interfaces import Tones
from gen_data.core.scene import Body, Camera, Environment, Light, Scene
from gen_data.core.se3 import SE3, Vec3
from gen_data.renderers.warp.device import open_device
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.scene.kernels import brdf
from gen_data.renderers.warp.settings import RenderSettings
from tests.renderers import images
from tests.renderers.fake_library import (
    DARK,
    MATTE,
    FakeLibrary,
    box_mesh,
    camera_at,
    forward_camera,
    plane_mesh,
    sphere_mesh,
)

RADIANCE = frozenset({Channel.RADIANCE})
GLASS = Material((1.0, 1.0, 1.0), 0.0, transmission=1.0, ior=1.5)
FURNACE = Environment(luminance_cd_m2=100.0)


def radiance_of(
    bodies: tuple[Body, ...],
    library: FakeLibrary,
    camera: Camera,
    lights: tuple[Light, ...] = (),
    environment: Environment = DARK,
) -> np.ndarray:
    scene = Scene("t", bodies, lights=lights, environment=environment)
    return images.drawn(scene, replace(camera, ev100=8.0), library, images.SHARP)


def glowing(luminance_cd_m2: float) -> Material:
    return Material((0, 0, 0), 1.0, specular=0.0, emission_cd_m2=(luminance_cd_m2,) * 3)


def fresnel_by_angles(incidence_rad: float, ior: float) -> float:
    """Fresnel reflectance as the mean of the sine and the tangent law (Fresnel 1823)."""
    if incidence_rad == 0.0:
        return ((ior - 1.0) / (ior + 1.0)) ** 2
    t = math.asin(math.sin(incidence_rad) / ior)
    s = math.sin(incidence_rad - t) / math.sin(incidence_rad + t)
    p = math.tan(incidence_rad - t) / math.tan(incidence_rad + t)
    return 0.5 * (s * s + p * p)


@wp.kernel
def _fresnel(cosines: wp.array(dtype=float), eta: float, f: wp.array(dtype=float)):  # noqa: ANN202
    i = wp.tid()
    f[i] = brdf.fresnel_dielectric(cosines[i], eta)


@wp.kernel
def _pane(f: wp.array(dtype=float), tint: float, rt: wp.array(dtype=wp.vec2)):  # noqa: ANN202
    i = wp.tid()
    color = wp.vec3(tint)
    rt[i] = wp.vec2(brdf.pane_reflectance(f[i], color)[0], brdf.pane_transmittance(f[i], color)[1])


def test_reflectance_of_glass_is_fresnels() -> None:
    """From 4 % at normal to 1 at grazing incidence; all beyond the critical angle from inside."""
    device = open_device("cpu")
    angles = np.radians([0.0, 10.0, 30.0, 45.0, 60.0, 75.0, 85.0, 89.0])
    cosines = wp.array(np.cos(angles), dtype=float, device=device)
    f = wp.zeros(8, dtype=float, device=device)

    wp.launch(_fresnel, 8, [cosines, 1.5], [f], device=device)
    expected = [fresnel_by_angles(float(a), 1.5) for a in angles]
    np.testing.assert_allclose(f.numpy(), expected, rtol=1e-4)

    wp.launch(_fresnel, 8, [cosines, 1.0 / 1.5], [f], device=device)
    critical = math.asin(1.0 / 1.5)
    assert (f.numpy()[angles > critical] == 1.0).all()
    assert (f.numpy()[angles < critical] < 0.2).all()


@pytest.mark.parametrize("tint", [1.0, 0.6])
def test_a_pane_sums_the_series_of_its_inner_reflections(tint: float) -> None:
    """The first 200 terms of the series; a clear pane keeps all energy."""
    device = open_device("cpu")
    faces = np.array([0.02, 0.04, 0.2, 0.5, 0.9])
    rt = wp.zeros(5, dtype=wp.vec2, device=device)
    given = wp.array(faces, dtype=float, device=device)
    wp.launch(_pane, 5, [given, tint], [rt], device=device)

    for f, (reflected, passed) in zip(faces, rt.numpy(), strict=True):
        ways = [(1 - f) ** 2 * tint * (f * tint) ** k for k in range(200)]
        assert passed == pytest.approx(sum(ways[0::2]), rel=1e-4)
        assert reflected == pytest.approx(f + sum(ways[1::2]), rel=1e-4)
        if tint == 1.0:
            assert reflected + passed == pytest.approx(1.0, rel=1e-4)


def ball_in_furnace(material: Material, rings: int) -> np.ndarray:
    """The middle of a ball, relative to the even light around it."""
    library = FakeLibrary({"ball": sphere_mesh(0.5, rings, (material,))})
    camera = camera_at((2.0, 0.0, 0.5), (0.0, 0.0, 0.0), (64, 48), hfov_deg=20.0)
    image = radiance_of((Body("b", "ball"),), library, camera, environment=FURNACE)
    return image[12:36, 20:44] / 100.0


@pytest.mark.parametrize(
    "base", [MATTE, Material((1, 1, 1), 1.0), Material((1, 1, 1), 0.4, 1.0), Material()]
)
@pytest.mark.parametrize("coat_roughness", [0.03, 0.3, 0.8])
def test_a_coated_ball_in_a_furnace_keeps_the_energy(base: Material, coat_roughness: float) -> None:
    """White stays white within 2 %, and no base exceeds the furnace."""
    inside = ball_in_furnace(replace(base, coat=1.0, coat_roughness=coat_roughness), 48)

    assert inside.max() <= 1.005
    if min(base.base_color) == 1.0:
        assert inside.min() >= 0.98
    elif base.roughness == 1.0:
        # (1 - share) 0.5 + share of the coat: 4 % head-on for a smooth one, more aside.
        assert 0.51 <= inside.min() < inside.max() < 0.75


@pytest.mark.parametrize("thin", [True, False])
def test_clear_glass_vanishes_in_a_furnace(thin: bool) -> None:
    """Reflection and transmission sum to 1 within 3 % for a pane and for a solid ball."""
    inside = ball_in_furnace(replace(GLASS, thin=thin), 64)

    assert inside.max() <= 1.03
    assert inside.mean() == pytest.approx(1.0, abs=0.04)


@pytest.mark.parametrize("angle_deg", [0.0, 50.0])
@pytest.mark.parametrize("tint", [1.0, 0.5])
def test_light_behind_a_pane_is_the_remainder_of_the_series(angle_deg: float, tint: float) -> None:
    """100 cd/m^2 behind a thin pane at normal and oblique incidence, in an otherwise dark room.

    The mesh is a single sheet; with F of one face T = (1 - F)^2 a / (1 - F^2 a^2).
    """
    pane = replace(GLASS, base_color=(tint,) * 3)
    library = FakeLibrary(
        {"wall": box_mesh((20, 20, 0.1), (glowing(100.0),)), "pane": plane_mesh(3.0, (pane,))}
    )
    half = 0.5 * math.radians(180.0 - angle_deg)
    turned = SE3((0, 0, 2.0), (math.cos(half), 0.0, math.sin(half), 0.0))
    bodies = (Body("wall", "wall", SE3((0, 0, 5.0))), Body("pane", "pane", turned))

    measured = radiance_of(bodies, library, forward_camera((31, 31), 400.0))[15, 15, 1]

    f = fresnel_by_angles(math.radians(angle_deg), 1.5)
    expected = 100.0 * (1 - f) ** 2 * tint / (1 - f * f * tint * tint)
    assert measured == pytest.approx(expected, rel=5e-3)


def snell(d: np.ndarray, n: np.ndarray, n1: float, n2: float) -> np.ndarray:
    """Refracted direction, by decomposition along and across the normal."""
    across = (d - n * (d @ n)) * (n1 / n2)
    return across - n * math.sqrt(1.0 - float(across @ across))


def test_an_edge_behind_a_slab_is_displaced_as_snell_says() -> None:
    """A slab of 0.2 m turned by 40 degrees before the border of light and dark, within 0.6 px.

    The ray through the border leaves the slab parallel to itself, shifted by
    t sin(a) (1 - cos(a) / sqrt(n^2 - sin^2(a))).
    """
    thickness, turn, distance = 0.2, math.radians(40.0), 3.0
    library = FakeLibrary({
        "slab": box_mesh((1.6, 1.6, thickness), (replace(GLASS, thin=False),)),
        "bright": box_mesh((4, 8, 0.01), (glowing(100.0),)),
    })  # fmt: skip
    pose = SE3((0, 0, 1.2), (math.cos(turn / 2), 0.0, math.sin(turn / 2), 0.0))
    bodies = (
        Body("slab", "slab", pose), Body("right", "bright", SE3((2.0, 0.0, distance + 0.005))),
    )  # fmt: skip
    focal_px = 600.0

    row = radiance_of(bodies, library, forward_camera((301, 5), focal_px))[2, :, 1]

    def lands_at(x_px: float) -> float:
        """X at the wall of the ray through a column, by the formula for the shift."""
        angle = math.atan(x_px / focal_px)
        # The slab's normal is turned about Y: incidence is the difference of the angles.
        a = abs(angle - turn)
        root = math.sqrt(1.5**2 - math.sin(a) ** 2)
        shift = thickness * math.sin(a) * (1.0 - math.cos(a) / root)
        # Bent towards the normal, the ray moves towards it by the shift, across its own way.
        return distance * math.tan(angle) + shift / math.cos(angle)

    columns = np.arange(301) + 0.5 - 150.5
    landed = np.array([lands_at(float(x)) for x in columns])
    expected_px = float(np.interp(0.0, landed, columns))
    measured_px = float(columns[np.argmax(row > 50.0)]) - 0.5
    assert abs(expected_px) > 5.0
    assert measured_px == pytest.approx(expected_px, abs=0.7)


def test_a_glass_ball_shows_the_world_upside_down_where_snell_says() -> None:
    """Rows at which the border between a bright and a dark half appears, within 1.5 px."""
    radius, middle, wall, border_m = 0.5, 2.0, 4.0, 0.15
    library = FakeLibrary({
        "ball": sphere_mesh(radius, 160, (replace(GLASS, thin=False),)),
        "bright": box_mesh((20, 10, 0.01), (glowing(100.0),)),
    })  # fmt: skip
    bodies = (
        Body("ball", "ball", SE3((0, 0, middle))),
        Body("low", "bright", SE3((0.0, 5.0 + border_m, wall + 0.005))),
    )
    focal_px = 400.0

    column = radiance_of(bodies, library, forward_camera((5, 161), focal_px))[:, 2, 1]

    def lands_at(y_px: float) -> float:
        """Y at the wall of the ray through a row, traced through a perfect ball."""
        centre = np.array([0.0, middle])
        d = np.array([y_px / focal_px, 1.0])
        d /= math.hypot(*d)
        p = d * (d @ centre - math.sqrt((d @ centre) ** 2 - centre @ centre + radius**2))
        d = snell(d, (p - centre) / radius, 1.0, 1.5)
        p = p + d * (-2.0 * float(d @ (p - centre)))
        d = snell(d, (centre - p) / radius, 1.5, 1.0)
        return float(p[0] + d[0] * (wall - p[1]) / d[1])

    rows = np.arange(161) + 0.5 - 80.5
    near_axis = np.abs(rows) < 60
    landed = np.array([lands_at(float(y)) for y in rows[near_axis]])
    # Upside down: rows that look down see the dark half above the border.
    expected_px = float(np.interp(-border_m, -landed, rows[near_axis]))
    bright = column[near_axis] > 50.0
    assert bright[:5].all() and not bright[-5:].any()
    measured_px = float(rows[near_axis][np.argmin(bright)]) - 0.5
    assert expected_px < -3.0
    assert measured_px == pytest.approx(expected_px, abs=1.5)


def test_a_mirror_shows_the_mirrored_scene() -> None:
    """A box before a perfect mirror equals the same box behind a window: all but 1 % of pixels.

    The sun shines along the mirror: both boxes are lit alike.
    """
    mirror = Material((1, 1, 1), 0.0, 1.0)
    meshes = {"box": box_mesh((0.4, 0.6, 0.3), (MATTE,)), "mirror": plane_mesh(8.0, (mirror,))}
    library = FakeLibrary(meshes)
    q = math.sqrt(0.5)
    wall = Body("wall", "mirror", SE3((0, 0, 0), (q, 0.0, q, 0.0)))
    c, s = math.cos(0.2), math.sin(0.2)
    sun = Light("sun", "sun", direction=(0.0, 0.6, -0.8), illuminance_lux=3000.0)
    camera = camera_at((1.6, -2.5, 0.5), (-1.0, 0.0, 0.0), (120, 90), 30.0)
    box = Body("box", "box", SE3((1.0, 0.0, 0.0), (c, 0.0, 0.0, s)))
    image = Body("box", "box", SE3((-1.0, 0.0, 0.0), (c, 0.0, 0.0, -s)))

    mirrored = radiance_of((wall, box), library, camera, (sun,))
    behind = radiance_of((image,), library, camera, (sun,))

    assert (behind[..., 1] > 50.0).sum() > 500
    assert (np.abs(mirrored - behind).max(axis=-1) > 0.02 * behind.max()).mean() < 0.01


def test_an_edge_in_a_mirror_is_the_mean_of_tones_of_a_camera_with_many_photosites() -> None:
    """Two of three samples see a ceiling of 2000 cd/m^2, one the half of 50; no row differs."""
    mirror = Material((1, 1, 1), 0.0, 1.0)
    meshes = {
        "mirror": plane_mesh(8.0, (mirror,)),
        "bright": box_mesh((20.0, 40.0, 0.1), (glowing(2000.0),)),
        "dim": box_mesh((20.0, 40.0, 0.1), (glowing(50.0),)),
    }
    # From 3 m above the mirror the ceiling is 13 m away.
    pixel_m = 13.0 * 2.0 * math.tan(math.radians(10.0)) / 64
    edge_m = 0.35 * pixel_m
    bodies = (
        Body("mirror", "mirror"), Body("bright", "bright", SE3((10.0 + edge_m, 0.0, 10.05))),
        Body("dim", "dim", SE3((-10.0 + edge_m, 0.0, 10.05))),
    )  # fmt: skip
    white, brightest = 100.0, 1000.0
    renderer = WarpRenderer(FakeLibrary(meshes), "cpu", RenderSettings(antialias=8))
    scene = Scene("t", bodies, environment=DARK)

    reading = renderer.render(scene, FROM_ABOVE, RADIANCE, lambda _: Tones(white, brightest))

    seen = reading.channels[Channel.RADIANCE][..., 1]
    between = seen[:, np.flatnonzero((seen[24] > 60.0) & (seen[24] < 1900.0))]
    log_mean = (2.0 * math.log(brightest + 0.05 * white) + math.log(50.0 + 0.05 * white)) / 3.0
    assert between.shape == (48, 1)
    assert between.ravel() == pytest.approx(np.full(48, math.exp(log_mean) - 5.0), rel=0.03)


def test_mirrored_textures_are_as_far_as_the_whole_way() -> None:
    """A fine, distant checker in a mirror becomes its mean: mip levels follow the whole path."""
    y, x = np.mgrid[:256, :256]
    tile = np.where(((x // 2 + y // 2) % 2)[..., None], 255, 0) * np.ones(3)
    checker = Material((1, 1, 1), 1.0, specular=0.0, texture="checker", texture_scale_m=0.5)
    meshes = {
        "wall": box_mesh((60, 60, 0.1), (checker,)),
        "mirror": plane_mesh(1.0, (Material((1, 1, 1), 0.0, 1.0),)),
    }
    library = FakeLibrary(meshes, {"checker": TextureData(tile.astype(np.uint8))})
    bodies = (
        Body("mirror", "mirror", SE3((0, 0, 1.0), (0.0, 1.0, 0.0, 0.0))),
        Body("wall", "wall", SE3((0, 0, -30.0))),
    )

    seen = radiance_of(bodies, library, forward_camera((32, 32), 60.0), environment=FURNACE)

    assert seen.std() < 0.03 * seen.mean()
    assert seen.mean() == pytest.approx(50.0, rel=0.05)


def halves(left: int, right: int, channels: int) -> np.ndarray:
    """Two bytes, side by side, each over half of 64 x 64 texels."""
    image = np.where(np.arange(64) < 32, left, right).astype(np.uint8)
    grid = np.broadcast_to(image, (64, 64))
    return np.ascontiguousarray(np.stack([grid] * channels, axis=-1) if channels > 1 else grid)


def mapped(texture: TextureData, material: Material) -> tuple[tuple[Body, ...], FakeLibrary]:
    sheet = plane_mesh(2.0, (replace(material, texture="map"),))
    return (Body("sheet", "sheet"),), FakeLibrary({"sheet": sheet}, {"map": texture})


FROM_ABOVE = camera_at((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), (64, 48), hfov_deg=20.0)
WHITE = np.full((64, 64, 3), 255, np.uint8)


def of_halves(image: np.ndarray) -> list[float]:
    """Green at the centres of an image's left and right half; sorted by the mesh's u."""
    return sorted(float(image[20:28, at, 1].mean()) for at in (slice(8, 20), slice(44, 56)))


def test_emission_maps_scale_the_emitted_luminance() -> None:
    """200 cd/m^2 times sRGB 255 and 128: 200 and 43.2 (IEC 61966-2-1)."""
    texture = TextureData(WHITE, emission=halves(255, 128, 3))

    dim, bright = of_halves(radiance_of(*mapped(texture, glowing(200.0)), FROM_ABOVE))

    assert bright == pytest.approx(200.0, rel=0.005)
    assert dim == pytest.approx(200.0 * ((128 / 255 + 0.055) / 1.055) ** 2.4, rel=0.02)


def test_occlusion_maps_darken_ambient_light_only() -> None:
    """An even sky of 100 cd/m^2 on an albedo of 0.5: 50 and 50 * 128 / 255; the sun stays."""
    bodies, library = mapped(TextureData(WHITE, occlusion=halves(255, 128, 1)), MATTE)

    dim, bright = of_halves(radiance_of(bodies, library, FROM_ABOVE, environment=FURNACE))
    assert bright == pytest.approx(50.0, rel=0.01)
    assert dim == pytest.approx(50.0 * 128 / 255, rel=0.01)

    sun = Light("sun", "sun", direction=(0.0, 0.0, -1.0), illuminance_lux=1000.0)
    lit = of_halves(radiance_of(bodies, library, FROM_ABOVE, (sun,)))
    np.testing.assert_allclose(lit, 1000.0 * 0.5 / math.pi, rtol=0.01)


def test_metallic_maps_take_the_diffuse_light_of_metals() -> None:
    """Far from its highlight, bare metal is dark where the dielectric is E rho / pi."""
    texture = TextureData(WHITE, metallic=halves(255, 0, 1))
    material = Material((0.5, 0.5, 0.5), 0.2, 1.0, specular=0.0)
    s = math.sin(math.radians(60.0))
    sun = Light("sun", "sun", direction=(0.0, s, -0.5), illuminance_lux=2000.0)

    metal, chalk = of_halves(radiance_of(*mapped(texture, material), FROM_ABOVE, (sun,)))

    assert chalk == pytest.approx(2000.0 * 0.5 * 0.5 / math.pi, rel=0.02)
    assert metal < 0.05 * chalk


def test_opacity_mixes_with_what_is_behind() -> None:
    """0.3 of 200 cd/m^2 over 0.7 of 100 cd/m^2 is 130; labels treat the veil as solid."""
    veil = replace(glowing(200.0), opacity=0.3)
    library = FakeLibrary(
        {"veil": plane_mesh(1.0, (veil,)), "wall": plane_mesh(9.0, (glowing(100.0),))}
    )
    bodies = (Body("veil", "veil", SE3((0, 0, 1.0)), instance_id=1), Body("wall", "wall"))
    scene = Scene("t", bodies, environment=DARK)
    camera = camera_at((0, 0, 3.0), (0, 0, 0), (33, 33), 20.0, ev100=8.0)
    wanted = (Channel.RADIANCE, Channel.INSTANCE, Channel.Z_DEPTH)

    channels = images.seen(scene, camera, library, *wanted, settings=images.SHARP)

    np.testing.assert_allclose(channels[Channel.RADIANCE][16, 16], 130.0, rtol=1e-3)
    assert channels[Channel.INSTANCE][16, 16] == 1
    assert channels[Channel.Z_DEPTH][16, 16] == pytest.approx(2.0, rel=1e-5)


@pytest.mark.parametrize("material", [GLASS, replace(MATTE, opacity=0.2)])
def test_clear_bodies_throw_no_shadow(material: Material) -> None:
    """The sun's light below a clear plate equals the light next to it."""
    library = FakeLibrary(
        {"floor": plane_mesh(9.0, (MATTE,)), "plate": box_mesh((1, 1, 0.1), (material,))}
    )
    sun = Light("sun", "sun", direction=(0.5, 0.0, -0.866), illuminance_lux=1000.0)
    camera = camera_at((0.0, 0.0, 3.0), (0.58, 0.0, 0.0), (48, 36), 30.0)
    floor = Body("floor", "floor")
    above = Body("plate", "plate", SE3((-1.0, 0.0, 1.0)))

    bare = radiance_of((floor,), library, camera, (sun,))
    covered = radiance_of((floor, above), library, camera, (sun,))

    np.testing.assert_allclose(covered[:, 30:], bare[:, 30:], rtol=1e-4)


def test_glass_out_of_sight_changes_no_byte() -> None:
    """A glass ball and a mirror behind the camera leave every byte of the image unchanged."""
    plain = Material((0.3, 0.5, 0.2), 0.2, texture="map")
    texture = TextureData(halves(90, 200, 3))
    meshes = {
        "floor": plane_mesh(6.0, (plain,)), "box": box_mesh((0.5, 0.5, 0.5)),
        "ball": sphere_mesh(0.3, 16, (replace(GLASS, thin=False, coat=1.0),)),
    }  # fmt: skip
    library = FakeLibrary(meshes, {"map": texture})
    sun = Light("sun", "sun", direction=(0.5, 0.2, -0.8), illuminance_lux=5000.0)
    bodies = (Body("floor", "floor"), Body("box", "box", SE3((0, 0, 0.25))))
    behind = Body("ball", "ball", SE3((20.0, -20.0, 8.0)))
    camera = camera_at((1.5, -2.0, 1.2), (0, 0, 0), (80, 60), 50.0)

    without = radiance_of(bodies, library, camera, (sun,), FURNACE)
    beside = radiance_of((*bodies, behind), library, camera, (sun,), FURNACE)

    np.testing.assert_array_equal(without, beside)


@pytest.mark.parametrize("color", [(0.5, 0.02, 0.02), (0.02, 0.02, 0.3)])
def test_a_coat_mirrors_what_is_around(color: Vec3) -> None:
    """A glowing wall at grazing incidence: Fresnel reflection over the base."""
    base = Material(color, 0.6, specular=0.0, coat=1.0, coat_roughness=0.0)
    library = FakeLibrary(
        {"floor": plane_mesh(6.0, (base,)), "wall": box_mesh((8, 0.1, 8), (glowing(1000.0),))}
    )
    bodies = (Body("floor", "floor"), Body("wall", "wall", SE3((0, 3.0, 0.0))))
    angle = math.radians(60.0)
    eye = (0.0, -2.0 * math.sin(angle), 2.0 * math.cos(angle))
    seen = radiance_of(bodies, library, camera_at(eye, (0, 0, 0), (15, 15), 2.0))[7, 7]

    schlick = 0.04 + 0.96 * (1.0 - math.cos(angle)) ** 5
    np.testing.assert_allclose(seen, 1000.0 * schlick, rtol=0.03)
