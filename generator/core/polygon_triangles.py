"""Triangles of polygons that files list by their corners: fans where convex, else ears."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gen_data.core.se3 import Array

Int64 = NDArray[np.int64]
_FOLDED = -1e-9
"""Share of a polygon's area: a triangle of its fan that is turned by more lies outside of it."""
_SAME_AREA = 1e-6
_AT_ONCE = 100_000
"""Polygons whose triangles are held at a time."""


def split_polygons(sizes: Int64, points: Array, corners: Int64) -> tuple[Int64, Int64]:
    """Triangulate polygons.

    Polygons whose fan from the first corner leaves them are cut into ears (mapbox's earcut), where
    these cover them; a polygon that crosses itself keeps its fan.

    Args:
        sizes: Number of corners of each polygon.
        points: Points, [n, 3].
        corners: Points of the corners of all polygons, one after another.

    Returns:
        Numbers of corners [m, 3], and the polygon of each triangle, [m].
    """
    fans, polygon = _fans(sizes), np.repeat(np.arange(len(sizes)), np.maximum(sizes - 2, 0))
    starts = np.cumsum(sizes) - sizes
    rows = np.cumsum(np.maximum(sizes - 2, 0)) - np.maximum(sizes - 2, 0)
    parts, owners = [], []
    for numbers, normals in _concave(sizes, starts, points, corners):
        four = sizes[numbers] == 4
        quads, other = _other_diagonals(starts[numbers[four]], normals[four], points, corners)
        place = rows[numbers[four][quads]]
        fans[place], fans[place + 1] = other[:, 0], other[:, 1]
        for k, normal in zip(numbers[~four].tolist(), normals[~four], strict=True):
            ears = _ears(points[corners[starts[k] : starts[k] + sizes[k]]], normal)
            if ears is not None:
                parts.append(ears + starts[k])
                owners.append(np.full(len(ears), k))
    if not parts:
        return fans, polygon
    kept = ~np.isin(polygon, [owner[0] for owner in owners])
    triangles = np.concatenate([fans[kept], *parts])
    polygons = np.concatenate([polygon[kept], *owners])
    order = np.argsort(polygons, kind="stable")
    return triangles[order], polygons[order]


def _concave(
    sizes: Int64, starts: Int64, points: Array, corners: Int64
) -> Iterator[tuple[Int64, Array]]:
    """Yield numbers of polygons whose fans leave them, and normals of twice their areas [k, 3]."""
    many = np.flatnonzero(sizes > 3)
    if not len(many) or not np.isfinite(points).all():
        return
    for first in range(0, len(many), _AT_ONCE):
        chosen = many[first : first + _AT_ONCE]
        own = sizes[chosen]
        shift = np.repeat(starts[chosen] - (np.cumsum(own) - own), own)
        numbers = corners[shift + np.arange(len(shift))]
        crosses = _crosses(points[numbers], _fans(own))
        owner = np.repeat(np.arange(len(own)), own - 2)
        # Summed up, twice the area of a polygon, whatever its shape.
        whole = np.stack(
            [np.bincount(owner, weights=crosses[:, k], minlength=len(own)) for k in range(3)], 1
        )
        lengths = (whole * whole).sum(axis=1)
        turned = (crosses * whole[owner]).sum(axis=1) < _FOLDED * lengths[owner]
        found = np.unique(owner[turned])
        yield chosen[found], whole[found]


def _other_diagonals(
    starts: Int64, normals: Array, points: Array, corners: Int64
) -> tuple[NDArray[np.bool_], Int64]:
    """Which quadrilaterals their other diagonal divides inside of them, and those triangles."""
    halves = starts[:, None, None] + np.array([[1, 2, 3], [1, 3, 0]])
    crosses = _crosses(points, corners[halves.reshape(-1, 3)]).reshape(-1, 2, 3)
    inside = ((crosses * normals[:, None]).sum(axis=2) > 0.0).all(axis=1)
    return inside, halves[inside]


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
