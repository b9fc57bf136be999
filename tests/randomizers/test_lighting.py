"""Lamps, the sun, and light from all around."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gen_data.config.distributions import Constant, Uniform
from gen_data.core.errors import ConfigError, LayoutRejected
from gen_data.core.scene import Body, Light, Region, Scene
from gen_data.core.se3 import SE3
from gen_data.randomizers.ceiling_lights import CeilingLights
from gen_data.randomizers.environment import EnvironmentLight
from gen_data.randomizers.free_space import is_clear
from gen_data.randomizers.lighting import Lighting
from tests.randomizers.doubles import FakeAssets, rng_of

FOCUS = Region((0.3, -0.2, 0.8), (1.2, 0.8, 0.25))
ROOM = ((-2.3, -1.8, 0.1), (2.3, 1.8, 2.6))
SCENE = Scene("test", focus=FOCUS, interior_m=ROOM)


def lit(scene: Scene = SCENE, scene_index: int = 0, **given: object) -> tuple[Light, ...]:
    lighting = Lighting(name="lamps", **given)  # type: ignore[arg-type]
    return lighting(scene, FakeAssets(), rng_of("lamps", scene_index, index=scene_index)).lights


def illuminance_lux(light: Light) -> float:
    """On a small surface at the focus that faces the light: E = I / d^2 for a small source."""
    if light.kind == "sun":
        return light.illuminance_lux
    distance_m = math.dist(light.position_m, FOCUS.center_m)
    return light.intensity_cd / distance_m**2


@pytest.mark.parametrize("kind", ["sphere", "spot", "sun"])
@pytest.mark.parametrize("count", [1, 3])
def test_lights_add_up_to_the_illuminance_at_the_focus(kind: str, count: int) -> None:
    """By the photometric law, whatever their distance, number and kind."""
    lights = lit(count=Constant(count), kind=Constant(kind), illuminance_lux=Constant(640.0))

    assert len(lights) == count
    assert {light.kind for light in lights} == {kind}
    assert sum(illuminance_lux(light) for light in lights) == pytest.approx(640.0, rel=1e-4)


def test_lamps_hang_where_they_were_asked_to() -> None:
    """Elevation and azimuth seen from the focus; distance at most the one drawn."""
    elevation, azimuth = Uniform(40.0, 60.0), Uniform(100.0, 140.0)
    for scene_index in range(20):
        for light in lit(
            scene_index=scene_index, elevation_deg=elevation, azimuth_deg=azimuth,
            distance_m=Uniform(0.9, 1.6),
        ):  # fmt: skip
            away = np.subtract(light.position_m, FOCUS.center_m)
            distance_m = float(np.linalg.norm(away))

            assert distance_m <= 1.6 + 1e-5
            assert 40.0 - 1e-3 <= math.degrees(math.asin(away[2] / distance_m)) <= 60.0 + 1e-3
            assert 100.0 - 1e-3 <= math.degrees(math.atan2(away[1], away[0])) <= 140.0 + 1e-3


def test_lamps_are_in_the_room_and_outside_of_bodies() -> None:
    """A box as large as half the space around the focus leaves the rest to them."""
    body = Body("cupboard", "plane?size_m=1,1", instance_id=1)
    cupboard = replace(body, asset="room?size_m=1.2,1.2,1.2", T_world_body=SE3((0.8, -0.2, 0.9)))
    scene = replace(SCENE, bodies=(cupboard,))
    for scene_index in range(40):
        for light in lit(scene, scene_index, count=Constant(2), radius_m=Constant(0.1)):
            inside = np.array(light.position_m)

            assert (inside >= ROOM[0]).all()
            assert (inside <= ROOM[1]).all()
            here = inside - (0.8, -0.2, 0.9)
            gap_m = np.maximum(np.abs(here - (0, 0, 0.6)) - 0.6, 0.0)
            assert gap_m.max() >= 0.1


def test_no_place_for_a_lamp_is_told_with_a_remedy() -> None:
    """Straight down from the focus is under the floor."""
    with pytest.raises(LayoutRejected) as refused:
        lit(elevation_deg=Constant(-90.0), distance_m=Uniform(3.0, 4.0))
    assert "randomizers.lamps" in refused.value.rejection.remedy


def test_spots_and_suns_shine_on_the_focus() -> None:
    """A spot's axis goes through the focus; the sun comes from above. Directions are unit."""
    (spot,) = lit(count=Constant(1), kind=Constant("spot"), cone_deg=Constant(25.0))
    (sun,) = lit(count=Constant(1), kind=Constant("sun"), elevation_deg=Constant(30.0))
    towards = np.subtract(FOCUS.center_m, spot.position_m)

    assert np.allclose(towards / np.linalg.norm(towards), spot.direction, atol=2e-6)
    assert spot.cone_rad == pytest.approx(math.radians(25.0), abs=1e-6)
    assert np.linalg.norm(sun.direction) == pytest.approx(1.0, abs=1e-5)
    assert sun.direction[2] == pytest.approx(-0.5, abs=1e-6)


def test_lights_have_their_temperature_and_softness() -> None:
    """Linear RGB of luminance 1, warm or cold; radius as drawn."""
    (warm,) = lit(count=Constant(1), temperature_k=Constant(2700.0), radius_m=Constant(0.07))
    (cold,) = lit(count=Constant(1), temperature_k=Constant(9000.0))

    assert warm.color[0] > 1.0 > warm.color[2]
    assert cold.color[2] > 1.0 > cold.color[0]
    assert np.dot(warm.color, (0.2126, 0.7152, 0.0722)) == pytest.approx(1.0, abs=1e-5)
    assert warm.radius_m == 0.07


def test_defaults_are_those_of_a_room() -> None:
    """Between 250 and 1200 lx, balls of 2 to 12 cm, above their focus."""
    for scene_index in range(30):
        lights = lit(scene_index=scene_index)

        assert 1 <= len(lights) <= 3
        assert 249.0 < sum(illuminance_lux(light) for light in lights) < 1201.0
        assert all(0.02 <= light.radius_m <= 0.12 for light in lights)
        assert all(light.position_m[2] > FOCUS.center_m[2] + 0.3 for light in lights)


PANELS = {
    "width_m": Uniform(0.4, 0.9), "panel_aspect": Uniform(0.5, 0.8), "radius_m": Uniform(0.2, 0.3),
}  # fmt: skip


@pytest.mark.parametrize("kind", ["rectangle", "disk"])
def test_soft_boxes_are_turned_to_the_focus_and_stand_level(kind: str) -> None:
    """As large as drawn; together they give the illuminance, by the formula for the axis."""
    for scene_index in range(10):
        lights = lit(
            scene_index=scene_index, count=Constant(2), kind=Constant(kind),
            illuminance_lux=Constant(500.0), **PANELS,
        )  # fmt: skip
        total_lux = 0.0
        for light in lights:
            away = np.subtract(light.position_m, FOCUS.center_m)
            d = float(np.linalg.norm(away))
            assert np.allclose(-away / d, light.direction, atol=2e-6)
            if kind == "disk":
                assert 0.2 <= light.radius_m <= 0.3
                total_lux += light.intensity_cd / (d * d + light.radius_m**2)
            else:
                assert 0.4 <= light.size_m[0] <= 0.9
                assert 0.5 - 1e-3 <= light.size_m[1] / light.size_m[0] <= 0.8 + 1e-3
                assert light.side[2] == 0.0
                assert np.dot(light.side, light.direction) == pytest.approx(0.0, abs=2e-6)
                assert np.linalg.norm(light.side) == pytest.approx(1.0, abs=2e-6)
                # Sixteen by sixteen parts of the panel.
                s = (np.arange(16) + 0.5) / 16 - 0.5
                u, v = np.meshgrid(s * light.size_m[0], s * light.size_m[1])
                total_lux += light.intensity_cd * (d**2 / (u**2 + v**2 + d**2) ** 2).mean()
        assert total_lux == pytest.approx(500.0, rel=2e-3)


@pytest.mark.parametrize(
    ("kind", "per_flux"), [("sphere", 4 * math.pi), ("rectangle", math.pi), ("disk", math.pi)]
)
def test_flux_is_an_alternative_to_illuminance(kind: str, per_flux: float) -> None:
    """I = flux / (4 pi) of a ball, flux / pi of a panel, wherever it is."""
    lights = lit(
        count=Constant(2), kind=Constant(kind), luminous_flux_lm=Constant(3000.0), **PANELS
    )

    assert sum(light.intensity_cd for light in lights) * per_flux == pytest.approx(3000.0)


def test_a_visible_panel_hangs_in_a_housing_and_the_next_draw_takes_it_away() -> None:
    """One body per panel, which the light goes with; lights drawn over them leave none behind."""
    lighting = Lighting(name="soft", kind=Constant("rectangle"), visible=True, count=Constant(2))
    scene = lighting(SCENE, FakeAssets(), rng_of("soft", 3))
    again = Lighting(name="lamps")(scene, FakeAssets(), rng_of("lamps", 3))
    kept = Lighting(name="lamps", keep_existing=True)(scene, FakeAssets(), rng_of("lamps", 3))

    assert [body.name for body in scene.bodies] == ["soft/0", "soft/1"]
    assert [light.body for light in scene.lights] == ["soft/0", "soft/1"]
    assert again.bodies == ()
    assert kept.bodies == scene.bodies
    assert kept.lights[:2] == scene.lights


def test_cameras_and_lamps_keep_clear_of_housings() -> None:
    """They are background, and in the way all the same."""
    lighting = Lighting(name="soft", kind=Constant("rectangle"), visible=True, count=Constant(1))
    scene = lighting(SCENE, FakeAssets(), rng_of("soft", 3))
    light = scene.lights[0]

    assert not is_clear(light.position_m, scene, FakeAssets(), 0.02)
    assert is_clear(light.position_m, replace(scene, lights=()), FakeAssets(), 0.02)


def test_a_sun_with_a_flux_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"randomizers\.lamps\.luminous_flux_lm: a sun has no"):
        lit(kind=Constant("sun"), luminous_flux_lm=Constant(1000.0))


def ceiling(**given: object) -> Scene:
    lights = CeilingLights.model_validate({"name": "panels", "broken": False, **given})
    return lights(SCENE, FakeAssets(), rng_of("panels", 1))


def test_ceiling_panels_hang_in_a_grid_and_shine_down() -> None:
    """Two rows of three, in the middles of equal fields at the top of the room, 1000 lm each."""
    scene = ceiling(rows=2, columns=3, luminous_flux_lm=1000)

    at = sorted(light.position_m for light in scene.lights)
    x = [-2.3 + 4.6 * k / 6 for k in (1, 3, 5)]
    expected = [(a, b, 2.6) for a in x for b in (-0.9, 0.9)]
    np.testing.assert_allclose(at, expected, atol=1e-6)
    assert {light.direction for light in scene.lights} == {(0.0, 0.0, -1.0)}
    assert all(
        light.intensity_cd == pytest.approx(1000 / math.pi, rel=1e-5) for light in scene.lights
    )
    assert len(scene.bodies) == 6


def test_broken_ceiling_panels_are_dark_and_there() -> None:
    """Housings without a light; none at all if they are not to be seen."""
    dark = ceiling(rows=1, columns=2, broken=True)
    unseen = ceiling(rows=1, columns=2, visible=False)

    assert dark.lights == ()
    assert (len(dark.bodies), len(unseen.lights)) == (2, 2)
    assert unseen.bodies == ()


def test_environment_is_one_of_those_asked_for() -> None:
    """By family or tag; luminance and turn within their ranges."""
    asked = EnvironmentLight(
        name="sky", images=("studio", "outdoor"), luminance_cd_m2=Uniform(40.0, 60.0),
        yaw_deg=Uniform(90.0, 180.0), visible=False,
    )  # fmt: skip
    seen = set()
    for scene_index in range(40):
        environment = asked(SCENE, FakeAssets(), rng_of("sky", scene_index)).environment
        seen.add(environment.image)

        assert 40.0 <= environment.luminance_cd_m2 <= 60.0
        assert math.pi / 2 <= environment.yaw_rad <= math.pi + 1e-6
        assert not environment.visible
    assert seen == {f"environment/{name}?seed={k}" for name in ("studio", "sky") for k in (0, 1)}
