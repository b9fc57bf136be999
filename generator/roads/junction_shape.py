"""Shape and lanes of junctions: arms from a centre, rounded corners, one path per turn."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Protocol

import numpy as np

from gen_data.core.scene import Lane, LaneKind
from gen_data.core.se3 import SE3
from gen_data.roads.cross_section import FALL, KERB_WIDTH_M
from gen_data.roads.lane_graph import FURNITURE_M, world_points
from gen_data.roads.reference_line import Array

CROSSWALK_M = (0.5, 3.5)
"""Extent of a crosswalk along an arm, from the end of the corners' curves."""
STOP_LINE_M = (4.5, 5.0)
SETBACK_M = 6.5
ABSENT = -1.0
TURN_LANE = -1
"""Number of the lane in the median for those who turn across."""
_STRAIGHT_RAD = math.radians(30.0)
"""Ways that change direction by less go straight on."""
_ARC_STEP_RAD = math.radians(7.5)


class ArmsShape(Protocol):
    """Arms from a centre, and kerbs and sidewalks around the corners between them.

    The base of all shapes of intersections; subclasses define the rest.
    """

    __slots__ = ()

    @property
    def arms_deg(self) -> tuple[float, float, float, float]:
        """Directions of the arms from the centre, ascending; ``ABSENT`` = no such arm."""
        ...

    @property
    def traffic(self) -> str:
        """Side on which vehicles drive."""
        ...

    @property
    def lanes(self) -> int:
        """Number of lanes per arm and direction."""
        ...

    @property
    def lane_width_m(self) -> float:
        """Width of each lane."""
        ...

    @property
    def kerb_m(self) -> float:
        """Height of the kerbs."""
        ...

    @property
    def sidewalk_m(self) -> float:
        """Width of the sidewalks; 0 = none."""
        ...

    @property
    def beside_m(self) -> float:
        """Width between kerb and sidewalk."""
        ...

    @property
    def setback_m(self) -> float:
        """Width of the land between the sidewalks and the fronts of houses."""
        ...

    @property
    def median_m(self) -> float:
        """Width of the strip between the directions of an arm; 0 = none."""
        return 0.0

    @property
    def half_m(self) -> float:
        """Distance from an arm's middle to its kerb."""
        return 0.5 * self.median_m + self.lanes * self.lane_width_m

    @property
    def border_m(self) -> float:
        """Distance from the kerb's face to the outer edge of the sidewalk."""
        return KERB_WIDTH_M + self.beside_m + self.sidewalk_m

    @property
    def edge_z_m(self) -> float:
        """Height of the outer edge of the sidewalk."""
        return self.kerb_m + FALL * self.sidewalk_m

    def arms_rad(self) -> tuple[float, ...]:
        """Directions of the existing arms, ascending."""
        return tuple(math.radians(arm) for arm in self.arms_deg if arm != ABSENT)

    def gaps_rad(self) -> tuple[float, ...]:
        """Angles from each arm to the next one counter-clockwise."""
        arms = self.arms_rad()
        return tuple(
            (after - arm) % math.tau for arm, after in zip(arms, (*arms[1:], arms[0]), strict=True)
        )

    def reach_m(self) -> float:
        """Length of every arm."""
        return self.curve_end_m() + SETBACK_M

    def has_turn_lane(self, number: int) -> bool:
        """Whether the median of an arm is a lane for those who turn across."""
        del number
        return False

    def is_straight(self, number: int) -> bool:
        """Whether the kerb runs straight on from an arm to the next one."""
        ...

    def curve_end_m(self) -> float:
        """Distance from the centre to the end of the longest corner's curve on its arm."""
        ...

    def corner_line(self, number: int, offset_m: float) -> Array:
        """As ``corner``."""
        ...

    def height_m(self, xy: Array) -> Array:
        """Heights [n] of the carriageway at points [n, 2]."""
        ...


@dataclass(frozen=True, slots=True)
class JunctionShape(ArmsShape):
    """Arms with equal numbers of lanes in and out, all of one width.

    Attributes:
        arms_deg: Directions of the arms from the centre, ascending; ``ABSENT`` = no such arm.
        lanes: Number of lanes per arm and direction.
        beside_m: Width between kerb and sidewalk (verge, or the road's parking).
        radius_m: Radius of the kerb at the corners.
        setback_m: Width of the land between the sidewalks and the fronts of houses.
        median_m: Width of the strip between the directions of every arm.
        turn_lane: 1 = on arms from which vehicles can turn across, this strip is a lane for them.
    """

    arms_deg: tuple[float, float, float, float] = (0.0, 90.0, 180.0, 270.0)
    lanes: int = 1
    lane_width_m: float = 3.5
    kerb_m: float = 0.12
    sidewalk_m: float = 2.5
    beside_m: float = 0.0
    radius_m: float = 7.0
    crown: float = 0.025
    traffic: str = "right"
    setback_m: float = 0.0
    median_m: float = 0.0
    turn_lane: float = 0.0

    @property
    def top_m(self) -> float:
        """Height of the middle above the gutters."""
        return self.crown * self.half_m

    def curve_end_m(self) -> float:
        """Distance from the centre to the end of the longest corner's curve on its arm."""
        ends = [self.half_m]
        for gap in self.gaps_rad():
            if abs(gap - math.pi) > 1e-3:
                ends.append((self.half_m + self.radius_m) / math.tan(0.5 * gap))
        return max(ends)

    def is_straight(self, number: int) -> bool:
        """Whether the kerb runs straight on from an arm to the next one."""
        return abs(self.gaps_rad()[number] - math.pi) <= 1e-3

    def has_turn_lane(self, number: int) -> bool:
        """Whether the median of an arm is a lane for those who turn across."""
        if self.turn_lane <= 0.0:
            return False
        return any(_is_across(self, number, j) for j in range(len(self.arms_rad())))

    def corner_line(self, number: int, offset_m: float) -> Array:
        """As ``corner``."""
        return _junction_corner(self, number, offset_m)

    def height_m(self, xy: Array) -> Array:
        """Heights [n] of the carriageway at points [n, 2]."""
        return make_fan(self).height_m(xy)


def corner(shape: ArmsShape, number: int, offset_m: float) -> Array:
    """Line [n, 2] parallel to the kerb, from the end of an arm to the end of the next one.

    Args:
        shape: Shape of the junction.
        number: Number of the first arm, on its left side seen from the centre.
        offset_m: Distance behind the kerb's face; n is the same for all distances.
    """
    return shape.corner_line(number, offset_m)


def _junction_corner(shape: JunctionShape, number: int, offset_m: float) -> Array:
    arms, gap = shape.arms_rad(), shape.gaps_rad()[number]
    here, after = arms[number], arms[(number + 1) % len(arms)]
    away, reach = shape.half_m + offset_m, shape.reach_m()
    first = on_arm(here, reach, away)
    last = on_arm(after, reach, -away)
    if abs(gap - math.pi) <= 1e-3:
        share = np.linspace(0.0, 1.0, 9)[:, None]
        return first + share * (last - first)
    radius = shape.radius_m - offset_m
    # The centre of the arc is one radius away from both edges.
    middle = on_arm(here, (shape.half_m + shape.radius_m) / math.tan(0.5 * gap), 0.0)
    middle = middle + (shape.half_m + shape.radius_m) * _left_of(here)
    turn = math.pi - gap
    count = max(2, math.ceil(turn / _ARC_STEP_RAD) + 1)
    angles = here - 0.5 * math.pi - np.linspace(0.0, turn, count)
    arc = middle + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.concatenate([first[None], arc, last[None]])


@dataclass(frozen=True, eq=False, slots=True)
class Fan:
    """Carriageway of a junction: triangles from the centre to its outline.

    Attributes:
        outline_m: Points [n, 3], counter-clockwise from the first arm's right kerb.
        center_z_m: Height of the centre, at the origin.
    """

    outline_m: Array
    center_z_m: float

    def height_m(self, xy: Array) -> Array:
        """Heights [n] of the surface at points [n, 2]."""
        a, b = self.outline_m, np.roll(self.outline_m, -1, axis=0)
        area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        u = (xy[:, :1] * b[:, 1] - xy[:, 1:] * b[:, 0]) / area
        v = (a[:, 0] * xy[:, 1:] - a[:, 1] * xy[:, :1]) / area
        which = np.minimum(u, v).argmax(axis=1)
        rows = np.arange(len(xy))
        u, v = u[rows, which], v[rows, which]
        center = self.center_z_m
        heights: Array = center + u * (a[which, 2] - center) + v * (b[which, 2] - center)
        return heights


# Cached, because every lane of a junction needs its heights.
@lru_cache(maxsize=16)
def make_fan(shape: JunctionShape) -> Fan:
    """Build the carriageway of a junction; its mouths have the cross section of a crowned road."""
    parts = []
    for number, arm in enumerate(shape.arms_rad()):
        t = np.linspace(-shape.half_m, shape.half_m, 9)
        mouth = np.array([on_arm(arm, shape.reach_m(), float(v)) for v in t])
        z = shape.crown * (shape.half_m - np.abs(t))
        parts.append(np.column_stack([mouth, z])[:-1])
        kerb = corner(shape, number, 0.0)[:-1]
        parts.append(np.column_stack([kerb, np.zeros(len(kerb))]))
    return Fan(np.concatenate(parts), shape.top_m)


def arm_pose(shape: ArmsShape, number: int) -> SE3:
    """Pose of the end of an arm, with X pointing away from the junction."""
    arm = shape.arms_rad()[number]
    x, y = (float(v) for v in on_arm(arm, shape.reach_m(), 0.0))
    return SE3.about_z(arm, (x, y, 0.0))


def arm_points(shape: ArmsShape, number: int, r_m: Array, t_m: Array) -> Array:
    """Points [..., 2] at distances along an arm and to its left."""
    arm = shape.arms_rad()[number]
    c, s = math.cos(arm), math.sin(arm)
    return np.stack([r_m * c - t_m * s, r_m * s + t_m * c], axis=-1)


def junction_lanes(
    shape: JunctionShape, name: str, T_world_junction: SE3, speed_m_s: float, crosswalks: bool
) -> tuple[Lane, ...]:
    """Make the paths of all turns, sidewalks and frontages around the corners, and crosswalks."""
    lanes = []
    for i, j, k in _list_turns(shape):
        center = lane_points(_turn_path(shape, i, j, k), shape, T_world_junction)
        word = "turn" if k == TURN_LANE else str(k)
        lane = Lane(f"{name}/{i}to{j}_{word}", "driving", center, shape.lane_width_m, road=name)
        lanes.append(replace(lane, speed_m_s=speed_m_s, junction=True))
    return (*lanes, *corner_lanes(shape, name, T_world_junction, crosswalks))


def corner_lanes(
    shape: ArmsShape, name: str, T_world_junction: SE3, crosswalks: bool
) -> Iterator[Lane]:
    """Make sidewalks, furniture lanes and frontages around the corners, and crosswalks."""
    inner = KERB_WIDTH_M + shape.beside_m
    into = inner + min(FURNITURE_M, 0.5 * shape.sidewalk_m)
    beside: tuple[tuple[LaneKind, float, float], ...] = (
        ("sidewalk", inner + 0.5 * shape.sidewalk_m, shape.sidewalk_m),
        ("furniture", into, 0.6),
        ("frontage", shape.border_m, 0.0),
    )
    for number in range(len(shape.arms_rad())):
        for kind, offset_m, width_m in beside if shape.sidewalk_m > 0.0 else ():
            set_back = kind == "frontage" and shape.setback_m > 0.0
            if set_back and not shape.is_straight(number):
                # The fronts of the arms' houses meet in a separate corner.
                continue
            line = corner(shape, number, offset_m + (shape.setback_m if set_back else 0.0))
            sloping_m = min(offset_m, shape.border_m) - KERB_WIDTH_M
            rise = (shape.edge_z_m - shape.kerb_m) * sloping_m
            z = shape.kerb_m + rise / (shape.border_m - KERB_WIDTH_M)
            center = world_points(np.column_stack([line, np.full(len(line), z)]), T_world_junction)
            yield Lane(f"{name}/{kind}{number}", kind, center, width_m, road=name)
        if crosswalks:
            yield _crosswalk(shape, name, number, T_world_junction)


def _crosswalk(shape: ArmsShape, name: str, number: int, T_world_junction: SE3) -> Lane:
    r = shape.curve_end_m() + 0.5 * sum(CROSSWALK_M)
    t = np.linspace(-shape.half_m, shape.half_m, 5)
    center = lane_points(arm_points(shape, number, np.full(5, r), t), shape, T_world_junction)
    width_m = CROSSWALK_M[1] - CROSSWALK_M[0]
    own = f"{name}/crosswalk{number}"
    return Lane(own, "crosswalk", center, width_m, road=name, junction=True)


def _list_turns(shape: JunctionShape) -> list[tuple[int, int, int]]:
    """Arms and lane of every turn: the outer lane turns to its side, the inner one across.

    Where there is a lane for those who turn across, ``TURN_LANE``, they take it.
    """
    arms = shape.arms_rad()
    turns = []
    for i, j in ((i, j) for i in range(len(arms)) for j in range(len(arms)) if i != j):
        if _is_across(shape, i, j) and shape.has_turn_lane(i):
            turns.append((i, j, TURN_LANE))
            continue
        straight = abs(_change_rad(shape, i, j)) < _STRAIGHT_RAD
        for k in range(shape.lanes):
            if straight or k == (0 if _is_across(shape, i, j) else shape.lanes - 1):
                turns.append((i, j, k))
    return turns


def _change_rad(shape: ArmsShape, start: int, end: int) -> float:
    """Change of direction from one arm to another, positive to the left."""
    arms = shape.arms_rad()
    return math.remainder(arms[end] - arms[start] - math.pi, math.tau)


def _is_across(shape: ArmsShape, start: int, end: int) -> bool:
    """Whether the way from one arm to another turns across the oncoming traffic."""
    change = _change_rad(shape, start, end)
    if start == end or abs(change) < _STRAIGHT_RAD:
        return False
    return change > 0.0 if shape.traffic == "right" else change < 0.0


def _turn_path(shape: JunctionShape, start: int, end: int, lane: int) -> Array:
    """Path [n, 2] from the end of one arm to another: a cubic close to a circular arc."""
    way = 1.0 if shape.traffic == "right" else -1.0
    away = way * lane_middle_m(shape, max(lane, 0))
    arms = shape.arms_rad()
    a = on_arm(arms[start], shape.reach_m(), 0.0 if lane == TURN_LANE else away)
    b = on_arm(arms[end], shape.reach_m(), -away)
    return curve(a, arms[start] + math.pi, b, arms[end])


def lane_middle_m(shape: ArmsShape, lane: int) -> float:
    """Distance of a lane's middle from the middle of its arm."""
    return 0.5 * shape.median_m + (lane + 0.5) * shape.lane_width_m


def curve(a: Array, heading_a_rad: float, b: Array, heading_b_rad: float) -> Array:
    """Path [n, 2] from one point and heading to another: a cubic close to a circular arc."""
    turn = math.remainder(heading_b_rad - heading_a_rad, math.tau)
    chord = math.hypot(*(b - a))
    # Bezier handles of a circular arc: 4/3 tan(turn / 4) times the radius.
    handle = (2.0 / 3.0) * chord / (1.0 + math.cos(0.5 * turn))
    count = max(2, math.ceil(1.2 * chord / 0.8))
    p = np.linspace(0.0, 1.0, count + 1)[:, None]
    c0, c1 = a + handle * _direction(heading_a_rad), b - handle * _direction(heading_b_rad)
    path: Array = (1 - p) ** 3 * a + 3 * (1 - p) ** 2 * p * c0 + 3 * (1 - p) * p**2 * c1 + p**3 * b
    return path


def lane_points(
    line: Array, shape: ArmsShape, T_world_junction: SE3
) -> tuple[tuple[float, float, float], ...]:
    """Points of a line [n, 2] on the carriageway, in the world."""
    return world_points(np.column_stack([line, shape.height_m(line)]), T_world_junction)


def _direction(arm_rad: float) -> Array:
    return np.array([math.cos(arm_rad), math.sin(arm_rad)])


def _left_of(arm_rad: float) -> Array:
    return np.array([-math.sin(arm_rad), math.cos(arm_rad)])


def on_arm(arm_rad: float, r_m: float, t_m: float) -> Array:
    """Point [2] at a distance along an arm and to its left."""
    point: Array = r_m * _direction(arm_rad) + t_m * _left_of(arm_rad)
    return point
