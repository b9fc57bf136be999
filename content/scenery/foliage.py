"""Leaves as geometry: small triangles, shaded as if the crown were one soft body.

Every triangle represents a spray of leaves. Its front faces outward and its normals lean away from
the middle of its crown: a crown is lit as a whole and does not glitter leaf by leaf.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gen_data.content.procedural.patches import GRID_M, Array, Indices, round_values, unit
from gen_data.core.asset_types import Material, MeshData
from gen_data.core.noise import uniform
from gen_data.core.streams import Rng

OUTWARD = 0.78
"""Share of the outward direction in a leaf's normal; the rest is its own."""


@dataclass(frozen=True, eq=False, slots=True)
class Sprays:
    """Sprays of leaves, one triangle each.

    Attributes:
        at_m: Where each is attached, [n, 3].
        outward: Unit direction away from the crown's middle, [n, 3].
        along: Unit direction in which it grows, [n, 3].
        length_m: From its foot to its tip, [n].
        slots: Material of each, [n].
    """

    at_m: Array
    outward: Array
    along: Array
    length_m: Array
    slots: Indices


def leaf_mesh(sprays: Sprays, materials: Sequence[Material], width: float, rng: Rng) -> MeshData:
    """Triangles ``width`` times as wide as long, turned about their own axis by chance."""
    aside = sprays.outward + 0.9 * directions(len(sprays.slots), rng)
    across = unit(np.cross(sprays.along, aside))
    half = 0.5 * width * sprays.length_m[:, None] * across
    # A third of the way along a spray is widest: a kite that lost one wing reads as foliage.
    skew = (uniform((len(sprays.slots), 1), rng) - 0.5) * sprays.length_m[:, None] * sprays.along
    foot, tip = sprays.at_m, sprays.at_m + sprays.length_m[:, None] * sprays.along
    corners = np.stack([foot + half + 0.4 * skew, tip, foot - half - 0.4 * skew], axis=1)
    # Nothing grows into the ground.
    corners[..., 2] = np.maximum(corners[..., 2], 0.0)
    corners = np.round(round_values(corners) / GRID_M) * GRID_M
    own = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = (own * sprays.outward).sum(axis=1) < 0.0
    corners[inward] = corners[inward][:, ::-1]
    own = unit(np.where(inward[:, None], -own, own))
    normals = unit(OUTWARD * sprays.outward + (1.0 - OUTWARD) * own)
    n = len(corners)
    return MeshData(
        vertices_m=corners.reshape(-1, 3).astype(np.float32),
        faces=np.arange(3 * n, dtype=np.int32).reshape(-1, 3),
        normals=(np.round(round_values(np.repeat(normals, 3, axis=0)), 6) + 0.0).astype(np.float32),
        uvs=np.zeros((3 * n, 2), dtype=np.float32),
        face_slots=sprays.slots.astype(np.int32),
        materials=tuple(materials),
    )


@dataclass(frozen=True, slots=True)
class Habit:
    """Arrangement of a plant's leaves.

    Attributes:
        count: How many sprays.
        length_m: Mean length of a spray.
        spread_m: Radius of the cluster about an anchor.
        shades: Number of materials; the first is the deepest in the crown.
        droop: How much sprays hang; below 0, they rise.
    """

    count: int
    length_m: float
    spread_m: float
    shades: int = 4
    droop: float = 0.15


def sprays_about(anchors_m: Array, centre_m: Array, habit: Habit, rng: Rng) -> Sprays:
    """Sprays in clusters about anchors.

    Args:
        anchors_m: Ends of twigs, [k, 3].
        centre_m: Middle of the crown, [3].
        habit: How many, how large, how dense.
        rng: Draws places and directions.
    """
    count, shades = habit.count, habit.shades
    which = np.arange(count) % len(anchors_m)
    offset = directions(count, rng) * habit.spread_m * uniform((count, 1), rng) ** 0.5
    at = anchors_m[which] + offset
    outward = unit(at - centre_m + 0.25 * offset)
    along = 0.55 * outward + 0.8 * directions(count, rng)
    along = unit(along - np.array([0.0, 0.0, habit.droop]))
    reach = np.sqrt(((at - centre_m) ** 2).sum(axis=1))
    depth = reach / max(float(reach.max()), 1e-9) + 0.12 * offset[:, 2] / habit.spread_m
    # Deep sprays are large and close the crown, outer ones are small and draw its outline.
    size = np.clip(1.6 - 0.85 * depth, 0.7, 1.5)
    length = habit.length_m * size * (0.75 + 0.5 * uniform(count, rng))
    lit = depth + 0.2 * (uniform(count, rng) - 0.5)
    slots = np.clip(np.floor((lit - 0.35) / 0.65 * shades), 0, shades - 1).astype(np.int64)
    return Sprays(at, outward, along, length, slots)


def merge_meshes(first: MeshData, second: MeshData) -> MeshData:
    """Both meshes as one; the second's slots follow the first's."""
    slots = second.face_slots + np.int32(len(first.materials))
    return MeshData(
        vertices_m=np.concatenate([first.vertices_m, second.vertices_m]),
        faces=np.concatenate([first.faces, second.faces + np.int32(len(first.vertices_m))]),
        normals=np.concatenate([first.normals, second.normals]),
        uvs=np.concatenate([first.uvs, second.uvs]),
        face_slots=np.concatenate([first.face_slots, slots]),
        materials=(*first.materials, *second.materials),
    )


def directions(count: int, rng: Rng) -> Array:
    """Unit vectors, even over the sphere, [count, 3]."""
    z = 2.0 * uniform(count, rng) - 1.0
    turn = 2.0 * math.pi * uniform(count, rng)
    flat = np.sqrt(1.0 - z * z)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
