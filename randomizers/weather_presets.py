"""Weather presets: a condition and a time of day in one name, as in ``HardRainSunset``."""

from __future__ import annotations

from dataclasses import dataclass, field

from gen_data.generator.assets.procedural.data_tables import load_table
from gen_data.generator.core.scene import Weather

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
    weather: Weather = field(default_factory=Weather)


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
