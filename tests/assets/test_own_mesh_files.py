"""Files of users: written by many tools, read as their authors intend.

Expected values come from the files themselves, from the formats' rules, or are computed by hand.
"""

import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

from gen_data.assets.asset_folder import Folder
from gen_data.assets.folder_index import MeshEntry
from gen_data.assets.importer import ImportedMesh, import_object
from gen_data.assets.library import Library, open_library
from gen_data.assets.readers import read_mesh
from gen_data.core.asset_types import Material
from gen_data.core.errors import AssetError
from tests.assets.step_box import METRE, step_box

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
RED = "newmtl red\nKd 1 0 0\n"


def material_of(folder: Path, name: str = "a.obj") -> Material:
    soup = read_mesh(Folder(folder), name).soup
    return soup.slots[int(soup.face_slots[0])].material


def imported(folder: Path, name: str) -> ImportedMesh:
    return import_object(Folder(folder), MeshEntry(file=name), "user/a")


def opened(tmp_path: Path, folder: Path) -> Library:
    return open_library((folder,), tmp_path / "cache", tmp_path / "packs")


@pytest.mark.parametrize(
    ("obj", "mtl"),
    [
        (f"mtllib\ta.mtl\n{TRIANGLE}usemtl\tred\nf\t1 2\t3\n", "newmtl\tred\nKd\t1\t0 0\n"),
        (f"\ufeffmtllib a.mtl\n{TRIANGLE}usemtl red\nf 1 2 3\n", f"\ufeff{RED}"),
        (f"mtllib a.mtl\r\n{TRIANGLE}usemtl red\r\nf 1 2 \\\r\n3\r\n", RED.replace("\n", "\r\n")),
        (f"mtllib a.mtl\r{TRIANGLE}usemtl red\rf 1 2 3\r".replace("\n", "\r"), RED),
        (f"# C:\\models\\\nmtllib a.mtl\n{TRIANGLE}usemtl red\nf 1 2 3 # last\n", RED),
        (f"  mtllib   a.mtl  \n{TRIANGLE}  usemtl  red \n  f 1 2 3\n", "newmtl  red \nkd 1 0 0\n"),
        (f"mtllib other.mtl a.mtl\n{TRIANGLE}usemtl red\nf 1 2 3\n", RED),
        (f"mtllib C:\\work\\A.MTL\n{TRIANGLE}usemtl red\nf 1 2 3\n", RED),
    ],
    ids=["tabs", "byte order marks", "continued lines", "CR", "comments", "indented",
         "two libraries", "foreign path"],
)  # fmt: skip
def test_obj_spelling_keeps_faces_and_materials(tmp_path: Path, obj: str, mtl: str) -> None:
    """One triangle in the red of its MTL."""
    (tmp_path / "a.obj").write_bytes(obj.encode())
    (tmp_path / "a.mtl").write_bytes(mtl.encode())
    if "other.mtl" in obj:
        (tmp_path / "other.mtl").write_text("newmtl blue\nKd 0 0 1\n")
    source = read_mesh(Folder(tmp_path), "a.obj")
    assert source.soup.corners.tolist() == [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]
    assert material_of(tmp_path).base_color == (1.0, 0.0, 0.0)


@pytest.mark.parametrize(
    "encodings", [("latin-1", "utf-8"), ("latin-1", "latin-1"), ("utf-16", "utf-8")]
)
def test_obj_names_match_across_encodings(tmp_path: Path, encodings: tuple[str, str]) -> None:
    """``röt`` in the OBJ and in the MTL, as programs of different systems write it."""
    obj, mtl = encodings
    (tmp_path / "a.obj").write_bytes(f"mtllib a.mtl\n{TRIANGLE}usemtl röt\nf 1 2 3\n".encode(obj))
    (tmp_path / "a.mtl").write_bytes("newmtl röt\nKd 1 0 0\n".encode(mtl))
    assert material_of(tmp_path).base_color == (1.0, 0.0, 0.0)


@pytest.mark.parametrize("name", ["None", "(null)"])
def test_names_for_no_material_are_grey_without_a_remark(tmp_path: Path, name: str) -> None:
    """As Blender and ShapeNet's converter write faces without a material."""
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{TRIANGLE}usemtl {name}\nf 1 2 3\n")
    (tmp_path / "a.mtl").write_text(RED)
    read = imported(tmp_path, "a.obj")
    assert read.mesh is not None
    assert read.mesh.materials[0].base_color == (0.6, 0.6, 0.6)
    assert read.remarks == ()


def test_an_mtl_may_name_the_image_of_another_model_and_scale_and_move_it(tmp_path: Path) -> None:
    """As Gazebo's ``ambulance`` takes the wheels of ``suv``."""
    (tmp_path / "suv/images").mkdir(parents=True)
    (tmp_path / "suv/images/wheel.png").write_bytes(b"")
    (tmp_path / "van").mkdir()
    (tmp_path / "van/a.mtl").write_text("newmtl m\nmap_Kd model://suv/images/wheel.png\n")
    text = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n"
    (tmp_path / "van/a.obj").write_text(text)
    soup = read_mesh(Folder(tmp_path), "van/a.obj").soup
    assert soup.slots[soup.face_slots[0]].material.texture == "suv/images/wheel.png"
    # ``-s 2 3 1 -o 0.5 0``: u * 2 + 0.5 and v * 3, as in Blender and three.js.
    (tmp_path / "a.obj").write_text(
        f"mtllib a.mtl\n{TRIANGLE}vt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n"
    )
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd -s 2 3 1 -o 0.5 0 w.png\n")
    uvs = read_mesh(Folder(tmp_path), "a.obj").soup.uvs
    assert uvs is not None
    assert uvs[0].tolist() == [[0.5, 0.0], [2.5, 0.0], [0.5, 3.0]]


SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
SRGB = [(255, 0, 0), (0, 255, 0), (0, 0, 255), (188, 188, 188)]
# IEC 61966-2-1: sRGB 188 of 255 is linear 0.5029.
LINEAR = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.5029, 0.5029, 0.5029)]


def ply_text(kind: str = "uchar", scale: float = 1.0) -> bytes:
    head = "ply\nformat ascii 1.0\nelement vertex 4\n"
    head += "".join(f"property float {a}\n" for a in "xyz")
    head += "".join(f"property {kind} {c}\n" for c in ("red", "green", "blue"))
    head += "element face 1\nproperty list uchar int vertex_index\nend_header\n"
    rows = [" ".join(str(x) for x in (*p, *(c * scale if scale != 1.0 else c for c in rgb)))
            for p, rgb in zip(SQUARE, SRGB, strict=True)]  # fmt: skip
    return (head + "\n".join(rows) + "\n4 0 1 2 3\n").encode()


def obj_text(scale: float) -> bytes:
    rows = [f"v {x} {y} {z} {r * scale} {g * scale} {b * scale}"
            for (x, y, z), (r, g, b) in zip(SQUARE, SRGB, strict=True)]  # fmt: skip
    return ("\n".join(rows) + "\nf 1 2 3 4\n").encode()


@pytest.mark.parametrize(
    ("name", "data"),
    [("a.ply", ply_text()), ("a.ply", ply_text("float", 1.0 / 255.0)),
     ("a.obj", obj_text(1.0 / 255.0)), ("a.obj", obj_text(1.0))],
    ids=["PLY of bytes", "PLY of floats", "OBJ to 1", "OBJ to 255"],
)  # fmt: skip
def test_vertex_colours_are_read_as_srgb(tmp_path: Path, name: str, data: bytes) -> None:
    """The square's fan 0 1 2, 0 2 3 has the colours of its corners."""
    (tmp_path / name).write_bytes(data)
    colors = read_mesh(Folder(tmp_path), name).soup.colors
    assert colors is not None
    expected = [[LINEAR[k] for k in triangle] for triangle in ((0, 1, 2), (0, 2, 3))]
    assert colors == pytest.approx(np.array(expected), abs=1e-4)


def color_at(read: ImportedMesh, point: tuple[float, float]) -> np.ndarray:
    """SRGB of a flat asset at a point of its plane, with the image's bilinear interpolation."""
    mesh = read.mesh
    assert mesh is not None
    xy = mesh.vertices_m[:, :2].astype(np.float64)
    for face, slot in zip(mesh.faces, mesh.face_slots, strict=True):
        a, b, c = xy[face]
        s, t = np.linalg.solve(np.stack([b - a, c - a], axis=1), np.array(point) - a)
        if min(s, t, 1 - s - t) < -1e-9:
            continue
        u, v = np.array([1 - s - t, s, t]) @ mesh.uvs[face]
        image = read.images["vertex_colors"].astype(np.float64)
        assert mesh.materials[slot].base_color == (1.0, 1.0, 1.0)
        x, y = u * image.shape[1] - 0.5, (1.0 - v) * image.shape[0] - 0.5
        x0, y0 = int(np.floor(x + 1e-6)), int(np.floor(y + 1e-6))
        x1, y1 = min(x0 + 1, image.shape[1] - 1), min(y0 + 1, image.shape[0] - 1)
        top = image[y0, x0] * (1 - x + x0) + image[y0, x1] * (x - x0)
        low = image[y1, x0] * (1 - x + x0) + image[y1, x1] * (x - x0)
        return np.asarray(top * (1 - y + y0) + low * (y - y0))
    raise AssertionError(point)


def test_gradients_become_an_image_of_corner_colours_and_few_ones_materials(tmp_path: Path) -> None:
    """At the corners of the square, which is centred: the file's own bytes."""
    (tmp_path / "a.ply").write_bytes(ply_text())
    read = imported(tmp_path, "a.ply")
    for (x, y, _), rgb in zip(SQUARE, SRGB, strict=True):
        assert color_at(read, (x - 0.5, y - 0.5)) == pytest.approx(rgb, abs=1.0)
    # A PLY with a red and a blue face has two materials and no image.
    (tmp_path / "a.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        "property float z\nelement face 2\nproperty list uchar int vertex_indices\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
        "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 188 0 0\n3 0 2 3 0 0 188\n"
    )
    read = imported(tmp_path, "a.ply")
    assert read.mesh is not None
    assert read.images == {}
    colors = [m.base_color for m in read.mesh.materials]
    assert colors == [pytest.approx(c, abs=1e-4) for c in ((0.5029, 0, 0), (0, 0, 0.5029))]


@pytest.mark.slow
def test_colours_of_a_dense_scan_survive_its_decimation(tmp_path: Path) -> None:
    """A sheet of 28,800 triangles, red on the left and blue on the right, is cut to 20,000."""
    n = 121
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    z = 0.05 * np.sin(9 * x) * np.cos(7 * y)
    vertex = np.zeros(n * n, [("p", "<f4", 3), ("c", "u1", 3)])
    vertex["p"] = np.stack([x, y, z], axis=2).reshape(-1, 3)
    level = np.rint(255 * x.reshape(-1))
    vertex["c"] = np.stack([255 - level, 0 * level, level], axis=1)
    cell = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).reshape(-1)
    quads = np.stack([cell, cell + 1, cell + n + 1, cell, cell + n + 1, cell + n], 1).reshape(-1, 3)
    face = np.zeros(len(quads), [("n", "u1"), ("v", "<i4", 3)])
    face["n"], face["v"] = 3, quads
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertex)}\n"
    head += "".join(f"property float {a}\n" for a in "xyz")
    head += "".join(f"property uchar {c}\n" for c in ("red", "green", "blue"))
    head += f"element face {len(face)}\nproperty list uchar int vertex_indices\nend_header\n"
    (tmp_path / "a.ply").write_bytes(head.encode() + vertex.tobytes() + face.tobytes())
    read = imported(tmp_path, "a.ply")
    assert read.mesh is not None
    assert len(read.mesh.faces) <= 25_000
    for at in (-0.4, 0.0, 0.3):
        expected = 255 * (at + 0.5)
        assert color_at(read, (at, 0.1)) == pytest.approx((255 - expected, 0, expected), abs=5)


@pytest.mark.parametrize(("color", "told"), [("255 0 0", 1), ("192 192 192", 0)])
def test_a_colour_beside_an_image_of_ply_is_named(tmp_path: Path, color: str, told: int) -> None:
    """Unless it is one grey, a placeholder."""
    properties = "".join(f"property float {n}\n" for n in ("x", "y", "z", "s", "t"))
    properties += "".join(f"property uchar {n}\n" for n in ("red", "green", "blue"))
    corners = "".join(f"{x} {y} 0 {x} {y} {color}\n" for x, y in ((0, 0), (1, 0), (0, 1)))
    (tmp_path / "a.ply").write_text(
        f"ply\nformat ascii 1.0\ncomment TextureFile t.png\nelement vertex 3\n{properties}"
        f"element face 1\nproperty list uchar int vertex_indices\nend_header\n{corners}3 0 1 2\n"
    )
    remarks = read_mesh(Folder(tmp_path), "a.ply").remarks
    assert remarks.count("vertex and face colours are not used next to an image") == told


def test_ply_images_with_texture_coordinates_of_corners_and_triangle_strips(tmp_path: Path) -> None:
    """MeshLab: ``TextureFile`` and a list ``texcoord`` per face; the file's words are longer."""
    (tmp_path / "a.ply").write_text(
        "ply\nformat ascii 1.0\ncomment TextureFile my image.png\nelement vertex 3\n"
        "property float x\nproperty float y\nproperty float z\nelement face 1\n"
        "property list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 0.1 0.2 0.3 0.4 0.5 0.6 9 9\n"
    )
    soup = read_mesh(Folder(tmp_path), "a.ply").soup
    assert soup.slots[0].material.texture == "my image.png"
    assert soup.uvs is not None
    assert soup.uvs[0] == pytest.approx(np.array([[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]]))
    # Strip 0 1 3 2 and, after -1, 0 1 2: every second triangle of a strip is turned.
    (tmp_path / "a.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        "property float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n1 1 0\n0 1 0\n8 0 1 3 2 -1 0 1 2\n"
    )
    corners = read_mesh(Folder(tmp_path), "a.ply").soup.corners
    expected = [[SQUARE[k] for k in t] for t in ((0, 1, 3), (3, 1, 2), (0, 1, 2))]
    assert corners.tolist() == np.array(expected, float).tolist()


@pytest.mark.parametrize("order", ["<", ">"])
def test_binary_ply_of_triangles_and_quads(tmp_path: Path, order: str) -> None:
    """Lists of different lengths, in both byte orders; a quad becomes two triangles."""
    name = {"<": "little", ">": "big"}[order]
    head = (
        f"ply\nformat binary_{name}_endian 1.0\nelement vertex 4\nproperty double x\n"
        "property double y\nproperty double z\nelement face 2\n"
        "property list uchar uint vertex_indices\nend_header\n"
    )
    body = b"".join(struct.pack(f"{order}3d", *p) for p in SQUARE)
    body += struct.pack(f"{order}B3I", 3, 0, 1, 2) + struct.pack(f"{order}B4I", 4, 0, 1, 2, 3)
    (tmp_path / "a.ply").write_bytes(head.encode() + body)
    assert len(read_mesh(Folder(tmp_path), "a.ply").soup) == 3


def binary_stl(attributes: tuple[int, ...], header: bytes = b"") -> bytes:
    facet = np.zeros(len(attributes), [("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
    facet["v"] = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    facet["v"][:, :, 2] += np.arange(len(attributes))[:, None]
    facet["a"] = attributes
    return header.ljust(80, b"\0") + struct.pack("<I", len(attributes)) + facet.tobytes()


@pytest.mark.parametrize("tail", [b"\0\0", b"\r\n"])
def test_binary_stl_with_bytes_after_its_end(tmp_path: Path, tail: bytes) -> None:
    """They are named, and not read."""
    (tmp_path / "a.stl").write_bytes(binary_stl((0, 0)) + tail)
    source = read_mesh(Folder(tmp_path), "a.stl")
    assert len(source.soup) == 2
    assert source.remarks == ("2 bytes after its last facet are not read",)


def test_stl_facet_colours_of_both_conventions(tmp_path: Path) -> None:
    """SolidView: bit 15 set, red in bits 10 to 14. Magics: bit 15 unset, red in bits 0 to 4."""
    (tmp_path / "s.stl").write_bytes(binary_stl((0x8000 | 31 << 10, 0x8000 | 31)))
    (tmp_path / "m.stl").write_bytes(binary_stl((31, 31 << 10), b"COLOR=\xff\xff\xff\xff"))
    for name in ("s.stl", "m.stl"):
        colors = read_mesh(Folder(tmp_path), name).soup.colors
        assert colors is not None
        assert colors[:, 0].tolist() == [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]


ASCII_STL = (
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
    "endfacet\nfacet normal 0 0 1\nouter loop\nvertex 0 0 1\nvertex 1 0 1\nvertex 0 1 1\nendloop\n"
    "endfacet\nendsolid a\n"
)


@pytest.mark.parametrize(
    ("text", "reason"),
    [(ASCII_STL[:105], "cut off"), (ASCII_STL[:-12], "cut off"),
     (ASCII_STL.replace("vertex 1 0 0\n", ""), r"a\.stl:6: .*without three vertices"),
     (ASCII_STL.replace("vertex 1 0 0\n", "vertex 1 0\n"), r"a\.stl:5: .*three numbers")],
    ids=["first facet only", "last line missing", "two vertices", "two numbers"],
)  # fmt: skip
def test_a_cut_ascii_stl_is_refused(tmp_path: Path, text: str, reason: str) -> None:
    """Whole, it has two facets; cut, none of them is trusted."""
    (tmp_path / "a.stl").write_text(ASCII_STL)
    assert len(read_mesh(Folder(tmp_path), "a.stl").soup) == 2
    (tmp_path / "a.stl").write_text(text)
    with pytest.raises(AssetError, match=reason):
        read_mesh(Folder(tmp_path), "a.stl")


def test_3mf_builds_components_in_their_unit_with_their_colours(tmp_path: Path) -> None:
    """A tetrahedron of 10 inches, twice: 0.254 m, the second one 20 inches further along X."""
    model = """<?xml version="1.0"?>
<model unit="inch" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
 xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02"><resources>
<basematerials id="5"><base name="r" displaycolor="#FF0000"/></basematerials>
<m:colorgroup id="6"><m:color color="#0000FFFF"/></m:colorgroup>
<object id="1" pid="5" pindex="0"><mesh><vertices><vertex x="0" y="0" z="0"/>
<vertex x="10" y="0" z="0"/><vertex x="0" y="10" z="0"/><vertex x="0" y="0" z="10"/></vertices>
<triangles><triangle v1="0" v2="2" v3="1"/><triangle v1="0" v2="1" v3="3"/>
<triangle v1="0" v2="3" v3="2"/><triangle v1="1" v2="2" v3="3" pid="6" p1="0"/></triangles></mesh>
</object><object id="2"><components><component objectid="1"/>
<component objectid="1" transform="1 0 0 0 1 0 0 0 1 20 0 0"/></components></object></resources>
<build><item objectid="2"/></build></model>"""
    with zipfile.ZipFile(tmp_path / "a.3mf", "w") as archive:
        archive.writestr("3D/3dmodel.model", model)
    soup = read_mesh(Folder(tmp_path), "a.3mf").soup
    assert soup.corners.reshape(-1, 3).max(axis=0) == pytest.approx((30 * 0.0254, 0.254, 0.254))
    assert soup.colors is not None
    assert soup.colors[:, 0].tolist() == ([[1, 0, 0]] * 3 + [[0, 0, 1]]) * 2


@pytest.mark.parametrize(("alphas", "told"), [
    ((255, 255, 255), ()), ((0, 0, 0), ()),
    ((255, 90, 255), ("the opacity of vertices (alpha) is not used",)),
])  # fmt: skip
def test_opacity_of_vertices_of_ply_is_named(
    tmp_path: Path, alphas: tuple[int, ...], told: tuple[str, ...]
) -> None:
    """Where it varies: a constant one is a placeholder."""
    head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    colors = "".join(f"property uchar {name}\n" for name in ("red", "green", "blue", "alpha"))
    face = "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    places = ((0, 0), (1, 0), (0, 1))
    rows = [f"{x} {y} 0 255 0 0 {a}\n" for (x, y), a in zip(places, alphas, strict=True)]
    (tmp_path / "a.ply").write_text(
        f"{head}property float z\n{colors}{face}{''.join(rows)}3 0 1 2\n"
    )
    assert read_mesh(Folder(tmp_path), "a.ply").remarks == told


@pytest.mark.parametrize(("alpha", "told"), [
    ("", ()), ("FF", ()), ("40", ("the opacity of colours is not used",)),
])  # fmt: skip
def test_opacity_of_colours_of_3mf_is_named(
    tmp_path: Path, alpha: str, told: tuple[str, ...]
) -> None:
    model = (
        '<model unit="millimeter"><resources><basematerials id="5"><base name="a" '
        f'displaycolor="#FF0000{alpha}"/></basematerials><object id="1" pid="5" pindex="0"><mesh>'
        '<vertices><vertex x="0" y="0" z="0"/><vertex x="9" y="0" z="0"/>'
        '<vertex x="0" y="9" z="0"/></vertices><triangles><triangle v1="0" v2="1" v3="2"/>'
        '</triangles></mesh></object></resources><build><item objectid="1"/></build></model>'
    )
    with zipfile.ZipFile(tmp_path / "a.3mf", "w") as archive:
        archive.writestr("3D/3dmodel.model", model)
    assert read_mesh(Folder(tmp_path), "a.3mf").remarks == told


@pytest.mark.slow
@pytest.mark.parametrize(("text", "metres"), [
    (step_box((10, 20, 30), color=(1.0, 0.5, 0.0)), 0.001),
    (step_box((10, 20, 30), METRE), 1.0),
    (step_box((10, 20, 30), inch=True), 0.0254),
])  # fmt: skip
def test_step_is_meshed_in_metres_with_its_axes_and_colours(
    tmp_path: Path, text: str, metres: float
) -> None:
    """A box of 10 x 20 x 30 units, Z up, turned outwards; sRGB 0.5 is 0.214041 linear."""
    pytest.importorskip("cascadio")
    (tmp_path / "a.step").write_text(text)
    soup = read_mesh(Folder(tmp_path), "a.step").soup
    points = soup.corners.reshape(-1, 3)
    np.testing.assert_allclose(points.min(axis=0), 0.0, atol=1e-9)
    np.testing.assert_allclose(points.max(axis=0), metres * np.array([10, 20, 30]), rtol=1e-6)
    a, b, c = np.moveaxis(soup.corners, 1, 0)
    assert (a * np.cross(b, c)).sum() / 6.0 == pytest.approx(6000.0 * metres**3, rel=1e-5)
    if "COLOUR_RGB" in text:
        (slot,) = soup.slots
        assert slot.material.base_color == pytest.approx((1.0, 0.214041, 0.0), abs=1e-5)


@pytest.mark.slow
def test_a_step_file_without_a_shape_is_one_clear_error(tmp_path: Path) -> None:
    pytest.importorskip("cascadio")
    (tmp_path / "a.step").write_text(
        "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n"
    )
    with pytest.raises(AssetError, match=r"a\.step: "):
        opened(tmp_path, tmp_path).mesh("user/a")


def test_fully_transparent_parts_are_left_out(tmp_path: Path) -> None:
    """``d 0`` on one of two triangles; on all of them, it is the mistake of an exporter."""
    (tmp_path / "a.obj").write_text(
        f"mtllib a.mtl\n{TRIANGLE}v 0 0 5\nusemtl s\nf 1 2 3\nusemtl h\nf 1 2 4\n"
    )
    (tmp_path / "a.mtl").write_text("newmtl s\nKd 1 0 0\nnewmtl h\nd 0\n")
    read = imported(tmp_path, "a.obj")
    assert read.mesh is not None
    assert np.ptp(read.mesh.vertices_m, axis=0).tolist() == [1.0, 1.0, 0.0]
    assert "1 fully transparent triangles are left out (h)" in read.remarks[0].unused
    (tmp_path / "a.mtl").write_text("newmtl s\nKd 1 0 0\nd 0\nnewmtl h\nd 0\n")
    whole = imported(tmp_path, "a.obj")
    assert whole.mesh is not None
    assert len(whole.mesh.faces) == 2
    assert "read as opaque" in whole.remarks[0].unused[0]


def test_origin_file_keeps_coordinates_and_other_origins_state_their_shift(tmp_path: Path) -> None:
    """A square of a CAD file from 30 to 110 mm in X and 20 to 80 mm in Y, at 10 mm."""
    (tmp_path / "a.obj").write_text("v 30 20 10\nv 110 20 10\nv 110 80 10\nv 30 80 10\nf 1 2 3 4\n")
    expected = {"file": (0, 0, 0), "center": (-0.07, -0.05, -0.01), "floor": (-0.07, -0.05, -0.01)}
    for origin, shift in expected.items():
        entry = MeshEntry(file="a.obj", unit="mm", origin=origin)
        read = import_object(Folder(tmp_path), entry, "user/a")
        assert read.mesh is not None
        assert read.shift_m == pytest.approx(shift)
        low = read.mesh.vertices_m.min(axis=0) - np.array(read.shift_m)
        assert low == pytest.approx((0.03, 0.02, 0.01), abs=1e-7)


@pytest.mark.slow
def test_links_of_robots_keep_colours_of_vertices(tmp_path: Path) -> None:
    """A link with a gradient has a separate image; one of one colour a base colour."""
    root = tmp_path / "robots"
    root.mkdir()
    (root / "square.ply").write_bytes(ply_text())
    links = "".join(
        f'<link name="{name}"><visual><geometry><mesh filename="square.ply"/></geometry>'
        "</visual></link>"
        for name in ("base", "tip")
    )
    (root / "arm.urdf").write_text(
        f'<robot name="arm">{links}<joint name="j" type="fixed"><parent link="base"/>'
        '<child link="tip"/></joint></robot>'
    )
    (root / "assets.yaml").write_text("robots: [{id: arm, file: arm.urdf}]\n")
    library = opened(tmp_path, root)
    (material,) = library.mesh("user/arm/tip").materials
    albedo = library.texture(material.texture).albedo
    assert set(SRGB) <= {tuple(color) for color in albedo.reshape(-1, 3).tolist()}


MODEL_3MF = (
    '<model unit="meter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">'
    '<resources><object id="1">{}</object></resources><build><item objectid="1"/></build></model>'
)


@pytest.mark.hostile
@pytest.mark.parametrize(
    ("model", "reason"),
    [(MODEL_3MF.format('<components><component objectid="1"/></components>'), "16 levels"),
     (MODEL_3MF.format('<components><component objectid="9"/></components>'), "missing '9'"),
     ('<!DOCTYPE a [<!ENTITY b "c">]><model/>', "declares a document type"),
     (" " * 100_000_000, "malformed XML")],
    ids=["cycle", "missing object", "entities", "a bomb of blanks"],
)  # fmt: skip
def test_hostile_3mf_is_one_clear_error(tmp_path: Path, model: str, reason: str) -> None:
    root = tmp_path / "props"
    root.mkdir()
    with zipfile.ZipFile(root / "a.3mf", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/3dmodel.model", model)
    with pytest.raises(AssetError, match=reason):
        opened(tmp_path, root).mesh("user/a")


ELL = ((1, 1), (1, 3), (0, 3), (0, 0), (3, 0), (3, 1))
"""Corners of an L of area 5; the fan from the first one covers it, from others it does not."""


@pytest.mark.parametrize("ending", ["obj", "ply", "dae", "usda"])
def test_concave_polygons_have_their_own_area_in_every_format(tmp_path: Path, ending: str) -> None:
    corners = [*ELL[2:], *ELL[:2]]
    flat = " ".join(f"{x} {y} 0" for x, y in corners)
    texts = {
        "obj": "".join(f"v {x} {y} 0\n" for x, y in corners) + "f 1 2 3 4 5 6\n",
        "ply": "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\n"
               "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
               "end_header\n" + "".join(f"{x} {y} 0\n" for x, y in corners) + "6 0 1 2 3 4 5\n",
        "dae": '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
               '<asset><up_axis>Z_UP</up_axis></asset><library_geometries><geometry id="g"><mesh>'
               f'<source id="p"><float_array id="a" count="18">{flat}</float_array>'
               '<technique_common><accessor source="#a" count="6" stride="3"><param name="X" '
               'type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>'
               '</accessor></technique_common></source><vertices id="v"><input '
               'semantic="POSITION" source="#p"/></vertices><polylist count="1"><input '
               'semantic="VERTEX" source="#v" offset="0"/><vcount>6</vcount><p>0 1 2 3 4 5</p>'
               "</polylist></mesh></geometry></library_geometries></COLLADA>",
        "usda": '#usda 1.0\n(\nmetersPerUnit = 1\nupAxis = "Z"\n)\ndef Mesh "m" {\n'
                "int[] faceVertexCounts = [6]\nint[] faceVertexIndices = [0, 1, 2, 3, 4, 5]\n"
                f"point3f[] points = {[(x, y, 0) for x, y in corners]}\n"
                'uniform token subdivisionScheme = "none"\n}\n',
    }  # fmt: skip
    (tmp_path / f"a.{ending}").write_text(texts[ending])
    found = read_mesh(Folder(tmp_path), f"a.{ending}").soup.corners
    crosses = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])
    assert 0.5 * np.abs(crosses[:, 2]).sum() == pytest.approx(5.0)
    assert (crosses[:, 2] > 0.0).all()


BOX = [(x, y, z) for x in (0, 1) for y in (0, 2) for z in (0, 5)]
FACES = "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"


def box_obj(scale: float, order: tuple[int, int, int] = (0, 1, 2), shift: float = 0.0) -> str:
    rows = [[scale * corner[k] + shift for k in order] for corner in BOX]
    return "".join(f"v {x} {y} {z}\n" for x, y, z in rows) + FACES


@pytest.mark.parametrize(("collision", "size"), [
    (box_obj(1000.0), "1000 x 2000 x 5000 m"),
    (box_obj(0.001), "0.001 x 0.002 x 0.005 m"),
    (box_obj(1.0, (2, 1, 0)), "5 x 2 x 1 m"),
    (box_obj(1.0, shift=20.0), "1 x 2 x 5 m"),
])  # fmt: skip
def test_a_collision_mesh_of_another_unit_or_axes_or_place_is_refused(
    tmp_path: Path, collision: str, size: str
) -> None:
    """In millimetres, in kilometres, with X upwards, and 20 m away."""
    (tmp_path / "a.obj").write_text(box_obj(1.0))
    (tmp_path / "c.obj").write_text(collision)
    entry = MeshEntry(file="a.obj", collision="c.obj")
    fact = rf"c\.obj: it is {size} large or elsewhere than a\.obj, of 1 x 2 x 5 m"
    with pytest.raises(AssetError, match=fact):
        import_object(Folder(tmp_path), entry, "user/a")
    # A simpler part of it is a usual collision mesh.
    (tmp_path / "c.obj").write_text(box_obj(0.4))
    assert import_object(Folder(tmp_path), entry, "user/a").collision is not None
