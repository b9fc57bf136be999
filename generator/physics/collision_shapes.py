"""Collision geometry for the engine: boxes where they are exact, else shrunken convex hulls.

Bullet adds a collision margin of fixed thickness around every hull. Hulls are therefore shrunk by
that thickness: hull and margin together end where the mesh does, and nothing floats above its
support.
"""

import contextlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import blake2b
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gen_data.core import asset_types, code_digests
from gen_data.core.se3 import SE3, Array, Vec3

if TYPE_CHECKING:
    from scipy.spatial import ConvexHull

SHELL_M = 0.001
"""Bullet's collision margin of hulls, which is fixed for parts of a compound."""

_SHELL_SHARE_MAX = 0.4
"""Largest shrinkage over a part's smallest width: no hull vanishes."""
_RETREAT_MAX = 1.75
"""Just above the square root of 3 of a box's corner. Sharper tips move less than their faces
require: a gap of less than half a margin is better than a tip that sinks in by several.
"""
_SCALE_STEP = 1.05
"""Hulls are shrunk for scale rounded to a power of this: an error of at most 25 micrometres."""
_BOXES_MAX = 16
"""Most primitives in one compound of pybullet."""


@dataclass(frozen=True, eq=False)
class Hull:
    """One convex part about the centre of mass of the whole.

    Attributes:
        vertices_m: float64 [n, 3].
        retreats: Motion of each vertex per metre by which all faces move inward, [n, 3].
        width_m: Smallest extent along the normal of a face.
    """

    vertices_m: Array
    retreats: Array
    width_m: float

    def shrunken(self, depth_m: float) -> Array:
        """Vertices [n, 3] with all faces moved inward by a depth, less for thin parts."""
        return self.vertices_m + min(depth_m, _SHELL_SHARE_MAX * self.width_m) * self.retreats


@dataclass(frozen=True, eq=False)
class CollisionShape:
    """The collision geometry of one asset at scale 1.

    Attributes:
        hulls: About the centre of mass.
        center_of_mass_m: In the asset's frame, for uniform density.
        boxes: ``(centre, half extents)`` of every part about the centre of mass, if all parts are
            axis-aligned boxes and at most ``_BOXES_MAX``; else empty.
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
        """Half extents of the bounding box, [3]."""
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
            # The engine computes the hull of all points that the faces refer to.
            last = first + len(points) - 1
            lines += [
                f"f {k} {min(k + 1, last)} {min(k + 2, last)}" for k in range(first, last + 1, 3)
            ]
            first = last + 1
        return "\n".join(lines) + "\n"

    @cached_property
    def _planes(self) -> list[Array]:
        """Normal and offset [n, 4] of the faces of every part that is not flat."""
        from scipy.spatial import ConvexHull, QhullError

        planes = []
        for hull in self.hulls:
            with contextlib.suppress(QhullError):
                planes.append(ConvexHull(hull.vertices_m).equations)
        return planes

    def hits_m(
        self, T_world_center: SE3, scale: float, origins_m: Array, direction: Array
    ) -> Array:
        """Distances [n] from points [n, 3] along a unit vector [3]; inf = missed, 0 = inside."""
        inverse = T_world_center.inverse()
        origins, along = inverse.apply(origins_m) / scale, inverse.rotate(direction)
        nearest = np.full(len(origins), np.inf)
        for planes in self._planes:
            heights = np.einsum("nk,pk->np", origins, planes[:, :3]) + planes[:, 3]
            rates = np.broadcast_to(np.einsum("pk,k->p", planes[:, :3], along), heights.shape)
            with np.errstate(divide="ignore", invalid="ignore"):
                crossings = -heights / rates
            enters = np.where(rates < 0.0, crossings, 0.0).max(axis=1, initial=0.0)
            leaves = np.where(rates > 0.0, crossings, np.inf).min(axis=1, initial=np.inf)
            beside = ((rates == 0.0) & (heights > 0.0)).any(axis=1)
            hits = (enters <= leaves) & ~beside
            nearest = np.where(hits, np.minimum(nearest, enters), nearest)
        return nearest * scale

    def bounds_m(self, T_world_center: SE3, scale: float) -> tuple[Array, Array]:
        """Low and high corner in the world [m] with the centre of mass at a pose."""
        points = T_world_center.apply(self.vertices_m * scale)
        return points.min(axis=0), points.max(axis=0)


def pack_shape(shape: CollisionShape) -> dict[str, NDArray[Any]]:
    """Arrays that hold a shape, for storage."""
    return {
        "starts": np.cumsum([0, *(len(hull.vertices_m) for hull in shape.hulls)]),
        "vertices_m": shape.vertices_m,
        "retreats": np.concatenate([hull.retreats for hull in shape.hulls]),
        "widths_m": np.array([hull.width_m for hull in shape.hulls]),
        "center_of_mass_m": np.array(shape.center_of_mass_m),
        "boxes": np.array(shape.boxes, dtype=np.float64).reshape(-1, 2, 3),
    }


def unpack_shape(arrays: Mapping[str, NDArray[Any]]) -> CollisionShape:
    """The shape of ``pack_shape``'s arrays, which it refers to."""
    starts = arrays["starts"].tolist()
    hulls = tuple(
        Hull(arrays["vertices_m"][a:b], arrays["retreats"][a:b], width_m)
        for a, b, width_m in zip(starts[:-1], starts[1:], arrays["widths_m"].tolist(), strict=True)
    )
    x, y, z = arrays["center_of_mass_m"].tolist()
    boxes = tuple((tuple(center), tuple(half)) for center, half in arrays["boxes"].tolist())
    return CollisionShape(hulls, (x, y, z), boxes)


def shape_version() -> str:
    """Everything but the parts that a shape depends on: code and libraries."""
    import scipy

    return code_digests.code_digest((__file__,), np.__version__, scipy.__version__)


def scale_step(scale: float) -> int:
    """Exponent of the power of ``_SCALE_STEP`` nearest to a scale; 0 for scale 1."""
    return round(math.log(scale) / math.log(_SCALE_STEP))


def collision_shape(parts: asset_types.ConvexParts) -> CollisionShape:
    """The collision shape of an asset's convex parts."""
    measured = _measure(parts.parts_m)
    volumes_m3 = np.array([part.volume_m3 for part in measured])
    middles = np.stack([part.center_m for part in measured])
    # Flat parts have no volume: if all are flat, they weigh the same.
    weights = volumes_m3 if volumes_m3.sum() > 0.0 else np.ones(len(measured))
    center = (weights[:, None] * middles).sum(axis=0) / weights.sum()
    x, y, z = (round(float(v), 9) for v in center)
    offset = np.array([x, y, z])
    inner = [part.hull for part in measured]
    hulls = tuple(replace(hull, vertices_m=hull.vertices_m - offset) for hull in inner)
    boxes = [_as_box(hull.vertices_m) for hull in hulls]
    exact = tuple(box for box in boxes if box is not None)
    return CollisionShape(
        hulls, (x, y, z), boxes=exact if len(exact) == len(boxes) <= _BOXES_MAX else ()
    )


def box_shape(low_m: Vec3, high_m: Vec3) -> CollisionShape:
    """The collision shape of an axis-aligned box, which needs no search for its hull."""
    low, high = np.array(low_m), np.array(high_m)
    sides = np.array(list(product((-1.0, 1.0), repeat=3)))
    x, y, z = (round(float(v), 9) for v in 0.5 * (low + high))
    vertices_m = np.where(sides < 0.0, low, high) - np.array([x, y, z])
    box = _as_box(vertices_m)
    hull = Hull(vertices_m, -sides, float((high - low).min()))
    return CollisionShape((hull,), (x, y, z), boxes=() if box is None else (box,))


@dataclass(frozen=True, eq=False, slots=True)
class _Part:
    """Measures of one convex part, in the asset's frame; the centre of mass has shape [3]."""

    hull: Hull
    volume_m3: float
    center_m: Array


def _measure(parts_m: Sequence[Array]) -> list[_Part]:
    """Measure convex parts: all faces at once, as numpy's overhead per part would dominate."""
    from scipy.spatial import ConvexHull, QhullError

    middles = [points.mean(axis=0) for points in parts_m]
    hulls: dict[int, ConvexHull] = {}
    for k, part in enumerate(parts_m):
        # qhull refuses flat parts; they cannot shrink and have no weight.
        with contextlib.suppress(QhullError):
            hulls[k] = ConvexHull(part - middles[k])
    measured = [
        _Part(Hull(p, np.zeros_like(p), 0.0), 0.0, m) for p, m in zip(parts_m, middles, strict=True)
    ]
    if not hulls:
        return measured
    solid = list(hulls.values())
    first = np.cumsum([0, *(len(hull.points) for hull in solid)])
    points = np.concatenate([hull.points for hull in solid])
    faces = np.concatenate([hull.simplices + n for hull, n in zip(solid, first[:-1], strict=True)])
    normals = np.concatenate([hull.equations[:, :3] for hull in solid])
    retreats = _retreats(normals, faces, len(points))
    a, b, c = (points[faces[:, k]] for k in range(3))
    volumes_m3 = np.abs(_dot(a, _cross(b, c))) / 6.0
    moments = volumes_m3[:, None] * (a + b + c) / 4.0
    starts = np.cumsum([0, *(len(hull.simplices) for hull in solid[:-1])])
    volumes_m3 = np.add.reduceat(volumes_m3, starts)
    moments = np.add.reduceat(moments, starts)
    for n, (k, hull) in enumerate(hulls.items()):
        kept = np.sort(hull.vertices)
        shrinkable = Hull(parts_m[k][kept], retreats[first[n] + kept], _width_m(hull))
        center = middles[k] + moments[n] / volumes_m3[n]
        measured[k] = _Part(shrinkable, float(volumes_m3[n]), center)
    return measured


def _width_m(hull: "ConvexHull") -> float:
    """Smallest distance [m] between a face and the vertex farthest behind it."""
    depths = np.einsum("kf,kn->fn", hull.equations[:, :3].T, hull.points.T, optimize=False)
    return float((depths.max(axis=1) - depths.min(axis=1)).min())


def _retreats(normals: Array, faces: NDArray[Any], points: int) -> Array:
    """Motion of vertices whose faces move inward by one: ``n . x = -1``, by least squares.

    A little damping selects the shortest solution where all faces of a vertex are coplanar.

    Args:
        normals: Normals of the faces, [f, 3].
        faces: Indices of their corners, [f, 3].
        points: Number of points, including points on no face.

    Returns:
        float64 [points, 3].
    """
    corners = faces.T.reshape(-1)
    nx, ny, nz = normals.T
    terms = (nx * nx, nx * ny, nx * nz, ny * ny, ny * nz, nz * nz, nx, ny, nz)
    sums = [
        np.bincount(corners, np.tile(term, 3), points).astype(np.float64, copy=False)
        for term in terms
    ]
    xx, xy, xz, yy, yz, zz, *b = sums
    xx, yy, zz = xx + 1e-9, yy + 1e-9, zz + 1e-9
    # Cofactors of the symmetric matrix.
    c_xx, c_xy, c_xz = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    c_yy, c_yz, c_zz = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
    scale = -1.0 / (xx * c_xx + xy * c_xy + xz * c_xz)
    x = np.stack(
        [
            (c_xx * b[0] + c_xy * b[1] + c_xz * b[2]) * scale,
            (c_xy * b[0] + c_yy * b[1] + c_yz * b[2]) * scale,
            (c_xz * b[0] + c_yz * b[1] + c_zz * b[2]) * scale,
        ],
        axis=1,
    )
    lengths = np.sqrt(_dot(x, x))[:, None]
    return x * np.minimum(1.0, _RETREAT_MAX / np.maximum(lengths, 1e-12))


def _dot(a: Array, b: Array) -> Array:
    # By coordinate: several times as fast as a sum over a short last axis.
    product: Array = a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]
    return product


def _cross(a: Array, b: Array) -> Array:
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def _as_box(points: Array) -> tuple[Vec3, Vec3] | None:
    """Centre and half extents of a hull that is an axis-aligned box; None for any other."""
    if len(points) != 8:
        return None
    low, high = points.min(axis=0), points.max(axis=0)
    center, half = 0.5 * (low + high), 0.5 * (high - low)
    if (np.abs(np.abs(points - center) - half) > 1e-6 * half.max()).any():
        return None
    (cx, cy, cz), (hx, hy, hz) = center.tolist(), half.tolist()
    return (cx, cy, cz), (hx, hy, hz)
