"""Petrol stations beside roads."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal

from pydantic import Field

from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import LaneKind, Scene
from gen_data.generator.core.se3 import SE3
from gen_data.scene_templates.element import (
    Element,
    add_background,
    add_static,
    name_relations,
    parametric_id,
    stand_upright,
)
from gen_data.scene_templates.road_places import cut_lanes, find_place

LENGTH_M, DEPTH_M = 38.0, 30.0
"""Extent of the forecourt along the road and away from it (assumed, 20 %)."""
_CANOPY_M, _SHOP_M = 10.5, 24.0
"""Distances of the middles of canopy and shop from the road's edge."""


class PetrolStation(Element):
    """A forecourt beside a road with a canopy over pumps, a shop and a price sign; unlabelled.

    It takes the place of houses, gardens and trees there; the road stays as it is.

    Attributes:
        road: Name of the road.
        station_m: Position of its middle along the road.
        side: Side of the road, as seen along it.
        seed: Seed of the brand and of all parts.
    """

    type: Literal["petrol_station"] = "petrol_station"
    road: str = Field(examples=["main"])
    station_m: float = Field(60.0, ge=0)
    side: Literal["left", "right"] = "right"
    seed: int = Field(0, ge=0, le=1_000_000)

    @property
    def relations(self) -> Mapping[str, str]:
        """The road."""
        return name_relations(road=self.road)

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add the forecourt as background; canopy, shop and sign take room."""
        where, side = f"elements.{self.name}", 1 if self.side == "left" else -1
        place = find_place(scene, self.road, self.station_m, 0.5 * LENGTH_M, where)
        kinds: tuple[LaneKind, ...] = ("garden", "frontage", "verge", "furniture", "parking")
        scene = cut_lanes(scene, place, 0.5 * LENGTH_M, kinds, self.side)
        edge_m, z_m = place.edge_m(side, land=False)
        edge_m += place.sagitta_m(side, 0.5 * LENGTH_M)
        # X away from the road; Y along it.
        frame = place.pose(side * edge_m, max(z_m, -0.02) + 0.02, side * 0.5 * math.pi)
        brand = self.seed % 4
        pad = parametric_id(
            "paved_area", cover="asphalt", seed=self.seed % 4, size_m=(DEPTH_M, LENGTH_M)
        )
        at = SE3((0.5 * DEPTH_M, 0.0, 0.0))
        scene = add_background(scene, assets, f"{self.name}/forecourt", pad, frame @ at)
        parts = (
            ("canopy", "petrol_canopy", SE3((_CANOPY_M, 0.0, 0.0))),
            ("shop", "petrol_shop", SE3.about_z(math.pi, (_SHOP_M, 0.0, 0.0))),
            ("sign", "price_sign", SE3.about_z(0.5 * math.pi, (1.6, 0.4 * LENGTH_M, 0.0))),
        )
        for word, family, stand in parts:
            asset = parametric_id(family, seed=brand)
            pose = stand_upright(assets, asset, frame @ stand)
            scene = add_static(scene, assets, f"{self.name}/{word}", asset, pose)
        return scene
