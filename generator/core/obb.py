"""Oriented boxes: whether two of them overlap, on the ground and in space.

Convex bodies are disjoint if and only if some axis separates them: their projections onto it are
disjoint. For boxes it is enough to try the normals of their faces and, in space, the nine
directions across an edge of each (Gottschalk, Lin and Manocha, "OBBTree", SIGGRAPH 1996).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.se3 import SE3, Array, Vec3

_SLACK_M = 1e-12


def rectangles_overlap(a: Array, half_a_m: Array, b: Array, half_b_m: Array) -> NDArray[np.bool_]:
    """Whether rectangles have inner points in common, pair by pair.

    Args:
        a: Centre [m] and direction of the first half extent: x, y, cosine, sine; shape [..., 4].
        half_a_m: Half extents, shape [..., 2].
        b: The other rectangles, as ``a``.
        half_b_m: As ``half_a_m``.

    Returns:
        Shape [...], after broadcasting.
    """
    dx, dy = b[..., 0] - a[..., 0], b[..., 1] - a[..., 1]
    cos_a, sin_a, cos_b, sin_b = a[..., 2], a[..., 3], b[..., 2], b[..., 3]
    ax, ay, bx, by = half_a_m[..., 0], half_a_m[..., 1], half_b_m[..., 0], half_b_m[..., 1]
    # Of the angle between both: how much of one's extents counts along the other's axes.
    c = np.abs(cos_a * cos_b + sin_a * sin_b)
    s = np.abs(cos_a * sin_b - sin_a * cos_b)
    overlap: NDArray[np.bool_] = (
        (np.abs(dx * cos_a + dy * sin_a) < ax + bx * c + by * s)
        & (np.abs(dy * cos_a - dx * sin_a) < ay + bx * s + by * c)
        & (np.abs(dx * cos_b + dy * sin_b) < bx + ax * c + ay * s)
        & (np.abs(dy * cos_b - dx * sin_b) < by + ax * s + ay * c)
    )
    return overlap


def boxes_touch(T_world_a: SE3, half_a_m: Vec3, T_world_b: SE3, half_b_m: Vec3) -> bool:
    """Whether two boxes, given by their centres and half extents, have a point in common."""
    between = np.asarray(T_world_b.translation_m) - np.asarray(T_world_a.translation_m)
    half_a, half_b = np.array(half_a_m), np.array(half_b_m)
    reach_m = float(np.sqrt(np.sum(half_a * half_a))) + float(np.sqrt(np.sum(half_b * half_b)))
    if float(between @ between) > reach_m * reach_m:
        return False
    edges_a, edges_b = T_world_a.rotation().T, T_world_b.rotation().T
    across = np.cross(edges_a[:, None], edges_b[None]).reshape(9, 3)
    axes = np.concatenate([edges_a, edges_b, across])
    span_m = np.abs(axes @ edges_a.T) @ half_a + np.abs(axes @ edges_b.T) @ half_b
    # Parallel edges give an axis of length 0, along which nothing may count as separated.
    return bool(np.all(np.abs(axes @ between) <= span_m + _SLACK_M))
