"""Colours, shapes, copies and labels of stages, as OpenUSD defines them."""

from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, Vt

from gen_data.assets.asset_folder import Folder
from gen_data.assets.folder_index import MeshEntry
from gen_data.assets.importer import import_object
from gen_data.assets.readers import MeshSource, read_mesh
from gen_data.assets.usd_stages import stage_model
from gen_data.core.errors import AssetError

RED, BLUE = Gf.Vec3f(1, 0, 0), Gf.Vec3f(0, 0, 1)


def new_stage(folder: Path) -> Usd.Stage:
    stage = Usd.Stage.CreateNew(str(folder / "a.usda"))
    UsdGeom.SetStageUpAxis(stage, "Z")
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.Xform.Define(stage, "/W")
    return stage


def add_quads(stage: Usd.Stage, path: str = "/W/M") -> UsdGeom.Mesh:
    """Two squares side by side, without subdivision."""
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0)])
    mesh.CreateFaceVertexCountsAttr([4, 4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 4, 3, 1, 2, 5, 4])
    mesh.CreateSubdivisionSchemeAttr("none")
    return mesh


def saved(stage: Usd.Stage, folder: Path) -> MeshSource:
    stage.Save()
    return read_mesh(Folder(folder), "a.usda")


@pytest.mark.parametrize(
    ("interpolation", "values", "indices", "expected"),
    [("constant", [RED], None, [RED] * 4), ("uniform", [RED, BLUE], None, [RED, RED, BLUE, BLUE]),
     ("uniform", [RED, BLUE], [1, 0], [BLUE, BLUE, RED, RED]),
     ("vertex", [RED, RED, BLUE, RED, RED, BLUE], None, [RED, RED, RED, RED]),
     ("faceVarying", [BLUE] * 4 + [RED] * 4, None, [BLUE, BLUE, RED, RED])],
)  # fmt: skip
def test_display_colours_by_interpolation(
    tmp_path: Path, interpolation: str, values: list[Gf.Vec3f], indices: list[int] | None,
    expected: list[Gf.Vec3f],
) -> None:  # fmt: skip
    """The colour at the first corner of the four triangles."""
    stage = new_stage(tmp_path)
    primvar = add_quads(stage).CreateDisplayColorPrimvar(interpolation)
    primvar.Set(values)
    if indices:
        primvar.SetIndices(Vt.IntArray(indices))
    colors = saved(stage, tmp_path).soup.colors
    assert colors is not None
    assert colors[:, 0].tolist() == [list(color) for color in expected]


def test_display_colours_are_inherited_hidden_by_materials_or_used_by_them(tmp_path: Path) -> None:
    """/W is red; the second mesh has a green material. UsdPrimvarReader_float3 of displayColor."""
    stage = new_stage(tmp_path)
    add_quads(stage, "/W/A")
    bound = add_quads(stage, "/W/B")
    bound.AddTranslateOp().Set((0, 3, 0))
    primvars = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/W"))
    primvars.CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, "constant").Set([RED])
    material, shader = surface(stage)
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set((0, 0.5, 0))
    UsdShade.MaterialBindingAPI.Apply(bound.GetPrim()).Bind(material)
    stage.Save()
    mesh = import_object(Folder(tmp_path), MeshEntry(file="a.usda"), "user/a").mesh
    assert mesh is not None
    shown = {m.base_color for m in mesh.materials}
    assert shown == {(0.85, 0.0, 0.0), (0.0, 0.5, 0.0)}
    (tmp_path / "b").mkdir()
    stage = new_stage(tmp_path / "b")
    mesh = add_quads(stage)
    mesh.CreateDisplayColorPrimvar("uniform").Set([RED, BLUE])
    material, shader = surface(stage)
    reader = UsdShade.Shader.Define(stage, "/W/Look/R")
    reader.CreateIdAttr("UsdPrimvarReader_float3")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("displayColor")
    source = shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
    source.ConnectToSource(reader.ConnectableAPI(), "result")
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
    colors = saved(stage, tmp_path / "b").soup.colors
    assert colors is not None
    assert colors[:, 0].tolist() == [[1, 0, 0], [1, 0, 0], [0, 0, 1], [0, 0, 1]]


def surface(stage: Usd.Stage) -> tuple[UsdShade.Material, UsdShade.Shader]:
    material = UsdShade.Material.Define(stage, "/W/Look")
    shader = UsdShade.Shader.Define(stage, "/W/Look/S")
    shader.CreateIdAttr("UsdPreviewSurface")
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    return material, shader


@pytest.mark.parametrize("hides", ["opacity", "presence", "displayOpacity"])
def test_opacity_0_hides_and_glass_stays(tmp_path: Path, hides: str) -> None:
    """Glass is transparent too, but states its refractive index."""
    stage = new_stage(tmp_path)
    mesh = add_quads(stage)
    if hides == "displayOpacity":
        mesh.CreateDisplayOpacityPrimvar("constant").Set([0.0])
    else:
        material, shader = surface(stage)
        shader.CreateInput("opacity", Sdf.ValueTypeNames.Float).Set(0.0)
        if hides == "presence":
            shader.CreateInput("opacityMode", Sdf.ValueTypeNames.Token).Set("presence")
            shader.CreateInput("ior", Sdf.ValueTypeNames.Float).Set(1.5)
        UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
    stage.Save()
    entry = MeshEntry(file="a.usda")
    with pytest.raises(AssetError, match="fully transparent"):
        import_object(Folder(tmp_path), entry, "user/a")
    if hides == "opacity":
        shader.CreateInput("ior", Sdf.ValueTypeNames.Float).Set(1.5)
        stage.Save()
        glass = import_object(Folder(tmp_path), entry, "user/a").mesh
        assert glass is not None
        assert glass.materials[0].transmission == 1.0


def area_and_size(source: MeshSource) -> tuple[float, list[float]]:
    corners = source.soup.corners
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    volume = float((corners[:, 0] * np.cross(corners[:, 1], corners[:, 2])).sum()) / 6.0
    assert volume >= 0.0, "triangles wind outwards"
    area = float(np.linalg.norm(crosses, axis=1).sum()) / 2.0
    return area, np.ptp(corners.reshape(-1, 3), axis=0).tolist()


@pytest.mark.parametrize(
    ("kind", "attributes", "area", "size"),
    [("Cube", {"size": 2.0}, 24.0, [2, 2, 2]), ("Sphere", {"radius": 0.5}, np.pi, [1, 1, 1]),
     ("Cylinder", {"radius": 0.5, "height": 2.0, "axis": "X"}, 2.5 * np.pi, [2, 1, 1]),
     ("Cone", {"radius": 3.0, "height": 4.0, "axis": "Z"}, 24.0 * np.pi, [6, 6, 4]),
     ("Capsule", {"radius": 0.5, "height": 1.0, "axis": "Y"}, 2.0 * np.pi, [1, 2, 1]),
     ("Plane", {"width": 2.0, "length": 3.0, "axis": "Z"}, 6.0, [2, 3, 0])],
)  # fmt: skip
def test_primitive_shapes_have_their_area_and_size(
    tmp_path: Path, kind: str, attributes: dict[str, object], area: float, size: list[float]
) -> None:
    """Round ones to the 2 % of their 32 sides."""
    stage = new_stage(tmp_path)
    prim = stage.DefinePrim("/W/P", kind)
    for name, value in attributes.items():
        prim.GetAttribute(name).Set(value)
    UsdGeom.Gprim(prim).CreateDisplayColorPrimvar("constant").Set([RED])
    source = saved(stage, tmp_path)
    found, extent = area_and_size(source)
    assert found == pytest.approx(area, rel=0.02)
    assert extent == pytest.approx(size, rel=0.01)
    assert source.soup.colors is not None
    assert source.soup.colors[0, 0].tolist() == [1, 0, 0]


def test_copies_of_an_instancer_are_placed_and_masked(tmp_path: Path) -> None:
    """Two prototypes, four copies, of which one is masked; prototypes alone are not shown."""
    stage = new_stage(tmp_path)
    instancer = UsdGeom.PointInstancer.Define(stage, "/W/I")
    UsdGeom.Cube.Define(stage, "/W/I/Protos/Box").CreateSizeAttr(1.0)
    big = UsdGeom.Cube.Define(stage, "/W/I/Protos/Big")
    big.CreateSizeAttr(1.0)
    big.AddScaleOp().Set((2, 2, 2))
    instancer.CreatePrototypesRel().SetTargets(["/W/I/Protos/Box", "/W/I/Protos/Big"])
    instancer.CreateProtoIndicesAttr([0, 1, 0, 0])
    instancer.CreatePositionsAttr([(0, 0, 0), (10, 0, 0), (20, 0, 0), (90, 0, 0)])
    instancer.DeactivateId(3)
    stage.Save()
    model = stage_model(Folder(tmp_path), MeshEntry(file="a.usda"), "user/a")
    assert [p.T_stage_piece.translation_m[0] for p in model.pieces] == [0.0, 10.0, 20.0]
    corners = read_mesh(Folder(tmp_path), "a.usda").soup.corners
    assert len(corners) == 3 * 12
    assert corners.reshape(-1, 3).min(axis=0).tolist() == [-0.5, -1, -1]
    assert corners.reshape(-1, 3).max(axis=0).tolist() == [20.5, 1, 1]


@pytest.mark.parametrize("name", ["Semantics", "Semantics_a1"])
def test_labels_of_older_stages(tmp_path: Path, name: str) -> None:
    """``semantic:...:params:semanticData`` of Isaac Sim up to 4, also on an ancestor."""
    stage = new_stage(tmp_path)
    add_quads(stage)
    prim = stage.GetPrimAtPath("/W")
    text = Sdf.ValueTypeNames.String
    prim.CreateAttribute(f"semantic:{name}:params:semanticType", text).Set("class")
    prim.CreateAttribute(f"semantic:{name}:params:semanticData", text).Set("cup")
    stage.Save()
    (piece,) = stage_model(Folder(tmp_path), MeshEntry(file="a.usda"), "user/a").pieces
    assert (piece.thing, piece.category) == ("W", "cup")


def test_what_a_stage_holds_and_is_not_used_is_named(tmp_path: Path) -> None:
    """Subdivision, curves, and points that move."""
    stage = new_stage(tmp_path)
    mesh = add_quads(stage)
    mesh.GetSubdivisionSchemeAttr().Set("catmullClark")
    points = mesh.GetPointsAttr()
    points.Set(points.Get(), 1.0)
    points.Set([p + Gf.Vec3f(0, 0, 1) for p in points.Get(1.0)], 2.0)
    UsdGeom.BasisCurves.Define(stage, "/W/C")
    remarks = saved(stage, tmp_path).remarks
    assert remarks == (
        "BasisCurves is not read, such as /W/C",
        "subdivision surfaces (catmullClark) are read as their cages",
        "points that move over time are read at the earliest time",
    )
