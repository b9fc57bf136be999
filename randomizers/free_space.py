"""Free space: footprints of bodies on the ground, and clearance of points."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from gen_data.generator.core.boxes import Rectangle, overlap_of
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import Body, Camera, Scene
from gen_data.generator.core.se3 import SE3, Vec3, rotate_by_quaternion

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
    def of(cls, T_world_body: SE3, bounds_m: tuple[Vec3, Vec3], scale: float = 1.0) -> Footprint:
        """Footprint of an upright body with these bounds in its own frame."""
        (x0, y0, _), (x1, y1, _) = bounds_m
        q = T_world_body.quaternion_wxyz
        middle = (0.5 * scale * (x0 + x1), 0.5 * scale * (y0 + y1), 0.0)
        tx, ty, _ = T_world_body.translation_m
        x, y, _ = rotate_by_quaternion(q, middle)
        half_x_m, half_y_m = 0.5 * scale * (x1 - x0), 0.5 * scale * (y1 - y0)
        return cls(tx + x, ty + y, half_x_m, half_y_m, 2.0 * math.atan2(q[3], q[0]))

    def expand(self, margin_m: float) -> Footprint:
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

    def copy(self) -> Ground:
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
    """The latest ground: each of a street's randomizers asks for that of the bodies so far."""

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


def hidden_share(camera: Camera, scene: Scene, assets: AssetIndex, near_m: float) -> float:
    """Share of a camera's image, in [0, 1], that bodies nearer than ``near_m`` may hide.

    Rays through the middles of a grid of cells are tested with the bounding boxes of the bodies
    that ``is_clear`` tests; parts of the image without a ray show nothing.
    """
    k = camera.intrinsics
    u, v = (np.arange(count) + 0.5 for count in _GRID)
    cells = np.stack(np.meshgrid(u / _GRID[0] * k.width_px, v / _GRID[1] * k.height_px), axis=-1)
    rays = k.rays(cells.reshape(-1, 2))
    rays = camera.T_world_camera.rotate(rays[np.isfinite(rays).all(axis=1)])
    eye_m = camera.T_world_camera.translation_m
    hidden = np.zeros(len(rays), np.bool_)
    for body in _solid_bodies(scene):
        low, high = (body.scale * np.array(edge) for edge in standing_bounds_m(assets, body.asset))
        T_body_world = body.T_world_body.inverse()
        start = np.array((T_body_world @ SE3(eye_m)).translation_m)
        if (np.maximum(low - start, start - high) > near_m).any():
            continue
        # Distances at which rays cross the planes of the faces (Kay and Kajiya 1986).
        along = T_body_world.rotate(rays)
        along = np.where(np.abs(along) < _PARALLEL, _PARALLEL, along)
        one, other = (low - start) / along, (high - start) / along
        enter, leave = np.minimum(one, other).max(axis=1), np.maximum(one, other).min(axis=1)
        hidden |= (enter <= np.minimum(leave, near_m)) & (leave >= 0.0)
    return float(hidden.mean()) if len(hidden) else 0.0


def is_clear(point_m: Vec3, scene: Scene, assets: AssetIndex, margin_m: float) -> bool:
    """Whether a point is no nearer than ``margin_m`` to a body.

    Bodies are tested by their bounding boxes. The background (the room itself) is ignored, except
    for the fixtures of lights.
    """
    bodies = list(_solid_bodies(scene))
    if not bodies:
        return True
    bounds_m = {name: standing_bounds_m(assets, name) for name in {b.asset for b in bodies}}
    scales = np.array([body.scale for body in bodies])
    boxes_m = np.array([bounds_m[body.asset] for body in bodies]) * scales[:, None, None]
    w, x, y, z = np.array([body.T_world_body.quaternion_wxyz for body in bodies]).T
    shift_m = tuple(-np.array([body.T_world_body.translation_m for body in bodies]).T)
    # The products and sums of ``SE3.inverse() @ SE3(point_m)``, for all bodies at once.
    inverse = (w, -x, -y, -z)
    local_m = np.array(rotate_by_quaternion(inverse, shift_m)) + np.array(
        rotate_by_quaternion(inverse, point_m)
    )
    low, high = boxes_m[:, 0].T - margin_m, boxes_m[:, 1].T + margin_m
    return not ((low <= local_m) & (local_m <= high)).all(axis=0).any()


def _solid_bodies(scene: Scene) -> Iterator[Body]:
    """Yield all bodies but the background; fixtures of lights are no background."""
    fixtures = {light.body for light in scene.lights}
    for body in scene.bodies:
        if body.instance_id or body.name in fixtures:
            yield body
