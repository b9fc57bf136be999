"""Nominal positions of a group's objects: in rows, clear of other elements."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import Placement, Scene, SupportSurface
from gen_data.generator.core.se3 import Vec3

LAYERS: dict[Placement, int] = {"drop": 4, "scatter": 1, "grid": 1, "stack": 4}
"""Largest number of objects that start above one another, by placement."""

MARGIN_M = 0.02
"""Gap between objects and other elements on the surface."""

_GAPS_M = (0.24, 0.18, 0.12, 0.08, 0.05, 0.03, 0.015, 0.005)
_STEP_M = 0.02
_TURNS_MAX = 100_000
"""Limit on the steps, rows and layers tried for one object; large surfaces need fewer."""


def find_keep_out_discs(
    scene: Scene, surface: SupportSurface, assets: AssetIndex
) -> tuple[Vec3, ...]:
    """Discs ``(x, y, radius)`` [m], world, around the static bodies on a surface: arms, bins."""
    discs = []
    for body in scene.bodies:
        if body.motion == "dynamic" or body.name == surface.body:
            continue
        low, high = assets.bounds_m(body.asset)
        corners = np.array([[x, y, z] for x in (low[0], high[0])
                            for y in (low[1], high[1]) for z in (low[2], high[2])])  # fmt: skip
        here = (surface.T_world_surface.inverse() @ body.T_world_body).apply(corners * body.scale)
        bottom, top = here.min(axis=0), here.max(axis=0)
        middle, half = 0.5 * (bottom + top), 0.5 * (top - bottom)
        over = np.abs(middle[:2]) <= 0.5 * np.array(surface.size_m) + half[:2]
        if abs(bottom[2]) < MARGIN_M and over.all():
            x, y, _ = surface.T_world_surface.apply(np.array([middle[0], middle[1], 0.0]))
            radius_m = math.hypot(float(half[0]), float(half[1])) + MARGIN_M
            discs.append((round(float(x), 6), round(float(y), 6), round(radius_m, 6)))
    return tuple(discs)


def place_in_rows(
    sizes_m: Sequence[Vec3], surface: SupportSurface, discs: Sequence[Vec3], layers: int
) -> list[Vec3] | None:
    """Place upright boxes in rows on a surface, with the largest gap that fits.

    Args:
        sizes_m: Extents of the boxes.
        surface: Supporting surface.
        discs: Keep-out discs ``(x, y, radius)`` in the surface's frame.
        layers: Largest number of boxes above one another.

    Returns:
        Centre of each box's base in the surface's frame [m]; None if they do not fit.
    """
    for gap_m in _GAPS_M:
        points = _pack_rows(sizes_m, surface, discs, layers, gap_m)
        if points is not None:
            return points
    return None


def _pack_rows(
    sizes_m: Sequence[Vec3],
    surface: SupportSurface,
    discs: Sequence[Vec3],
    layers: int,
    gap_m: float,
) -> list[Vec3] | None:
    """Place boxes row by row from the low corner, then layer by layer."""
    half_x, half_y = (0.5 * size for size in surface.size_m)
    left, front = -half_x + 0.5 * gap_m, -half_y + 0.5 * gap_m
    x, y, z, layer = left, front, 0.0, 1
    row_m = layer_m = 0.0
    points: list[Vec3] = []
    for length_m, width_m, height_m in sizes_m:
        for _ in range(_TURNS_MAX):
            if x + length_m > half_x:
                if x == left:
                    return None
                x, y, row_m = left, y + max(row_m, _STEP_M) + gap_m, 0.0
            elif y + width_m > half_y:
                if y == front or layer == layers:
                    return None
                x, y, z, layer = left, front, z + layer_m + gap_m, layer + 1
                row_m = layer_m = 0.0
            elif z + height_m > surface.clearance_m:
                return None
            elif _touches_disc(discs, x, y, length_m, width_m):
                x += _STEP_M
            else:
                break
        else:
            return None
        points.append((x + 0.5 * length_m, y + 0.5 * width_m, z))
        x += length_m + gap_m
        row_m, layer_m = max(row_m, width_m), max(layer_m, height_m)
    return points


def _touches_disc(
    discs: Sequence[Vec3], x: float, y: float, length_m: float, width_m: float
) -> bool:
    """Whether the rectangle with this low corner touches a disc."""
    for center_x, center_y, radius_m in discs:
        near_x = min(max(center_x, x), x + length_m)
        near_y = min(max(center_y, y), y + width_m)
        if math.hypot(near_x - center_x, near_y - center_y) < radius_m:
            return True
    return False
