"""Lane graph of an OpenDRIVE file, relative to an origin at its centre."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from gen_data.core import errors, se3
from gen_data.core.lane_geometry import left_normals
from gen_data.core.scene import Lane, LaneKind
from gen_data.roads.lane_graph import FURNITURE_M, stations, world_points
from gen_data.roads.opendrive import Contact, LaneRecord, Network, Road, Section
from gen_data.roads.reference_line import Array

_DRIVEN = ("driving", "entry", "exit", "mwyEntry", "mwyExit", "onRamp", "offRamp", "slipLane",
           "connectingRamp", "bidirectional", "bus", "taxi", "HOV")  # fmt: skip
KINDS: dict[str, LaneKind] = {
    **dict.fromkeys(_DRIVEN, "driving"),
    "parking": "parking",
    "biking": "bicycle",
    "sidewalk": "sidewalk",
    "walking": "sidewalk",
}
"""Lane types of the standard that carry traffic; others only have a surface."""
RAISED_M = 0.12
"""Default height of sidewalks."""
MAX_LINK_GAP_M = 0.1
"""Largest gap between linked lanes."""
TAPERED_M = 0.5
"""Width below which a lane has ended where another one continues."""
DEFAULT_SPEED_M_S = 13.9
_STEP_M = 2.0
_TWIST, _WIDENING_M = 1e-3, 1e-3
"""Cross slopes, and widths, of a lane that change by less than this are one."""
_NARROW_M = 0.05
"""Least width by which differences in height are divided for cross slopes."""
_SIGN_KINDS = frozenset({"sidewalk", "parking"})
"""Kinds that always run with the street on their left, whichever side traffic keeps to."""

Key = tuple[str, int, int]


def origin_m(network: Network) -> tuple[float, float]:
    """Centre of all reference lines, in whole metres; file coordinates may be far from zero."""
    ends = np.concatenate(
        [road.line.points(stations(0.0, road.line.length_m, 20.0), np.zeros(1))
         for road in network.roads.values()]
    )  # fmt: skip
    low, high = ends.min(axis=0), ends.max(axis=0)
    return (round(float(low[0] + high[0]) / 2.0), round(float(low[1] + high[1]) / 2.0))


def heights_m(lane: LaneRecord) -> tuple[float, float]:
    """Heights of a lane's inner and outer edge over the road."""
    if lane.height_m is not None:
        return lane.height_m
    return (RAISED_M, RAISED_M) if KINDS.get(lane.kind) == "sidewalk" else (0.0, 0.0)


def network_lanes(network: Network) -> tuple[Lane, ...]:
    """Every lane, in the frame whose origin is ``origin_m``.

    Raises:
        AssetError: if linked lanes do not meet; the message names the road.
    """
    x, y = origin_m(network)
    T_body_file = se3.SE3((-x, -y, 0.0))
    made: dict[Key, Lane] = {}
    extra: list[Lane] = []
    narrow: set[Key] = set()
    for road in network.roads.values():
        for index, section in enumerate(road.sections):
            for number in sorted(section.lanes):
                kind = KINDS.get(section.lanes[number].kind)
                if number == 0 or kind is None:
                    continue
                lane = _make_lane(road, index, section, number, T_body_file)
                if max(lane.widths_m or (lane.width_m,)) < TAPERED_M:
                    narrow.add((road.road_id, index, number))
                else:
                    made[road.road_id, index, number] = lane
            extra += _make_side_lanes(road, index, section, T_body_file)
    linked = []
    for key, lane in made.items():
        after = [
            k
            for k in _next_keys(network, key)
            if k in made and made[k].kind == lane.kind and not _tapers(network, key, k)
        ]
        if lane.kind == "sidewalk":
            # Their links join them whichever way they run here: head on they lead nowhere.
            after = [k for k in after if _gap_m(lane, made[k]) <= MAX_LINK_GAP_M]
        for other in after:
            _check_gap(network, key, lane, made[other])
        linked.append(_link_lane(network, lane, key, after, made, narrow))
    return (*linked, *extra)


def runs_forward(road: Road, lane: LaneRecord) -> bool:
    """Whether a lane runs along its road's direction."""
    left_hand = road.left_hand and KINDS[lane.kind] not in _SIGN_KINDS
    return ((lane.number < 0) != left_hand) != lane.reversed


@dataclass(frozen=True, slots=True)
class _LaneEdges:
    """Sampled edges of a lane.

    Attributes:
        s_m: Arc lengths [n].
        inner_m, outer_m: ``t`` of its edges [n].
    """

    s_m: Array
    inner_m: Array
    outer_m: Array


def _trace_edges(road: Road, section: Section, number: int, step_m: float = _STEP_M) -> _LaneEdges:
    s = road.stations(section.start_m, section.end_m, step_m)
    edges = road.boundaries_m(section, s)
    side = 1 if number > 0 else -1
    return _LaneEdges(s, edges[number - side], edges[number])


def _make_lane(road: Road, index: int, section: Section, number: int, T_body_file: se3.SE3) -> Lane:
    record = section.lanes[number]
    course = _trace_edges(road, section, number)
    lift = np.full(len(course.s_m), 0.5 * sum(heights_m(record)))
    points = road.points(section, course.s_m, 0.5 * (course.inner_m + course.outer_m), lift)
    low_m, high_m = heights_m(record)
    inner = road.points(section, course.s_m, course.inner_m, np.full(len(lift), low_m))
    outer = road.points(section, course.s_m, course.outer_m, np.full(len(lift), high_m))
    widths_m = np.linalg.norm((outer - inner)[:, :2], axis=1)
    # Lanes with negative numbers have their inner edge on the left, seen along the road.
    forward = runs_forward(road, record)
    fall = (inner - outer)[:, 2] * (1.0 if (number < 0) == forward else -1.0)
    width_m = round(float(widths_m.mean()), 6)
    bank = float(fall.mean()) / width_m if width_m else 0.0
    banks = fall / np.maximum(widths_m, _NARROW_M)
    # Widths of the file are square to the reference line, which the lane may leave at an angle.
    normals = left_normals(points)[:, :2]
    headings = road.line.poses(course.s_m)[:, 2]
    across = np.stack([-np.sin(headings), np.cos(headings)], axis=1)
    widths_m = widths_m * np.abs((normals * across).sum(axis=1))
    if not forward:
        points, banks, widths_m = points[::-1], banks[::-1], widths_m[::-1]
    kind = KINDS[record.kind]
    drives = kind == "driving"
    return Lane(
        name=_lane_name((road.road_id, index, number)),
        kind=kind,
        center_m=world_points(points, T_body_file),
        width_m=width_m,
        road=road.road_id,
        speed_m_s=(road.speed_m_s(section, number) or DEFAULT_SPEED_M_S) if drives else 0.0,
        junction=bool(road.junction),
        bank=round(bank, 9) + 0.0,
        banks=_where_it_changes(banks, _TWIST),
        widths_m=_where_it_changes(widths_m, _WIDENING_M),
    )


def _where_it_changes(values: Array, least: float) -> tuple[float, ...]:
    """Values that differ by more than the least change; else none."""
    if np.ptp(values) <= least:
        return ()
    return tuple((np.round(values, 9) + 0.0).tolist())


def _make_side_lanes(road: Road, index: int, section: Section, T_body_file: se3.SE3) -> list[Lane]:
    """Furniture lanes on sidewalks, and frontage lanes along the outer edges of roads."""
    made: list[Lane] = []
    for side in (1, -1):
        numbers = sorted((n for n in section.lanes if n * side > 0), key=abs)
        if not numbers or road.junction:
            continue
        outermost = numbers[-1]
        lines: list[tuple[LaneKind, int, float]] = [("frontage", outermost, 1.0)]
        lines += [
            ("furniture", n, 0.0) for n in numbers if KINDS.get(section.lanes[n].kind) == "sidewalk"
        ]
        for kind, number, share in lines:
            course = _trace_edges(road, section, number)
            into = share * (course.outer_m - course.inner_m)
            if kind == "furniture":
                into = side * np.minimum(FURNITURE_M, 0.5 * np.abs(course.outer_m - course.inner_m))
            lift = np.full(len(course.s_m), heights_m(section.lanes[number])[1])
            points = road.points(section, course.s_m, course.inner_m + into, lift)
            points = points if side < 0 else points[::-1]
            name = f"{_lane_name((road.road_id, index, number))}/{kind}"
            width = 0.6 if kind == "furniture" else 0.0
            made.append(
                Lane(name, kind, world_points(points, T_body_file), width, road=road.road_id)
            )
    return made


def _lane_name(key: Key) -> str:
    return f"{key[0]}.{key[1]}.{key[2]}"


def _link_lane(
    network: Network,
    lane: Lane,
    key: Key,
    after: list[Key],
    made: dict[Key, Lane],
    narrow: set[Key],
) -> Lane:
    """Add successors, and adjacent lanes of the same kind, to a lane; narrow ones are passed."""
    road, section, number = key
    side = 1 if number > 0 else -1
    lanes = network.roads[road].sections[section].lanes
    forward = runs_forward(network.roads[road], lanes[number])

    def beside(step: int) -> str:
        other = (road, section, number + step)
        while other in narrow:
            other = (road, section, other[2] + step)
        if other not in made or made[other].kind != lane.kind:
            return ""
        alike = runs_forward(network.roads[road], lanes[other[2]]) == forward
        return _lane_name(other) if alike else ""

    # The centre lies at -side in t; left is +t for traffic along the road.
    inner_is_left = forward == (side < 0)
    left, right = (-side, side) if inner_is_left else (side, -side)
    return replace(
        lane,
        successors=tuple(sorted(_lane_name(k) for k in after)),
        left=beside(left),
        right=beside(right),
    )


def _next_keys(network: Network, key: Key) -> list[Key]:
    """Keys of a lane's successors."""
    road = network.roads[key[0]]
    record = road.sections[key[1]].lanes[key[2]]
    forward = runs_forward(road, record)
    step, target = (1, record.successor) if forward else (-1, record.predecessor)
    index = key[1] + step
    if 0 <= index < len(road.sections):
        return [] if target is None else [(road.road_id, index, target)]
    link = road.successor if forward else road.predecessor
    if link is None:
        return []
    if not link.junction:
        return [] if target is None else [_entry_key(network, link.target, link.contact, target)]
    return list(dict.fromkeys(_through_junction(network, link.target, road, record.number)))


def _through_junction(network: Network, junction: str, road: Road, number: int) -> Iterator[Key]:
    """Keys of the lanes that a lane leads to through a junction."""
    for one in network.junctions[junction]:
        for origin, to in one.lanes:
            if one.incoming == road.road_id and origin == number:
                yield _entry_key(network, one.connecting, one.contact, to)
            if one.direct and one.connecting == road.road_id and to == number:
                link = network.roads[one.incoming].successor
                at_end = link is not None and link.junction and link.target == junction
                yield _entry_key(network, one.incoming, "end" if at_end else "start", origin)


def _entry_key(network: Network, road_id: str, contact: Contact, number: int) -> Key:
    sections = network.roads[road_id].sections
    return (road_id, 0 if contact == "start" else len(sections) - 1, number)


def _tapers(network: Network, key: Key, after: Key) -> bool:
    """Whether a lane has no width where it meets the next one: traffic merges before."""
    ends = []
    for road_id, index, number in (key, after):
        road = network.roads[road_id]
        section = road.sections[index]
        starts = runs_forward(road, section.lanes[number]) == ((road_id, index, number) == after)
        edges = road.boundaries_m(section, np.array([section.start_m if starts else section.end_m]))
        inner = number - (1 if number > 0 else -1)
        ends.append(abs(float(edges[number][0] - edges[inner][0])))
    return min(ends) < TAPERED_M < max(ends)


def _check_gap(network: Network, key: Key, lane: Lane, after: Lane) -> None:
    gap = _gap_m(lane, after)
    if gap > MAX_LINK_GAP_M:
        raise errors.AssetError(
            f"{network.place}: road '{key[0]}': lane {key[2]} ends {gap:.2f} m from lane "
            f"'{after.name}' that it leads to; correct the link or the geometry"
        )


def _gap_m(lane: Lane, after: Lane) -> float:
    return math.dist(lane.center_m[-1], after.center_m[0])
