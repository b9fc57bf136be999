"""Roundabouts."""

import math
from typing import ClassVar, Literal

from pydantic import Field

from gen_data.core import errors, scene, se3
from gen_data.roads.roundabout_shape import RoundaboutShape, roundabout_lanes
from gen_data.scene_templates.intersection import Intersection

_SPARE_RAD = math.radians(4.0)


class Roundabout(Intersection):
    """A roundabout of one lane; roads of one lane per direction start at ``<name>/<arm>``.

    Vehicles wait for each other as at a junction without signs, not only for vehicles on the ring.

    Attributes:
        diameter_m: Outer diameter of the ring.
        ring_m: Width of the ring, with the truck apron.
        truck_apron_m: Width of the rough inner part of the ring; 0 = none.
        lane_width_m: Width of each lane of the arms.
        splitters: Whether raised islands part the lanes of every arm.
        speed_m_s: Usual speed on the ring.
    """

    FAMILY: ClassVar[str] = "roundabout"

    type: Literal["roundabout"] = "roundabout"
    diameter_m: float = Field(30.0, ge=22, le=80)
    ring_m: float = Field(7.0, ge=4, le=12)
    truck_apron_m: float = Field(1.6, ge=0, le=4)
    lane_width_m: float = Field(3.5, ge=2.5, le=5)
    radius_m: float = Field(12.0, ge=6, le=40)
    splitters: bool = True
    speed_m_s: float = Field(7.0, ge=0, le=30)

    def shape(self) -> RoundaboutShape:
        """Return its shape. Raises ConfigError if ring, arms or corners are impossible."""
        where = f"elements.{self.name}"
        shape = RoundaboutShape(
            self.arms(), self.lane_width_m, self.kerb_m, self.sidewalk_m, self.beside_m,
            self.radius_m, self.crown, self.traffic, self.diameter_m, self.ring_m,
            self.truck_apron_m, float(self.splitters), self.setback_m,
        )  # fmt: skip
        if self.ring_m < self.truck_apron_m + self.lane_width_m or shape.island_m < 2.0:
            raise errors.ConfigError(
                f"{where}.ring_m: {self.ring_m:g} m; expected {self.truck_apron_m:g} m of truck "
                f"apron and at least {self.lane_width_m:g} m at its side, and an island of at "
                f"least 4 m within a diameter of {self.diameter_m:g} m"
            )
        self.check_corners(shape)
        needed = 2.0 * shape.mouth_rad() + _SPARE_RAD
        if min(shape.gaps_rad()) < needed:
            raise errors.ConfigError(
                f"{where}.arms_deg: neighbouring arms are "
                f"{math.degrees(min(shape.gaps_rad())):.0f} degrees apart; expected at least "
                f"{math.degrees(needed):.0f}, or a larger diameter_m or a smaller radius_m"
            )
        return shape

    def _lanes(self, T_world_body: se3.SE3) -> tuple[scene.Lane, ...]:
        crosswalks = self.crossings != "none"
        return roundabout_lanes(self.shape(), self.name, T_world_body, self.speed_m_s, crosswalks)
