"""What things are meant to rest on, and the invisible walls that keep them there meanwhile."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from generator.core.geometry import ConvexParts
from generator.core.scene import Body, Scene, Surface
from generator.core.se3 import SE3, Array
from generator.physics.shapes import CollisionShape, collision_shape

_SINK_M = 0.02
"""How far below a surface a body on it may reach: more than any contact error."""
_WALL_THICKNESS_M = 1.0
_WALL_BELOW_M = 0.5
_WALL_ABOVE_M = 5.0


def surfaces_of(scene: Scene, body: Body) -> tuple[Surface, ...]:
    """Surfaces that a body may end on: its group's, or all where it has no group."""
    for group in scene.groups:
        if group.name == body.group:
            return tuple(s for s in scene.surfaces if s.name in group.surfaces)
    return scene.surfaces


def home_surface(surfaces: Iterable[Surface], low_m: Array, high_m: Array) -> Surface | None:
    """The surface that a body with these bounds will land on: the nearest one below it."""
    below = [s for s in surfaces if _holds(s, low_m, high_m, slack_m=0.0)]
    return max(below, key=lambda s: s.T_world_surface.translation_m[2], default=None)


def is_supported(surfaces: Iterable[Surface], low_m: Array, high_m: Array) -> bool:
    """Whether a body with these bounds lies over one of the surfaces, give or take its own size."""
    size_m = float((high_m - low_m).max())
    return any(_holds(s, low_m, high_m, slack_m=size_m) for s in surfaces)


def is_within(surfaces: Iterable[Surface], low_m: Array, high_m: Array) -> bool:
    """Whether a body with these bounds lies over one of the surfaces with all of its footprint."""
    corners = [(x, y) for x in (low_m[0], high_m[0]) for y in (low_m[1], high_m[1])]
    bottom = float(low_m[2])
    return any(
        all(
            _holds(s, np.array([x, y, bottom]), np.array([x, y, bottom]), slack_m=0.0)
            for x, y in corners
        )
        for s in surfaces
    )


def guard_walls(surface: Surface) -> list[tuple[CollisionShape, SE3]]:
    """Four walls around an open surface; none around a walled one."""
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


def _holds(surface: Surface, low_m: Array, high_m: Array, slack_m: float) -> bool:
    """Whether the bounds' centre is over the rectangle and their bottom not below it."""
    center = 0.5 * (low_m + high_m)
    x, y, _ = surface.T_world_surface.inverse().apply(center)
    height = float(low_m[2]) - surface.T_world_surface.translation_m[2]
    return (
        abs(float(x)) <= 0.5 * surface.size_m[0] + slack_m
        and abs(float(y)) <= 0.5 * surface.size_m[1] + slack_m
        and height >= -_SINK_M
    )
