"""Triangles of polygons that files list by their corners: fans where convex, else ears."""

import numpy as np
from numpy.typing import NDArray

from gen_data.core.se3 import Array

Int64 = NDArray[np.int64]
_FOLDED = -1e-9
"""Share of a polygon's area: a triangle of its fan that is turned by more lies outside of it."""
_SAME_AREA = 1e-6


def split_polygons(sizes: Int64, points: Array) -> tuple[Int64, Int64]:
    """Triangulate polygons.

    Polygons whose fan from the first corner leaves them are cut into ears (mapbox's earcut), where
    these cover them; a polygon that crosses itself keeps its fan.

    Args:
        sizes: Number of corners of each polygon.
        points: Corners of all polygons one after another, [n, 3].

    Returns:
        Numbers of corners [m, 3], and the polygon of each triangle, [m].
    """
    fans, polygon = _fans(sizes), np.repeat(np.arange(len(sizes)), np.maximum(sizes - 2, 0))
    if not (sizes > 3).any() or not np.isfinite(points).all():
        return fans, polygon
    # Twice the area of each triangle and, summed up, of its polygon, whatever its shape.
    crosses = _crosses(points, fans)
    whole = np.stack(
        [np.bincount(polygon, weights=crosses[:, k], minlength=len(sizes)) for k in range(3)], 1
    )
    lengths = (whole * whole).sum(axis=1)
    turned = (crosses * whole[polygon]).sum(axis=1) < _FOLDED * lengths[polygon]
    concave = np.unique(polygon[turned])
    starts = np.cumsum(sizes) - sizes
    parts, owners, replaced = [], [], []
    for k in concave.tolist():
        ears = _ears(points[starts[k] : starts[k] + sizes[k]], whole[k])
        if ears is not None:
            parts.append(ears + starts[k])
            owners.append(np.full(len(ears), k))
            replaced.append(k)
    if not parts:
        return fans, polygon
    kept = ~np.isin(polygon, replaced)
    triangles = np.concatenate([fans[kept], *parts])
    polygons = np.concatenate([polygon[kept], *owners])
    order = np.argsort(polygons, kind="stable")
    return triangles[order], polygons[order]


def _fans(sizes: Int64) -> Int64:
    starts = np.cumsum(sizes) - sizes
    counts = np.maximum(sizes - 2, 0)
    first = np.repeat(starts, counts)
    step = np.arange(int(counts.sum())) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.stack([first, first + step + 1, first + step + 2], axis=1)


def _crosses(points: Array, triangles: Int64) -> Array:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def _ears(corners: Array, normal: Array) -> Int64 | None:
    """Triangles of one polygon [n, 3] around twice its area; None if they do not cover it."""
    import mapbox_earcut

    axis = int(np.abs(normal).argmax())
    flat = np.ascontiguousarray(corners[:, [(axis + 1) % 3, (axis + 2) % 3]])
    found = mapbox_earcut.triangulate_float64(flat, np.array([len(flat)], np.uint32))
    ears = np.asarray(found, np.int64).reshape(-1, 3)
    crosses = _crosses(corners, ears)
    backwards = crosses @ normal < 0.0
    ears[backwards] = ears[backwards][:, ::-1]
    area = float(np.abs(crosses @ normal).sum())
    length = float(normal @ normal)
    return ears if abs(area - length) <= _SAME_AREA * length else None
