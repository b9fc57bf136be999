"""Overhead lines of tramways along roads."""

import math
from typing import ClassVar, Literal

from pydantic import Field

from gen_data.core import errors, interfaces
from gen_data.core.scene import Scene
from gen_data.roads.cross_section import KERB_WIDTH_M, RoadShape, strips
from gen_data.scene_templates import element, road_places
from gen_data.scene_templates.road import find_road

BEHIND_KERB_M = 0.4
"""Distance of poles from the kerb."""


class TramLine(element.Element):
    """Contact wires over the tracks of a straight road with ``tram: true``; unlabelled.

    Cross wires between poles at both kerbs hold them. Poles take room, wires do not.

    Attributes:
        road: Name of the road.
        span_m: Distance between poles.
        seed: Seed of the poles.
    """

    related: ClassVar[tuple[str, ...]] = ("road",)

    type: Literal["tram_line"] = "tram_line"
    road: str = Field(examples=["main"])
    span_m: float = Field(30.0, ge=10, le=60)
    seed: int = Field(0, ge=0, le=1_000_000)

    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add wires and poles. Raises ConfigError if the road bends or has no track."""
        where = f"elements.{self.name}"
        shape, parameters, T_world_road = find_road(scene, self.road, f"{where}.road")
        bends = any(shape.curvature_range(0.0, shape.length_m))
        if bends or not parameters.get("tram"):
            fact = "bends" if bends else "has no track"
            raise errors.ConfigError(
                f"{where}.road: '{self.road}' {fact}; expected a straight road with tram: true"
            )
        away_m = {side: _pole_m(shape, side) for side in (1, -1)}
        tracks_m = 0.5 * (shape.median_m + shape.lane_width_m)
        count = max(1, round(shape.length_m / self.span_m))
        wires = element.parametric_id(
            "contact_wires", span_m=round(shape.length_m / count, 6), left_m=away_m[1],
            right_m=away_m[-1], tracks_m=round(tracks_m, 6),
        )  # fmt: skip
        pole = element.parametric_id("tram_pole", seed=self.seed % 4)
        for number in range(count):
            at_m = shape.length_m * (number + 0.5) / count
            place = road_places.RoadPlace(self.road, shape, T_world_road, at_m)
            name = f"{self.name}/{number}"
            scene = element.add_background(scene, assets, f"{name}/wires", wires, place.pose(0.0))
            for word, side in (("left", 1), ("right", -1)):
                z_m = place.edge_m(side, land=False)[1] - 0.05
                pose = place.pose(side * away_m[side], z_m, side * 0.5 * math.pi)
                scene = element.add_static(scene, assets, f"{name}/pole_{word}", pole, pose)
        return scene


def _pole_m(shape: RoadShape, side: int) -> float:
    """Distance of the poles of a side from the middle of the road."""
    beyond = [s for s in strips(shape, side) if s.kind in ("verge", "sidewalk")]
    edge_m = beyond[0].inner_m if beyond else shape.carriageway_m(side) + KERB_WIDTH_M
    return round(edge_m + BEHIND_KERB_M, 6)
