"""Weather presets: a condition and a time of day in one name, as in ``HardRainSunset``.

The names follow CARLA's ``WeatherParameters``, extended by fog and snow; the values are this
project's own. Rain rates follow the classes of the World Meteorological Organization: light below
2.5 mm/h, moderate up to 10, heavy above. Fog follows the meteorological range: mist from 1 km to
5 km, fog below 1 km.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from gen_data.generator.core.scene import Weather

Range = tuple[float, float]

KOSCHMIEDER = 3.912
"""Extinction times meteorological range at 2 % contrast (Koschmieder 1924)."""


@dataclass(frozen=True, slots=True)
class Condition:
    """State of the sky, the air and the ground.

    Attributes:
        cloudiness, turbidity: Ranges of uniform draws.
        weather: Typical values; the seed is drawn.
    """

    cloudiness: Range
    turbidity: Range = (2.0, 3.5)
    weather: Weather = field(default_factory=Weather)


def _fog(visibility_m: float, height_m: float) -> Weather:
    return Weather(
        fog_extinction_per_m=round(KOSCHMIEDER / visibility_m, 6),
        fog_height_m=height_m,
        wetness=0.3,
    )


def _rain(rate_mm_h: float, visibility_m: float, puddles: float, lens_drops: float) -> Weather:
    return Weather(
        fog_extinction_per_m=round(KOSCHMIEDER / visibility_m, 6),
        fog_height_m=600.0,
        rain_mm_h=rate_mm_h,
        wetness=min(0.5 + 0.1 * rate_mm_h, 1.0),
        puddles=puddles,
        lens_drops=lens_drops,
    )


def _snow(rate_mm_h: float, visibility_m: float, cover: float) -> Weather:
    return Weather(
        fog_extinction_per_m=round(KOSCHMIEDER / visibility_m, 6),
        fog_height_m=500.0,
        snow_mm_h=rate_mm_h,
        snow_cover=cover,
        wetness=0.4,
    )


CONDITIONS: dict[str, Condition] = {
    "Clear": Condition((0.0, 0.15)),
    "Cloudy": Condition((0.45, 0.9), (2.5, 4.0)),
    "Wet": Condition((0.1, 0.45), weather=Weather(wetness=0.8, puddles=0.18)),
    "WetCloudy": Condition((0.6, 1.0), (2.5, 4.0), Weather(wetness=0.9, puddles=0.22)),
    "SoftRain": Condition((0.75, 1.0), (3.0, 5.0), _rain(2.0, 9000.0, 0.08, 0.004)),
    "MidRain": Condition((0.9, 1.0), (3.0, 5.0), _rain(8.0, 4000.0, 0.2, 0.012)),
    "HardRain": Condition((1.0, 1.0), (3.0, 5.0), _rain(30.0, 1500.0, 0.35, 0.03)),
    "Misty": Condition((0.3, 0.8), (4.0, 6.0), _fog(1500.0, 60.0)),
    "Foggy": Condition((0.8, 1.0), (4.0, 6.0), _fog(250.0, 60.0)),
    "DenseFog": Condition((1.0, 1.0), (4.0, 6.0), _fog(70.0, 80.0)),
    "Snowy": Condition((0.0, 0.7), weather=Weather(snow_cover=0.75, wetness=0.4)),
    "SoftSnow": Condition((0.8, 1.0), (3.0, 5.0), _snow(0.6, 2500.0, 0.5)),
    "HardSnow": Condition((1.0, 1.0), (3.0, 5.0), _snow(2.5, 500.0, 0.85)),
    "DustStorm": Condition((0.3, 0.6), (7.0, 8.0), Weather(fog_extinction_per_m=0.006)),
}
"""Conditions by the first part of a preset's name."""

ALTITUDES_DEG: dict[str, Range] = {
    "Noon": (32.0, 62.0),
    "Morning": (8.0, 22.0),
    "Sunset": (0.8, 6.0),
    "Dusk": (-7.0, -3.0),
    "Night": (-50.0, -16.0),
}
"""Range of the sun's altitude, by the last part of a preset's name."""

_OTHER_NAMES = {"MidRainy": "MidRain"}


@dataclass(frozen=True, slots=True)
class Preset:
    """A condition at a time of day."""

    condition: Condition
    sun_altitude_deg: Range


PRESETS: dict[str, Preset] = {
    f"{name}{time}": Preset(CONDITIONS[_OTHER_NAMES.get(name, name)], altitude_deg)
    for name in (*CONDITIONS, *_OTHER_NAMES)
    for time, altitude_deg in ALTITUDES_DEG.items()
}
