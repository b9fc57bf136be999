"""Template meshes that are cut along level lines and thinned out, with all their data.

A mesh here is rows of values, one per vertex, whose first three are the position: shapes and
weights are cut along with it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gen_data.generator.assets.people.body import Array, Indices

Level = Callable[[Array], Array]
"""Positions [n, 3] -> signed distance from a cut [n], positive on the side that gets the zone."""

_SNAP_M = 0.0007
"""Vertices nearer to a cut than this count as lying on it: no slivers."""
_CALM = 3.0
"""How boldly edges are collapsed, from 1 to 10: slower and smoother than the library's 7."""


@dataclass(frozen=True, eq=False, slots=True)
class MeshRows:
    """A mesh in zones.

    Attributes:
        values: float64 [n, k]; columns 0 to 2 are the position [m].
        faces: int64 [m, 3].
        zones: Zone of each face, str [m]; faces of zone "" are dropped.
    """

    values: Array
    faces: Indices
    zones: np.ndarray[tuple[int], np.dtype[np.str_]]


def make_rows(values: Array, faces: Indices, zone: str) -> MeshRows:
    """A mesh in one zone."""
    return MeshRows(values, faces, np.full(len(faces), zone, dtype="U16"))


def grid_faces(rows: int, columns: int) -> Indices:
    """Triangles of a grid of points, row by row; outside is where columns run to the right."""
    i = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (part.ravel() for part in (i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]))
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def split_region(rows: MeshRows, zone: str, into: str, level: Level) -> MeshRows:
    """Split a zone along a level line; its positive side becomes the zone ``into``."""
    heights = level(rows.values[:, :3])
    heights = np.where(np.abs(heights) < _SNAP_M, 0.0, heights)
    corners = heights[rows.faces]
    mine = rows.zones == zone
    crossed = mine & (corners.min(axis=1) < 0.0) & (corners.max(axis=1) > 0.0)
    zones = rows.zones.copy()
    zones[mine & ~crossed & (corners.sum(axis=1) > 0.0)] = into
    values, made, made_zones = _split(rows.values, rows.faces[crossed], heights, (into, zone))
    return MeshRows(
        values,
        np.concatenate([rows.faces[~crossed], made]),
        np.concatenate([zones[~crossed], made_zones]),
    )


def simplify_region(rows: MeshRows, zone: str, max_faces: int) -> MeshRows:
    """The same mesh with about ``max_faces`` triangles in a zone; its border stays as it is.

    Vertices that remain keep their place, so that every shape and weight still belongs to them.
    """
    import fast_simplification

    mine = rows.zones == zone
    used, local = np.unique(rows.faces[mine], return_inverse=True)
    positions = rows.values[used, :3]
    points, faces = fast_simplification.simplify(
        positions,
        local.reshape(-1, 3).astype(np.int32),
        target_count=max_faces,
        agg=_CALM,
        preserve_border=True,
    )
    squared = ((points[:, None].astype(np.float64) - positions[None]) ** 2).sum(axis=2)
    collapsed = used[np.argmin(squared, axis=1)][faces]
    a, b, c = collapsed.T
    collapsed = collapsed[(a != b) & (b != c) & (a != c)]
    return MeshRows(
        rows.values,
        np.concatenate([rows.faces[~mine], collapsed]),
        np.concatenate([rows.zones[~mine], np.full(len(collapsed), zone, dtype="U16")]),
    )


def _split(
    values: Array, faces: Indices, heights: Array, names: tuple[str, str]
) -> tuple[Array, Indices, np.ndarray[tuple[int], np.dtype[np.str_]]]:
    """Triangles that a level line crosses, cut along it; and the vertices with those it adds."""
    added: list[Array] = []
    numbers: dict[tuple[int, int], int] = {}

    def between(a: int, b: int) -> int:
        a, b = min(a, b), max(a, b)
        if (a, b) not in numbers:
            numbers[a, b] = len(values) + len(added)
            t = heights[a] / (heights[a] - heights[b])
            added.append((1.0 - t) * values[a] + t * values[b])
        return numbers[a, b]

    made: list[tuple[int, int, int]] = []
    zones: list[str] = []
    for triangle in faces.tolist():
        for name, sign in zip(names, (1.0, -1.0), strict=True):
            outline: list[int] = []
            for a, b in zip(triangle, triangle[1:] + triangle[:1], strict=True):
                if sign * heights[a] >= 0.0:
                    outline.append(a)
                if heights[a] * heights[b] < 0.0:
                    outline.append(between(a, b))
            for i in range(1, len(outline) - 1):
                made.append((outline[0], outline[i], outline[i + 1]))
                zones.append(name)
    if not made:
        return values, np.zeros((0, 3), np.int64), np.zeros(0, "U16")
    return (
        np.concatenate([values, np.array(added)]) if added else values,
        np.array(made),
        np.array(zones, dtype="U16"),
    )
