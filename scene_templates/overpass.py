"""Bridges over roads."""

import math
from typing import ClassVar, Literal

from pydantic import Field

from gen_data.assets.families import declared
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Scene
from gen_data.scene_templates import element
from gen_data.scene_templates.road_places import cut_lanes, find_place

_MARGIN_M, _PIER_MEDIAN_M = 1.0, 2.0
"""Room between the road's edge and the abutments; smallest median with pillars."""


class Overpass(element.Element):
    """A bridge over a road with embankments at both ends; every lane passes beneath, unlabelled.

    Nothing is planted or built where it stands.

    Attributes:
        road: Name of the road.
        station_m: Position of its middle along the road.
        width_m: Width of the bridge.
        clearance_m: Height of its underside: 4.5 m for vehicles of 4 m, and a reserve.
        kind: A slab of concrete, or girders of steel as under railways.
        ramp_m: Length of the embankments.
        seed: Seed of its colours.
    """

    related: ClassVar[tuple[str, ...]] = ("road",)

    type: Literal["overpass"] = "overpass"
    road: str = Field(examples=["main"])
    station_m: float = Field(60.0, ge=0)
    width_m: float = Field(10.0, ge=3, le=40)
    clearance_m: float = Field(4.7, ge=3, le=12)
    kind: Literal["concrete", "steel"] = "concrete"
    ramp_m: float = Field(45.0, ge=5, le=200)
    seed: int = Field(0, ge=0, le=1_000_000)

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add the deck as background, and the ends, which take room."""
        half_m = 0.5 * self.width_m + 1.0
        place = find_place(scene, self.road, self.station_m, half_m, f"elements.{self.name}")
        height_m = self.clearance_m + declared("overpass", "depths_m")[self.kind]
        scene = cut_lanes(scene, place, half_m + 4.0, ("verge", "furniture"))
        scene = cut_lanes(
            scene, place, half_m + declared("overpass", "slope") * height_m, ("garden", "frontage")
        )
        left, right = (place.edge_m(side, land=False)[0] + _MARGIN_M for side in (1, -1))
        pier = place.shape.median_m >= _PIER_MEDIAN_M and left == right
        deck = element.parametric_id(
            "overpass", clearance_m=self.clearance_m, kind=self.kind, pier=float(pier),
            seed=self.seed % 4, span_m=round(left + right, 3), width_m=self.width_m,
        )  # fmt: skip
        middle = place.pose(0.5 * (left - right))
        scene = element.add_background(scene, assets, f"{self.name}/deck", deck, middle)
        end = element.parametric_id(
            "embankment", height_m=round(height_m, 3), length_m=self.ramp_m,
            seed=self.seed % 4, width_m=self.width_m,
        )  # fmt: skip
        for word, t_m, turn in (("left", left, 0.5), ("right", -right, -0.5)):
            pose = place.pose(t_m, -0.1, turn * math.pi)
            scene = element.add_static(scene, assets, f"{self.name}/{word}", end, pose)
        return scene
