"""Asset family of blocks."""

import numpy as np

from gen_data.assets.family import Family, Provenance, Solid
from gen_data.assets.triangle_soup import box, face_crosses
from gen_data.core.asset_types import ConvexParts, Material, MeshData


def block(seed: int) -> Solid:
    """A red block on the floor, 0.4 m wide; its height grows with the seed."""
    height_m = 0.5 + 0.1 * seed
    corners_m = np.add(box((0.4, 0.4, height_m)), (0.0, 0.0, 0.5 * height_m))
    crosses = face_crosses(corners_m)
    normals = np.repeat(crosses / np.linalg.norm(crosses, axis=1, keepdims=True), 3, axis=0)
    points_m = corners_m.reshape(-1, 3)
    mesh = MeshData(
        vertices_m=points_m.astype(np.float32),
        faces=np.arange(36, dtype=np.int32).reshape(-1, 3),
        normals=normals.astype(np.float32),
        uvs=np.zeros((36, 2), np.float32),
        face_slots=np.zeros(12, np.int32),
        materials=(Material((0.5, 0.1, 0.1), 0.6),),
    )
    return Solid(mesh, ConvexParts((np.unique(points_m, axis=0),)))


BLOCK = Family(
    name="stranger_block",
    category="block",
    tags=("stranger_furniture",),
    variants=2,
    mass_kg=0.0,
    stackable=True,
    version=1,
    parameters={},
    build=block,
    origin=Provenance("CC0-1.0", "A stranger", "stranger"),
)
