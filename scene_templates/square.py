"""Squares next to roads."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import ClassVar, Literal

from pydantic import Field

from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Lane, LaneKind, Scene
from gen_data.core.se3 import SE3
from gen_data.core.variant_rng import VariantRng, variant_rng
from gen_data.scene_templates import element, horizon, road_places
from gen_data.scene_templates.road import Ground

_TREES = ("linden", "plane", "horse_chestnut")
_WALK_M = 3.0


class Square(element.Element):
    """A paved square next to a road: houses on three sides, trees, benches and a fountain.

    Sidewalks run along its houses, on which people walk; the rest is background without labels.

    Attributes:
        road: Name of the road.
        station_m: Position of its middle along the road.
        side: Side of the road, as seen along it.
        length_m: Extent along the road.
        depth_m: Extent away from the road.
        cover: Paving.
        houses: Style of the houses around it, a family ``building/<houses>``.
        season: Foliage of the trees.
        seed: Seed of houses, trees and the fountain.
    """

    related: ClassVar[tuple[str, ...]] = ("road",)

    type: Literal["square"] = "square"
    road: str = Field(examples=["main"])
    station_m: float = Field(60.0, ge=0)
    side: Literal["left", "right"] = "left"
    length_m: float = Field(40.0, ge=20, le=120)
    depth_m: float = Field(30.0, ge=15, le=120)
    cover: Ground = "cobbles"
    houses: Literal["old_town", "residential", "house", "commercial"] = "old_town"
    season: horizon.Season = "summer"
    seed: int = Field(0, ge=0, le=1_000_000)

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add the pavement, its objects and surroundings, and its sidewalks."""
        side = 1 if self.side == "left" else -1
        where = f"elements.{self.name}"
        place = road_places.find_place(scene, self.road, self.station_m, 0.5 * self.length_m, where)
        fronts: tuple[LaneKind, ...] = ("frontage",)
        land: tuple[LaneKind, ...] = ("garden",)
        scene = road_places.cut_lanes(scene, place, 0.5 * self.length_m + 12.0, fronts, self.side)
        scene = road_places.cut_lanes(scene, place, 0.5 * self.length_m, land, self.side)
        edge_m, z_m = place.edge_m(side, land=False)
        edge_m += place.sagitta_m(side, 0.5 * self.length_m)
        # X away from the road; Y along it.
        frame = place.pose(side * edge_m, z_m, side * 0.5 * math.pi)
        pad = element.parametric_id(
            "paved_area", cover=self.cover, seed=self.seed % 4, size_m=(self.depth_m, self.length_m)
        )
        middle = frame @ SE3((0.5 * self.depth_m, 0.0, 0.0))
        scene = element.add_background(scene, assets, f"{self.name}/pavement", pad, middle)
        rng = variant_rng("square", self.seed)
        things = [*self._houses(assets, rng), *self._furniture(rng)]
        for number, (asset, stand) in enumerate(things):
            pose = element.stand_upright(assets, asset, frame @ stand)
            scene = element.add_static(scene, assets, f"{self.name}/{number}", asset, pose)
        return replace(scene, lanes=(*scene.lanes, *self._walks(place, frame)))

    def _houses(self, assets: AssetIndex, rng: VariantRng) -> Iterator[tuple[str, SE3]]:
        """Houses with their fronts on the far side and on both sides of the square."""
        half = 0.5 * self.length_m
        rows = (
            (math.pi, (self.depth_m, -half), (0.0, 1.0), self.length_m),
            (0.5 * math.pi, (2.0, -half), (1.0, 0.0), self.depth_m - 2.0),
            (-0.5 * math.pi, (2.0, half), (1.0, 0.0), self.depth_m - 2.0),
        )
        for turn, (x, y), (dx, dy), reach in rows:
            at, house = 0.0, self._draw_house(rng)
            (_, y0, _), (x1, y1, _) = assets.bounds_m(house)
            while at + (y1 - y0) <= reach + 4.0:
                middle = at + 0.5 * (y1 - y0)
                stand = SE3.about_z(turn, (x + dx * middle, y + dy * middle, 0.0))
                yield house, stand @ SE3((-x1, -0.5 * (y0 + y1), 0.0))
                at, house = at + (y1 - y0), self._draw_house(rng)
                (_, y0, _), (x1, y1, _) = assets.bounds_m(house)

    def _draw_house(self, rng: VariantRng) -> str:
        return element.parametric_id(f"building/{self.houses}", seed=int(rng.between(0, 96)))

    def _furniture(self, rng: VariantRng) -> Iterator[tuple[str, SE3]]:
        """A fountain in the middle, rows of trees with benches below, lamps at the corners."""
        x, half = 0.5 * self.depth_m, 0.5 * self.length_m
        yield element.parametric_id("fountain", seed=self.seed % 6), SE3((x, 0.0, 0.0))
        species, variant = rng.choose(_TREES), int(rng.between(0, 4))
        tree = element.parametric_id(f"tree/{species}", season=self.season, seed=variant)
        bench = element.parametric_id("bench", seed=int(rng.between(0, 8)))
        for way in (-1.0, 1.0):
            for share in (-0.55, 0.0, 0.55):
                at = (x + 0.55 * share * self.depth_m, way * 0.55 * half, 0.0)
                yield tree, SE3.about_z(rng.between(0.0, math.tau), at)
            for share in (-0.27, 0.27):
                at = (x + 0.55 * share * self.depth_m, way * 0.55 * half, 0.0)
                yield bench, SE3.about_z(-way * 0.5 * math.pi, at)
            lamp = element.parametric_id("street_light", seed=self.seed % 8)
            corner = (1.5, way * (half - 1.5), 0.0)
            yield lamp, SE3.about_z(math.pi, corner)
        yield (
            element.parametric_id("advertising_column", seed=self.seed % 6),
            SE3((3.0, 0.3 * half, 0.0)),
        )

    def _walks(self, place: road_places.RoadPlace, frame: SE3) -> Iterator[Lane]:
        """Sidewalks along the houses; counter-clockwise, with the square on their left."""
        x, half = self.depth_m - _WALK_M, 0.5 * self.length_m - _WALK_M
        ends = (((1.0, -half), (x, -half)), ((x, -half), (x, half)), ((x, half), (1.0, half)))
        for number, line in enumerate(ends):
            center = tuple((frame @ SE3((a, b, 0.0))).rounded().translation_m for a, b in line)
            name = f"{self.name}/sidewalk{number}"
            yield Lane(name, "sidewalk", center, 2.0 * _WALK_M - 1.0, road=place.name)
