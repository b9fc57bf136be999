"""Carried objects: backpack, handbag, telephone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gen_data.generator.assets.people.body import Array, BodyTemplate, Indices
from gen_data.generator.assets.people.person import Person
from gen_data.generator.assets.people.skinning import vertex_normals
from gen_data.generator.core.asset_types import Material

_PHONE = Material((0.012, 0.012, 0.014), 0.15, role="bag")


@dataclass(frozen=True, eq=False, slots=True)
class Prop:
    """A rigid object in place."""

    vertices_m: Array
    normals: Array
    faces: Indices
    slots: Indices
    materials: tuple[Material, ...]


def make_props(
    person: Person, body: BodyTemplate, posed_m: Array, transforms: Array, scale: float
) -> tuple[Prop, ...]:
    """Everything a person carries.

    Args:
        person: Person who carries them.
        body: Their template.
        posed_m: Bone heads and landmarks after the pose [m].
        transforms: Of every bone, shape [bones, 3, 4].
        scale: Of the person against the template.
    """
    made = []
    material = person.outfit.bag_material
    if person.outfit.bag == "backpack":
        trunk = transforms[body.bone("spine_03"), :, :3]
        middle = posed_m[body.bone("spine_03")] + trunk @ (np.array([-0.172, 0.0, 0.03]) * scale)
        size = np.array([0.17, 0.3, 0.42]) * scale
        made.append(_pillow(middle, size, trunk, material))
    if person.pose == "carry" or (person.outfit.bag == "handbag" and person.pose != "phone"):
        # Bags hang from the hand and keep upright.
        grip = 0.5 * (posed_m[body.bone("hand_r")] + posed_m[body.bone("middle_03_r")])
        middle = grip - np.array([0.0, 0.0, 0.25 * scale])
        made.append(_pillow(middle, np.array([0.32, 0.1, 0.3]) * scale, np.eye(3), material))
        handle = grip - np.array([0.0, 0.0, 0.06 * scale])
        made.append(_pillow(handle, np.array([0.1, 0.02, 0.16]) * scale, np.eye(3), material))
    if person.pose == "phone":
        hand = transforms[body.bone("hand_r"), :, :3]
        grip = posed_m[body.bone("middle_01_r")]
        thumb = posed_m[body.bone("thumb_03_r")]
        made.append(_pillow(0.6 * grip + 0.4 * thumb, np.array([0.14, 0.075, 0.01]), hand, _PHONE))
    return tuple(made)


def _pillow(middle: Array, size_m: Array, axes: Array, material: Material) -> Prop:
    """A box with round edges."""
    n = 5
    t = np.linspace(-1.0, 1.0, n)
    u, v = (grid.ravel() for grid in np.meshgrid(t, t, indexing="ij"))
    quads = [
        (i * n + j, (i + 1) * n + j, (i + 1) * n + j + 1, i * n + j + 1)
        for i in range(n - 1)
        for j in range(n - 1)
    ]
    faces = np.array([tri for a, b, c, d in quads for tri in ((a, b, c), (a, c, d))])
    places: list[Array] = []
    triangles: list[Indices] = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            p = np.zeros((n * n, 3))
            p[:, axis], p[:, (axis + 1) % 3], p[:, (axis + 2) % 3] = sign, u, v
            triangles.append((faces if sign > 0 else faces[:, ::-1]) + n * n * len(places))
            places.append(p)
    cube = np.concatenate(places)
    # A superellipsoid of degree six: flat sides, soft edges.
    around = cube / ((cube**6).sum(axis=1, keepdims=True) ** (1.0 / 6.0))
    vertices = (0.5 * size_m * around) @ axes.T + middle
    index = np.concatenate(triangles)
    normals = _across_seams(around, vertices, index)
    return Prop(vertices, normals, index, np.zeros(len(index), np.int64), (material,))


def _across_seams(around: Array, vertices: Array, faces: Indices) -> Array:
    """Normals that vertices in the same place share."""
    _, first, inverse = np.unique(
        np.rint(around * 1e6), axis=0, return_index=True, return_inverse=True
    )
    normals: Array = vertex_normals(vertices[first], inverse.reshape(-1)[faces])
    return normals[inverse.reshape(-1)]
