"""Boxes that move: whether they touch, how far ahead they are, how near."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gen_data.generator.core.motion import STILL, Trajectory, Twist
from gen_data.generator.core.obb import boxes_touch
from gen_data.generator.core.scene import Instance, Scene
from gen_data.generator.core.se3 import SE3, Array

STEMS = ("pole", "street_light", "traffic_light", "traffic_sign", "tree", "utility_pole")
"""Categories whose box is mostly air: a stem stands for them."""
STEM_M = 0.2
"""Half the width of a stem."""


@dataclass(frozen=True, slots=True)
class OrientedObstacle:
    """An instance as a box that may move.

    Attributes:
        track: Of the body that carries it; None = it stands still.
        T_world_instance: Where it is at the scene's instant.
        T_instance_box: The middle of its box.
        half_m: Half the edges of its box.
    """

    instance: Instance
    track: Trajectory | None
    T_world_instance: SE3
    T_instance_box: SE3
    half_m: tuple[float, float, float]

    def box(self, time_s: float) -> SE3:
        """``T_world_box`` at one instant."""
        place = self.T_world_instance if self.track is None else self.track.pose(time_s)
        return place @ self.T_instance_box

    def twist(self, time_s: float) -> Twist:
        """How it moves at one instant."""
        return STILL if self.track is None else self.track.twist(time_s)

    @property
    def radius_m(self) -> float:
        """Of the ball around its box."""
        return float(np.sqrt(np.sum(np.square(self.half_m))))


def find_obstacles(scene: Scene) -> tuple[OrientedObstacle, ...]:
    """Every instance that has a box, in order of id."""
    tracks = {track.body: track for track in scene.tracks}
    rooted = {a.instance_id for a in scene.articulations}
    carriers: dict[int, Trajectory] = {}
    for body in scene.bodies:
        if body.name in tracks and body.instance_id not in rooted:
            carriers.setdefault(body.instance_id, tracks[body.name])
    ordered = sorted(scene.instances, key=lambda instance: instance.instance_id)
    things = (_thing(instance, carriers.get(instance.instance_id)) for instance in ordered)
    return tuple(thing for thing in things if min(thing.half_m) > 0.0)


def is_touching(one: OrientedObstacle, other: OrientedObstacle, time_s: float) -> bool:
    """Whether two boxes have a point in common at one instant."""
    return boxes_touch(one.box(time_s), one.half_m, other.box(time_s), other.half_m)


def distance_m(thing: OrientedObstacle, point_m: Array, time_s: float) -> float:
    """From a point of the world to the nearest of its box; 0 inside."""
    local = thing.box(time_s).inverse().apply(point_m)
    outside = np.maximum(np.abs(local) - np.array(thing.half_m), 0.0)
    return float(np.sqrt(outside @ outside))


def ahead_m(own: OrientedObstacle, other: OrientedObstacle, time_s: float) -> float:
    """How far one's front may go straight on until it meets another; inf if it passes.

    Both as they are at the instant, in the plane; 0 where they overlap.
    """
    T_own_other = own.box(time_s).inverse() @ other.box(time_s)
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    corners = T_own_other.apply(signs * np.array(other.half_m))
    length, width, height = own.half_m
    if corners[:, 2].min() > height or corners[:, 2].max() < -height:
        return np.inf
    outline = corners[[0, 2, 6, 4], :2] if _upright(T_own_other) else _hull(corners[:, :2])
    inside = _clipped(_clipped(outline, 1.0, width), -1.0, width)
    if len(inside) == 0 or inside[:, 0].max() < -length:
        return np.inf
    return max(float(inside[:, 0].min()) - length, 0.0)


def project_to_ground(
    own: OrientedObstacle, other: OrientedObstacle, time_s: float, clearance_m: float
) -> bool:
    """Whether a thing is so low that one drives over it or stands on it."""
    top_m = other.box(time_s).translation_m[2] + _height_m(other, time_s)
    bottom_m = own.box(time_s).translation_m[2] - _height_m(own, time_s)
    return top_m < bottom_m + clearance_m


def _thing(instance: Instance, track: Trajectory | None) -> OrientedObstacle:
    low, high = np.asarray(instance.box_min_m), np.asarray(instance.box_max_m)
    half, middle = 0.5 * (high - low), 0.5 * (low + high)
    if instance.category in STEMS:
        half[:2], middle[:2] = STEM_M, 0.0
    x, y, z = (float(v) for v in middle)
    a, b, c = (float(v) for v in half)
    return OrientedObstacle(instance, track, instance.T_world_instance, SE3((x, y, z)), (a, b, c))


def _height_m(thing: OrientedObstacle, time_s: float) -> float:
    """Half of its extent along world Z."""
    return float(np.abs(thing.box(time_s).rotation()[2]) @ np.array(thing.half_m))


def _upright(turn: SE3) -> bool:
    """Whether two boxes share their vertical."""
    _, x, y, _ = turn.quaternion_wxyz
    return abs(x) < 1e-6 and abs(y) < 1e-6


def _hull(points: Array) -> Array:
    """Corners of the convex hull, counter-clockwise (Andrew 1979)."""
    ordered = points[np.lexsort((points[:, 1], points[:, 0]))]

    def chain(rows: Array) -> list[Array]:
        kept: list[Array] = []
        for row in rows:
            while len(kept) > 1 and _left_turn(kept[-2], kept[-1], row) <= 0.0:
                kept.pop()
            kept.append(row)
        return kept[:-1]

    return np.array(chain(ordered) + chain(ordered[::-1]))


def _left_turn(a: Array, b: Array, c: Array) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def _clipped(outline: Array, side: float, width_m: float) -> Array:
    """The part of a convex outline on one side of a line along X (Sutherland and Hodgman 1974)."""
    kept: list[Array] = []
    for k in range(len(outline)):
        a, b = outline[k - 1], outline[k]
        inside_a, inside_b = side * a[1] <= width_m, side * b[1] <= width_m
        if inside_a != inside_b:
            kept.append(a + (side * width_m - a[1]) / (b[1] - a[1]) * (b - a))
        if inside_b:
            kept.append(b)
    return np.array(kept).reshape(-1, 2)
