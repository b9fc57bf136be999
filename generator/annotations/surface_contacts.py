"""Contacts and distances between triangle meshes, exact up to rounding.

The closest features of two disjoint triangles are a vertex and a face, or two edges (Ericson,
"Real-Time Collision Detection", 2005, section 5.1): all fifteen such pairs are evaluated. Triangles
are float64 [n, 3, 3]: corners [m] in one frame, counter-clockwise seen from outside.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from gen_data.core.se3 import Array

Rows = NDArray[np.intp]

PAIRS_AT_ONCE = 1 << 22
"""Pairs of triangles whose bounds are compared in one step: bounds memory, not the result."""
ROUNDING_M = 1e-6
"""More than rounding adds to distances from lines: squares of 100 m have 1e-12 m^2."""
OPPOSED = -0.1
"""Surfaces in contact face each other: largest cosine between their outward normals."""
EDGE = ((0, 1), (1, 2), (2, 0))


@dataclass(frozen=True, eq=False, slots=True)
class Contacts:
    """Points where body A touches body B.

    Attributes:
        points_m: On A's surface, [n, 3].
        normals: Unit vectors from B into A, [n, 3].
        gaps_m: Distances along the normals, negative where the surfaces cross, [n].
    """

    points_m: Array
    normals: Array
    gaps_m: Array

    def inverse(self) -> "Contacts":
        """The same contacts of body B with body A."""
        return Contacts(
            self.points_m - self.gaps_m[:, None] * self.normals, -self.normals, self.gaps_m
        )


def find_contacts(a: Array, b: Array, tolerance_m: float) -> Contacts:
    """Contacts of two meshes: regular pairs of features at most a tolerance apart.

    A pair is regular if a vertex lies over the inside of a face, or if two edges cross: only then
    does the pair have a normal. Without a contact all arrays have no rows.
    """
    found: list[tuple[Array, Array, Array]] = []
    for i, j in _near_pairs(a, b, tolerance_m):
        one, other = a[i], b[j]
        n_a, n_b = triangle_normals(one), triangle_normals(other)
        facing = (n_a * n_b).sum(1) < OPPOSED
        one, other, n_a, n_b = one[facing], other[facing], n_a[facing], n_b[facing]
        for k in range(3):
            height, inside = _over_face(one[:, k], other, n_b)
            found.append(_select(one[:, k], n_b, height, inside, tolerance_m))
            height, inside = _over_face(other[:, k], one, n_a)
            foot = other[:, k] - height[:, None] * n_a
            found.append(_select(foot, -n_a, height, inside, tolerance_m))
        for p, q in EDGE:
            for r, s in EDGE:
                point_a, point_b, crossing = _between_edges(
                    one[:, p], one[:, q], other[:, r], other[:, s]
                )
                across = np.cross(one[:, q] - one[:, p], other[:, s] - other[:, r])
                across /= np.maximum(np.sqrt((across * across).sum(1)), 1e-30)[:, None]
                across *= np.sign((across * (n_b - n_a)).sum(1))[:, None]
                height = ((point_a - point_b) * across).sum(1)
                found.append(_select(point_a, across, height, crossing, tolerance_m))
    if not found:
        return Contacts(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))
    points, normals, gaps = (np.concatenate(part) for part in zip(*found, strict=True))
    return Contacts(points, normals, gaps)


def are_within(a: Array, b: Array, limit_m: float) -> bool:
    """Whether two meshes are at most a limit apart [m]."""
    a = a[_reaching(a, b, limit_m)]
    b = b[_reaching(b, a, limit_m)] if len(a) else b[:0]
    if not len(b):
        return False
    from scipy.spatial import cKDTree

    # Corners decide most cases: one of each triangle, and a tree of the smaller set.
    few, many = sorted((a[:, 0], b[:, 0]), key=len)
    nearest = cKDTree(few).query(many, distance_upper_bound=limit_m)[0]
    if np.isfinite(nearest).any():
        return True
    return any((_distances(a[i], b[j]) <= limit_m).any() for i, j in _near_pairs(a, b, limit_m))


def hits_by_rays(origins_m: Array, directions: Array, triangles: Array) -> Array:
    """Distances at which rays hit triangles, [rays, triangles].

    In units of the directions' lengths; inf where a ray misses, or the triangle is behind it.
    Origins and directions are [n, 3].
    """
    distances = np.full((len(directions), len(triangles)), np.inf)
    for rays, faces, reached in _hits(origins_m, directions, triangles):
        distances[rays, faces] = reached
    return distances


def first_hits(origins_m: Array, directions: Array, triangles: Array) -> Array:
    """Distances at which rays first hit any of the triangles, [rays]; see ``hits_by_rays``."""
    nearest = np.full(len(directions), np.inf)
    for rays, _, reached in _hits(origins_m, directions, triangles):
        np.minimum.at(nearest, rays, reached)
    return nearest


def _hits(
    origins_m: Array, directions: Array, triangles: Array
) -> Iterator[tuple[Rows, Rows, Array]]:
    """Rays, triangles that they hit, and distances, in parts (Moeller and Trumbore, 1997).

    Only triangles whose bounding sphere the line of a ray meets are tested.
    """
    middles = triangles.mean(1)
    radii_m = np.sqrt(((triangles - middles[:, None]) ** 2).sum(2).max(1)) + ROUNDING_M
    base = triangles[:, 0]
    u_axes, v_axes = triangles[:, 1] - base, triangles[:, 2] - base
    units = directions / np.sqrt((directions**2).sum(1))[:, None]
    step = max(1, PAIRS_AT_ONCE // max(1, len(triangles)))
    for start in range(0, len(directions), step):
        part = slice(start, start + step)
        # Distance of a middle from a line: Pythagoras with the distances to and along it.
        along = units[part] @ middles.T - (units[part] * origins_m[part]).sum(1)[:, None]
        apart = ((origins_m[part] ** 2).sum(1)[:, None] + (middles**2).sum(1)) - 2.0 * (
            origins_m[part] @ middles.T
        )
        rays, faces = np.nonzero(apart - along**2 <= radii_m**2)
        origin, direction = origins_m[part][rays], directions[part][rays]
        to_origin, u_axis, v_axis = origin - base[faces], u_axes[faces], v_axes[faces]
        p = _cross(direction, v_axis)
        area = (u_axis * p).sum(1)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = (to_origin * p).sum(1) / area
            q = _cross(to_origin, u_axis)
            v = (q * direction).sum(1) / area
            t = (v_axis * q).sum(1) / area
            hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
        yield rays[hit] + start, faces[hit], t[hit]


def _cross(a: Array, b: Array) -> Array:
    """Cross products of rows; ``np.cross`` takes five times as long for few of them."""
    return a[:, [1, 2, 0]] * b[:, [2, 0, 1]] - a[:, [2, 0, 1]] * b[:, [1, 2, 0]]


def meet_along(points_m: Array, direction: Array, triangles: Array, length_m: float) -> bool:
    """Whether a ray from any of the points [n, 3] hits a mesh within a distance [m]."""
    near = triangles[_reaching(triangles, points_m, length_m)] if len(points_m) else triangles[:0]
    if not len(near):
        return False
    unit = direction / np.linalg.norm(direction)
    hits = hits_by_rays(points_m, np.tile(unit, (len(points_m), 1)), near)
    return bool((hits <= length_m).any())


def _reaching(triangles: Array, others: Array, limit_m: float) -> NDArray[np.bool_]:
    """Whether the bounds of triangles come as near as a limit to a mesh's bounds, bool [n]."""
    corners = others.reshape(-1, 3)
    return _overlap(triangles.min(1), triangles.max(1), corners.min(0), corners.max(0), limit_m)


def _near_pairs(a: Array, b: Array, limit_m: float) -> Iterator[tuple[Rows, Rows]]:
    """Indices of the pairs of triangles whose bounds are at most a limit apart, in parts."""
    near_a = np.flatnonzero(_reaching(a, b, limit_m))
    near_b = np.flatnonzero(_reaching(b, a, limit_m))
    if not (len(near_a) and len(near_b)):
        return
    low_b, high_b = b[near_b].min(1), b[near_b].max(1)
    step = max(1, PAIRS_AT_ONCE // len(near_b))
    for start in range(0, len(near_a), step):
        rows = near_a[start : start + step]
        low_a, high_a = a[rows].min(1)[:, None], a[rows].max(1)[:, None]
        i, j = np.nonzero(_overlap(low_a, high_a, low_b, high_b, limit_m))
        if len(i):
            yield rows[i], near_b[j]


def _overlap(
    low_a: Array, high_a: Array, low_b: Array, high_b: Array, limit_m: float
) -> NDArray[np.bool_]:
    apart = (low_a > high_b + limit_m) | (low_b > high_a + limit_m)
    return cast("NDArray[np.bool_]", ~apart.any(-1))


def _distances(a: Array, b: Array) -> Array:
    """Distance of each pair of triangles [m], [n]; if they cross, of their features."""
    n_a, n_b = triangle_normals(a), triangle_normals(b)
    best = np.full(len(a), np.inf)
    for k in range(3):
        for height, inside in (_over_face(a[:, k], b, n_b), _over_face(b[:, k], a, n_a)):
            best = np.where(inside, np.minimum(best, np.abs(height)), best)
    for p, q in EDGE:
        for r, s in EDGE:
            one, other, _ = _between_edges(a[:, p], a[:, q], b[:, r], b[:, s])
            best = np.minimum(best, np.sqrt(((one - other) ** 2).sum(1)))
    return best


def triangle_normals(triangles: Array) -> Array:
    """Unit normals [n, 3]; zero for triangles without area."""
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return np.asarray(across / np.maximum(np.sqrt((across * across).sum(1)), 1e-30)[:, None])


def _over_face(points: Array, triangles: Array, normals: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Signed height of points over the planes of triangles [m], and whether over their inside."""
    height = ((points - triangles[:, 0]) * normals).sum(1)
    inside = (normals != 0.0).any(1)
    for p, q in EDGE:
        side = np.cross(triangles[:, q] - triangles[:, p], points - triangles[:, p])
        inside &= (side * normals).sum(1) >= -1e-12
    return height, inside


def _between_edges(
    p0: Array, p1: Array, q0: Array, q1: Array
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Closest points of segments (Ericson, 5.1.9), and whether both are inside their segments."""
    d1, d2, r = p1 - p0, q1 - q0, p0 - q0
    a, e, f = (d1 * d1).sum(1), (d2 * d2).sum(1), (d2 * r).sum(1)
    b, c = (d1 * d2).sum(1), (d1 * r).sum(1)
    tiny = 1e-30
    area = a * e - b * b
    crossing = area > 1e-9 * a * e
    s = np.where(crossing, np.clip((b * f - c * e) / np.maximum(area, tiny), 0, 1), 0.0)
    t = (b * s + f) / np.maximum(e, tiny)
    clipped = np.clip(t, 0.0, 1.0)
    s = np.where(t == clipped, s, np.clip((b * clipped - c) / np.maximum(a, tiny), 0, 1))
    crossing &= (s > 0) & (s < 1) & (clipped > 0) & (clipped < 1)
    return p0 + s[:, None] * d1, q0 + clipped[:, None] * d2, crossing


def _select(
    points: Array, normals: Array, height: Array, regular: NDArray[np.bool_], tolerance_m: float
) -> tuple[Array, Array, Array]:
    chosen = regular & (np.abs(height) <= tolerance_m)
    return points[chosen], normals[chosen], height[chosen]
