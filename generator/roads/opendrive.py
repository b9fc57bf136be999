"""Reader of OpenDRIVE files (``.xodr``): roads with lanes of varying width, and junctions.

Source: ASAM OpenDRIVE 1.4 (Rev. H) to 1.7. Supported are reference lines, elevation,
superelevation, lane offsets, lane sections with widths, heights, marks and links, and junction
connections. Elements that describe neither lanes nor surface (objects, signals, controllers,
railways) are ignored.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal
from xml.etree.ElementTree import Element

import numpy as np

from gen_data.generator.core.errors import AssetError
from gen_data.generator.core.safe_xml import parse_xml
from gen_data.generator.roads.reference_line import (
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

Contact = Literal["start", "end"]


@dataclass(frozen=True, slots=True)
class Piecewise:
    """Piecewise cubic function of s; 0 before the first piece.

    Attributes:
        pieces: ``(start, a, b, c, d)``, sorted by start.
    """

    pieces: tuple[tuple[float, float, float, float, float], ...] = ()

    def __call__(self, s_m: Array) -> Array:
        """Values [n] at arc lengths [n]."""
        values = np.zeros_like(s_m)
        for start, *coefficients in self.pieces:
            here = s_m >= start - 1e-9
            values[here] = cubic(coefficients, s_m[here] - start)
        return values


@dataclass(frozen=True, slots=True)
class Mark:
    """A line on the outer edge of a lane.

    Attributes:
        kind: ``solid``, ``broken``, ``none``, ... as in the file.
    """

    kind: str
    width_m: float


@dataclass(frozen=True, slots=True)
class LaneRecord:
    """A lane of one section; ``number`` is positive to the left of the reference line.

    Attributes:
        width_m: Width by distance from the section's start.
        height_m: Heights of its inner and outer edge over the road; None = not given.
        predecessor, successor: Lane numbers in the adjacent sections; None = no link.
    """

    number: int
    kind: str
    width_m: Piecewise
    height_m: tuple[float, float] | None
    mark: Mark
    predecessor: int | None
    successor: int | None


@dataclass(frozen=True, slots=True)
class Section:
    """Stretch of a road with a constant set of lanes; ``lanes`` by number, including 0."""

    start_m: float
    end_m: float
    lanes: Mapping[int, LaneRecord]


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
        left_hand: Whether traffic keeps left.
        speed_m_s: Speed limit; 0 = not given.
    """

    road_id: str
    junction: str
    line: ReferenceLine
    elevation_m: Piecewise
    superelevation_rad: Piecewise
    lane_offset_m: Piecewise
    sections: tuple[Section, ...]
    predecessor: RoadLink | None
    successor: RoadLink | None
    left_hand: bool
    speed_m_s: float

    def boundaries_m(self, section: Section, s_m: Array) -> dict[int, Array]:
        """``t`` [n] of each lane's outer edge by number; 0 is the centre, at the lane offset."""
        edges = {0: self.lane_offset_m(s_m)}
        for side in (1, -1):
            t = edges[0]
            for number in sorted((n for n in section.lanes if n * side > 0), key=abs):
                width = section.lanes[number].width_m(s_m - section.start_m)
                t = t + side * np.maximum(width, 0.0)
                edges[number] = t
        return edges

    def points(self, s_m: Array, t_m: Array, lift_m: Array) -> Array:
        """Points [n, 3] at arc lengths, distances to the left and heights over the road."""
        flat = self.line.points(s_m, t_m)
        z = self.elevation_m(s_m) + t_m * np.tan(self.superelevation_rad(s_m)) + lift_m
        return np.column_stack([flat, z])


@dataclass(frozen=True, slots=True)
class Connection:
    """Connection through a junction; ``lanes`` are pairs (from, to) of lane numbers."""

    incoming: str
    connecting: str
    contact: Contact
    lanes: tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class Network:
    """Content of a file.

    Attributes:
        roads: Roads by id, in the file's order.
        junctions: Connections by junction id.
        place: Name of the file in error messages.
    """

    roads: Mapping[str, Road]
    junctions: Mapping[str, tuple[Connection, ...]]
    place: str


def read_opendrive(data: bytes, place: str) -> Network:
    """Read the roads of an OpenDRIVE file.

    Raises:
        AssetError: if it is malformed, incomplete, too large, or has gaps or broken links; the
            message names the road.
    """
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
            raise AssetError(f"{where}: its id is missing or taken; give it one of its own")
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
            junctions[name] = tuple(_read_connection(e) for e in element.findall("connection"))
        except (KeyError, ValueError) as error:
            raise AssetError(f"{place}: junction '{name[:40]}': malformed ({error})") from None
    network = Network(roads, junctions, place)
    _check_links(network)
    return network


def _read_road(element: Element) -> Road:
    line = _read_line(element)
    length_m = _read_number(element, "length")
    if abs(length_m - line.length_m) > MAX_GAP_M:
        raise ValueError(
            f"its length is {length_m:g} m, that of its geometry {line.length_m:g} m; correct one"
        )
    lanes = _require_child(element, "lanes")
    junction = element.get("junction", "-1")
    speed = element.find("type/speed")
    return Road(
        road_id=element.attrib["id"],
        junction="" if junction == "-1" else junction,
        line=line,
        elevation_m=_read_piecewise(element.findall("elevationProfile/elevation")),
        superelevation_rad=_read_piecewise(element.findall("lateralProfile/superelevation")),
        lane_offset_m=_read_piecewise(lanes.findall("laneOffset")),
        sections=_read_sections(lanes, line.length_m),
        predecessor=_read_road_link(element.find("link/predecessor")),
        successor=_read_road_link(element.find("link/successor")),
        left_hand=element.get("rule", "RHT") == "LHT",
        speed_m_s=0.0 if speed is None else _read_speed(speed),
    )


def _check_extents(road: Road) -> None:
    """Raise ValueError if a lane is too wide, or the road lies too far aside, up or down."""
    for section in road.sections:
        steps = math.ceil((section.end_m - section.start_m) / _CHECK_STEP_M)
        s_m = np.linspace(section.start_m, section.end_m, steps + 1)
        # Overflow yields inf or NaN, which no comparison below accepts.
        with np.errstate(over="ignore", invalid="ignore"):
            widths_m = {
                number: float(np.abs(lane.width_m(s_m - section.start_m)).max())
                for number, lane in section.lanes.items()
            }
            edges_m = np.stack(list(road.boundaries_m(section, s_m).values()))
            heights_m = road.elevation_m(s_m) + edges_m * np.tan(road.superelevation_rad(s_m))
        for number, width_m in widths_m.items():
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


def _read_sections(lanes: Element, length_m: float) -> tuple[Section, ...]:
    elements = lanes.findall("laneSection")
    if not elements:
        raise ValueError("it has no lane sections; add one")
    starts = [_read_number(element, "s") for element in elements]
    ends = [*starts[1:], length_m]
    if abs(starts[0]) > MAX_GAP_M or any(a >= b for a, b in zip(starts, ends, strict=True)):
        raise ValueError("its lane sections do not start at s = 0 in ascending order; sort them")
    made = []
    for element, start, end in zip(elements, starts, ends, strict=True):
        records = [_read_lane(lane) for lane in element.iterfind("*/lane")]
        numbers = {record.number: record for record in records}
        for side in (1, -1):
            here = sorted((n for n in numbers if n * side > 0), key=abs)
            if here != [side * (k + 1) for k in range(len(here))]:
                raise ValueError(f"the lanes at s = {start:g} m are not numbered without gaps")
        made.append(Section(start, end, numbers))
    return tuple(made)


def _read_lane(element: Element) -> LaneRecord:
    mark = element.find("roadMark")
    height = element.find("height")
    links = [element.find(f"link/{tag}") for tag in ("predecessor", "successor")]
    number = int(element.attrib["id"])
    width = _read_piecewise(element.findall("width"), "sOffset")
    if number != 0 and not width.pieces:
        raise ValueError(f"lane {number} has no width; add one")
    line, edges = Mark("none", 0.0), None
    if mark is not None:
        line = Mark(mark.get("type", "none"), float(mark.get("width", "0.12")) or 0.12)
    if height is not None:
        edges = (_read_number(height, "inner"), _read_number(height, "outer"))
    before, after = (None if link is None else int(link.attrib["id"]) for link in links)
    kind = element.get("type", "none")
    return LaneRecord(number, kind, width, edges, line, predecessor=before, successor=after)


def _read_piecewise(elements: Iterable[Element], start: str = "s") -> Piecewise:
    pieces = [(_read_number(e, start), *_read_cubic(e, "")) for e in elements]
    return Piecewise(tuple(sorted(pieces)))


def _read_road_link(element: Element | None) -> RoadLink | None:
    if element is None:
        return None
    junction = element.get("elementType", "road") == "junction"
    return RoadLink(junction, element.attrib["elementId"], _read_contact(element))


def _read_connection(element: Element) -> Connection:
    links = [link.attrib for link in element.findall("laneLink")]
    roads = element.attrib["incomingRoad"], element.attrib["connectingRoad"]
    lanes = tuple((int(link["from"]), int(link["to"])) for link in links)
    return Connection(*roads, _read_contact(element), lanes)


def _read_contact(element: Element) -> Contact:
    return "end" if element.get("contactPoint", "start") == "end" else "start"


def _read_speed(element: Element) -> float:
    text = element.get("max", "")
    if text in ("no limit", "undefined", ""):
        return 0.0
    factor = {"km/h": 1 / 3.6, "mph": 0.44704}.get(element.get("unit", "m/s"), 1.0)
    return float(text) * factor


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
