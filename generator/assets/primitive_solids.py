"""The solids that URDF can spell: boxes, cylinders and spheres, around the origin, Z their axis."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from gen_data.generator.assets.triangle_soup import Float64

SEGMENTS = 32
_BOX_QUADS = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))


def box(size_m: tuple[float, float, float]) -> Float64:
    """Triangles [12, 3, 3] of a box."""
    x, y, z = (0.5 * side for side in size_m)
    corners = np.array([(i * x, j * y, k * z) for k in (-1, 1) for j in (-1, 1) for i in (-1, 1)])
    return np.array([[corners[i] for i in t] for q in _BOX_QUADS for t in (q[:3], (q[0], *q[2:]))])


def cylinder(radius_m: float, length_m: float) -> Float64:
    """Triangles [4 * SEGMENTS, 3, 3] of a cylinder."""
    return _revolved([(0.0, -0.5 * length_m), (radius_m, -0.5 * length_m),
                      (radius_m, 0.5 * length_m), (0.0, 0.5 * length_m)])  # fmt: skip


def sphere(radius_m: float) -> Float64:
    """Triangles [m, 3, 3] of a sphere."""
    steps = SEGMENTS // 2
    angles = [math.pi * (k / steps - 0.5) for k in range(steps + 1)]
    return _revolved([(radius_m * math.cos(a), radius_m * math.sin(a)) for a in angles])


def _revolved(profile: list[tuple[float, float]]) -> Float64:
    """Triangles of a profile (radius, height), bottom to top, turned about Z."""
    triangles: list[tuple[tuple[float, float, float], ...]] = []
    turns = [2.0 * math.pi * k / SEGMENTS for k in range(SEGMENTS)]
    ring = [(math.cos(a), math.sin(a)) for a in turns]
    for (r0, z0), (r1, z1) in pairwise(profile):
        for (cx, cy), (nx, ny) in zip(ring, [*ring[1:], ring[0]], strict=True):
            a, b = (r0 * cx, r0 * cy, z0), (r0 * nx, r0 * ny, z0)
            c, d = (r1 * nx, r1 * ny, z1), (r1 * cx, r1 * cy, z1)
            triangles += [(a, b, c), (a, c, d)]
    return np.array(triangles, dtype=np.float64)
