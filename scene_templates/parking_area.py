"""Car parks."""

from typing import Literal

from pydantic import Field

from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Scene
from gen_data.roads import cross_section, parking_shape
from gen_data.scene_templates import element, road


class ParkingArea(road.RoadSurface, element.PlacedElement):
    """Aisles along X with bays at right angles on both sides, around ``at_m``.

    Attributes:
        bays: Number of bays per row; in bends, of a row on the middle line.
        aisles: Number of aisles, each with two rows.
        bay_m: Width and length of a bay.
        aisle_m: Width of an aisle.
        curvature_per_m: Curvature of the middle line, positive to the left: aisles are arcs about
            one centre, and bays point at it; 0 = straight.
    """

    type: Literal["parking_area"] = "parking_area"
    bays: int = Field(10, ge=1, le=60)
    aisles: int = Field(1, ge=1, le=10)
    bay_m: tuple[float, float] = (2.5, 5.0)
    aisle_m: float = Field(6.0, ge=3, le=12)
    curvature_per_m: float = Field(0.0, ge=-0.1, le=0.1)

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add the surface as background; every bay is a lane."""
        try:
            shape = parking_shape.ParkingShape(
                self.bays, self.aisles, self.bay_m, self.aisle_m, self.curvature_per_m
            )
        except ValueError as error:
            raise ConfigError(f"elements.{self.name}.{error}") from error
        pose = self.pose(scene)
        parameters = cross_section.non_default_fields(shape) | self.surface_parameters()
        asset = element.parametric_id("parking_area", **parameters)
        lanes = parking_shape.parking_lanes(shape, self.name, pose)
        return road.add_street(scene, assets, self.name, asset, pose, lanes)
