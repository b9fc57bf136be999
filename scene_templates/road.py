"""Roads, and the lanes on and next to them."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from typing import Any, ClassVar, Literal, TypeVar

import numpy as np
from pydantic import Field

from gen_data.assets.asset_ids import parse_asset_id
from gen_data.config.base_model import Strict
from gen_data.core.errors import ConfigError, did_you_mean
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Lane, Scene
from gen_data.core.se3 import SE3
from gen_data.roads import alignment
from gen_data.roads.cross_section import RoadShape, non_default_fields, strips
from gen_data.roads.junction_shape import JunctionShape, arm_pose
from gen_data.roads.lane_graph import link_lanes, road_lanes
from gen_data.roads.roundabout_shape import RoundaboutShape
from gen_data.scene_templates.element import (
    Element,
    add_background,
    level_pose,
    parametric_id,
)

T = TypeVar("T")
Width = float
PARKING_M = {"none": 0.0, "parallel": 2.2, "angled": 5.58, "perpendicular": 5.0}
"""Width of a parking strip: at least 2.00 m along the kerb (RASt 06, by stvo2go.de); bays of 2.50 m
x 5.00 m, 0.70 m of it over the kerb (RAR, by sicherestrassen.de)."""
TURN_LANE_M = 2.5
"""Smallest width of a lane for turning vehicles (assumed, 10 %)."""
BAY_ANGLE_DEG = {"none": 0.0, "parallel": 0.0, "angled": 60.0, "perpendicular": 90.0}

Rails = bool | Literal["bends"]
Ground = Literal["grass", "paving", "cobbles", "gravel", "earth", "asphalt"]
Parking = bool | Literal["none", "parallel", "angled", "perpendicular"]

_RAILS = {False: 0.0, True: 1.0, "bends": 2.0}


class RoadSurface(Strict):
    """Surfaces of roads, junctions and parking areas.

    Attributes:
        wear: Wear from 0, new, to 1, worn out: ruts, patches, sealed cracks, flaking paint.
        paving: Material of the sidewalks.
        ground: Material of the land on its sides.
        carriageway: Material of the driven surface; gravel and earth have no markings.
        age_years: Age of the driven surface: asphalt turns from dark to grey; -1 = 40 times the
            wear.
        coating: Colour of bicycle lanes.
        center_color: Colour of the line between the directions.
        seed: Seed of patches, cracks, manhole covers and textures.
    """

    wear: float = Field(0.3, ge=0, le=1)
    paving: Ground = "paving"
    ground: Ground = "grass"
    carriageway: Literal["asphalt", "concrete", "cobbles", "gravel", "earth"] = "asphalt"
    age_years: float = Field(-1.0, ge=-1, le=100)
    coating: Literal["none", "red", "green", "blue"] = "none"
    center_color: Literal["white", "yellow"] = "white"
    seed: int = Field(0, ge=0, le=1_000_000)

    def surface_parameters(self) -> dict[str, Any]:
        """Asset parameters that differ from their defaults."""
        default = RoadSurface()
        named = ((name, getattr(self, name)) for name in RoadSurface.model_fields)
        return {name: value for name, value in named if value != getattr(default, name)}


class Bend(Strict):
    """A bend of a road: an arc between two clothoids.

    Attributes:
        to: Side to which it turns.
        radius_m: Radius of the arc.
        turn_deg: Change of the heading over the bend.
    """

    to: Literal["left", "right"] = "left"
    radius_m: float = Field(ge=alignment.RADIUS_MIN_M, examples=[80.0])
    turn_deg: float = Field(gt=0, le=150, examples=[40.0])


class Road(RoadSurface, Element):
    """A road along its own +X axis; pairs are (left, right) as seen along it.

    Attributes:
        after: Name of the road, or ``<junction>/<arm>``, at the end of which it starts; empty = it
            starts at ``at_m``.
        at_m: Start of the centre line (x, y); an optional third number is the height.
        yaw_deg: Direction at the start.
        length_m: Length of the centre line.
        curvature_per_m: Curvature, 1 / radius, positive to the left; 0 = straight.
        bends: Bends, each in the middle of an equal share of the road; both ends are straight for
            12 m. Lengths of their clothoids follow from radius and speed, by RASt 06, RAL and RAA.
            Where its share of the road is too short, a bend turns less.
        lanes: Number of lanes against its direction and along it.
        lane_width_m: Width of each driving lane.
        median_m: Width of the strip between the directions; 0 = only a line.
        median_kerb_m: Height of the kerbs around that strip; 0 = none. A kerbed median of at least
            1.2 m is a lane for plants.
        turn_m: Length of lanes in the median for those who turn across, at the start and at the
            end; 0 = none. They need a median of at least 2.5 m without kerbs, the rest of which is
            a blocked area.
        bicycle_m, shoulder_m: Width of bicycle lanes and of hard shoulders; 0 = none.
        parking: Parking strips along the kerb: true or ``parallel`` = 2.2 m wide, ``angled`` =
            bays at 60 degrees, 5.58 m, ``perpendicular`` = 5 m; angled and perpendicular bays are
            separate lanes. A single word is for both sides.
        verge_m: Width of planted strips between kerb and sidewalk; 0 = none.
        sidewalk_m: Width of the sidewalks; 0 = none.
        setback_m: Width of the land between sidewalk and house fronts, covered with ``ground``; a
            lane of kind ``garden``; 0 = none.
        kerb_m: Height of the kerbs; 0 = none, as on country roads and motorways.
        crown: Cross slope of the carriageway, from its middle to its gutters; 2.5 % in RASt 06, RAL
            and RAA.
        traffic: Side on which vehicles drive.
        markings: Style of the centre line.
        edge_lines: Whether the carriageway has edge lines.
        dash_m: Length of dashes and of the gaps between them: 3, 6 in towns; 4, 8 on country
            roads; 6, 12 on motorways.
        line_m: Width of narrow lines: 0.12; 0.15 on motorways.
        rails: Whether there are guard rails, left and right; ``bends`` = outside of bends only.
        arrows: Whether lanes that lead to the start and to the end of the road have arrows there.
        tram: Whether the lanes next to the middle have the rails of a tramway.
        apron_m: Width of the land next to the road that slopes down to the ground.
        speed_m_s: Usual speed.
    """

    related: ClassVar[tuple[str, ...]] = ("after",)

    type: Literal["road"] = "road"
    after: str = ""
    at_m: tuple[float, float] | tuple[float, float, float] = (0.0, 0.0)
    yaw_deg: float = 0.0
    length_m: float = Field(160.0, ge=1, le=2000)
    curvature_per_m: float = Field(0.0, ge=-0.2, le=0.2)
    bends: tuple[Bend, ...] = Field((), max_length=8)
    lanes: tuple[int, int] = (1, 1)
    lane_width_m: float = Field(3.5, ge=2, le=6)
    median_m: float = Field(0.0, ge=0, le=30)
    median_kerb_m: float = Field(0.0, ge=0, le=0.3)
    turn_m: tuple[Width, Width] = (0.0, 0.0)
    bicycle_m: tuple[Width, Width] = (0.0, 0.0)
    shoulder_m: tuple[Width, Width] = (0.0, 0.0)
    parking: Parking | tuple[Parking, Parking] = (False, False)
    verge_m: tuple[Width, Width] = (0.0, 0.0)
    sidewalk_m: tuple[Width, Width] = (2.5, 2.5)
    setback_m: tuple[Width, Width] = (0.0, 0.0)
    kerb_m: float = Field(0.12, ge=0, le=0.3)
    crown: float = Field(0.025, ge=0, le=0.08)
    traffic: Literal["right", "left"] = "right"
    markings: Literal["dashed", "solid", "double", "none"] = "dashed"
    edge_lines: bool = False
    dash_m: tuple[float, float] = (3.0, 6.0)
    line_m: float = Field(0.12, ge=0.05, le=0.5)
    rails: tuple[Rails, Rails] = (False, False)
    arrows: tuple[bool, bool] = (False, False)
    tram: bool = False
    apron_m: float = Field(6.0, ge=0, le=100)
    speed_m_s: float = Field(13.9, ge=0, le=60)

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add the road as background, and link its lanes to the roads that it meets."""
        shape = self.shape()
        pose = self._find_pose(scene)
        options: dict[str, Any] = {
            "markings": (self.markings, "dashed"),
            "edge_lines": ("solid" if self.edge_lines else "none", "none"),
            "dash_m": (self.dash_m, (3.0, 6.0)),
            "line_m": (self.line_m, 0.12),
            "rails": ((_RAILS[self.rails[0]], _RAILS[self.rails[1]]), (0.0, 0.0)),
            "apron_m": (self.apron_m, 6.0),
            "arrows": (_numbers(self.arrows), (0.0, 0.0)),
            "tram": (float(self.tram), 0.0),
        }
        given = {name: value for name, (value, default) in options.items() if value != default}
        given |= non_default_fields(shape) | self.surface_parameters()
        asset = parametric_id("road", **given)
        lanes = road_lanes(shape, self.name, pose, self.speed_m_s)
        return add_street(scene, assets, self.name, asset, pose, lanes)

    def shape(self) -> RoadShape:
        """Return its cross section and course. Raises ConfigError if they are impossible."""
        own = set(Road.model_fields)
        values = {f.name: getattr(self, f.name) for f in fields(RoadShape) if f.name in own}
        values["lanes"] = _numbers(self.lanes)
        bends = [
            (bend.radius_m if bend.to == "left" else -bend.radius_m, math.radians(bend.turn_deg))
            for bend in self.bends
        ]
        values["bends"] = alignment.lay_out(self.length_m, bends, self.speed_m_s)
        kinds = self.parking_kinds()
        values["parking_m"] = (PARKING_M[kinds[0]], PARKING_M[kinds[1]])
        values["bay_angle_deg"] = (BAY_ANGLE_DEG[kinds[0]], BAY_ANGLE_DEG[kinds[1]])
        shape = RoadShape(**values)
        where = f"elements.{self.name}"
        check_widths(where, shape)
        reach = max(shape.carriageway_m(side) for side in (1, -1)) + 6.0
        if self.bends:
            reach = max(row[-1].outer_m for side in (1, -1) if (row := strips(shape, side)))
        low, high = shape.curvature_range(0.0, shape.length_m)
        sharpest = max(-low, high)
        if sharpest * reach >= 1.0:
            field = "bends" if any(self.bends) else "curvature_per_m"
            raise ConfigError(
                f"{where}.{field}: a radius of {1 / sharpest:.1f} m is "
                f"less than the width of the road; expected a curvature below {1 / reach:.3g}"
            )
        headings = shape.line().poses(np.linspace(0.0, shape.length_m, 100))[:, 2]
        if np.ptp(headings) >= math.tau:
            raise ConfigError(
                f"{where}.length_m: the bend closes on itself; expected a shorter road"
            )
        return shape

    def parking_kinds(self) -> tuple[str, str]:
        """Word of ``PARKING_M`` for the left and the right side."""
        pair = self.parking if isinstance(self.parking, tuple) else (self.parking, self.parking)
        words = [("parallel" if v else "none") if isinstance(v, bool) else v for v in pair]
        return (words[0], words[1])

    def _find_pose(self, scene: Scene) -> SE3:
        if self.after:
            return find_port(scene, self.after, f"elements.{self.name}.after")
        return level_pose(self.at_m, self.yaw_deg)


def check_widths(where: str, shape: RoadShape) -> None:
    """Raise ConfigError if a cross section has no lane or a negative width."""
    if shape.lanes[0] + shape.lanes[1] < 1 or min(shape.lanes) < 0 or max(shape.lanes) > 8:
        raise ConfigError(f"{where}.lanes: {shape.lanes[0]:g}, {shape.lanes[1]:g}; expected 1 to 8")
    for name in ("bicycle_m", "shoulder_m", "verge_m", "sidewalk_m", "setback_m"):
        if not all(0.0 <= width <= 50.0 for width in getattr(shape, name)):
            raise ConfigError(f"{where}.{name}: expected two widths from 0 to 50 m")
    if any(shape.turn_m) and (shape.median_m < TURN_LANE_M or shape.median_kerb_m > 0.0):
        raise ConfigError(
            f"{where}.turn_m: lanes for turning vehicles need median_m of at least {TURN_LANE_M:g} "
            "and median_kerb_m: 0"
        )
    if min(shape.turn_m) < 0.0 or sum(shape.turn_m) > shape.length_m:
        raise ConfigError(
            f"{where}.turn_m: expected two lengths of together at most {shape.length_m:g} m"
        )


def add_street(
    scene: Scene,
    assets: AssetIndex,
    name: str,
    asset: str,
    T_world_body: SE3,
    lanes: tuple[Lane, ...],
) -> Scene:
    """Add a surface as background, and link its lanes to the ones that it meets."""
    scene = add_background(scene, assets, name, asset, T_world_body)
    return replace(scene, lanes=link_lanes((*scene.lanes, *lanes)))


def find_road(scene: Scene, name: str, field: str) -> tuple[RoadShape, dict[str, Any], SE3]:
    """Find the shape, all parameters and the pose of a road in the scene.

    Raises:
        ConfigError: there is no such road.
    """
    roads = {b.name: b for b in scene.bodies if b.asset.partition("?")[0] == "road"}
    if name not in roads:
        known = ", ".join(sorted(roads)) or "none: list the road before the elements on it"
        raise ConfigError(
            f"{field}: there is no road '{name}'; expected one of {known}"
            f"{did_you_mean(name, roads)}"
        )
    parameters = dict(parse_asset_id(roads[name].asset).parameters)
    names = {f.name for f in fields(RoadShape)}
    shape = RoadShape(**{k: v for k, v in parameters.items() if k in names})  # type: ignore[arg-type]
    return shape, parameters, roads[name].T_world_body


def find_port(scene: Scene, name: str, field: str) -> SE3:
    """Find the pose at which a road can start: the end of a road, or of ``<junction>/<arm>``.

    Raises:
        ConfigError: there is no such road or arm.
    """
    owner, slash, arm = name.partition("/")
    if slash:
        return _find_arm_end(scene, owner, arm, field)
    shape, _, T_world_road = find_road(scene, name, field)
    x, y, heading = (float(v) for v in shape.line().poses(np.array([shape.length_m]))[0])
    return T_world_road @ SE3.about_z(heading, (x, y, 0.0))


_ARMED: dict[str, type[JunctionShape] | type[RoundaboutShape]] = {
    "junction": JunctionShape,
    "roundabout": RoundaboutShape,
}


def _find_arm_end(scene: Scene, name: str, arm: str, field: str) -> SE3:
    for body in scene.bodies:
        parsed = parse_asset_id(body.asset) if body.name == name else None
        if parsed is not None and parsed.name in _ARMED:
            kind = _ARMED[parsed.name]
            names = {f.name for f in fields(kind)}
            given: dict[str, Any] = {k: v for k, v in parsed.parameters.items() if k in names}
            shape = kind(**given)
            count = len(shape.arms_rad())
            if arm.isdecimal() and int(arm) < count:
                return body.T_world_body @ arm_pose(shape, int(arm))
            raise ConfigError(f"{field}: '{name}' has no arm '{arm}'; expected 0 to {count - 1}")
    raise ConfigError(
        f"{field}: there is no junction or roundabout '{name}'; list it before the roads that "
        "start at it"
    )


def _numbers(pair: tuple[Any, Any]) -> tuple[float, float]:
    return (float(pair[0]), float(pair[1]))
