"""Intersections: the common part of junctions and roundabouts."""

from abc import abstractmethod
from itertools import pairwise
from typing import Any, ClassVar, Literal

from pydantic import Field

from gen_data.core import errors, interfaces, se3
from gen_data.core.scene import Lane, Scene
from gen_data.roads.cross_section import non_default_fields
from gen_data.roads.junction_shape import ABSENT, JunctionShape
from gen_data.roads.roundabout_shape import RoundaboutShape
from gen_data.scene_templates import element, road

Shape = JunctionShape | RoundaboutShape


class Intersection(road.RoadSurface, element.Element):
    """A level intersection of three or four arms, at whose ends roads start.

    Attributes:
        after: Name of the road whose end meets the arm at 180 degrees; empty = use ``at_m``.
        at_m: Position of its centre (x, y); an optional third number is the height.
        yaw_deg: Rotation about the vertical.
        arms_deg: Directions of its three or four arms, ascending from 0; arm 0 is the first.
        sidewalk_m: Width of the sidewalks; 0 = none.
        beside_m: Width between kerb and sidewalk, to match roads with verges or parking strips.
        setback_m: Width of the land between sidewalk and house fronts, to match the roads'.
        kerb_m: Height of the kerbs.
        radius_m: Radius of the kerb at the corners.
        crown: Cross slope of the arms, from their middle to their gutters.
        traffic: Side on which vehicles drive.
        crossings: Style of the crosswalks; lines as at traffic lights, a ladder has bars and lines.
    """

    related: ClassVar[tuple[str, ...]] = ("after",)

    FAMILY: ClassVar[str]
    """Family of its surface."""

    after: str = ""
    at_m: tuple[float, float] | tuple[float, float, float] = (0.0, 0.0)
    yaw_deg: float = 0.0
    arms_deg: tuple[float, float, float] | tuple[float, float, float, float] = (
        0.0, 90.0, 180.0, 270.0,
    )  # fmt: skip
    sidewalk_m: float = Field(2.5, ge=0, le=20)
    beside_m: float = Field(0.0, ge=0, le=10)
    setback_m: float = Field(0.0, ge=0, le=50)
    kerb_m: float = Field(0.12, ge=0, le=0.3)
    radius_m: float = Field(7.0, ge=1, le=50)
    crown: float = Field(0.025, ge=0, le=0.08)
    traffic: Literal["right", "left"] = "right"
    crossings: Literal["zebra", "ladder", "lines", "none"] = "zebra"

    @abstractmethod
    def shape(self) -> Shape:
        """Return its shape. Raises ConfigError if the arms or the corners are impossible."""

    @abstractmethod
    def _lanes(self, T_world_body: se3.SE3) -> tuple[Lane, ...]:
        """All lanes, in the world."""

    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add it as background, and link its lanes to the roads that it meets."""
        shape = self.shape()
        pose = self._find_pose(scene, shape)
        given: dict[str, Any] = {} if self.crossings == "zebra" else {"crossings": self.crossings}
        asset = element.parametric_id(
            self.FAMILY, **non_default_fields(shape), **given, **self.surface_parameters()
        )
        return road.add_street(scene, assets, self.name, asset, pose, self._lanes(pose))

    def arms(self) -> tuple[float, float, float, float]:
        """Directions of four arms; ``ABSENT`` for a missing one.

        Raises:
            ConfigError: they do not ascend.
        """
        arms = self.arms_deg
        if not all(a < b for a, b in pairwise(arms)) or arms[0] < 0.0 or arms[-1] >= 360.0:
            raise errors.ConfigError(
                f"elements.{self.name}.arms_deg: expected ascending directions from 0 to below 360"
            )
        first, second, third = arms[:3]
        return (first, second, third, arms[3] if len(arms) == 4 else ABSENT)

    def check_corners(self, shape: Shape) -> None:
        """Raise ConfigError if the sidewalk does not fit around the corners."""
        if self.sidewalk_m > 0.0 and self.radius_m < shape.border_m + 0.5:
            raise errors.ConfigError(
                f"elements.{self.name}.radius_m: {self.radius_m:g} m is too tight for the "
                f"sidewalk; expected at least {shape.border_m + 0.5:.2f}"
            )

    def _find_pose(self, scene: Scene, shape: Shape) -> se3.SE3:
        if not self.after:
            return element.level_pose(self.at_m, self.yaw_deg)
        if 180.0 not in self.arms_deg:
            raise errors.ConfigError(
                f"elements.{self.name}.after: no arm points at the road; expected 180 in arms_deg"
            )
        return road.find_port(scene, self.after, f"elements.{self.name}.after") @ se3.SE3(
            (shape.reach_m(), 0.0, 0.0)
        )
