"""Weather, time of day and street lights: their parts of a scene."""

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gen_data.core.asset_types import Material
from gen_data.core.scene import Body, Light, Scene
from gen_data.core.scene import Weather as SceneWeather
from gen_data.core.se3 import SE3
from gen_data.randomizers import TABLE
from gen_data.randomizers.street_lights import spot_intensity_cd, white_balanced_color
from gen_data.randomizers.weather import ALTITUDES_DEG, CONDITIONS, PRESETS
from gen_data.sky import daylight
from gen_data.sky.sky import SkyModel, mean_luminance_cd_m2
from tests.randomizers.doubles import FakeAssets, rng_of
from tests.tiers import sampled

CARLA = (
    *("ClearNoon", "CloudyNoon", "WetNoon", "WetCloudyNoon", "SoftRainNoon", "MidRainyNoon"),
    *("HardRainNoon", "ClearSunset", "CloudySunset", "WetSunset", "WetCloudySunset"),
    *("SoftRainSunset", "MidRainSunset", "HardRainSunset", "ClearNight", "CloudyNight"),
    *("WetNight", "WetCloudyNight", "SoftRainNight", "MidRainyNight", "HardRainNight"),
)


def made(kind: str, **fields: Any) -> Any:
    plain = {"type": kind, "name": kind, **fields}
    return TABLE.load(kind).model_validate_json(json.dumps(plain))


def drawn(kind: str, scene: Scene | None = None, seed: int = 0, **fields: Any) -> Scene:
    return made(kind, **fields)(scene or Scene("t"), FakeAssets(), rng_of(kind, seed))


def suns(scene: Scene) -> list[Light]:
    return [light for light in scene.lights if light.kind == "sun"]


def test_presets_have_the_names_of_carla() -> None:
    """And every condition exists at every time."""
    assert set(CARLA) <= set(PRESETS)
    assert {c + t for c in CONDITIONS for t in ALTITUDES_DEG} <= set(PRESETS)


@pytest.mark.parametrize("preset", sampled(sorted(PRESETS), 6))
def test_every_preset_makes_weather_and_a_sky(preset: str) -> None:
    """The sky's parameters are legal, the sun shines only above the horizon."""
    scene = drawn("weather", preset=preset)
    shared = dict(scene.shared)
    low, high = PRESETS[preset].sun_altitude_deg

    assert low <= shared["sun_altitude_deg"] <= high
    assert scene.environment.image.startswith("environment/sky?")
    assert scene.environment.luminance_cd_m2 > 0.0
    assert bool(suns(scene)) <= (shared["sun_altitude_deg"] > -0.8)
    assert replace(scene.weather, seed=0) == PRESETS[preset].condition.weather


def test_sun_stands_where_the_sky_is_brightest() -> None:
    """The image has the sun at +X and is turned by the yaw to the drawn azimuth."""
    scene = drawn("weather", preset="ClearNoon", sun_altitude_deg=30, sun_azimuth_deg=100)
    (sun,) = suns(scene)

    assert scene.environment.yaw_rad == pytest.approx(math.radians(100.0), abs=1e-6)
    expected = np.array([math.cos(math.radians(100)), math.sin(math.radians(100)), 0.0])
    expected = -np.sqrt(0.75) * expected - np.array([0.0, 0.0, 0.5])
    assert np.asarray(sun.direction) == pytest.approx(expected, abs=1e-5)


def test_fields_replace_what_the_preset_says() -> None:
    """A field that is given counts, the others stay."""
    scene = drawn("weather", preset="HardRainNoon", rain_mm_h=3.5, puddles={"uniform": [0.8, 0.9]})

    assert scene.weather.rain_mm_h == 3.5
    assert 0.8 <= scene.weather.puddles <= 0.9
    assert scene.weather.wetness == PRESETS["HardRainNoon"].condition.weather.wetness


def test_time_of_day_takes_other_suns_away_and_leaves_lamps_and_clouds() -> None:
    """One sun at most; lamps are not its business."""
    lamp = Light("lamp", "sphere", intensity_cd=10.0)
    scene = Scene("t", lights=(Light("old", "sun", illuminance_lux=5.0), lamp))
    noon = drawn("time_of_day", scene, sun_altitude_deg=40, cloudiness=0)

    assert [light.name for light in noon.lights] == ["sun", "lamp"]
    assert drawn("time_of_day", noon, sun_altitude_deg=-20).lights == (lamp,)

    rainy = drawn("weather", preset="HardRainNoon")

    assert dict(drawn("time_of_day", rainy).shared)["cloudiness"] == 1.0
    clear = drawn("time_of_day", rainy, cloudiness=0.1)
    assert dict(clear.shared)["cloudiness"] == 0.1
    assert clear.weather == rainy.weather


def test_time_of_day_can_be_preethams() -> None:
    """Sun and sky of one model: clear, whatever the weather said; the sun as the model has it."""
    rainy = Scene("t", shared=(("cloudiness", 1.0),))

    scene = drawn("time_of_day", rainy, sky="preetham", sun_altitude_deg=40, turbidity=3)

    model = SkyModel(0, 40.0, 3.0, model="preetham")
    assert "model=preetham" in scene.environment.image
    assert dict(scene.shared)["cloudiness"] == 0.0
    assert scene.environment.luminance_cd_m2 == pytest.approx(mean_luminance_cd_m2(model), rel=1e-3)
    (sun,) = suns(scene)
    assert sun.illuminance_lux == pytest.approx(
        daylight.preetham_sun_lux(math.radians(40.0), 3.0), rel=1e-3
    )


def test_clouds_dim_and_soften_the_sun() -> None:
    """Half the sky under clouds is duller light from a larger disc."""
    clear, broken = (
        suns(drawn("time_of_day", sun_altitude_deg=40, turbidity=2.5, cloudiness=c))[0]
        for c in (0.0, 0.5)
    )

    assert broken.illuminance_lux < 0.8 * clear.illuminance_lux
    assert broken.angular_radius_rad > 1.5 * clear.angular_radius_rad


def street() -> Scene:
    window = Material(role="window")
    house = Body("house", "brick", materials=(Material(role="facade"), window))
    lamp = Body("lamp", "street_lamp", SE3((2.0, 1.0, 0.5)), materials=(Material(role="lamp"),))
    scene = Scene("t", bodies=(house, lamp), weather=SceneWeather())
    return drawn("time_of_day", scene, sun_altitude_deg=-20)


def test_street_lights_burn_when_it_is_dark() -> None:
    """By day nothing changes; at night a spot hangs below the lamp, and its slot glows."""
    day = drawn("time_of_day", street(), sun_altitude_deg=20)
    assert drawn("street_lights", day) == day

    night = drawn("street_lights", street(), broken=False, windows=True)
    (light,) = night.lights
    assert light.position_m == pytest.approx((3.5, 1.0, 6.45))
    assert light.direction == (0.0, 0.0, -1.0)
    glowing = {
        material.role: material.emission_cd_m2[1] > 0.0
        for body in night.bodies
        for material in body.materials
    }
    assert glowing == {"facade": False, "window": True, "lamp": True}


def test_broken_lamps_and_dark_windows_stay_dark() -> None:
    """Probability 1 of being broken, 0 of being lit."""
    night = drawn("street_lights", street(), broken=True, windows=False)

    assert (night.lights, night.bodies) == ((), street().bodies)


def test_spot_sends_out_its_flux() -> None:
    """The integral of the renderer's profile over the cone is the flux, within 5 %."""
    cone = math.radians(70.0)
    theta = (np.arange(20_000) + 0.5) / 20_000 * cone
    t = np.clip(
        (np.cos(theta) - math.cos(cone)) / (math.cos(0.5 * cone) - math.cos(cone)), 0.0, 1.0
    )
    profile = t * t * (3.0 - 2.0 * t)
    solid_angle = (profile * 2.0 * math.pi * np.sin(theta)).sum() * cone / 20_000

    assert spot_intensity_cd(6000.0, cone) * solid_angle == pytest.approx(6000.0, rel=0.05)


def test_warm_lamps_look_warm_and_cold_ones_do_not() -> None:
    """Red over blue falls with the colour temperature."""
    ratios = [red / blue for red, _, blue in map(white_balanced_color, (2300.0, 3000.0, 4000.0))]

    assert ratios == sorted(ratios, reverse=True)
    assert 0.8 < ratios[-1] < 2.0
