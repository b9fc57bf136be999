"""Triangles of the primitive shapes of UsdGeom: cubes, spheres, cylinders, cones, capsules, planes.

Their surfaces are as the schemas define them; round ones have ``SEGMENTS`` sides.
"""

import math
from itertools import pairwise
from typing import Any

import numpy as np

from gen_data.core import errors, se3

KINDS = ("Cube", "Sphere", "Cylinder", "Cone", "Capsule", "Plane")
SEGMENTS = 32
_QUADS = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))


def primitive_corners(prim: Any, place: str) -> se3.Array:
    """Triangles [m, 3, 3] of a primitive, in its own frame and unit.

    Raises:
        AssetError: if one of its lengths is not positive.
    """
    kind = str(prim.GetTypeName())

    def length(name: str) -> float:
        value = float(prim.GetAttribute(name).Get())
        if not 0.0 < value < math.inf:
            raise errors.AssetError(f"{place}: {prim.GetPath()}: {name} is {value:g}; correct it")
        return value

    if kind == "Cube":
        corners = _box(length("size"))
    elif kind == "Plane":
        corners = _plane(length("width"), length("length"))
    elif kind == "Sphere":
        corners = _revolve(_arc(length("radius"), 0.0, -90.0, 90.0))
    elif kind == "Capsule":
        radius, half = length("radius"), 0.5 * length("height")
        corners = _revolve([*_arc(radius, -half, -90.0, 0.0), *_arc(radius, half, 0.0, 90.0)])
    else:
        radius, half = length("radius"), 0.5 * length("height")
        top = radius if kind == "Cylinder" else 0.0
        corners = _revolve([(0.0, -half), (radius, -half), (top, half), (0.0, half)])
    axis = prim.GetAttribute("axis").Get() if kind not in ("Cube", "Sphere") else "Z"
    # Cyclic: shapes keep their winding.
    return np.asarray(np.roll(corners, {"Z": 0, "X": 1, "Y": 2}[str(axis)], axis=2))


def _box(size: float) -> se3.Array:
    half = 0.5 * size
    points = np.array([(i * half, j * half, k * half)
                       for k in (-1, 1) for j in (-1, 1) for i in (-1, 1)])  # fmt: skip
    triangles = np.array([t for q in _QUADS for t in (q[:3], (q[0], *q[2:]))])
    return np.asarray(points[triangles], np.float64)


def _plane(width: float, length: float) -> se3.Array:
    x, y = 0.5 * width, 0.5 * length
    a, b, c, d = (-x, -y, 0.0), (x, -y, 0.0), (x, y, 0.0), (-x, y, 0.0)
    return np.array([(a, b, c), (a, c, d)])


def _arc(
    radius: float, height: float, low_deg: float, high_deg: float
) -> list[tuple[float, float]]:
    """(radius, height) along a circle, by elevation."""
    steps = round(SEGMENTS * (high_deg - low_deg) / 360.0)
    turns = [math.radians(low_deg + (high_deg - low_deg) * k / steps) for k in range(steps + 1)]
    return [(radius * max(math.cos(t), 0.0), height + radius * math.sin(t)) for t in turns]


def _revolve(profile: list[tuple[float, float]]) -> se3.Array:
    """Triangles of a profile (radius, height), bottom to top, revolved about Z."""
    turns = [2.0 * math.pi * k / SEGMENTS for k in range(SEGMENTS + 1)]
    ring = [(math.cos(t), math.sin(t)) for t in turns[:-1]]
    found: list[tuple[tuple[float, float, float], ...]] = []
    for (r0, z0), (r1, z1) in pairwise(profile):
        for (cx, cy), (nx, ny) in zip(ring, [*ring[1:], ring[0]], strict=True):
            a, b = (r0 * cx, r0 * cy, z0), (r0 * nx, r0 * ny, z0)
            c, d = (r1 * nx, r1 * ny, z1), (r1 * cx, r1 * cy, z1)
            found += [(a, b, c)] if r0 > 0.0 else []
            found += [(a, c, d)] if r1 > 0.0 else []
    return np.array(found)
