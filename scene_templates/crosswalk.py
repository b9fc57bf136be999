"""Pedestrian crossings."""

from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from gen_data.core import errors, interfaces
from gen_data.core.scene import Lane, Scene
from gen_data.roads.cross_section import height_m, non_default_fields
from gen_data.roads.lane_graph import world_points
from gen_data.scene_templates.element import Element, parametric_id
from gen_data.scene_templates.road import add_street, find_road


class Crosswalk(Element):
    """A zebra crossing on a road.

    Attributes:
        road: Name of the road.
        station_m: Position of its centre along the road.
        width_m: Width along the road: the length of its bars.
        style: Bars, or a ladder: bars between two lines.
    """

    related: ClassVar[tuple[str, ...]] = ("road",)

    type: Literal["crosswalk"] = "crosswalk"
    road: str = Field(examples=["main"])
    station_m: float = Field(40.0, ge=0)
    width_m: float = Field(4.0, ge=1.5, le=20)
    style: Literal["zebra", "ladder"] = "zebra"

    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add the markings on the road, and the lane of the pedestrians."""
        where = f"elements.{self.name}"
        shape, parameters, T_world_road = find_road(scene, self.road, f"{where}.road")
        if not 0.5 * self.width_m <= self.station_m <= shape.length_m - 0.5 * self.width_m:
            raise errors.ConfigError(
                f"{where}.station_m: {self.station_m:g} is not on '{self.road}', which is "
                f"{shape.length_m:g} m long"
            )
        # The surface around its bars is the road's.
        shown = ("age_years", "carriageway", "seed", "wear")
        looks: dict[str, Any] = {k: parameters[k] for k in shown if k in parameters}
        looks |= {"station_m": self.station_m, "width_m": self.width_m}
        looks |= {} if self.style == "zebra" else {"style": self.style}
        asset = parametric_id("crosswalk", **non_default_fields(shape), **looks)
        t = np.linspace(-shape.carriageway_m(-1), shape.carriageway_m(1), 7)
        flat = shape.line().points(np.full(7, self.station_m), t)
        center = world_points(np.column_stack([flat, height_m(shape, t)]), T_world_road)
        lane = Lane(f"{self.name}/crosswalk", "crosswalk", center, self.width_m, road=self.road)
        return add_street(scene, assets, self.name, asset, T_world_road, (lane,))
