"""Roundabouts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any, Literal

from pydantic import Field

from gen_data.generator.core.errors import ConfigError
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import Scene
from gen_data.generator.core.se3 import SE3
from gen_data.generator.roads.cross_section import non_default_fields
from gen_data.generator.roads.junction_shape import ABSENT
from gen_data.generator.roads.roundabout_shape import RoundaboutShape, roundabout_lanes
from gen_data.scene_templates.element import Element, level_pose, name_relations, parametric_id
from gen_data.scene_templates.road import RoadSurface, add_street, find_port

_SPARE_RAD = math.radians(4.0)


class Roundabout(RoadSurface, Element):
    """A roundabout of one lane; roads of one lane per direction start at ``<name>/<arm>``.

    Vehicles wait for each other as at a junction without signs, not only for those on the ring.

    Attributes:
        after: Name of the road whose end meets the arm at 180 degrees; empty = use ``at_m``.
        at_m: Position of its centre (x, y); an optional third number is the height.
        yaw_deg: Rotation about the vertical.
        arms_deg: Directions of its three or four arms, ascending from 0; arm 0 is the first.
        diameter_m: Outer diameter of the ring.
        ring_m: Width of the ring, with the truck apron.
        truck_apron_m: Width of the rough inner part of the ring; 0 = none.
        lane_width_m: Width of each lane of the arms.
        sidewalk_m: Width of the sidewalks; 0 = none.
        beside_m: Width between kerb and sidewalk, to match roads with verges or parking strips.
        setback_m: Width of the land between sidewalk and house fronts, to match that of the roads.
        kerb_m: Height of the kerbs.
        radius_m: Radius of the kerb at the corners.
        splitters: Whether raised islands part the lanes of every arm.
        crown: Cross slope of the arms, from their middle to their gutters.
        traffic: Side on which vehicles drive.
        crossings: Style of the crosswalks.
        speed_m_s: Usual speed on the ring.
    """

    type: Literal["roundabout"] = "roundabout"
    after: str = ""
    at_m: tuple[float, float] | tuple[float, float, float] = (0.0, 0.0)
    yaw_deg: float = 0.0
    arms_deg: tuple[float, float, float] | tuple[float, float, float, float] = (
        0.0, 90.0, 180.0, 270.0,
    )  # fmt: skip
    diameter_m: float = Field(30.0, ge=22, le=80)
    ring_m: float = Field(7.0, ge=4, le=12)
    truck_apron_m: float = Field(1.6, ge=0, le=4)
    lane_width_m: float = Field(3.5, ge=2.5, le=5)
    sidewalk_m: float = Field(2.5, ge=0, le=10)
    beside_m: float = Field(0.0, ge=0, le=10)
    setback_m: float = Field(0.0, ge=0, le=50)
    kerb_m: float = Field(0.12, ge=0, le=0.3)
    radius_m: float = Field(12.0, ge=6, le=40)
    splitters: bool = True
    crown: float = Field(0.02, ge=0, le=0.08)
    traffic: Literal["right", "left"] = "right"
    crossings: Literal["zebra", "ladder", "lines", "none"] = "zebra"
    speed_m_s: float = Field(7.0, ge=0, le=30)

    @property
    def relations(self) -> Mapping[str, str]:
        """The road that leads to it."""
        return name_relations(after=self.after)

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add the roundabout as background, and link its lanes to the roads that it meets."""
        shape = self.shape()
        pose = self._find_pose(scene, shape)
        given: dict[str, Any] = {} if self.crossings == "zebra" else {"crossings": self.crossings}
        asset = parametric_id(
            "roundabout", **non_default_fields(shape), **given, **self.surface_parameters()
        )
        lanes = roundabout_lanes(shape, self.name, pose, self.speed_m_s, self.crossings != "none")
        return add_street(scene, assets, self.name, asset, pose, lanes)

    def shape(self) -> RoundaboutShape:
        """Return its shape. Raises ConfigError if ring, arms or corners are impossible."""
        where = f"elements.{self.name}"
        arms = self.arms_deg
        if not all(a < b for a, b in pairwise(arms)) or arms[0] < 0.0 or arms[-1] >= 360.0:
            raise ConfigError(
                f"{where}.arms_deg: expected ascending directions from 0 to below 360"
            )
        shape = RoundaboutShape(
            (*arms[:3], arms[3] if len(arms) == 4 else ABSENT), self.lane_width_m, self.kerb_m,
            self.sidewalk_m, self.beside_m, self.radius_m, self.crown, self.traffic,
            self.diameter_m, self.ring_m, self.truck_apron_m, float(self.splitters),
            self.setback_m,
        )  # fmt: skip
        if self.ring_m < self.truck_apron_m + self.lane_width_m or shape.island_m < 2.0:
            raise ConfigError(
                f"{where}.ring_m: {self.ring_m:g} m; expected {self.truck_apron_m:g} m of truck "
                f"apron and at least {self.lane_width_m:g} m beside it, and an island of at least "
                f"4 m within a diameter of {self.diameter_m:g} m"
            )
        if self.sidewalk_m > 0.0 and self.radius_m < shape.border_m + 0.5:
            raise ConfigError(
                f"{where}.radius_m: {self.radius_m:g} m is too tight for the sidewalk; "
                f"expected at least {shape.border_m + 0.5:.2f}"
            )
        needed = 2.0 * shape.mouth_rad() + _SPARE_RAD
        if min(shape.gaps_rad()) < needed:
            raise ConfigError(
                f"{where}.arms_deg: neighbouring arms are "
                f"{math.degrees(min(shape.gaps_rad())):.0f} degrees apart; expected at least "
                f"{math.degrees(needed):.0f}, or a larger diameter_m or a smaller radius_m"
            )
        return shape

    def _find_pose(self, scene: Scene, shape: RoundaboutShape) -> SE3:
        if not self.after:
            return level_pose(self.at_m, self.yaw_deg)
        if 180.0 not in self.arms_deg:
            raise ConfigError(
                f"elements.{self.name}.after: no arm points at the road; expected 180 in arms_deg"
            )
        return find_port(scene, self.after, f"elements.{self.name}.after") @ SE3(
            (shape.reach_m(), 0.0, 0.0)
        )
