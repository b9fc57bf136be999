"""Vector map of Argoverse 2: lanes with marks, crosswalks and drivable areas of a world."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from gen_data.core.lane_geometry import MEETING_M, Side, border_line
from gen_data.core.scene import Lane
from gen_data.core.se3 import Array
from gen_data.exporters.road_map import Area, Divider, Paint, RoadMap

LANE_TYPES = {"driving": "VEHICLE", "bicycle": "BIKE"}
DECIMALS = 3

Row = dict[str, Any]


def argoverse_map(roads: RoadMap) -> Row:
    """Content of ``log_map_archive_*.json``; ids are numbers of lanes and areas, from 1."""
    ids = {lane.name: k for k, lane in enumerate(roads.lanes, 1)}
    ways = [lane for lane in roads.lanes if lane.kind in LANE_TYPES]
    before: dict[str, list[int]] = {}
    for lane in ways:
        for name in lane.successors:
            before.setdefault(name, []).append(ids[lane.name])
    dividers = {divider.border.name: divider for divider in roads.dividers}
    ground = np.concatenate([np.zeros((0, 3)), *(np.asarray(k.center_m) for k in roads.lanes)])
    crossings = [lane for lane in roads.lanes if lane.kind == "crosswalk"]
    areas = [piece for area in roads.drivable for piece in without_holes(area)]
    return {
        "lane_segments": {
            str(ids[lane.name]): _segment(lane, ids, before, dividers) for lane in ways
        },
        "pedestrian_crossings": {str(ids[k.name]): _crossing(k, ids[k.name]) for k in crossings},
        "drivable_areas": {
            str(k): {"id": k, "area_boundary": _points(_raised(piece, ground))}
            for k, piece in enumerate(areas, 1)
        },
    }


def mark_type(paint: Paint) -> str:
    """Type of a mark with this paint."""
    if paint.style == "none":
        return "NONE"
    color = "YELLOW" if paint.is_yellow else "WHITE"
    if paint.is_double:
        return f"DOUBLE_{'SOLID' if paint.style == 'solid' else 'DASH'}_{color}"
    return f"{'SOLID' if paint.style == 'solid' else 'DASHED'}_{color}"


def without_holes(area: Area) -> Iterator[Array]:
    """Outlines [n, 2] of the pieces of an area, which is cut through the middle of each hole."""
    import shapely

    shape = shapely.Polygon(area.exterior, area.holes)
    if not area.holes:
        yield area.exterior
        return
    middle = float(np.mean(area.holes[0][:, 0]))
    low_x, low_y, high_x, high_y = shape.bounds
    for half in ((low_x, middle), (middle, high_x)):
        piece = shape.intersection(shapely.box(half[0], low_y, half[1], high_y))
        for part in getattr(piece, "geoms", [piece]):
            if part.geom_type == "Polygon" and part.area > 0.0:
                ring = shapely.orient_polygons(part)
                holes = tuple(np.asarray(hole.coords)[:-1] for hole in ring.interiors)
                yield from without_holes(Area(np.asarray(ring.exterior.coords)[:-1], holes))


def _segment(
    lane: Lane,
    ids: Mapping[str, int],
    before: Mapping[str, list[int]],
    dividers: Mapping[str, Divider],
) -> Row:
    row: Row = {
        "id": ids[lane.name],
        "is_intersection": lane.junction,
        "lane_type": LANE_TYPES[lane.kind],
        "predecessors": before.get(lane.name, []),
        "successors": [ids[name] for name in lane.successors if name in ids],
    }
    for side, beside in (("left", lane.left), ("right", lane.right)):
        word: Side = "left" if side == "left" else "right"
        row[f"{side}_lane_boundary"] = _points(np.asarray(border_line(lane, word)))
        row[f"{side}_lane_mark_type"] = mark_type(_paint(lane, word, dividers))
        row[f"{side}_neighbor_id"] = ids.get(beside)
    return row


def _paint(lane: Lane, side: Side, dividers: Mapping[str, Divider]) -> Paint:
    """The most frequent paint at one side of a lane; oncoming lanes share a border's."""
    name = f"{lane.right}:left" if side == "right" and lane.right else f"{lane.name}:{side}"
    found = dividers.get(name)
    if found is None:
        line = border_line(lane, side)
        for divider in dividers.values():
            points = divider.border.points_m
            if max(math.dist(line[0], points[-1]), math.dist(line[-1], points[0])) < MEETING_M:
                found = divider
    if found is None:
        return Paint()
    paints = found.paint
    return max(dict.fromkeys(paints), key=paints.count)


def _crossing(lane: Lane, number: int) -> Row:
    left, right = (np.asarray(border_line(lane, side)) for side in ("left", "right"))
    return {"id": number, "edge1": _points(left[[0, -1]]), "edge2": _points(right[[0, -1]])}


def _raised(outline: Array, ground: Array) -> Array:
    """An outline [n, 2] at the heights of the nearest points of lanes."""
    if not len(ground):
        return np.column_stack([outline, np.zeros(len(outline))])
    x, y = (outline[:, None, axis] - ground[:, axis] for axis in range(2))
    return np.column_stack([outline, ground[(x * x + y * y).argmin(axis=1), 2]])


def _points(points: Array) -> list[dict[str, float]]:
    rounded = (np.round(points, DECIMALS) + 0.0).tolist()
    return [dict(zip("xyz", point, strict=True)) for point in rounded]
