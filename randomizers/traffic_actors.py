"""Vehicles, pedestrians, obstacles and signals that a traffic simulation reads from a scene."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gen_data.core import interfaces, se3
from gen_data.core.scene import Body, Scene
from gen_data.randomizers import free_space, pedestrian_poses
from gen_data.randomizers.traffic_lights import Signal, runs_along
from gen_data.traffic.axles import Axles, find_axles
from gen_data.traffic.conflict_zones import crosswalk_zones, heading
from gen_data.traffic.lane_routes import LaneGraph, LanePosition
from gen_data.traffic.signal_cycles import Approach, Cycle

PERSON = "person"
SCENERY = "scenery"
"""Tag of assets that never move of themselves."""
POSTS = ("street_light", "traffic_light", "traffic_sign", "tree", "utility_pole")
POST_M = 0.12
"""Half width of the post at the origin of ``POSTS``; only parts above head height reach further."""
SIGNAL_REACH_M = 30.0
"""Largest distance between the end of a lane and its signal."""
NEAR_JUNCTION_M = 12.0
"""Largest distance of a signal's crosswalk from the beginning of a lane across the junction."""


@dataclass(frozen=True, slots=True)
class Driver:
    """Driving limits of a category of vehicles.

    Attributes:
        speed_m_s: Largest speed.
        acceleration_m_s2: Largest acceleration.
        keeps_side: Whether it stays where it is across its lane, instead of in the middle.
    """

    speed_m_s: float = 60.0
    acceleration_m_s2: float = 1.5
    keeps_side: bool = False


DRIVERS: Mapping[str, Driver] = {
    "bus": Driver(22.0, 1.0),
    "cyclist": Driver(5.5, 0.8, keeps_side=True),
    "motorcycle": Driver(60.0, 2.2),
    "tram": Driver(14.0, 1.0),
    "truck": Driver(22.0, 0.9),
}


@dataclass(frozen=True, slots=True)
class OnRoad:
    """A driving vehicle: its body, its axles, and the lane position of its rear axle."""

    body: Body
    axles: Axles
    T_world_rear: se3.SE3
    place: LanePosition
    category: str

    @property
    def ahead(self) -> tuple[float, float]:
        """Horizontal unit vector of its front."""
        return heading_direction(self.body)


@dataclass(frozen=True, slots=True)
class OnFoot:
    """A pedestrian: the body and its position on a sidewalk or crosswalk."""

    body: Body
    place: LanePosition
    walks: bool


def find_drivers(scene: Scene, graph: LaneGraph, assets: interfaces.AssetIndex) -> list[OnRoad]:
    """Find the vehicles on the graph's lanes, in order: members of groups and carriers of rigs.

    Vehicles across a lane or against its direction are left out, and scenery at a lane's edge, such
    as parked bicycles, cones and grass.
    """
    groups = {group.name for group in scene.groups}
    carriers = {rig.body for rig in scene.rigs}
    near_m = max((line.lane.width_m for line in graph.lines.values()), default=0.0)
    found = []
    for body in scene.bodies:
        if not body.instance_id or not (body.group in groups or body.name in carriers):
            continue
        asset = assets.get(body.asset)
        near = graph.nearest(*body.T_world_body.translation_m[:2])
        if (
            asset.category == PERSON
            or SCENERY in asset.tags
            or near is None
            or near.away_m > near_m
        ):
            continue
        axles = find_axles(assets, body.asset, body.scale)
        T_world_rear = body.T_world_body @ axles.T_body_rear
        place = graph.nearest(*T_world_rear.translation_m[:2])
        if place is None or place.away_m > graph.lines[place.lane].half_width_m(place.at_m):
            continue
        (ax, ay), (bx, by) = heading_direction(body), _lane_direction(graph, place)
        if ax * bx + ay * by > 0.7:
            found.append(OnRoad(body, axles, T_world_rear, place, asset.category))
    return found


def find_pedestrians(
    scene: Scene, sidewalks: LaneGraph, crosswalks: LaneGraph, assets: interfaces.AssetIndex
) -> list[OnFoot]:
    """Find the people of the scene's groups, in order, on their nearest sidewalk or crosswalk."""
    groups = {group.name for group in scene.groups}
    found = []
    for body in scene.bodies:
        if body.group not in groups:
            continue
        asset = assets.get(body.asset)
        if asset.category != PERSON:
            continue
        xy = body.T_world_body.translation_m[:2]
        near = [
            (place.away_m, place)
            for graph in (crosswalks, sidewalks)
            if (place := graph.nearest(*xy)) is not None
            and place.away_m < graph.lines[place.lane].half_width_m(place.at_m)
        ]
        if near:
            place = min(near, key=lambda pair: pair[0])[1]
            pose = dict(asset.attributes).get("pose", "walk")
            walks = pose in pedestrian_poses.moving_poses()
            # Somebody who stands on a crosswalk is an obstacle.
            if walks or place.lane in sidewalks.lines:
                found.append(OnFoot(body, place, walks))
    return found


@dataclass(frozen=True, eq=False, slots=True)
class Standing:
    """Obstacles on the ground.

    Attributes:
        names: Names of the bodies.
        categories: Their categories.
        boxes: Their footprints [b, 6]: centre and half extents [m], cosine and sine of the yaw.
    """

    names: tuple[str, ...]
    categories: tuple[str, ...]
    boxes: se3.Array

    def at(self, x_m: float, y_m: float) -> str:
        """Name of the obstacle at a point; empty if the point is free."""
        x, y, hx, hy, c, s = self.boxes.T
        dx, dy = x_m - x, y_m - y
        inside = (np.abs(c * dx + s * dy) < hx) & (np.abs(c * dy - s * dx) < hy)
        return self.names[int(np.argmax(inside))] if inside.any() else ""


def find_obstacles(scene: Scene, moving: Iterable[Body], assets: interfaces.AssetIndex) -> Standing:
    """Find every body with an instance id, except roads and moving bodies."""
    moving_names = {body.name for body in moving}
    names: list[str] = []
    categories: list[str] = []
    rows: list[tuple[float, ...]] = []
    for body in free_space.standing_bodies(scene):
        if body.name in moving_names:
            continue
        category = assets.get(body.asset).category
        if category in POSTS:
            x, y, _ = body.T_world_body.translation_m
            rows.append((x, y, POST_M, POST_M, 1.0, 0.0))
        else:
            bounds_m = assets.bounds_m(body.asset)
            footprint = free_space.Footprint.of(body.T_world_body, bounds_m, body.scale)
            x, y, cos_yaw, sin_yaw, half_x_m, half_y_m = footprint.rectangle
            rows.append((x, y, half_x_m, half_y_m, cos_yaw, sin_yaw))
        names.append(body.name)
        categories.append(category)
    return Standing(tuple(names), tuple(categories), np.array(rows).reshape(-1, 6))


def find_approaches(
    graph: LaneGraph, crosswalks: LaneGraph, signals: Sequence[tuple[Signal, Approach]]
) -> dict[str, Approach]:
    """Map the names of lanes into junctions, and of crosswalks there, to their signals."""
    found: dict[str, Approach] = {}
    for name in graph.names:
        ways = [n for n in graph.successors(name) if graph.lines[n].lane.junction]
        approach = None if graph.lines[name].lane.junction else _find_signal(graph, name, signals)
        if not ways or approach is None:
            continue
        found[name] = approach
        for crossed in crosswalk_zones(graph, ways, crosswalks).values():
            found |= {
                zone.crosswalk: approach for zone in crossed if zone.enter_m < NEAR_JUNCTION_M
            }
    return found


def number_axes(junction: Sequence[Signal]) -> list[int]:
    """Number the axes of a junction by first appearance; the axis of every signal."""
    firsts: list[Signal] = []
    axes = []
    for signal in junction:
        axis = next((k for k, first in enumerate(firsts) if runs_along(first, signal)), None)
        if axis is None:
            axis = len(firsts)
            firsts.append(signal)
        axes.append(axis)
    return axes


def set_cycles(
    junctions: Iterable[tuple[Sequence[Signal], Cycle]],
) -> list[tuple[Signal, Approach]]:
    """Pair every signal with its approach in the junction's cycle."""
    return [
        (signal, Approach(cycle, axis))
        for junction, cycle in junctions
        for signal, axis in zip(junction, number_axes(junction), strict=True)
    ]


def heading_direction(body: Body) -> tuple[float, float]:
    """Horizontal unit vector of a body's front."""
    x, y, _ = body.T_world_body.rotation()[:, 0].tolist()
    length = math.sqrt(x * x + y * y)
    return x / length, y / length


def _lane_direction(graph: LaneGraph, place: LanePosition) -> tuple[float, float]:
    x, y, _ = graph.lines[place.lane].pose(place.at_m).rotation()[:, 0].tolist()
    return x, y


def _find_signal(
    graph: LaneGraph, name: str, signals: Sequence[tuple[Signal, Approach]]
) -> Approach | None:
    """Nearest signal that faces the traffic of a lane; None if there is none in reach."""
    lane = graph.lines[name].lane
    ax, ay = heading(lane.center_m, -1)
    near = [
        (math.dist(signal.at_m[:2], lane.center_m[-1][:2]), k)
        for k, (signal, _) in enumerate(signals)
        if signal.axis[0] * ax + signal.axis[1] * ay < -0.7
    ]
    distance, k = min(near, default=(math.inf, -1))
    return signals[k][1] if distance < SIGNAL_REACH_M else None
