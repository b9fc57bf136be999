"""Sun and sky by time of day."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from gen_data.config import distributions as dist
from gen_data.core import interfaces, streams
from gen_data.core.scene import Scene
from gen_data.randomizers import base, daylight
from gen_data.sky.sky import SkyModel

Altitude = Annotated[dist.Scalar, dist.Bounds(-90, 90)]
Turbidity = Annotated[dist.Scalar, dist.Bounds(1.8, 8.0)]


class TimeOfDay(base.RandomizerBase):
    """Draws the position of the sun; daylight and sky follow from it.

    Attributes:
        sun_altitude_deg: Angle of the sun above the horizon: 60 summer noon, 0 sunset, -6 end of
            dusk, below -12 night.
        sun_azimuth_deg: Direction of the sun around the vertical, from +X towards +Y.
        cloudiness: Cloud cover: 0 clear, 0.5 broken clouds, 1 overcast; null = the value of the
            weather randomizer, else uniform from 0 to 0.6.
        turbidity: Haze of clear air: 2 very clear, 6 hazy.
        sky: measured: illuminance from tables of measured daylight, for any cloud cover, day and
            night. preetham: luminance of Preetham's analytic clear daytime sky (1999), with its
            sun.
    """

    type: Literal["time_of_day"] = "time_of_day"
    sun_altitude_deg: Altitude = dist.Uniform(5.0, 60.0)
    sun_azimuth_deg: dist.Scalar = dist.Uniform(0.0, 360.0)
    cloudiness: dist.UnitInterval | None = Field(None)
    turbidity: Turbidity = dist.Uniform(2.0, 4.0)
    sky: Literal["measured", "preetham"] = "measured"

    @model_validator(mode="after")
    def _is_day_and_clear(self) -> "TimeOfDay":
        if self.sky == "preetham":
            if self.cloudiness is not None and self.cloudiness.support() != (0.0, 0.0):
                raise ValueError("sky 'preetham' has no clouds; omit cloudiness")
            if self.sun_altitude_deg.support()[0] < 1.0:
                raise ValueError(
                    "sky 'preetham' has no night; expected sun_altitude_deg of at least 1"
                )
        return self

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with a drawn sun and sky."""
        del assets
        altitude_deg = self.sun_altitude_deg.draw(rng)
        azimuth_deg = self.sun_azimuth_deg.draw(rng)
        turbidity, seed = self.turbidity.draw(rng), daylight.draw_cloud_seed(rng)
        given = 0.0 if self.sky == "preetham" else daylight.shared_number(scene, "cloudiness")
        if self.cloudiness is not None:
            cloudiness = self.cloudiness.draw(rng)
        elif given is not None:
            cloudiness = given
        else:
            cloudiness = dist.Uniform(0.0, 0.6).draw(rng)
        sky = SkyModel(seed, altitude_deg, turbidity, cloudiness, model=self.sky)
        return daylight.set_daylight(scene, sky, azimuth_deg)
