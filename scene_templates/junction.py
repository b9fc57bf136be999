"""Road junctions."""

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
from gen_data.generator.roads.junction_shape import ABSENT, JunctionShape, junction_lanes
from gen_data.scene_templates.element import Element, level_pose, name_relations, parametric_id
from gen_data.scene_templates.road import RoadSurface, add_street, find_port


class Junction(RoadSurface, Element):
    """A level junction with rounded corners; roads start at its arms with ``after: <name>/<arm>``.

    Attributes:
        after: Name of the road whose end meets the arm at 180 degrees; empty = use ``at_m``.
        at_m: Position of its centre (x, y); an optional third number is the height.
        yaw_deg: Rotation about the vertical.
        arms_deg: Directions of its three or four arms, ascending from 0; arm 0 is the first.
        lanes: Number of lanes per arm and direction.
        lane_width_m: Width of each lane.
        sidewalk_m: Width of the sidewalks; 0 = none.
        beside_m: Width between kerb and sidewalk, to match roads with verges or parking strips.
        setback_m: Width of the land between sidewalk and house fronts, to match that of the roads.
        kerb_m: Height of the kerbs.
        radius_m: Radius of the kerb at the corners.
        crown: Cross slope of the arms, from their middle to their gutters.
        traffic: Side on which vehicles drive.
        crossings: Style of the crosswalks; lines as at traffic lights, a ladder has bars and lines.
        speed_m_s: Usual speed of crossing vehicles.
    """

    type: Literal["junction"] = "junction"
    after: str = ""
    at_m: tuple[float, float] | tuple[float, float, float] = (0.0, 0.0)
    yaw_deg: float = 0.0
    arms_deg: tuple[float, float, float] | tuple[float, float, float, float] = (
        0.0, 90.0, 180.0, 270.0,
    )  # fmt: skip
    lanes: int = Field(1, ge=1, le=4)
    lane_width_m: float = Field(3.5, ge=2, le=6)
    sidewalk_m: float = Field(2.5, ge=0, le=20)
    beside_m: float = Field(0.0, ge=0, le=10)
    setback_m: float = Field(0.0, ge=0, le=50)
    kerb_m: float = Field(0.12, ge=0, le=0.3)
    radius_m: float = Field(7.0, ge=1, le=50)
    crown: float = Field(0.02, ge=0, le=0.08)
    traffic: Literal["right", "left"] = "right"
    crossings: Literal["zebra", "ladder", "lines", "none"] = "zebra"
    speed_m_s: float = Field(8.0, ge=0, le=60)

    @property
    def relations(self) -> Mapping[str, str]:
        """The road that leads to it."""
        return name_relations(after=self.after)

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add the junction as background, and link its lanes to the roads that it meets."""
        shape = self.shape()
        pose = self._find_pose(scene, shape)
        given: dict[str, Any] = {} if self.crossings == "zebra" else {"crossings": self.crossings}
        asset = parametric_id(
            "junction", **non_default_fields(shape), **given, **self.surface_parameters()
        )
        lanes = junction_lanes(shape, self.name, pose, self.speed_m_s, self.crossings != "none")
        return add_street(scene, assets, self.name, asset, pose, lanes)

    def shape(self) -> JunctionShape:
        """Return its shape. Raises ConfigError if the arms or the corners are impossible."""
        where = f"elements.{self.name}"
        arms = self.arms_deg
        first, second, third = arms[:3]
        fourth = arms[3] if len(arms) == 4 else ABSENT
        shape = JunctionShape(
            (first, second, third, fourth), self.lanes, self.lane_width_m, self.kerb_m,
            self.sidewalk_m, self.beside_m, self.radius_m, self.crown, self.traffic,
            self.setback_m,
        )  # fmt: skip
        rising = all(a < b for a, b in pairwise(arms))
        gaps = shape.gaps_rad()
        if not rising or arms[0] < 0.0 or arms[-1] >= 360.0:
            raise ConfigError(
                f"{where}.arms_deg: expected ascending directions from 0 to below 360"
            )
        if min(gaps) < math.radians(40.0) or max(gaps) > math.pi + 1e-3:
            raise ConfigError(
                f"{where}.arms_deg: neighbouring arms must be 40 to 180 degrees apart; "
                f"found {math.degrees(min(gaps)):.0f} to {math.degrees(max(gaps)):.0f}"
            )
        if self.sidewalk_m > 0.0 and self.radius_m < shape.border_m + 0.5:
            raise ConfigError(
                f"{where}.radius_m: {self.radius_m:g} m is too tight for the sidewalk; "
                f"expected at least {shape.border_m + 0.5:.2f}"
            )
        return shape

    def _find_pose(self, scene: Scene, shape: JunctionShape) -> SE3:
        if not self.after:
            return level_pose(self.at_m, self.yaw_deg)
        if 180.0 not in self.arms_deg:
            raise ConfigError(
                f"elements.{self.name}.after: no arm points at the road; expected 180 in arms_deg"
            )
        return find_port(scene, self.after, f"elements.{self.name}.after") @ SE3(
            (shape.reach_m(), 0.0, 0.0)
        )
