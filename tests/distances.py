"""Exact distances from points to triangles, by trimesh's formula (Ericson 2004, 5.1.5)."""

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

Array = NDArray[np.float64]
CHUNK = 2_000_000
"""Pairs of points and triangles that are looked at together."""


def distances_m(points_m: Array, triangles_m: Array) -> Array:
    """From each point [n, 3] to the nearest of the triangles [m, 3, 3], [n]."""
    # In large units: trimesh takes products of four lengths below 1e-14 for zero.
    unit_m = np.ptp(triangles_m.reshape(-1, 3), axis=0).max() / 100.0
    points, triangles = points_m / unit_m, triangles_m / unit_m
    centres = triangles.mean(axis=1)
    radii = np.linalg.norm(triangles - centres[:, None], axis=2).max(axis=1)
    step = max(1, CHUNK // len(centres))
    parts = [
        _nearest(points[first : first + step], triangles, centres, radii)
        for first in range(0, len(points), step)
    ]
    return np.concatenate(parts) * unit_m


def _nearest(points: Array, triangles: Array, centres: Array, radii: Array) -> Array:
    """Only triangles whose sphere comes nearer than some triangle's centre can be the nearest."""
    to_centres = cdist(points, centres)
    near = to_centres - radii <= to_centres.min(axis=1, keepdims=True)
    point, triangle = np.nonzero(near)
    at = trimesh.triangles.closest_point(triangles[triangle], points[point])
    found = np.linalg.norm(at - points[point], axis=1)
    return np.minimum.reduceat(found, np.flatnonzero(np.diff(point, prepend=-1)))
