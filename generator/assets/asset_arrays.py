"""Lossless conversion of meshes, collision parts and images to plain arrays and back."""

import json
from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np

from gen_data.assets.asset_cache import Arrays
from gen_data.assets.importer import FileRemarks, ImportedMesh
from gen_data.core.asset_types import ConvexParts, Keypoint, Material, MeshData, TextureData, UInt8
from gen_data.core.se3 import Vec3
from gen_data.core.serialization import canonical_json, from_plain
from gen_data.core.writing import Writing

_MESH_ARRAYS = ("vertices_m", "faces", "normals", "uvs", "face_slots")
_IMAGE = "image/"
_MATERIALS_KEPT = 4096


def pack_imported(imported: ImportedMesh) -> Arrays:
    """Convert an imported asset to plain arrays."""
    arrays: Arrays = {f"{_IMAGE}{name}": image for name, image in imported.images.items()}
    if imported.mesh is not None:
        arrays |= {name: getattr(imported.mesh, name) for name in _MESH_ARRAYS}
        arrays["materials"] = encode_text(canonical_json(imported.mesh.materials))
    if imported.collision is not None:
        parts = imported.collision.parts_m
        arrays["part_sizes"] = np.array([len(part) for part in parts], dtype=np.int64)
        arrays["parts_m"] = np.concatenate(parts) if parts else np.zeros((0, 3))
    if imported.keypoints:
        arrays["keypoints"] = encode_text(canonical_json(imported.keypoints))
    if imported.body_bounds_m is not None:
        arrays["body_bounds_m"] = np.array(imported.body_bounds_m, dtype=np.float64)
    if imported.shift_m != (0.0, 0.0, 0.0):
        arrays["shift_m"] = np.array(imported.shift_m, dtype=np.float64)
    if imported.remarks:
        arrays["remarks"] = encode_text(canonical_json(imported.remarks))
    return arrays


def unpack_imported(arrays: Arrays) -> ImportedMesh:
    """Restore an imported asset.

    Raises:
        KeyError, ValueError: if the arrays hold no imported asset.
    """
    mesh = collision = None
    if "materials" in arrays:
        mesh = MeshData(
            **{name: arrays[name] for name in _MESH_ARRAYS},
            materials=_decode_materials(arrays["materials"].tobytes()),
        )
    if "part_sizes" in arrays:
        ends = np.cumsum(arrays["part_sizes"])[:-1]
        collision = ConvexParts(tuple(np.split(arrays["parts_m"], ends)))
    images: Mapping[str, UInt8] = {
        name.removeprefix(_IMAGE): array for name, array in arrays.items() if _IMAGE in name
    }
    keypoints: tuple[Keypoint, ...] = ()
    if "keypoints" in arrays:
        keypoints = from_plain(tuple[Keypoint, ...], json.loads(arrays["keypoints"].tobytes()))
    bounds_m = None
    if "body_bounds_m" in arrays:
        bounds_m = from_plain(tuple[Vec3, Vec3], arrays["body_bounds_m"].tolist())
    x, y, z = arrays["shift_m"].tolist() if "shift_m" in arrays else (0.0, 0.0, 0.0)
    remarks: tuple[FileRemarks, ...] = ()
    if "remarks" in arrays:
        remarks = from_plain(tuple[FileRemarks, ...], json.loads(arrays["remarks"].tobytes()))
    return ImportedMesh(mesh, collision, images, keypoints, bounds_m, (x, y, z), remarks)


@lru_cache(maxsize=_MATERIALS_KEPT)
def _decode_materials(text: bytes) -> tuple[Material, ...]:
    """Materials in canonical JSON; an asset that is loaded again has the same ones."""
    return from_plain(tuple[Material, ...], json.loads(text))


_OPTIONAL_IMAGES = ("roughness", "normal", "metallic", "occlusion", "emission", "alpha")


def pack_texture(texture: TextureData) -> Arrays:
    """Convert a texture to plain arrays."""
    optional = {name: getattr(texture, name) for name in _OPTIONAL_IMAGES}
    return {"albedo": texture.albedo, **{k: v for k, v in optional.items() if v is not None}}


def unpack_texture(arrays: Arrays) -> TextureData:
    """Restore a texture. Raises KeyError if the arrays hold none."""
    return TextureData(arrays["albedo"], **{name: arrays.get(name) for name in _OPTIONAL_IMAGES})


def pack_writing(lines: Sequence[Writing]) -> Arrays:
    """Convert lines of text to plain arrays."""
    facts = [(w.text, w.language, w.stroke, w.kind, len(w.quads)) for w in lines]
    quads = [line.quads for line in lines] or [np.zeros((0, 4, 2))]
    return {"lines": encode_text(canonical_json(facts)), "quads": np.concatenate(quads)}


def unpack_writing(arrays: Arrays) -> tuple[Writing, ...]:
    """Restore lines of text. Raises KeyError if the arrays hold none."""
    facts, start, lines = json.loads(arrays["lines"].tobytes()), 0, []
    for text, language, stroke, kind, count in facts:
        lines.append(Writing(text, language, arrays["quads"][start : start + count], stroke, kind))
        start += count
    return tuple(lines)


def encode_text(text: str) -> UInt8:
    """UTF-8 bytes of a text as an array."""
    return np.frombuffer(text.encode(), dtype=np.uint8)
