"""Meshes on the device, each with its hierarchy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.generator.core.asset_types import Material, MeshData
from gen_data.generator.core.se3 import Array
from gen_data.generator.renderers.warp.scene.bvh import face_boxes, mesh_tree
from gen_data.generator.renderers.warp.scene.kernels.records import Geometry
from gen_data.generator.renderers.warp.scene.struct_dtypes import to_record

# Cells along the longest side of the grid that groups faces into boxes.
_CELLS = 6
# Faces larger than three cells get boxes of their own, up to this number.
_LARGE_FACES_MAX = 256

# Above this number of faces, the quadratic test costs more than it saves.
_CONVEXITY_FACES_MAX = 2000


@dataclass(frozen=True, eq=False, slots=True)
class DeviceMesh:
    """Geometry of one asset on the device.

    Attributes:
        record: A Geometry record [1].
        keep: The device arrays and the hierarchy that the record points to.
        low_m, high_m: Bounds in the mesh frame.
    """

    record: NDArray[np.void]
    keep: tuple[object, ...]
    low_m: Array
    high_m: Array
    vertex_count: int
    materials: tuple[Material, ...]
    nbytes: int


def upload_mesh(data: MeshData, device: wp.Device) -> DeviceMesh:
    """Upload a mesh and build its hierarchy."""
    vertices = wp.array(data.vertices_m, dtype=wp.vec3, device=device)
    normals = wp.array(data.normals, dtype=wp.vec3, device=device)
    uvs = wp.array(data.uvs, dtype=wp.vec2, device=device)
    faces = wp.array(data.faces.reshape(-1), dtype=wp.int32, device=device)
    slots = wp.array(data.face_slots, dtype=wp.int32, device=device)
    face_lows, face_highs = face_boxes(data.vertices_m, data.faces)
    lows, highs = (
        wp.array(bounds, dtype=wp.vec3, device=device)
        for bounds in boxes_around(face_lows, face_highs)
    )
    low, high = (np.asarray(bound, dtype=np.float64) for bound in data.bounds_m())
    record = Geometry()
    if device.is_cuda:
        hierarchy = wp.Mesh(points=vertices, indices=faces)
        record.mesh = hierarchy.id
        # Warp's hierarchy has two 16-byte nodes per triangle, built from 24-byte boxes.
        hierarchy_nbytes = (64 + 24) * len(data.faces)
    else:
        tree = mesh_tree(data.vertices_m, data.faces, face_lows, face_highs)
        hierarchy = record.tree = wp.array(tree, dtype=wp.float32, device=device)
        hierarchy_nbytes = tree.nbytes
    record.vertices_m, record.normals, record.uvs = vertices, normals, uvs
    record.faces, record.face_slots = faces, slots
    record.box_lows_m, record.box_highs_m = lows, highs
    record.low_m, record.high_m = wp.vec3(*low), wp.vec3(*high)
    record.convex = int(is_convex_solid(data.vertices_m, data.faces))
    nbytes = 32 * len(data.vertices_m) + 16 * len(data.faces) + hierarchy_nbytes
    keep = (vertices, normals, uvs, faces, slots, lows, highs, hierarchy)
    return DeviceMesh(
        to_record(record, Geometry), keep, low, high, len(data.vertices_m), data.materials, nbytes
    )


def boxes_around(
    lows: NDArray[np.float32], highs: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Low and high corners [m], [n, 3] each, of a few boxes that contain those of all faces.

    Faces whose centres lie in one cell of a coarse grid share a box; large ones have their own.
    """
    origin = np.array([column.min() for column in lows.T])
    top = np.array([column.max() for column in highs.T])
    cell_m = max(float((top - origin).max()) / _CELLS, 1e-9)
    places = ((0.5 * (lows + highs) - origin) / cell_m).astype(np.int64)
    cells = places @ np.array([1, _CELLS + 1, (_CELLS + 1) ** 2])
    x, y, z = (highs - lows).T
    large = np.flatnonzero(np.maximum(np.maximum(x, y), z) > 3.0 * cell_m)[:_LARGE_FACES_MAX]
    cells[large] = -1 - large
    order = np.argsort(cells, kind="stable")
    starts = np.flatnonzero(np.diff(cells[order], prepend=np.iinfo(np.int64).min))
    return np.minimum.reduceat(lows[order], starts), np.maximum.reduceat(highs[order], starts)


def is_convex_solid(vertices_m: NDArray[np.float32], faces: NDArray[np.int32]) -> bool:
    """Whether no vertex lies outside the plane of any face; False for large meshes."""
    if len(faces) > _CONVEXITY_FACES_MAX:
        return False
    # Most concave meshes fail at one of the first few faces.
    return all(_behind_faces(vertices_m, part) for part in (faces[:: len(faces) // 8 + 1], faces))


def _behind_faces(vertices_m: NDArray[np.float32], faces: NDArray[np.int32]) -> bool:
    vertices = vertices_m.astype(np.float64)
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.sqrt((normals * normals).sum(axis=1))
    solid = lengths > 0.0
    normals = normals[solid] / lengths[solid, None]
    offsets = (normals * corners[solid, 0]).sum(axis=1)
    heights = np.einsum("fk,vk->fv", normals, vertices, optimize=False) - offsets[:, None]
    tolerance = 1e-5 * float(np.ptp(vertices, axis=0).max())
    return bool((heights <= tolerance).all())
