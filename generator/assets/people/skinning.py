"""Linear blend skinning: points that move with bones.

Source: Magnenat-Thalmann, Laperrière and Thalmann, "Joint-dependent local deformations for hand
animation and object grasping", Graphics Interface 1988.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gen_data.generator.assets.people.body import Array, BodyTemplate, Indices

Rotations = Mapping[str, Array]
"""``{bone: rotation [3, 3] from the template to the pose, in the body's frame}``; bones that are
not named turn with their parent."""


def bone_transforms(body: BodyTemplate, heads_m: Array, rotations: Rotations) -> Array:
    """Transform of each bone from the rest pose to the pose, float64 [bones, 3, 4].

    Args:
        body: Template with the bones.
        heads_m: Bone heads before the pose [m], shape [bones, 3]; the root's stays where it is.
        rotations: The pose.
    """
    turns = np.zeros((len(body.bones), 3, 3))
    places = np.zeros((len(body.bones), 3))
    for k, name in enumerate(body.bones):
        parent = int(body.parents[k])
        inherited = np.eye(3) if parent < 0 else turns[parent]
        turns[k] = rotations.get(name, inherited)
        places[k] = heads_m[k]
        if parent >= 0:
            places[k] = places[parent] + inherited @ (heads_m[k] - heads_m[parent])
    shifts = places - np.einsum("bij,bj->bi", turns, heads_m, optimize=False)
    return np.concatenate([turns, shifts[:, :, None]], axis=2)


def skin_points(points_m: Array, bones: Indices, weights: Array, transforms: Array) -> Array:
    """Points moved by their bones.

    Args:
        points_m: Before the pose [m], shape [n, 3].
        bones: Of each point, shape [n, 4].
        weights: Shares of those bones, shape [n, 4].
        transforms: Of every bone, shape [bones, 3, 4].

    Returns:
        After the pose [m], float64 [n, 3].
    """
    flat = transforms.reshape(len(transforms), 12)
    blended = weights[:, 0, None] * flat[bones[:, 0]]
    for k in range(1, bones.shape[1]):
        blended += weights[:, k, None] * flat[bones[:, k]]
    matrices = blended.reshape(-1, 3, 4)
    x, y, z = points_m.T[:, :, None]
    moved: Array = (
        matrices[:, :, 0] * x + matrices[:, :, 1] * y + matrices[:, :, 2] * z + matrices[:, :, 3]
    )
    return moved


def vertex_normals(points_m: Array, faces: Indices) -> Array:
    """Unit normals [n, 3], weighted by the area of the faces; (0, 0, 1) where there is none."""
    a, b, c = (points_m[faces[:, i]] for i in range(3))
    crosses = _cross(b - a, c - a)
    corners = faces.T.reshape(-1)
    sums = np.stack(
        [
            np.bincount(corners, np.tile(crosses[:, axis], 3), minlength=len(points_m))
            for axis in range(3)
        ],
        axis=1,
    )
    lengths = np.sqrt((sums * sums).sum(axis=1, keepdims=True))
    unit: Array = np.where(lengths > 1e-12, sums / np.maximum(lengths, 1e-12), (0.0, 0.0, 1.0))
    return unit


def _cross(a: Array, b: Array) -> Array:
    """``np.cross`` of rows, without its overhead."""
    ax, ay, az = a.T
    bx, by, bz = b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)
