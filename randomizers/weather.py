"""Weather, with the matching sun and sky.

A preset is a condition and a time of day in one name, as in ``HardRainSunset``.
"""

from dataclasses import dataclass, field, replace
from typing import Any, Literal

from pydantic import Field, field_validator

from gen_data.config import distributions as dist
from gen_data.config.data_files import load_table
from gen_data.config.yaml_scalars import quote_value
from gen_data.core import errors, interfaces, streams
from gen_data.core.scene import Scene
from gen_data.core.scene import Weather as SceneWeather
from gen_data.randomizers import base, daylight, time_of_day
from gen_data.sky.sky import SkyModel

_FIELDS = ("fog_extinction_per_m", "fog_height_m", "rain_mm_h", "snow_mm_h", "wetness", "puddles",
           "snow_cover", "lens_drops")  # fmt: skip
_PATTERNS = 2**31

Range = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Condition:
    """State of the sky, the air and the ground.

    Attributes:
        cloudiness, turbidity: Ranges of uniform draws.
        weather: Typical values; the seed is drawn.
    """

    cloudiness: Range
    turbidity: Range = (2.0, 3.5)
    weather: SceneWeather = field(default_factory=SceneWeather)


CONDITIONS = load_table("gen_data.randomizers", "weather_conditions", Condition)
"""Conditions by the first part of a preset's name."""

ALTITUDES_DEG: dict[str, Range] = {
    "Noon": (32.0, 62.0),
    "Morning": (8.0, 22.0),
    "Sunset": (0.8, 6.0),
    "Dusk": (-7.0, -3.0),
    "Night": (-50.0, -16.0),
}
"""Range of the sun's altitude, by the last part of a preset's name."""


@dataclass(frozen=True, slots=True)
class Preset:
    """A condition at a time of day."""

    condition: Condition
    sun_altitude_deg: Range


PRESETS: dict[str, Preset] = {
    f"{name}{time}": Preset(condition, altitude_deg)
    for name, condition in {**CONDITIONS, "MidRainy": CONDITIONS["MidRain"]}.items()
    for time, altitude_deg in ALTITUDES_DEG.items()
}


class Weather(base.RandomizerBase):
    """Draws a weather preset; other fields, where given, override the preset's values.

    Attributes:
        preset: Condition and time of day in one name, such as ClearNoon, WetCloudySunset or
            HardRainNight. Conditions: Clear, Cloudy, Wet, WetCloudy, SoftRain, MidRain, HardRain,
            Misty, Foggy, DenseFog, Snowy, SoftSnow, HardSnow, DustStorm. Times: Noon, Morning,
            Sunset, Dusk, Night.
        sun_altitude_deg: Angle of the sun above the horizon; negative at night.
        sun_azimuth_deg: Direction of the sun around the vertical, from +X towards +Y.
        cloudiness: Cloud cover: 0 clear, 0.5 broken clouds, 1 overcast.
        turbidity: Haze of clear air: 2 very clear, 6 hazy.
        fog_extinction_per_m: Extinction coefficient at the ground; the meteorological range is
            3.912 divided by it.
        fog_height_m: Height over which fog thins by a factor of e; 0 = uniform fog.
        rain_mm_h: Rain rate.
        snow_mm_h: Snow rate as water equivalent.
        wetness: Wetness of surfaces open to the sky: 0 dry, 1 soaked.
        puddles: Fraction of level, paved ground under water; higher places and soil have less.
        snow_cover: Fraction of upward-facing surfaces under snow.
        lens_drops: Fraction of the image covered by drops on the lens.
    """

    type: Literal["weather"] = "weather"
    preset: dist.Name = dist.Choice(("ClearNoon", "CloudyNoon", "ClearSunset", "WetNoon"))
    sun_altitude_deg: time_of_day.Altitude | None = Field(None)
    sun_azimuth_deg: dist.Scalar = dist.Uniform(0.0, 360.0)
    cloudiness: dist.UnitInterval | None = Field(None)
    turbidity: time_of_day.Turbidity | None = Field(None)
    fog_extinction_per_m: dist.NonNegative | None = Field(None)
    fog_height_m: dist.NonNegative | None = Field(None)
    rain_mm_h: dist.NonNegative | None = Field(None)
    snow_mm_h: dist.NonNegative | None = Field(None)
    wetness: dist.UnitInterval | None = Field(None)
    puddles: dist.UnitInterval | None = Field(None)
    snow_cover: dist.UnitInterval | None = Field(None)
    lens_drops: dist.UnitInterval | None = Field(None)

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with drawn weather, sun and sky."""
        del assets
        preset = PRESETS[self.preset.draw(rng)]
        condition = preset.condition
        altitude_deg = _draw(self.sun_altitude_deg, preset.sun_altitude_deg, rng)
        azimuth_deg = self.sun_azimuth_deg.draw(rng)
        cloudiness = _draw(self.cloudiness, condition.cloudiness, rng)
        turbidity = _draw(self.turbidity, condition.turbidity, rng)
        sky = SkyModel(daylight.draw_cloud_seed(rng), altitude_deg, turbidity, cloudiness)
        values: dict[str, Any] = {"seed": int(rng.integers(_PATTERNS))}
        for name in _FIELDS:
            given: dist.Scalar | None = getattr(self, name)
            if given is not None:
                values[name] = round(given.draw(rng), 6)
        weather = replace(condition.weather, **values)
        return daylight.set_daylight(replace(scene, weather=weather), sky, azimuth_deg)

    @field_validator("preset")
    @classmethod
    def _check_preset(cls, preset: dist.Name) -> dist.Name:
        for name in preset.outcomes():
            if name not in PRESETS:
                raise ValueError(
                    f"there is no weather {quote_value(name)}; expected a condition and a time "
                    f"such as ClearNoon{errors.did_you_mean(name, PRESETS)}"
                )
        return preset


def _draw(given: dist.Scalar | None, default: Range, rng: streams.Rng) -> float:
    return (given or dist.Uniform(*default)).draw(rng)
