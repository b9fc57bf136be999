"""Rays against one mesh, by Open3D's Embree: which face is met, how far, and from which side."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.generator.core.asset_types import MeshData
from gen_data.generator.core.bounded_cache import ObjectCache

Array = NDArray[np.float64]

_casters: ObjectCache[Any] = ObjectCache(4)
"""Of the latest meshes: building a hierarchy takes longer than a thousand rays in it."""


def cast(mesh: MeshData, origins_m: Array, directions: Array) -> tuple[Array, Array, Array]:
    """Distance in lengths of the direction (inf = nothing), face (-1) and its unit normal.

    The normal is the face's own, by its winding.
    """
    try:
        import open3d as o3d
    except (ImportError, OSError) as error:
        pytest.skip(f"open3d cannot be loaded ({error})")

    def make_caster() -> Any:
        caster = o3d.t.geometry.RaycastingScene(nthreads=1)
        caster.add_triangles(
            o3d.core.Tensor(mesh.vertices_m), o3d.core.Tensor(mesh.faces.astype(np.uint32))
        )
        return caster

    caster = _casters.get(mesh, make_caster)
    rays = np.concatenate([origins_m, directions], axis=1).astype(np.float32)
    answer = caster.cast_rays(o3d.core.Tensor(rays))
    face = answer["primitive_ids"].numpy().astype(np.int64)
    face[face == 2**32 - 1] = -1
    return answer["t_hit"].numpy(), face, answer["primitive_normals"].numpy()
