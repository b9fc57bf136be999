"""Map expansion of nuScenes, version 1.3: vector map of a world, in the global frame.

=================  ================================================================================
drivable_area      connected carriageways, from kerb to kerb
road_segment       carriageway of a road or of an intersection
road_block         adjacent lanes of one direction
lane               driving (``CAR``) and bicycle lanes (``BIKE``) outside junctions
lane_connector     ways through junctions
ped_crossing       crosswalks
walkway            sidewalks
stop_line          painted lines before junctions: ``TRAFFIC_LIGHT`` with signals, ``PED_CROSSING``
                   with a crosswalk behind them, else ``TURN_STOP``
carpark_area       parking strips and bays
road_divider       borders between lanes of opposite directions
lane_divider       borders between lanes of one direction, with the paint at each node
traffic_light      signals of vehicles: pose, lamps, the block that they control
arcline_path_3     centre lines of lanes and connectors, as arcs; ``connectivity`` links them
=================  ================================================================================

Nodes are shared by all geometries with a point at that place. The format has one type of dashed
line, ``DOUBLE_DASHED_WHITE``, and no double yellow one.

Reference: map expansion of nuScenes (``map_api.py`` of nuscenes-devkit, and its tutorial).
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from gen_data.core.lane_geometry import MEETING_M, Side, border_line
from gen_data.core.scene import Lane
from gen_data.core.se3 import SE3, Array
from gen_data.exporters.arc_paths import arc_paths
from gen_data.exporters.nuscenes_files import MapArea
from gen_data.exporters.oxts import roll_pitch_yaw
from gen_data.exporters.road_map import Area, Block, Divider, Paint, RoadMap, Signal, lane_area

VERSION = "1.3"
DECIMALS = 4
LANE_TYPES = {"driving": "CAR", "bicycle": "BIKE"}
AREAS = {"crosswalk": "ped_crossing", "sidewalk": "walkway", "parking": "carpark_area"}
"""Layers of areas by kind of lane."""
CROSSING_NEAR_M = 6.0
"""A crosswalk this near behind a stop line belongs to it."""

Row = dict[str, Any]
Token = Callable[..., str]


def map_expansion(roads: RoadMap, area: MapArea, token: Token) -> Row:
    """Content of ``maps/expansion/<location>.json``.

    Args:
        roads: Map of the world.
        area: Area of its mask; its corner is the origin of the global frame.
        token: Makes tokens of layer and identity.
    """
    writer = _Writer(roads, np.array(area.low_m, np.float64), token)
    writer.add_areas()
    writer.add_lanes()
    writer.add_dividers()
    writer.add_signals()
    writer.add_stop_lines()
    return {"version": VERSION, "canvas_edge": [float(v) for v in area.size_m]} | writer.layers


def segment_type(paint: Paint) -> str:
    """Type of a divider with this paint."""
    if paint.style == "none":
        return "NIL"
    if paint.style == "dashed":
        return "DOUBLE_DASHED_WHITE"
    if paint.is_yellow:
        return "SINGLE_SOLID_YELLOW"
    return "DOUBLE_SOLID_WHITE" if paint.is_double else "SINGLE_SOLID_WHITE"


LISTS = (
    "polygon", "line", "node", "drivable_area", "road_segment", "road_block", "lane",
    "ped_crossing", "walkway", "stop_line", "carpark_area", "road_divider", "lane_divider",
    "traffic_light", "lane_connector",
)  # fmt: skip


def _layers() -> dict[str, Any]:
    made: dict[str, Any] = {name: [] for name in LISTS}
    return made | {"connectivity": {}, "arcline_path_3": {}}


@dataclass(frozen=True, eq=False)
class _Writer:
    """Collects the rows of all layers.

    Attributes:
        roads: The map.
        low_m: Origin of the global frame in the world, [2].
        token: Makes tokens of layer and identity.
    """

    roads: RoadMap
    low_m: Array
    token: Token
    layers: dict[str, Any] = field(default_factory=_layers)
    _nodes: dict[tuple[float, float], str] = field(default_factory=dict)

    @cached_property
    def _node_token(self) -> str:
        """First digits of the tokens of all nodes."""
        return self.token("node")[:24]

    def add_areas(self) -> None:
        """Add the layers that consist of areas only."""
        for number, area in enumerate(self.roads.drivable):
            polygons = [self._polygon(area, "drivable_area", number)]
            self._row("drivable_area", number, polygon_tokens=polygons)
        for segment in self.roads.segments:
            polygon = self._polygon(segment.area, "road_segment", segment.name)
            crosses, near = segment.is_intersection, segment.area.exterior[0]
            self._row(
                "road_segment", segment.name, polygon_token=polygon, is_intersection=crosses,
                drivable_area_token=self._drivable_at(near),
            )  # fmt: skip
        for block in self.roads.blocks:
            self._row(
                "road_block",
                block.name,
                polygon_token=self._polygon(block.area, "road_block", block.name),
                **self._edges(block.lanes[0], block.lanes[-1], "block"),
                road_segment_token=self._named("road_segment", block.segment),
            )
        for lane in self.roads.lanes:
            if lane.kind in AREAS:
                layer, more = AREAS[lane.kind], self._area_facts(lane)
                own = self._polygon(lane_area([lane]), layer, lane.name)
                self._row(layer, lane.name, polygon_token=own, **more)

    def add_lanes(self) -> None:
        """Add lanes, connectors, their links and their centre lines."""
        paint = {d.border.name: d for d in self.roads.dividers}
        ways = [lane for lane in self.roads.lanes if lane.kind in LANE_TYPES]
        tokens = {lane.name: self.token(_layer(lane), lane.name) for lane in ways}
        incoming: dict[str, list[str]] = {name: [] for name in tokens}
        for lane in ways:
            for name in lane.successors:
                incoming.setdefault(name, []).append(tokens[lane.name])
        for lane in ways:
            layer = _layer(lane)
            polygon = self._polygon(lane_area([lane]), layer, lane.name)
            more: Row = {}
            if layer == "lane":
                more = {
                    "lane_type": LANE_TYPES[lane.kind],
                    **self._edges(lane, lane, "lane"),
                    "left_lane_divider_segments": self._painted(_border(paint, lane, "left")),
                    "right_lane_divider_segments": self._painted(_border(paint, lane, "right")),
                }
            self._row(layer, lane.name, polygon_token=polygon, **more)
            own = tokens[lane.name]
            outgoing = [tokens[name] for name in lane.successors if name in tokens]
            self.layers["connectivity"][own] = {
                "incoming": incoming[lane.name],
                "outgoing": outgoing,
            }
            center = np.asarray(lane.center_m)[:, :2] - self.low_m
            self.layers["arcline_path_3"][own] = arc_paths(center)

    def add_dividers(self) -> None:
        """Add the borders between lanes."""
        for divider in self.roads.dividers:
            border = divider.border
            if border.kind == "edge":
                continue
            layer = f"{border.kind}_divider"
            line = self._line(np.asarray(border.points_m), layer, border.name)
            if layer == "lane_divider":
                more: Row = {"lane_divider_segments": self._painted(divider)}
            else:
                middle = border.points_m[len(border.points_m) // 2]
                segment = self.roads.segment_at(middle)
                more = {"road_segment_token": self._named("road_segment", segment)}
            self._row(layer, border.name, line_token=line, **more)

    def add_signals(self) -> None:
        """Add traffic lights, each a line of one metre in the direction of its front."""
        for signal in self.roads.signals:
            pose, name = signal.body.T_world_body, signal.body.name
            ends = pose.apply(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
            own: str = ""
            after: list[str] = []
            if signal.block is not None:
                own = self.token("road_block", signal.block.name)
                after = [self.token("road_block", b.name) for b in self.roads.after(signal.block)]
            self._row(
                "traffic_light",
                name,
                line_token=self._line(ends, "traffic_light", name),
                traffic_light_type="VERTICAL",
                from_road_block_token=own,
                items=[_lamp(color, place, after) for color, place in signal.lamps],
                pose=self._pose(pose),
            )

    def add_stop_lines(self) -> None:
        """Add stop lines with the signals or crosswalks that they serve."""
        for line in self.roads.stop_lines:
            name = line.block.name
            lights = [s.body.name for s in self.roads.signals if _serves(s, line.block)]
            crossings = [] if lights else list(_behind(line.block, self.roads.lanes))
            kind = "TRAFFIC_LIGHT" if lights else "PED_CROSSING" if crossings else "TURN_STOP"
            self._row(
                "stop_line",
                name,
                polygon_token=self._polygon(line.area, "stop_line", name),
                stop_line_type=kind,
                traffic_light_tokens=[self.token("traffic_light", n) for n in lights],
                ped_crossing_tokens=[self.token("ped_crossing", n) for n in crossings],
                road_block_token=self.token("road_block", name),
            )

    def _area_facts(self, lane: Lane) -> Row:
        """Facts of a crosswalk or a parking strip."""
        if lane.kind == "crosswalk":
            segment = self.roads.segment_at(_middle(lane))
            return {"road_segment_token": self._named("road_segment", segment)}
        if lane.kind == "parking":
            turn = round(_yaw(lane), DECIMALS)
            return {"orientation": turn, "road_block_token": self._block_near(lane)}
        return {}

    def _row(self, layer: str, name: object, **values: Any) -> None:
        self.layers[layer].append({"token": self.token(layer, name), **values})

    def _named(self, layer: str, name: str) -> str:
        return self.token(layer, name) if name else ""

    def _nodes_at(self, points: Iterable[Sequence[float]]) -> list[str]:
        """Tokens of the nodes at places, of which only x and y count; new ones are added."""
        found, known, rows = [], self._nodes, self.layers["node"]
        low_x, low_y = self.low_m.tolist()
        for point in points:
            x = round(point[0] - low_x, DECIMALS) + 0.0
            y = round(point[1] - low_y, DECIMALS) + 0.0
            token = known.get((x, y))
            if token is None:
                # Hashing the place of each would take longer than everything else.
                token = known[x, y] = f"{self._node_token}{len(known):08x}"
                rows.append({"token": token, "x": x, "y": y})
            found.append(token)
        return found

    def _ring(self, points: Array) -> list[str]:
        """Nodes of a ring; points that round to one node appear once."""
        nodes = self._nodes_at(points.tolist())
        return [node for k, node in enumerate(nodes) if node != nodes[k - 1]]

    def _polygon(self, area: Area, layer: str, name: object) -> str:
        made = self.token("polygon", layer, name)
        holes = [{"node_tokens": self._ring(hole)} for hole in area.holes]
        ring = self._ring(area.exterior)
        self.layers["polygon"].append(
            {"token": made, "exterior_node_tokens": ring, "holes": holes}
        )  # fmt: skip
        return made

    def _line(self, points: Array, layer: str, name: object) -> str:
        made = self.token("line", layer, name)
        nodes = self._nodes_at(points.tolist())
        self.layers["line"].append({"token": made, "node_tokens": nodes})
        return made

    def _edges(self, first: Lane, last: Lane, layer: str) -> Row:
        """Lines across lanes at their start and end, from left to right."""
        left, right = border_line(first, "left"), border_line(last, "right")
        return {
            f"{word}_edge_line_token": self._line(
                np.array([left[end], right[end]]), f"{layer}_{word}", first.name
            )
            for word, end in (("from", 0), ("to", -1))
        }

    def _painted(self, divider: Divider | None) -> list[Row]:
        if divider is None:
            return []
        nodes = self._nodes_at(divider.border.points_m)
        return [{"node_token": node, "segment_type": segment_type(paint)}
                for node, paint in zip(nodes, divider.paint, strict=True)]  # fmt: skip

    def _drivable_at(self, point: Array) -> str:
        """Drivable area with the corner of a segment: the nearest one."""
        areas = self.roads.drivable
        if not areas:
            return ""
        near = [float(np.min(np.linalg.norm(a.exterior - point, axis=1))) for a in areas]
        return self.token("drivable_area", int(np.argmin(near)))

    def _block_near(self, lane: Lane) -> str:
        """The block of the same road whose outer lane is nearest to a lane."""
        own = [b for b in self.roads.blocks if b.lanes[0].road == lane.road]
        if not own:
            return ""
        middle = np.array(_middle(lane))
        lines = [np.concatenate([x.center_m for x in block.lanes])[:, :2] for block in own]
        gaps = [float(np.linalg.norm(line - middle, axis=1).min()) for line in lines]
        return self.token("road_block", own[int(np.argmin(gaps))].name)

    def _pose(self, pose: SE3) -> dict[str, float]:
        x, y, z = pose.translation_m
        roll, pitch, yaw = roll_pitch_yaw(pose.rotation())
        low_x, low_y = self.low_m.tolist()
        return _six((x - low_x, y - low_y, z, roll, pitch, yaw))


def _layer(lane: Lane) -> str:
    return "lane_connector" if lane.junction else "lane"


def _middle(lane: Lane) -> tuple[float, float]:
    x, y, _ = np.mean(lane.center_m, axis=0).tolist()
    return (x, y)


def _yaw(lane: Lane) -> float:
    (x0, y0, _), (x1, y1, _) = lane.center_m[0], lane.center_m[-1]
    return math.atan2(y1 - y0, x1 - x0)


def _border(paint: Mapping[str, Divider], lane: Lane, side: Side) -> Divider | None:
    """Divider at one side of a lane, in its direction; None = none."""
    if side == "right" and lane.right:
        return paint.get(f"{lane.right}:left")
    own = paint.get(f"{lane.name}:{side}")
    if own is not None:
        return own
    # Of two oncoming lanes with a common border, one names it.
    line = border_line(lane, side)
    for divider in paint.values():
        points = divider.border.points_m
        if max(math.dist(line[0], points[-1]), math.dist(line[-1], points[0])) < MEETING_M:
            border = replace(divider.border, points_m=points[::-1])
            return Divider(border, divider.paint[::-1])
    return None


def _lamp(color: str, place: Sequence[float], blocks: Sequence[str]) -> Row:
    position = _six((*place, 0.0, 0.0, 0.0))
    return {
        "color": color,
        "shape": "CIRCLE",
        "rel_pos": position,
        "to_road_block_tokens": list(blocks),
    }


def _six(values: Sequence[float]) -> dict[str, float]:
    """Translation [m] and roll, pitch and yaw [rad] under the keys of the format."""
    keys = ("tx", "ty", "tz", "rx", "ry", "rz")
    return {key: round(v, DECIMALS) + 0.0 for key, v in zip(keys, values, strict=True)}


def _serves(signal: Signal, block: Block) -> bool:
    """Whether a signal controls a block: its own, or another one that ends at the same line."""
    if signal.block is None:
        return False
    return signal.block.name == block.name or _ends_beside(signal.block, block)


def _ends_beside(one: Block, other: Block) -> bool:
    """Whether two blocks of a road end side by side: lanes ahead, and lanes that turn."""
    if one.segment != other.segment:
        return False
    left, right = (
        [border_line(block.lanes[0], "left")[-1], border_line(block.lanes[-1], "right")[-1]]
        for block in (one, other)
    )
    return min(math.dist(left[1], right[0]), math.dist(right[1], left[0])) < MEETING_M


def _behind(block: Block, lanes: Iterable[Lane]) -> Iterator[str]:
    """Names of the crosswalks ahead of the end of a block and near it."""
    (x0, y0, _), (x1, y1, _) = block.lanes[0].center_m[-2:]
    ahead = np.array([x1 - x0, y1 - y0]) / math.hypot(x1 - x0, y1 - y0)
    for lane in lanes:
        if lane.kind != "crosswalk":
            continue
        ends = np.asarray(lane.center_m)[[0, -1], :2] - block.end_m
        along, across = ends @ ahead, ends @ np.array([-ahead[1], ahead[0]])
        if 0.0 < along.mean() < CROSSING_NEAR_M and across.min() < 0.0 < across.max():
            yield lane.name
