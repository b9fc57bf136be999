"""Text of an OpenDRIVE file: roads, their lanes, heights, marks and links, and junctions."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from xml.etree.ElementTree import Element, SubElement
from xml.sax.saxutils import escape

import numpy as np

from gen_data.core.interfaces import AssetLibrary
from gen_data.core.lane_geometry import border_line
from gen_data.core.scene import Lane, Scene
from gen_data.core.se3 import Array
from gen_data.exporters.opendrive_roads import TYPES, RoadPlan, Strip, plan_roads
from gen_data.exporters.road_map import Paint, PaintIndex, find_paint

REVISION = ("1", "7")
DATE = "2020-01-01T00:00:00"
LEVEL_M = 1e-5
"""Heights that follow from their neighbours within this have no record."""
SPECIAL = re.compile('[&<>"]')
MARK_M = 0.12
MARKS = {
    ("solid", False): "solid", ("dashed", False): "broken",
    ("solid", True): "solid solid", ("dashed", True): "broken broken",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Place:
    """A lane in the file: its road, number and direction."""

    plan: RoadPlan
    number: int
    forward: bool

    @property
    def entry(self) -> str:
        """End of the road at which traffic comes in."""
        return "start" if self.forward else "end"

    @property
    def exit(self) -> str:
        """End of the road at which traffic leaves."""
        return "end" if self.forward else "start"


@dataclass(frozen=True, eq=False)
class Streets:
    """All roads of a scene, and how their lanes are linked.

    Attributes:
        places: Place of each lane by name.
        before: Names of the lanes that lead to a lane.
        junctions: Id of each junction by name of its element.
    """

    plans: tuple[RoadPlan, ...]
    lanes: Mapping[str, Lane]
    places: Mapping[str, Place]
    before: Mapping[str, Sequence[str]]
    junctions: Mapping[str, int]

    def successors(self, name: str) -> list[str]:
        """Lanes in the file to which a lane leads."""
        return [other for other in self.lanes[name].successors if other in self.places]

    def neighbours(self, plan: RoadPlan, end: str) -> dict[int, list[str]]:
        """Lanes beyond one end of a road, by number of the lane that leads to or from them."""
        found: dict[int, list[str]] = {}
        for number, strip in plan.numbered():
            if strip.lane is None:
                continue
            name, place = strip.lane.name, Place(plan, number, strip.forward)
            beyond = self.successors(name) if place.exit == end else self.before.get(name, ())
            if beyond:
                found[number] = list(beyond)
        return found


def opendrive_bytes(scene: Scene, assets: AssetLibrary, name: str) -> bytes:
    """Content of the file of a scene, UTF-8."""
    streets = _streets(scene)
    root = Element("OpenDRIVE")
    points = np.concatenate([plan.line_m for plan in streets.plans])
    (west, south), (east, north) = points.min(axis=0), points.max(axis=0)
    header = {"revMajor": REVISION[0], "revMinor": REVISION[1], "name": name, "date": DATE}
    edges = {"north": north, "south": south, "east": east, "west": west}
    SubElement(root, "header", header | {key: _text(value) for key, value in edges.items()})
    paint = find_paint(scene, assets)
    crosswalks = _owned_crosswalks(scene, streets.plans)
    for plan in streets.plans:
        _add_road(root, plan, streets, paint, crosswalks.get(plan.number, []))
    for junction, number in streets.junctions.items():
        _add_junction(root, junction, number, streets)
    lines = ['<?xml version="1.0" encoding="UTF-8"?>']
    _add_lines(lines, root, "")
    return "\n".join([*lines, ""]).encode()


def _add_lines(lines: list[str], element: Element, indent: str) -> None:
    """Add the lines of an element without text; ``ElementTree`` takes three times as long."""
    values = "".join([f' {key}="{_escape(value)}"' for key, value in element.items()])
    if not len(element):
        lines.append(f"{indent}<{element.tag}{values} />")
        return
    lines.append(f"{indent}<{element.tag}{values}>")
    for child in element:
        _add_lines(lines, child, indent + "  ")
    lines.append(f"{indent}</{element.tag}>")


def _escape(value: str) -> str:
    return escape(value, {'"': "&quot;"}) if SPECIAL.search(value) else value


def _streets(scene: Scene) -> Streets:
    plans = plan_roads(scene.lanes)
    lanes = {lane.name: lane for lane in scene.lanes}
    places = {
        strip.lane.name: Place(plan, number, strip.forward)
        for plan in plans
        for number, strip in plan.numbered()
        if strip.lane is not None
    }
    before: dict[str, list[str]] = {}
    for name in places:
        for other in lanes[name].successors:
            before.setdefault(other, []).append(name)
    roads = dict.fromkeys(plan.name for plan in plans if plan.junction)
    junctions = {road: len(plans) + k for k, road in enumerate(roads, 1)}
    return Streets(plans, lanes, places, before, junctions)


def _text(value: float) -> str:
    return f"{round(float(value), 9) + 0.0:.12g}"


def _cubic(parent: Element, tag: str, at: Mapping[str, float], values: Sequence[float]) -> None:
    numbers = dict(zip("abcd", (*values, 0.0, 0.0, 0.0, 0.0)[:4], strict=True))
    SubElement(parent, tag, {key: _text(v) for key, v in {**at, **numbers}.items()})


def _add_road(
    root: Element,
    plan: RoadPlan,
    streets: Streets,
    paint: PaintIndex,
    crosswalks: Sequence[tuple[int, Lane]],
) -> None:
    junction = streets.junctions[plan.name] if plan.junction else -1
    facts = {"name": plan.name, "length": _text(plan.s_m[-1]), "id": str(plan.number)}
    rule = "LHT" if plan.left_hand else "RHT"
    road = SubElement(root, "road", facts | {"junction": str(junction), "rule": rule})
    links: dict[str, dict[int, int]] = {}
    link = SubElement(road, "link")
    for tag, end in (("predecessor", "start"), ("successor", "end")):
        target, links[tag] = _road_link(plan, end, streets)
        if target:
            SubElement(link, tag, target)
    _add_plan_view(road, plan)
    _add_heights(road, plan)
    _add_lanes(road, plan, links, paint)
    if crosswalks:
        objects = SubElement(road, "objects")
        for number, lane in crosswalks:
            _add_crosswalk(objects, plan, lane, number)


def _road_link(plan: RoadPlan, end: str, streets: Streets) -> tuple[dict[str, str], dict[int, int]]:
    """Attributes of a road's link at one end, and the linked numbers of lanes; empty = none."""
    beyond = streets.neighbours(plan, end)
    names = [name for names in beyond.values() for name in names]
    crossing = [streets.places[name].plan.name for name in names
                if streets.places[name].plan.junction]  # fmt: skip
    if crossing and not plan.junction:
        return {"elementType": "junction", "elementId": str(streets.junctions[crossing[0]])}, {}
    if not names:
        return {}, {}
    target = streets.places[names[0]].plan
    linked: dict[int, int] = {}
    contact = ""
    for number, others in beyond.items():
        for other in others:
            place = streets.places[other]
            if place.plan is target and number not in linked:
                linked[number] = place.number
                leads = streets.lanes[other].name in _after(plan, number, streets)
                contact = contact or (place.entry if leads else place.exit)
    return {"elementType": "road", "elementId": str(target.number), "contactPoint": contact}, linked


def _after(plan: RoadPlan, number: int, streets: Streets) -> list[str]:
    strip = dict(plan.numbered())[number]
    return streets.successors(strip.lane.name) if strip.lane is not None else []


def _add_plan_view(road: Element, plan: RoadPlan) -> None:
    view = SubElement(road, "planView")
    for piece in plan.geometry:
        at = {"s": piece.s_m, "x": piece.x_m, "y": piece.y_m, "hdg": piece.heading_rad,
              "length": piece.length_m}  # fmt: skip
        element = SubElement(view, "geometry", {key: _text(v) for key, v in at.items()})
        if not piece.u:
            SubElement(element, "line")
            continue
        numbers = {f"{letter}{axis}": _text(value)
                   for axis, values in (("U", piece.u), ("V", piece.v))
                   for letter, value in zip("abcd", values, strict=True)}  # fmt: skip
        SubElement(element, "paramPoly3", {**numbers, "pRange": "normalized"})


def _add_heights(road: Element, plan: RoadPlan) -> None:
    """Heights of the reference line, and of the strips over it."""
    elevation = SubElement(road, "elevationProfile")
    s_m, z_m = plan.s_m, plan.z_m
    slopes = np.diff(z_m) / np.diff(s_m)
    for k in _turns(slopes[:, None] * np.diff(s_m)[:, None].clip(1.0), LEVEL_M):
        _cubic(elevation, "elevation", {"s": s_m[k]}, (z_m[k], slopes[k]))
    pieces = list(_profile(plan))
    profile = np.stack([np.stack([a, b], axis=1) for _, a, b in pieces], axis=1)
    lateral = SubElement(road, "lateralProfile")
    flat = profile.reshape(len(s_m), -1)
    for k in _turns(flat, LEVEL_M, both=True):
        for j, (t_m, _, _) in enumerate(pieces):
            _cubic(lateral, "shape", {"s": s_m[k], "t": t_m}, profile[k, j].tolist())


def _turns(values: Array, tolerance: float, *, both: bool = False) -> list[int]:
    """Rows of values [n, m] that differ from the row before, with that row itself if ``both``."""
    changed = (np.abs(np.diff(values, axis=0)) > tolerance).any(axis=1)
    rows = {0, *(np.flatnonzero(changed) + 1).tolist()}
    if both:
        rows |= set(np.flatnonzero(changed).tolist())
    return sorted(rows)


def _profile(plan: RoadPlan) -> Iterator[tuple[float, Array, Array]]:
    """Strips from right to left: right border, its height over the line, and its slope [n]."""
    for strip in (*reversed(plan.right), *plan.left):
        rise = (strip.z_high_m - strip.z_low_m) / (strip.high_m - strip.low_m)
        yield strip.low_m, strip.z_low_m - plan.z_m, rise


def _add_lanes(
    road: Element, plan: RoadPlan, links: Mapping[str, Mapping[int, int]], paint: PaintIndex
) -> None:
    section = SubElement(SubElement(road, "lanes"), "laneSection", {"s": "0"})
    lanes = {1: [x for x in plan.numbered() if x[0] > 0][::-1],
             -1: [x for x in plan.numbered() if x[0] < 0]}  # fmt: skip
    if lanes[1]:
        left = SubElement(section, "left")
        for number, strip in lanes[1]:
            _add_lane(left, plan, (number, strip), links, paint)
    center = SubElement(SubElement(section, "center"), "lane", {"id": "0", "type": "none"})
    center.set("level", "false")
    _add_marks(center, plan, 0.0, paint)
    if lanes[-1]:
        right = SubElement(section, "right")
        for number, strip in lanes[-1]:
            _add_lane(right, plan, (number, strip), links, paint)


def _add_lane(
    side: Element,
    plan: RoadPlan,
    numbered: tuple[int, Strip],
    links: Mapping[str, Mapping[int, int]],
    paint: PaintIndex,
) -> None:
    number, strip = numbered
    kind = "none" if strip.lane is None else TYPES[strip.lane.kind]
    element = SubElement(side, "lane", {"id": str(number), "type": kind, "level": "false"})
    link = SubElement(element, "link")
    for tag, linked in links.items():
        if number in linked:
            SubElement(link, tag, {"id": str(linked[number])})
    _cubic(element, "width", {"sOffset": 0.0}, (strip.high_m - strip.low_m,))
    _add_marks(element, plan, strip.high_m if number > 0 else strip.low_m, paint)
    if strip.lane is not None and strip.lane.speed_m_s:
        speed = {"sOffset": "0", "max": _text(strip.lane.speed_m_s), "unit": "m/s"}
        SubElement(element, "speed", speed)
    SubElement(element, "height", {"sOffset": "0", "inner": "0", "outer": "0"})


def _add_marks(lane: Element, plan: RoadPlan, t_m: float, paint: PaintIndex) -> None:
    """Marks of the outer border of a lane, from where they change."""
    found = zip(plan.s_m.tolist(), paint.along(plan.border_m(t_m)), strict=True)
    for mark, places in groupby(found, key=lambda item: item[1]):
        facts = {"sOffset": _text(next(places)[0]), **_mark(mark)}
        SubElement(lane, "roadMark", facts)


def _mark(paint: Paint) -> dict[str, str]:
    kind = MARKS.get((paint.style, paint.is_double), "none")
    color = "yellow" if paint.is_yellow else "white"
    width = {"width": _text(MARK_M)} if kind != "none" else {}
    return {"type": kind, "weight": "standard", "color": color, **width}


def _owned_crosswalks(scene: Scene, plans: Sequence[RoadPlan]) -> dict[int, list[tuple[int, Lane]]]:
    """Crosswalks with their numbers in the file, by number of the nearest road."""
    found: dict[int, list[tuple[int, Lane]]] = {}
    for number, lane in enumerate(scene.lanes):
        if lane.kind == "crosswalk" and len(lane.center_m) > 1:
            middle = np.mean(lane.center_m, axis=0)[:2]
            gaps = [float(np.linalg.norm(p.line_m - middle, axis=1).min()) for p in plans]
            found.setdefault(plans[int(np.argmin(gaps))].number, []).append((number, lane))
    return found


def _add_crosswalk(objects: Element, plan: RoadPlan, lane: Lane, number: int) -> None:
    """The outline of a crosswalk around a point of the reference line."""
    outline = np.array([*border_line(lane, "right"), *reversed(border_line(lane, "left"))])
    k = int(np.linalg.norm(plan.line_m - outline[:, :2].mean(axis=0), axis=1).argmin())
    heading = float(plan.headings_rad[k])
    ahead = np.array([np.cos(heading), np.sin(heading)])
    offset = outline[:, :2] - plan.line_m[k]
    along, aside = offset @ ahead, offset @ np.array([-ahead[1], ahead[0]])
    facts = {"s": plan.s_m[k], "t": 0.0, "zOffset": 0.0, "hdg": 0.0, "pitch": 0.0, "roll": 0.0}
    element = SubElement(
        objects,
        "object",
        {"id": str(number), "name": lane.name, "type": "crosswalk", "orientation": "none"}
        | {key: _text(value) for key, value in facts.items()},
    )
    corners = SubElement(SubElement(element, "outlines"), "outline", {"id": "0", "closed": "true"})
    heights = outline[:, 2] - plan.z_m[k]
    for name, (u, v, z) in enumerate(zip(along, aside, heights, strict=True)):
        corner = {"u": _text(u), "v": _text(v), "z": _text(z), "height": "0", "id": str(name)}
        SubElement(corners, "cornerLocal", corner)


def _add_junction(root: Element, name: str, number: int, streets: Streets) -> None:
    junction = SubElement(root, "junction", {"name": name, "id": str(number)})
    count = 0
    for plan in streets.plans:
        if not plan.junction or plan.name != name:
            continue
        for own, strip in plan.numbered():
            for before in streets.before.get(strip.lane.name, ()) if strip.lane else ():
                place = streets.places[before]
                if place.plan.junction:
                    continue
                facts = {"id": str(count), "incomingRoad": str(place.plan.number),
                         "connectingRoad": str(plan.number), "contactPoint": "start"}  # fmt: skip
                connection = SubElement(junction, "connection", facts)
                SubElement(connection, "laneLink", {"from": str(place.number), "to": str(own)})
                count += 1
