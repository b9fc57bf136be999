"""Light that rooms reflect: against closed formulas, and against path-traced images."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gen_data.core.capture import Channel
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Body, Camera, Environment, IrradianceVolume, Light, Scene
from gen_data.core.se3 import SE3, Vec3, look_at
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.settings import RenderSettings
from gen_data.rooms.interreflection import Hole, LitRoom, find_interreflection
from gen_data.rooms.lit_rooms import find_lit_rooms
from tests.rooms.test_layouts import library, nominal


def grey(value: float) -> tuple[Vec3, ...]:
    return ((value, value, value),) * 6


def lamp(at_m: Vec3, lumen: float) -> Light:
    return Light("lamp", "sphere", at_m, intensity_cd=lumen / (4.0 * math.pi))


def light_of(volume: IrradianceVolume) -> np.ndarray:
    """Irradiance over pi, [probes, 6 axes, 3]."""
    return np.array(volume.light_cd_m2).reshape(-1, 6, 3)


@pytest.mark.parametrize("reflectance", [0.2, 0.5, 0.8])
def test_a_closed_room_keeps_its_energy(reflectance: float) -> None:
    """Sumpner 1892: the mean indirect illuminance is flux * r / (area * (1 - r))."""
    room = LitRoom((-2.0, -2.0, 0.0), (2.0, 2.0, 4.0), grey(reflectance))
    (volume,) = find_interreflection([room], [lamp((0.0, 0.0, 2.0), 1000.0)])
    expected_lux = 1000.0 * reflectance / (6 * 16.0 * (1.0 - reflectance))

    assert math.pi * light_of(volume).mean() == pytest.approx(expected_lux, rel=0.12)


def test_a_red_floor_colours_what_comes_from_below() -> None:
    """The share of red is larger in light from the floor than in light from the ceiling."""
    room = LitRoom((0.0, 0.0, 0.0), (4.0, 4.0, 2.5), (*grey(0.6)[:5], (0.6, 0.05, 0.05)))
    (volume,) = find_interreflection([room], [lamp((2.0, 2.0, 2.0), 1000.0)])
    red = light_of(volume)[..., 0] / light_of(volume).sum(axis=-1)

    assert red[:, 5].mean() > red[:, 4].mean() + 0.2


def test_before_a_window_wall_light_comes_from_the_room() -> None:
    """A panel at -X lights all sides but its own, which is darker than its opposite."""
    room = LitRoom((0.0, 0.0, 0.0), (6.0, 4.0, 2.5), grey(0.6))
    panel = Light(
        "window", "rectangle", (0.05, 2.0, 1.5), (1.0, 0.0, 0.0), intensity_cd=3000.0,
        size_m=(2.0, 1.5), side=(0.0, 1.0, 0.0),
    )  # fmt: skip
    (volume,) = find_interreflection([room], [panel])
    nearest = light_of(volume).reshape(*volume.counts, 6, 3)[0].mean(axis=(0, 1, 3))

    assert nearest[0] > 1.2 * nearest[1]


def two_rooms(openness: float) -> tuple[LitRoom, LitRoom]:
    """Rooms side by side along X, with a door between them."""
    west, east = (
        Hole(0, (3.0, 1.0, 0.0), (3.0, 1.9, 2.0), openness, (1, 0)),
        Hole(1, (3.2, 1.0, 0.0), (3.2, 1.9, 2.0), openness, (0, 0)),
    )
    return (
        LitRoom((0.0, 0.0, 0.0), (3.0, 3.0, 2.5), grey(0.6), (west,)),
        LitRoom((3.2, 0.0, 0.0), (6.2, 3.0, 2.5), grey(0.6), (east,)),
    )


def test_light_passes_open_doors_only() -> None:
    """A dark room next to a lit one is black behind a closed door, dim behind an open one."""
    bulb = [lamp((1.5, 1.5, 2.2), 1000.0)]
    closed, half, wide = (
        [light_of(v).mean() for v in find_interreflection(two_rooms(share), bulb)]
        for share in (0.0, 0.5, 1.0)
    )

    assert closed[1] == 0.0
    assert 0.0 < half[1] < wide[1] < 0.3 * wide[0]


def test_the_sun_brings_the_flux_that_passes_its_window() -> None:
    """A black room but for its floor: all of the floor's light is the window's flux once."""
    sides = (*grey(0.0)[:5], (0.5, 0.5, 0.5))
    window = Hole(1, (0.0, 1.0, 1.0), (0.0, 3.0, 2.2))
    room = LitRoom((0.0, 0.0, 0.0), (5.0, 4.0, 2.6), sides, (window,))
    c = math.cos(math.radians(50.0))
    sun = Light("sun", "sun", direction=(c, 0.0, -math.sqrt(1 - c * c)), illuminance_lux=20000.0)
    (volume,) = find_interreflection([room], [sun])
    # Far above a small patch of luminous flux F, the illuminance of a level face is F / (pi d^2).
    above = light_of(volume)[:, 5, 0].max() * math.pi
    flux = 0.5 * 20000.0 * c * 2.0 * 1.2

    assert 0.05 * flux < above < 1.0 * flux
    assert light_of(volume)[:, 4].max() == 0.0


def test_the_renderer_interpolates_between_probes() -> None:
    """A grey floor in a volume whose light from above rises evenly with x: no lamp, no sky."""
    values = np.zeros((4, 1, 1, 6, 3))
    centers = (np.arange(4) + 0.5) / 4 * 4.0 - 2.0
    values[:, 0, 0, 4] = (100.0 + 20.0 * centers)[:, None]
    box = IrradianceVolume((-2.0, -2.0, 0.0), (2.0, 2.0, 2.5), (4, 1, 1), tuple(values.ravel()))
    matte = replace(
        library().materials("floor")[0], texture="", base_color=(0.5, 0.5, 0.5), specular=0.0
    )
    floor = Body("floor", "floor?size_m=4,4", SE3(), materials=(matte,))
    eye = look_at((0.0, 0.0, 2.0), (0.0, 1e-6, 0.0))
    camera = Camera("c", eye, Intrinsics.from_hfov(32, 32, 1.2))
    sky = Environment(luminance_cd_m2=0.0, visible=False, volumes=(box,))
    scene = Scene("test", bodies=(floor,), environment=sky, cameras=(camera,))
    renderer = WarpRenderer(library(), "cpu", RenderSettings())
    read = renderer.render(scene, camera, frozenset({Channel.RADIANCE, Channel.Z_DEPTH}))
    radiance = read.channels[Channel.RADIANCE][16, :, 1]
    k = camera.intrinsics
    ways = np.stack([(np.arange(32) + 0.5 - k.cx_px) / k.fx_px, np.zeros(32), np.ones(32)], axis=1)
    x = eye.apply(2.0 * ways)[:, 0]

    # Burley's diffuse lobe and the rounding of the lattice leave a few percent.
    assert radiance == pytest.approx(0.5 * (100.0 + 20.0 * x), rel=0.04)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["living_room", "bathroom"])
def test_an_empty_room_agrees_with_paths(kind: str) -> None:
    """Means of the image and of its quarters, by 256 paths per pixel."""
    scene = nominal(kind)
    low, high = scene.interior_m
    middle = 0.5 * np.add(low, high)
    bulb = lamp((middle[0], middle[1], high[2] - 0.5), 1500.0)
    bodies = tuple(
        b for b in scene.bodies if b.name.rpartition("/")[2].partition("_")[0] != "window"
    )
    scene = replace(scene, bodies=bodies, lights=(bulb,))
    volumes = find_interreflection(find_lit_rooms(scene, "room", library()), scene.lights)
    eye = (high[0] - 0.4, high[1] - 0.4, 1.6)
    camera = Camera("c", look_at(eye, (low[0], low[1], 0.9)), Intrinsics.from_hfov(48, 36, 1.2))
    images = []
    for tier, ambience in (("realtime", volumes), ("pathtraced", ())):
        sky = Environment(luminance_cd_m2=0.0, visible=False, volumes=ambience)
        settings = RenderSettings(tier=tier, samples=256)
        renderer = WarpRenderer(library(), "cpu", settings)
        read = renderer.render(
            replace(scene, environment=sky), camera, frozenset({Channel.RADIANCE})
        )
        images.append(read.channels[Channel.RADIANCE].reshape(2, 18, 2, 24, 3).mean(axis=(1, 3, 4)))

    assert images[0] == pytest.approx(images[1], rel=0.12)
