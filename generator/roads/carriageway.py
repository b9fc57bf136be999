"""Drivable surfaces of streets and the paint on them, as triangles in the world."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gen_data.core.interfaces import AssetLibrary
from gen_data.core.scene import Body, Scene
from gen_data.core.se3 import Array

PAINT = frozenset({"marking"})
PAVED = frozenset({"asphalt"})
DRIVABLE = PAVED | PAINT
"""Roles of materials of drivable surfaces."""
YELLOWNESS = 2.0
"""Paint is yellow if its red is this many times its blue; white paint has equal parts."""
NOTHING: Array = np.zeros((0, 3, 3))


def carriageways(scene: Scene, assets: AssetLibrary) -> Array:
    """Triangles [n, 3, 3] of all drivable surfaces."""
    parts = [carriageway(body, assets) for body in ground_bodies(scene)]
    return np.concatenate([NOTHING, *parts])


def ground_bodies(scene: Scene) -> tuple[Body, ...]:
    """Bodies that may be part of the ground: static and without an instance."""
    return tuple(b for b in scene.bodies if b.instance_id == 0 and b.motion == "static")


@lru_cache(maxsize=32)
def carriageway(body: Body, assets: AssetLibrary) -> Array:
    """Upward triangles [n, 3, 3] of a body's carriageway; [0, 3, 3] for most bodies."""
    return surface(body, assets, DRIVABLE)[0]


def surface(
    body: Body, assets: AssetLibrary, roles: frozenset[str]
) -> tuple[Array, NDArray[np.bool_]]:
    """Upward triangles [n, 3, 3] of a body's materials of these roles, and which are yellow [n]."""
    materials = body.materials or assets.materials(body.asset)
    slots = [k for k, material in enumerate(materials) if material.role in roles]
    if not slots:
        return NOTHING, np.zeros(0, np.bool_)
    mesh = assets.mesh(body.asset)
    chosen = np.isin(mesh.face_slots, slots)
    vertices = body.T_world_body.apply(mesh.vertices_m.astype(np.float64) * body.scale)
    triangles: Array = vertices[mesh.faces[chosen]]
    colors = np.array([material.base_color for material in materials])
    yellow = (colors[:, 0] > YELLOWNESS * colors[:, 2])[mesh.face_slots[chosen]]
    u, v = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    up = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] > 0.0
    return triangles[up], yellow[up]
