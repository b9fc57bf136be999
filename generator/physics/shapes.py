"""Collision geometry prepared for the engine: primitives where exact, else shrunken hulls.

The engine keeps a thin shell (its collision margin) around every hull, so hulls are made smaller
by the shell's thickness: the outside of shell and hull together is where the mesh is, and nothing
floats above its support.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b

import numpy as np

from generator.core.geometry import ConvexParts
from generator.core.se3 import SE3, Array, Vec3

_MARGIN_M = 0.0005
_MARGIN_SHARE_MAX = 0.2
_BOXES_MAX = 16
"""Primitives that pybullet takes in one compound shape."""


@dataclass(frozen=True, eq=False)
class CollisionShape:
    """The collision geometry of one asset at scale 1, about its centre of mass.

    Attributes:
        parts_m: Hull vertices per part, float64 [n, 3], relative to the centre of mass.
        center_of_mass_m: In the asset's frame; of a solid of even density.
        boxes: ``(centre, half extents)`` of every part, where all parts are upright boxes and
            few; else empty.
    """

    parts_m: tuple[Array, ...]
    center_of_mass_m: Vec3
    boxes: tuple[tuple[Vec3, Vec3], ...]

    @cached_property
    def vertices_m(self) -> Array:
        """Vertices of all parts, float64 [n, 3], relative to the centre of mass."""
        return np.concatenate(self.parts_m)

    @cached_property
    def margin_m(self) -> float:
        """Thickness of the shell; thinner for thin parts."""
        thinnest = min(float(_half_extents(part).min()) for part in self.parts_m)
        return max(min(_MARGIN_M, _MARGIN_SHARE_MAX * thinnest), 1e-6)

    @cached_property
    def radius_m(self) -> float:
        """Half the smallest extent of the whole."""
        return float(_half_extents(self.vertices_m).min())

    @cached_property
    def volume_m3(self) -> float:
        """Of the bounding box: an upper bound."""
        return float(np.prod(2.0 * _half_extents(self.vertices_m)))

    @cached_property
    def obj(self) -> str:
        """The shrunken parts as Wavefront OBJ, one object per part."""
        lines, first = [], 1
        for number, part in enumerate(self.parts_m):
            lines.append(f"o part{number}")
            lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in _shrunken(part, self.margin_m)]
            # The engine builds the hull of what the faces name; which faces does not matter.
            last = first + len(part) - 1
            lines += [
                f"f {k} {min(k + 1, last)} {min(k + 2, last)}" for k in range(first, last + 1, 3)
            ]
            first = last + 1
        return "\n".join(lines) + "\n"

    @cached_property
    def key(self) -> str:
        """Digest of the content."""
        return blake2b(self.obj.encode(), digest_size=16).hexdigest()

    def bounds_m(self, T_world_center: SE3, scale: float) -> tuple[Array, Array]:
        """Low and high corner in the world [m] with the centre of mass at a pose."""
        points = T_world_center.apply(self.vertices_m * scale)
        return points.min(axis=0), points.max(axis=0)


def collision_shape(parts: ConvexParts) -> CollisionShape:
    """The shape of an asset's convex parts."""
    center = _center_of_mass(parts.parts_m)
    offset = np.asarray(center)
    boxes = [_as_box(part - offset) for part in parts.parts_m]
    exact = tuple(box for box in boxes if box is not None)
    return CollisionShape(
        parts_m=tuple(part - offset for part in parts.parts_m),
        center_of_mass_m=center,
        boxes=exact if len(exact) == len(boxes) <= _BOXES_MAX else (),
    )


def _center_of_mass(parts_m: tuple[Array, ...]) -> Vec3:
    """Of solid hulls; where parts overlap, matter counts twice."""
    from scipy.spatial import ConvexHull, QhullError

    total, moment = 0.0, np.zeros(3)
    for part in parts_m:
        middle = part.mean(axis=0)
        try:
            triangles = part[ConvexHull(part).simplices] - middle
        except QhullError:  # a flat part has no volume and no say
            continue
        volumes = np.abs(np.einsum("ij,ij->i", triangles[:, 0], _normals(triangles))) / 6.0
        centers = middle + triangles.sum(axis=1) / 4.0
        total += float(volumes.sum())
        moment += (volumes[:, None] * centers).sum(axis=0)
    if total <= 0.0:
        low, high = np.concatenate(parts_m).min(axis=0), np.concatenate(parts_m).max(axis=0)
        total, moment = 1.0, 0.5 * (low + high)
    x, y, z = (round(float(v), 9) for v in moment / total)
    return (x, y, z)


def _normals(triangles: Array) -> Array:
    return np.cross(triangles[:, 1], triangles[:, 2])


def _half_extents(points: Array) -> Array:
    extents: Array = 0.5 * (points.max(axis=0) - points.min(axis=0))
    return extents


def _shrunken(part: Array, margin_m: float) -> Array:
    """The part, smaller by the margin on every side of its bounding box."""
    middle = 0.5 * (part.max(axis=0) + part.min(axis=0))
    half = np.maximum(_half_extents(part), 1e-9)
    factor = np.maximum(half - margin_m, (1.0 - _MARGIN_SHARE_MAX) * half) / half
    shrunken: Array = middle + (part - middle) * factor
    return shrunken


def _as_box(part: Array) -> tuple[Vec3, Vec3] | None:
    """Centre and half extents of a part whose vertices are the corners of an upright box."""
    low, high = part.min(axis=0), part.max(axis=0)
    half = 0.5 * (high - low)
    at_corner = np.abs(np.abs(part - 0.5 * (low + high)) - half) <= 1e-6 * max(
        float(half.max()), 1e-3
    )
    corners = np.unique(np.round((part - low) / np.maximum(high - low, 1e-12)), axis=0)
    if not at_corner.all() or len(corners) != 8:
        return None
    cx, cy, cz = (float(v) for v in 0.5 * (low + high))
    hx, hy, hz = (float(v) for v in half)
    return (cx, cy, cz), (hx, hy, hz)
