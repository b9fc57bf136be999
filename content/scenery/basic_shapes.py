"""Basic shapes of street objects, and their assembly into solids.

Frame of everything here: metres, Z up, front +X, origin on the ground.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural.patches import (
    Array,
    Patch,
    grid_bounds_m,
    join_patches,
    make_solid_in_place,
)
from gen_data.content.procedural.surface_shapes import circle, cone, grid, sweep
from gen_data.core import asset_types, se3

Span = tuple[float, float]
WHOLE: tuple[Span, Span] = ((0.0, 1.0), (0.0, 1.0))


def make_solid(
    patches: Iterable[Patch],
    materials: Sequence[asset_types.Material],
    hulls_m: Iterable[Array],
    keypoints: Sequence[asset_types.Keypoint] = (),
    body: Sequence[Patch] = (),
) -> Solid:
    """A solid that keeps its frame; materials that no triangle uses are left out.

    ``body`` are the patches within ``Solid.body_bounds_m``; without any, the solid states none.
    """
    patch = join_patches(patches)
    used = np.unique(patch.slots)
    numbers = np.zeros(len(materials), dtype=np.int64)
    numbers[used] = np.arange(len(used))
    compact = replace(patch, slots=numbers[patch.slots])
    made = make_solid_in_place((compact,), [materials[k] for k in used], hulls_m)
    bounds_m = grid_bounds_m(body) if body else None
    return replace(made, keypoints=tuple(keypoints), body_bounds_m=bounds_m)


def quad(
    corners_m: Sequence[Sequence[float]], slot: int = 0, uv: tuple[Span, Span] = WHOLE
) -> Patch:
    """Four corners, counter-clockwise from outside, the image's bottom left first."""
    a, b, c, d = (np.array(corner, dtype=np.float64) for corner in corners_m)
    (u0, u1), (v0, v1) = uv
    return grid(np.array([[a, b], [d, c]]), np.array([u0, u1]), np.array([v0, v1]), slot)


def facing_rectangle(x: float, y_m: Span, z_m: Span, slot: int = 0) -> Patch:
    """An upright rectangle that faces +X; y runs to the viewer's right."""
    (y0, y1), (z0, z1) = y_m, z_m
    return quad([(x, y0, z0), (x, y1, z0), (x, y1, z1), (x, y0, z1)], slot)


def post(radius_m: float, z_m: Span, at: se3.Vec3 = (0.0, 0.0, 0.0), sides: int = 10) -> Patch:
    """An upright cylinder."""
    return cone((radius_m, z_m[0]), (radius_m, z_m[1]), sides).moved(*at)


def tube(path: Sequence[se3.Vec3], radius_m: float, sides: int = 8) -> Patch:
    """A round bar along a path."""
    points = np.array(path, dtype=np.float64)
    start = points[1] - points[0]
    # The section's first axis must not lie along the path.
    up = (0.0, 0.0, 1.0) if abs(start[2]) < 0.9 * np.sqrt((start**2).sum()) else (0.0, 1.0, 0.0)
    return sweep(points, circle(radius_m, sides), up=up)
