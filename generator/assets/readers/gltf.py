"""glTF 2.0, text and binary (Khronos, "glTF 2.0 specification", 2021).

Triangles, the first UV set and materials (see ``gltf_materials``) are read. Morph targets, skins,
animations, cameras and lights are ignored; compressed geometry is refused.
"""

from __future__ import annotations

import base64
import binascii
import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.assets.asset_folder import Folder
from gen_data.generator.assets.image_decoding import decode_image
from gen_data.generator.assets.readers.gltf_materials import Images, gltf_material
from gen_data.generator.assets.readers.mesh_source import MAX_FACES, MeshSource
from gen_data.generator.assets.triangle_soup import (
    Float64,
    Int64,
    MaterialSlot,
    TriangleSoup,
    join_soups,
)
from gen_data.generator.core.asset_types import UInt8
from gen_data.generator.core.errors import AssetError

_JSON_CHUNK, _BINARY_CHUNK = 0x4E4F534A, 0x004E4942
_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_MAX_PARTS = 50_000
"""Bound on nodes, and on primitives of all nodes: each takes about 0.1 ms."""
_NAME_MAX = 400
"""Bound on the characters kept of names of nodes."""
_SUPPORTED_EXTENSIONS = (
    "KHR_materials_",
    "KHR_texture_transform",
    "KHR_mesh_quantization",
    "KHR_lights_",
)


@dataclass
class _Document:
    """A parsed file; buffers and embedded images are loaded on first use."""

    folder: Folder
    relative: str
    tree: dict[str, Any]
    binary: bytes
    buffers: dict[int, bytes] = field(default_factory=dict)
    images: dict[str, bytes] = field(default_factory=dict)


def read_gltf(folder: Folder, relative: str, materials: bool) -> MeshSource:
    """Read the triangles of the default scene of a glTF file, in its own axes (Y up).

    Raises:
        AssetError: if it is malformed, states more data than it holds, or requires an unsupported
            extension.
    """
    data = folder.read(relative)
    try:
        document = _parse_document(folder, relative, data)
        described = _get_list(document, "materials")
        slots = (
            *(_make_slot(document, m) if materials else MaterialSlot() for m in described),
            MaterialSlot(),
        )
        meshes = _mesh_instances(document)
        if sum(len(mesh["primitives"]) for _, mesh, _ in meshes) > _MAX_PARTS:
            raise ValueError(f"more than {_MAX_PARTS} primitives; join them")
        parts = [
            part
            for matrix, mesh, name in meshes
            for part in _read_primitives(document, mesh, matrix, slots, name)
        ]
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, RecursionError) as error:
        reason = f"missing {error}" if isinstance(error, KeyError) else str(error)[:120]
        raise AssetError(
            f"{folder.root / relative}: malformed glTF ({reason}); export it again"
        ) from None
    if not parts:
        raise AssetError(f"{folder.root / relative}: holds no triangles; export it with its mesh")
    return MeshSource(join_soups(parts), document.images)


def _parse_document(folder: Folder, relative: str, data: bytes) -> _Document:
    text, binary = _split_chunks(data) if data[:4] == b"glTF" else (data, b"")
    tree = json.loads(text.decode("utf-8"))
    if not isinstance(tree, dict):
        raise ValueError("not a JSON object")
    for extension in tree.get("extensionsRequired", []):
        if not str(extension).startswith(_SUPPORTED_EXTENSIONS):
            raise ValueError(f"it requires the unsupported {extension}")
    return _Document(folder, relative, tree, binary)


def _split_chunks(data: bytes) -> tuple[bytes, bytes]:
    _, version, length = struct.unpack_from("<4sII", data.ljust(12, b"\0"))
    if version != 2 or length != len(data):
        raise ValueError(f"its header says version {version}, {length} of {len(data)} bytes")
    chunks: dict[int, bytes] = {}
    offset = 12
    while offset + 8 <= length:
        size, kind = struct.unpack_from("<II", data, offset)
        if offset + 8 + size > length:
            raise ValueError("a chunk is longer than the file")
        chunks.setdefault(kind, data[offset + 8 : offset + 8 + size])
        offset += 8 + size
    return chunks[_JSON_CHUNK], chunks.get(_BINARY_CHUNK, b"")


def _get_list(document: _Document, key: str) -> list[Any]:
    value = document.tree.get(key, [])
    if not isinstance(value, list):
        raise TypeError(f"'{key}' is not a list")
    return value


def _get_item(items: Sequence[Any], index: Any, what: str) -> Any:
    if not isinstance(index, int) or not 0 <= index < len(items):
        raise ValueError(f"{what} {index} does not exist")
    return items[index]


def _mesh_instances(document: _Document) -> list[tuple[Float64, Mapping[str, Any], str]]:
    """``(matrix [4, 4], mesh, name)`` of the mesh nodes of the default scene, in document order.

    The name consists of those of the node, its ancestors and its mesh.
    """
    nodes, meshes = _get_list(document, "nodes"), _get_list(document, "meshes")
    if len(nodes) > _MAX_PARTS:
        raise ValueError(f"{len(nodes)} nodes, at most {_MAX_PARTS}; join them")
    scenes = _get_list(document, "scenes")
    if scenes:
        roots = list(_get_item(scenes, document.tree.get("scene", 0), "scene").get("nodes", []))
    else:
        children = {c for node in nodes for c in node.get("children", [])}
        roots = [k for k in range(len(nodes)) if k not in children]
    placed: list[tuple[Float64, Mapping[str, Any], str]] = []
    visited: set[int] = set()
    pending = [(index, np.eye(4), "") for index in reversed(roots)]
    while pending:
        index, parent, path = pending.pop()
        node = _get_item(nodes, index, "node")
        if index in visited:
            raise ValueError(f"node {index} has two parents or is its own ancestor")
        visited.add(index)
        matrix = _product(parent, _local_matrix(node))
        path = f"{path}/{str(node.get('name', ''))[:_NAME_MAX]}"[-_NAME_MAX:]
        if "mesh" in node:
            mesh = _get_item(meshes, node["mesh"], "mesh")
            placed.append((matrix, mesh, f"{path}/{str(mesh.get('name', ''))[:_NAME_MAX]}"))
        pending += [(child, matrix, path) for child in reversed(node.get("children", []))]
    return placed


def _local_matrix(node: Mapping[str, Any]) -> Float64:
    if "matrix" in node:
        rows: Float64 = np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
        return rows
    x, y, z, w = (float(v) for v in node.get("rotation", (0.0, 0.0, 0.0, 1.0)))
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = rotation * np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=np.float64)
    matrix[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return matrix


def _product(a: Float64, b: Float64) -> Float64:
    product: Float64 = np.einsum("ij,jk->ik", a, b, optimize=False)
    return product


def _read_primitives(
    document: _Document,
    mesh: Mapping[str, Any],
    matrix: Float64,
    slots: tuple[MaterialSlot, ...],
    name: str,
) -> list[TriangleSoup]:
    soups = []
    for primitive in mesh["primitives"]:
        if primitive.get("mode", _TRIANGLES) not in (_TRIANGLES, _STRIP, _FAN):
            continue
        slot = _get_item(slots, primitive.get("material", len(slots) - 1), "material")
        soup = replace(_read_primitive(document, primitive, slot), group_names=(name,))
        soups.append(soup.transformed(matrix[:3]))
    return soups


def _read_primitive(
    document: _Document, primitive: Mapping[str, Any], slot: MaterialSlot
) -> TriangleSoup:
    attributes = primitive["attributes"]
    positions = _read_accessor(document, attributes["POSITION"], 3).astype(np.float64)
    if "indices" in primitive:
        indices = _read_accessor(document, primitive["indices"], 1).astype(np.int64)[:, 0]
    else:
        indices = np.arange(len(positions))
    faces = _index_triangles(indices, primitive.get("mode", _TRIANGLES))
    if len(faces) > MAX_FACES:
        raise ValueError(f"more than {MAX_FACES} triangles")
    if len(faces) and (faces.max() >= len(positions) or faces.min() < 0):
        raise ValueError("an index out of range")
    uvs = _optional_attribute(document, attributes, "TEXCOORD_0", 2, len(positions))
    normals = _optional_attribute(document, attributes, "NORMAL", 3, len(positions))
    if uvs is not None:
        # glTF measures V from the top of the image.
        uvs = np.stack([uvs[:, 0], 1.0 - uvs[:, 1]], axis=1)
    zeros = np.zeros(len(faces), dtype=np.int64)
    return TriangleSoup(
        corners=positions[faces],
        uvs=None if uvs is None else uvs[faces],
        normals=None if normals is None else normals[faces],
        face_slots=zeros,
        face_groups=zeros,
        slots=(slot,),
    )


def _index_triangles(indices: Int64, mode: int) -> Int64:
    if mode == _TRIANGLES:
        return indices[: len(indices) // 3 * 3].reshape(-1, 3)
    if mode == _FAN:
        first = np.repeat(indices[:1], max(len(indices) - 2, 0))
        return np.stack([first, indices[1:-1], indices[2:]], axis=1)
    faces = np.stack([indices[:-2], indices[1:-1], indices[2:]], axis=1)
    faces[1::2] = faces[1::2, [1, 0, 2]]
    return faces


def _optional_attribute(
    document: _Document, attributes: Mapping[str, Any], name: str, width: int, count: int
) -> Float64 | None:
    if name not in attributes:
        return None
    values = _read_accessor(document, attributes[name], width).astype(np.float64)
    if len(values) != count:
        raise ValueError(f"{name} has {len(values)} entries for {count} positions")
    return values


def _read_accessor(document: _Document, index: Any, width: int) -> NDArray[Any]:
    """Values of an accessor [count, width]; normalized integers become floats."""
    accessor = _get_item(_get_list(document, "accessors"), index, "accessor")
    if "sparse" in accessor or "bufferView" not in accessor:
        raise ValueError(f"accessor {index} is sparse or empty, which is not supported")
    view = _get_item(_get_list(document, "bufferViews"), accessor["bufferView"], "buffer view")
    data = _view_bytes(document, view)
    dtype = np.dtype(_COMPONENTS[accessor["componentType"]])
    if _WIDTHS.get(accessor["type"]) != width:
        raise ValueError(f"accessor {index} has type {accessor['type']}")
    offset, count = int(accessor.get("byteOffset", 0)), int(accessor["count"])
    item = dtype.itemsize * width
    stride = int(view.get("byteStride", 0)) or item
    if count < 1 or offset < 0 or stride < item or offset + stride * (count - 1) + item > len(data):
        raise ValueError(f"accessor {index} exceeds its buffer")
    values: NDArray[Any] = np.ndarray((count, width), dtype, data, offset, (stride, dtype.itemsize))
    if accessor.get("normalized") and dtype.kind in "iu":
        values = np.maximum(values / np.iinfo(dtype).max, -1.0)
    return values


def _view_bytes(document: _Document, view: Mapping[str, Any]) -> bytes:
    number = view["buffer"]
    if number not in document.buffers:
        buffer = _get_item(_get_list(document, "buffers"), number, "buffer")
        document.buffers[number] = (
            _read_uri(document, buffer["uri"]) if "uri" in buffer else document.binary
        )
    data = document.buffers[number]
    offset, length = int(view.get("byteOffset", 0)), int(view["byteLength"])
    if offset < 0 or length < 0 or offset + length > len(data):
        raise ValueError("a buffer view exceeds its buffer")
    return data[offset : offset + length]


def _read_uri(document: _Document, uri: str) -> bytes:
    if not uri.startswith("data:"):
        relative = document.folder.refer(document.relative, unquote(uri))
        return document.folder.read(relative)
    try:
        return base64.b64decode(uri.partition(",")[2], validate=True)
    except binascii.Error:
        raise ValueError("a data URI that is not base64") from None


def _make_slot(document: _Document, description: Mapping[str, Any]) -> MaterialSlot:
    place = f"{document.folder.root / document.relative}"

    def pixels(name: str) -> UInt8:
        encoded = document.images.get(name) or document.folder.read(name)
        return decode_image(encoded, f"{place}#{name}", alpha=True)

    name = str(description.get("name", ""))
    images = Images(lambda reference: _image_name(document, reference), cache(pixels))
    try:
        return MaterialSlot(name, gltf_material(description, images), from_file=True)
    except ValueError as error:
        raise ValueError(f"material '{name[:40]}': {error}") from None


def _image_name(document: _Document, reference: Mapping[str, Any]) -> str:
    """Name of a texture reference's image: its path, or the number of an embedded image."""
    texture = _get_item(_get_list(document, "textures"), reference["index"], "texture")
    number = texture.get("source")
    image = _get_item(_get_list(document, "images"), number, "image")
    if "uri" in image and not image["uri"].startswith("data:"):
        return document.folder.refer(document.relative, unquote(image["uri"]))
    name = str(number)
    if "uri" in image:
        document.images[name] = _read_uri(document, image["uri"])
    else:
        view = _get_item(_get_list(document, "bufferViews"), image["bufferView"], "buffer view")
        document.images[name] = _view_bytes(document, view)
    return name
