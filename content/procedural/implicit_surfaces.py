"""Implicit surfaces: smooth unions of round cones, and their meshes.

Distances are negative inside. Round cones: Quilez, "Distance functions", 2008 on; meshes: dual
vertices as in Gibson, "Constrained elastic surface nets", MICCAI 1998.
"""

import numpy as np
from numpy.typing import NDArray

from gen_data.content.procedural.patches import Array, Patch


def capsule_distance(points: Array, a: Array, b: Array, ra: float, rb: float) -> Array:
    """Distance of points, shape [n, 3], to a capsule whose radius goes from ``ra`` to ``rb``."""
    along = b - a
    share = np.clip(((points - a) @ along) / max(float(along @ along), 1e-18), 0.0, 1.0)
    away = points - a - share[:, None] * along
    return np.asarray(np.sqrt((away**2).sum(axis=1)) - (ra + (rb - ra) * share))


def ellipsoid_distance(points: Array, middle: Array, halves: Array) -> Array:
    """About the distance of points, shape [n, 3], to an ellipsoid along the axes."""
    scaled = (points - middle) / halves
    k0 = np.sqrt((scaled**2).sum(axis=1))
    k1 = np.sqrt(((scaled / halves) ** 2).sum(axis=1))
    return np.asarray(k0 * (k0 - 1.0) / np.maximum(k1, 1e-9))


def smooth_union(first: Array, second: Array, reach_m: float) -> Array:
    """The smaller distance, rounded where both are closer than ``reach_m`` (cubic)."""
    blend = np.maximum(reach_m - np.abs(first - second), 0.0) / reach_m
    return np.asarray(np.minimum(first, second) - blend**3 * reach_m / 6.0)


def mesh_level_set(ticks: tuple[Array, Array, Array], distance: Array) -> Patch:
    """The surface where distances change their sign, closed, in slot 0 and without texture.

    Args:
        ticks: Coordinates of the lattice along X, Y and Z [m]; steps may differ.
        distance: At the lattice's points, shape [nx, ny, nz]; positive at its border.
    """
    corner = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=3)
    inside = distance < 0.0
    counts = np.zeros(tuple(n - 1 for n in distance.shape), dtype=np.int64)
    sums = np.zeros((*counts.shape, 3))
    for axis in range(3):
        low, high = _pairs(axis)
        d0, d1 = distance[low], distance[high]
        crossed = inside[low] != inside[high]
        share = np.where(crossed, d0 / np.where(crossed, d0 - d1, 1.0), 0.0)
        place = corner[low] + share[..., None] * (corner[high] - corner[low])
        place = np.where(crossed[..., None], place, 0.0)
        for cells in _neighbours(axis, counts.shape):
            counts += crossed[cells]
            sums += place[cells]
    vertex = sums / np.maximum(counts, 1)[..., None]
    quads = [_quads(vertex, inside, axis) for axis in range(3)]
    corners = np.concatenate(quads)
    return Patch(corners, np.zeros((len(corners), 3, 2)), np.zeros(len(corners), dtype=np.int64))


def _pairs(axis: int) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    """Slices of both ends of all edges along an axis."""
    low = [slice(None)] * 3
    high = [slice(None)] * 3
    low[axis], high[axis] = slice(None, -1), slice(1, None)
    return tuple(low), tuple(high)


def _neighbours(axis: int, cells: tuple[int, ...]) -> list[tuple[slice, ...]]:
    """Slices of edges along an axis: for each cell, the four of its twelve edges."""
    others = [k for k in range(3) if k != axis]
    made = []
    for i in (0, 1):
        for j in (0, 1):
            part = [slice(None)] * 3
            part[others[0]] = slice(i, i + cells[others[0]])
            part[others[1]] = slice(j, j + cells[others[1]])
            made.append(tuple(part))
    return made


def _quads(vertex: Array, inside: NDArray[np.bool_], axis: int) -> Array:
    """Two triangles around every edge along an axis that is crossed, shape [n, 3, 3]."""
    low, high = _pairs(axis)
    leaves = inside[low] & ~inside[high]
    enters = ~inside[low] & inside[high]
    j, k = (axis + 1) % 3, (axis + 2) % 3
    made = []
    for mask, turn in ((leaves, 1), (enters, -1)):
        at = np.argwhere(mask)
        step_j, step_k = np.eye(3, dtype=np.int64)[[j, k]]
        ring = [at - step_j - step_k, at - step_k, at, at - step_j][::turn]
        a, b, c, d = (vertex[tuple(cell.T)] for cell in ring)
        # The shorter diagonal keeps thin parts round.
        first = (((a - c) ** 2).sum(axis=1) <= ((b - d) ** 2).sum(axis=1))[:, None, None]
        one = np.where(first, np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
        two = np.where(first, np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1))
        made += [one, two]
    return np.concatenate(made)
