"""Colours, shapes, copies and labels of stages, as OpenUSD defines them."""

import io
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, UsdUtils, Vt

from gen_data.assets.asset_folder import Folder
from gen_data.assets.folder_index import MeshEntry
from gen_data.assets.importer import import_object
from gen_data.assets.library import open_library
from gen_data.assets.readers import MeshSource, read_mesh
from gen_data.assets.texture_maps import find_maps
from gen_data.assets.usd_stages import stage_model
from gen_data.core.errors import AssetError
from tests.usd import stages
from tests.usd.stages import add_reader, bind, surface

RED, BLUE = Gf.Vec3f(1, 0, 0), Gf.Vec3f(0, 0, 1)


def new_stage(folder: Path) -> Usd.Stage:
    stage = stages.new_stage(folder / "a.usda", "Z", 1.0)
    UsdGeom.Xform.Define(stage, "/W")
    return stage


def add_quads(stage: Usd.Stage, path: str = "/W/M") -> UsdGeom.Mesh:
    """Two squares side by side, without subdivision."""
    points = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0)]
    mesh = stages.add_mesh(stage, path, points, (0, 1, 4, 3), (1, 2, 5, 4))
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
    material, _ = surface(stage, "/W/Look", diffuseColor=(0, 0.5, 0))
    bind(bound, material)
    stage.Save()
    mesh = import_object(Folder(tmp_path), MeshEntry(file="a.usda"), "user/a").mesh
    assert mesh is not None
    shown = {m.base_color for m in mesh.materials}
    assert shown == {(0.85, 0.0, 0.0), (0.0, 0.5, 0.0)}
    stage = new_stage(tmp_path / "b")
    mesh = add_quads(stage)
    mesh.CreateDisplayColorPrimvar("uniform").Set([RED, BLUE])
    material, shader = surface(stage, "/W/Look")
    reader = add_reader(stage, "/W/Look/R", "float3", "displayColor")
    source = shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
    source.ConnectToSource(reader.ConnectableAPI(), "result")
    bind(mesh, material)
    colors = saved(stage, tmp_path / "b").soup.colors
    assert colors is not None
    assert colors[:, 0].tolist() == [[1, 0, 0], [1, 0, 0], [0, 0, 1], [0, 0, 1]]


@pytest.mark.parametrize("hides", ["opacity", "presence", "displayOpacity"])
def test_opacity_0_hides_and_glass_stays(tmp_path: Path, hides: str) -> None:
    """Glass is transparent too, but states its refractive index."""
    stage = new_stage(tmp_path)
    mesh = add_quads(stage)
    if hides == "displayOpacity":
        mesh.CreateDisplayOpacityPrimvar("constant").Set([0.0])
    else:
        presence = {"opacityMode": "presence", "ior": 1.5} if hides == "presence" else {}
        material, shader = surface(stage, "/W/Look", opacity=0.0, **presence)
        bind(mesh, material)
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


LIGHT, DARK = 200, 20
"""Texels of the left and the right half of an image."""


def linear(texel: int) -> float:
    """By IEC 61966-2-1, of sRGB in eight bits."""
    share = texel / 255.0
    return share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4


def textured(
    folder: Path,
    key: str,
    output: str,
    kind: Sdf.ValueTypeName,
    file: str = "a.png",
    **inputs: object,
) -> MeshSource:
    """Quads with a material whose input comes from an image with two halves."""
    pixels = np.full((8, 8, 3), LIGHT, np.uint8)
    pixels[:, 4:] = DARK
    if file.endswith("exr"):
        channels = {name: np.float32([[linear(v) for v in row] for row in pixels[..., 0]])
                    for name in "RGB"}  # fmt: skip
        OpenEXR.File({"type": OpenEXR.scanlineimage}, channels).write(str(folder / file))
    else:
        Image.fromarray(pixels).save(folder / file)
    stage = new_stage(folder)
    mesh = add_quads(stage)
    coordinates = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
        "st", Sdf.ValueTypeNames.TexCoord2fArray, "vertex"
    )
    coordinates.Set([(0, 0), (0.5, 0), (1, 0), (0, 1), (0.5, 1), (1, 1)])
    image = UsdShade.Shader.Define(stage, "/W/Image")
    image.CreateIdAttr("UsdUVTexture")
    image.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(file)
    for name, value in inputs.items():
        of = Sdf.ValueTypeNames.Token if name == "sourceColorSpace" else Sdf.ValueTypeNames.Float4
        image.CreateInput(name, of).Set(value)
    shader = bound_surface(stage, mesh)
    shader.CreateInput(key, kind).ConnectToSource(image.ConnectableAPI(), output)
    return saved(stage, folder)


def bound_surface(stage: Usd.Stage, mesh: UsdGeom.Mesh, purpose: str = "") -> UsdShade.Shader:
    material, shader = surface(stage, "/W/Paint")
    bind(mesh, material, purpose)
    return shader


def texels(found: MeshSource, channel: str = "albedo") -> list[list[int]]:
    """Middle texels of both halves of the image of a channel, as the reader gives it."""
    (material,) = (slot.material for slot in found.soup.slots if slot.material.texture)
    maps = find_maps(material.texture)
    name = getattr(maps, channel) if maps else material.texture
    pixels = np.asarray(Image.open(io.BytesIO(found.images[name.partition("!")[0]])))
    return [pixels[4, 1].tolist(), pixels[4, 6].tolist()]


@pytest.mark.parametrize(("inputs", "expected"), [
    ({"scale": (-1, -1, -1, 1), "bias": (1, 1, 1, 0)}, [255 - LIGHT, 255 - DARK]),
    ({"scale": (0.5, 0.5, 0.5, 1), "bias": (0.25, 0.25, 0.25, 0)}, [164, 74]),
    ({"sourceColorSpace": "sRGB"}, [round(255 * linear(LIGHT)), round(255 * linear(DARK))]),
])  # fmt: skip
def test_roughness_is_the_image_times_scale_plus_bias(
    tmp_path: Path, inputs: dict[str, object], expected: list[int]
) -> None:
    """Such as an image of glossiness, which is inverted; 0.5 x 200 + 0.25 x 255 is 163.75."""
    found = textured(tmp_path, "roughness", "r", Sdf.ValueTypeNames.Float, **inputs)
    assert [slot.material.roughness for slot in found.soup.slots if slot.material.texture] == [1.0]
    assert [row[0] for row in texels(found, "roughness")] == expected


def test_an_image_of_linear_colours_is_read_as_such(tmp_path: Path) -> None:
    """The linear value of an sRGB texel is the texel of the file; ``auto`` means sRGB here."""
    kind = Sdf.ValueTypeNames.Color3f
    found = textured(tmp_path, "diffuseColor", "rgb", kind, sourceColorSpace="raw")
    for row, texel in zip(texels(found), (LIGHT, DARK), strict=True):
        assert 255 * linear(row[0]) == pytest.approx(texel, abs=1.0)
    same = textured(tmp_path, "diffuseColor", "rgb", kind, sourceColorSpace="sRGB")
    assert not same.images
    assert [slot.material.texture for slot in same.soup.slots] == ["a.png"]


def test_colours_of_openexr_images_are_linear_also_in_archives(tmp_path: Path) -> None:
    """As texels of sRGB: inverted by scale and bias, next to a layer, and in a usdz."""
    kind = Sdf.ValueTypeNames.Color3f
    inverse = {"scale": (-1, -1, -1, 1), "bias": (1, 1, 1, 0)}
    inverted = textured(tmp_path, "diffuseColor", "rgb", kind, "a.exr", **inverse)
    for row, texel in zip(texels(inverted), (LIGHT, DARK), strict=True):
        assert linear(row[0]) == pytest.approx(1.0 - linear(texel), abs=0.005)
    (tmp_path / "props").mkdir()
    textured(tmp_path, "diffuseColor", "rgb", kind, "a.exr")
    assert UsdUtils.CreateNewUsdzPackage(
        str(tmp_path / "a.usda"), str(tmp_path / "props/packed.usdz")
    )
    textured(tmp_path / "props", "diffuseColor", "rgb", kind, "a.exr")
    library = open_library((tmp_path / "props",), tmp_path / "cache", tmp_path / "no packs")
    for name in ("user/a", "user/packed"):
        (texture,) = (m.texture for m in library.mesh(name).materials if m.texture)
        row = library.texture(texture).albedo[4, :, 0].tolist()
        assert row == [LIGHT] * 4 + [DARK] * 4


def test_an_image_of_normals_with_y_downwards_is_turned(tmp_path: Path) -> None:
    """Scale and bias (2, -2, 2) and (-1, 1, -1): green is inverted."""
    kind = Sdf.ValueTypeNames.Normal3f
    down = {"scale": (2, -2, 2, 1), "bias": (-1, 1, -1, 0)}
    found = textured(tmp_path, "normal", "rgb", kind, **down)
    assert texels(found, "normal") == [[t, 255 - t, t] for t in (LIGHT, DARK)]
    usual = {"scale": (2, 2, 2, 1), "bias": (-1, -1, -1, 0), "sourceColorSpace": "raw"}
    assert not textured(tmp_path, "normal", "rgb", kind, **usual).images


@pytest.mark.parametrize("purpose", ["preview", "full"])
def test_materials_that_are_bound_for_one_purpose_are_used(tmp_path: Path, purpose: str) -> None:
    stage = new_stage(tmp_path)
    shader = bound_surface(stage, add_quads(stage), purpose)
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(RED)
    (slot,) = saved(stage, tmp_path).soup.slots
    assert (slot.name, slot.material.base_color) == ("Paint", (1.0, 0.0, 0.0))


def test_the_fallback_of_a_missing_primvar_is_the_colour(tmp_path: Path) -> None:
    stage = new_stage(tmp_path)
    shader = bound_surface(stage, add_quads(stage))
    reader = add_reader(stage, "/W/Reader", "float3", "nowhere")
    reader.CreateInput("fallback", Sdf.ValueTypeNames.Float3).Set(BLUE)
    given = shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
    given.ConnectToSource(reader.ConnectableAPI(), "result")
    (slot,) = saved(stage, tmp_path).soup.slots
    assert slot.material.base_color == (0.0, 0.0, 1.0)


def test_holes_of_a_mesh_are_open_and_do_not_shift_colours_of_polygons(tmp_path: Path) -> None:
    """Of three squares in a row the middle one is a hole; the last one stays blue."""
    stage = new_stage(tmp_path)
    mesh = add_quads(stage)
    mesh.GetPointsAttr().Set([(x, y, 0) for y in (0, 1) for x in range(4)])
    mesh.GetFaceVertexCountsAttr().Set([4, 4, 4])
    mesh.GetFaceVertexIndicesAttr().Set([0, 1, 5, 4, 1, 2, 6, 5, 2, 3, 7, 6])
    mesh.CreateHoleIndicesAttr([1])
    mesh.CreateDisplayColorPrimvar("uniform").Set([RED, RED, BLUE])
    soup = saved(stage, tmp_path).soup
    assert soup.corners[..., 0].min(axis=1).tolist() == [0.0, 0.0, 2.0, 2.0]
    assert soup.colors is not None
    assert soup.colors[:, 0].tolist() == [list(RED), list(RED), list(BLUE), list(BLUE)]


def test_inputs_of_a_material_without_a_counterpart_are_named(tmp_path: Path) -> None:
    """Only where they have an effect: the colour of reflections in its own workflow."""
    stage = new_stage(tmp_path)
    shader = bound_surface(stage, add_quads(stage))
    shader.CreateInput("specularColor", Sdf.ValueTypeNames.Color3f).Set(RED)
    shader.CreateInput("displacement", Sdf.ValueTypeNames.Float).Set(0.0)
    assert saved(stage, tmp_path).remarks == ()
    shader.CreateInput("useSpecularWorkflow", Sdf.ValueTypeNames.Int).Set(1)
    shader.GetInput("displacement").Set(0.1)
    assert saved(stage, tmp_path).remarks == (
        "material 'Paint': specularColor is not used",
        "material 'Paint': displacement is not used",
    )


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
