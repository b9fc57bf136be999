"""Lanes of roads, and the links between them."""

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from gen_data.core.scene import Lane, LaneKind
from gen_data.core.se3 import SE3, Vec3
from gen_data.roads.cross_section import (
    BAY_WIDTH_M,
    KERB_WIDTH_M,
    RoadShape,
    Strip,
    bay_borders,
    side_index,
    strips,
)
from gen_data.roads.reference_line import Array, beside

FURNITURE_M = 0.5
"""Distance of poles and bins from the kerb."""
OVERHANG_M = 0.6
"""Length by which cars in angled bays stand over the kerb (RAR, by sicherestrassen.de: 0.70 m)."""
PLANTED_MEDIAN_M = 1.2
"""Kerbed medians from this width on are a lane for plants."""
MEETING_M = 0.05
MEETING_RAD = math.radians(8.0)
"""Largest distance and angle between the end of a lane and the start of its successor."""
BICYCLE_M_S = 5.0
"""Usual speed on bicycle lanes: 18 km/h (assumed, 20 %)."""
_STEP_M = 2.0


def road_lanes(
    shape: RoadShape, name: str, T_world_road: SE3, speed_m_s: float
) -> tuple[Lane, ...]:
    """Make the lanes of a road: driving lanes both ways, others with the road on their left."""
    line = shape.line()
    poses = line.poses(stations(0.0, line.length_m, _STEP_M))
    lanes: list[Lane] = []
    for side in (1, -1):
        word = "left" if side > 0 else "right"
        row = strips(shape, side)
        driving = [strip for strip in row if strip.kind == "driving"]
        forward = shape.forward(side)
        for strip in driving:
            left, right = _neighbours(name, shape, side, strip.number, len(driving))
            center = _path(poses, strip.middle_m, strip.middle_z_m, forward, T_world_road)
            own = lane_name(name, side, strip.number, shape)
            rise = (strip.inner_z_m - strip.outer_z_m) / strip.width_m
            bank = round(rise if shape.traffic == "right" else -rise, 9) + 0.0
            lane = Lane(own, "driving", center, strip.width_m, name, (), left, right, speed_m_s)
            lanes.append(replace(lane, bank=bank))
        angled = shape.bay_angle_deg[side_index(side)] > 0.0
        for kind, t_m, z_m, width_m in _beside(row, side):
            if kind == "parking" and angled:
                continue
            center = _path(poses, t_m, z_m, side < 0, T_world_road)
            speed = BICYCLE_M_S if kind == "bicycle" else 0.0
            own = f"{name}/{kind}_{word}"
            lanes.append(Lane(own, kind, center, width_m, road=name, speed_m_s=speed))
        if angled:
            lanes += _bays(shape, row, f"{name}/parking_{word}", name, T_world_road)
    lanes += _turn_lanes(shape, name, T_world_road, speed_m_s)
    if shape.median_kerb_m > 0.0 and shape.median_m >= PLANTED_MEDIAN_M:
        z_m = strips(shape, 1)[0].inner_z_m
        center = _path(poses, 0.0, z_m, True, T_world_road)
        width_m = shape.median_m - 2.0 * KERB_WIDTH_M
        lanes.append(Lane(f"{name}/verge_median", "verge", center, width_m, road=name))
    return tuple(lanes)


def _turn_lanes(shape: RoadShape, name: str, T_world_road: SE3, speed_m_s: float) -> Iterator[Lane]:
    """Make the lanes in the median for those who turn across; nothing leads into them."""
    line, z_m = shape.line(), strips(shape, 1)[0].middle_z_m if shape.median_m else 0.0
    for start, end, is_forward in shape.turn_spans():
        s = stations(start, end, _STEP_M)
        s = s if is_forward else s[::-1]
        flat = line.points(s, np.zeros(len(s)))
        center = world_points(np.column_stack([flat, np.full(len(s), z_m)]), T_world_road)
        word = "forward" if is_forward else "backward"
        beside = f"{name}/{word}0"
        left, right = ("", beside) if shape.traffic == "right" else (beside, "")
        own, width_m = f"{name}/turn_{word}", shape.median_m
        yield Lane(own, "driving", center, width_m, name, (), left, right, speed_m_s)


def _bays(
    shape: RoadShape, row: Sequence[Strip], prefix: str, name: str, T_world_road: SE3
) -> Iterator[Lane]:
    """Make a lane per angled bay, from the street inwards and over the kerb by ``OVERHANG_M``."""
    line = shape.line()
    for strip in (strip for strip in row if strip.kind == "parking"):
        borders = np.array(bay_borders(shape, strip))
        middles = 0.5 * (borders[:-1] + borders[1:])
        inwards = middles[:, 1] - middles[:, 0]
        reach = OVERHANG_M / np.array([math.hypot(s, t) for s, t in inwards.tolist()])
        ends = np.stack([middles[:, 0], middles[:, 1] + inwards * reach[:, None]], axis=1)
        flat = line.points(ends[..., 0].ravel(), ends[..., 1].ravel())
        solid = np.column_stack([flat, np.full(len(flat), strip.middle_z_m)])
        points = world_points(solid, T_world_road)
        for k in range(len(ends)):
            center = points[2 * k : 2 * k + 2]
            yield Lane(f"{prefix}{k}", "parking", center, BAY_WIDTH_M, road=name)


def lane_name(road: str, side: int, number: int, shape: RoadShape) -> str:
    """Name of a driving lane, such as ``main/forward0`` next to the middle."""
    return f"{road}/{'forward' if shape.forward(side) else 'backward'}{number}"


def _path(
    poses: Array, t_m: float, z_m: float, forward: bool, T_world_road: SE3
) -> tuple[Vec3, ...]:
    """Points in the world at a distance to the left of a road's poses [n, 3], or back along it."""
    along = poses if forward else poses[::-1]
    flat = beside(along, np.full(len(along), t_m))
    return world_points(np.column_stack([flat, np.full(len(along), z_m)]), T_world_road)


def world_points(points: Array, T_world_road: SE3) -> tuple[Vec3, ...]:
    """Transform points [n, 3] of a road's frame to the world, rounded to a micrometre."""
    placed = np.round(T_world_road.apply(points), 6) + 0.0
    return tuple(map(tuple, placed.tolist()))


def stations(start_m: float, end_m: float, step_m: float) -> Array:
    """Evenly spaced arc lengths [n] from start to end, at most one step apart."""
    return np.linspace(start_m, end_m, max(1, math.ceil((end_m - start_m) / step_m - 1e-9)) + 1)


def link_lanes(lanes: Sequence[Lane]) -> tuple[Lane, ...]:
    """Set the successors of lanes: lanes that start at a lane's end, in its direction."""
    found: defaultdict[int, set[str]] = defaultdict(set)
    for k, n in _near_pairs(lanes):
        lane, other = lanes[k], lanes[n]
        if lane.kind == other.kind and lane.name != other.name and _meet(lane, other):
            found[k].add(other.name)
    linked = [tuple(sorted(found[k] | set(lane.successors))) for k, lane in enumerate(lanes)]
    # A lane is measured once, as long as it is the same object.
    return tuple(
        lane if lane.successors == names else replace(lane, successors=names)
        for lane, names in zip(lanes, linked, strict=True)
    )


def _near_pairs(lanes: Sequence[Lane]) -> list[list[int]]:
    """Pairs of a lane and another that starts at most ``MEETING_M`` from its end along X and Y."""
    ends, starts = (
        np.array([lane.center_m[k][:2] for lane in lanes]).reshape(-1, 2) for k in (-1, 0)
    )
    away = np.abs(ends[:, None, :] - starts[None, :, :])
    pairs: list[list[int]] = np.argwhere((away <= MEETING_M).all(axis=2)).tolist()
    return pairs


def _meet(lane: Lane, following: Lane) -> bool:
    """Whether a lane starts at another one's end, in its direction."""
    end, start = lane.center_m[-1], following.center_m[0]
    turn = _heading(*following.center_m[:2]) - _heading(*lane.center_m[-2:])
    is_straight = abs(math.remainder(turn, math.tau)) < MEETING_RAD
    return math.dist(end, start) < MEETING_M and is_straight


def _heading(start_m: Vec3, end_m: Vec3) -> float:
    return math.atan2(end_m[1] - start_m[1], end_m[0] - start_m[0])


def _neighbours(name: str, shape: RoadShape, side: int, number: int, count: int) -> tuple[str, str]:
    """Names of the left and right neighbours with the same direction."""
    # In right-hand traffic, the middle of the road is to the left of a lane.
    inner = lane_name(name, side, number - 1, shape) if number > 0 else ""
    outer = lane_name(name, side, number + 1, shape) if number + 1 < count else ""
    return (inner, outer) if shape.traffic == "right" else (outer, inner)


def _beside(row: Sequence[Strip], side: int) -> list[tuple[LaneKind, float, float, float]]:
    """Kind, t, height and width of all lanes of one side except driving lanes."""
    by_kind = {strip.kind: strip for strip in row}
    made: list[tuple[LaneKind, float, float, float]] = []
    whole: tuple[LaneKind, ...] = ("bicycle", "parking", "verge", "sidewalk", "garden")
    for kind in whole:
        if kind in by_kind:
            strip = by_kind[kind]
            made.append((kind, strip.middle_m, strip.middle_z_m, strip.width_m))
    edge = by_kind.get("sidewalk", by_kind.get("verge"))
    if edge is not None:
        into = min(FURNITURE_M, 0.5 * edge.width_m)
        z_m = edge.inner_z_m + (edge.outer_z_m - edge.inner_z_m) * into / edge.width_m
        made.append(("furniture", side * (edge.inner_m + into), z_m, min(0.6, edge.width_m)))
    if row:
        made.append(("frontage", side * row[-1].outer_m, row[-1].outer_z_m, 0.0))
    return made
