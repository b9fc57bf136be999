"""Geometry on the ground as triangles in the world: carriageways, lanes, footprints."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache

import numpy as np

from gen_data.generator.core.interfaces import AssetLibrary
from gen_data.generator.core.lane_geometry import border_line
from gen_data.generator.core.scene import Body, Lane, Scene
from gen_data.generator.core.se3 import Array

CARRIAGEWAY = frozenset({"asphalt", "marking"})
"""Roles of materials of drivable surfaces."""
LOW_M = 2.0
"""Geometry higher than this above the ground, as crowns of trees, does not occupy it."""
DIRECTIONS = 48
"""Directions that sample the outline of a footprint."""
NOTHING: Array = np.zeros((0, 3, 3))


def carriageways(scene: Scene, assets: AssetLibrary) -> Array:
    """Triangles [n, 3, 3] of all drivable surfaces."""
    parts = [
        carriageway(body, assets)
        for body in scene.bodies
        if body.instance_id == 0 and body.motion == "static"
    ]
    return np.concatenate([NOTHING, *parts])


@lru_cache(maxsize=32)
def carriageway(body: Body, assets: AssetLibrary) -> Array:
    """Upward triangles [n, 3, 3] of a body's carriageway; [0, 3, 3] for most bodies."""
    materials = body.materials or assets.materials(body.asset)
    slots = [k for k, material in enumerate(materials) if material.role in CARRIAGEWAY]
    if not slots:
        return NOTHING
    mesh = assets.mesh(body.asset)
    faces = mesh.faces[np.isin(mesh.face_slots, slots)]
    vertices = body.T_world_body.apply(mesh.vertices_m.astype(np.float64) * body.scale)
    triangles: Array = vertices[faces]
    u, v = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    up = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] > 0.0
    return triangles[up]


def strips(lanes: Iterable[Lane]) -> Array:
    """Triangles [n, 3, 3] of the areas of lanes."""
    parts = []
    for lane in lanes:
        left, right = (np.asarray(border_line(lane, side)) for side in ("left", "right"))
        parts.append(ribbon(left, right))
    return np.concatenate([NOTHING, *parts])


def ribbon(left: Array, right: Array) -> Array:
    """Triangles [2 (n - 1), 3, 3] between two lines of n points."""
    one = np.stack([left[:-1], right[:-1], right[1:]], axis=1)
    other = np.stack([left[:-1], right[1:], left[1:]], axis=1)
    return np.concatenate([one, other])


def footprints(bodies: Iterable[Body], assets: AssetLibrary) -> Array:
    """Triangles [n, 3, 3] of the ground occupied by bodies: convex outlines of their lowest 2 m."""
    parts = []
    for body in bodies:
        outline = body.T_world_body.apply(low_outline(body.asset, body.scale, assets))
        if len(outline) >= 3:
            first = np.broadcast_to(outline[0], outline[2:].shape)
            parts.append(np.stack([first, outline[1:-1], outline[2:]], axis=1))
    return np.concatenate([NOTHING, *parts])


@lru_cache(maxsize=4096)
def low_outline(asset: str, scale: float, assets: AssetLibrary) -> Array:
    """The convex outline [n, 3], counter-clockwise, of the lowest 2 m of an asset, at its foot."""
    vertices = assets.mesh(asset).vertices_m.astype(np.float64) * scale
    foot_m = vertices[:, 2].min()
    low = vertices[vertices[:, 2] < foot_m + LOW_M]
    angles = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    towards = np.stack([np.cos(angles), np.sin(angles)])
    # einsum keeps one order of summation, on which ties between vertices depend.
    along = np.einsum("ij,jk->ik", low[:, :2], towards, optimize=False)
    corners = along.argmax(axis=0)
    outline = low[corners[np.diff(corners, append=corners[0] - 1) != 0]]
    return np.column_stack([outline[:, :2], np.full(len(outline), foot_m)])
