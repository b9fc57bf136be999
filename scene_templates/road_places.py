"""Places along a road: frames next to it, and lanes that leave room for them."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace

import numpy as np

from gen_data.core.errors import ConfigError
from gen_data.core.lane_geometry import LaneLine
from gen_data.core.scene import Lane, LaneKind, Scene
from gen_data.core.se3 import SE3, Vec3
from gen_data.roads.cross_section import RoadShape, strips
from gen_data.roads.lane_graph import link_lanes
from gen_data.scene_templates.road import find_road

_SHORTEST_M = 2.0
"""Pieces of lanes shorter than this are left out."""


@dataclass(frozen=True, slots=True)
class RoadPlace:
    """A place on a road.

    Attributes:
        name: The road.
        shape: Its section and course.
        T_world_road: Its frame.
        station_m: Arc length.
    """

    name: str
    shape: RoadShape
    T_world_road: SE3
    station_m: float

    def pose(self, t_m: float, z_m: float = 0.0, turn_rad: float = 0.0) -> SE3:
        """``T_world_place`` at a distance to the left; X along the road, turned about Z."""
        line = self.shape.line()
        x, y = line.points(np.array([self.station_m]), np.array([t_m]))[0].tolist()
        heading = float(line.poses(np.array([self.station_m]))[0, 2])
        return self.T_world_road @ SE3.about_z(heading + turn_rad, (x, y, z_m))

    def edge_m(self, side: int, *, land: bool) -> tuple[float, float]:
        """Distance and height of the outer edge of one side, with the land before houses or not."""
        row = [s for s in strips(self.shape, side) if land or s.kind != "garden"]
        return (row[-1].outer_m, row[-1].outer_z_m) if row else (0.0, 0.0)

    def sagitta_m(self, side: int, half_m: float) -> float:
        """How far the road bends into a straight rectangle of half a length at its side."""
        low, high = self.shape.curvature_range(self.station_m - half_m, self.station_m + half_m)
        return 0.5 * max(0.0, high if side > 0 else -low) * half_m * half_m


def find_place(scene: Scene, road: str, station_m: float, half_m: float, where: str) -> RoadPlace:
    """Find a place on a road with room of ``half_m`` before and behind it.

    Raises:
        ConfigError: there is no such road, or it is too short.
    """
    shape, _, T_world_road = find_road(scene, road, f"{where}.road")
    if not half_m <= station_m <= shape.length_m - half_m:
        raise ConfigError(
            f"{where}.station_m: {station_m:g} m; expected {half_m:.1f} to "
            f"{shape.length_m - half_m:.1f} m on '{road}', which is {shape.length_m:g} m long"
        )
    return RoadPlace(road, shape, T_world_road, station_m)


def cut_lanes(
    scene: Scene, place: RoadPlace, half_m: float, kinds: Collection[LaneKind], sides: str = "both"
) -> Scene:
    """Return the scene whose lanes next to a road have a gap around a place.

    Lanes across the road, such as bays, are left out within the gap.

    Args:
        scene: With the road.
        place: Middle of the gap.
        half_m: Half the length of the gap along the road.
        kinds: Kinds of lanes to cut.
        sides: ``left``, ``right`` or ``both``.
    """
    lanes: list[Lane] = []
    for lane in scene.lanes:
        here = lane.road == place.name and lane.kind in kinds
        if not here or (sides != "both" and f"_{sides}" not in lane.name):
            lanes.append(lane)
        elif LaneLine(lane).length_m > 0.5 * place.shape.length_m:
            lanes += _pieces(lane, place, half_m)
        elif abs(_station_m(lane, place) - place.station_m) > half_m:
            lanes.append(lane)
    return replace(scene, lanes=link_lanes(lanes))


def _station_m(lane: Lane, place: RoadPlace) -> float:
    """Arc length of the road at the start of a lane that lies across it, such as a bay."""
    start = place.T_world_road.inverse().apply(np.array([lane.center_m[0]]))[0, :2]
    s = np.linspace(0.0, place.shape.length_m, max(2, round(place.shape.length_m) + 1))
    away = place.shape.line().points(s, np.zeros(len(s))) - start
    return float(s[int((away * away).sum(axis=1).argmin())])


def _pieces(lane: Lane, place: RoadPlace, half_m: float) -> Iterator[Lane]:
    """The rest of a lane on both sides of a gap; the first piece keeps the name."""
    line = LaneLine(lane)
    middle, reach = place.station_m / place.shape.length_m, half_m / line.length_m
    # Lanes on the left run against the road.
    middle = 1.0 - middle if lane.name.endswith("_left") else middle
    low, high = max(0.0, middle - reach), min(1.0, middle + reach)
    ends = ((0.0, low * line.length_m), (high * line.length_m, line.length_m))
    for number, (start, end) in enumerate(ends):
        if end - start >= _SHORTEST_M:
            first, last = (line.pose(a).rounded().translation_m for a in (start, end))
            inside = [
                point
                for a, point in zip(line.at_m, lane.center_m, strict=True)
                if start + 0.05 < a < end - 0.05
            ]
            center: tuple[Vec3, ...] = (first, *inside, last)
            name = lane.name if number == 0 else f"{lane.name}_on"
            onward = lane.successors if number == 1 else ()
            yield replace(lane, name=name, center_m=center, successors=onward)
