"""Convex collision parts: few, small, and hollow where objects must be able to fall in.

Every function returns float64 [n, 3] arrays of hull vertices [m], at most 48 per part.
"""

import math
from collections.abc import Sequence, Set
from itertools import pairwise, product

import numpy as np

from gen_data.content.procedural.patches import Array
from gen_data.core.se3 import Vec3


def box(low: Vec3, high: Vec3) -> Array:
    """The eight corners of an axis-aligned box."""
    return np.array(list(product(*zip(low, high, strict=True))), dtype=np.float64)


def frustum(low: tuple[float, float], high: tuple[float, float], sides: int = 20) -> Array:
    """A slice of a body of revolution between two (radius, z)."""
    return np.concatenate([_ring(radius, z, sides) for radius, z in (low, high)])


def stack(profile: Sequence[tuple[float, float]], sides: int = 20) -> list[Array]:
    """One frustum per segment of a profile of (radius, z), from bottom to top."""
    return [frustum(a, b, sides) for a, b in pairwise(profile)]


def ring(
    low: tuple[float, float, float], high: tuple[float, float, float], count: int
) -> list[Array]:
    """A wall of revolution as ``count`` wedges, between two (inner radius, outer radius, z).

    The inner faces are flat: they lie half outside and half inside the true inner surface.
    """
    factor = 2.0 / (1.0 + math.cos(math.pi / count))
    levels = [(min(inner * factor, outer), outer, z) for inner, outer, z in (low, high)]
    profile = [(radius, z) for *radii, z in levels for radius in radii]
    return wedges(profile, count, {outer for _, outer, _ in levels})


def wedges(
    profile: Sequence[tuple[float, float]], count: int, round_at: Set[float] = frozenset()
) -> list[Array]:
    """A convex cross-section of (radius, z) turned about Z, cut into ``count`` wedges.

    Points whose radius is in ``round_at``, or the largest, have a third vertex between the two
    cuts, which makes the outside rounder.
    """
    half = math.pi / count
    rounded = {max(radius for radius, _ in profile), *round_at}
    made = []
    for i in range(count):
        middle = 2.0 * math.pi * i / count
        points = [
            (radius * math.cos(middle + turn), radius * math.sin(middle + turn), z)
            for radius, z in profile
            for turn in ((-half, 0.0, half) if radius in rounded else (-half, half))
        ]
        made.append(np.array(points))
    return made


def extreme(points: Array, count: int = 48, turn_rad: float = 0.0) -> Array:
    """The points that lie furthest along ``count`` even directions: a small hull of a cloud.

    Directions are Fibonacci's spiral about Z, turned by ``turn_rad``.
    """
    i = np.arange(count) + 0.5
    z = 1.0 - 2.0 * i / count
    turn = math.pi * (3.0 - math.sqrt(5.0)) * i + turn_rad
    radius = np.sqrt(1.0 - z * z)
    directions = zip(radius * np.cos(turn), radius * np.sin(turn), z, strict=True)
    x, y, z = points.reshape(-1, 3).T.astype(np.float64, order="C")
    # In nanometres: the furthest of equal ones is the first, whatever the last bit of a product.
    reaches_nm = (np.rint(1e9 * (x * dx + y * dy + z * dz)) for dx, dy, dz in directions)
    chosen = np.unique([int(np.argmax(reach_nm)) for reach_nm in reaches_nm])
    return np.array(points.reshape(-1, 3)[chosen], dtype=np.float64)


def tube(path: Array, radius: float) -> list[Array]:
    """A box along each segment of a path, shape [n, 3]; the path lies in a plane of constant y.

    The boxes are as thick as the tube: half width ``radius``.
    """
    boxes = []
    for a, b in pairwise(path):
        along = b - a
        length = math.sqrt(float((along * along).sum()))
        across = np.array([-along[2], 0.0, along[0]]) / length * radius
        side = np.array([0.0, radius, 0.0])
        corners = product((a, b), (-1.0, 1.0), (-1.0, 1.0))
        boxes.append(np.array([p + s * across + t * side for p, s, t in corners]))
    return boxes


def _ring(radius: float, z: float, sides: int) -> Array:
    if radius <= 0.0:
        return np.array([[0.0, 0.0, z]])
    turn = 2.0 * math.pi * np.arange(sides) / sides
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), np.full(sides, z)], axis=1)
