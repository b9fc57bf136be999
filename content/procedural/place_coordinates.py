"""Texture coordinates by place, for layers such as dirt that belong to a whole object."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from gen_data.core.asset_types import Float32, MeshData


def map_by_place(
    mesh: MeshData, slots: Sequence[int], coordinates: Callable[[Float32], Float32]
) -> MeshData:
    """The mesh with other texture coordinates on some slots.

    Args:
        mesh: The mesh; its other slots keep theirs.
        slots: Material slots.
        coordinates: Texture coordinates, shape [n, 2], of vertices, shape [n, 3] [m].
    """
    chosen = np.isin(mesh.face_slots, slots)
    if not chosen.any():
        return mesh
    mapped, others = np.unique(mesh.faces[chosen]), np.unique(mesh.faces[~chosen])
    # Vertices that another slot shares keep their coordinates; the mapped faces have copies.
    shared = np.intersect1d(mapped, others)
    target = np.arange(len(mesh.vertices_m), dtype=np.int32)
    target[shared] = len(target) + np.arange(len(shared), dtype=np.int32)
    vertices = np.concatenate([mesh.vertices_m, mesh.vertices_m[shared]])
    uvs = np.concatenate([mesh.uvs, mesh.uvs[shared]])
    uvs[target[mapped]] = np.round(coordinates(vertices[target[mapped]]), 6)
    return replace(
        mesh,
        vertices_m=vertices,
        normals=np.concatenate([mesh.normals, mesh.normals[shared]]),
        uvs=uvs,
        faces=np.where(chosen[:, None], target[mesh.faces], mesh.faces),
    )
