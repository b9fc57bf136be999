"""Layer of one asset: its mesh and default materials.

Materials are UsdPreviewSurface networks (specification version 2.6).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gen_data.core.asset_types import Float32, Material, MeshData
from gen_data.usd.prims import open_stage_for_writing

MESH = "Mesh"
ASSET = "/Asset"
SLOT = "slot_"
UV, BOX_UV = "st", "stBox"
"""Primvars of a mesh's texture coordinates, and of those [m] that replace triplanar mapping."""


@dataclass(frozen=True, slots=True)
class TextureFiles:
    """Image paths of a texture, relative to the current layer; empty = none.

    Attributes:
        shares: Occlusion in red, metallic in blue.
        alpha: Coverage; values below one half are holes.
    """

    albedo: str
    roughness: str = ""
    normal: str = ""
    shares: str = ""
    emission: str = ""
    alpha: str = ""


TextureFinder = Callable[[str], TextureFiles]


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
        material = _define_material(stage, f"{scope}/{SLOT}{slot}", materials[slot], textures)
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


def _define_material(stage: Any, path: str, material: Material, textures: TextureFinder) -> Any:
    """Define a material with its network; return the ``UsdShade.Material``."""
    from pxr import Sdf, UsdShade

    shade = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/Surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("useSpecularWorkflow", Sdf.ValueTypeNames.Int).Set(0)
    number = Sdf.ValueTypeNames.Float
    ior = material.ior if material.transmission else _refractive_index(material.specular)
    shader.CreateInput("metallic", number).Set(material.metallic)
    shader.CreateInput("ior", number).Set(ior)
    if any(material.emission_cd_m2):
        glow = shader.CreateInput("emissiveColor", Sdf.ValueTypeNames.Color3f)
        glow.Set(material.emission_cd_m2)
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(material.base_color)
    shader.CreateInput("roughness", number).Set(material.roughness)
    _define_layers(shader, material)
    if material.texture:
        _connect_images(shader, _Images(stage, path, material), textures(material.texture))
    shade.CreateSurfaceOutput().ConnectToSource(
        shader.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    )
    return shade


def _define_layers(shader: Any, material: Material) -> None:
    """Define coat, transmission and opacity where the material has them."""
    from pxr import Sdf

    number = Sdf.ValueTypeNames.Float
    if material.coat:
        shader.CreateInput("clearcoat", number).Set(material.coat)
        shader.CreateInput("clearcoatRoughness", number).Set(material.coat_roughness)
    if material.opacity < 1.0:
        shader.CreateInput("opacityMode", Sdf.ValueTypeNames.Token).Set("presence")
        shader.CreateInput("opacity", number).Set(material.opacity)
    elif material.transmission:
        shader.CreateInput("opacity", number).Set(1.0 - material.transmission)


def _connect_images(shader: Any, images: "_Images", files: TextureFiles) -> None:
    """Connect images; the inputs' constant values become the images' scale factors."""
    from pxr import Gf, Sdf

    def connect(name: str, node: Any, output: str) -> None:
        kind = Sdf.ValueTypeNames.Float if len(output) == 1 else Sdf.ValueTypeNames.Float3
        given = shader.GetInput(name)
        given.GetAttr().Clear()
        given.ConnectToSource(node.CreateOutput(output, kind))

    def factor(name: str) -> Any:
        return shader.GetInput(name).Get()

    albedo = images.add("Albedo", files.albedo, "sRGB", (*factor("diffuseColor"), 1.0))
    connect("diffuseColor", albedo, "rgb")
    if files.roughness:
        node = images.add("Roughness", files.roughness, "raw", (factor("roughness"),) * 4)
        connect("roughness", node, "r")
    if files.shares:
        node = images.add("Shares", files.shares, "raw", (1.0, 1.0, factor("metallic"), 1.0))
        connect("metallic", node, "b")
        shader.CreateInput("occlusion", Sdf.ValueTypeNames.Float)
        connect("occlusion", node, "r")
    if files.emission and shader.GetInput("emissiveColor"):
        node = images.add("Emission", files.emission, "sRGB", (*factor("emissiveColor"), 1.0))
        connect("emissiveColor", node, "rgb")
    if files.normal:
        node = images.add("Normal", files.normal, "raw", (2.0, 2.0, 2.0, 1.0))
        node.CreateInput("bias", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(-1.0, -1.0, -1.0, 0.0))
        shader.CreateInput("normal", Sdf.ValueTypeNames.Normal3f)
        connect("normal", node, "rgb")
    if files.alpha:
        node = images.add("Alpha", files.alpha, "raw", (1.0,) * 4)
        shader.CreateInput("opacity", Sdf.ValueTypeNames.Float)
        connect("opacity", node, "r")
        shader.CreateInput("opacityThreshold", Sdf.ValueTypeNames.Float).Set(0.5)


class _Images:
    """Texture nodes of one material, which share their coordinates."""

    def __init__(self, stage: Any, path: str, material: Material) -> None:
        from pxr import Sdf, UsdShade

        self._stage, self._path = stage, path
        boxed = material.texture_scale_m > 0.0
        reader = UsdShade.Shader.Define(stage, f"{path}/Coordinates")
        reader.CreateIdAttr("UsdPrimvarReader_float2")
        name = BOX_UV if boxed else UV
        reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set(name)
        self._uvs = reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
        if boxed:
            scale = UsdShade.Shader.Define(stage, f"{path}/Repeats")
            scale.CreateIdAttr("UsdTransform2d")
            scale.CreateInput("in", Sdf.ValueTypeNames.Float2).ConnectToSource(self._uvs)
            repeats = 1.0 / material.texture_scale_m
            scale.CreateInput("scale", Sdf.ValueTypeNames.Float2).Set((repeats, repeats))
            self._uvs = scale.CreateOutput("result", Sdf.ValueTypeNames.Float2)

    def add(self, name: str, file: str, space: str, factors: tuple[float, ...]) -> Any:
        from pxr import Sdf, UsdShade

        node = UsdShade.Shader.Define(self._stage, f"{self._path}/{name}")
        node.CreateIdAttr("UsdUVTexture")
        node.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(file)
        node.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set(space)
        node.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(self._uvs)
        node.CreateInput("scale", Sdf.ValueTypeNames.Float4).Set(factors)
        for axis in ("wrapS", "wrapT"):
            node.CreateInput(axis, Sdf.ValueTypeNames.Token).Set("repeat")
        return node


def _refractive_index(specular: float) -> float:
    """Refractive index whose reflectance at normal incidence is ``0.08 * specular``.

    Source: Fresnel at normal incidence, F0 = ((n - 1) / (n + 1))^2, solved for n.
    """
    root = math.sqrt(0.08 * specular)
    return (1.0 + root) / (1.0 - root)
