"""Queries of moving oriented boxes: contact, gap ahead, distance; lane borders and lights."""

from dataclasses import dataclass

import numpy as np

from gen_data.core import lane_geometry, motion
from gen_data.core.boxes import boxes_touch
from gen_data.core.scene import Instance, Lane, Scene
from gen_data.core.se3 import SE3, Array

STEMS = ("pole", "street_light", "traffic_light", "traffic_sign", "tree", "utility_pole")
"""Categories with mostly empty boxes: only their stem counts."""
STEM_M = 0.2
"""Half the width of a stem."""


@dataclass(frozen=True, slots=True)
class OrientedObstacle:
    """The oriented box of an instance, which may move.

    Attributes:
        track: Trajectory of its first body; None = it does not move.
        T_world_instance: Pose of the instance at the scene's instant.
        T_instance_box: Pose of the box, its origin in the middle.
        half_m: Half extents of the box.
    """

    instance: Instance
    track: motion.Trajectory | None
    T_world_instance: SE3
    T_instance_box: SE3
    half_m: tuple[float, float, float]

    def box(self, time_s: float) -> SE3:
        """``T_world_box`` at an instant."""
        place = self.T_world_instance if self.track is None else self.track.pose(time_s)
        return place @ self.T_instance_box

    def twist(self, time_s: float) -> motion.Twist:
        """Twist of the instance's frame at an instant."""
        return motion.STILL if self.track is None else self.track.twist(time_s)

    @property
    def radius_m(self) -> float:
        """Radius of the box's circumscribed sphere."""
        return float(np.sqrt(np.sum(np.square(self.half_m))))


def find_obstacles(scene: Scene) -> tuple[OrientedObstacle, ...]:
    """Boxes of all instances that have one, in order of id."""
    tracks = {track.body: track for track in scene.tracks}
    rooted = {a.instance_id for a in scene.articulations}
    carriers: dict[int, motion.Trajectory] = {}
    for body in scene.bodies:
        if body.name in tracks and body.instance_id not in rooted:
            carriers.setdefault(body.instance_id, tracks[body.name])
    ordered = sorted(scene.instances, key=lambda instance: instance.instance_id)
    boxes = (_make_obstacle(instance, carriers.get(instance.instance_id)) for instance in ordered)
    return tuple(box for box in boxes if min(box.half_m) > 0.0)


def is_touching(one: OrientedObstacle, other: OrientedObstacle, time_s: float) -> bool:
    """Whether two boxes have a point in common at an instant."""
    return boxes_touch(one.box(time_s), one.half_m, other.box(time_s), other.half_m)


def distance_m(box: OrientedObstacle, point_m: Array, time_s: float) -> float:
    """Distance between a point of the world and a box at an instant; 0 inside."""
    local = box.box(time_s).inverse().apply(point_m)
    outside = np.maximum(np.abs(local) - np.array(box.half_m), 0.0)
    return float(np.sqrt(outside @ outside))


def gap_ahead_m(own: OrientedObstacle, other: OrientedObstacle, time_s: float) -> float:
    """Distance straight ahead from a box's front to another box at an instant.

    In the plane of the first box; 0 where they overlap, inf where the straight path misses.
    """
    T_own_other = own.box(time_s).inverse() @ other.box(time_s)
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    corners = T_own_other.apply(signs * np.array(other.half_m))
    length, width, height = own.half_m
    if corners[:, 2].min() > height or corners[:, 2].max() < -height:
        return np.inf
    outline = corners[[0, 2, 6, 4], :2] if _is_upright(T_own_other) else _hull(corners[:, :2])
    inside = _clip_side(_clip_side(outline, 1.0, width), -1.0, width)
    if len(inside) == 0 or inside[:, 0].max() < -length:
        return np.inf
    return max(float(inside[:, 0].min()) - length, 0.0)


def is_below(
    own: OrientedObstacle, other: OrientedObstacle, time_s: float, clearance_m: float
) -> bool:
    """Whether another box is so low that a box stands on it or passes over it."""
    top_m = other.box(time_s).translation_m[2] + _height_m(other, time_s)
    bottom_m = own.box(time_s).translation_m[2] - _height_m(own, time_s)
    return top_m < bottom_m + clearance_m


def _make_obstacle(instance: Instance, track: motion.Trajectory | None) -> OrientedObstacle:
    low, high = np.asarray(instance.box_min_m), np.asarray(instance.box_max_m)
    half, middle = 0.5 * (high - low), 0.5 * (low + high)
    if instance.category in STEMS:
        half[:2], middle[:2] = STEM_M, 0.0
    x, y, z = (float(v) for v in middle)
    a, b, c = (float(v) for v in half)
    return OrientedObstacle(instance, track, instance.T_world_instance, SE3((x, y, z)), (a, b, c))


def _height_m(box: OrientedObstacle, time_s: float) -> float:
    """Half the extent of a box along world Z."""
    return float(np.abs(box.box(time_s).rotation()[2]) @ np.array(box.half_m))


def _is_upright(rotation: SE3) -> bool:
    """Whether a rotation is about Z alone."""
    _, x, y, _ = rotation.quaternion_wxyz
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


def _clip_side(outline: Array, side: float, width_m: float) -> Array:
    """Clip a convex outline to ``side * y <= width_m`` (Sutherland and Hodgman 1974)."""
    kept: list[Array] = []
    for k in range(len(outline)):
        a, b = outline[k - 1], outline[k]
        inside_a, inside_b = side * a[1] <= width_m, side * b[1] <= width_m
        if inside_a != inside_b:
            kept.append(a + (side * width_m - a[1]) / (b[1] - a[1]) * (b - a))
        if inside_b:
            kept.append(b)
    return np.array(kept).reshape(-1, 2)


SIGNAL_M = 15.0
"""Largest distance between a traffic light and the end of its lane."""
FACING_COSINE_MAX = -np.sqrt(0.5)
"""Largest cosine between a light's front and the direction of its lane: 45 degrees off."""


def lane_border_pieces(scene: Scene) -> Array:
    """Segments of the lines on both sides of driving lanes outside junctions, world, [n, 2, 2]."""
    pieces = [
        line
        for lane in scene.lanes
        if lane.kind == "driving" and not lane.junction
        for line in _side_segments(lane)
    ]
    return np.concatenate(pieces) if pieces else np.zeros((0, 2, 2))


def is_crossed(pieces: Array, T_world_box: SE3, half_m: tuple[float, float, float]) -> Array:
    """Whether a line lies under the left and the right half of a footprint, bool [2].

    ``pieces`` are as returned by ``lane_border_pieces``; the box has half extents ``half_m``.
    """
    forward = T_world_box.rotation()[:2, 0]
    forward = forward / np.sqrt(forward @ forward)
    axes = np.stack([forward, np.array([-forward[1], forward[0]])])
    local = (pieces - np.array(T_world_box.translation_m[:2])) @ axes.T
    start, span = local[:, 0], local[:, 1] - local[:, 0]
    # Slab test of segments against the footprint; the epsilon avoids 0 / 0 for parallel ones.
    span = np.where(np.abs(span) < 1e-12, 1e-12, span)
    bounds = np.array([half_m[0], half_m[1]])
    times = np.stack([(-bounds - start) / span, (bounds - start) / span])
    enter = np.maximum(times.min(axis=0).max(axis=1), 0.0)
    leave = np.minimum(times.max(axis=0).min(axis=1), 1.0)
    under = enter <= leave
    aside = (start + 0.5 * (enter + leave)[:, None] * span)[under, 1]
    return np.array([bool((aside >= 0.0).any()), bool((aside < 0.0).any())])


def governing_light(scene: Scene, T_world_box: SE3, within_m: float) -> Instance | None:
    """The traffic light of the lane that a box is on; None if there is none.

    It is the nearest light to the lane's end that has a state and faces the lane's traffic; the
    end must be within ``within_m`` of the box, along the lane.
    """
    found = _find_lane(scene, T_world_box)
    if found is None:
        return None
    line, at_m = found
    if line.length_m - at_m > within_m:
        return None
    end = line.pose(line.length_m)
    direction, position = end.rotation()[:2, 0], np.array(end.translation_m[:2])
    lights = []
    for instance in scene.instances:
        state = dict(instance.attributes).get("state", "")
        if instance.category != "traffic_light" or instance.subcategory == "pedestrian":
            continue
        front = instance.T_world_instance.rotation()[:2, 0]
        gap = np.array(instance.T_world_instance.translation_m[:2]) - position
        away_m = float(np.sqrt(gap @ gap))
        if state and away_m < SIGNAL_M and float(front @ direction) < FACING_COSINE_MAX:
            lights.append((away_m, instance.instance_id, instance))
    return min(lights, key=lambda light: light[:2])[2] if lights else None


def _side_segments(lane: Lane) -> tuple[Array, Array]:
    """Segments of the left and the right border of a lane, [n, 2, 2] each."""
    centre = np.asarray(lane.center_m, dtype=np.float64)[:, :2]
    along = np.gradient(centre, axis=0)
    along /= np.sqrt(np.sum(along**2, axis=1, keepdims=True))
    half_m = lane_geometry.half_widths_m(lane)[:, None]
    left = half_m * np.stack([-along[:, 1], along[:, 0]], axis=1)
    lines = (centre + left, centre - left)
    one, other = (np.stack([line[:-1], line[1:]], axis=1) for line in lines)
    return one, other


def _find_lane(scene: Scene, T_world_box: SE3) -> tuple[lane_geometry.LaneLine, float] | None:
    """The nearest driving lane below a box with its heading, and the arc length [m] on it."""
    position = np.array(T_world_box.translation_m[:2])
    heading = T_world_box.rotation()[:2, 0]
    best: tuple[float, Lane, float] | None = None
    for lane in scene.lanes:
        if lane.kind != "driving" or lane.junction:
            continue
        centre = np.asarray(lane.center_m, dtype=np.float64)[:, :2]
        span = np.diff(centre, axis=0)
        share = np.sum((position - centre[:-1]) * span, axis=1) / np.sum(span**2, axis=1)
        gaps = position - centre[:-1] - np.clip(share, 0.0, 1.0)[:, None] * span
        distances = np.sqrt(np.sum(gaps**2, axis=1))
        k = int(distances.argmin())
        half_m = lane_geometry.half_widths_m(lane)
        beyond = (k == len(span) - 1 and share[k] > 1.0) or (k == 0 and share[k] < 0.0)
        if beyond or distances[k] > half_m[k] or span[k] @ heading <= 0.0:
            continue
        if best is None or distances[k] < best[0]:
            at_m = lane_geometry.LaneLine(lane).at_m
            along_m = at_m[k] + float(np.clip(share[k], 0.0, 1.0)) * (at_m[k + 1] - at_m[k])
            best = (float(distances[k]), lane, along_m)
    return None if best is None else (lane_geometry.LaneLine(best[1]), best[2])
