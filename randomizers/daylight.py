"""Sun and sky that match each other."""

import math
from dataclasses import replace

from gen_data.core.scene import Environment, Light, Scene
from gen_data.core.streams import Rng
from gen_data.sky.daylight import sun_color, sun_radius_rad
from gen_data.sky.sky import SkyModel, mean_luminance_cd_m2, sun_lux

SUN = "sun"
"""Name of the sun among the lights."""
_CLOUD_SEEDS = 4096
_FAINTEST_LUX = 0.5
"""A fainter sun is left out."""
_SNOW_ALBEDO = 0.7
_LAND_ALBEDO = 0.18


def draw_cloud_seed(rng: Rng) -> int:
    """Draw a seed for the clouds of a sky."""
    return int(rng.integers(_CLOUD_SEEDS))


def set_daylight(scene: Scene, sky: SkyModel, sun_azimuth_deg: float) -> Scene:
    """Return the scene with its suns and environment replaced; lamps stay.

    Args:
        scene: The scene; its snow cover decides on the albedo of the ground.
        sky: Parameters of the sky, which are rounded; its albedo is ignored.
        sun_azimuth_deg: Direction of the sun from +X towards +Y.
    """
    altitude_deg, cloudiness = round(sky.sun_altitude_deg, 2), round(sky.cloudiness, 3)
    turbidity = round(sky.turbidity, 2)
    albedo = _SNOW_ALBEDO if scene.weather.snow_cover > 0.0 else _LAND_ALBEDO
    model = SkyModel(sky.seed, altitude_deg, turbidity, cloudiness, albedo, sky.model)
    yaw = round(math.radians(sun_azimuth_deg % 360.0), 6)
    named = "" if sky.model == "measured" else f"&model={sky.model}"
    image = (
        f"environment/sky?cloudiness={cloudiness:g}&ground_albedo={albedo:g}{named}"
        f"&seed={sky.seed}&sun_altitude_deg={altitude_deg:g}&turbidity={turbidity:g}"
    )
    environment = Environment(image, _significant(mean_luminance_cd_m2(model)), yaw)
    lamps = tuple(lamp for lamp in scene.lights if lamp.kind != "sun")
    return set_shared_values(
        replace(scene, lights=(*_sun(model, yaw), *lamps), environment=environment),
        cloudiness=cloudiness,
        sun_altitude_deg=altitude_deg,
    )


def set_shared_values(scene: Scene, **values: float) -> Scene:
    """Return the scene with values that later randomizers can read."""
    merged = {**dict(scene.shared), **values}
    return replace(scene, shared=tuple(sorted(merged.items())))


def shared_number(scene: Scene, name: str) -> float | None:
    """Value shared by an earlier randomizer; None if it is missing or no number."""
    value = dict(scene.shared).get(name)
    return float(value) if isinstance(value, (int, float)) else None


def is_dark(scene: Scene) -> bool:
    """Whether the sun has set."""
    altitude_deg = shared_number(scene, "sun_altitude_deg")
    return altitude_deg is not None and altitude_deg < 0.0


def _sun(model: SkyModel, yaw_rad: float) -> tuple[Light, ...]:
    altitude = model.sun_altitude_rad
    lux = sun_lux(model)
    if lux < _FAINTEST_LUX:
        return ()
    level = math.cos(altitude)
    direction = (
        round(-level * math.cos(yaw_rad), 6),
        round(-level * math.sin(yaw_rad), 6),
        round(-math.sin(altitude), 6),
    )
    color, lux = sun_color(altitude, model.turbidity), _significant(lux)
    light = Light(SUN, "sun", direction=direction, color=color, illuminance_lux=lux)
    radius_rad = round(sun_radius_rad(model.cloudiness), 6)
    return (replace(light, angular_radius_rad=radius_rad),)


def _significant(value: float) -> float:
    """Round to five digits: the recorded value is the rendered one."""
    return float(f"{value:.5g}")
