"""Parsed glTF 2.0 files: their JSON tree, buffers and accessors."""

import base64
import binascii
import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from gen_data.assets.asset_folder import Folder
from gen_data.assets.readers.mesh_source import locate_file
from gen_data.core.errors import AssetError

_JSON_CHUNK, _BINARY_CHUNK = 0x4E4F534A, 0x004E4942
_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_APPLIED = frozenset(
    {
        "EXT_mesh_gpu_instancing", "EXT_texture_webp", "KHR_lights_punctual",
        "KHR_materials_clearcoat", "KHR_materials_diffuse_transmission",
        "KHR_materials_emissive_strength", "KHR_materials_ior",
        "KHR_materials_pbrSpecularGlossiness", "KHR_materials_specular",
        "KHR_materials_transmission", "KHR_materials_unlit", "KHR_materials_variants",
        "KHR_materials_volume", "KHR_mesh_quantization", "KHR_node_visibility",
        "KHR_texture_transform", "KHR_xmp_json_ld",
    }
)  # fmt: skip
"""Extensions that are applied, do not change the look of an object, or are named by content."""
_UNPACK = "decompress it by `gltfpack -i IN -o OUT -noq`"
_REMEDIES = {
    "EXT_meshopt_compression": _UNPACK,
    "KHR_draco_mesh_compression": "decompress it by `gltf-transform copy IN OUT`",
    "KHR_meshopt_compression": _UNPACK,
    "KHR_texture_basisu": "turn its images to PNG by `gltf-transform ktxdecompress IN OUT`",
}


@dataclass
class Document:
    """A parsed file; buffers and embedded images are loaded on first use.

    Attributes:
        remarks: Its unused contents, as far as its readers have found them.
    """

    folder: Folder
    relative: str
    tree: dict[str, Any]
    binary: bytes
    buffers: dict[int, bytes] = field(default_factory=dict)
    images: dict[str, bytes] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)

    def list_of(self, key: str) -> list[Any]:
        """A list at the top of the tree; empty if it is absent."""
        value = self.tree.get(key, [])
        if not isinstance(value, list):
            raise TypeError(f"'{key}' is not a list")
        return value

    def item(self, key: str, index: Any, name: str) -> Any:
        """An item of such a list. Raises ValueError if there is none."""
        return get_item(self.list_of(key), index, name)


def get_item(items: Sequence[Any], index: Any, name: str) -> Any:
    """An item by its index. Raises ValueError with its name if there is none."""
    if not isinstance(index, int) or not 0 <= index < len(items):
        raise ValueError(f"{name} {index} does not exist")
    return items[index]


def parse_document(folder: Folder, relative: str, data: bytes) -> Document:
    """Parse a text or binary file.

    Raises:
        AssetError: if it has another version or requires an unsupported extension.
        ValueError, KeyError, TypeError: if it is malformed.
    """
    remarks: list[str] = []
    text, binary = data, b""
    if data[:8] == b"glTF\x01\0\0\0":
        raise _other_version(folder, relative, "1.0")
    if data[:4] == b"glTF":
        text, binary = _split_chunks(data, remarks)
    elif data.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] != b"{":
        raise ValueError("it begins neither like JSON nor like a binary glTF")
    tree = json.loads(text.decode("utf-8-sig"))
    if not isinstance(tree, dict):
        raise ValueError("not a JSON object")
    asset = tree.get("asset", {})
    # Version 1.0 may leave the version out, and has objects where 2.0 has lists.
    version = "1.0" if isinstance(tree.get("meshes"), dict) else str(asset.get("version", "2.0"))
    least = str(asset.get("minVersion", f"{version.partition('.')[0]}.0"))
    if least != "2.0":
        raise _other_version(folder, relative, least)
    for extension in tree.get("extensionsRequired", []):
        if extension not in _APPLIED:
            raise unsupported_extension(folder, relative, extension)
    unused = sorted({str(name) for name in tree.get("extensionsUsed", [])} - _APPLIED)
    remarks += [f"the extension {name} is not used" for name in unused]
    further = tree.get("extensions", {})
    contents = {
        "animations are not used: it is read at rest": tree.get("animations"),
        "cameras are not used": tree.get("cameras"),
        "lights are not used": further.get("KHR_lights_punctual", {}).get("lights"),
        "variants of materials are not used: the default ones are read": further.get(
            "KHR_materials_variants", {}
        ).get("variants"),
    }
    remarks += [f"{len(items)} {text}" for text, items in contents.items() if items]
    return Document(folder, relative, tree, binary, remarks=remarks)


def unsupported_extension(folder: Folder, relative: str, name: str) -> AssetError:
    """The refusal of a file that cannot be read without an extension."""
    remedy = _REMEDIES.get(name, "export it without")
    return AssetError(f"{folder.root / relative}: requires the unsupported {name[:80]}; {remedy}")


def _other_version(folder: Folder, relative: str, version: str) -> AssetError:
    remedy = "export it as 2.0"
    if version == "1.0":
        remedy = "convert it by `gltf-pipeline -i IN -o OUT`"
    return AssetError(f"{folder.root / relative}: is glTF {version[:20]}, not 2.0; {remedy}")


def _split_chunks(data: bytes, remarks: list[str]) -> tuple[bytes, bytes]:
    _, version, length = struct.unpack_from("<4sII", data.ljust(12, b"\0"))
    if version != 2 or length > len(data):
        raise ValueError(f"its header states version {version}, {length} of {len(data)} bytes")
    if length < len(data):
        remarks.append(f"{len(data) - length} bytes after its end are not read")
    chunks: dict[int, bytes] = {}
    offset = 12
    while offset + 8 <= length:
        size, kind = struct.unpack_from("<II", data, offset)
        if offset + 8 + size > length:
            raise ValueError("a chunk is longer than the file")
        chunks.setdefault(kind, data[offset + 8 : offset + 8 + size])
        offset += 8 + size
    return chunks[_JSON_CHUNK], chunks.get(_BINARY_CHUNK, b"")


def read_accessor(document: Document, index: Any, width: int) -> NDArray[Any]:
    """Values of an accessor [count, width]; normalized integers become floats.

    Raises:
        ValueError, KeyError: if it exceeds its buffer or has another type.
    """
    accessor = document.item("accessors", index, "accessor")
    dtype = _component_type(accessor, f"accessor {index}")
    if _WIDTHS.get(accessor["type"]) != width:
        raise ValueError(f"accessor {index} has type {accessor['type']}")
    count = int(accessor["count"])
    if "bufferView" in accessor:
        values = _read_values(document, accessor, dtype, count, width, f"accessor {index}")
    elif "sparse" not in accessor:
        raise ValueError(f"accessor {index} is empty: its data are compressed or missing")
    elif not 0 < count <= _MAX_SPARSE:
        raise ValueError(f"accessor {index} counts {count} values")
    else:
        values = np.zeros((count, width), dtype)
    if "sparse" in accessor:
        values = _replace_sparse(document, accessor["sparse"], values.copy(), f"accessor {index}")
    if accessor.get("normalized") and dtype.kind in "iu":
        values = np.maximum(values / np.iinfo(dtype).max, -1.0)
    return values


_MAX_SPARSE = 20_000_000
"""Bound on values that a file states without holding them."""


def _component_type(accessor: Mapping[str, Any], name: str) -> np.dtype[Any]:
    kind = accessor["componentType"]
    if kind not in _COMPONENTS:
        raise ValueError(f"{name} has the unknown componentType {kind}")
    return np.dtype(_COMPONENTS[kind])


def _replace_sparse(
    document: Document, sparse: Mapping[str, Any], values: NDArray[Any], name: str
) -> NDArray[Any]:
    count, width = int(sparse["count"]), values.shape[1]
    kind = _component_type(sparse["indices"], f"{name}'s sparse indices")
    at = _read_values(document, sparse["indices"], kind, count, 1, name)[:, 0].astype(np.int64)
    if (at < 0).any() or (at >= len(values)).any():
        raise ValueError(f"{name} has a sparse index out of range")
    values[at] = _read_values(document, sparse["values"], values.dtype, count, width, name)
    return values


def _read_values(
    document: Document,
    place: Mapping[str, Any],
    dtype: np.dtype[Any],
    count: int,
    width: int,
    name: str,
) -> NDArray[Any]:
    """Values [count, width] in a buffer view, from an offset."""
    view = document.item("bufferViews", place["bufferView"], "buffer view")
    data = view_bytes(document, view)
    offset, item = int(place.get("byteOffset", 0)), dtype.itemsize * width
    stride = int(view.get("byteStride", 0)) or item
    if count < 1 or offset < 0 or stride < item or offset + stride * (count - 1) + item > len(data):
        raise ValueError(f"{name} exceeds its buffer")
    values: NDArray[Any] = np.ndarray((count, width), dtype, data, offset, (stride, dtype.itemsize))
    return values


def view_bytes(document: Document, view: Mapping[str, Any]) -> bytes:
    """Bytes of a buffer view. Raises ValueError if it exceeds its buffer."""
    number = view["buffer"]
    if number not in document.buffers:
        buffer = document.item("buffers", number, "buffer")
        if "uri" not in buffer and (number or not document.binary):
            raise ValueError(f"buffer {number} has no data")
        document.buffers[number] = (
            read_uri(document, buffer["uri"]) if "uri" in buffer else document.binary
        )
    data = document.buffers[number]
    offset, length = int(view.get("byteOffset", 0)), int(view["byteLength"])
    if offset < 0 or length < 0 or offset + length > len(data):
        raise ValueError("a buffer view exceeds its buffer")
    return data[offset : offset + length]


def read_uri(document: Document, uri: str) -> bytes:
    """Bytes of a file next to the document, or of a data URI."""
    if not uri.startswith("data:"):
        return document.folder.read(locate_file(document.folder, document.relative, unquote(uri)))
    try:
        return base64.b64decode(uri.partition(",")[2], validate=True)
    except binascii.Error:
        raise ValueError("a data URI that is not base64") from None
