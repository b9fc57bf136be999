"""Small stages to import: meshes, and materials of the preview surface."""

from collections.abc import Sequence
from pathlib import Path

from pxr import Sdf, Usd, UsdGeom, UsdShade


def new_stage(path: Path, up: str = "Y", metres: float = 0.01) -> Usd.Stage:
    """An empty stage; by default with the units of OpenUSD."""
    path.parent.mkdir(parents=True, exist_ok=True)
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, up)
    UsdGeom.SetStageMetersPerUnit(stage, metres)
    return stage


def add_mesh(
    stage: Usd.Stage, path: str, points: Sequence[tuple[int, ...]], *faces: tuple[int, ...]
) -> UsdGeom.Mesh:
    """A mesh of the corners of each face."""
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(points)
    mesh.CreateFaceVertexCountsAttr([len(face) for face in faces])
    mesh.CreateFaceVertexIndicesAttr([corner for face in faces for corner in face])
    return mesh


def surface(
    stage: Usd.Stage, path: str, **inputs: object
) -> tuple[UsdShade.Material, UsdShade.Shader]:
    """A material of a preview surface: numbers, colours (tuples) and words among its inputs."""
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/S")
    shader.CreateIdAttr("UsdPreviewSurface")
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    kinds = {float: "Float", tuple: "Color3f", str: "Token"}
    for name, value in inputs.items():
        shader.CreateInput(name, getattr(Sdf.ValueTypeNames, kinds[type(value)])).Set(value)
    return material, shader


def add_reader(stage: Usd.Stage, path: str, kind: str, varname: str) -> UsdShade.Shader:
    """A node that looks a primvar up: ``float2`` or ``float3``."""
    reader = UsdShade.Shader.Define(stage, path)
    reader.CreateIdAttr(f"UsdPrimvarReader_{kind}")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set(varname)
    return reader


def bind(mesh: UsdGeom.Mesh, material: UsdShade.Material, purpose: str = "") -> None:
    """For all purposes, unless one is given."""
    binding = UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim())
    binding.Bind(material, materialPurpose=purpose)
