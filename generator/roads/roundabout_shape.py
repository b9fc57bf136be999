"""Shape and lanes of roundabouts: a ring around an island, arms with rounded corners."""

import math
from dataclasses import dataclass, replace

import numpy as np

from gen_data.core import scene, se3
from gen_data.roads.junction_shape import ArmsShape, corner_lanes, curve, lane_points, on_arm
from gen_data.roads.reference_line import Array

_ARC_STEP_RAD = math.radians(6.0)
_LANE_STEP_M = 1.0
_FALL_OUTWARDS = 0.025
"""Cross slope of the ring, to its outer edge (Merkblatt Kreisverkehre: 2.5 %)."""


@dataclass(frozen=True, slots=True)
class RoundaboutShape(ArmsShape):
    """A ring of one lane, and arms of one lane in and one lane out.

    Attributes:
        arms_deg: Directions of the arms from the centre, ascending; ``ABSENT`` = no such arm.
        diameter_m: Outer diameter: 26 to 40 m for small ones (FGSV, Merkblatt Kreisverkehre, 2006).
        ring_m: Width of the ring, with the truck apron.
        truck_apron_m: Width of the ring's inner, rough part.
        radius_m: Radius of the kerb at the corners.
        setback_m: Width of the land between the sidewalks and the fronts of houses.
        splitter: 1 = raised islands between both lanes of every arm, 0 = none.
    """

    arms_deg: tuple[float, float, float, float] = (0.0, 90.0, 180.0, 270.0)
    lane_width_m: float = 3.5
    kerb_m: float = 0.12
    sidewalk_m: float = 2.5
    beside_m: float = 0.0
    radius_m: float = 12.0
    crown: float = 0.025
    traffic: str = "right"
    diameter_m: float = 30.0
    ring_m: float = 7.0
    truck_apron_m: float = 1.6
    splitter: float = 1.0
    setback_m: float = 0.0

    @property
    def lanes(self) -> int:
        """Number of lanes per arm and direction."""
        return 1

    @property
    def outer_m(self) -> float:
        """Radius of the ring's outer edge."""
        return 0.5 * self.diameter_m

    @property
    def island_m(self) -> float:
        """Radius of the island."""
        return self.outer_m - self.ring_m

    @property
    def lane_radius_m(self) -> float:
        """Radius of the ring lane's centre line."""
        return self.outer_m - 0.5 * (self.ring_m - self.truck_apron_m)

    def is_straight(self, number: int) -> bool:
        """Never: kerbs follow the ring."""
        del number
        return False

    def curve_end_m(self) -> float:
        """Distance from the centre to the end of the corners' curves on every arm."""
        reach, away = self.outer_m + self.radius_m, self.half_m + self.radius_m
        return math.sqrt(max(0.0, reach * reach - away * away))

    def mouth_rad(self) -> float:
        """Angle between an arm and the point where its corner's curve meets the ring."""
        return math.atan2(self.half_m + self.radius_m, self.curve_end_m())

    def corner_line(self, number: int, offset_m: float) -> Array:
        """Line [n, 2] parallel to the kerb, from the end of an arm to the end of the next one.

        Along the arm, around the corner, along the ring, and back the same way; ``offset_m`` behind
        the
        kerb's face.
        """
        arms = self.arms_rad()
        here, gap = arms[number], self.gaps_rad()[number]
        turn = 0.5 * math.pi - self.mouth_rad()
        angles = -0.5 * math.pi - np.linspace(0.0, turn, math.ceil(turn / _ARC_STEP_RAD) + 1)
        middle = np.array([self.curve_end_m(), self.half_m + self.radius_m])
        radius = self.radius_m - offset_m
        bend = middle + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        first = np.concatenate([[[self.reach_m(), self.half_m + offset_m]], bend])
        along = gap - 2.0 * self.mouth_rad()
        count = math.ceil(along / _ARC_STEP_RAD) + 1
        ring = self.mouth_rad() + np.linspace(0.0, along, max(3, count))[1:-1]
        outer = self.outer_m + offset_m
        circle = outer * np.stack([np.cos(ring), np.sin(ring)], axis=1)
        last = first[::-1] * np.array([1.0, -1.0])
        parts = (_turned(first, here), _turned(circle, here), _turned(last, here + gap))
        return np.concatenate(parts)

    def height_m(self, xy: Array) -> Array:
        """Heights [n] of the carriageway at points [n, 2].

        The ring falls outwards; the crown of the arms fades out towards it.
        """
        r = np.sqrt((xy * xy).sum(axis=1))
        ring = _FALL_OUTWARDS * np.maximum(0.0, self.outer_m - r)
        share = np.clip((r - self.outer_m) / (self.reach_m() - self.outer_m), 0.0, 1.0)
        crowned = np.zeros(len(xy))
        for arm in self.arms_rad():
            along = xy @ np.array([math.cos(arm), math.sin(arm)])
            away = np.abs(xy @ np.array([-math.sin(arm), math.cos(arm)]))
            top = self.crown * np.maximum(0.0, self.half_m - away)
            crowned = np.maximum(crowned, np.where(along > 0.0, top, 0.0))
        heights: Array = ring + share * share * (3.0 - 2.0 * share) * crowned
        return heights

    def outline(self) -> Array:
        """Kerb line [n, 2] and mouths of the arms, counter-clockwise from the first arm's right."""
        parts = []
        for number, arm in enumerate(self.arms_rad()):
            t = np.linspace(-self.half_m, self.half_m, 9)
            parts.append(np.array([on_arm(arm, self.reach_m(), float(v)) for v in t])[:-1])
            parts.append(self.corner_line(number, 0.0)[:-1])
        return np.concatenate(parts)


def roundabout_lanes(
    shape: RoundaboutShape, name: str, T_world_junction: se3.SE3, speed_m_s: float, crosswalks: bool
) -> tuple[scene.Lane, ...]:
    """Make a path from every arm around the ring to every other, sidewalks, and crosswalks.

    Paths share the ring; each is a separate lane, as are the turns of a junction.
    """
    arms = len(shape.arms_rad())
    lanes = []
    for i, j in ((i, j) for i in range(arms) for j in range(arms) if i != j):
        center = lane_points(_ring_path(shape, i, j), shape, T_world_junction)
        lane = scene.Lane(f"{name}/{i}to{j}_0", "driving", center, shape.lane_width_m, road=name)
        lanes.append(replace(lane, speed_m_s=speed_m_s, junction=True))
    return (*lanes, *corner_lanes(shape, name, T_world_junction, crosswalks))


def _ring_path(shape: RoundaboutShape, start: int, end: int) -> Array:
    """Path [n, 2] from the end of one arm along the ring to the end of another."""
    way = 1.0 if shape.traffic == "right" else -1.0
    arms, mouth, radius = shape.arms_rad(), shape.mouth_rad(), shape.lane_radius_m
    enter, leave = arms[start] + way * mouth, arms[end] - way * mouth
    along = (way * (leave - enter)) % math.tau
    count = max(2, math.ceil(along * radius / _LANE_STEP_M))
    angles = enter + way * np.linspace(0.0, along, count + 1)
    ring = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    away = 0.5 * way * shape.lane_width_m
    outside = on_arm(arms[start], shape.reach_m(), away), on_arm(arms[end], shape.reach_m(), -away)
    tangent = 0.5 * math.pi * way
    first = curve(outside[0], arms[start] + math.pi, ring[0], enter + tangent)
    last = curve(ring[-1], leave + tangent, outside[1], arms[end])
    return np.concatenate([first[:-1], ring[:-1], last])


def _turned(points: Array, angle_rad: float) -> Array:
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    turned: Array = points @ np.array([[c, s], [-s, c]])
    return turned
