"""Who takes part in traffic, and what stands in its way."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import Body, Scene
from gen_data.generator.core.se3 import SE3, Array
from gen_data.generator.traffic.axles import Axles, find_axles
from gen_data.generator.traffic.conflict_zones import crosswalk_zones, heading
from gen_data.generator.traffic.lane_routes import LaneGraph, LanePosition
from gen_data.generator.traffic.signal_cycles import Approach, Cycle
from gen_data.randomizers.footprints import Footprint
from gen_data.randomizers.traffic_lights import Signal, runs_along

PERSON = "person"
MOVING_POSES = ("walk", "run", "carry")
"""People in other poses stand."""
POSTS = ("street_light", "traffic_light", "traffic_sign", "tree")
POST_M = 0.12
"""Things of these categories stand on a post at their origin, and reach out above heads only."""
SIGNAL_REACH_M = 30.0
"""A lane obeys a signal no farther from its end than this."""
NEAR_JUNCTION_M = 12.0
"""Crosswalks this near to the beginning of a junction's lane belong to its signals."""


@dataclass(frozen=True, slots=True)
class Driver:
    """How a category of vehicles is driven.

    Attributes:
        speed_m_s: It is driven no faster.
        acceleration_m_s2: Greatest one.
    """

    speed_m_s: float = 60.0
    acceleration_m_s2: float = 1.5


DRIVERS: Mapping[str, Driver] = {
    "bus": Driver(22.0, 1.0),
    "cyclist": Driver(5.5, 0.8),
    "motorcycle": Driver(60.0, 2.2),
    "truck": Driver(22.0, 0.9),
}


@dataclass(frozen=True, slots=True)
class OnRoad:
    """A vehicle that drives: its body, its axles, and where its rear axle is."""

    body: Body
    axles: Axles
    T_world_rear: SE3
    place: LanePosition
    category: str

    @property
    def ahead(self) -> tuple[float, float]:
        """Where it points, level, unit."""
        return heading_direction(self.body)


@dataclass(frozen=True, slots=True)
class OnFoot:
    """Somebody on foot: their body, and where they are on a sidewalk or crosswalk."""

    body: Body
    place: LanePosition
    walks: bool


def find_drivers(scene: Scene, graph: LaneGraph, assets: AssetIndex) -> list[OnRoad]:
    """Vehicles on driving lanes, in order: members of groups, and what carries a rig.

    What stands across a lane or against it takes no part.
    """
    groups = {group.name for group in scene.groups}
    carriers = {rig.body for rig in scene.rigs}
    near_m = max((line.lane.width_m for line in graph.lines.values()), default=0.0)
    found = []
    for body in scene.bodies:
        if not body.instance_id or not (body.group in groups or body.name in carriers):
            continue
        category = assets.get(body.asset).category
        near = graph.nearest(*body.T_world_body.translation_m[:2])
        if category == PERSON or near is None or near.away_m > near_m:
            continue
        axles = find_axles(assets, body.asset, body.scale)
        T_world_rear = body.T_world_body @ axles.T_body_rear
        place = graph.nearest(*T_world_rear.translation_m[:2])
        if place is None or place.away_m > 0.5 * graph.lines[place.lane].lane.width_m:
            continue
        (ax, ay), (bx, by) = heading_direction(body), _ahead_at(graph, place)
        if ax * bx + ay * by > 0.7:
            found.append(OnRoad(body, axles, T_world_rear, place, category))
    return found


def find_pedestrians(
    scene: Scene, sidewalks: LaneGraph, crosswalks: LaneGraph, assets: AssetIndex
) -> list[OnFoot]:
    """People of the scene's groups, in order, on the sidewalk or crosswalk nearest to them."""
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
            and place.away_m < 0.5 * graph.lines[place.lane].lane.width_m
        ]
        if near:
            place = min(near, key=lambda pair: pair[0])[1]
            pose = dict(asset.attributes).get("pose", "walk")
            walks = pose in MOVING_POSES
            # Who stands on a crosswalk is in the way.
            if walks or place.lane in sidewalks.lines:
                found.append(OnFoot(body, place, walks))
    return found


@dataclass(frozen=True, eq=False, slots=True)
class Standing:
    """What stands on the ground and takes no part.

    Attributes:
        names: Of the bodies.
        categories: What it is.
        boxes: What it covers [b, 6]: centre, half extents, cosine and sine of its direction.
    """

    names: tuple[str, ...]
    categories: tuple[str, ...]
    boxes: Array

    def at(self, x_m: float, y_m: float) -> str:
        """Name of what covers a point; empty = nothing."""
        x, y, hx, hy, c, s = self.boxes.T
        dx, dy = x_m - x, y_m - y
        inside = (np.abs(c * dx + s * dy) < hx) & (np.abs(c * dy - s * dx) < hy)
        return self.names[int(np.argmax(inside))] if inside.any() else ""


def find_obstacles(scene: Scene, taking_part: Iterable[Body], assets: AssetIndex) -> Standing:
    """Everything that has an instance, but roads and those who take part."""
    moving = {body.name for body in taking_part}
    roads = {lane.road for lane in scene.lanes}
    names: list[str] = []
    categories: list[str] = []
    rows: list[tuple[float, ...]] = []
    for body in scene.bodies:
        if not body.instance_id or body.name in moving or body.name.partition("/")[0] in roads:
            continue
        category = assets.get(body.asset).category
        if category in POSTS:
            x, y, _ = body.T_world_body.translation_m
            rows.append((x, y, POST_M, POST_M, 1.0, 0.0))
        else:
            bounds_m = assets.bounds_m(body.asset)
            rows.append(Footprint.of(body.T_world_body, bounds_m, body.scale).row()[:6])
        names.append(body.name)
        categories.append(category)
    return Standing(tuple(names), tuple(categories), np.array(rows).reshape(-1, 6))


def find_approaches(
    graph: LaneGraph, crosswalks: LaneGraph, signals: Sequence[tuple[Signal, Approach]]
) -> dict[str, Approach]:
    """The signals that lanes into junctions, and crosswalks there, obey, by the lanes' names."""
    found: dict[str, Approach] = {}
    for name in graph.names:
        ways = [n for n in graph.successors(name) if graph.lines[n].lane.junction]
        approach = None if graph.lines[name].lane.junction else _signal_for(graph, name, signals)
        if not ways or approach is None:
            continue
        found[name] = approach
        for crossed in crosswalk_zones(graph, ways, crosswalks).values():
            found |= {
                zone.crosswalk: approach for zone in crossed if zone.enter_m < NEAR_JUNCTION_M
            }
    return found


def cycles_axes(junction: Sequence[Signal]) -> list[int]:
    """Number of the axis of every signal of a junction, in order of their first signals."""
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
    """Every signal with its place in its junction's cycle."""
    return [
        (signal, Approach(cycle, axis))
        for junction, cycle in junctions
        for signal, axis in zip(junction, cycles_axes(junction), strict=True)
    ]


def heading_direction(body: Body) -> tuple[float, float]:
    """Where a body's front points, level, unit."""
    x, y, _ = body.T_world_body.rotation()[:, 0].tolist()
    length = math.sqrt(x * x + y * y)
    return x / length, y / length


def _ahead_at(graph: LaneGraph, place: LanePosition) -> tuple[float, float]:
    x, y, _ = graph.lines[place.lane].pose(place.at_m).rotation()[:, 0].tolist()
    return x, y


def _signal_for(
    graph: LaneGraph, name: str, signals: Sequence[tuple[Signal, Approach]]
) -> Approach | None:
    """The nearest signal that faces those who come along a lane."""
    lane = graph.lines[name].lane
    ax, ay = heading(lane.center_m, -1)
    near = [
        (math.dist(signal.at_m[:2], lane.center_m[-1][:2]), k)
        for k, (signal, _) in enumerate(signals)
        if signal.axis[0] * ax + signal.axis[1] * ay < -0.7
    ]
    distance, k = min(near, default=(math.inf, -1))
    return signals[k][1] if distance < SIGNAL_REACH_M else None
