"""Broken and malicious files: each is refused quickly, by name, and nothing outside is opened."""

import json
import os
import re
import struct
import tracemalloc
import zlib
from base64 import b64encode
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gen_data.assets.asset_folder import Folder
from gen_data.assets.folder_index import FolderIndex, MeshEntry, list_assets
from gen_data.assets.library import open_library
from gen_data.assets.readers import read_mesh
from gen_data.assets.triangle_soup import TriangleSoup
from gen_data.core.errors import AssetError

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
TETRAHEDRON = TRIANGLE + "f 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n"
SECRET = "this must never appear in an error or a data set"


def gltf(**changes: Any) -> bytes:
    """A one-triangle glTF with an inline buffer, with some keys exchanged."""
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    tree: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": "data:;base64," + b64encode(positions).decode()}],
    }
    return json.dumps({**tree, **changes}).encode()


def shiny(**factors: Any) -> bytes:
    primitive = {"attributes": {"POSITION": 0}, "material": 0}
    return gltf(materials=[{"pbrMetallicRoughness": factors}], meshes=[{"primitives": [primitive]}])


def glb(text: bytes) -> bytes:
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A) + text


def accessor(**changes: Any) -> list[dict[str, Any]]:
    return [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", **changes}]


def chain(length: int) -> list[dict[str, Any]]:
    return [*({"children": [k + 1]} for k in range(length)), {"children": [0]}]


def stl(count: int, triangles: int) -> bytes:
    return b"\0" * 80 + struct.pack("<I", count) + b"\0" * 50 * triangles


def ply(header: str, body: bytes = b"") -> bytes:
    return f"ply\nformat binary_little_endian 1.0\n{header}end_header\n".encode() + body


VERTICES = "property float x\nproperty float y\nproperty float z\n"
FACES = "property list uchar int vertex_indices\n"

MESHES: dict[str, tuple[str, bytes | str]] = {
    "empty obj": ("a.obj", ""),
    "noise obj": ("a.obj", bytes(range(256)) * 40),
    "nul bytes obj": ("a.obj", b"\0" * 5000),
    "vertices only obj": ("a.obj", TRIANGLE),
    "nan obj": ("a.obj", TETRAHEDRON.replace("v 1 0 0", "v nan 0 0")),
    "inf obj": ("a.obj", TETRAHEDRON.replace("v 1 0 0", "v inf 0 0")),
    "huge obj": ("a.obj", TETRAHEDRON.replace("v 1 0 0", "v 1e308 0 0")),
    "word obj": ("a.obj", TETRAHEDRON.replace("v 1 0 0", "v one 0 0")),
    "short vertex obj": ("a.obj", TETRAHEDRON.replace("v 1 0 0", "v 1")),
    "index too large obj": ("a.obj", TRIANGLE + "f 1 2 99\n"),
    "index zero obj": ("a.obj", TRIANGLE + "f 0 1 2\n"),
    "index far below zero obj": ("a.obj", TRIANGLE + "f -9 -2 -1\n"),
    "index astronomical obj": ("a.obj", TRIANGLE + "f 1 2 " + "9" * 30 + "\n"),
    "index of 6000 digits obj": ("a.obj", TRIANGLE + "f 1 2 " + "9" * 6000 + "\n"),
    "uv index too large obj": ("a.obj", TRIANGLE + "vt 0 0\nf 1/1 2/1 3/2\n"),
    "two-cornered face obj": ("a.obj", TRIANGLE + "f 1 2\n"),
    "degenerate obj": ("a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\nf 1 1 2\n"),
    "polygon of 300,000 equal corners obj": ("a.obj", TRIANGLE + "f" + " 1" * 300_000 + "\n"),
    "mtllib absolute obj": ("a.obj", "mtllib /etc/passwd\nusemtl x\n" + TETRAHEDRON),
    "mtllib traversal obj": ("a.obj", "mtllib ../secret.mtl\nusemtl x\n" + TETRAHEDRON),
    "mtllib missing obj": ("a.obj", "mtllib none.mtl\nusemtl x\n" + TETRAHEDRON),
    "mtllib url obj": ("a.obj", "mtllib http://127.0.0.1:9/a.mtl\nusemtl x\n" + TETRAHEDRON),
    "empty stl": ("a.stl", b""),
    "no triangles stl": ("a.stl", stl(0, 0)),
    "absurd count stl": ("a.stl", stl(0xFFFFFFFF, 2)),
    "truncated stl": ("a.stl", stl(5, 2)),
    "all zero stl": ("a.stl", stl(3, 3)),
    "noise stl": ("a.stl", b"solid " + bytes(range(256)) * 10),
    "words ascii stl": ("a.stl", "solid\nvertex a b c\nendsolid\n"),
    "two vertices ascii stl": ("a.stl", "solid\nvertex 0 0 0\nvertex 1 0 0\nendsolid\n"),
    "noise ply": ("a.ply", bytes(range(256)) * 10),
    "four billion vertices ply": ("a.ply", ply(f"element vertex 4000000000\n{VERTICES}")),
    "negative count ply": ("a.ply", ply(f"element vertex -5\n{VERTICES}")),
    "no faces ply": ("a.ply", ply(f"element vertex 1\n{VERTICES}", b"\0" * 12)),
    "index out of range ply": (
        "a.ply",
        ply(f"element vertex 3\n{VERTICES}element face 1\n{FACES}",
            np.eye(3, dtype="<f4").tobytes() + b"\x03" + np.array([0, 1, 9], "<i4").tobytes()),
    ),
    "truncated ply": (
        "a.ply", ply(f"element vertex 30\n{VERTICES}element face 9\n{FACES}", b"x" * 60)),
    "no header end ply": ("a.ply", b"ply\n" + b"comment x\n" * 20_000),
    "no element ply": ("a.ply", b"ply\nformat ascii 1.0\nproperty float x\nend_header\n0\n"),
    "unknown type ply": (
        "a.ply", ply(f"element vertex 3\nproperty quux x\nelement face 1\n{FACES}", b"x" * 99)),
    "short property ply": (
        "a.ply", ply(f"element vertex 3\nproperty float\nelement face 1\n{FACES}", b"x" * 99)),
    "empty glb": ("a.glb", b""),
    "magic only glb": ("a.glb", b"glTF"),
    "truncated glb": ("a.glb", struct.pack("<4sIIII", b"glTF", 2, 4000, 3000, 0x4E4F534A) + b"{}"),
    "chunk beyond the end glb": (
        "a.glb", struct.pack("<4sIIII", b"glTF", 2, 22, 0xFFFFFFF0, 0x4E4F534A) + b"{}"),
    "no json glb": ("a.glb", struct.pack("<4sII", b"glTF", 2, 12)),
    "not json gltf": ("a.gltf", b"{{{{"),
    "json list gltf": ("a.gltf", b"[]"),
    "deep json gltf": ("a.gltf", b"[" * 100_000),
    "nan json gltf": ("a.gltf", gltf(nodes=[{"mesh": 0, "scale": [float("nan")] * 3}])),
    "no meshes gltf": ("a.gltf", gltf(nodes=[{}])),
    "no such mesh gltf": ("a.gltf", gltf(nodes=[{"mesh": 7}])),
    "negative mesh gltf": ("a.gltf", gltf(nodes=[{"mesh": -1}])),
    "self-parent gltf": ("a.gltf", gltf(nodes=[{"children": [0]}])),
    "cycle of 20,000 nodes gltf": ("a.gltf", gltf(nodes=chain(20_000))),
    "200,000 nodes glb": (
        "a.glb", glb(gltf(nodes=[{"mesh": 0}] * 200_000, scenes=[{"nodes": [*range(200_000)]}]))),
    "200,000 primitives glb": (
        "a.glb", glb(gltf(meshes=[{"primitives": [{"attributes": {"POSITION": 0}}] * 200_000}]))),
    "count of two billion gltf": ("a.gltf", gltf(accessors=accessor(count=2**31))),
    "zero count gltf": ("a.gltf", gltf(accessors=accessor(count=0))),
    "no view gltf": (
        "a.gltf", gltf(accessors=[{"componentType": 5126, "count": 10**9, "type": "VEC3"}])),
    "sparse gltf": ("a.gltf", gltf(accessors=accessor(sparse={"count": 1}))),
    "unknown component gltf": ("a.gltf", gltf(accessors=accessor(componentType=1))),
    "wrong type gltf": ("a.gltf", gltf(accessors=accessor(type="MAT4"))),
    "offset beyond gltf": ("a.gltf", gltf(accessors=accessor(byteOffset=30))),
    "negative offset gltf": ("a.gltf", gltf(accessors=accessor(byteOffset=-4))),
    "small stride gltf": (
        "a.gltf", gltf(bufferViews=[{"buffer": 0, "byteLength": 36, "byteStride": 1}])),
    "view beyond gltf": ("a.gltf", gltf(bufferViews=[{"buffer": 0, "byteLength": 999}])),
    "file uri gltf": ("a.gltf", gltf(buffers=[{"byteLength": 36, "uri": "file:///etc/passwd"}])),
    "http uri gltf": ("a.gltf", gltf(buffers=[{"byteLength": 36, "uri": "http://127.0.0.1:9/x"}])),
    "absolute uri gltf": ("a.gltf", gltf(buffers=[{"byteLength": 36, "uri": "/etc/passwd"}])),
    "traversal uri gltf": ("a.gltf", gltf(buffers=[{"byteLength": 36, "uri": "../secret.mtl"}])),
    "escaped traversal uri gltf": (
        "a.gltf", gltf(buffers=[{"byteLength": 36, "uri": "%2e%2e/secret.mtl"}])),
    "bad base64 gltf": ("a.gltf", gltf(buffers=[{"byteLength": 36, "uri": "data:;base64,@@@"}])),
    "roughness 1.5 gltf": ("a.gltf", shiny(roughnessFactor=1.5)),
    "negative roughness glb": ("a.glb", glb(shiny(roughnessFactor=-0.1))),
    "nan roughness gltf": ("a.gltf", shiny(roughnessFactor=float("nan"))),
    "metal of 2 gltf": ("a.gltf", shiny(metallicFactor=2)),
    "colour beyond white gltf": ("a.gltf", shiny(baseColorFactor=[1, 1, 3, 1])),
    "draco gltf": ("a.gltf", gltf(extensionsRequired=["KHR_draco_mesh_compression"])),
    "strings for numbers gltf": ("a.gltf", gltf(accessors=accessor(count="three"))),
    "null everywhere gltf": ("a.gltf", gltf(meshes=None, nodes=None)),
    "unknown suffix": ("a.fbx", b"Kaydara"),
}  # fmt: skip


def robot(link: str = "", extra: str = "") -> str:
    geometry = link or '<visual><geometry><box size="1 1 1"/></geometry></visual>'
    return f'<robot name="r"><link name="a">{geometry}</link>{extra}</robot>'


def mesh_link(name: str) -> str:
    return robot(f'<visual><geometry><mesh filename="{name}"/></geometry></visual>')


def joint(parent: str, child: str, name: str = "j", kind: str = "fixed") -> str:
    return (f'<joint name="{name}" type="{kind}"><parent link="{parent}"/>'
            f'<child link="{child}"/></joint>')  # fmt: skip


LAUGHS = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 12))

URDFS: dict[str, str | bytes] = {
    "empty": "",
    "no xml": "hello",
    "other root": "<html/>",
    "billion laughs": f'<!DOCTYPE r [<!ENTITY l0 "ha">{LAUGHS}]><robot>&l11;</robot>',
    "external entity": '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot>&x;</robot>',
    "external dtd": '<!DOCTYPE robot SYSTEM "http://127.0.0.1:9/x.dtd"><robot name="r"/>',
    "utf-16 entity": ('<?xml version="1.0" encoding="utf-16"?><!DOCTYPE r [<!ENTITY x "y">]>'
                      "<robot>&x;</robot>").encode("utf-16"),
    "10,000 levels": "<robot>" + "<a>" * 10_000 + "</a>" * 10_000 + "</robot>",
    "100,000 elements": "<robot>" + "<a/>" * 100_000 + "</robot>",
    "no links": '<robot name="r"/>',
    "nothing to see": robot(" "),
    "two links of one name": robot(extra='<link name="a"/>'),
    "two roots": robot(extra='<link name="b"/>'),
    "own parent": robot(extra=joint("a", "a")),
    "loop": robot(extra='<link name="b"/><link name="c"/>' + joint("b", "c", "j1")
                  + joint("c", "b", "j2")),
    "two parents": robot(extra='<link name="b"/><link name="c"/>' + joint("a", "c", "j1")
                         + joint("b", "c", "j2") + joint("a", "b", "j3")),
    "joint to nowhere": robot(extra=joint("a", "z")),
    "unknown joint type": robot(extra='<link name="b"/>' + joint("a", "b", kind="magic")),
    "no limits": robot(extra='<link name="b"/>' + joint("a", "b", kind="revolute")),
    "nan pose": robot('<visual><origin xyz="nan 0 0"/>'
                      '<geometry><box size="1 1 1"/></geometry></visual>'),
    "two numbers": robot('<visual><geometry><box size="1 1"/></geometry></visual>'),
    "negative nothing box": robot('<visual><geometry><box size="0 0 0"/></geometry></visual>'),
    "unknown geometry": robot("<visual><geometry><plane/></geometry></visual>"),
    "xacro": robot('<visual><geometry><box size="${1+1} 1 1"/></geometry></visual>'),
    "mesh missing": mesh_link("none.stl"),
    "mesh traversal": mesh_link("../../secret.obj"),
    "mesh absolute": mesh_link("/etc/passwd"),
    "mesh package traversal": mesh_link("package://x/../../secret.obj"),
    "mesh url": mesh_link("http://127.0.0.1:9/a.stl"),
    "mesh with newline": mesh_link("a&#10;b.stl"),
    "mesh with nothing": mesh_link(""),
    "mesh is a urdf": mesh_link("a.urdf"),
}  # fmt: skip


def refused(tmp_path: Path, file: str, ask: Callable[[Any], object]) -> str:
    """The message with which an asset is refused, after the general demands on it were checked."""
    folder = tmp_path / "assets"
    (tmp_path / "secret.mtl").write_text(SECRET)
    (tmp_path / "secret.obj").write_text(TETRAHEDRON)
    library = open_library([folder], cache_dir=tmp_path / "cache")
    with pytest.raises(AssetError) as told:
        ask(library)
    message = str(told.value)
    assert re.search(r"[:;] ", message), "place, fact and remedy"
    assert SECRET not in message
    assert len(message) < 600
    assert Path(file).name.partition(".")[0] in message or "secret" in message
    assert not list((tmp_path / "cache").rglob("*.arrays"))
    return message


EXPLAINED = {"truncated ply": "unexpected length", "no element ply": "before any element",
             "unknown type ply": "unknown type or property 'quux'",
             "short property ply": "an incomplete line in its header"}  # fmt: skip
"""Causes of malformed PLY files."""


def in_folder(tmp_path: Path, file: str, content: bytes | str) -> None:
    """Put a file and an index with the asset ``a`` of it into the folder ``assets``."""
    folder = tmp_path / "assets"
    folder.mkdir()
    (folder / file).write_bytes(content if isinstance(content, bytes) else content.encode())
    (folder / "assets.yaml").write_text(f"assets: [{{id: a, file: {file}, category: x}}]\n")


@pytest.mark.hostile
@pytest.mark.parametrize("name", MESHES)
def test_hostile_meshes_are_refused(tmp_path: Path, name: str) -> None:
    """An AssetError within seconds, and nothing is cached; a malformed PLY is explained."""
    file, content = MESHES[name]
    in_folder(tmp_path, file, content)
    message = refused(tmp_path, file, lambda library: library.mesh("user/a"))
    cause = rf"a\.ply: malformed PLY \(.*{EXPLAINED[name]}" if name in EXPLAINED else ""
    assert re.search(cause, message)


FAULTY_JOINTS = {"loop": "joint 'j1' is part of a loop",
                 "two parents": "joint 'j2' closes a loop: link 'c' has another parent already",
                 "no limits": "joint 'j' has no limits"}  # fmt: skip
"""A robot's author finds the joint by its name and its place, which is not the root's."""


@pytest.mark.hostile
@pytest.mark.parametrize("name", URDFS)
def test_hostile_urdfs_are_refused(tmp_path: Path, name: str) -> None:
    """Entities are never expanded, references never leave the folder, trees are trees."""
    in_folder(tmp_path, "a.urdf", URDFS[name])
    message = refused(tmp_path, "a.urdf", lambda library: library.mesh("user/a"))
    assert re.search(
        rf"a\.urdf:1:\d\d+: .*{FAULTY_JOINTS[name]}" if name in FAULTY_JOINTS else "", message
    )


def png_claiming(width: int, height: int) -> bytes:
    """A PNG of a few bytes whose header claims a size."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header)
            + chunk(b"IDAT", zlib.compress(b"\0" * 1000)) + chunk(b"IEND", b""))  # fmt: skip


IMAGES: dict[str, tuple[bytes, str]] = {
    "60,000 pixels square": (png_claiming(60_000, 60_000), "more than 64 megapixels"),
    "20,000 pixels wide": (png_claiming(20_000, 10), "20000 x 10 px"),
    "truncated": (png_claiming(64, 64)[:-30], "unreadable"),
    "fewer pixels than claimed": (png_claiming(640, 640), "unreadable"),
    "noise": (bytes(range(256)), "unreadable"),
    "empty": (b"", "unreadable"),
    "html": (b"<html>404</html>", "unreadable"),
    "postscript": (b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n", "unreadable"),
}


@pytest.mark.hostile
@pytest.mark.parametrize("name", IMAGES)
def test_hostile_images_are_refused(tmp_path: Path, name: str) -> None:
    """Sizes are read from the header, before any pixel is decoded."""
    data, reason = IMAGES[name]
    folder = tmp_path / "assets"
    folder.mkdir()
    (folder / "a.png").write_bytes(data)
    (folder / "a.mtl").write_text("newmtl m\nmap_Kd a.png\n")
    (folder / "a.obj").write_text("mtllib a.mtl\nusemtl m\n" + TETRAHEDRON)
    library = open_library([folder], cache_dir=tmp_path / "cache")
    texture = library.materials("user/a")[0].texture
    with pytest.raises(AssetError, match=reason):
        library.texture(texture)


def test_a_roughness_that_does_not_exist_is_told_by_name(tmp_path: Path) -> None:
    """The file, the factor, its value and the allowed range; at its ends it is read."""
    folder = tmp_path / "assets"
    folder.mkdir()
    for name, value in (("bad", 1.5), ("mirror", 0.0), ("chalk", 1.0)):
        (folder / f"{name}.glb").write_bytes(glb(shiny(roughnessFactor=value)))
    library = open_library([folder], cache_dir=tmp_path / "cache")
    with pytest.raises(AssetError, match=r"bad\.glb: .*roughnessFactor is 1\.5, .* \[0, 1\]"):
        library.mesh("user/bad")
    for name, value in (("mirror", 0.0), ("chalk", 1.0)):
        assert library.materials(f"user/{name}")[0].roughness == value


@pytest.mark.hostile
@pytest.mark.parametrize("reference", ["../secret.mtl", "/etc/passwd", "C:\\x.png", "http://a/b"])
def test_a_texture_outside_the_folder_is_refused(tmp_path: Path, reference: str) -> None:
    folder = tmp_path / "assets"
    folder.mkdir()
    (folder / "a.mtl").write_text(f"newmtl m\nmap_Kd {reference}\n")
    (folder / "a.obj").write_text("mtllib a.mtl\nusemtl m\n" + TETRAHEDRON)
    refused(tmp_path, "a.mtl", lambda library: library.mesh("user/a"))


@pytest.mark.hostile
@pytest.mark.parametrize("kind", ["fifo", "directory", "link outside", "link loop", "device link"])
def test_only_regular_files_inside_the_folder_are_read(tmp_path: Path, kind: str) -> None:
    """Reading a FIFO blocks for ever, a device never ends."""
    folder = tmp_path / "assets"
    folder.mkdir()
    (tmp_path / "secret.obj").write_text(TETRAHEDRON)
    path = folder / "a.obj"
    if kind == "fifo":
        os.mkfifo(path)
    elif kind == "directory":
        path.mkdir()
    elif kind == "link outside":
        path.symlink_to(tmp_path / "secret.obj")
    elif kind == "link loop":
        path.symlink_to(path)
    else:
        path.symlink_to("/dev/zero")
    with pytest.raises(AssetError):
        Folder(folder).read("a.obj")


@pytest.mark.hostile
@pytest.mark.parametrize("name", ["a\0b", "x" * 5000, "../" * 30 + "etc/passwd", "/etc/passwd"])
def test_strange_names_and_image_ids_cannot_leave_the_folder(tmp_path: Path, name: str) -> None:
    with pytest.raises(AssetError):
        Folder(tmp_path).read(name)
    with pytest.raises(AssetError):
        open_library(cache_dir=tmp_path / "cache").texture(f"pybullet/teddy#{name}")


def test_a_file_that_changes_while_it_is_read_is_refused(tmp_path: Path) -> None:
    """The hashed content is the parsed content."""
    folder = tmp_path / "assets"
    folder.mkdir()
    (folder / "a.obj").write_text(TETRAHEDRON)
    library = open_library([folder], cache_dir=tmp_path / "cache")
    library.get("user/a")
    status = (folder / "a.obj").stat()
    (folder / "a.obj").write_text(TETRAHEDRON.replace("v 1 0 0", "v 2 0 0"))
    os.utime(folder / "a.obj", ns=(status.st_atime_ns, status.st_mtime_ns))
    with pytest.raises(AssetError, match="changed while it was read"):
        library.mesh("user/a")


def test_a_polygon_of_twenty_thousand_corners_is_fine(tmp_path: Path) -> None:
    turns = np.arange(20_000) * (2 * np.pi / 20_000)
    lines = [f"v {np.cos(t):.6f} {np.sin(t):.6f} 0" for t in turns]
    folder = tmp_path / "assets"
    folder.mkdir()
    face = " ".join(str(k + 1) for k in range(20_000))
    (folder / "disc.obj").write_text("\n".join([*lines, f"f {face}"]))
    library = open_library([folder], cache_dir=tmp_path / "cache")
    assert len(library.mesh("user/disc").faces) > 1000


def test_a_series_writes_numbers_with_three_digits() -> None:
    """``000`` is the place of the number in id and file."""
    entry = MeshEntry(id="a/000", file="x/000/000.obj", category="c", count=12)
    names = [
        (one.asset_id, one.entry.file) for one in list_assets(FolderIndex(assets=(entry,)), Path())
    ]
    assert names[11] == ("a/011", "x/011/011.obj")


def test_reading_takes_no_more_memory_than_the_file(tmp_path: Path) -> None:
    """A small file under a small limit of memory."""
    (tmp_path / "a.obj").write_bytes(b"v 0 0 0\n" * 100)
    tracemalloc.start()
    try:
        data = Folder(tmp_path).read("a.obj")
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(data) == 800
    assert peak < 1_000_000


def test_an_stl_with_too_many_triangles_is_refused_before_it_is_decoded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.stl").write_bytes(stl(4, 4))
    monkeypatch.setattr("gen_data.assets.readers.mesh_source.MAX_FACES", 3)
    monkeypatch.setattr(TriangleSoup, "of", lambda *_: pytest.fail("decoded"))
    with pytest.raises(AssetError, match="4 triangles, at most 3"):
        read_mesh(Folder(tmp_path), "a.stl")
