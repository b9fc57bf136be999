"""Framing: which object a camera is aimed at, and from where it fills a share of the image.

The size of an object in an image is the size of the box around the projection of all its vertices,
also outside the image. For a pinhole that is the box of its silhouette; a lens that bends
straight edges adds less than the length of an edge bends.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from gen_data.core.boxes import OrientedBox
from gen_data.core.interfaces import AssetIndex
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Body, Region, Scene, SupportSurface
from gen_data.core.se3 import SE3, VERTICAL, Array, Vec3, look_at, multiply_quaternions

PRECISION = 1e-6
"""Largest relative error of a share."""
_ITERATIONS_MAX = 60
_DOUBLINGS_MAX = 40


@dataclass(frozen=True, eq=False, slots=True)
class Thing:
    """An object to aim a camera at.

    Attributes:
        center_m: Centre of its bounding box, world.
        points_m: Its vertices, world, [n, 3].
    """

    center_m: Vec3
    points_m: Array

    @property
    def reach_m(self) -> float:
        """Largest distance of a vertex from the centre."""
        away = self.points_m - self.center_m
        return math.sqrt(float((away * away).sum(axis=1).max()))


def names_to_aim_at(scene: Scene) -> list[str]:
    """Sorted names of the groups of objects, surfaces and elements with bodies of a scene."""
    groups = {group.name for group in scene.groups}
    surfaces = {surface.name for surface in scene.surfaces}
    owners = {body.name.partition("/")[0] for body in scene.bodies}
    return sorted(groups | surfaces | owners)


def candidates(scene: Scene, name: str) -> list[Region | SupportSurface | tuple[Body, ...]]:
    """Objects of a name, in the scene's order; empty if a group has no object.

    A group gives each of its objects, an empty name the scene's focus. A surface's name goes
    before its body's.
    """
    if not name:
        return [scene.focus]
    if any(group.name == name for group in scene.groups):
        return [(body,) for body in scene.bodies if body.group == name]
    surfaces = [surface for surface in scene.surfaces if surface.name == name]
    if surfaces:
        return [*surfaces]
    parts = tuple(b for b in scene.bodies if b.name.partition("/")[0] == name)
    return [parts] if parts else []


def measure(found: Region | SupportSurface | tuple[Body, ...], assets: AssetIndex) -> Thing:
    """Vertices and centre of a region, a surface, or a body with all its parts."""
    if isinstance(found, Region):
        box = OrientedBox(SE3(found.center_m), found.size_m)
        return Thing(found.center_m, box.corners())
    if isinstance(found, SupportSurface):
        flat = OrientedBox(found.T_world_surface, (*found.size_m, 0.0))
        return Thing(found.T_world_surface.translation_m, flat.corners())
    points_m = np.concatenate([_vertices_m(body, assets) for body in found])
    if len(found) > 1:
        x, y, z = (0.5 * float(v) for v in points_m.min(axis=0) + points_m.max(axis=0))
        return Thing((x, y, z), points_m)
    (body,) = found
    low, high = assets.bounds_m(body.asset)
    x, y, z = (0.5 * body.scale * (a + b) for a, b in zip(low, high, strict=True))
    return Thing((body.T_world_body @ SE3((x, y, z))).translation_m, points_m)


def _vertices_m(body: Body, assets: AssetIndex) -> Array:
    """Vertices of a body, world [m], [n, 3]."""
    own = assets.vertices_m(body.asset).astype(np.float64)
    return body.T_world_body.apply(body.scale * own)


@dataclass(frozen=True, slots=True)
class Framing:
    """Wanted view of an object.

    Attributes:
        share: Longer side of its box over the longer side of the image.
        toward: Unit vector from the object's centre to the camera, world.
        at_px: Where the object's centre appears.
        roll_rad: Rotation of the camera about its viewing direction.
    """

    share: float
    toward: Vec3
    at_px: tuple[float, float]
    roll_rad: float


def frame(
    thing: Thing, framing: Framing, intrinsics: Intrinsics, nearest_m: float = 0.0
) -> SE3 | None:
    """``T_world_camera`` that shows an object as wanted; None if no distance does.

    From ``nearest_m`` on, where the share needs a shorter distance to the object's centre.
    """
    ray = intrinsics.rays(np.array(framing.at_px))
    if np.isnan(ray).any():
        return None
    turned = _turn(framing, ray)
    # Moved along one line without turning, a camera keeps the object's centre in its place.
    around = turned.inverse().apply(thing.points_m - thing.center_m)

    def share_at(distance_m: float) -> float:
        return long_side_share(around + distance_m * ray, intrinsics)

    distance_m = distance_for_share(share_at, framing.share, max(thing.reach_m, 1e-4))
    if distance_m is None:
        return None
    distance_m = max(distance_m, nearest_m)
    x, y, z = (c + distance_m * t for c, t in zip(thing.center_m, framing.toward, strict=True))
    return SE3((x, y, z), turned.quaternion_wxyz)


def long_side_share(points_camera_m: Array, intrinsics: Intrinsics) -> float:
    """Longer side of the box around projected points over the longer side of the image.

    Infinite if a point of the camera frame, [n, 3], has no image.
    """
    seen = intrinsics.project(points_camera_m)
    if np.isnan(seen).any():
        return math.inf
    # Column by column: reducing [n, 2] over its rows takes many times as long.
    sides_px = np.array([column.max() - column.min() for column in seen.T])
    return float(sides_px.max()) / max(intrinsics.width_px, intrinsics.height_px)


def distance_for_share(
    share_at: Callable[[float], float], wanted: float, start_m: float
) -> float | None:
    """Distance at which an object fills the wanted share of an image; None if there is none.

    Args:
        share_at: Share by distance [m]; infinite for distances that are too short.
        wanted: Above 0.
        start_m: Any distance; the search doubles or halves it until the share lies between.
    """

    def error(distance_m: float) -> float:
        # Nearly proportional to the distance: secants converge within a few steps.
        return wanted / share_at(distance_m) - 1.0

    bracket = _bracket(error, start_m)
    return None if bracket is None else _root(error, *bracket)


def _bracket(error: Callable[[float], float], start_m: float) -> tuple[float, float] | None:
    """Two distances, one twice the other, whose errors are below 0 and at least 0."""
    low = high = start_m
    for _ in range(_DOUBLINGS_MAX):
        if error(high) >= 0.0:
            break
        low, high = high, 2.0 * high
    else:
        return None
    for _ in range(_DOUBLINGS_MAX):
        if error(low) < 0.0:
            return low, high
        low, high = 0.5 * low, low
    return None


def _root(error: Callable[[float], float], low: float, high: float) -> float | None:
    """Where an error changes its sign; None if it jumps there.

    Regula falsi in the Illinois variant, bisection where that stalls; Dowell and Jarratt, "A
    modified regula falsi method for computing the root of an equation", BIT 11, 1971.
    """
    at_low, at_high = error(low), error(high)
    last = 0
    for number in range(_ITERATIONS_MAX):
        share = 0.5 if number % 3 == 2 else at_low / (at_low - at_high)
        middle = low + share * (high - low)
        missed = error(middle)
        if abs(missed) <= PRECISION:
            return middle
        side = 1 if missed > 0.0 else -1
        if side > 0:
            high, at_high = middle, missed
            at_low *= 0.5 if last == side else 1.0
        else:
            low, at_low = middle, missed
            at_high *= 0.5 if last == side else 1.0
        last = side
    return None


def _turn(framing: Framing, ray: Array) -> SE3:
    """Rotation of a camera whose ray points at the object.

    Its X axis is level but for the roll, except near the vertical, where a camera that keeps it
    level cannot show the object off its axis.
    """
    c, s = math.cos(framing.roll_rad), math.sin(framing.roll_rad)
    # The ray in a camera without roll: right, down, forward.
    right, down = c * ray[0] - s * ray[1], s * ray[0] + c * ray[1]
    forward = float(ray[2])
    x, y, z = (-v for v in framing.toward)
    pitch = _level_pitch(down, forward, z)
    if pitch is None:
        straight = look_at(framing.toward, (0.0, 0.0, 0.0), framing.roll_rad).quaternion_wxyz
        # The shortest rotation from the ray to the optical axis.
        aside = (1.0 + forward, float(ray[1]), -float(ray[0]), 0.0)
        return SE3(quaternion_wxyz=multiply_quaternions(straight, aside)).rounded()
    level = forward * math.cos(pitch) + down * math.sin(pitch)
    yaw = math.atan2(y, x) + math.atan2(right, level)
    ahead = math.cos(pitch) * math.cos(yaw), math.cos(pitch) * math.sin(yaw), math.sin(pitch)
    return look_at((0.0, 0.0, 0.0), ahead, framing.roll_rad).rounded()


def _level_pitch(down: float, forward: float, up: float) -> float | None:
    """Elevation of the axis of an upright camera that sees a unit vector there [rad].

    The vector is given by its components along the camera's Y and Z axes and the world's Z axis.
    Of several angles, none beyond the vertical, the nearest to level; None if there is none.
    """
    length = math.hypot(down, forward)
    if abs(up) >= length:
        return None
    tilt, rise = math.atan2(down, forward), math.asin(up / length)
    both = (math.remainder(tilt + e, 2.0 * math.pi) for e in (rise, math.pi - rise))
    steepest = math.asin(VERTICAL)
    return min((p for p in both if abs(p) < steepest), key=abs, default=None)


def smallest_and_largest_share(
    sizes_m: Iterable[Vec3], focal_px: float, image_px: int, nearest_m: float, farthest_m: float
) -> tuple[float, float]:
    """Estimate the range of shares that boxes of these sizes fill, from a range of distances.

    The smallest share belongs to a box that shows its two shorter sides at the farthest distance,
    the largest to the sphere around a box, seen from ``nearest_m`` outside the box's nearest
    side; infinite where the camera is within that sphere.
    """
    smallest, largest = math.inf, 0.0
    for size_m in sizes_m:
        _, middle_m, _ = sorted(size_m)
        smallest = min(smallest, focal_px * middle_m / farthest_m / image_px)
        radius_m = 0.5 * math.sqrt(sum(side * side for side in size_m))
        distance_m = 0.5 * min(size_m) + nearest_m
        if distance_m <= radius_m:
            largest = math.inf
            continue
        tangent = radius_m / math.sqrt(distance_m * distance_m - radius_m * radius_m)
        largest = max(largest, 2.0 * focal_px * tangent / image_px)
    return smallest, largest
