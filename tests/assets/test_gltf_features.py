"""glTF as its makers mean it: extensions, second texture sets, colours, skins, sparse values.

Files are built here; expected values follow from the specification of glTF 2.0 and its extensions.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from gen_data.assets.asset_folder import Folder
from gen_data.assets.folder_index import MeshEntry
from gen_data.assets.importer import import_object
from gen_data.assets.readers import read_mesh
from gen_data.core.errors import AssetError
from tests.assets.gltf_builder import POINTS, UVS, Builder


@pytest.fixture
def builder() -> Builder:
    return Builder()


def test_texture_transforms_scale_turn_and_move(builder: Builder, tmp_path: Path) -> None:
    """(u, v) from the top: scaled by (2, 4), a quarter turn counter-clockwise, moved by (0.1, 0.2).

    A quarter turn in the image, whose V points down, takes +U to -V and +V to +U.
    """
    builder.attributes["TEXCOORD_0"] = builder.accessor(UVS)
    transform = {"offset": [0.1, 0.2], "rotation": np.pi / 2, "scale": [2, 4]}
    builder.textured(tmp_path, extensions={"KHR_texture_transform": transform})
    builder.tree["extensionsRequired"] = ["KHR_texture_transform"]
    uvs = builder.read(tmp_path).soup.uvs
    assert uvs is not None
    from_top = np.array([[0.1, 0.2], [0.1, 0.2 - 0.5], [0.1 + 2.0, 0.2]])
    assert uvs[0] == pytest.approx(np.stack([from_top[:, 0], 1 - from_top[:, 1]], axis=1))


def test_the_second_set_of_texture_coordinates(builder: Builder, tmp_path: Path) -> None:
    """``texCoord: 1``; an occlusion image in set 0 is named and left out."""
    builder.attributes["TEXCOORD_0"] = builder.accessor(UVS)
    builder.attributes["TEXCOORD_1"] = builder.accessor(UVS + np.float32(0.5))
    builder.textured(tmp_path, texCoord=1)["occlusionTexture"] = {"index": 0}
    source = builder.read(tmp_path)
    assert source.soup.uvs is not None
    assert source.soup.uvs[0][:, 0] == pytest.approx([0.5, 0.75, 0.5])
    assert source.soup.slots[0].material.texture == "i.png"
    assert any("occlusionTexture is not used" in text for text in source.remarks)


@pytest.mark.parametrize("kind", ["f4", "u1", "u2"])
def test_vertex_colours_are_linear_or_integers(builder: Builder, tmp_path: Path, kind: str) -> None:
    """COLOR_0 red, green, blue."""
    top = {"f4": 1, "u1": 255, "u2": 65535}[kind]
    colors = (np.eye(4)[:3] * top).astype(f"<{kind}")
    colors[:, 3] = top
    builder.attributes["COLOR_0"] = builder.accessor(colors, normalized=kind != "f4")
    soup = builder.read(tmp_path).soup
    assert soup.colors is not None
    assert soup.colors[0].tolist() == np.eye(3).tolist()
    assert soup.slots[0].material.base_color == (1.0, 1.0, 1.0)


def test_instances_are_placed_turned_and_scaled(builder: Builder, tmp_path: Path) -> None:
    """Three copies; the last one is turned by half about Z and twice as large."""
    moves = np.array([[0, 0, 0], [2, 0, 0], [4, 0, 0]], "<f4")
    turns = np.array([[0, 0, 0, 1], [0, 0, 0, 1], [0, 0, 1, 0]], "<f4")
    sizes = np.array([[1, 1, 1], [1, 1, 1], [2, 2, 2]], "<f4")
    rows = {"TRANSLATION": moves, "ROTATION": turns, "SCALE": sizes}
    attributes = {name: builder.accessor(values) for name, values in rows.items()}
    builder.tree["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    builder.tree["extensionsUsed"] = ["EXT_mesh_gpu_instancing"]
    corners = builder.read(tmp_path).soup.corners
    assert corners[1] == pytest.approx(POINTS + np.array([2, 0, 0]))
    assert corners[2] == pytest.approx(np.array([[4, 0, 0], [2, 0, 0], [4, -2, 0]]))


def test_a_skin_takes_the_place_of_its_nodes_transform(builder: Builder, tmp_path: Path) -> None:
    """Joint 1 moves by 1 in Y, its bind matrix halves; weights of 1/4 and 3/4 blend both joints."""
    joints = np.array([[0, 1, 0, 0]] * 3, "<u1")
    weights = np.array([[0.25, 0.75, 0, 0]] * 3, "<f4")
    bind = np.stack([np.eye(4), np.diag([0.5, 0.5, 0.5, 1.0])]).astype("<f4")
    builder.attributes |= {
        "JOINTS_0": builder.accessor(joints),
        "WEIGHTS_0": builder.accessor(weights),
    }
    matrices = builder.accessor(bind.reshape(-1, 16))
    builder.tree["nodes"] = [{"mesh": 0, "skin": 0, "scale": [5, 5, 5]}, {"name": "a"},
                             {"name": "b", "translation": [0, 1, 0]}]  # fmt: skip
    builder.tree["scenes"] = [{"nodes": [0, 1, 2]}]
    builder.tree["skins"] = [{"joints": [1, 2], "inverseBindMatrices": matrices}]
    corners = builder.read(tmp_path).soup.corners[0]
    assert corners == pytest.approx(0.25 * POINTS + 0.75 * (0.5 * POINTS + [0, 1, 0]))


def test_morph_targets_apply_by_their_weights_at_rest(builder: Builder, tmp_path: Path) -> None:
    """Half of a target that moves all points by 2 in Z."""
    target = np.tile(np.array([0, 0, 2], "<f4"), (3, 1))
    builder.primitive["targets"] = [{"POSITION": builder.accessor(target)}]
    builder.tree["meshes"][0]["weights"] = [0.5]
    assert builder.read(tmp_path).soup.corners[0][:, 2].tolist() == [1.0, 1.0, 1.0]


def test_morph_targets_move_normals_and_leave_them_without_own_ones(
    builder: Builder, tmp_path: Path
) -> None:
    """At weight 0.5, (0, 0, 1) plus half of (0.6, 0, -0.4) is (0.3, 0, 0.8)."""
    builder.attributes["NORMAL"] = builder.accessor(np.array([[0, 0, 1]] * 3, "<f4"))
    still = builder.accessor(np.zeros((3, 3), "<f4"))
    turn = builder.accessor(np.array([[0.6, 0, -0.4]] * 3, "<f4"))
    builder.tree["meshes"][0]["weights"] = [0.5, 1.0]
    builder.primitive["targets"] = [{"POSITION": still, "NORMAL": turn}, {"POSITION": still}]
    normals = builder.read(tmp_path).soup.normals
    assert normals is not None
    assert normals[0] == pytest.approx(np.array([[0.3, 0, 0.8]] * 3))


def test_triangles_without_normals_are_flat_next_to_smooth_ones(
    builder: Builder, tmp_path: Path
) -> None:
    """A ridge of 20 degrees without normals, next to a triangle with some; glTF 2.0, 3.7.2.1."""
    tilted = np.array([[0.6, 0, 0.8], [0, 0.6, 0.8], [0, 0, 1]], "<f4")
    builder.attributes["NORMAL"] = builder.accessor(tilted)
    c, s = np.cos(np.radians(20)), np.sin(np.radians(20))
    ridge = np.array([[5, 0, 0], [5, 1, 0], [5 - c, 0, s], [6, 0, 0]], "<f4")
    indices = builder.accessor(np.array([0, 1, 2, 0, 3, 1], "<u2"))
    rough = {"attributes": {"POSITION": builder.accessor(ridge)}, "indices": indices}
    builder.tree["meshes"][0]["primitives"].append(rough)
    builder.write(tmp_path)
    mesh = import_object(Folder(tmp_path), MeshEntry(file="a.gltf", up="z"), "user/a").mesh
    assert mesh is not None
    expected = [tilted, [[s, 0, c]] * 3, [[0, 0, 1]] * 3]
    assert mesh.normals[mesh.faces] == pytest.approx(np.array(expected), abs=1e-4)


def test_a_mesh_of_scale_0_has_no_place(builder: Builder, tmp_path: Path) -> None:
    """100 m away: it would be the object's border, and move its origin."""
    hidden = {"mesh": 0, "scale": [0, 0, 0], "translation": [100, 0, 0]}
    builder.tree["nodes"] = [{"mesh": 0}, {"children": [2], "rotation": [0.6, 0, 0, 0.8]}, hidden]
    builder.tree["scenes"] = [{"nodes": [0, 1]}]
    builder.write(tmp_path)
    imported = import_object(Folder(tmp_path), MeshEntry(file="a.gltf", up="z"), "user/a")
    assert imported.shift_m == (-0.5, -0.5, 0.0)
    assert imported.mesh is not None and len(imported.mesh.faces) == 1
    assert imported.mesh.bounds_m() == ((-0.5, -0.5, 0.0), (0.5, 0.5, 0.0))


@pytest.mark.parametrize("length", [0.5, 0.9999, 1.0, 2.0])
def test_quaternions_of_any_length_are_turns(
    builder: Builder, tmp_path: Path, length: float
) -> None:
    """A quarter turn about Z takes X to Y."""
    half = length * np.sqrt(0.5)
    builder.tree["nodes"][0]["rotation"] = [0, 0, half, half]
    corners = builder.read(tmp_path).soup.corners[0]
    assert corners == pytest.approx(np.array([[0, 0, 0], [0, 1, 0], [-1, 0, 0]]))


def test_sparse_accessors_replace_single_values(builder: Builder, tmp_path: Path) -> None:
    """Point 1 is replaced; without a buffer view, the others are zero."""
    sparse = {"count": 1,
              "indices": {"bufferView": builder.view(np.array([1], "<u2")), "componentType": 5123},
              "values": {"bufferView": builder.view(np.array([7, 8, 9], "<f4"))}}  # fmt: skip
    builder.tree["accessors"][0]["sparse"] = sparse
    assert builder.read(tmp_path).soup.corners[0].tolist() == [[0, 0, 0], [7, 8, 9], [0, 1, 0]]
    del builder.tree["accessors"][0]["bufferView"]
    assert builder.read(tmp_path).soup.corners[0].tolist() == [[0, 0, 0], [7, 8, 9], [0, 0, 0]]


def test_webp_images_and_hidden_nodes(builder: Builder, tmp_path: Path) -> None:
    """EXT_texture_webp without a fallback; KHR_node_visibility hides a second triangle."""
    builder.attributes["TEXCOORD_0"] = builder.accessor(UVS)
    builder.textured(tmp_path)
    Image.new("RGB", (2, 2), (200, 0, 0)).save(tmp_path / "i.webp")
    builder.tree["images"] = [{"uri": "i.webp"}]
    builder.tree["textures"] = [{"extensions": {"EXT_texture_webp": {"source": 0}}}]
    hidden = {"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": False}}}
    builder.tree["nodes"].append(hidden)
    builder.tree["scenes"] = [{"nodes": [0, 1]}]
    soup = builder.read(tmp_path).soup
    assert len(soup) == 1
    assert soup.slots[0].material.texture == "i.webp"


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ({"diffuseFactor": [0.5, 0.2, 0.1, 1], "specularFactor": [0.04] * 3,
          "glossinessFactor": 0.25}, ((0.5, 0.2, 0.1), 0.75, 0.0, 0.5)),
        # Without reflection.
        ({"diffuseFactor": [0.5, 0.2, 0.1, 1], "specularFactor": [0, 0, 0],
          "glossinessFactor": 0.0}, ((0.5, 0.2, 0.1), 1.0, 0.0, 0.0)),
        # Black, with the reflection of gold: a metal of that colour.
        ({"diffuseFactor": [0, 0, 0, 1], "specularFactor": [1.0, 0.77, 0.34],
          "glossinessFactor": 1.0}, ((1.0, 0.77, 0.34), 0.0, 1.0, 1.0)),
    ],
    ids=["plastic", "cloth", "gold"],
)  # fmt: skip
def test_specular_glossiness(
    builder: Builder, tmp_path: Path, content: dict[str, Any],
    expected: tuple[tuple[float, float, float], float, float, float],
) -> None:  # fmt: skip
    """Colour, roughness, metalness and reflectance that look the same."""
    builder.material(extensions={"KHR_materials_pbrSpecularGlossiness": content})
    builder.tree["extensionsRequired"] = ["KHR_materials_pbrSpecularGlossiness"]
    material = builder.read(tmp_path).soup.slots[0].material
    found = (material.base_color, material.roughness, material.metallic, material.specular)
    assert found == expected


@pytest.mark.parametrize(
    "name",
    ["KHR_materials_", "KHR_materials_sheen", "KHR_texture_transform2", "KHR_texture_basisu"],
)
def test_extensions_are_compared_as_whole(builder: Builder, tmp_path: Path, name: str) -> None:
    """Unsupported extensions are refused if required, and named if used."""
    builder.tree["extensionsUsed"] = [name]
    assert builder.read(tmp_path).remarks == (f"the extension {name} is not used",)
    builder.tree["extensionsRequired"] = [name]
    with pytest.raises(AssetError, match=f"requires the unsupported {name}"):
        builder.read(tmp_path)


def test_bytes_after_a_binary_file(builder: Builder, tmp_path: Path) -> None:
    """Padding behind the stated length is named; a file that is too short is refused."""
    whole = builder.glb()
    (tmp_path / "a.glb").write_bytes(whole + b"\0\0\0")
    assert read_mesh(Folder(tmp_path), "a.glb").remarks == ("3 bytes after its end are not read",)
    (tmp_path / "a.glb").write_bytes(whole[:-1])
    with pytest.raises(AssetError, match="its header states version 2"):
        read_mesh(Folder(tmp_path), "a.glb")


@pytest.mark.parametrize(
    ("name", "tool"),
    [("KHR_draco_mesh_compression", "gltf-transform copy IN OUT"),
     ("EXT_meshopt_compression", "gltfpack -i IN -o OUT -noq"),
     ("KHR_texture_basisu", "gltf-transform ktxdecompress IN OUT")],
)  # fmt: skip
def test_compressed_files_are_refused_with_the_tool_that_unpacks_them(
    builder: Builder, tmp_path: Path, name: str, tool: str
) -> None:
    builder.tree["extensionsRequired"] = [name]
    with pytest.raises(AssetError, match=rf"a\.gltf: requires the unsupported {name}; .*`{tool}`"):
        builder.read(tmp_path)


@pytest.mark.parametrize(
    ("changes", "version"),
    [({"asset": {"version": "1.0"}}, "1.0"), ({"asset": {}, "meshes": {"m": {}}}, "1.0"),
     ({"asset": {"version": "2.1", "minVersion": "2.1"}}, "2.1"),
     ({"asset": {"version": "2.1"}}, ""), ({"asset": {"version": "3.0", "minVersion": "2.0"}}, "")],
)  # fmt: skip
def test_other_versions_are_refused_unless_they_allow_readers_of_2_0(
    builder: Builder, tmp_path: Path, changes: dict[str, Any], version: str
) -> None:
    """``minVersion`` is the oldest version whose readers may read the file."""
    builder.tree |= changes
    if not version:
        assert len(builder.read(tmp_path).soup) == 1
        return
    with pytest.raises(AssetError, match=rf"a\.gltf: is glTF {version}, not 2\.0; "):
        builder.read(tmp_path)
    (tmp_path / "a.glb").write_bytes(b"glTF\x01\0\0\0" + builder.glb()[8:])
    with pytest.raises(AssetError, match=r"is glTF 1\.0, not 2\.0; .*`gltf-pipeline -i IN -o OUT`"):
        read_mesh(Folder(tmp_path), "a.glb")


def test_only_the_first_buffer_is_the_binary_chunk(builder: Builder, tmp_path: Path) -> None:
    """A second buffer without an address, as compression leaves it, has no data."""
    (tmp_path / "a.glb").write_bytes(builder.glb(buffers=2))
    assert len(read_mesh(Folder(tmp_path), "a.glb").soup) == 1
    builder.tree["bufferViews"][0]["buffer"] = 1
    (tmp_path / "a.glb").write_bytes(builder.glb(buffers=2))
    with pytest.raises(AssetError, match="buffer 1 has no data"):
        read_mesh(Folder(tmp_path), "a.glb")


@pytest.mark.parametrize(
    "fault",
    [{"roughnessFactor": 1.5}, {"baseColorTexture": {"index": 0}},
     {"baseColorTexture": {"index": 1}}, {"baseColorTexture": {"index": 9}}],
    ids=["a value", "an image that is not there", "a kind of image", "a texture"],
)  # fmt: skip
def test_a_material_that_no_triangle_uses_may_have_any_fault(
    builder: Builder, tmp_path: Path, fault: dict[str, Any]
) -> None:
    builder.material()
    images = [{"uri": "none.png"}, {"uri": "i.ktx2"}]
    textures = [{"source": 0}, {"extensions": {"KHR_texture_basisu": {"source": 1}}}]
    faulty = {"alphaMode": "BLEND", "pbrMetallicRoughness": fault}
    builder.tree |= {"images": images, "textures": textures}
    builder.tree["materials"].append(faulty)
    assert builder.read(tmp_path).soup.slots[0].name == "m"
    builder.primitive["material"] = 1
    with pytest.raises(AssetError):
        builder.read(tmp_path)


@pytest.mark.parametrize(
    "material",
    [{"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 0]}},
     {"alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 0.2]}},
     {"alphaMode": "MASK", "alphaCutoff": 1.5}],
    ids=["BLEND", "MASK", "MASK beyond 1"],
)  # fmt: skip
def test_the_unseen_is_no_asset(builder: Builder, tmp_path: Path, material: dict[str, Any]) -> None:
    """Alpha 0, or below the threshold of a mask."""
    builder.material(**material)
    builder.write(tmp_path)
    with pytest.raises(AssetError, match="all its materials are fully transparent"):
        import_object(Folder(tmp_path), MeshEntry(file="a.gltf"), "user/a")


def test_unread_content_is_named_and_unknown_ones_refused(builder: Builder, tmp_path: Path) -> None:
    """Contents that do not change the triangles at rest."""
    builder.tree["animations"] = [{"channels": [], "samplers": []}]
    builder.tree["cameras"] = [{"type": "perspective"}]
    builder.tree["scenes"].append({"nodes": []})
    builder.tree["extensions"] = {
        "KHR_lights_punctual": {"lights": [{"type": "point"}] * 2},
        "KHR_materials_variants": {"variants": [{"name": "red"}]},
    }
    builder.tree["extensionsUsed"] = list(builder.tree["extensions"])
    builder.primitive["targets"] = [{"POSITION": 0}]
    further = [{"attributes": builder.attributes, "mode": 1}, {"attributes": {}}]
    builder.tree["meshes"][0]["primitives"] += further
    builder.attributes["TEXCOORD_0"] = builder.accessor(UVS)
    builder.textured(tmp_path)
    builder.tree["textures"] = [{}]
    assert builder.read(tmp_path).remarks == (
        "1 animations are not used: it is read at rest",
        "1 cameras are not used",
        "2 lights are not used",
        "1 variants of materials are not used: the default ones are read",
        "1 further scenes are not read",
        "textures without an image are not used",
        "morph targets of weight 0 are not used",
        "lines and points are not read",
        "primitives without positions are not read",
    )
    builder.tree["accessors"][0]["componentType"] = 9999
    with pytest.raises(AssetError, match="accessor 0 has the unknown componentType 9999"):
        builder.read(tmp_path)


@pytest.mark.parametrize(
    ("data", "reason"),
    [(b"\xcd\x00\x00\x00binary", "neither like JSON nor like a binary glTF"),
     (b'{"asset": 3', "malformed glTF")],
)  # fmt: skip
def test_other_files_are_refused_in_words(tmp_path: Path, data: bytes, reason: str) -> None:
    (tmp_path / "a.glb").write_bytes(data)
    with pytest.raises(AssetError, match=reason):
        read_mesh(Folder(tmp_path), "a.glb")
