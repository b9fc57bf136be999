"""Rays against one mesh, by Embree: which face is met, how far, and from which side."""

import numpy as np
from numpy.typing import NDArray

from gen_data.core.asset_types import MeshData
from gen_data.core.bounded_cache import ObjectCache
from tests.embree import RayCaster

Array = NDArray[np.float64]

_casters: ObjectCache[RayCaster] = ObjectCache(4)
"""Of the latest meshes: building a hierarchy takes longer than a thousand rays in it."""


def cast(mesh: MeshData, origins_m: Array, directions: Array) -> tuple[Array, Array, Array]:
    """Distance in lengths of the direction (inf = nothing), face (-1) and its unit normal.

    The normal is the face's own, by its winding.
    """
    caster = _casters.get(mesh, lambda: RayCaster((mesh.vertices_m, mesh.faces)))
    hits = caster.cast(origins_m, directions)
    return hits.distance, hits.face, hits.normal
