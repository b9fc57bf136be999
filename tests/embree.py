"""Rays against meshes by Intel Embree, which shares no code with the renderer.

The package embreex needs no library of the system, and has wheels for x86-64 only.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from gen_data.core.interfaces import AssetLibrary
from gen_data.core.scene import Body

pytest.importorskip("embreex", reason="embreex has wheels for x86-64 only")
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

NOTHING = -1
"""Number of mesh and face where a ray meets nothing."""


@dataclass(frozen=True, eq=False)
class Hits:
    """First surfaces on rays.

    Attributes:
        distance: In lengths of the direction; inf = nothing, [...].
        mesh: Numbers of meshes in the order of their list, [...].
        face: Numbers of faces in their mesh, [...].
        normal: Normals of the faces by their winding, of unit length; 0 = nothing, [..., 3].
    """

    distance: NDArray[np.float32]
    mesh: NDArray[np.int32]
    face: NDArray[np.int32]
    normal: NDArray[np.float32]


class RayCaster:
    """A scene of meshes: corners [n, 3] and faces [m, 3] of each."""

    def __init__(self, *meshes: tuple[ArrayLike, ArrayLike]) -> None:
        self._scene = EmbreeScene(robust=True)
        for corners, faces in meshes:
            TriangleMesh(self._scene, np.asarray(corners, np.float32), np.asarray(faces, np.int32))

    def cast(self, origins: ArrayLike, directions: ArrayLike) -> Hits:
        """First surfaces on rays; origins and directions are broadcast, [..., 3]."""
        shape, rays = _rays(origins, directions)
        hit = self._scene.run(*rays, output=1)
        missed = hit["geomID"] == NOTHING
        length = np.linalg.norm(hit["Ng"], axis=1, keepdims=True)
        return Hits(
            np.where(missed, np.float32(np.inf), hit["tfar"]).reshape(shape),
            hit["geomID"].reshape(shape),
            hit["primID"].reshape(shape),
            (hit["Ng"] / np.where(length > 0.0, length, 1.0)).reshape((*shape, 3)),
        )

    def is_blocked(
        self, origins: ArrayLike, directions: ArrayLike, near: float, far: float = 1e30
    ) -> NDArray[np.bool_]:
        """Whether a surface is on each ray between two multiples of its direction, [...]."""
        start = np.asarray(origins) + near * np.asarray(directions)
        shape, rays = _rays(start, directions)
        reach = np.full(len(rays[0]), far - near, np.float32)
        found = self._scene.run(*rays, reach, query="OCCLUDED")
        return np.asarray(found != NOTHING).reshape(shape)


def _rays(
    origins: ArrayLike, directions: ArrayLike
) -> tuple[tuple[int, ...], tuple[NDArray[np.float32], NDArray[np.float32]]]:
    both = np.broadcast_arrays(np.asarray(origins, np.float32), np.asarray(directions, np.float32))
    start, way = (np.ascontiguousarray(one.reshape(-1, 3)) for one in both)
    return both[0].shape[:-1], (start, way)


def placed(body: Body, assets: AssetLibrary) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
    mesh = assets.mesh(body.asset)
    return body.T_world_body.apply(mesh.vertices_m.astype(np.float64) * body.scale), mesh.faces
