"""Lumens, candelas, lux: against integrals over the sphere and over panels."""

import math

import numpy as np
import pytest
from scipy.integrate import dblquad, quad

from gen_data.core import photometry
from gen_data.core.asset_types import Material
from gen_data.core.scene import Body, Light, Scene

SPHERE, SPOT = Light("s", "sphere"), Light("p", "spot", cone_rad=0.5, even=0.6)
RECTANGLE = Light("r", "rectangle", size_m=(1.2, 0.5))
DISK = Light("d", "disk", radius_m=0.4)


def share_of_intensity(light: Light, angle_rad: float) -> float:
    """Intensity at an angle from the axis over that along it; the spot fades by a smooth step."""
    if light.kind == "sphere":
        return 1.0
    if light.kind == "spot":
        inner, outer = math.cos(light.even * light.cone_rad), math.cos(light.cone_rad)
        t = min(max((math.cos(angle_rad) - outer) / (inner - outer), 0.0), 1.0)
        return t * t * (3.0 - 2.0 * t)
    return max(math.cos(angle_rad), 0.0)


@pytest.mark.parametrize("light", [SPHERE, SPOT, RECTANGLE, DISK])
def test_intensity_over_all_directions_sums_to_the_flux(light: Light) -> None:
    """The integral of I(angle) over the sphere, by quadrature, is the luminous flux."""
    intensity_cd = photometry.flux_to_intensity_cd(light, 3000.0)

    flux_lm, _ = quad(
        lambda a: 2.0 * math.pi * math.sin(a) * share_of_intensity(light, a) * intensity_cd,
        0.0, math.pi, points=[0.3, 0.5, math.pi / 2],
    )  # fmt: skip
    assert flux_lm == pytest.approx(3000.0, rel=1e-6)
    assert photometry.scale_to_flux(light, 3000.0).intensity_cd == pytest.approx(
        intensity_cd, abs=1e-4
    )


def test_a_sun_has_no_flux_and_a_ball_no_luminance() -> None:
    """500 lx at 3 m are 4500 cd; 60 cd of 0.6 m^2 are 100 cd/m^2."""
    with pytest.raises(ValueError, match="not a flux"):
        photometry.flux_to_intensity_cd(Light("s", "sun"), 100.0)

    assert photometry.illuminance_to_intensity_cd(SPHERE, 500.0, 3.0) == 4500.0

    panel = Light("r", "rectangle", intensity_cd=60.0, size_m=(1.2, 0.5))
    assert photometry.luminance_cd_m2(panel) == pytest.approx(100.0)
    with pytest.raises(ValueError, match="not a panel"):
        photometry.luminance_cd_m2(SPHERE)


@pytest.mark.parametrize("distance_m", [0.3, 1.0, 7.0])
def test_panels_give_the_illuminance_that_was_asked_for(distance_m: float) -> None:
    """L cos cos / d^2 over the panel, by quadrature, straight before its middle."""
    for light in (RECTANGLE, DISK):
        cd = photometry.illuminance_to_intensity_cd(light, 500.0, distance_m)
        lit = Light("l", light.kind, intensity_cd=cd, size_m=light.size_m, radius_m=light.radius_m)

        def arriving(x: float, y: float) -> float:
            return distance_m**2 / (x * x + y * y + distance_m**2) ** 2

        if light.kind == "rectangle":
            a, b = light.size_m[0] / 2, light.size_m[1] / 2
            per_luminance, _ = dblquad(arriving, -b, b, -a, a)
        else:
            per_luminance, _ = quad(
                lambda r: 2.0 * math.pi * r * arriving(r, 0.0), 0.0, light.radius_m
            )
        assert photometry.luminance_cd_m2(lit) * per_luminance == pytest.approx(500.0, rel=1e-6)


@pytest.mark.parametrize("direction", [(0.0, 0.0, -1.0), (0.6, 0.0, -0.8), (0.0, -1.0, 0.0)])
def test_a_fixture_lies_right_behind_its_panel(direction: tuple[float, float, float]) -> None:
    """Its front, in its own frame the plane z = 0 towards -Z, is 1 mm behind; only it glows."""
    light = Light(
        "panel", "rectangle", (1.0, 2.0, 1.5), direction, (1.1, 0.98, 0.9), 60.0,
        size_m=(1.2, 0.5), side=photometry.level_side(direction),
    )  # fmt: skip
    slots = (Material(), Material(role="lamp"))

    scene, shown = photometry.add_fixture(Scene("t"), light, slots)

    (body,) = scene.bodies
    front = body.T_world_body.apply(np.zeros(3))
    assert np.asarray(light.position_m) - front == pytest.approx(1e-3 * np.asarray(direction))
    assert body.T_world_body.rotate(np.array((0.0, 0.0, -1.0))) == pytest.approx(
        np.asarray(direction), abs=1e-6
    )
    assert body.T_world_body.rotate(np.array((1.0, 0.0, 0.0))) == pytest.approx(
        np.asarray(light.side), abs=1e-6
    )
    assert shown.body == body.name
    assert body.instance_id == 0
    assert not body.collides
    assert body.materials[0] == Material()
    assert body.materials[1].emission_cd_m2 == pytest.approx((110.0, 98.0, 90.0))


def test_lights_go_with_their_fixtures_and_leave_what_else_they_ride_on() -> None:
    """A panel's housing goes; a car stays when its lamps do not."""
    panel = Light("panel", "disk", radius_m=0.2, intensity_cd=5.0)
    scene, shown = photometry.add_fixture(
        Scene("t", (Body("car", "car"),)), panel, (Material(role="lamp"),)
    )
    headlight = Light("head", "spot", body="car")

    left = photometry.remove_lights(Scene("t", scene.bodies, lights=(shown, headlight)))

    assert left.lights == ()
    assert [body.name for body in left.bodies] == ["car"]
