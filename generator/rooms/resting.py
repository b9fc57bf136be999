"""Poses in which objects rest on a level surface, by their convex hulls.

A rigid body rests on a facet of its convex hull if its centre of mass is above that facet (Goldberg
et al., "Part pose statistics", IEEE Transactions on Robotics and Automation 15, 1999). That is so
if a line from the centre along the facet's normal leaves the hull through that facet.
"""

import math

import numpy as np

from gen_data.core.se3 import Array, Quaternion

STEEPEST = math.cos(math.radians(50.0))
"""Facets that are turned further from below than this are another way to lie, not this one."""
UPRIGHT: Quaternion = (1.0, 0.0, 0.0, 0.0)


def turn_to_rest(points_m: Array) -> Quaternion | None:
    """A small turn (w, x, y, z) after which a body of even density rests; None if there is none.

    Of the facets within ``STEEPEST`` of below, the one that has the centre of mass lowest: round
    objects roll on from all others.

    Args:
        points_m: Points [n, 3] whose convex hull is the body's.
    """
    from scipy.spatial import ConvexHull

    hull = ConvexHull(points_m)
    normals, offsets = hull.equations[:, :3], hull.equations[:, 3]
    distances = -((normals * center_of_mass(points_m[hull.simplices])).sum(axis=1) + offsets)
    lower = np.flatnonzero(normals[:, 2] < -STEEPEST)
    cosines = np.einsum("ik,jk->ij", normals[lower], normals)
    with np.errstate(divide="ignore", invalid="ignore"):
        ways_m = np.where(cosines > 1e-9, distances / cosines, np.inf)
    resting = lower[ways_m.min(axis=1) >= distances[lower] - 1e-9]
    if not len(resting):
        return None
    x, y, z = normals[resting[np.argmin(distances[resting])]].tolist()
    # The turn from the normal to straight down, about their common perpendicular.
    w = math.sqrt(0.5 * (1.0 - z))
    return (round(w, 9), round(-0.5 * y / w, 9), round(0.5 * x / w, 9), 0.0)


def center_of_mass(triangles_m: Array) -> Array:
    """Centre of the volume of a convex body, [3], from its surface [n, 3, 3] in any orientation."""
    inside = triangles_m.reshape(-1, 3).mean(axis=0)
    a, b, c = np.moveaxis(triangles_m - inside, 1, 0)
    volumes = np.abs((a * np.cross(b, c)).sum(axis=1))
    center: Array = inside + (volumes[:, None] * (a + b + c)).sum(axis=0) / (4.0 * volumes.sum())
    return center
