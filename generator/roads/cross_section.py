"""Cross sections of roads: strips side by side, from the middle outwards.

``t`` is the distance to the left of the reference line, ``s`` the arc length along it. The lowest
gutter is at z = 0; the carriageway rises to its crown in the middle.
"""

import math
from dataclasses import dataclass, fields
from typing import Any, Literal

import numpy as np

from gen_data.roads.alignment import bent_line, curvature_range
from gen_data.roads.reference_line import Array, ReferenceLine

StripKind = Literal[
    "median", "driving", "bicycle", "shoulder", "parking", "kerb", "verge", "sidewalk", "garden"
]
Pair = tuple[float, float]

KERB_WIDTH_M = 0.15
APRON_M, APRON_FALL_M = 6.0, 0.1
"""Width of a road's apron, and depth of its outer edge below the gutter."""
APRON_STEPS, APRON_DROPS = (0.0, 0.25, 1.0), (0.0, 0.25, 1.0)
"""Profile of the apron as fractions of both."""
BAY_WIDTH_M = 2.5
"""Width of bays at an angle to the road (RAR, by sicherestrassen.de: 2.50 m)."""
FALL = 0.025
"""Slope of sidewalks and verges, for drainage (assumed, 2 to 3 %)."""


@dataclass(frozen=True, slots=True)
class RoadShape:
    """A road of constant cross section. Pairs are (left, right) as seen along the road.

    Attributes:
        length_m: Length of the reference line, the middle of the road.
        lanes: Numbers of lanes against and along the road's direction.
        median_m: Width of the strip between the two directions.
        median_kerb_m: Height of the kerbs around that strip; 0 = it is level with the road.
        bicycle_m, shoulder_m, parking_m: Widths of strips next to the lanes; 0 = none.
        bay_angle_deg: Angle of parking bays to the road; 0 = cars park along the kerb.
        kerb_m: Height of the kerbs; 0 = none.
        verge_m, sidewalk_m: Widths of planting strips and of sidewalks beyond them; 0 = none.
        setback_m: Widths of the land between the sidewalks and the fronts of houses; 0 = none.
        curvature_per_m: Curvature of the reference line, positive to the left.
        crown: Cross slope of the carriageway, from the middle to the gutters.
        traffic: Side on which vehicles drive, ``right`` or ``left``.
        turn_m: Lengths of the lanes in the median for those who turn across, at the start and at
            the end; 0 = none. With such a lane, the rest of the median is a blocked area.
        bends: Numbers of ``alignment.Bend``, one bend after the other.
    """

    length_m: float = 100.0
    lanes: Pair = (1.0, 1.0)
    lane_width_m: float = 3.5
    median_m: float = 0.0
    bicycle_m: Pair = (0.0, 0.0)
    shoulder_m: Pair = (0.0, 0.0)
    parking_m: Pair = (0.0, 0.0)
    kerb_m: float = 0.12
    verge_m: Pair = (0.0, 0.0)
    sidewalk_m: Pair = (2.5, 2.5)
    curvature_per_m: float = 0.0
    crown: float = 0.025
    traffic: str = "right"
    setback_m: Pair = (0.0, 0.0)
    median_kerb_m: float = 0.0
    bay_angle_deg: Pair = (0.0, 0.0)
    turn_m: Pair = (0.0, 0.0)
    bends: tuple[float, ...] = ()

    def line(self) -> ReferenceLine:
        """Reference line, from the origin along +X."""
        return bent_line(self.length_m, self.curvature_per_m, self.bends)

    def curvature_range(self, start_m: float, end_m: float) -> Pair:
        """Least and largest curvature of the reference line between two arc lengths."""
        return curvature_range(self.curvature_per_m, self.bends, start_m, end_m)

    def lanes_on(self, side: int) -> int:
        """Number of driving lanes left (+1) or right (-1) of the middle."""
        return round(self.lanes[1] if self.forward(side) else self.lanes[0])

    def forward(self, side: int) -> bool:
        """Whether a side's lanes run along the road."""
        return (side < 0) == (self.traffic == "right")

    def carriageway_m(self, side: int) -> float:
        """Distance from the middle to the gutter."""
        k = side_index(side)
        beside = self.bicycle_m[k] + self.shoulder_m[k] + self.parking_m[k]
        return 0.5 * self.median_m + self.lanes_on(side) * self.lane_width_m + beside

    def turn_spans(self) -> tuple[tuple[float, float, bool], ...]:
        """Lanes in the median: from where to where [m], and whether they lead to the end."""
        start, end = self.turn_m
        spans = ((0.0, start, False), (self.length_m - end, self.length_m, True))
        return tuple(span for span in spans if span[1] > span[0])

    def crowned_m(self, side: int) -> float:
        """Distance from the middle to the end of the cross slope; parking strips are level."""
        return self.carriageway_m(side) - self.parking_m[side_index(side)]


@dataclass(frozen=True, slots=True)
class Strip:
    """One strip of a cross section.

    Attributes:
        side: +1 left, -1 right of the reference line.
        number: Number among its kind, from the middle.
        inner_m, outer_m: Distances from the reference line, both >= 0.
        inner_z_m, outer_z_m: Heights of both edges.
    """

    kind: StripKind
    side: int
    number: int
    inner_m: float
    outer_m: float
    inner_z_m: float
    outer_z_m: float

    @property
    def width_m(self) -> float:
        """Extent across the road."""
        return self.outer_m - self.inner_m

    @property
    def middle_m(self) -> float:
        """``t`` of its middle."""
        return self.side * 0.5 * (self.inner_m + self.outer_m)

    @property
    def middle_z_m(self) -> float:
        """Height of its middle."""
        return 0.5 * (self.inner_z_m + self.outer_z_m)


def strips(shape: RoadShape, side: int) -> tuple[Strip, ...]:
    """Strips of one side, from the middle outwards."""
    k = side_index(side)
    top = shape.crown * max(shape.crowned_m(1), shape.crowned_m(-1))
    made: list[Strip] = []

    def put(kind: StripKind, width_m: float, rise_m: float, number: int = 0) -> None:
        if width_m > 0.0:
            inner = made[-1].outer_m if made else 0.0
            z = made[-1].outer_z_m if made else top
            made.append(Strip(kind, side, number, inner, inner + width_m, z, z + rise_m))

    _put_median(made, shape, side, top)
    for number in range(shape.lanes_on(side)):
        put("driving", shape.lane_width_m, -shape.lane_width_m * shape.crown, number)
    put("bicycle", shape.bicycle_m[k], -shape.bicycle_m[k] * shape.crown)
    put("shoulder", shape.shoulder_m[k], -shape.shoulder_m[k] * shape.crown)
    put("parking", shape.parking_m[k], 0.0)
    beyond = shape.verge_m[k] + shape.sidewalk_m[k]
    if beyond > 0.0 and shape.kerb_m > 0.0:
        put("kerb", KERB_WIDTH_M, shape.kerb_m)
    # Behind a kerb the ground rises outwards, to drain to the gutter; without one it falls.
    fall = FALL if shape.kerb_m > 0.0 else -FALL
    put("verge", shape.verge_m[k], fall * shape.verge_m[k])
    put("sidewalk", shape.sidewalk_m[k], fall * shape.sidewalk_m[k])
    put("garden", shape.setback_m[k], 0.0)
    return tuple(made)


def _put_median(made: list[Strip], shape: RoadShape, side: int, top_m: float) -> None:
    """Add one half of the strip between the directions, and its kerb."""
    half = 0.5 * shape.median_m
    edge = top_m - half * shape.crown
    if half <= 0.0:
        return
    if shape.median_kerb_m <= 0.0 or half <= KERB_WIDTH_M:
        made.append(Strip("median", side, 0, 0.0, half, top_m, edge))
        return
    raised, inside = edge + shape.median_kerb_m, half - KERB_WIDTH_M
    made.append(Strip("median", side, 0, 0.0, inside, raised, raised))
    made.append(Strip("kerb", side, 0, inside, half, raised, edge))


def bay_borders(shape: RoadShape, strip: Strip) -> list[tuple[Pair, Pair]]:
    """Lines between the angled bays of a parking strip: near and far end, each (s, t).

    Cars drive in forwards: the bays lean in the direction of travel on their side.
    """
    angle = math.radians(shape.bay_angle_deg[side_index(strip.side)])
    along = 1.0 if shape.forward(strip.side) else -1.0
    lean = strip.width_m / math.tan(angle) if angle < 1.57 else 0.0
    pitch = BAY_WIDTH_M / math.sin(angle)
    count = max(0, math.floor((shape.length_m - lean - 1.0) / pitch))
    start = 0.5 * (shape.length_m - count * pitch - lean) + (lean if along < 0.0 else 0.0)
    t0, t1 = strip.side * strip.inner_m, strip.side * strip.outer_m
    return [
        ((start + k * pitch, t0), (start + k * pitch + along * lean, t1)) for k in range(count + 1)
    ]


def height_m(shape: RoadShape, t_m: Array) -> Array:
    """Heights of the surface [n] at distances to the left [n], clipped to the edges."""
    heights = np.zeros_like(t_m)
    for side in (1, -1):
        row = strips(shape, side)
        at = [0.0, *(strip.outer_m for strip in row)]
        z = [row[0].inner_z_m if row else 0.0, *(strip.outer_z_m for strip in row)]
        here = (t_m >= 0.0) if side > 0 else (t_m < 0.0)
        heights[here] = np.interp(np.abs(t_m[here]), at, z)
    return heights


def non_default_fields(shape: Any) -> dict[str, Any]:
    """Fields of a dataclass instance that differ from their defaults."""
    pairs = ((f.name, getattr(shape, f.name), f.default) for f in fields(shape))
    return {name: value for name, value, default in pairs if value != default}


def side_index(side: int) -> int:
    """Index of a side in a (left, right) pair."""
    return 0 if side > 0 else 1
