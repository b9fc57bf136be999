"""Fields next to a road."""

import math
from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Body, Scene
from gen_data.core.se3 import SE3
from gen_data.core.variant_rng import variant_rng
from gen_data.roads.cross_section import RoadShape, non_default_fields, strips
from gen_data.roads.fields_shape import FieldsShape, Parcel
from gen_data.scene_templates.element import Element, add_background, parametric_id
from gen_data.scene_templates.road import find_road

Crop = Literal[
    "maize", "wheat", "rape", "stubble", "furrows", "potatoes", "seedlings", "meadow"
]  # fmt: skip

_LIFT_M, _LOWEST_M = 0.05, -0.05
"""Fields lie this far over the land next to the road, and never below the ground around."""
_BALE_PITCH_M, _BALE_KINDS, _REACH_M = 17.0, 6, 60.0
"""Distance between bales: one per 290 m^2 gives the 35 per hectare of straw that balers report
(assumed, 30 %); variants; farther bales would be a few pixels high."""
_MOWN = ("stubble", "meadow")


class Fields(Element):
    """Parcels of crops on both sides of a road, with bales; background, without labels.

    Standing crops are maize, wheat and rape; others lie flat.

    Attributes:
        road: Name of the road.
        sides: Sides of the road to cover, as seen along it.
        crops: Crops to choose from for every parcel.
        gap_m: Distance between the road's outer edge, land before houses included, and the fields.
        depth_m: Width of the fields across the road.
        bales: Share of the stubble fields and meadows on which bales lie.
        seed: Seed of parcels, crops and bales.
    """

    related: ClassVar[tuple[str, ...]] = ("road",)

    type: Literal["fields"] = "fields"
    road: str = Field(examples=["main"])
    sides: tuple[Literal["left", "right"], ...] = Field(("left", "right"), min_length=1)
    crops: tuple[Crop, ...] = Field(("maize", "wheat", "meadow"), min_length=1)
    gap_m: float = Field(1.0, ge=0, le=50)
    depth_m: float = Field(75.0, ge=10, le=300)
    bales: float = Field(0.5, ge=0, le=1)
    seed: int = Field(0, ge=0, le=1_000_000)

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add one body per side, and the bales."""
        road, _, T_world_road = find_road(scene, self.road, f"elements.{self.name}.road")
        for word in dict.fromkeys(self.sides):
            side = 1 if word == "left" else -1
            shape, z_m = self._lay_out(road, side)
            pose = T_world_road @ SE3((0.0, 0.0, z_m))
            asset = parametric_id("fields", **non_default_fields(shape))
            scene = add_background(scene, assets, f"{self.name}/{word}", asset, pose)
            scene = self._add_bales(scene, assets, shape, pose, word)
        return scene

    def _lay_out(self, road: RoadShape, side: int) -> tuple[FieldsShape, float]:
        """The fields of one side and their height. Raises ConfigError if the bend is too tight."""
        row = strips(road, side)
        edge_m, edge_z_m = (row[-1].outer_m, row[-1].outer_z_m) if row else (0.0, 0.0)
        shape = FieldsShape(
            road.length_m, road.curvature_per_m, float(side), round(edge_m + self.gap_m, 6),
            self.depth_m, "_".join(self.crops), self.seed, road.bends,
        )  # fmt: skip
        reach_m = shape.inner_m + shape.depth_m
        low, high = road.curvature_range(0.0, road.length_m)
        inner = high if side > 0 else -low
        if inner * reach_m >= 0.95:
            raise ConfigError(
                f"elements.{self.name}.depth_m: fields of {self.depth_m:g} m would meet inside "
                f"the bend of '{self.road}', whose radius is {1 / inner:.0f} m"
            )
        return shape, round(max(edge_z_m, _LOWEST_M) + _LIFT_M, 6)

    def _add_bales(
        self, scene: Scene, assets: AssetIndex, shape: FieldsShape, T_world_field: SE3, word: str
    ) -> Scene:
        rng = variant_rng(f"fields/bales/{word}", self.seed)
        bodies: list[Body] = []
        for parcel in shape.parcels():
            if parcel.crop not in _MOWN or not rng.chance(self.bales):
                continue
            asset = parametric_id("straw_bale", seed=int(rng.between(0, _BALE_KINDS)))
            assets.get(asset)
            for s, away in _bale_places(parcel, shape.depth_m):
                at = np.array([s + rng.between(-3.0, 3.0)]), np.array([away + rng.between(-4, 4)])
                x, y = shape.points(*at)[0].tolist()
                pose = T_world_field @ SE3.about_z(rng.between(0.0, math.tau), (x, y, 0.0))
                name = f"{self.name}/bale_{word}{len(bodies)}"
                bodies.append(Body(name, asset, pose.rounded()))
        return replace(scene, bodies=(*scene.bodies, *bodies))


def _bale_places(parcel: Parcel, depth_m: float) -> list[tuple[float, float]]:
    """Arc lengths and distances of bales on a parcel, before they are moved a little."""
    s = np.arange(parcel.start_m + 8.0, parcel.end_m - 6.0, _BALE_PITCH_M)
    away = np.arange(9.0, min(_REACH_M, depth_m - 5.0), _BALE_PITCH_M)
    return [(float(a), float(b)) for a in s for b in away]
