"""Collision geometry prepared for the engine: boxes where exact, else hulls with room for a shell.

Bullet keeps a shell of fixed thickness (its collision margin) around every hull. Each hull is
therefore made smaller by just that: shell and hull together end where the mesh does, and nothing
floats above its support.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b

import numpy as np

from generator.core.geometry import ConvexParts
from generator.core.se3 import SE3, Array, Vec3

SHELL_M = 0.001
"""Bullet's own thickness for hulls; parts of a compound cannot have another."""

_SHELL_SHARE_MAX = 0.4
"""Of a part's smallest width: a hull never shrinks to nothing."""
_RETREAT_MAX = 1.75
"""Just above the square root of 3, of a box's corner. Sharper tips move less than their faces ask
for: better a gap of less than half a shell than a tip that sinks in by several.
"""
_SCALE_STEP = 1.05
"""Hulls are shrunk for the nearest of these steps of scale: 25 micrometres at most are missing."""
_BOXES_MAX = 16
"""Primitives that pybullet takes in one compound."""


@dataclass(frozen=True, eq=False)
class Hull:
    """One convex part about the centre of mass of the whole.

    Attributes:
        vertices_m: float64 [n, 3].
        retreats: How each vertex moves per metre by which all faces move inward, [n, 3].
        width_m: Smallest distance between parallel planes on both sides, over all faces.
    """

    vertices_m: Array
    retreats: Array
    width_m: float

    def shrunken(self, depth_m: float) -> Array:
        """Vertices with all faces moved inward by a depth, less for thin parts."""
        return self.vertices_m + min(depth_m, _SHELL_SHARE_MAX * self.width_m) * self.retreats


@dataclass(frozen=True, eq=False)
class CollisionShape:
    """The collision geometry of one asset at scale 1.

    Attributes:
        hulls: About the centre of mass.
        center_of_mass_m: In the asset's frame; of a solid of even density.
        boxes: ``(centre, half extents)`` of every part, about the centre of mass, where all
            parts are upright boxes and few; else empty.
    """

    hulls: tuple[Hull, ...]
    center_of_mass_m: Vec3
    boxes: tuple[tuple[Vec3, Vec3], ...]

    @cached_property
    def vertices_m(self) -> Array:
        """Vertices of all hulls, float64 [n, 3]."""
        return np.concatenate([hull.vertices_m for hull in self.hulls])

    @cached_property
    def half_extents_m(self) -> Array:
        """Of the bounding box, [3]."""
        half: Array = 0.5 * (self.vertices_m.max(axis=0) - self.vertices_m.min(axis=0))
        return half

    @cached_property
    def key(self) -> str:
        """Digest of the content."""
        digest = blake2b(digest_size=16)
        for hull in self.hulls:
            digest.update(hull.vertices_m.tobytes() + b"|")
        return digest.hexdigest()

    def obj(self, step: int) -> str:
        """Wavefront OBJ at scale 1, one object per hull, shrunk for ``scale_step(scale)``."""
        lines, first = [], 1
        for number, hull in enumerate(self.hulls):
            lines.append(f"o part{number}")
            points = hull.shrunken(SHELL_M / _SCALE_STEP**step)
            lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in points]
            # The engine builds the hull of whatever points the faces name.
            last = first + len(points) - 1
            lines += [
                f"f {k} {min(k + 1, last)} {min(k + 2, last)}" for k in range(first, last + 1, 3)
            ]
            first = last + 1
        return "\n".join(lines) + "\n"

    def bounds_m(self, T_world_center: SE3, scale: float) -> tuple[Array, Array]:
        """Low and high corner in the world [m] with the centre of mass at a pose."""
        points = T_world_center.apply(self.vertices_m * scale)
        return points.min(axis=0), points.max(axis=0)


def scale_step(scale: float) -> int:
    """Number of the step of scale that is nearest to a scale; 0 for scale 1."""
    return round(math.log(scale) / math.log(_SCALE_STEP))


def collision_shape(parts: ConvexParts) -> CollisionShape:
    """The shape of an asset's convex parts."""
    measured = [_measured(part) for part in parts.parts_m]
    volumes_m3 = np.array([volume for _, volume, _ in measured])
    middles = np.stack([middle for _, _, middle in measured])
    # Parts that are all flat have no volume; then every part weighs the same.
    weights = volumes_m3 if volumes_m3.sum() > 0.0 else np.ones(len(measured))
    center = (weights[:, None] * middles).sum(axis=0) / weights.sum()
    x, y, z = (round(float(v), 9) for v in center)
    offset = np.array([x, y, z])
    hulls = tuple(
        Hull(hull.vertices_m - offset, hull.retreats, hull.width_m) for hull, _, _ in measured
    )
    boxes = [_as_box(hull.vertices_m) for hull in hulls]
    exact = tuple(box for box in boxes if box is not None)
    return CollisionShape(
        hulls, (x, y, z), boxes=exact if len(exact) == len(boxes) <= _BOXES_MAX else ()
    )


def _measured(points: Array) -> tuple[Hull, float, Array]:
    """The hull of some points, its volume [m^3] and its centre of mass [m]."""
    from scipy.spatial import ConvexHull, QhullError

    middle = points.mean(axis=0)
    try:
        hull = ConvexHull(points - middle)
    except QhullError:  # flat: nothing to shrink and no weight
        return Hull(points, np.zeros_like(points), 0.0), 0.0, middle
    kept = np.sort(hull.vertices)
    triangles = hull.points[hull.simplices]
    normals = hull.equations[:, :3]
    volumes = np.abs(_dot(triangles[:, 0], _cross(triangles[:, 1], triangles[:, 2]))) / 6.0
    volume_m3 = float(volumes.sum())
    moment = (volumes[:, None] * triangles.sum(axis=1) / 4.0).sum(axis=0)
    depths = np.einsum("fk,nk->fn", normals, hull.points[kept], optimize=False)
    width_m = float((depths.max(axis=1) - depths.min(axis=1)).min())
    meets = (hull.simplices[None, :, :] == kept[:, None, None]).any(axis=2)
    retreats = _retreats(normals, meets.astype(np.float64))
    return Hull(points[kept], retreats, width_m), volume_m3, middle + moment / volume_m3


def _retreats(normals: Array, meets: Array) -> Array:
    """Where vertices go when their faces move inward by one: ``n . x = -1``, by least squares.

    A trace of damping picks the shortest answer where all faces of a vertex lie in one plane.

    Args:
        normals: Of the faces, shape [f, 3].
        meets: 1 where a vertex belongs to a face, else 0, shape [v, f].
    """
    squares = np.einsum("fi,fj->fij", normals, normals, optimize=False)
    a = np.einsum("vf,fij->vij", meets, squares, optimize=False) + 1e-9 * np.eye(3)
    b = np.einsum("vf,fi->vi", meets, normals, optimize=False)
    rows = (_cross(a[:, 1], a[:, 2]), _cross(a[:, 2], a[:, 0]), _cross(a[:, 0], a[:, 1]))
    cofactors = np.stack(rows, axis=1)
    x: Array = -_dot(cofactors, b[:, None, :]) / _dot(a[:, 0], cofactors[:, 0])[:, None]
    lengths = np.sqrt(_dot(x, x))[:, None]
    return x * np.minimum(1.0, _RETREAT_MAX / lengths)


def _dot(a: Array, b: Array) -> Array:
    # Coordinate by coordinate: summing over a short last axis takes several times as long.
    product: Array = a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]
    return product


def _cross(a: Array, b: Array) -> Array:
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def _as_box(points: Array) -> tuple[Vec3, Vec3] | None:
    """Centre and half extents of a hull whose vertices are the corners of an upright box."""
    low, high = points.min(axis=0), points.max(axis=0)
    center, half = 0.5 * (low + high), 0.5 * (high - low)
    if len(points) != 8 or (np.abs(np.abs(points - center) - half) > 1e-6 * half.max()).any():
        return None
    (cx, cy, cz), (hx, hy, hz) = center.tolist(), half.tolist()
    return (cx, cy, cz), (hx, hy, hz)
