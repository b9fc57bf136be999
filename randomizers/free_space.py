"""Free space: footprints of bodies on the ground, and clearance of points."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.core.boxes import Rectangle, overlap_of
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Body, Camera, Scene
from gen_data.core.se3 import SE3, Array, Vec3, rotate_by_quaternion

_GRID = (16, 9)
"""Columns and rows of the rays that test a view."""
_PARALLEL = 1e-9
"""Smallest component of a direction, instead of 0."""


@dataclass(frozen=True)
class Footprint:
    """A rectangle on the ground: centre [m], half extents [m] and yaw of its X axis."""

    x_m: float
    y_m: float
    half_x_m: float
    half_y_m: float
    yaw_rad: float

    @classmethod
    def of(cls, T_world_body: SE3, bounds_m: tuple[Vec3, Vec3], scale: float = 1.0) -> "Footprint":
        """Footprint of an upright body with these bounds in its own frame."""
        (x0, y0, _), (x1, y1, _) = bounds_m
        q = T_world_body.quaternion_wxyz
        middle = (0.5 * scale * (x0 + x1), 0.5 * scale * (y0 + y1), 0.0)
        tx, ty, _ = T_world_body.translation_m
        x, y, _ = rotate_by_quaternion(q, middle)
        half_x_m, half_y_m = 0.5 * scale * (x1 - x0), 0.5 * scale * (y1 - y0)
        return cls(tx + x, ty + y, half_x_m, half_y_m, 2.0 * math.atan2(q[3], q[0]))

    def expand(self, margin_m: float) -> "Footprint":
        """Return the rectangle with a margin on every side."""
        half_x_m, half_y_m = self.half_x_m + margin_m, self.half_y_m + margin_m
        return Footprint(self.x_m, self.y_m, half_x_m, half_y_m, self.yaw_rad)

    @property
    def rectangle(self) -> Rectangle:
        """Centre, cosine and sine of the yaw, half extents."""
        c, s = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return (self.x_m, self.y_m, c, s, self.half_x_m, self.half_y_m)

    @property
    def disc(self) -> tuple[float, float, float]:
        """Centre and half of the diagonal [m]."""
        return (self.x_m, self.y_m, math.hypot(self.half_x_m, self.half_y_m))


class Ground:
    """Footprints of existing objects."""

    def __init__(self) -> None:
        """No footprint; their discs, centres and half diagonals [m], will be a table [3, n]."""
        self._rectangles: list[Rectangle] = []
        self._discs = np.zeros((3, 64))

    def copy(self) -> "Ground":
        """A ground with the same footprints."""
        other = Ground()
        other._rectangles, other._discs = self._rectangles.copy(), self._discs.copy()
        return other

    def add(self, footprint: Footprint) -> None:
        """Add a footprint."""
        count = len(self._rectangles)
        if count == self._discs.shape[1]:
            self._discs = np.concatenate([self._discs, np.zeros_like(self._discs)], axis=1)
        self._rectangles.append(footprint.rectangle)
        self._discs[:, count] = footprint.disc

    def is_free(self, footprint: Footprint) -> bool:
        """Whether a rectangle overlaps no footprint."""
        x, y, reach = self._discs[:, : len(self._rectangles)]
        own_x, own_y, own_reach = footprint.disc
        dx, dy, reach = x - own_x, y - own_y, reach + own_reach
        # Few are near: for them, numbers are quicker than arrays.
        near = (dx * dx + dy * dy < reach * reach).nonzero()[0].tolist()
        if not near:
            return True
        own = footprint.rectangle
        return not any(overlap_of(own, self._rectangles[k]) for k in near)

    def occupy(self, footprint: Footprint, margin_m: float = 0.0) -> bool:
        """Add a footprint if it is free with a margin on every side; return whether it was."""
        if not self.is_free(footprint.expand(margin_m)):
            return False
        self.add(footprint)
        return True


def standing_bodies(scene: Scene) -> Iterator[Body]:
    """Yield the bodies with an instance id, except roads."""
    roads = {lane.road for lane in scene.lanes}
    for body in scene.bodies:
        if body.instance_id and body.name.partition("/")[0] not in roads:
            yield body


def make_ground(bodies: Iterable[Body], assets: AssetIndex) -> Ground:
    """Collect the footprints of bodies."""
    return _grounds.get(tuple(bodies), assets)


class _Grounds:
    """The latest ground: each of a street's randomizers needs it for the bodies so far."""

    def __init__(self) -> None:
        self._assets: AssetIndex | None = None
        self._bodies: tuple[Body, ...] = ()
        self._ground = Ground()

    def get(self, bodies: tuple[Body, ...], assets: AssetIndex) -> Ground:
        """The ground of these bodies: of the latest ones and more, as a rule."""
        known = len(self._bodies)
        if assets is not self._assets or bodies[:known] != self._bodies:
            known, self._ground = 0, Ground()
        for body in bodies[known:]:
            bounds_m = standing_bounds_m(assets, body.asset)
            self._ground.add(Footprint.of(body.T_world_body, bounds_m, body.scale))
        self._assets, self._bodies = assets, bodies
        return self._ground.copy()


_grounds = _Grounds()


def standing_bounds_m(assets: AssetIndex, asset: str) -> tuple[Vec3, Vec3]:
    """Bounds of an asset [m] without the cables that hang between poles, far above all others."""
    body_m = assets.body_bounds_m(asset)
    if body_m is None or assets.get(asset).category != "utility_pole":
        return assets.bounds_m(asset)
    return body_m


def is_inside(point_m: Vec3, low_m: Vec3, high_m: Vec3) -> bool:
    """Whether a point lies in an axis-aligned box."""
    return all(a <= p <= b for p, a, b in zip(point_m, low_m, high_m, strict=True))


def is_in_the_open(point_m: Vec3, scene: Scene, assets: AssetIndex, margin_m: float) -> bool:
    """Whether a point is inside the scene's interior and no nearer than ``margin_m`` to a body."""
    return is_inside(point_m, *scene.interior_m) and is_clear(point_m, scene, assets, margin_m)


@dataclass(frozen=True, eq=False)
class Sight:
    """First hits of rays through the middles of a grid of an image's cells.

    Attributes:
        bodies: Bodies that were tested, by their bounding boxes.
        distances_m: Per ray; infinite if it meets nothing within reach.
        hits: Per ray, index of the body; -1 = none.
        places: Per ray, its place in the image, from -1 to 1 to the right and down, [n, 2].
    """

    bodies: tuple[Body, ...]
    distances_m: Array
    hits: NDArray[np.int64]
    places: Array


def look_around(camera: Camera, scene: Scene, assets: AssetIndex, reach_m: float) -> Sight:
    """Surfaces that a camera sees within a reach; parts of the image without a ray show nothing."""
    k = camera.intrinsics
    u, v = ((np.arange(count) + 0.5) / count for count in _GRID)
    shares = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    rays = k.rays(shares * (k.width_px, k.height_px))
    usable = np.isfinite(rays).all(axis=1)
    rays = camera.T_world_camera.rotate(rays[usable])
    places = 2.0 * shares[usable] - 1.0
    bodies = list(_solid_bodies(scene))
    seen = _Boxes.of(bodies, assets, camera.T_world_camera.translation_m)
    near = np.flatnonzero((np.maximum(seen.low_m, -seen.high_m) <= reach_m).all(axis=0))
    if not len(near) or not len(rays):
        nothing = np.full(len(rays), np.inf), np.full(len(rays), -1, np.int64)
        return Sight((), *nothing, places)
    # Distances at which rays cross the planes of the faces (Kay and Kajiya 1986).
    w, x, y, z = seen.inverse[:, near, None]
    rx, ry, rz = rays.T
    along: Array = np.array(rotate_by_quaternion((w, x, y, z), (rx, ry, rz)))
    along = np.where(np.abs(along) < _PARALLEL, _PARALLEL, along)
    one, other = (edge_m[:, near, None] / along for edge_m in (seen.low_m, seen.high_m))
    enter = np.maximum(np.minimum(one, other).max(axis=0), 0.0)
    leave = np.maximum(one, other).min(axis=0)
    distances = np.where((enter <= leave) & (enter <= reach_m), enter, np.inf)
    first = distances.argmin(axis=0)
    nearest = distances.min(axis=0)
    hits = np.where(np.isfinite(nearest), first, -1)
    return Sight(tuple(bodies[k] for k in near), nearest, hits, places)


@dataclass(frozen=True, eq=False)
class _Boxes:
    """Bounding boxes of bodies in their own frames, from a point on.

    Attributes:
        low_m: From the point to the lowest corners, [3, n].
        high_m: From the point to the highest corners, [3, n].
        inverse: Rotations from the world to the bodies (w, x, y, z), [4, n].
    """

    low_m: Array
    high_m: Array
    inverse: Array

    @classmethod
    def of(cls, bodies: list[Body], assets: AssetIndex, point_m: Vec3) -> "_Boxes":
        bounds_m = {name: standing_bounds_m(assets, name) for name in {b.asset for b in bodies}}
        scales = np.array([body.scale for body in bodies])
        boxes_m = np.array([bounds_m[body.asset] for body in bodies]).reshape(-1, 2, 3)
        low, high = (boxes_m * scales[:, None, None]).transpose(1, 2, 0)
        w, x, y, z = np.array([b.T_world_body.quaternion_wxyz for b in bodies]).reshape(-1, 4).T
        sx, sy, sz = -np.array([b.T_world_body.translation_m for b in bodies]).reshape(-1, 3).T
        # The products and sums of ``SE3.inverse() @ SE3(point_m)``, for all bodies at once.
        inverse = (w, -x, -y, -z)
        local_m = np.array(rotate_by_quaternion(inverse, (sx, sy, sz))) + np.array(
            rotate_by_quaternion(inverse, point_m)
        )
        return cls(low - local_m, high - local_m, np.array(inverse))


def hidden_share(camera: Camera, scene: Scene, assets: AssetIndex, near_m: float) -> float:
    """Share of a camera's image, in [0, 1], that bodies nearer than ``near_m`` may hide.

    ``is_clear`` tests the same bodies.
    """
    distances_m = look_around(camera, scene, assets, near_m).distances_m
    return float((distances_m <= near_m).mean()) if len(distances_m) else 0.0


def is_clear(point_m: Vec3, scene: Scene, assets: AssetIndex, margin_m: float) -> bool:
    """Whether a point is at least as far as ``margin_m`` to a body.

    Bodies are tested by their bounding boxes. The background (the room itself) is ignored, except
    for the fixtures of lights.
    """
    boxes = _Boxes.of(list(_solid_bodies(scene)), assets, point_m)
    return not ((boxes.low_m <= margin_m) & (boxes.high_m >= -margin_m)).all(axis=0).any()


def _solid_bodies(scene: Scene) -> Iterator[Body]:
    """Yield all bodies but the background; fixtures of lights do not belong to it."""
    fixtures = {light.body for light in scene.lights}
    for body in scene.bodies:
        if body.instance_id or body.name in fixtures:
            yield body
