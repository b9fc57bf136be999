"""Surfaces that bodies are to rest on, and invisible guard walls around them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gen_data.generator.core.asset_types import ConvexParts
from gen_data.generator.core.scene import Body, Scene, SupportSurface
from gen_data.generator.core.se3 import SE3, Array
from gen_data.generator.physics.collision_shapes import CollisionShape, collision_shape

_SINK_M = 0.02
"""Tolerance of a body's bottom below its surface: more than any contact error."""
_WALL_THICKNESS_M = 1.0
_WALL_BELOW_M = 0.5
_WALL_ABOVE_M = 5.0


def candidate_surfaces(scene: Scene, body: Body) -> tuple[SupportSurface, ...]:
    """Surfaces that a body may rest on: those of its group, or all if it has none."""
    for group in scene.groups:
        if group.name == body.group:
            return tuple(s for s in scene.surfaces if s.name in group.surfaces)
    return scene.surfaces


def home_surface(
    surfaces: Iterable[SupportSurface], low_m: Array, high_m: Array
) -> SupportSurface | None:
    """The nearest surface below a body with these bounds; None if there is none."""
    below = [s for s in surfaces if _holds(s, low_m, high_m, slack_m=0.0)]
    return max(below, key=lambda s: s.T_world_surface.translation_m[2], default=None)


def is_supported(surfaces: Iterable[SupportSurface], low_m: Array, high_m: Array) -> bool:
    """Whether a body with these bounds is above a surface extended by the body's size."""
    size_m = float((high_m - low_m).max())
    return any(_holds(s, low_m, high_m, slack_m=size_m) for s in surfaces)


def is_within(surfaces: Iterable[SupportSurface], low_m: Array, high_m: Array) -> bool:
    """Whether the whole footprint of a body with these bounds is above one surface."""
    corners = [
        np.array([x, y, low_m[2]]) for x in (low_m[0], high_m[0]) for y in (low_m[1], high_m[1])
    ]
    return any(all(_holds(s, at, at, slack_m=0.0) for at in corners) for s in surfaces)


def guard_walls(surface: SupportSurface) -> list[tuple[CollisionShape, SE3]]:
    """Shapes and poses of four walls around an open surface; [] for a walled one."""
    if surface.walled:
        return []
    half_x, half_y = (0.5 * size for size in surface.size_m)
    thick = _WALL_THICKNESS_M
    along_x = _box(half_x + thick, 0.5 * thick)
    along_y = _box(0.5 * thick, half_y + thick)
    sides = [
        (along_x, 0.0, half_y + 0.5 * thick),
        (along_x, 0.0, -half_y - 0.5 * thick),
        (along_y, half_x + 0.5 * thick, 0.0),
        (along_y, -half_x - 0.5 * thick, 0.0),
    ]
    return [(shape, surface.T_world_surface @ SE3((x, y, 0.0))) for shape, x, y in sides]


def _box(half_x: float, half_y: float) -> CollisionShape:
    corners = [
        (x, y, z)
        for x in (-half_x, half_x)
        for y in (-half_y, half_y)
        for z in (-_WALL_BELOW_M, _WALL_ABOVE_M)
    ]
    return collision_shape(ConvexParts((np.array(corners),)))


def _holds(surface: SupportSurface, low_m: Array, high_m: Array, slack_m: float) -> bool:
    """Whether the centre of bounds is within the rectangle and their bottom not below it."""
    center = 0.5 * (low_m + high_m)
    x, y, _ = surface.T_world_surface.inverse().apply(center)
    height = float(low_m[2]) - surface.T_world_surface.translation_m[2]
    return (
        abs(float(x)) <= 0.5 * surface.size_m[0] + slack_m
        and abs(float(y)) <= 0.5 * surface.size_m[1] + slack_m
        and height >= -_SINK_M
    )
