"""Level crossings of roads and railways."""

import math
from typing import Any, ClassVar, Literal

from pydantic import Field

from gen_data.assets.families import declared
from gen_data.core import interfaces, se3
from gen_data.core.scene import Scene
from gen_data.roads.cross_section import non_default_fields
from gen_data.scene_templates import element, road_places
from gen_data.scene_templates.road import find_road

_POST_M = 3.2
"""Distance of the barriers from the middle of the track; they stand before the stop lines."""
_HEAD_M, _GROUND_M = 0.1, -0.05
"""Height of the rails over the land, and of the ground around."""
_RAISED = (2, 5)
"""Seeds of the family ``level_crossing_barrier`` with raised booms: lanes stay free."""


class LevelCrossing(element.Element):
    """A railway across a road: panels, rails, stop lines, open barriers with lights and crosses.

    The track goes on at right angles on both sides; nothing is planted or built on it. Unlabelled.

    Attributes:
        road: Name of the road.
        station_m: Position of the track along the road.
        track_m: Length of the track on each side.
        seed: Seed of the barriers' design.
    """

    related: ClassVar[tuple[str, ...]] = ("road",)

    type: Literal["level_crossing"] = "level_crossing"
    road: str = Field(examples=["main"])
    station_m: float = Field(60.0, ge=0)
    track_m: float = Field(80.0, ge=10, le=400)
    seed: int = Field(0, ge=0, le=1_000_000)

    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add the surface as background; the track next to the road and the barriers take room."""
        where = f"elements.{self.name}"
        place = road_places.find_place(scene, self.road, self.station_m, 6.0, where)
        _, parameters, T_world_road = find_road(scene, self.road, f"{where}.road")
        scene = road_places.cut_lanes(
            scene, place, 5.0, ("verge", "furniture", "garden", "frontage", "parking")
        )
        shown = ("age_years", "carriageway", "seed", "wear")
        looks: dict[str, Any] = {k: parameters[k] for k in shown if k in parameters}
        asset = element.parametric_id(
            "level_crossing", **non_default_fields(place.shape), **looks, station_m=self.station_m
        )
        scene = element.add_background(scene, assets, f"{self.name}/panels", asset, T_world_road)
        barrier = element.parametric_id("level_crossing_barrier", seed=_RAISED[self.seed % 2])
        track = element.parametric_id("railway_track", length_m=self.track_m, seed=self.seed % 4)
        for word, side in (("left", 1), ("right", -1)):
            edge_m, edge_z_m = place.edge_m(side, land=False)
            # The ballast lies over the land next to the road, and over the ground around.
            head_m = max(edge_z_m, _GROUND_M) + _HEAD_M
            at_m = side * (edge_m + 0.5 * self.track_m)
            pose = place.pose(at_m, head_m - declared("railway_track", "rail_top_m"), 0.5 * math.pi)
            scene = element.add_static(scene, assets, f"{self.name}/track_{word}", track, pose)
            # Those who come on this side see the barrier in front of them.
            way = -1.0 if place.shape.forward(side) else 1.0
            beside_m = place.shape.carriageway_m(side) + 1.0
            foot_m = max(edge_z_m, 0.0) - 0.02
            stand = place.pose(side * beside_m, foot_m, 0.0 if way > 0.0 else math.pi)
            pose = element.stand_upright(assets, barrier, stand @ se3.SE3((_POST_M, 0.0, 0.0)))
            scene = element.add_static(scene, assets, f"{self.name}/barrier_{word}", barrier, pose)
        return scene
