"""Petrol stations next to roads."""

import math
from dataclasses import replace
from typing import ClassVar, Literal

from pydantic import Field

from gen_data.assets.families import declared
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import LaneKind, Scene
from gen_data.core.se3 import SE3
from gen_data.core.variant_rng import variant_rng
from gen_data.roads.cross_section import strips
from gen_data.scene_templates import element
from gen_data.scene_templates.road_places import RoadPlace, cut_lanes, find_place

LENGTH_M, DEPTH_M = 38.0, 30.0
"""Extent of the forecourt along the road and away from it (assumed, 20 %)."""
_CANOPY_M, _SHOP_M = 10.5, 24.0
"""Distances of the middles of canopy and shop from the road's edge."""
_DRIVEWAYS_M, _DRIVEWAY_M = (-12.5, 12.5), 6.5
"""Places of the driveways along the road, and their width (assumed, 20 %)."""
_BESIDE_M, _CARS = 1.75, 124
"""Distance of a car that is filled up from the middle of its island; variants of cars."""


class PetrolStation(element.Element):
    """A forecourt next to a road with a canopy over pumps, a shop and a price sign.

    It takes the place of houses, gardens and trees there; the road stays as it is. Two driveways
    cross the kerb and the sidewalk. Only cars at the pumps have labels.

    Attributes:
        road: Name of the road.
        station_m: Position of its middle along the road.
        side: Side of the road, as seen along it.
        cars: Probability that a car stands at an island of pumps.
        seed: Seed of the brand, of all parts and of the cars.
    """

    related: ClassVar[tuple[str, ...]] = ("road",)

    type: Literal["petrol_station"] = "petrol_station"
    road: str = Field(examples=["main"])
    station_m: float = Field(60.0, ge=0)
    side: Literal["left", "right"] = "right"
    cars: float = Field(0.5, ge=0, le=1)
    seed: int = Field(0, ge=0, le=1_000_000)

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
        pad = element.parametric_id(
            "paved_area", cover="asphalt", seed=self.seed % 4, size_m=(DEPTH_M, LENGTH_M)
        )
        at = SE3((0.5 * DEPTH_M, 0.0, 0.0))
        scene = element.add_background(scene, assets, f"{self.name}/forecourt", pad, frame @ at)
        parts = (
            ("canopy", "petrol_canopy", SE3((_CANOPY_M, 0.0, 0.0))),
            ("shop", "petrol_shop", SE3.about_z(math.pi, (_SHOP_M, 0.0, 0.0))),
            ("sign", "price_sign", SE3.about_z(0.5 * math.pi, (1.6, 0.4 * LENGTH_M, 0.0))),
        )
        for word, family, stand in parts:
            asset = element.parametric_id(family, seed=brand)
            pose = element.stand_upright(assets, asset, frame @ stand)
            scene = element.add_static(scene, assets, f"{self.name}/{word}", asset, pose)
        scene = self._add_driveways(scene, assets, place, side, max(z_m, -0.02) + 0.02)
        return self._add_cars(scene, assets, frame @ SE3((_CANOPY_M, 0.0, 0.0)), brand)

    def _add_driveways(
        self, scene: Scene, assets: AssetIndex, place: RoadPlace, side: int, rise_m: float
    ) -> Scene:
        """Add asphalt from the gutter to the forecourt, ``rise_m`` above the gutter."""
        foot_m = place.shape.carriageway_m(side)
        row = [s for s in strips(place.shape, side) if s.kind == "kerb"]
        kerb_m = row[-1].outer_z_m - row[-1].inner_z_m if row else 0.0
        for number, along in enumerate(_DRIVEWAYS_M):
            here = replace(place, station_m=place.station_m + along)
            edge_m = place.edge_m(side, land=False)[0] + place.sagitta_m(side, 0.5 * LENGTH_M)
            # On the inside of bends the road comes nearer to the forecourt's edge.
            bent_m = place.sagitta_m(side, abs(along)) - place.sagitta_m(-side, abs(along))
            asset = element.parametric_id(
                "driveway", seed=self.seed % 4, width_m=_DRIVEWAY_M,
                depth_m=round(edge_m - foot_m - min(bent_m, edge_m - foot_m - 0.5) + 0.3, 3),
                kerb_m=round(kerb_m, 4), rise_m=round(rise_m, 4),
            )  # fmt: skip
            pose = here.pose(side * foot_m, 0.0, side * 0.5 * math.pi)
            scene = element.add_background(
                scene, assets, f"{self.name}/driveway{number}", asset, pose
            )
        return scene

    def _add_cars(self, scene: Scene, assets: AssetIndex, T_world_canopy: SE3, brand: int) -> Scene:
        """Add cars next to the islands, their fronts to or from the shop."""
        rng = variant_rng("petrol_station/cars", self.seed)
        for number, y in enumerate(declared("petrol_canopy", "islands_m")(brand)):
            here = rng.chance(self.cars)
            at = SE3.about_z(math.pi * (rng.random() < 0.5), (rng.between(-1.4, 1.4), y + _BESIDE_M,
                             0.0))  # fmt: skip
            asset = element.parametric_id("car", seed=int(rng.between(0, _CARS)))
            if here:
                pose = element.stand_upright(assets, asset, T_world_canopy @ at)
                name = f"{self.name}/car{number}"
                scene = element.add_static(scene, assets, name, asset, pose, annotated=True)
        return scene
