"""Objects of families and parts of them, and what holds for the mesh of every one."""

import hashlib
from functools import cache

import numpy as np
from numpy.typing import NDArray

from gen_data.assets.families import own_families
from gen_data.assets.family import Family, Solid, Worn
from gen_data.core.asset_types import MeshData

Array = NDArray[np.float64]


def build(name: str, seed: int, **parameters: object) -> Solid:
    """A variant with the parameters of its family, or with others."""
    family = own_families()[name]
    assert isinstance(family, Family)
    return family.build(**{**family.parameters, "seed": seed, **parameters})


variant = cache(build)
"""The same, built once for all tests."""


def new_and_worn(name: str, seed: int) -> tuple[MeshData, MeshData]:
    """Meshes of a variant before and after its use.

    Use changes no place and no face; slots that keep their texture keep its coordinates.
    """
    family = own_families()[name]
    assert isinstance(family, Family)
    assert isinstance(family.build, Worn)
    new = family.build.build(**{**family.parameters, "seed": seed}).mesh
    worn = build(name, seed).mesh
    kept = [k for k, m in enumerate(worn.materials) if m.texture == new.materials[k].texture]
    plain = np.isin(worn.face_slots, kept)
    assert len(worn.materials) == len(new.materials)
    assert (new.face_slots == worn.face_slots).all()
    assert (new.vertices_m[new.faces] == worn.vertices_m[worn.faces]).all()
    assert (new.normals[new.faces] == worn.normals[worn.faces]).all()
    assert (new.uvs[new.faces[plain]] == worn.uvs[worn.faces[plain]]).all()
    return new, worn


def with_role(mesh: MeshData, *roles: str) -> Array:
    """Corners of the faces of these roles, shape [n, 3 corners, 3]."""
    slots = [k for k, material in enumerate(mesh.materials) if material.role in roles]
    return mesh.vertices_m[mesh.faces[np.isin(mesh.face_slots, slots)]].astype(np.float64)


def crosses(mesh: MeshData) -> Array:
    """Normals of all faces by their winding, [n, 3]; their lengths are twice the areas."""
    a, b, c = mesh.vertices_m[mesh.faces].astype(np.float64).transpose(1, 0, 2)
    return np.cross(b - a, c - a)


def volume_m3(corners: Array) -> float:
    """Sum of the signed tetrahedra between the origin and every triangle [n, 3, 3]."""
    return float((corners[:, 0] * np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0)


def digest(solid: Solid) -> str:
    """SHA-256 of geometry, materials and keypoints."""
    mesh, sha = solid.mesh, hashlib.sha256()
    arrays = (mesh.vertices_m, mesh.faces, mesh.normals, mesh.uvs, mesh.face_slots)
    for array in (*arrays, *solid.collision.parts_m):
        sha.update(array.tobytes())
    sha.update(repr((mesh.materials, solid.keypoints)).encode())
    return sha.hexdigest()


def assert_well_formed(mesh: MeshData) -> None:
    """Arrays of the contract's types, unit normals, every vertex and slot used, faces with area."""
    n, m = len(mesh.vertices_m), len(mesh.faces)
    for array, shape, dtype in (
        (mesh.vertices_m, (n, 3), np.float32),
        (mesh.normals, (n, 3), np.float32),
        (mesh.uvs, (n, 2), np.float32),
        (mesh.faces, (m, 3), np.int32),
        (mesh.face_slots, (m,), np.int32),
    ):
        assert (array.shape, array.dtype) == (shape, dtype)
        assert np.isfinite(array).all()
    assert np.allclose((mesh.normals.astype(np.float64) ** 2).sum(axis=1), 1.0, atol=1e-4)
    assert set(np.unique(mesh.face_slots)) <= set(range(len(mesh.materials)))
    assert (mesh.faces.min(), mesh.faces.max()) == (0, n - 1)
    assert np.sqrt((crosses(mesh) ** 2).sum(axis=1)).min() > 1e-13
