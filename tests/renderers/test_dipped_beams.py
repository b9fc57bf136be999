"""Dipped beams against the test points of UN Regulation No. 112."""

import math

import numpy as np
import pytest

from gen_data.core.scene import Body, Light, Scene
from gen_data.core.se3 import SE3
from gen_data.randomizers.vehicle_lights import dipped_beam
from gen_data.renderers.warp.realtime.light_selection import dipped_share, main_lamps
from gen_data.renderers.warp.scene.kernels import records
from tests.renderers.fake_library import DARK, MATTE, FakeLibrary, box_mesh, camera_at
from tests.renderers.images import drawn

BEAMS_CD = (9000.0, 11_500.0, 14_000.0)
SCREEN_M = 25.0
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
POINTS = {
    # Name: degrees up, degrees to the right, least and most [lx] on the screen.
    "B50L": (0.57, -3.43, 0.0, 0.4),
    "75R": (-0.57, 1.15, 12.0, math.inf),
    "75L": (-0.57, -3.43, 0.0, 12.0),
    "50L": (-0.86, -3.43, 0.0, 21.1),
    "50R": (-0.86, 1.72, 12.0, math.inf),
    "50V": (-0.86, 0.0, 6.0, math.inf),
    "25L": (-1.72, -9.0, 2.0, math.inf),
    "25R": (-1.72, 9.0, 2.0, math.inf),
    "BR": (1.0, 2.5, 0.0, 2.8),
    "zone III": (2.0, 0.0, 0.1, 0.7),
}
"""UN R112, class B, right-hand traffic; 50L and BR in its later form, in candela / 625 m^2."""


def headlight(beam_cd: float, T_world_lens: SE3 | None = None) -> Light:
    return dipped_beam("beam", T_world_lens or SE3(), beam_cd)


def lamp_records(lights: list[Light]) -> np.ndarray:
    values = np.zeros(len(lights), dtype=records.LightRecord.numpy_dtype())
    for value, light in zip(values, lights, strict=True):
        value["kind"], value["cutoff"] = 1, light.cutoff
        value["position_m"], value["direction"] = light.position_m, light.direction
        value["power"] = np.array(light.color) * light.intensity_cd
        value["cos_outer"] = math.cos(light.cone_rad)
        value["cos_inner"] = math.cos(light.even * light.cone_rad)
    return values


def directions(up_deg: float, right_deg: float) -> np.ndarray:
    up, right = math.tan(math.radians(up_deg)), math.tan(math.radians(right_deg))
    d = np.array([1.0, -right, up])
    return d / np.linalg.norm(d)


@pytest.mark.parametrize("beam_cd", BEAMS_CD)
@pytest.mark.parametrize("point", POINTS)
def test_beams_meet_the_points_of_the_regulation(point: str, beam_cd: float) -> None:
    """Illuminance on a screen at 25 m, as computed when lamps are ranked."""
    up, right, least, most = POINTS[point]
    (lamp,) = lamp_records([headlight(beam_cd)])
    d = directions(up, right)
    share = dipped_share(lamp, [np.array([part]) for part in d])[0]

    assert least <= share * beam_cd / SCREEN_M**2 <= most


@pytest.mark.parametrize("point", POINTS)
def test_pictures_of_a_screen_show_what_the_regulation_asks(point: str) -> None:
    """A wall at 25 m, albedo 0.5: luminance = lx * 0.5 / pi, within the regulation's bounds."""
    beam_cd = 11_500.0
    up, right, least, most = POINTS[point]
    d = directions(up, right)
    p = d * (SCREEN_M / d[0])
    library = FakeLibrary({"wall": box_mesh((1.0, 1.0, 1.0), (MATTE,))})
    wall = Body("wall", "wall", SE3((SCREEN_M + 50.0, 0.0, 0.0)), scale=100.0)
    scene = Scene("t", (wall,), lights=(headlight(beam_cd),), environment=DARK)
    camera = camera_at((SCREEN_M - 2.0, p[1], p[2]), tuple(p), (9, 9), hfov_deg=0.2)

    lux = drawn(scene, camera, library)[4, 4] @ LUMINANCE * math.pi / 0.5

    assert least <= lux <= most


def test_a_beam_turns_with_its_vehicle() -> None:
    """Facing +Y, the right is +X: there the cut-off rises and the light is stronger."""
    (lamp,) = lamp_records([headlight(10_000.0, SE3.about_z(0.5 * math.pi))])
    slope = 0.005
    left, right = (
        dipped_share(lamp, [np.array([x]), np.array([1.0]), np.array([-slope])])[0]
        for x in (-0.05, 0.05)
    )

    assert right > 20.0 * left


def test_cars_ahead_are_lit_below_the_cutoff_only() -> None:
    """A wall 12 m ahead of a lamp at 0.65 m: bright to the knee, stray light at the windscreen."""
    (lamp,) = lamp_records([headlight(10_000.0, SE3((0.0, 0.0, 0.65)))])
    lux = {
        z: float(dipped_share(lamp, [np.array([12.0]), np.array([0.0]), np.array([z - 0.65])])[0])
        for z in (0.3, 1.3)
    }

    assert lux[0.3] > 0.5
    assert lux[1.3] < 0.02


def test_beams_that_end_below_what_is_seen_are_ranked_last() -> None:
    """Of two lamps, the one that the view lies in the dark part of goes."""
    above = np.array([[20.0, 0.0, 3.0], [25.0, 1.0, 4.0]])
    normals = np.tile([-1.0, 0.0, 0.0], (2, 1))
    spot = Light("spot", "spot", direction=(1.0, 0.0, 0.0), intensity_cd=5000.0, cone_rad=0.9)
    lamps = lamp_records([headlight(14_000.0, SE3((0.0, 0.0, 2.0))), spot])

    assert main_lamps(lamps, above, normals, 1).tolist() == [1]
