"""Exposure, tone and anti-aliasing of colour images."""

from __future__ import annotations

import math

import numpy as np
import pytest

from generator.core.capture import Channel
from generator.core.geometry import Material
from generator.core.scene import Body, Camera, Environment, Light, Scene
from generator.core.se3 import SE3
from generator.renderers.exposure import automatic_ev100, exposure_of, filmic, tone_curve
from generator.renderers.occlusion import pixel_parts
from generator.renderers.settings import RenderSettings
from generator.renderers.warp import WarpRenderer
from tests.renderers.fake_library import (
    DARK,
    FakeLibrary,
    box_mesh,
    camera_at,
    forward_camera,
    plane_mesh,
    sphere_mesh,
)

GLOW = Material((0.0, 0.0, 0.0), 1.0, specular=0.0, emission_cd_m2=(100.0, 100.0, 100.0))
LIBRARY = FakeLibrary({"plane": plane_mesh(100.0), "box": box_mesh(), "ball": sphere_mesh(0.5)})


def rgb_of(scene: Scene, camera: Camera, settings: RenderSettings) -> np.ndarray:
    renderer = WarpRenderer(LIBRARY, "cpu", settings)
    return renderer.render(scene, camera, frozenset({Channel.RGB})).channels[Channel.RGB]


def glowing(pose: SE3, asset: str = "box", scale: float = 1.0, emission: float = 100.0) -> Body:
    material = Material((0.0, 0.0, 0.0), 1.0, specular=0.0, emission_cd_m2=(emission,) * 3)
    return Body("glow", asset, pose, scale, materials=(material,))


def test_the_saturation_luminance_is_white() -> None:
    """1.2 * 2^EV100 is 1 after exposure: 307.2 cd/m^2 at EV 8."""
    assert 307.2 * exposure_of(8.0) == pytest.approx(1.0)


@pytest.mark.parametrize(("emission", "byte"), [(307.2, 255), (307.2 * 0.21404, 127), (0.0, 0)])
def test_a_fixed_exposure_maps_luminance_to_srgb(emission: float, byte: int) -> None:
    """0.21404 linear is 0.5 in sRGB."""
    scene = Scene("t", (glowing(SE3((0.0, 0.0, 2.0)), emission=emission),), environment=DARK)
    camera = camera_at((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), ev100=8.0)

    rgb = rgb_of(scene, camera, RenderSettings(tone="srgb"))

    assert abs(int(rgb[24, 32, 0]) - byte) <= 1


def test_exposure_compensation_is_in_stops() -> None:
    """+1 stop shows half the luminance in the same tone."""
    camera = camera_at((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), ev100=8.0)
    bright = Scene("t", (glowing(SE3((0.0, 0.0, 2.0)), emission=100.0),), environment=DARK)
    dim = Scene("t", (glowing(SE3((0.0, 0.0, 2.0)), emission=50.0),), environment=DARK)

    plain = rgb_of(bright, camera, RenderSettings())
    pushed = rgb_of(dim, camera, RenderSettings(exposure_compensation_ev=1.0))

    np.testing.assert_array_equal(plain, pushed)


@pytest.mark.parametrize("luminance", [0.5, 40.0, 9000.0])
def test_automatic_exposure_puts_a_uniform_view_at_middle_grey(luminance: float) -> None:
    """Whatever the light, its log-average becomes 0.18 of white."""
    view = np.full((48, 64, 3), luminance, np.float32)

    exposed = luminance * exposure_of(automatic_ev100(view))

    assert exposed == pytest.approx(0.18, rel=0.002)


def test_automatic_exposure_of_darkness_is_finite() -> None:
    """A black view does not divide by zero: it is exposed as long as a camera can."""
    assert automatic_ev100(np.zeros((4, 4, 3), np.float32)) == 1.0


def test_the_filmic_curve_keeps_middle_grey_and_never_reaches_beyond_white() -> None:
    """Monotonic, near the identity in the mid-tones, with a shoulder that tells 1 from 4."""
    x = np.linspace(0.0, 8.0, 4000)
    y = filmic(x)

    assert (np.diff(y) >= 0.0).all()
    assert y[0] == 0.0
    assert abs(float(filmic(np.array(0.18))) - 0.18) < 0.02
    assert float(filmic(np.array(1.0))) < 0.9 < float(filmic(np.array(4.0))) <= 1.0


@pytest.mark.parametrize("value", [0.002, 0.01, 0.18, 0.5, 1.0])
def test_the_srgb_curve_is_that_of_the_standard(value: float) -> None:
    """IEC 61966-2-1: 12.92 v below 0.0031308, else 1.055 v^(1/2.4) - 0.055; white beyond 1."""
    curve = tone_curve("srgb")
    byte = int(curve[round(value / (1.0 + value) * (len(curve) - 1))])

    display = 12.92 * value if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055
    assert abs(byte - 255.0 * display) <= 1.0
    assert int(curve[len(curve) * 2 // 3]) == 255


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        # In the straight part, 0.22 to 0.532, the curve is the identity.
        (0.22, 0.22),
        (0.4, 0.4),
        (0.532, 0.532),
        # The shoulder: 1 - 0.468 exp(-(x - 0.532) / 0.468).
        (1.0, 1.0 - 0.468 * math.exp(-1.0)),
        (2.0, 1.0 - 0.468 * math.exp(-1.468 / 0.468)),
        # The toe half-way up, where it weighs half: (0.22 * 0.5^1.33 + 0.11) / 2.
        (0.11, 0.5 * (0.22 * 0.5**1.33 + 0.11)),
    ],
)
def test_the_filmic_curve_is_that_of_its_source(value: float, expected: float) -> None:
    """Uchimura 2017, worked by hand for his parameters."""
    assert float(filmic(np.array(value))) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(("lux", "ev100"), [(2.5, 0.0), (2500.0, 9.966), (80_000.0, 14.966)])
def test_exposure_values_are_those_of_a_light_meter(lux: float, ev100: float) -> None:
    """An incident-light meter, E = 2.5 lx 2^EV (ISO 2720, C = 250): grey is between grey and white.

    A card of 18 % under that light, exposed by the meter, is 0.12 of saturation: 0.18 * 2.5 / pi /
    1.2, which is where cameras put it, three stops below white.
    """
    grey_cd_m2 = 0.18 * lux / math.pi

    exposed = grey_cd_m2 * exposure_of(ev100)

    assert exposed == pytest.approx(0.18 * 2.5 / math.pi / 1.2, rel=1e-3)


def test_the_tone_curve_ends_at_black_and_white() -> None:
    """Indexed by v / (1 + v): the last entry stands for infinity."""
    for tone in ("filmic", "srgb"):
        curve = tone_curve(tone)
        assert (int(curve[0]), int(curve[-1])) == (0, 255)


def test_an_edge_is_as_grey_as_it_is_covered() -> None:
    """A white box over black, its edge a quarter into a pixel: that pixel is a quarter white."""
    left_m = (22.75 - 32.0) / 50.0 * 2.0
    scene = Scene("t", (glowing(SE3((left_m + 0.5, 0.0, 2.5)), emission=307.2),), environment=DARK)
    camera = forward_camera()
    camera = Camera("c", camera.T_world_camera, camera.intrinsics, ev100=8.0)

    smooth = rgb_of(scene, camera, RenderSettings(tone="srgb"))[24, 20:25, 0]
    rough = rgb_of(scene, camera, RenderSettings(tone="srgb", antialias=1))[24, 20:25, 0]

    assert rough.tolist() == [0, 0, 0, 255, 255]
    assert smooth[[0, 1, 3, 4]].tolist() == [0, 0, 255, 255]
    # One of four samples is white; bright samples weigh half, as after a tone curve.
    linear = 0.25 * 0.5 / (0.75 + 0.25 * 0.5)
    assert abs(int(smooth[2]) - 255 * (1.055 * linear ** (1 / 2.4) - 0.055)) <= 2


def test_anti_aliasing_does_not_touch_labels() -> None:
    """Ids and depth are those of pixel centres, with or without it."""
    scene = Scene("t", (Body("b", "ball", SE3((0.1, 0.0, 2.0)), instance_id=3),))
    wanted = frozenset({Channel.RGB, Channel.INSTANCE, Channel.Z_DEPTH})
    images = [
        WarpRenderer(LIBRARY, "cpu", RenderSettings(antialias=n))
        .render(scene, forward_camera(), wanted)
        .channels
        for n in (1, 8)
    ]

    for channel in (Channel.INSTANCE, Channel.Z_DEPTH):
        np.testing.assert_array_equal(images[0][channel], images[1][channel])
    assert (images[0][Channel.RGB] != images[1][Channel.RGB]).any()


@pytest.mark.parametrize("n", [2, 4, 8])
def test_parts_of_a_pixel_share_no_row_and_no_column(n: int) -> None:
    """So that nearly upright and nearly level edges get n + 1 shades."""
    parts = pixel_parts(n)

    for axis in range(2):
        assert sorted(parts[:, axis]) == [(k + 0.5) / n for k in range(n)]
    assert not np.allclose(parts[:, 0], parts[:, 1])


def test_nothing_shows_the_environment_or_black() -> None:
    """Pixels that see no body: the sky's image if it is visible."""
    camera = forward_camera()
    camera = Camera("c", camera.T_world_camera, camera.intrinsics, ev100=8.0)
    seen = Scene("t", environment=Environment(luminance_cd_m2=307.2))
    unseen = Scene("t", environment=Environment(luminance_cd_m2=307.2, visible=False))

    settings = RenderSettings(tone="srgb")

    assert (rgb_of(seen, camera, settings) == 255).all()
    assert not rgb_of(unseen, camera, settings).any()


def test_a_corner_is_darker_than_the_open_floor() -> None:
    """Ambient occlusion: at the foot of a wall half of the sky is hidden, far from it none."""
    matte = Material((0.5, 0.5, 0.5), 1.0, specular=0.0)
    bodies = (
        Body("floor", "plane", materials=(matte,)),
        Body("wall", "box", SE3((0.0, 1.0, 0.5)), materials=(matte,)),
    )
    scene = Scene("t", bodies, environment=Environment(luminance_cd_m2=300.0))
    camera = camera_at((0.0, 0.0, 3.0), (0.0, 0.01, 0.0), (24, 384), hfov_deg=1.6, ev100=8.0)

    shaded = rgb_of(scene, camera, RenderSettings(tone="srgb"))[:, 12, 1].astype(int)
    flat = RenderSettings(tone="srgb", ambient_occlusion_radius_m=0.0)
    plain = rgb_of(scene, camera, flat)[:, 12, 1].astype(int)

    # 286 px to the metre: the wall begins 143 px above the centre, row 192.
    foot = 192 - 143 + 4
    assert shaded[foot] < 0.9 * plain[foot]
    assert (shaded[192:] == plain[192:]).all()
    assert (np.diff(shaded[foot:192]) >= -1).all()


def test_a_lit_ball_has_no_noise() -> None:
    """Neighbouring pixels inside a matte ball under a large lamp differ by a few steps at most."""
    matte = Material((0.6, 0.6, 0.6), 1.0, specular=0.0)
    bodies = (
        Body("ball", "ball", SE3((0.0, 0.0, 0.5)), materials=(matte,)),
        Body("floor", "plane", materials=(matte,)),
    )
    lamp = Light("l", "sphere", (1.0, -1.0, 2.5), intensity_cd=600.0, radius_m=0.2)
    scene = Scene("t", bodies, lights=(lamp,), environment=Environment(luminance_cd_m2=20.0))
    camera = camera_at((0.0, -2.5, 1.5), (0.0, 0.0, 0.4), (160, 120), hfov_deg=40.0)
    settings = RenderSettings(antialias=1)
    renderer = WarpRenderer(LIBRARY, "cpu", settings)

    channels = renderer.render(scene, camera, frozenset({Channel.RGB, Channel.NORMALS})).channels

    grey = channels[Channel.RGB][..., 1].astype(int)
    normals = channels[Channel.NORMALS]
    alike = (normals[:, 1:] * normals[:, :-1]).sum(axis=-1) > math.cos(math.radians(8.0))
    steps = np.abs(np.diff(grey, axis=1))[alike]
    assert np.quantile(steps, 0.99) <= 12
