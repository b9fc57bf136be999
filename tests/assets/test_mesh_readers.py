"""File formats: content is read as the files state it."""

import base64
import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from gen_data.assets.asset_folder import Folder
from gen_data.assets.library import open_library
from gen_data.assets.readers import read_mesh
from gen_data.assets.triangle_soup import box, sphere
from tests.assets.gltf_builder import Builder

CUBE_OBJ = """mtllib cube.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 1 0 1
v 1 1 1
v 0 1 1
usemtl red
f 4 3 2 1
f 5 6 7 8
usemtl shiny
f -8 -7 -3 -4
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
"""


def test_obj_polygons_negative_indices_and_materials(tmp_path: Path) -> None:
    """Quads become two triangles; -8 of 8 vertices is the first."""
    (tmp_path / "cube.obj").write_text(CUBE_OBJ)
    (tmp_path / "cube.mtl").write_text(
        "newmtl red\nKd 1 0 0\nNs 0\nnewmtl shiny\nKd 0.5 0.5 0.5\nPr 0.1\nPm 1\n"
    )
    soup = read_mesh(Folder(tmp_path), "cube.obj").soup
    assert len(soup) == 12
    front = soup.corners[4:6].reshape(-1, 3)
    assert set(front[:, 1].tolist()) == {0.0}
    used = {soup.slots[k].name: soup.slots[k].material for k in np.unique(soup.face_slots)}
    assert used["red"].base_color == (1.0, 0.0, 0.0)
    # IEC 61966-2-1: sRGB 0.5 is linear 0.2140.
    assert used["shiny"].base_color == pytest.approx((0.2140,) * 3, abs=1e-4)
    assert (used["shiny"].roughness, used["shiny"].metallic) == (0.1, 1.0)


def test_obj_groups_follow_its_objects_and_texture_options_odd_line_ends(tmp_path: Path) -> None:
    """Two ``o`` statements are two groups."""
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\no a\nf 1 2 3\no b\nf 1 3 2\n"
    (tmp_path / "two.obj").write_text(text)
    assert len(set(read_mesh(Folder(tmp_path), "two.obj").soup.face_groups.tolist())) == 2
    # ``-s 2 2 1`` before the file name, which repeats it twice, spaces in it, and CR LF.
    (tmp_path / "a.mtl").write_bytes(b"newmtl m\r\nmap_Kd -s 2 2 1 -clamp on maps/my wood.png\r\n")
    (tmp_path / "a.obj").write_bytes(
        b"mtllib a.mtl\r\nusemtl m\r\nv 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\n"
        b"vt 0 0\r\nvt 1 0\r\nvt 0 1\r\nf 1/1 2/2 3/3\r\n"
    )
    soup = read_mesh(Folder(tmp_path), "a.obj").soup
    assert soup.slots[int(soup.face_slots[0])].material.texture == "maps/my wood.png"
    assert soup.uvs is not None
    assert soup.uvs[0].tolist() == [[0, 0], [2, 0], [0, 2]]


def test_an_obj_face_without_normals_leaves_those_of_others(tmp_path: Path) -> None:
    """Zero stands for none."""
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0.6 0 0.8\nf 1//1 2//1 3//1\nf 1 3 2\n"
    (tmp_path / "a.obj").write_text(text)
    normals = read_mesh(Folder(tmp_path), "a.obj").soup.normals
    assert normals is not None
    assert normals.tolist() == [[[0.6, 0, 0.8]] * 3, [[0, 0, 0]] * 3]


@pytest.mark.parametrize("suffix", ["stl", "stl_ascii", "ply", "obj"])
def test_files_written_by_another_tool_read_back(tmp_path: Path, suffix: str) -> None:
    """Trimesh writes, we read: the same triangles; those at the poles that have no area go."""
    corners = sphere(0.1).round(4)
    mesh = trimesh.Trimesh(
        corners.reshape(-1, 3), np.arange(len(corners) * 3).reshape(-1, 3), process=False
    )
    name = f"ball.{suffix.partition('_')[0]}"
    data = mesh.export(file_type=suffix)
    (tmp_path / name).write_bytes(data if isinstance(data, bytes) else data.encode())
    read = read_mesh(Folder(tmp_path), name).soup
    assert read.corners == pytest.approx(corners[mesh.area_faces > 0.0], abs=1e-6)


def textured_triangle(tmp_path: Path) -> Builder:
    """A triangle in the plane Y = 0 of glTF, 2 m wide, with an embedded 4 x 2 image."""
    image = np.zeros((2, 4, 3), np.uint8)
    image[0, 0] = (255, 0, 0)
    Image.fromarray(image).save(tmp_path / "i.png")
    made = Builder(np.array([[0, 0, 0], [2, 0, 0], [0, 0, -2]], "<f4"))
    made.attributes["TEXCOORD_0"] = made.accessor(np.array([[0, 0], [1, 0], [0, 1]], "<f4"))
    made.primitive["indices"] = made.accessor(np.array([0, 1, 2], "<u2"))
    png = made.view(np.fromfile(tmp_path / "i.png", np.uint8))
    made.tree |= {
        "nodes": [{"children": [1], "scale": [0.5] * 3}, {"mesh": 0, "translation": [2, 0, 0]}],
        "images": [{"bufferView": png, "mimeType": "image/png"}],
        "textures": [{"source": 0}],
    }
    made.material(
        name="paint",
        pbrMetallicRoughness={
            "baseColorTexture": {"index": 0},
            "baseColorFactor": [0.5, 0.5, 0.5, 1],
            "metallicFactor": 0,
            "roughnessFactor": 0.3,
        },
    )
    return made


def test_glb_comes_upright_with_its_embedded_image(tmp_path: Path) -> None:
    """Node transforms apply, Y becomes Z, UVs count from the bottom, images are served."""
    folder = tmp_path / "assets"
    folder.mkdir()
    (folder / "flag.glb").write_bytes(textured_triangle(tmp_path).glb())
    library = open_library([folder], cache_dir=tmp_path / "cache")
    mesh = library.mesh("user/flag")
    low, high = np.array(mesh.bounds_m())
    assert high - low == pytest.approx([1.0, 1.0, 0.0], abs=1e-6)
    # glTF's +Y, the triangle's front, is our +Z.
    assert mesh.normals[:, 2] == pytest.approx(1.0)
    assert mesh.uvs[0].tolist() == [0.0, 1.0]
    (material,) = mesh.materials
    assert material.texture == "user/flag#0"
    assert (material.roughness, material.metallic) == (0.3, 0.0)
    assert material.base_color == (0.5, 0.5, 0.5)
    assert library.texture(material.texture).albedo[0, 0].tolist() == [255, 0, 0]
    again = open_library([folder], cache_dir=tmp_path / "cache")
    assert again.texture(material.texture).albedo.shape == (2, 4, 3)


def test_images_inside_the_meshes_of_a_robot_are_those_of_its_links(tmp_path: Path) -> None:
    """Of a robot's link and of a rigid object; two mesh files keep their images apart."""
    folder = tmp_path / "assets"
    folder.mkdir()
    visuals = ""
    for z, name in enumerate(("flag.glb", "other.glb")):
        (folder / name).write_bytes(textured_triangle(tmp_path).glb())
        visuals += f'<visual><origin xyz="0 0 {z}"/><geometry><mesh filename="{name}"/></geometry>'
        visuals += "</visual>"
    text = f'<robot name="r"><link name="a">{visuals}</link></robot>'
    (folder / "r.urdf").write_text(text)
    (folder / "assets.yaml").write_text(
        "robots: [{id: robot, file: r.urdf}]\nassets: [{id: thing, file: r.urdf, category: flag}]\n"
    )
    for asset_id in ("user/robot/a", "user/thing"):
        library = open_library([folder], cache_dir=tmp_path / "cache")
        textures = {material.texture for material in library.mesh(asset_id).materials}
        assert {t.partition("#")[0] for t in textures} == {asset_id}
        assert len(textures) == 2
        for texture in textures:
            assert library.texture(texture).albedo[0, 0].tolist() == [255, 0, 0]


def test_gltf_with_separate_and_inline_buffers_agree_and_other_tools(tmp_path: Path) -> None:
    """A .bin next to the file, a data URI and a GLB contain the same triangles."""
    made = textured_triangle(tmp_path)
    (tmp_path / "a.glb").write_bytes(made.glb())
    (tmp_path / "my data.bin").write_bytes(made.data)
    inline = "data:application/octet-stream;base64," + base64.b64encode(made.data).decode()
    for name, uri in (("b", "my%20data.bin"), ("c", inline)):
        made.tree["buffers"][0]["uri"] = uri
        (tmp_path / f"{name}.gltf").write_text(json.dumps(made.tree))
    soups = [read_mesh(Folder(tmp_path), name).soup for name in ("a.glb", "b.gltf", "c.gltf")]
    for soup in soups[1:]:
        assert soup.corners.tobytes() == soups[0].corners.tobytes()
    # Trimesh writes a box with a transform; it comes at its place and size.
    scene = trimesh.Scene()
    matrix = np.eye(4)
    matrix[:3, 3] = (1, 2, 3)
    cube = box((0.2, 0.4, 0.6))
    mesh = trimesh.Trimesh(cube.reshape(-1, 3), np.arange(36).reshape(-1, 3), process=False)
    scene.add_geometry(mesh, transform=matrix)
    (tmp_path / "box.glb").write_bytes(scene.export(file_type="glb"))
    points = read_mesh(Folder(tmp_path), "box.glb").soup.corners.reshape(-1, 3)
    assert points.min(axis=0) == pytest.approx([0.9, 1.8, 2.7], abs=1e-6)
    assert points.max(axis=0) == pytest.approx([1.1, 2.2, 3.3], abs=1e-6)
