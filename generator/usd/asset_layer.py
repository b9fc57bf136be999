"""Layer of one asset: its mesh and default materials."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gen_data.generator.core.asset_types import Float32, Material, MeshData
from gen_data.generator.usd.material_writer import BOX_UV, UV, TextureFinder, define_material
from gen_data.generator.usd.prims import open_stage_for_writing

MESH = "Mesh"
ASSET = "/Asset"
SLOT = "slot_"


def write_asset_layer(path: Path, mesh: MeshData, textures: TextureFinder) -> None:
    """Write the layer of an asset; its default prim holds a mesh in metres, Z up.

    Raises:
        StorageError: if it cannot be written.
    """
    with open_stage_for_writing(path, ASSET) as stage:
        _define_mesh(stage, f"{ASSET}/{MESH}", mesh)
        bind_materials(stage, f"{ASSET}/{MESH}", f"{ASSET}/Looks", mesh.materials, textures)


def bind_materials(
    stage: Any, mesh_path: str, scope: str, materials: Sequence[Material], textures: TextureFinder
) -> None:
    """Define the materials of a mesh's slots in a scope; bind them to the mesh and its subsets."""
    from pxr import Usd, UsdGeom, UsdShade

    mesh = stage.GetPrimAtPath(mesh_path)
    # All prims, because children of a class are abstract and filtered out by default.
    children = mesh.GetFilteredChildren(Usd.PrimAllPrimsPredicate)
    subsets = [child for child in children if child.IsA(UsdGeom.Subset)]
    parts = {int(part.GetName().removeprefix(SLOT)): part for part in subsets} or {0: mesh}
    UsdGeom.Scope.Define(stage, scope)
    for slot, part in parts.items():
        material = define_material(stage, f"{scope}/{SLOT}{slot}", materials[slot], textures)
        UsdShade.MaterialBindingAPI.Apply(part).Bind(material)
        if part is not mesh and slot == min(parts):
            # For readers without support for subsets.
            UsdShade.MaterialBindingAPI.Apply(mesh).Bind(material)


def _define_mesh(stage: Any, path: str, mesh: MeshData) -> None:
    from pxr import Sdf, UsdGeom, UsdShade, Vt

    prim = UsdGeom.Mesh.Define(stage, path)
    prim.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    prim.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(mesh.vertices_m)))
    prim.CreateFaceVertexCountsAttr(Vt.IntArray(len(mesh.faces), 3))
    prim.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(mesh.faces.ravel()))
    prim.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(mesh.normals)))
    prim.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    low, high = mesh.bounds_m()
    prim.CreateExtentAttr([low, high])
    primvars = UsdGeom.PrimvarsAPI(prim)
    for name, values, interpolation in (
        (UV, mesh.uvs, UsdGeom.Tokens.vertex),
        (BOX_UV, _box_uvs(mesh), UsdGeom.Tokens.faceVarying),
    ):
        kind = Sdf.ValueTypeNames.TexCoord2fArray
        primvar = primvars.CreatePrimvar(name, kind, interpolation)
        primvar.Set(Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(values)))
    slots = np.unique(mesh.face_slots).tolist()
    if slots != [0]:
        binding = UsdShade.MaterialBindingAPI.Apply(prim.GetPrim())
        for slot in slots:
            faces = np.flatnonzero(mesh.face_slots == slot).astype(np.int32)
            binding.CreateMaterialBindSubset(f"{SLOT}{slot}", Vt.IntArray.FromNumpy(faces))
        binding.SetMaterialBindSubsetsFamilyType(UsdGeom.Tokens.partition)


def _box_uvs(mesh: MeshData) -> Float32:
    """Planar coordinates [m] of all face corners, float32 [3 * m, 2], along the dominant axis.

    The renderer blends the three projections; here they switch per face, because USD has no
    triplanar node.
    """
    corners = mesh.vertices_m[mesh.faces]
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    axis = np.abs(crosses).argmax(axis=1)
    # X and Y faces keep Z upright.
    u, v = np.array([1, 0, 0])[axis], np.array([2, 2, 1])[axis]
    chosen = np.stack([u, v], axis=-1)[:, None, :]
    uvs: Float32 = np.take_along_axis(corners, chosen, axis=2).reshape(-1, 2).astype(np.float32)
    return uvs
