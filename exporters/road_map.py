"""Vector map of a street: areas, lanes, blocks of lanes, dividers with paint, stop lines, signals.

Areas and lines are the plan of the world (x, y). The carriageway is exact: the outline of the paved
meshes, from kerb to kerb, as they are laid out on level ground; relief changes no place in plan.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.assets.asset_ids import parse_asset_id
from gen_data.assets.drape import split_draped
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import AssetLibrary, DatasetInfo
from gen_data.core.lane_geometry import LaneBorder, border_line, half_widths_m, lane_borders
from gen_data.core.scene import Body, Lane, Scene
from gen_data.core.se3 import Array, Vec3
from gen_data.exporters import base
from gen_data.roads.carriageway import PAINT, PAVED, ground_bodies, surface

HOLE_M2 = 1.0
"""Smaller holes are covers of manholes and drains, over which vehicles drive."""
CRUMB_M2 = 0.01
"""Smaller pieces of areas are rounding."""
DECIMALS = 4
"""Corners of meshes are rounded to tenths of millimetres: pieces that meet have no cracks."""
BESIDE_M, ACROSS_M = 0.45, 0.4
"""Paint this near to a border belongs to it, unless it is wider: stop lines, crosswalks, arrows."""
WINDOW_M, STATION_M = 9.0, 0.25
"""Paint is judged within this distance on both sides of a point, at stations."""
SOLID, DASHED = 0.95, 0.1
"""Smallest painted shares of solid and dashed lines."""
DOUBLE_M = 0.07
"""Paint on both sides of a border, farther away than this, is a double line."""
STOP_FROM_M, STOP_TO_M = 1.0, 2.9
"""Stop lines are looked for from this before to this after the end of a lane into a junction."""
STOP_WIDTH_M = (0.28, 1.0)
"""Widths of stop lines; other lines are narrower, bars of crosswalks longer."""
SIGNAL_FAR_M, FACING = 30.0, -0.5
"""Distance of a signal from the block that it controls; cosine between its front and their way."""
LAMPS: Mapping[str, Literal["RED", "YELLOW", "GREEN"]] = {
    "lens_red": "RED", "lens_yellow": "YELLOW", "lens_green": "GREEN",
}  # fmt: skip
"""Colour by role of a lens."""

Geometry = Any
"""Of Shapely, which has no types."""


class StreetExporter(base.AssetExporter):
    """An exporter of maps, which scenes without a street do not have."""

    type: str

    def check(self, info: DatasetInfo) -> None:
        """Reject a system without Shapely. Raises ConfigError if Shapely is missing."""
        del info
        base.check_installed(self.type, "shapely")

    def check_scene(self, scene: Scene) -> None:
        """Reject scenes without a street.

        Raises:
            ConfigError: the text names the missing element.
        """
        if not any(lane.kind == "driving" for lane in scene.lanes):
            raise ConfigError(
                f"exporter '{self.type}': the scene has no driving lane; add an element 'road'"
            )


@dataclass(frozen=True, eq=False, slots=True)
class Area:
    """A polygon: its exterior [n, 2], counter-clockwise, and holes, clockwise; not closed."""

    exterior: Array
    holes: tuple[Array, ...] = ()


@dataclass(frozen=True, eq=False, slots=True)
class Segment:
    """Carriageway of a road, or of an intersection."""

    name: str
    area: Area
    is_intersection: bool


@dataclass(frozen=True, eq=False, slots=True)
class Block:
    """Adjacent driving lanes of one direction, outside junctions.

    Attributes:
        name: Name of its leftmost lane.
        lanes: Its lanes from left to right.
        segment: Name of the segment that it is on; empty = none.
    """

    name: str
    lanes: tuple[Lane, ...]
    area: Area
    segment: str

    @property
    def end_m(self) -> Array:
        """Middle of its end, [2]."""
        ends = [self.lanes[0].center_m[-1], self.lanes[-1].center_m[-1]]
        return np.asarray(np.mean(ends, axis=0)[:2])


@dataclass(frozen=True, slots=True)
class Paint:
    """Line on a border of lanes at a point."""

    style: Literal["none", "solid", "dashed"] = "none"
    is_double: bool = False
    is_yellow: bool = False


PAINTS = tuple(
    Paint(style, double, yellow)
    for style in ("none", "dashed", "solid")
    for double in (False, True)
    for yellow in (False, True)
)


@dataclass(frozen=True, eq=False, slots=True)
class Divider:
    """Border of driving lanes, and its paint at each of its points."""

    border: LaneBorder
    paint: tuple[Paint, ...]


@dataclass(frozen=True, eq=False, slots=True)
class StopLine:
    """Painted line at which the lanes of a block end."""

    block: Block
    area: Area


@dataclass(frozen=True, eq=False, slots=True)
class Signal:
    """Traffic light of vehicles.

    Attributes:
        body: The body; its X axis points to the traffic that it controls.
        lamps: Colour and place of each lamp in the frame of the body.
        block: The lanes that it controls; None = none end near it.
    """

    body: Body
    lamps: tuple[tuple[str, Vec3], ...]
    block: Block | None


@dataclass(frozen=True, eq=False, slots=True)
class RoadMap:
    """Vector map of a world.

    Attributes:
        lanes: All lanes of the street with at least two points.
        drivable: Carriageways, connected.
    """

    lanes: tuple[Lane, ...]
    drivable: tuple[Area, ...]
    segments: tuple[Segment, ...]
    blocks: tuple[Block, ...]
    dividers: tuple[Divider, ...]
    stop_lines: tuple[StopLine, ...]
    signals: tuple[Signal, ...]

    def segment_at(self, point: Sequence[float]) -> str:
        """Name of the segment at a place; empty = none."""
        return _segment_at(self.segments, point)

    def after(self, block: Block) -> tuple[Block, ...]:
        """Blocks to which a block leads through a junction, or directly."""
        by_name = {lane.name: lane for lane in self.lanes}
        seen = [name for lane in block.lanes for name in lane.successors]
        inner = [n for k in seen if k in by_name and by_name[k].junction
                 for n in by_name[k].successors]  # fmt: skip
        reached = {*seen, *inner}
        return tuple(b for b in self.blocks if reached & {lane.name for lane in b.lanes})


def road_map(scene: Scene, assets: AssetLibrary) -> RoadMap:
    """Derive the map of a world from its lanes, meshes and signals."""
    lanes = tuple(lane for lane in scene.lanes if len(lane.center_m) > 1)
    plans = _plans(scene, assets)
    paint = find_paint(scene, assets)
    driving = [lane for lane in lanes if lane.kind == "driving"]
    segments = tuple(_segments(driving, plans))
    blocks = tuple(_blocks(driving, segments))
    stop_lines = (_stop_line(block, driving, paint) for block in blocks)
    return RoadMap(
        lanes,
        tuple(_areas(_join(plans.values()))),
        segments,
        blocks,
        tuple(paint.divider(border) for border in lane_borders(scene.lanes)),
        tuple(line for line in stop_lines if line is not None),
        tuple(_signals(scene, assets, blocks)),
    )


def drivable_areas(scene: Scene, assets: AssetLibrary) -> tuple[Area, ...]:
    """``RoadMap.drivable`` alone."""
    return tuple(_areas(_join(_plans(scene, assets).values())))


def find_paint(scene: Scene, assets: AssetLibrary) -> "PaintIndex":
    """All paint of a street."""
    marks = [surface(body, assets, PAINT) for body in _level_bodies(scene)]
    triangles = np.concatenate([np.zeros((0, 3, 2)), *(found[0][..., :2] for found in marks)])
    return PaintIndex(triangles, np.concatenate([np.zeros(0, np.bool_), *(m[1] for m in marks)]))


def lane_area(lanes: Sequence[Lane]) -> Area:
    """Area between the left border of the first and the right border of the last lane."""
    left, right = border_line(lanes[0], "left"), border_line(lanes[-1], "right")
    if len(lanes) == 1 and lanes[0].widths_m:
        # Where a lane begins or ends without width, its outline would touch itself.
        wide = np.flatnonzero(half_widths_m(lanes[0]) > 10.0**-DECIMALS)
        low, high = max(int(wide[0]) - 1, 0), int(wide[-1]) + 2
        left, right = left[low:high], right[low:high]
    return Area(np.array([*right, *reversed(left)])[:, :2])


class PaintIndex:
    """Painted triangles of a street, to be found by place."""

    def __init__(self, triangles: Array, yellow: NDArray[np.bool_]) -> None:
        """Index triangles [n, 3, 2], and whether each is yellow [n]."""
        import shapely

        self.triangles, self.yellow = triangles, yellow
        self._tree = shapely.STRtree(shapely.polygons(triangles))

    def inside(self, area: Geometry) -> Geometry:
        """The paint in an area."""
        import shapely

        near = np.sort(self._tree.query(area, predicate="intersects"))
        return shapely.union_all(
            shapely.polygons(self.triangles[near].round(DECIMALS))
        ).intersection(area)

    def divider(self, border: LaneBorder) -> Divider:
        """A border and its paint."""
        return Divider(border, self.along(np.asarray(border.points_m)[:, :2]))

    def along(self, line: Array) -> tuple[Paint, ...]:
        """Paint of a border [n, 2] at each of its points."""
        import shapely

        path = shapely.LineString(line)
        steps = shapely.linestrings(np.stack([line[:-1], line[1:]], axis=1))
        near = np.unique(self._tree.query(steps, predicate="dwithin", distance=BESIDE_M)[1])
        if not len(near):
            return (PAINTS[0],) * len(line)
        corners = self.triangles[near]
        at_m = shapely.line_locate_point(path, shapely.points(line))
        along_m = shapely.line_locate_point(path, shapely.points(corners))
        middle_m = np.clip(along_m.mean(axis=1), 0.05, path.length - 0.05)
        before, after = (
            shapely.get_coordinates(shapely.line_interpolate_point(path, middle_m + d))
            for d in (-0.05, 0.05)
        )
        ahead = (after - before) / np.linalg.norm(after - before, axis=1, keepdims=True)
        offset = corners - (0.5 * (before + after))[:, None]
        left_m = ahead[:, None, 0] * offset[..., 1] - ahead[:, None, 1] * offset[..., 0]
        beside = np.abs(left_m.mean(axis=1)) < BESIDE_M
        beside &= np.ptp(left_m, axis=1) < ACROSS_M
        stations = np.arange(0.0, path.length + STATION_M, STATION_M)
        spans = along_m.min(axis=1), along_m.max(axis=1)
        side_m = left_m.mean(axis=1)
        some, left, right, tinted = (
            _covered(stations, spans, beside & chosen)
            for chosen in (beside, side_m > DOUBLE_M, side_m < -DOUBLE_M, self.yellow[near])
        )
        low = np.searchsorted(stations, at_m - WINDOW_M)
        high = np.searchsorted(stations, at_m + WINDOW_M, "right")
        painted, double, tint = (
            np.diff(np.concatenate([[0], np.cumsum(flags)])[np.stack([low, high])], axis=0)[0]
            for flags in (some, some & left & right, some & tinted)
        )
        share = painted / np.maximum(high - low, 1)
        kinds = 4 + 4 * (share >= SOLID) + 2 * (2 * double > painted) + (2 * tint > painted)
        return tuple(PAINTS[kind] for kind in np.where(share < DASHED, 0, kinds).tolist())


def _covered(
    stations: Array, spans: tuple[Array, Array], chosen: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Which stations are within any chosen span."""
    first = np.searchsorted(stations, spans[0][chosen])
    last = np.searchsorted(stations, spans[1][chosen], "right")
    count = len(stations) + 1
    steps = np.bincount(first, minlength=count) - np.bincount(last, minlength=count)
    return np.asarray(np.cumsum(steps)[:-1] > 0)


def _level_bodies(scene: Scene) -> list[Body]:
    """Bodies of the ground, on level ground: meshes have fewer triangles, and the same plan."""
    bodies = []
    for body in ground_bodies(scene):
        found = split_draped(parse_asset_id(body.asset)) if "relief=" in body.asset else None
        bodies.append(body if found is None else replace(body, asset=str(found[0])))
    return bodies


def _plans(scene: Scene, assets: AssetLibrary) -> dict[str, Geometry]:
    """Carriageways by name of the body."""
    paved = {body.name: surface(body, assets, PAVED)[0] for body in _level_bodies(scene)}
    return {name: plan_area(triangles) for name, triangles in paved.items() if len(triangles)}


def plan_area(triangles: Array) -> Geometry:
    """Area of upward triangles [n, 3, 3] in plan; they may overlap. Small holes are filled.

    Sides of two triangles cancel: the other ones part the plane into few faces, and how often they
    wind around a face is the number of triangles on it.
    """
    import shapely

    corners = np.rint(triangles[..., :2] * 10.0**DECIMALS).astype(np.int64)
    keys = (corners[..., 0] << 32) + corners[..., 1]
    side = np.stack([keys, np.roll(keys, -1, axis=1)], axis=-1).reshape(-1, 2)
    low, high = side.min(axis=1), side.max(axis=1)
    order = np.lexsort((high, low))
    changes = (np.diff(low[order]) != 0) | (np.diff(high[order]) != 0)
    first = np.flatnonzero(np.concatenate([[True], changes]))
    times = np.add.reduceat(np.sign(side[:, 1] - side[:, 0])[order], first)
    rows, times = order[first][times != 0], times[times != 0]
    ends = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-2).reshape(-1, 2, 2)[rows]
    ends = np.where((side[rows, 0] < side[rows, 1])[:, None, None], ends, ends[:, ::-1])
    lines = ends / 10.0**DECIMALS
    faces = shapely.get_parts(shapely.polygonize([shapely.union_all(shapely.linestrings(lines))]))
    inside = shapely.get_coordinates(shapely.point_on_surface(faces))
    return _tidy(shapely.coverage_union_all(faces[_winding(lines, times, inside) > 0]))


def _winding(lines: Array, times: NDArray[np.int64], points: Array) -> NDArray[np.int64]:
    """How often lines [n, 2, 2], each counted some times [n], wind around points [k, 2]; [k]."""
    (x0, y0), (x1, y1) = lines[:, 0].T, lines[:, 1].T
    x, y = points.T[..., None]
    left = (x1 - x0) * (y - y0) - (x - x0) * (y1 - y0)
    upward = (y0 <= y) & (y < y1) & (left > 0.0)
    downward = (y1 <= y) & (y < y0) & (left < 0.0)
    return np.asarray((upward.astype(np.int64) - downward) @ times)


def _join(areas: Iterable[Geometry]) -> Geometry:
    import shapely

    return _tidy(shapely.union_all([area for area in areas if not area.is_empty]))


def _tidy(area: Geometry) -> Geometry:
    """The area without holes that vehicles drive over, in canonical order."""
    import shapely

    kept = [
        shapely.Polygon(p.exterior, [h for h in p.interiors if shapely.Polygon(h).area > HOLE_M2])
        for p in _polygons(area)
    ]
    return shapely.normalize(shapely.multipolygons(kept)) if kept else shapely.Polygon()


def _polygons(area: Geometry) -> list[Geometry]:
    parts = getattr(area, "geoms", [area])
    return [p for p in parts if p.geom_type == "Polygon" and p.area > CRUMB_M2]


def _areas(area: Geometry) -> Iterator[Area]:
    import shapely

    for part in _polygons(area):
        ring = shapely.orient_polygons(part)
        holes = tuple(np.asarray(hole.coords)[:-1] for hole in ring.interiors)
        yield Area(np.asarray(ring.exterior.coords)[:-1], holes)


def _shape(area: Area) -> Geometry:
    import shapely

    return shapely.Polygon(area.exterior, area.holes)


def _segments(driving: Sequence[Lane], plans: Mapping[str, Geometry]) -> Iterator[Segment]:
    """Segments of all roads; a body with several roads is divided at its intersections."""
    for road in dict.fromkeys(lane.road for lane in driving):
        own = [lane for lane in driving if lane.road == road]
        plan = plans.get(road)
        if plan is None or plan.is_empty:
            plan = _join(_shape(lane_area([lane])).buffer(0) for lane in own)
        crossing = [lane for lane in own if lane.junction]
        parts = [(plan, bool(crossing))]
        if 0 < len(crossing) < len(own):
            inside = _join(_shape(lane_area([lane])).buffer(0) for lane in crossing)
            parts = [(plan.intersection(inside), True), (plan.difference(inside), False)]
        areas = [(area, crosses) for part, crosses in parts for area in _areas(_tidy(part))]
        for number, (area, crosses) in enumerate(areas):
            yield Segment(f"{road}/{number}" if len(areas) > 1 else road, area, crosses)


def _segment_at(segments: Iterable[Segment], point: Sequence[float]) -> str:
    import shapely

    place = shapely.Point(point[:2])
    return next((s.name for s in segments if _shape(s.area).covers(place)), "")


def _blocks(driving: Sequence[Lane], segments: Sequence[Segment]) -> Iterator[Block]:
    by_name = {lane.name: lane for lane in driving if not lane.junction}
    for lane in by_name.values():
        if lane.left in by_name and by_name[lane.left].right == lane.name:
            continue
        row = [lane]
        while row[-1].right in by_name and by_name[row[-1].right].left == row[-1].name:
            row.append(by_name[row[-1].right])
        middle = lane.center_m[len(lane.center_m) // 2]
        yield Block(lane.name, tuple(row), lane_area(row), _segment_at(segments, middle))


def _stop_line(block: Block, driving: Sequence[Lane], paint: PaintIndex) -> StopLine | None:
    """The painted line across the lanes of a block into a junction; None = there is none."""
    import shapely

    by_name = {lane.name: lane for lane in driving if lane.junction}
    found = []
    for lane in block.lanes:
        if not any(name in by_name for name in lane.successors):
            continue
        (x0, y0, _), (x1, y1, _) = lane.center_m[-2:]
        ahead = np.array([x1 - x0, y1 - y0]) / np.hypot(x1 - x0, y1 - y0)
        left, half_m = np.array([-ahead[1], ahead[0]]), half_widths_m(lane)[-1]
        corners = [(-STOP_FROM_M, -half_m), (STOP_TO_M, -half_m), (STOP_TO_M, half_m),
                   (-STOP_FROM_M, half_m)]  # fmt: skip
        end = np.array([x1, y1])
        strip = shapely.Polygon([end + along * ahead + t * left for along, t in corners])
        thin_m = 0.5 * STOP_WIDTH_M[0]
        # Narrow lines vanish, and wider ones keep their corners.
        wide = paint.inside(strip).buffer(-thin_m, join_style="mitre")
        for part in _polygons(wide.buffer(thin_m, join_style="mitre")):
            around = shapely.get_coordinates(part) - end
            along, across = np.ptp(around @ ahead), np.ptp(around @ left)
            if along <= STOP_WIDTH_M[1] and across > half_m:
                found.append(part)
    if not found:
        return None
    (area,) = _areas(shapely.union_all(found).convex_hull)
    return StopLine(block, area)


def _signals(scene: Scene, assets: AssetLibrary, blocks: Sequence[Block]) -> Iterator[Signal]:
    lights = {i.instance_id for i in scene.instances if i.category == "traffic_light"}
    junctions = {lane.name for lane in scene.lanes if lane.junction and lane.kind == "driving"}
    ending = [b for b in blocks if any(junctions & {*lane.successors} for lane in b.lanes)]
    for body in scene.bodies:
        lamps = tuple(_lamps(body, assets)) if body.instance_id in lights else ()
        if lamps:
            yield Signal(body, lamps, _controlled(body, ending))


def _lamps(body: Body, assets: AssetLibrary) -> Iterator[tuple[str, Vec3]]:
    materials = body.materials or assets.materials(body.asset)
    if not any(material.role in LAMPS for material in materials):
        return
    mesh = assets.mesh(body.asset)
    for slot, material in enumerate(materials):
        faces = mesh.faces[mesh.face_slots == slot]
        if material.role in LAMPS and len(faces):
            corners = mesh.vertices_m[faces].reshape(-1, 3).astype(np.float64) * body.scale
            x, y, z = (0.5 * (corners.min(axis=0) + corners.max(axis=0))).round(DECIMALS).tolist()
            yield LAMPS[material.role], (x, y, z)


def _controlled(body: Body, blocks: Iterable[Block]) -> Block | None:
    """The nearest block whose end the front of a signal faces."""
    front = body.T_world_body.rotation()[:2, 0]
    place = np.array(body.T_world_body.translation_m[:2])
    near: list[tuple[float, int, Block]] = []
    for number, block in enumerate(blocks):
        (x0, y0, _), (x1, y1, _) = block.lanes[0].center_m[-2:]
        ahead = np.array([x1 - x0, y1 - y0]) / np.hypot(x1 - x0, y1 - y0)
        away_m = float(np.linalg.norm(block.end_m - place))
        if float(front @ ahead) < FACING and away_m < SIGNAL_FAR_M:
            near.append((away_m, number, block))
    return min(near, key=lambda item: item[:2])[2] if near else None
