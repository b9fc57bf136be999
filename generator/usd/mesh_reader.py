"""Mesh prims: polygons, corner by corner, and what they look like."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.errors import AssetError
from gen_data.generator.core.se3 import Array
from gen_data.generator.usd.material_reader import PLAIN, BoundMaterial, read_look

Int64 = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class MeshPrim:
    """Triangles of a mesh prim, in its own frame and unit.

    Attributes:
        corners: float64 [m, 3, 3].
        uvs: float64 [m, 3, 2] as the looks use them; None = there are none.
        normals: float64 [m, 3, 3]; None = there are none.
        face_slots: int64 [m], indices into ``looks``.
    """

    corners: Array
    uvs: Array | None
    normals: Array | None
    face_slots: Int64
    looks: tuple[BoundMaterial, ...]


@dataclass(frozen=True, eq=False)
class _Topology:
    """How polygons are cut into triangles.

    Attributes:
        points: int64 [corners], the point of each corner of each polygon.
        fans: int64 [m, 3], corners of the triangles.
        polygon: int64 [m], the polygon of each triangle.
        polygons: How many there are.
    """

    points: Int64
    fans: Int64
    polygon: Int64
    polygons: int


def read_mesh_prim(prim: Any, place: str) -> MeshPrim:
    """Triangles and looks of a mesh.

    Raises:
        AssetError: if arrays contradict each other, or its material is not read.
    """
    from pxr import Usd, UsdGeom

    where = f"{place}: {prim.GetPath()}"
    mesh, time = UsdGeom.Mesh(prim), Usd.TimeCode.EarliestTime()
    points = np.array(mesh.GetPointsAttr().Get(time) or [], dtype=np.float64).reshape(-1, 3)
    topology = _topology(mesh, len(points), where)
    slots, looks = _looks(prim, topology.polygons, place)
    face_slots = slots[topology.polygon]
    return MeshPrim(
        corners=points[topology.points[topology.fans]],
        uvs=_uvs(prim, topology, face_slots, looks),
        normals=_normals(mesh, topology),
        face_slots=face_slots,
        looks=looks,
    )


def _topology(mesh: Any, point_count: int, where: str) -> _Topology:
    from pxr import Usd, UsdGeom

    time = Usd.TimeCode.EarliestTime()
    counts = np.array(mesh.GetFaceVertexCountsAttr().Get(time) or [], dtype=np.int64)
    points = np.array(mesh.GetFaceVertexIndicesAttr().Get(time) or [], dtype=np.int64)
    fits = len(counts) and counts.min() >= 3 and counts.sum() == len(points)
    if not fits or points.min() < 0 or points.max() >= point_count:
        raise AssetError(f"{where}: its faces and points do not fit together; export it again")
    starts = np.cumsum(counts) - counts
    first = np.repeat(starts, counts - 2)
    sizes = counts - 2
    step = np.arange(int(sizes.sum())) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    fans = np.stack([first, first + step + 1, first + step + 2], axis=1)
    if mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded:
        fans = fans[:, ::-1]
    return _Topology(points, fans, np.repeat(np.arange(len(counts)), sizes), len(counts))


def _looks(prim: Any, polygons: int, place: str) -> tuple[Int64, tuple[BoundMaterial, ...]]:
    """The slot of every polygon, and what the slots look like: the mesh, then its subsets."""
    from pxr import UsdShade

    slots = np.zeros(polygons, dtype=np.int64)
    prims = [prim]
    for subset in UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets():
        faces = np.array(subset.GetIndicesAttr().Get() or [], dtype=np.int64)
        slots[faces[(faces >= 0) & (faces < polygons)]] = len(prims)
        prims.append(subset.GetPrim())
    used = set(np.unique(slots).tolist())
    return slots, tuple(
        read_look(p, prim, place) if k in used else PLAIN for k, p in enumerate(prims)
    )


def _uvs(
    prim: Any, topology: _Topology, face_slots: Int64, looks: tuple[BoundMaterial, ...]
) -> Array | None:
    """Texture coordinates that each triangle's look asks for; None if no look finds its own."""
    uvs = np.zeros((len(topology.fans), 3, 2))
    found = False
    for slot, look in enumerate(looks):
        values = _per_corner(prim, look.uv_name, topology) if look.mapped else None
        if values is not None:
            chosen = face_slots == slot
            turned = np.einsum("ij,...j->...i", look.uv_matrix[:, :2], values, optimize=False)
            uvs[chosen] = (turned + look.uv_matrix[:, 2])[topology.fans[chosen]]
            found = True
    return uvs if found else None


def _normals(mesh: Any, topology: _Topology) -> Array | None:
    from pxr import Usd

    values = _per_corner(mesh.GetPrim(), "normals", topology)
    if values is None:
        given = mesh.GetNormalsAttr().Get(Usd.TimeCode.EarliestTime())
        if not given:
            return None
        values = _expand_to_corners(
            np.array(given, dtype=np.float64), mesh.GetNormalsInterpolation(), topology
        )
    if values is None or values.shape[1] != 3:
        return None
    normals: Array = values[topology.fans]
    return normals


def _per_corner(prim: Any, name: str, topology: _Topology) -> Array | None:
    """A primvar's value at every corner; None if there is none, or it does not fit."""
    from pxr import Usd, UsdGeom

    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
    if not primvar or not primvar.HasValue():
        return None
    values = np.array(primvar.ComputeFlattened(Usd.TimeCode.EarliestTime()), dtype=np.float64)
    if values.ndim != 2:
        return None
    return _expand_to_corners(values, primvar.GetInterpolation(), topology)


def _expand_to_corners(values: Array, interpolation: str, topology: _Topology) -> Array | None:
    """Values per constant, polygon, point or corner as values per corner; None if too few."""
    from pxr import UsdGeom

    tokens = UsdGeom.Tokens
    count = len(topology.points)
    if interpolation == tokens.faceVarying:
        index = np.arange(count)
    elif interpolation in (tokens.vertex, tokens.varying):
        index = topology.points
    elif interpolation == tokens.uniform:
        sizes = np.bincount(topology.polygon, minlength=topology.polygons) + 2
        index = np.repeat(np.arange(topology.polygons), sizes)
    else:
        index = np.zeros(count, dtype=np.int64)
    return values[index] if index.max() < len(values) else None
