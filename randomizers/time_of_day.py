"""Sun and sky through the day and the night."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from gen_data.generator.config.distributions import Bounds, Scalar, Uniform, UnitInterval
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import Scene
from gen_data.generator.core.streams import Rng
from gen_data.randomizers.base import RandomizerBase
from gen_data.randomizers.daylight import Daylight, draw_cloud_seed, set_daylight, shared_number

Altitude = Annotated[Scalar, Bounds(-90, 90)]
Turbidity = Annotated[Scalar, Bounds(1.8, 8.0)]


class TimeOfDay(RandomizerBase):
    """Draws where the sun stands; light, colours and the sky follow from it.

    Attributes:
        sun_altitude_deg: Over the horizon: 60 a summer's noon, 0 sunset, -6 the end of dusk,
            below -12 night.
        sun_azimuth_deg: Direction around the vertical, from +X towards +Y.
        cloudiness: 0 clear, 0.5 broken clouds, 1 overcast; without it what the weather said,
            else anything up to broken clouds.
        turbidity: Haze of clear air: 2 very clear, 6 hazy.
        sky: measured: as much light as tables of daylight say, under any clouds, day and night.
            preetham: the luminances of the analytic clear sky by day of Preetham 1999, and its sun.
    """

    type: Literal["time_of_day"] = "time_of_day"
    sun_altitude_deg: Altitude = Uniform(5.0, 60.0)
    sun_azimuth_deg: Scalar = Uniform(0.0, 360.0)
    cloudiness: UnitInterval | None = Field(None)
    turbidity: Turbidity = Uniform(2.0, 4.0)
    sky: Literal["measured", "preetham"] = "measured"

    @model_validator(mode="after")
    def _is_day_and_clear(self) -> TimeOfDay:
        if self.sky == "preetham":
            if self.cloudiness is not None and self.cloudiness.support() != (0.0, 0.0):
                raise ValueError("sky 'preetham' has no clouds; leave cloudiness out")
            if self.sun_altitude_deg.support()[0] < 1.0:
                raise ValueError("sky 'preetham' has no night; let sun_altitude_deg begin at 1")
        return self

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """The scene at another time."""
        del assets
        altitude_deg = self.sun_altitude_deg.draw(rng)
        azimuth_deg = self.sun_azimuth_deg.draw(rng)
        turbidity, seed = self.turbidity.draw(rng), draw_cloud_seed(rng)
        given = 0.0 if self.sky == "preetham" else shared_number(scene, "cloudiness")
        if self.cloudiness is not None:
            cloudiness = self.cloudiness.draw(rng)
        elif given is not None:
            cloudiness = given
        else:
            cloudiness = Uniform(0.0, 0.6).draw(rng)
        snow = scene.weather.snow_cover > 0.0
        light = Daylight(
            altitude_deg, azimuth_deg, cloudiness, turbidity, seed, snow=snow, model=self.sky
        )
        return set_daylight(scene, light)
