"""Import of mesh prims: triangulated polygons and their materials."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.core import polygon_triangles
from gen_data.core.errors import AssetError
from gen_data.core.se3 import Array
from gen_data.usd.material_reader import PLAIN, BoundMaterial, read_bound_material
from gen_data.usd.primitives import primitive_corners

Int64 = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class MeshPrim:
    """Triangles of a mesh prim, in its own frame and unit.

    Attributes:
        corners: float64 [m, 3, 3].
        uvs: float64 [m, 3, 2] as the materials use them; None = none.
        normals: float64 [m, 3, 3]; None = none.
        face_slots: int64 [m], indices into ``materials``.
        colors: float64 [m, 3, 3]: linear RGB at each corner, white where a material has colours;
            None = none.
        remarks: Unused contents of the prim.
    """

    corners: Array
    uvs: Array | None
    normals: Array | None
    face_slots: Int64
    materials: tuple[BoundMaterial, ...]
    colors: Array | None = None
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Topology:
    """Triangulation of polygons.

    Attributes:
        points: int64 [corners], point of each polygon corner.
        fans: int64 [m, 3], corners of the triangles.
        polygon: int64 [m], polygon of each triangle.
        owners: int64 [corners], polygon of each polygon corner.
        polygons: Number of polygons, with holes, which have no triangles.
    """

    points: Int64
    fans: Int64
    polygon: Int64
    owners: Int64
    polygons: int


def read_mesh_prim(prim: Any, place: str) -> MeshPrim:
    """Read triangles and materials of a mesh.

    Raises:
        AssetError: if its arrays are inconsistent, or its material is unsupported.
    """
    from pxr import Usd, UsdGeom

    where = f"{place}: {prim.GetPath()}"
    mesh, time = UsdGeom.Mesh(prim), Usd.TimeCode.EarliestTime()
    points = np.array(mesh.GetPointsAttr().Get(time) or [], dtype=np.float64).reshape(-1, 3)
    topology = _read_topology(mesh, points, where)
    slots, materials = _read_materials(prim, topology.polygons, place)
    face_slots = slots[topology.polygon]
    read = MeshPrim(
        corners=points[topology.points[topology.fans]],
        uvs=_read_uvs(prim, topology, face_slots, materials),
        normals=_read_normals(mesh, topology),
        face_slots=face_slots,
        materials=materials,
        remarks=_find_unused(mesh, materials),
    )
    return _paint(prim, read, topology)


def read_primitive(prim: Any, place: str) -> MeshPrim:
    """Read a sphere, cube or another primitive shape.

    Raises:
        AssetError: if a length is not positive, or its material is unsupported.
    """
    corners = primitive_corners(prim, place)
    count = len(corners)
    materials = (read_bound_material(prim, place),)
    remarks = tuple(
        f"material '{m.name}': a {prim.GetTypeName()} has no texture coordinates for its image"
        for m in materials
        if m.has_images
    )
    triangles = np.arange(3 * count).reshape(-1, 3)
    polygon = np.arange(count)
    owners = np.repeat(polygon, 3)
    topology = _Topology(triangles.reshape(-1), triangles, polygon, owners, count)
    read = MeshPrim(corners, None, None, np.zeros(count, np.int64), materials, remarks=remarks)
    return _paint(prim, read, topology)


def _find_unused(mesh: Any, materials: tuple[BoundMaterial, ...]) -> tuple[str, ...]:
    from pxr import UsdSkel

    remarks = [text for material in materials for text in material.unused]
    scheme = str(mesh.GetSubdivisionSchemeAttr().Get())
    if scheme != "none":
        remarks.append(f"subdivision surfaces ({scheme}) are read as their cages")
    if mesh.GetPrim().HasAPI(UsdSkel.BindingAPI):
        remarks.append("skinned meshes are read as they are bound, without their skeleton's pose")
    if mesh.GetPointsAttr().ValueMightBeTimeVarying():
        remarks.append("points that move over time are read at the earliest time")
    return tuple(remarks)


def _paint(prim: Any, mesh: MeshPrim, topology: _Topology) -> MeshPrim:
    """Give the display colour to triangles whose material uses it, or is missing."""
    colors = np.ones((len(mesh.corners), 3, 3))
    materials, remarks, found = list(mesh.materials), list(mesh.remarks), False
    for slot, material in enumerate(mesh.materials):
        values = _read_primvar(prim, material.color_name, topology) if material.color_name else None
        if values is None or values.shape[1] != 3:
            continue
        chosen = mesh.face_slots == slot
        colors[chosen] = np.clip(values[topology.fans[chosen]], 0.0, 1.0)
        white = replace(material.material, base_color=(1.0, 1.0, 1.0))
        materials[slot] = replace(material, material=white)
        found = True
    opacity = _read_primvar(prim, "displayOpacity", topology)
    if opacity is not None and opacity.shape[1] == 1:
        whole = round(float(np.clip(opacity, 0.0, 1.0).mean()), 4)
        for slot, material in enumerate(materials):
            if not material.name:
                seen = replace(material.material, opacity=whole)
                materials[slot] = replace(material, material=seen)
        if np.ptp(opacity) > 1e-3:
            remarks.append("only the mean of displayOpacity is used")
    return replace(
        mesh, materials=tuple(materials), colors=colors if found else None, remarks=tuple(remarks)
    )


def _read_topology(mesh: Any, positions: Array, where: str) -> _Topology:
    from pxr import Usd, UsdGeom

    time = Usd.TimeCode.EarliestTime()
    counts = np.array(mesh.GetFaceVertexCountsAttr().Get(time) or [], dtype=np.int64)
    points = np.array(mesh.GetFaceVertexIndicesAttr().Get(time) or [], dtype=np.int64)
    fits = len(counts) and counts.min() >= 3 and counts.sum() == len(points)
    if not fits or points.min() < 0 or points.max() >= len(positions):
        raise AssetError(f"{where}: its faces and points are inconsistent; export it again")
    fans, polygon = polygon_triangles.split_polygons(counts, positions, points)
    if mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded:
        fans = fans[:, ::-1]
    seen = ~np.isin(polygon, np.array(mesh.GetHoleIndicesAttr().Get(time) or [], dtype=np.int64))
    owners = np.repeat(np.arange(len(counts)), counts)
    return _Topology(points, fans[seen], polygon[seen], owners, len(counts))


def _read_materials(
    prim: Any, polygons: int, place: str
) -> tuple[Int64, tuple[BoundMaterial, ...]]:
    """Slot of every polygon, and the slots' materials: the mesh's, then its subsets'."""
    from pxr import UsdShade

    slots = np.zeros(polygons, dtype=np.int64)
    prims = [prim]
    for subset in UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets():
        faces = np.array(subset.GetIndicesAttr().Get() or [], dtype=np.int64)
        slots[faces[(faces >= 0) & (faces < polygons)]] = len(prims)
        prims.append(subset.GetPrim())
    used = set(np.unique(slots).tolist())
    return slots, tuple(
        read_bound_material(p, place) if k in used else PLAIN for k, p in enumerate(prims)
    )


def _read_uvs(
    prim: Any, topology: _Topology, face_slots: Int64, materials: tuple[BoundMaterial, ...]
) -> Array | None:
    """Texture coordinates by each triangle's material; None if no material has any."""
    uvs = np.zeros((len(topology.fans), 3, 2))
    found = False
    for slot, material in enumerate(materials):
        values = _read_primvar(prim, material.uv_name, topology) if material.has_images else None
        if values is not None:
            chosen = face_slots == slot
            linear = np.einsum("ij,...j->...i", material.uv_matrix[:, :2], values, optimize=False)
            uvs[chosen] = (linear + material.uv_matrix[:, 2])[topology.fans[chosen]]
            found = True
    return uvs if found else None


def _read_normals(mesh: Any, topology: _Topology) -> Array | None:
    from pxr import Usd

    values = _read_primvar(mesh.GetPrim(), "normals", topology)
    given = mesh.GetNormalsAttr().Get(Usd.TimeCode.EarliestTime())
    if values is None and given:
        directions = np.array(given, dtype=np.float64)
        if directions.ndim != 2:
            # Of another type than the schema's, as the type of an attribute may be.
            return None
        values = _expand_to_corners(directions, mesh.GetNormalsInterpolation(), topology)
    return None if values is None or values.shape[1] != 3 else np.asarray(values[topology.fans])


def _read_primvar(prim: Any, name: str, topology: _Topology) -> Array | None:
    """Values of a primvar per corner; None if it is missing or does not fit the mesh."""
    from pxr import Usd, UsdGeom

    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
    if not primvar or not primvar.HasValue():
        return None
    values = np.array(primvar.ComputeFlattened(Usd.TimeCode.EarliestTime()), dtype=np.float64)
    if values.ndim == 1:
        values = values[:, None]
    if values.ndim != 2 or not len(values):
        return None
    return _expand_to_corners(values, primvar.GetInterpolation(), topology)


def _expand_to_corners(values: Array, interpolation: str, topology: _Topology) -> Array | None:
    """Expand values per mesh, polygon, point or corner to corners; None if there are too few."""
    from pxr import UsdGeom

    tokens = UsdGeom.Tokens
    count = len(topology.points)
    if interpolation == tokens.faceVarying:
        index = np.arange(count)
    elif interpolation in (tokens.vertex, tokens.varying):
        index = topology.points
    elif interpolation == tokens.uniform:
        index = topology.owners
    else:
        index = np.zeros(count, dtype=np.int64)
    return values[index] if index.max() < len(values) else None
