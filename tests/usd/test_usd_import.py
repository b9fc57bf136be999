"""Stages as assets: import matches OpenUSD's own files, and bad files have distinct errors."""

import zipfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade, UsdUtils

from gen_data.assets.library import Library, open_library
from gen_data.core.capture import Channel
from gen_data.core.errors import AssetError
from gen_data.core.scene import Scene
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.scene_templates.usd_stage import UsdStage
from tests.usd.stages import add_mesh, add_reader, bind, new_stage, surface
from tests.usd.worlds import exported, table_world

QUAD = [(0, 0, 0), (100, 0, 0), (100, 50, 0), (0, 50, 0)]


def opened_library(folder: Path, *roots: Path) -> Library:
    return open_library(roots, cache_dir=folder / "cache", packs=Path("/nonexistent"))


def add_quad(stage: Usd.Stage, path: str) -> UsdGeom.Mesh:
    """A rectangle of 1 m x 0.5 m in the plane Z = 0."""
    return add_mesh(stage, path, QUAD, (0, 1, 2, 3))


def textured(stage: Usd.Stage, path: str, image: str) -> UsdShade.Material:
    """A material whose colour is half of an image, looked up by the primvar ``map``."""
    material, shader = surface(stage, path)
    reader = add_reader(stage, f"{path}/R", "float2", "map")
    node = UsdShade.Shader.Define(stage, f"{path}/T")
    node.CreateIdAttr("UsdUVTexture")
    node.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(image)
    node.CreateInput("scale", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(0.5, 0.5, 0.5, 1))
    st = node.CreateInput("st", Sdf.ValueTypeNames.Float2)
    st.ConnectToSource(reader.ConnectableAPI(), "result")
    color = shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
    color.ConnectToSource(node.ConnectableAPI(), "rgb")
    return material


@pytest.mark.slow
def test_an_exported_world_comes_back_with_its_lights_and_cameras(tmp_path: Path) -> None:
    """The same camera sees the same objects: label images agree to more than 99 %."""
    library = opened_library(tmp_path)
    world = table_world(library)
    root = exported(world, library, tmp_path / "out").parent
    again = opened_library(tmp_path / "again", root)
    element = UsdStage(name="copy", asset="user/000000000", annotate=True)
    scene = element.add(Scene("empty", cameras=world.cameras), again)
    (camera,) = world.cameras
    wanted = frozenset({Channel.INSTANCE, Channel.Z_DEPTH})
    first = WarpRenderer(library, "cpu").render(world, camera, wanted).channels
    second = WarpRenderer(again, "cpu").render(scene, camera, wanted).channels
    names = {i.instance_id: i.name for i in world.instances}
    assert [i.category for i in scene.instances] == [i.category for i in world.instances]
    for instance in scene.instances:
        name = instance.name.removeprefix("copy/World_").replace("clutter_", "clutter/")
        number = next(k for k, v in names.items() if v == name)
        one, other = (
            first[Channel.INSTANCE] == number,
            second[Channel.INSTANCE] == instance.instance_id,
        )
        assert one.sum() > 100
        assert (one & other).sum() / (one | other).sum() > 0.99
    both = np.isfinite(first[Channel.Z_DEPTH]) & np.isfinite(second[Channel.Z_DEPTH])
    depth = abs(first[Channel.Z_DEPTH][both] - second[Channel.Z_DEPTH][both])
    assert both.mean() > 0.5 and np.quantile(depth, 0.99) < 1e-4
    # Intensities, colours, cones and poses, turned with the element; cameras become rigs.
    element = UsdStage(name="copy", asset="user/000000000", cameras=True)
    scene = element.add(Scene("empty"), again)
    by_kind = {light.kind: light for light in scene.lights}
    for light in world.lights:
        copy = by_kind[light.kind]
        luminance = 0.2126 * light.color[0] + 0.7152 * light.color[1] + 0.0722 * light.color[2]
        assert copy.intensity_cd == pytest.approx(light.intensity_cd * luminance, rel=1e-5)
        assert copy.illuminance_lux == pytest.approx(light.illuminance_lux, rel=1e-5)
        assert copy.color == pytest.approx([c / luminance for c in light.color], rel=1e-5)
        if light.kind != "sun":
            assert copy.position_m == pytest.approx(light.position_m)
            assert copy.radius_m == pytest.approx(light.radius_m)
        if light.kind != "sphere":
            assert copy.direction == pytest.approx(light.direction, abs=1e-6)
    panel = by_kind["rectangle"]
    assert panel.size_m == pytest.approx((0.8, 0.4))
    assert panel.side == pytest.approx((0.8, 0.48, -0.36), abs=1e-6)
    spot = by_kind["spot"]
    assert (spot.cone_rad, spot.even) == pytest.approx((0.6, 0.8))
    axes = scene.rig_pose("copy/World_Cameras_color").rotation()
    camera = world.cameras[0].T_world_camera
    # X along the camera's axis, Y to its left, Z up in its image.
    expected = camera.rotation() @ np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]])
    assert axes == pytest.approx(expected, abs=1e-6)
    place = scene.rig_pose("copy/World_Cameras_color").translation_m
    assert place == pytest.approx(camera.translation_m, abs=1e-6)


def test_units_axes_subsets_and_materials_are_read(tmp_path: Path) -> None:
    """Centimetres, Y up: a wall of 1 m x 0.5 m; each half has its own material."""
    stage = new_stage(tmp_path / "props/wall.usda")
    mesh = add_mesh(stage, "/Wall/Mesh", QUAD, (0, 1, 2), (0, 2, 3))
    UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
        "map", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex
    ).Set([(0, 0), (2, 0), (2, 1), (0, 1)])
    Image.fromarray(np.full((4, 4, 3), (200, 10, 10), np.uint8)).save(tmp_path / "props/red.png")
    looks = {"metallic": 1.0, "roughness": 0.25, "diffuseColor": (0.9, 0.8, 0.7)}
    metal, _ = surface(stage, "/Wall/Metal", **looks)
    binding = UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim())
    for k, material in enumerate((metal, textured(stage, "/Wall/Red", "./red.png"))):
        part = binding.CreateMaterialBindSubset(f"part{k}", [k])
        bind(part, material)
    stage.Save()
    library = opened_library(tmp_path, tmp_path / "props")
    read = library.mesh("user/wall")
    low, high = read.bounds_m()
    assert np.subtract(high, low) == pytest.approx([1.0, 0.0, 0.5], abs=1e-6)
    slots = {m.metallic: (k, m) for k, m in enumerate(read.materials)}
    assert slots[1.0][1].base_color == pytest.approx((0.9, 0.8, 0.7))
    assert slots[1.0][1].roughness == 0.25
    k, red = slots[0.0]
    assert red.base_color == pytest.approx((0.5, 0.5, 0.5))
    assert library.texture(red.texture).albedo[0, 0].tolist() == [200, 10, 10]
    corners = read.faces[read.face_slots == k].ravel()
    assert read.uvs[corners].max(axis=0) == pytest.approx([2.0, 1.0])


def save_part(path: Path) -> None:
    """A layer to refer to, with one quad."""
    part = new_stage(path)
    add_quad(part, "/Quad/Mesh")
    part.SetDefaultPrim(part.GetPrimAtPath("/Quad"))
    part.Save()


def test_instances_transforms_and_references_are_followed(tmp_path: Path) -> None:
    """Two instances of a layer in a subfolder, one turned and scaled, one hidden."""
    save_part(tmp_path / "props/parts/quad.usdc")
    stage = new_stage(tmp_path / "props/pair.usdc")
    for k, name in enumerate(("a", "b", "hidden")):
        prim = UsdGeom.Xform.Define(stage, f"/World/{name}")
        prim.GetPrim().GetReferences().AddReference("./parts/quad.usdc")
        prim.GetPrim().SetInstanceable(True)
        prim.AddTranslateOp().Set((0.0, 100.0 * k, 0.0))
        prim.AddScaleOp().Set((1.0 + k, 1.0, 1.0))
    UsdGeom.Imageable(stage.GetPrimAtPath("/World/hidden")).MakeInvisible()
    stage.Save()
    library = opened_library(tmp_path, tmp_path / "props")
    model = library.stage("user/pair")
    assert [p.name for p in model.pieces] == ["World_a_Mesh", "World_b_Mesh"]
    # Centres: (50, 25) and (100, 125) cm; Y becomes Z.
    assert model.pieces[0].T_stage_piece.translation_m == pytest.approx((0.5, 0.0, 0.25))
    assert model.pieces[1].T_stage_piece.translation_m == pytest.approx((1.0, 0.0, 1.25))
    _, high = library.bounds_m(model.pieces[1].asset)
    assert high == pytest.approx((1.0, 0.0, 0.25), abs=1e-6)


def test_an_archive_brings_its_images(tmp_path: Path) -> None:
    """A usdz file is read without any other file."""
    Image.fromarray(np.full((4, 4, 3), (10, 200, 10), np.uint8)).save(tmp_path / "green.png")
    stage = new_stage(tmp_path / "leaf.usda")
    mesh = add_quad(stage, "/Leaf")
    bind(mesh, textured(stage, "/M", "./green.png"))
    stage.Save()
    (tmp_path / "props").mkdir()
    assert UsdUtils.CreateNewUsdzPackage(
        str(tmp_path / "leaf.usda"), str(tmp_path / "props/leaf.usdz")
    )
    library = opened_library(tmp_path, tmp_path / "props")
    for asset in ("user/leaf", library.stage("user/leaf").pieces[0].asset):
        (material,) = library.materials(asset)
        assert library.texture(material.texture).albedo[0, 0].tolist() == [10, 200, 10]


def broken(folder: Path, kind: str) -> None:
    stage = new_stage(folder / "bad.usda")
    if kind == "no mesh":
        UsdLux.SphereLight.Define(stage, "/Lamp")
    elif kind == "radius is -1":
        UsdGeom.Sphere.Define(stage, "/Ball").CreateRadiusAttr(-1.0)
    else:
        mesh = add_quad(stage, "/Quad")
        if kind == "is missing":
            bind(mesh, textured(stage, "/M", "./nowhere.png"))
        elif kind == "UsdPreviewSurface":
            bind(mesh, UsdShade.Material.Define(stage, "/M"))
        elif kind.startswith("roughness"):
            roughness = float(kind.rstrip(",").split()[-1])
            bind(mesh, surface(stage, "/M", roughness=roughness)[0])
        elif kind == "inconsistent":
            mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 9])
        elif kind == "No such file":
            stage.GetRootLayer().subLayerPaths.append("./lost.usda")
        elif kind == "outside":
            stage.GetRootLayer().subLayerPaths.append("../outside.usda")
        elif kind == "in an archive outside":
            stage.GetRootLayer().subLayerPaths.append("../outside.usdz[outside.usda]")
    stage.Save()
    if kind == "unreadable USD":
        (folder / "bad.usda").write_text('#usda 1.0\ndef Mesh "M" {\n  point3f[] points = [(1,\n')
    elif kind == "compressed":
        (folder / "bad.usda").unlink()
        with zipfile.ZipFile(folder / "bad.usdz", "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("bad.usda", "#usda 1.0\n" * 100)


@pytest.mark.hostile
@pytest.mark.parametrize(
    "fault",
    ["no mesh", "radius is -1", "is missing", "UsdPreviewSurface", "roughness is 1.5,",
     "roughness is -0.5,", "inconsistent", "No such file", "outside", "in an archive outside",
     "unreadable USD", "compressed"],
)  # fmt: skip
def test_bad_stages_are_told(fault: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """The file is named, the fault and the remedy; the library behind prints nothing."""
    (tmp_path / "outside.usda").write_text("#usda 1.0\n")
    broken(tmp_path / "props", fault)
    capfd.readouterr()
    library = opened_library(tmp_path, tmp_path / "props")
    with pytest.raises(AssetError, match=fault.removeprefix("in an archive ")) as raised:
        library.mesh("user/bad")
    assert "props/" in str(raised.value) and ";" in str(raised.value)
    out, err = capfd.readouterr()
    assert (out, err) == ("", "")


def test_bytes_that_are_no_crate_file_are_refused(tmp_path: Path) -> None:
    stage = new_stage(tmp_path / "whole.usdc")
    add_quad(stage, "/Quad")
    stage.Save()
    data = (tmp_path / "whole.usdc").read_bytes()
    (tmp_path / "props").mkdir()
    (tmp_path / "props/half.usdc").write_bytes(data[: len(data) // 2])
    (tmp_path / "props/noise.usdc").write_bytes(data[:8] + bytes(range(256)) * 4)
    (tmp_path / "props/word.usda").write_text("hello")
    (tmp_path / "props/open.usda").write_text('#usda 1.0\ndef Mesh "a" {\n  {{\n')
    library = opened_library(tmp_path, tmp_path / "props")
    for name, cause in (
        ("half", "damaged or cut off"),
        ("noise", "damaged or cut off"),
        ("word", "its content is not USD"),
        ("open", "syntax error at line 3"),
    ):
        with pytest.raises(AssetError, match=rf"unreadable USD.* \({cause}"):
            library.mesh(f"user/{name}")


def test_what_a_stage_refers_to_belongs_to_its_content(tmp_path: Path) -> None:
    """A changed layer below is another asset."""
    save_part(tmp_path / "props/parts/quad.usda")
    stage = new_stage(tmp_path / "props/one.usda")
    UsdGeom.Xform.Define(stage, "/W").GetPrim().GetReferences().AddReference("./parts/quad.usda")
    stage.Save()
    before = opened_library(tmp_path, tmp_path / "props").get("user/one").sha256
    text = (tmp_path / "props/parts/quad.usda").read_text()
    (tmp_path / "props/parts/quad.usda").write_text(text.replace("100", "120"))
    assert opened_library(tmp_path, tmp_path / "props").get("user/one").sha256 != before


@pytest.mark.hostile
@pytest.mark.parametrize(
    ("attribute", "value", "said"),
    [("inputs:intensity", float("nan"), "has intensity nan"),
     ("inputs:intensity", -3.0, "has intensity -"),
     ("inputs:color", (-0.5, 1.0, 1.0), "has color -"),
     ("inputs:color", (float("inf"), 1.0, 1.0), "light 'Panel'"),
     ("inputs:width", -1.0, "light 'Panel' has"), ("inputs:width", 0.0, "has no area"),
     ("inputs:height", float("nan"), "light 'Panel' has")],
)  # fmt: skip
def test_an_impossible_light_of_a_stage_is_refused(
    tmp_path: Path, attribute: str, value: object, said: str
) -> None:
    stage = new_stage(tmp_path / "props/s.usda")
    add_quad(stage, "/Quad")
    panel = UsdLux.RectLight.Define(stage, "/Panel")
    panel.GetPrim().GetAttribute(attribute).Set(value)
    stage.GetRootLayer().Save()
    with pytest.raises(AssetError, match=r"s\.usda: .*") as refused:
        opened_library(tmp_path, tmp_path / "props").stage("user/s")
    assert said in str(refused.value)


def test_normalised_panels_of_any_size_and_scaled_stages_keep_their_light(tmp_path: Path) -> None:
    """UsdLux: intensity 500, normalised, is 500 cd from 0.1 m^2 or 4 m^2 alike."""
    stage = new_stage(tmp_path / "props/s.usda")
    add_quad(stage, "/Quad")
    for name, width in (("A", 0.5), ("B", 20.0)):
        panel = UsdLux.RectLight.Define(stage, f"/{name}")
        panel.CreateWidthAttr(width)
        panel.CreateNormalizeAttr(True)
        panel.CreateIntensityAttr(500.0)
    stage.GetRootLayer().Save()
    lights = opened_library(tmp_path, tmp_path / "props").stage("user/s").lights
    assert [light.intensity_cd for light in lights] == pytest.approx([500.0, 500.0])
    # Twice as large: lamps twice as far away light as brightly as before.
    stage = new_stage(tmp_path / "scaled/s.usda", "Z", 1.0)
    add_quad(stage, "/Quad")
    lamp = UsdLux.SphereLight.Define(stage, "/Lamp")
    lamp.CreateRadiusAttr(0.1)
    lamp.CreateIntensityAttr(1000.0)
    lamp.AddTranslateOp().Set((0.0, 0.0, 3.0))
    stage.Save()
    index = "assets:\n  - {id: s, file: s.usda, category: room, scale: 0.02}\n"
    (tmp_path / "scaled/assets.yaml").write_text(index)
    (light,) = opened_library(tmp_path, tmp_path / "scaled").stage("user/s").lights
    assert (light.kind, light.position_m) == ("sphere", pytest.approx((0.0, 0.0, 0.06)))
    # 1000 nits of a disc of 0.1 m, at 1 / 50 of the distance.
    assert light.intensity_cd == pytest.approx(1000.0 * np.pi * 0.01 / 2500.0)
