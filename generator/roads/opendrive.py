"""Reader of OpenDRIVE files (``.xodr``): roads with lanes of varying width, and junctions.

Source: ASAM OpenDRIVE 1.4 (Rev. H) to 1.8. Supported are reference lines, elevation,
superelevation, crossfall, shape, lane offsets, lane sections with widths or borders, heights,
marks, speeds, directions and links, and connections of junctions, also direct ones. Everything
else is counted in ``Network.unused`` (``opendrive_unused``).
"""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Literal, TypeVar
from xml.etree.ElementTree import Element

import numpy as np

from gen_data.core.errors import AssetError
from gen_data.core.safe_xml import parse_xml
from gen_data.roads.lane_graph import stations
from gen_data.roads.opendrive_unused import count_unused
from gen_data.roads.reference_line import (
    Arc,
    Array,
    Curve,
    Line,
    ParamPoly3,
    Placed,
    Poly3,
    ReferenceLine,
    Spiral,
    cubic,
)

MAX_GAP_M = 0.01
"""Largest gap between consecutive pieces of a reference line."""
_MAX_ELEMENTS = 500_000
_MAX_ROADS = 5_000
_MAX_LENGTH_M = 50_000.0
_MAX_LANES_M = 5e5
"""Total length of all lanes; building lane graph and surface takes time in proportion."""
_MAX_TURN_RAD = 100.0
"""Largest turn of one geometry: the quadrature of spirals takes memory in proportion."""
_MAX_POLY3_M, _MAX_SLOPE = 1_000.0, 100.0
_MAX_LANE_WIDTH_M, _MAX_REACH_M = 100.0, 1e4
_CHECK_STEP_M = 10.0
_STATION_GAP_M = 0.05
"""Least distance of stations where records begin."""
NEGATIVE_M = 0.1
"""Widths down to minus this one are read as 0: cubics overshoot where lanes end."""

NO_LIMIT_M_S = 130.0 / 3.6
"""Speed on roads without a limit: the advisory one of German motorways."""

_UNITS_M_S = {"m/s": 1.0, "km/h": 1.0 / 3.6, "mph": 0.44704}

Contact = Literal["start", "end"]
V = TypeVar("V")
Steps = tuple[tuple[float, V], ...]
"""Values from distances on, sorted by distance."""


def value_at(steps: Steps[V], distance_m: float, before: V) -> V:
    """The value at a distance; ``before`` ahead of the first one."""
    found = before
    for start, value in steps:
        if start <= distance_m + 1e-6:
            found = value
    return found


@dataclass(frozen=True, slots=True)
class Piecewise:
    """Piecewise cubic function of s; 0 before the first piece.

    Attributes:
        pieces: ``(start, a, b, c, d)``, sorted by start.
    """

    pieces: tuple[tuple[float, float, float, float, float], ...] = ()

    def __call__(self, s_m: Array, end_m: float = math.inf) -> Array:
        """Values [n] at arc lengths [n]; pieces from ``end_m`` on are not used."""
        values = np.zeros_like(s_m)
        for start, *coefficients in self.pieces:
            if start > end_m - 1e-6:
                break
            here = s_m >= start - 1e-9
            values[here] = cubic(coefficients, s_m[here] - start)
        return values


@dataclass(frozen=True, slots=True)
class Shape:
    """Heights across a road: profiles at stations, interpolated in between.

    Attributes:
        stations: ``(s, pieces)`` in order; pieces ``(start, a, b, c, d)`` over t in order. The
            first and the last piece, and station, extend outwards.
    """

    stations: tuple[tuple[float, tuple[tuple[float, float, float, float, float], ...]], ...] = ()

    def __call__(self, s_m: Array, t_m: Array) -> Array:
        """Heights [n] at arc lengths and distances to the left [n]."""
        starts = np.array([s for s, _ in self.stations])
        upper = np.clip(np.searchsorted(starts, s_m, side="right"), 0, len(starts) - 1)
        lower = np.maximum(upper - 1, 0)
        span = np.maximum(starts[upper] - starts[lower], 1e-9)
        share = np.where(upper > lower, np.clip((s_m - starts[lower]) / span, 0.0, 1.0), 1.0)
        heights = np.zeros_like(t_m)
        for k in np.unique(np.concatenate([lower, upper])):
            weight = np.where(upper == k, share, 0.0) + np.where(
                (lower == k) & (upper > lower), 1.0 - share, 0.0
            )
            heights += weight * _profile(self.stations[k][1], t_m)
        return heights


def _profile(pieces: tuple[tuple[float, ...], ...], t_m: Array) -> Array:
    starts = np.array([piece[0] for piece in pieces])
    which = np.clip(np.searchsorted(starts, t_m + 1e-9, side="right") - 1, 0, None)
    heights = np.zeros_like(t_m)
    for k in np.unique(which):
        here = which == k
        heights[here] = cubic(pieces[k][1:], t_m[here] - starts[k])
    return heights


LINE_WORDS = frozenset({"solid", "broken"})
"""Words of the kinds of marks that are painted."""


@dataclass(frozen=True, slots=True)
class Mark:
    """One or two lines on the outer edge of a lane.

    Attributes:
        kind: ``solid``, ``broken solid``, ``none``, ... as in the file.
        width_m: Width of each line.
    """

    kind: str
    width_m: float
    is_yellow: bool = False

    @property
    def lines(self) -> tuple[str, ...]:
        """``solid`` and ``broken`` lines, from the inside out; of lane 0 from left to right.

        Empty = nothing is painted: kerbs, edges, dots.
        """
        words = tuple(self.kind.split())
        return words if len(words) < 3 and LINE_WORDS.issuperset(words) else ()


@dataclass(frozen=True, slots=True)
class LaneRecord:
    """A lane of one section; ``number`` is positive to the left of the reference line.

    Attributes:
        width_m: Width by distance from the section's origin.
        border_m: ``t`` of its outer edge by that distance, instead of a width; None = not given.
        height_m: Heights of its inner and outer edge over the road; None = not given.
        marks: Lines on its outer edge from distances on, in order.
        speeds_m_s: The lane's speed limits from distances on, in order; 0 = the road's.
        reversed: Whether traffic runs against the direction of its side.
        level: Whether it is level, as are lanes beyond it.
        predecessor, successor: Lane numbers in the adjacent sections; None = no link.
    """

    number: int
    kind: str
    width_m: Piecewise
    border_m: Piecewise | None
    height_m: tuple[float, float] | None
    marks: Steps[Mark]
    speeds_m_s: Steps[float]
    reversed: bool
    level: bool
    predecessor: int | None
    successor: int | None


@dataclass(frozen=True, slots=True)
class Section:
    """Stretch of a road with a constant set of lanes, and of speeds.

    Attributes:
        lanes: Lanes by number, including 0.
        origin_m: Start of the section in the file, from which its records count.
        file_end_m: Its end there; parts of different speed have it in common.
    """

    start_m: float
    end_m: float
    lanes: Mapping[int, LaneRecord]
    origin_m: float
    file_end_m: float

    def mark_spans(self, lane: LaneRecord) -> Iterator[tuple[float, float, Mark]]:
        """Where each line of a lane's outer edge begins and ends [m], in the file's section."""
        starts = [self.origin_m + offset for offset, _ in lane.marks]
        for k, (start, (_, mark)) in enumerate(zip(starts, lane.marks, strict=True)):
            end = starts[k + 1] if k + 1 < len(starts) else self.file_end_m
            if start < min(end, self.file_end_m):
                yield start, min(end, self.file_end_m), mark


@dataclass(frozen=True, slots=True)
class RoadLink:
    """Predecessor or successor of a road: the start or end of a road, or a junction."""

    junction: bool
    target: str
    contact: Contact


@dataclass(frozen=True, slots=True)
class Road:
    """One road of a file.

    Attributes:
        junction: Id of the junction it belongs to; empty = none.
        crossfall_rad: Fall of the surface from the reference line outwards, left and right.
        left_hand: Whether traffic keeps left.
        speeds_m_s: Speed limits from arc lengths on, in order; 0 = not given.
    """

    road_id: str
    junction: str
    line: ReferenceLine
    elevation_m: Piecewise
    superelevation_rad: Piecewise
    crossfall_rad: tuple[Piecewise, Piecewise]
    shape_m: Shape
    lane_offset_m: Piecewise
    sections: tuple[Section, ...]
    predecessor: RoadLink | None
    successor: RoadLink | None
    left_hand: bool
    speeds_m_s: Steps[float]

    def boundaries_m(self, section: Section, s_m: Array) -> dict[int, Array]:
        """``t`` [n] of each lane's outer edge by number; 0 is the centre, at the lane offset."""
        # The offset may jump where sections meet: the one before the end is this section's.
        edges = {0: self.lane_offset_m(s_m, section.end_m)}
        for side in (1, -1):
            t = edges[0]
            for number in sorted((n for n in section.lanes if n * side > 0), key=abs):
                lane = section.lanes[number]
                if lane.border_m is None:
                    width = lane.width_m(s_m - section.origin_m)
                else:
                    width = side * (lane.border_m(s_m - section.origin_m) - t)
                t = t + side * np.maximum(width, 0.0)
                edges[number] = t
        return edges

    def points(self, section: Section, s_m: Array, t_m: Array, lift_m: Array) -> Array:
        """Points [n, 3] at arc lengths, distances to the left and heights over the road.

        The superelevation rolls the whole cross section about the reference line: distances to
        the left are measured along the road's surface. ``lift_m`` is upright.
        """
        banked_m = self._within_level(section, s_m, t_m)
        height_m = np.zeros_like(banked_m)
        left, right = self.crossfall_rad
        if left.pieces or right.pieces:
            fall = np.where(banked_m > 0.0, left(s_m), right(s_m))
            height_m = height_m - np.abs(banked_m) * np.tan(fall)
        if self.shape_m.stations:
            height_m = height_m + self.shape_m(s_m, banked_m)
        roll = self.superelevation_rad(s_m)
        aside_m = banked_m * np.cos(roll) - height_m * np.sin(roll) + (t_m - banked_m)
        z = self.elevation_m(s_m) + banked_m * np.sin(roll) + height_m * np.cos(roll) + lift_m
        return np.column_stack([self.line.points(s_m, aside_m), z])

    def _within_level(self, section: Section, s_m: Array, t_m: Array) -> Array:
        """``t`` [n] at which the lateral profile ends: level lanes keep the height there."""
        edges = None
        for side in (1, -1):
            level = [n for n, lane in section.lanes.items() if n * side > 0 and lane.level]
            if level:
                edges = edges or self.boundaries_m(section, s_m)
                inner = edges[min(level, key=abs) - side]
                t_m = np.minimum(t_m, inner) if side > 0 else np.maximum(t_m, inner)
        return t_m

    def stations(self, start_m: float, end_m: float, step_m: float) -> Array:
        """Arc lengths [n] at most a step apart, with those where a record of the file begins."""
        even = stations(start_m, end_m, step_m)
        pieces = [self.elevation_m, self.superelevation_rad, *self.crossfall_rad]
        begins = {piece[0] for one in (*pieces, self.lane_offset_m) for piece in one.pieces}
        begins |= {s for s, _ in self.shape_m.stations}
        for section in self.sections:
            here = section.start_m < end_m and section.end_m > start_m
            for lane in section.lanes.values() if here else ():
                record = lane.border_m or lane.width_m
                begins |= {section.origin_m + piece[0] for piece in record.pieces}
        made = even
        for s_m in sorted(begins):
            if start_m < s_m < end_m and np.abs(made - s_m).min() > _STATION_GAP_M:
                made = np.sort(np.append(made, s_m))
        return made

    def speed_m_s(self, section: Section, number: int) -> float:
        """Speed limit of a lane in a section; 0 = not given."""
        lane = section.lanes[number]
        own = value_at(lane.speeds_m_s, section.start_m - section.origin_m, 0.0)
        return own or value_at(self.speeds_m_s, section.start_m, 0.0)


@dataclass(frozen=True, slots=True)
class Connection:
    """Connection through a junction; ``lanes`` are pairs (from, to) of lane numbers.

    A ``direct`` one joins two roads without a road in between, and leads both ways.
    """

    incoming: str
    connecting: str
    contact: Contact
    lanes: tuple[tuple[int, int], ...]
    direct: bool = False


@dataclass(frozen=True, slots=True)
class Network:
    """Content of a file.

    Attributes:
        roads: Roads by id, in the file's order.
        junctions: Connections by junction id.
        unused: Names of elements that have no effect here, and how many there are.
        place: Name of the file in error messages.
    """

    roads: Mapping[str, Road]
    junctions: Mapping[str, tuple[Connection, ...]]
    place: str
    unused: Mapping[str, int]


def read_opendrive(data: bytes, place: str) -> Network:
    """Read the roads of an OpenDRIVE file.

    Raises:
        AssetError: if it is malformed, incomplete, too large, or has gaps or broken links; the
            message names the road.
    """
    declaration = data.find(b"<?xml")
    if declaration > 0 and b"<" not in re.sub(rb"<!--.*?-->", b"", data[:declaration], flags=re.S):
        data = data[declaration:]  # An empty line or a licence before it is malformed XML.
    root = parse_xml(data, place, "OpenDRIVE", "an OpenDRIVE file", _MAX_ELEMENTS)
    elements = root.findall("road")
    if not elements:
        raise AssetError(f"{place}: holds no roads; export it again")
    if len(elements) > _MAX_ROADS:
        raise AssetError(f"{place}: more than {_MAX_ROADS} roads; cut out the part that matters")
    roads: dict[str, Road] = {}
    lanes_m = 0.0
    for element in elements:
        road_id = element.get("id", "")
        where = f"{place}: road '{road_id[:40]}'"
        if not road_id or road_id in roads:
            raise AssetError(f"{where}: its id is missing or taken; give it a unique one")
        try:
            roads[road_id] = road = _read_road(element)
            lanes_m += sum(len(x.lanes) * (x.end_m - x.start_m) for x in road.sections)
            if lanes_m <= _MAX_LANES_M:
                _check_extents(road)
        except KeyError as error:
            raise AssetError(f"{where}: {error} is missing; add it") from None
        except ValueError as error:
            raise AssetError(f"{where}: {error}") from None
        if lanes_m > _MAX_LANES_M:
            raise AssetError(
                f"{place}: more than {_MAX_LANES_M / 1e3:g} km of lanes; cut out the part that "
                "matters"
            )
    junctions = {}
    for element in root.findall("junction"):
        name = element.get("id", "")
        try:
            virtual = element.get("type") == "virtual"
            connections = () if virtual else element.findall("connection")
            junctions[name] = tuple(_read_connection(e) for e in connections)
        except (KeyError, ValueError) as error:
            raise AssetError(f"{place}: junction '{name[:40]}': malformed ({error})") from None
    network = Network(roads, junctions, place, count_unused(root))
    _check_links(network)
    return network


def _read_road(element: Element) -> Road:
    line = _read_line(element)
    length_m = _read_number(element, "length")
    if abs(length_m - line.length_m) > MAX_GAP_M:
        raise ValueError(
            f"its length is {length_m:g} m, its geometry has {line.length_m:g} m; correct one"
        )
    lanes = _require_child(element, "lanes")
    junction = element.get("junction", "-1")
    speeds = tuple(
        (_read_number(e, "s"), _read_speed(e.find("speed"))) for e in element.findall("type")
    )
    lateral = element.find("lateralProfile")
    return Road(
        road_id=element.attrib["id"],
        junction="" if junction == "-1" else junction,
        line=line,
        elevation_m=_read_piecewise(element.findall("elevationProfile/elevation")),
        superelevation_rad=_read_piecewise(element.findall("lateralProfile/superelevation")),
        crossfall_rad=_read_crossfall(lateral),
        shape_m=_read_shape(lateral),
        lane_offset_m=_read_piecewise(lanes.findall("laneOffset")),
        sections=_read_sections(lanes, line.length_m, speeds := sorted_steps(speeds)),
        predecessor=_read_road_link(element.find("link/predecessor")),
        successor=_read_road_link(element.find("link/successor")),
        left_hand=element.get("rule", "RHT") == "LHT",
        speeds_m_s=speeds,
    )


def sorted_steps(steps: Iterable[tuple[float, V]]) -> Steps[V]:
    """Values sorted by distance; of several at one distance the last one."""
    return tuple(sorted(dict(steps).items(), key=lambda step: step[0]))


def _read_crossfall(lateral: Element | None) -> tuple[Piecewise, Piecewise]:
    """Crossfall of the left and the right side."""
    found = [] if lateral is None else lateral.findall("crossfall")
    left, right = (
        _read_piecewise(e for e in found if e.get("side", "both") in (side, "both"))
        for side in ("left", "right")
    )
    return left, right


def _read_shape(lateral: Element | None) -> Shape:
    profiles: dict[float, list[tuple[float, float, float, float, float]]] = {}
    for element in [] if lateral is None else lateral.findall("shape"):
        piece = (_read_number(element, "t"), *_read_cubic(element, ""))
        profiles.setdefault(_read_number(element, "s"), []).append(piece)
    return Shape(tuple((s, tuple(sorted(profiles[s]))) for s in sorted(profiles)))


def _check_extents(road: Road) -> None:
    """Raise ValueError if a lane is too wide, or the road lies too far aside, up or down."""
    for section in road.sections:
        steps = math.ceil((section.end_m - section.start_m) / _CHECK_STEP_M)
        s_m = np.linspace(section.start_m, section.end_m, steps + 1)
        # Overflow yields inf or NaN, which no comparison below accepts.
        with np.errstate(over="ignore", invalid="ignore"):
            widths_m = dict(_raw_widths_m(road, section, s_m))
            edges_m = np.stack(list(road.boundaries_m(section, s_m).values()))
            heights_m = np.stack(
                [road.points(section, s_m, t, np.zeros_like(t))[:, 2] for t in edges_m]
            )
        for number, widths in widths_m.items():
            width_m, least = float(np.abs(widths).max()), int(np.argmin(widths))
            if widths[least] < -NEGATIVE_M:
                raise ValueError(
                    f"lane {number} is {widths[least]:.3g} m wide at s = {s_m[least]:g} m; correct "
                    "its width or border"
                )
            if not width_m <= _MAX_LANE_WIDTH_M:
                raise ValueError(
                    f"lane {number} is {width_m:.3g} m wide; at most {_MAX_LANE_WIDTH_M:g} m are "
                    "read, correct its width"
                )
        reach_m = float(np.maximum(np.abs(edges_m), np.abs(heights_m)).max())
        if not reach_m <= _MAX_REACH_M:
            raise ValueError(
                f"it reaches {reach_m:.3g} m aside, up or down; at most {_MAX_REACH_M:g} m are "
                "read, correct its elevation and lane offset"
            )


def _raw_widths_m(road: Road, section: Section, s_m: Array) -> Iterator[tuple[int, Array]]:
    """Widths [n] by lane as in the file, where they may be negative."""
    edges = road.boundaries_m(section, s_m)
    for number, lane in section.lanes.items():
        if lane.border_m is None:
            yield number, lane.width_m(s_m - section.origin_m)
        elif number:
            side = 1 if number > 0 else -1
            yield number, side * (lane.border_m(s_m - section.origin_m) - edges[number - side])


def _read_line(element: Element) -> ReferenceLine:
    pieces: list[Placed] = []
    s = 0.0
    for geometry in element.findall("planView/geometry"):
        curve = _read_curve(geometry)
        x, y, heading = (_read_number(geometry, name) for name in ("x", "y", "hdg"))
        if abs(_read_number(geometry, "s") - s) > MAX_GAP_M:
            raise ValueError(f"its geometry has a gap at s = {s:g} m; make the pieces contiguous")
        piece = Placed(s, x, y, heading, curve)
        if pieces:
            end = ReferenceLine((pieces[-1],)).poses(np.array([s]))[0]
            gap = math.hypot(end[0] - x, end[1] - y)
            if gap > MAX_GAP_M:
                raise ValueError(
                    f"its geometry has a gap of {gap:.3f} m at s = {s:g} m; at most {MAX_GAP_M} m "
                    "are allowed, correct x and y"
                )
        pieces.append(piece)
        s += curve.length_m
    if not pieces:
        raise ValueError("it has no geometry; add a planView")
    return ReferenceLine(tuple(pieces))


def _read_curve(geometry: Element) -> Curve:
    length_m = _read_number(geometry, "length")
    if not 0.0 < length_m <= _MAX_LENGTH_M:
        raise ValueError(f"a geometry is {length_m:g} m long; expected 0 to {_MAX_LENGTH_M:g} m")
    for kind in geometry:
        if kind.tag == "line":
            return Line(length_m)
        if kind.tag == "arc":
            return Arc(length_m, _read_curvature(kind, "curvature", length_m))
        if kind.tag == "spiral":
            start, end = (
                _read_curvature(kind, name, length_m) for name in ("curvStart", "curvEnd")
            )
            return Spiral(length_m, start, end)
        if kind.tag == "poly3":
            return _check_poly3(length_m, _read_cubic(kind, ""))
        if kind.tag == "paramPoly3":
            p_end = length_m if kind.get("pRange", "normalized") == "arcLength" else 1.0
            return ParamPoly3(length_m, _read_cubic(kind, "U"), _read_cubic(kind, "V"), p_end)
    raise ValueError("a geometry is neither line, arc, spiral, poly3 nor paramPoly3; convert it")


def _read_curvature(element: Element, name: str, length_m: float) -> float:
    curvature = _read_number(element, name)
    if abs(curvature) * length_m > _MAX_TURN_RAD:
        raise ValueError(
            f"a curvature of {curvature:g} per metre over {length_m:g} m turns by more than "
            f"{_MAX_TURN_RAD:g} rad; correct it"
        )
    return curvature


def _check_poly3(length_m: float, v: tuple[float, float, float, float]) -> Poly3:
    """A cubic whose arc length can be inverted in bounded time."""
    slope = max(abs(v[1]), 2.0 * abs(v[2]) * length_m, 3.0 * abs(v[3]) * length_m**2)
    if slope > _MAX_SLOPE or length_m > _MAX_POLY3_M:
        raise ValueError(
            f"a poly3 with a slope of {slope:.3g} over {length_m:g} m; at most {_MAX_SLOPE:g} over "
            f"{_MAX_POLY3_M:g} m are read, export it as paramPoly3"
        )
    return Poly3(length_m, v)


def _read_cubic(element: Element, suffix: str) -> tuple[float, float, float, float]:
    a, b, c, d = (_read_number(element, letter + suffix) for letter in "abcd")
    return (a, b, c, d)


def _read_sections(
    lanes: Element, length_m: float, speeds_m_s: Steps[float]
) -> tuple[Section, ...]:
    elements = lanes.findall("laneSection")
    if not elements:
        raise ValueError("it has no lane sections; add one")
    starts = [_read_number(element, "s") for element in elements]
    ends = [*starts[1:], length_m]
    if abs(starts[0]) > MAX_GAP_M or any(a >= b for a, b in zip(starts, ends, strict=True)):
        raise ValueError("its lane sections do not start at s = 0 in ascending order; sort them")
    made: list[Section] = []
    for element, start, end in zip(elements, starts, ends, strict=True):
        records = [_read_lane(lane) for lane in element.iterfind("*/lane")]
        numbers = {record.number: record for record in records}
        for side in (1, -1):
            here = sorted((n for n in numbers if n * side > 0), key=abs)
            if here != [side * (k + 1) for k in range(len(here))]:
                raise ValueError(f"the lanes at s = {start:g} m are not numbered without gaps")
        made += _split_by_speed(Section(start, end, numbers, start, end), speeds_m_s)
    return tuple(made)


def _split_by_speed(section: Section, speeds_m_s: Steps[float]) -> Iterator[Section]:
    """A section in pieces, within each of which the speed of every lane is constant."""
    cuts = {s for s, _ in speeds_m_s}
    for lane in section.lanes.values():
        cuts |= {section.origin_m + offset for offset, _ in lane.speeds_m_s}

    def limits(s_m: float) -> list[float]:
        road = value_at(speeds_m_s, s_m, 0.0)
        own = (
            value_at(lane.speeds_m_s, s_m - section.origin_m, 0.0)
            for number, lane in section.lanes.items()
            if number
        )
        return [speed or road for speed in own]

    starts = [section.start_m]
    for cut in sorted(cuts):
        inside = section.start_m + MAX_GAP_M < cut < section.end_m - MAX_GAP_M
        if inside and limits(cut) != limits(starts[-1]):
            starts.append(cut)
    ends = [*starts[1:], section.end_m]
    for k, (start, end) in enumerate(zip(starts, ends, strict=True)):
        lanes = {
            number: replace(
                lane,
                predecessor=lane.predecessor if k == 0 else number,
                successor=lane.successor if k == len(starts) - 1 else number,
            )
            for number, lane in section.lanes.items()
        }
        yield Section(start, end, lanes, section.origin_m, section.file_end_m)


def _read_lane(element: Element) -> LaneRecord:
    height = element.find("height")
    links = [element.find(f"link/{tag}") for tag in ("predecessor", "successor")]
    number = int(element.attrib["id"])
    width = _read_piecewise(element.findall("width"), "sOffset")
    border = _read_piecewise(element.findall("border"), "sOffset")
    if number != 0 and not width.pieces and not border.pieces:
        raise ValueError(f"lane {number} has no width; add one")
    edges = None
    if height is not None:
        edges = (_read_number(height, "inner"), _read_number(height, "outer"))
    before, after = (None if link is None else int(link.attrib["id"]) for link in links)
    return LaneRecord(
        number,
        element.get("type", "none"),
        width,
        # Where a lane has both, the standard prefers the width.
        border if border.pieces and not width.pieces else None,
        edges,
        marks=sorted_steps(_read_marks(element)),
        speeds_m_s=sorted_steps(
            (_read_number(e, "sOffset"), _read_speed(e)) for e in element.findall("speed")
        ),
        reversed=element.get("direction", "standard") == "reversed",
        level=element.get("level", "false") in ("true", "1"),
        predecessor=before,
        successor=after,
    )


def _read_marks(lane: Element) -> Iterator[tuple[float, Mark]]:
    for element in lane.findall("roadMark"):
        offset = _read_number(element, "sOffset") if "sOffset" in element.attrib else 0.0
        width_m = float(element.get("width", "0.12")) or 0.12
        is_yellow = element.get("color") == "yellow"
        yield offset, Mark(element.get("type", "none"), width_m, is_yellow)


def _read_piecewise(elements: Iterable[Element], start: str = "s") -> Piecewise:
    pieces = [(_read_number(e, start), *_read_cubic(e, "")) for e in elements]
    return Piecewise(tuple(sorted(pieces, key=lambda piece: round(piece[0], 6))))


def _read_road_link(element: Element | None) -> RoadLink | None:
    if element is None or "elementS" in element.attrib:
        return None  # Within a road, by a virtual junction: there is no lane graph of it.
    junction = element.get("elementType", "road") == "junction"
    return RoadLink(junction, element.attrib["elementId"], _read_contact(element))


def _read_connection(element: Element) -> Connection:
    links = [link.attrib for link in element.findall("laneLink")]
    direct = "linkedRoad" in element.attrib
    through = element.attrib["linkedRoad" if direct else "connectingRoad"]
    lanes = tuple((int(link["from"]), int(link["to"])) for link in links)
    contact = _read_contact(element)
    return Connection(element.attrib["incomingRoad"], through, contact, lanes, direct)


def _read_contact(element: Element) -> Contact:
    return "end" if element.get("contactPoint", "start") == "end" else "start"


def _read_speed(element: Element | None) -> float:
    """Speed limit [m/s]; 0 = not given."""
    text = "" if element is None else element.get("max", "")
    if element is None or text in ("undefined", ""):
        return 0.0
    if text == "no limit":
        return NO_LIMIT_M_S
    unit = element.get("unit") or "m/s"
    if unit not in _UNITS_M_S:
        raise ValueError(
            f"the unit '{unit[:40]}' of a speed is unknown; expected {', '.join(_UNITS_M_S)}"
        )
    return float(text) * _UNITS_M_S[unit]


def _read_number(element: Element, name: str) -> float:
    value = float(element.attrib[name])
    if not math.isfinite(value):
        raise ValueError(f"{name} is not finite; correct it")
    return value


def _require_child(element: Element, tag: str) -> Element:
    child = element.find(tag)
    if child is None:
        raise ValueError(f"it has no <{tag}>; add it")
    return child


def _check_links(network: Network) -> None:
    """Raise AssetError for links without a target."""
    for road in network.roads.values():
        for word, link in (("predecessor", road.predecessor), ("successor", road.successor)):
            known = network.junctions if link and link.junction else network.roads
            if link and link.target not in known:
                raise AssetError(
                    f"{network.place}: road '{road.road_id}': its {word} '{link.target[:40]}' is "
                    "not in the file; add it or remove the link"
                )
        for number, section in enumerate(road.sections[:-1]):
            after = road.sections[number + 1].lanes
            for lane in section.lanes.values():
                if lane.successor is not None and lane.successor not in after:
                    raise AssetError(
                        f"{network.place}: road '{road.road_id}': lane {lane.number} goes on as "
                        f"lane {lane.successor}, which the next section lacks; correct the link"
                    )
    for name, connections in network.junctions.items():
        for one in connections:
            for target in (one.incoming, one.connecting):
                if target not in network.roads:
                    raise AssetError(
                        f"{network.place}: junction '{name}': road '{target[:40]}' is not in the "
                        "file; add it or remove the connection"
                    )
