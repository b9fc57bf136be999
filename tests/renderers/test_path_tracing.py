"""The path-traced tier against closed forms, furnaces, and itself by other techniques."""

import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy import integrate

from gen_data.core.asset_types import Material, TextureData
from gen_data.core.capture import Channel
from gen_data.core.scene import Body, Camera, Environment, Light, Scene, Weather
from gen_data.core.se3 import SE3
from gen_data.renderers.warp.renderer import WarpRenderer
from tests.renderers.fake_library import (
    DARK,
    MATTE,
    FakeLibrary,
    camera_at,
    ground,
    plane_mesh,
    room_mesh,
    sphere_mesh,
)
from tests.renderers.paths import ASKED, BOTH, MET, radiance_of, replicates_of, settings_of

pytestmark = pytest.mark.slow

FURNACE = Environment(luminance_cd_m2=100.0)
WHITE = (1.0, 1.0, 1.0)


def ball_in_furnace(**fields: object) -> np.ndarray:
    """Radiance of eight replicates over the face of a fine ball, every direction 100 cd/m^2."""
    material = Material(**{"base_color": WHITE, **fields})
    library = FakeLibrary({"ball": sphere_mesh(0.5, 192, (material,))})
    scene = Scene("furnace", (Body("ball", "ball"),), environment=FURNACE)
    camera = camera_at((0.0, -4.0, 0.0), (0.0, 0.0, 0.0), (16, 16), hfov_deg=9.0)
    return replicates_of(scene, camera, library, 64, 8, max_bounces=128)


@pytest.mark.parametrize("fields", [
    {"metallic": 1.0, "roughness": 0.0}, {"metallic": 1.0, "roughness": 0.3},
    {"metallic": 1.0, "roughness": 0.7}, {"metallic": 1.0, "roughness": 1.0}, {"roughness": 0.1},
    {"roughness": 0.6, "specular": 1.0}, {"roughness": 1.0, "specular": 0.0},
    {"roughness": 0.5, "coat": 1.0, "coat_roughness": 0.0},
    {"metallic": 1.0, "roughness": 0.4, "coat": 1.0, "coat_roughness": 0.5},
    {"transmission": 1.0, "thin": True, "roughness": 0.5},
    {"transmission": 1.0, "thin": False, "roughness": 0.0},
    {"transmission": 1.0, "thin": True, "roughness": 0.0},
    {"transmission": 0.6, "thin": True, "roughness": 0.05, "opacity": 0.5},
], ids=str)  # fmt: skip
def test_materials_without_absorption_are_invisible_in_a_uniform_environment(fields: dict) -> None:
    """White furnace: radiance 100 in, 100 out, to 0.1 %, the error of the table of lobes."""
    means = ball_in_furnace(**fields).mean(axis=(1, 2, 3))
    error = means.std(ddof=1) / math.sqrt(len(means))
    assert abs(means.mean() - 100.0) < 4.0 * error + 0.1


def test_rough_glass_loses_the_light_that_its_facets_hide_and_no_more() -> None:
    """Walter's model has no second scattering: never above one, and not far below."""
    image = ball_in_furnace(transmission=1.0, thin=False, roughness=0.4).mean(axis=0)

    assert image.mean() < 100.1
    assert image.mean() > 85.0


def test_a_grey_ball_under_an_even_sky_has_its_albedo() -> None:
    """A convex matte body receives no light from itself: radiance is albedo times 100."""
    images = ball_in_furnace(base_color=(0.5, 0.25, 0.1), roughness=1.0, specular=0.0)

    np.testing.assert_allclose(images.mean(axis=(0, 1, 2)), (50.0, 25.0, 10.0), rtol=2e-3)


def from_above(size_px: tuple[int, int] = (16, 12)) -> Camera:
    return camera_at((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), size_px, hfov_deg=2.0)


def lit_ground(light: Light, samples: int = 256) -> np.ndarray:
    """Radiance of the middle of a matte floor, albedo 0.5."""
    scene = Scene("t", (Body("p", "plane"),), lights=(light,), environment=DARK)
    return radiance_of(scene, from_above(), ground(), samples)


TILTED = Light(
    "panel",
    "rectangle",
    (0.9, 0.2, 1.1),
    (-0.6, 0.0, -0.8),
    side=(0.0, 1.0, 0.0),
    size_m=(1.0, 0.6),
    intensity_cd=600.0,
)


def lux_of_tilted() -> float:
    """Luminance 1000 over 1 m x 0.6 m, to one side: sum of cos cos / d^2."""
    centre, normal, side = (np.array(v) for v in (TILTED.position_m, TILTED.direction, TILTED.side))
    across = np.cross(normal, side)

    def flow(v_m: float, u_m: float) -> float:
        way = centre + u_m * side + v_m * across
        front = max(-float(way @ normal), 0.0)
        return 1000.0 * max(way[2], 0.0) * front / float(way @ way) ** 2

    return float(integrate.dblquad(flow, -0.5, 0.5, -0.3, 0.3, epsabs=1e-3)[0])


@pytest.mark.parametrize(("light", "lux", "tolerance"), [
    (Light("sun", "sun", direction=(0.75**0.5, 0.0, -0.5), illuminance_lux=2000.0), 1000.0, 1e-3),
    (Light("b", "sphere", (0.0, 0.0, 2.0), intensity_cd=800.0, radius_m=0.5), 200.0, 2e-3),
    (TILTED, lux_of_tilted(), 3e-3),
    (Light("d", "disk", (0.0, 0.0, 1.2), radius_m=0.7, intensity_cd=490.0 * math.pi),
     1000.0 * math.pi * 0.49 / (0.49 + 1.44), 3e-3),
], ids=["a sun at 60 degrees", "a ball as a point, I / d^2", "a rectangle by quadrature",
        "a disk by r^2 / (r^2 + h^2) (Howell's catalogue, B-13)"])  # fmt: skip
def test_lamps_give_the_illuminance_of_closed_forms(
    light: Light, lux: float, tolerance: float
) -> None:
    """Lambert, albedo 0.5: radiance is 0.5 lux / pi; without noise under a sun."""
    image = lit_ground(light, 512)

    expected = lux * 0.5 / math.pi
    np.testing.assert_allclose(image.mean(), expected, rtol=tolerance)
    assert light.kind != "sun" or np.allclose(image, expected, rtol=1e-3)


def test_a_spot_is_dark_outside_its_cone_and_fades_within() -> None:
    """On its axis a spot equals a sphere; beyond its half angle it is dark."""
    spot = Light(
        "spot", "spot", (0.0, 0.0, 2.0), intensity_cd=400.0, radius_m=0.01, cone_rad=0.3, even=0.5
    )
    scene = Scene("t", (Body("p", "plane"),), lights=(spot,), environment=DARK)
    camera = camera_at((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), (41, 41), hfov_deg=30.0)

    image = radiance_of(scene, camera, ground(), 64)[..., 0]

    x_m = (np.arange(41) + 0.5 - 20.5) / 20.5 * 4.0 * math.tan(math.radians(15.0))
    off_m = np.hypot(*np.meshgrid(x_m, x_m))
    assert image[20, 20] == pytest.approx(100.0 * 0.5 / math.pi, rel=2e-3)
    assert not image[off_m > 2.0 * math.tan(0.3) + 0.1].any()
    fading = (off_m > 2.0 * math.tan(0.2)) & (off_m < 2.0 * math.tan(0.26))
    assert (image[fading] < image[20, 20] * 0.9).all() and (image[fading] > 0.0).all()


SHEETS = {
    "a veil of opacity 0.25": (replace(MATTE, base_color=(0.0, 0.0, 0.0), opacity=0.25), 2.5, 0.75),
    # (1 - F)^2 / (1 - F^2), F = 0.04, times its tint.
    "a clear pane": (Material((0.9, 0.9, 0.9), 0.0, transmission=1.0, thin=True), 2.5,
                     0.96**2 * 0.9 / (1.0 - 0.04**2 * 0.81)),
    "a texture that is all hole, also to the eye": (replace(MATTE, texture="nothing"), 1.0, 1.0),
}  # fmt: skip


@pytest.mark.parametrize("name", SHEETS)
def test_a_sheet_passes_its_share_of_the_sun(name: str) -> None:
    """1000 lx straight down through it, on an albedo of 0.5."""
    sheet, height_m, passed = SHEETS[name]
    nothing = TextureData(np.full((4, 4, 3), 200, np.uint8), alpha=np.zeros((4, 4), np.uint8))
    meshes = {"plane": plane_mesh(4.0, (MATTE,)), "sheet": plane_mesh(4.0, (sheet,))}
    sun = Light("sun", "sun", direction=(0.0, 0.0, -1.0), illuminance_lux=1000.0)
    bodies = (Body("p", "plane"), Body("sheet", "sheet", SE3((0.0, 0.0, height_m))))
    scene = Scene("t", bodies, lights=(sun,), environment=DARK)
    camera = camera_at((0.0, 0.0, 2.0), (0.0, 0.0, 0.0), (8, 8), hfov_deg=2.0)
    bounces = 1 if sheet.transmission else 16

    image = radiance_of(scene, camera, FakeLibrary(meshes, {"nothing": nothing}), 64, bounces)

    np.testing.assert_allclose(image, 1000.0 * passed * 0.5 / math.pi, rtol=1e-3)


def test_a_panel_seen_in_a_mirror_has_its_luminance() -> None:
    """A perfect mirror shows a panel as bright as it is: 500 cd/m^2."""
    mirror = Material(base_color=WHITE, metallic=1.0, roughness=0.0)
    panel = Light("panel", "rectangle", (0.0, 1.5, 1.5), (0.0, -0.7071068, -0.7071068),
                  side=(1.0, 0.0, 0.0), size_m=(1.0, 1.0), intensity_cd=500.0)  # fmt: skip
    scene = Scene("t", (Body("p", "plane"),), lights=(panel,), environment=DARK)
    camera = camera_at((0.0, -1.5, 1.5), (0.0, 0.0, 0.0), (8, 8), hfov_deg=2.0)

    image = radiance_of(scene, camera, ground(mirror), 256)

    np.testing.assert_allclose(image.mean(), 500.0, rtol=2e-3)


def test_a_panel_that_a_body_shows_gives_its_light_once() -> None:
    """The body's emission is the lamp's own light: the floor is lit by the lamp alone."""
    glowing = replace(MATTE, base_color=(0.0, 0.0, 0.0), emission_cd_m2=(1000.0, 1000.0, 1000.0))
    library = FakeLibrary(
        {"plane": plane_mesh(20.0, (MATTE,)), "face": plane_mesh(1.0, (glowing,))}
    )
    lamp = Light(
        "lamp", "rectangle", (0.0, 0.0, 1.2), side=(1.0, 0.0, 0.0), size_m=(1.0, 1.0),
        intensity_cd=1000.0, body="face",
    )  # fmt: skip
    bodies = (Body("p", "plane"), Body("face", "face", SE3((0.0, 0.0, 1.202))))
    camera = camera_at((0.0, -1.0, 0.8), (0.0, 0.0, 0.0), (8, 8), hfov_deg=2.0)
    shown = Scene("t", bodies, lights=(lamp,), environment=DARK)
    alone = Scene("t", bodies[:1], lights=(lamp,), environment=DARK)

    floor, expected = (radiance_of(scene, camera, library, 256, 1) for scene in (shown, alone))

    np.testing.assert_allclose(floor.mean(), expected.mean(), rtol=0.01)


def test_emission_shines_in_the_picture_and_on_its_surroundings() -> None:
    """A closed room that emits 10 cd/m^2 and reflects half: 10 + 5 + 2.5 ... = 20."""
    glowing = replace(MATTE, emission_cd_m2=(10.0, 10.0, 10.0))
    library = FakeLibrary({"room": room_mesh(materials=(glowing,))})
    camera = camera_at((0.0, 0.0, 1.5), (1.0, 0.3, 1.2), (12, 12))
    scene = Scene("t", (Body("room", "room"),), environment=DARK)

    image = radiance_of(scene, camera, library, 256, max_bounces=64)

    np.testing.assert_allclose(image.mean(), 20.0, rtol=3e-3)


def mixed_scene() -> tuple[Scene, Camera, FakeLibrary]:
    """Two soft lamps and a sky with a bright patch over glossy and matte objects."""
    sky = np.ones((32, 64, 3), np.float32)
    sky[6:10, 10:18] = 12.0
    sky /= sky.mean()
    glossy = Material(base_color=(0.6, 0.3, 0.2), roughness=0.35, specular=0.8)
    library = FakeLibrary(
        {
            "plane": plane_mesh(4.0, (replace(MATTE, base_color=(0.4, 0.4, 0.4)),)),
            "ball": sphere_mesh(0.4, 24, (glossy,)),
            "steel": sphere_mesh(0.3, 24, (Material((0.7, 0.7, 0.7), 0.45, 1.0),)),
        },
        None,
        {"patch": sky},
    )
    lights = (
        Light("ball", "sphere", (0.8, -0.6, 1.2), intensity_cd=120.0, radius_m=0.35),
        Light("panel", "rectangle", (-0.9, 0.0, 1.3), (0.6, 0.0, -0.8), side=(0.0, 1.0, 0.0),
              size_m=(0.8, 0.8), intensity_cd=150.0),
    )  # fmt: skip
    bodies = (
        Body("p", "plane"), Body("ball", "ball", SE3((0.3, 0.2, 0.4))),
        Body("steel", "steel", SE3((-0.5, -0.1, 0.3))),
    )  # fmt: skip
    environment = Environment("patch", luminance_cd_m2=40.0)
    camera = camera_at((0.0, -2.2, 1.2), (0.0, 0.0, 0.2), (24, 18), hfov_deg=45.0)
    return Scene("mixed", bodies, lights=lights, environment=environment), camera, library


@pytest.mark.slow
@pytest.mark.parametrize("lights", [ASKED, MET], ids=["asked", "met"])
def test_either_technique_alone_agrees_with_both_together(lights: int) -> None:
    """Three estimators of one integral: z-test of the mean over the image, sixteen replicates."""
    scene, camera, library = mixed_scene()

    both = replicates_of(scene, camera, library, 64, 16, BOTH).mean(axis=(1, 2, 3))
    alone = replicates_of(scene, camera, library, 64, 16, lights).mean(axis=(1, 2, 3))

    error = math.sqrt((both.var(ddof=1) + alone.var(ddof=1)) / 16)
    assert error < 0.02 * both.mean()
    assert abs(both.mean() - alone.mean()) < 3.5 * error


def test_both_techniques_together_are_less_noisy_than_either() -> None:
    """Multiple importance sampling: the variance, averaged over the image."""
    scene, camera, library = mixed_scene()

    noise = {
        lights: replicates_of(scene, camera, library, 16, 8, lights).var(axis=0).mean()
        for lights in (BOTH, ASKED, MET)
    }

    assert noise[BOTH] < 0.8 * noise[MET]
    assert noise[BOTH] < 1.05 * noise[ASKED]


def test_error_falls_faster_than_that_of_independent_samples() -> None:
    """Sixteen times the samples: a quarter of the error by chance, a sixth by scrambled nets."""
    sun = Light("lamp", "sphere", (0.3, 0.0, 1.0), intensity_cd=100.0, radius_m=0.3)
    scene = Scene("t", (Body("p", "plane"),), lights=(sun,), environment=DARK)

    few, many = (
        replicates_of(scene, from_above(), ground(), n, 8).std(axis=0).mean() for n in (4, 64)
    )

    assert few / many > 6.0


def test_the_same_scene_gives_the_same_bytes() -> None:
    """Two renderers, one of which has rendered another scene before."""
    scene, camera, library = mixed_scene()
    channels = frozenset({Channel.RADIANCE, Channel.INSTANCE})
    first, second = (WarpRenderer(library, "cpu", settings_of(4)) for _ in range(2))
    second.render(replace(scene, lights=()), camera, channels)

    a, b = (renderer.render(scene, camera, channels) for renderer in (first, second))

    for channel in channels:
        assert a.channels[channel].tobytes() == b.channels[channel].tobytes()


def test_labels_do_not_depend_on_the_tier() -> None:
    """Labels come from the pixel-centre ray."""
    scene, camera, library = mixed_scene()
    channels = frozenset({Channel.RADIANCE, Channel.INSTANCE, Channel.Z_DEPTH, Channel.NORMALS})
    traced = WarpRenderer(library, "cpu", settings_of(1)).render(scene, camera, channels)
    drawn = WarpRenderer(library, "cpu").render(scene, camera, channels)

    for channel in channels - {Channel.RADIANCE}:
        assert traced.channels[channel].tobytes() == drawn.channels[channel].tobytes()
    assert (traced.channels[Channel.RADIANCE] != drawn.channels[Channel.RADIANCE]).any()


def test_both_tiers_agree_where_light_comes_straight_from_lamps() -> None:
    """A matte floor under one lamp: without indirect light, the same radiance to 1 %."""
    lamp = Light("lamp", "sphere", (0.5, 0.0, 2.0), intensity_cd=300.0, radius_m=0.1)
    scene = Scene("t", (Body("p", "plane"),), lights=(lamp,), environment=DARK)
    channels = frozenset({Channel.RADIANCE})
    drawn = WarpRenderer(ground(), "cpu").render(scene, from_above(), channels)

    traced = radiance_of(scene, from_above(), ground(), 64)

    np.testing.assert_allclose(traced, drawn.channels[Channel.RADIANCE], rtol=0.01)


def test_fog_dims_distant_surfaces() -> None:
    """Koschmieder: exp(-0.2 * 3) of a lit floor remains, plus the fog's own light."""
    sun = Light("sun", "sun", direction=(0.0, 0.0, -1.0), illuminance_lux=1000.0)
    weather = Weather(fog_extinction_per_m=0.2)
    scene = Scene("t", (Body("p", "plane"),), lights=(sun,), environment=DARK, weather=weather)
    clear = radiance_of(replace(scene, weather=Weather()), from_above(), ground(), 4)

    foggy = radiance_of(scene, from_above(), ground(), 4)

    left = math.exp(-0.2 * 3.0)
    assert (foggy > left * clear * 0.99).all()
    assert (foggy < left * clear + (1.0 - left) * 1000.0 / math.pi).all()


def test_snow_whitens_and_puddles_mirror() -> None:
    """Paths include water and snow on the ground."""
    dark = replace(MATTE, base_color=(0.1, 0.1, 0.1), roughness=0.9)
    scene = Scene("t", (Body("p", "plane"),), environment=FURNACE)
    dry = radiance_of(scene, from_above(), ground(dark), 32).mean()

    snowed = replace(scene, weather=Weather(snow_cover=1.0))
    soaked = replace(scene, weather=Weather(puddles=1.0, wetness=1.0))

    assert dry == pytest.approx(10.0, rel=0.02)
    assert radiance_of(snowed, from_above(), ground(dark), 32).mean() > 60.0
    # Darker below, and 2 % that water mirrors.
    assert 3.0 < radiance_of(soaked, from_above(), ground(dark), 32).mean() < 10.0


@pytest.mark.slow
def test_the_other_tier_never_loads_the_kernels_of_paths() -> None:
    """A cold start of the realtime tier takes as long as before."""
    code = (
        "import sys; from gen_data.renderers.warp.settings import RenderSettings;"
        "from gen_data.renderers.warp.renderer import WarpRenderer;"
        "from gen_data.core.capture import Channel; from tests.renderers import "
        "fake_library as f;"
        "from gen_data.core.scene import Scene;"
        "WarpRenderer(f.FakeLibrary({}), 'cpu').render("
        "Scene('t', ()), f.camera_at((0, 0, 1), (1, 0, 1), (8, 8)), frozenset({Channel.RADIANCE}));"
        "assert 'gen_data.renderers.warp.realtime.realtime_shading' in sys.modules;"
        "loaded = [name for name in sys.modules if '.path' in name and 'renderers' in name];"
        "assert not loaded, loaded"
    )

    finished = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)

    assert finished.returncode == 0, finished.stderr.decode()
