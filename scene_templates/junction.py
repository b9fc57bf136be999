"""Road junctions."""

import math
from typing import ClassVar, Literal

from pydantic import Field

from gen_data.core import errors, scene, se3
from gen_data.roads.junction_shape import JunctionShape, junction_lanes
from gen_data.scene_templates import intersection, road


class Junction(intersection.Intersection):
    """A level junction with rounded corners; roads start at its arms with ``after: <name>/<arm>``.

    Attributes:
        lanes: Number of lanes per arm and direction.
        lane_width_m: Width of each lane.
        median_m: Width of the strip between the directions, to match the roads'.
        turn_lane: Whether that strip, at least 2.5 m wide, is a lane for those who turn across.
            Roads continue it by ``turn_m``.
        speed_m_s: Usual speed of crossing vehicles.
    """

    FAMILY: ClassVar[str] = "junction"

    type: Literal["junction"] = "junction"
    lanes: int = Field(1, ge=1, le=4)
    lane_width_m: float = Field(3.5, ge=2, le=6)
    median_m: float = Field(0.0, ge=0, le=12)
    turn_lane: bool = False
    speed_m_s: float = Field(8.0, ge=0, le=60)

    def shape(self) -> JunctionShape:
        """Return its shape. Raises ConfigError if the arms or the corners are impossible."""
        shape = JunctionShape(
            self.arms(), self.lanes, self.lane_width_m, self.kerb_m, self.sidewalk_m,
            self.beside_m, self.radius_m, self.crown, self.traffic, self.setback_m,
            self.median_m, float(self.turn_lane),
        )  # fmt: skip
        if self.turn_lane and self.median_m < road.TURN_LANE_M:
            raise errors.ConfigError(
                f"elements.{self.name}.median_m: {self.median_m:g} m; a lane for turning vehicles "
                f"needs at least {road.TURN_LANE_M:g}"
            )
        gaps = shape.gaps_rad()
        if min(gaps) < math.radians(40.0) or max(gaps) > math.pi + 1e-3:
            raise errors.ConfigError(
                f"elements.{self.name}.arms_deg: neighbouring arms must be 40 to 180 degrees "
                f"apart; found {math.degrees(min(gaps)):.0f} to {math.degrees(max(gaps)):.0f}"
            )
        self.check_corners(shape)
        return shape

    def _lanes(self, T_world_body: se3.SE3) -> tuple[scene.Lane, ...]:
        crosswalks = self.crossings != "none"
        return junction_lanes(self.shape(), self.name, T_world_body, self.speed_m_s, crosswalks)
