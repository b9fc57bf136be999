"""glTF 2.0, text and binary (Khronos, "glTF 2.0 specification", 2021).

Triangles are read with colours, instances, skins and morph targets at rest, and materials (see
``gltf_materials``). Animations, cameras and lights are named; compressed geometry is refused.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from typing import Any
from urllib.parse import unquote

import numpy as np

from gen_data.assets.asset_folder import Folder
from gen_data.assets.image_decoding import decode_image
from gen_data.assets.readers.gltf_document import (
    Document,
    parse_document,
    read_accessor,
    read_uri,
    unsupported_extension,
    view_bytes,
)
from gen_data.assets.readers.gltf_materials import Images, gltf_material
from gen_data.assets.readers.gltf_nodes import MAX_PARTS, PlacedMesh, placed_meshes
from gen_data.assets.readers.mesh_source import MAX_FACES, WHITE, MeshSource, locate_file
from gen_data.assets.triangle_soup import (
    Float64,
    Int64,
    MaterialSlot,
    TriangleSoup,
    face_crosses,
    join_soups,
)
from gen_data.core.asset_types import UInt8
from gen_data.core.errors import AssetError

_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_REPEAT = 10497
_BEYOND = 0.01
"""Texture coordinates outside of [0, 1] by less show almost the same part of an image."""
_REFERENCES = (
    ("pbrMetallicRoughness", "baseColorTexture"),
    ("extensions", "KHR_materials_pbrSpecularGlossiness", "diffuseTexture"),
    ("normalTexture",),
    ("pbrMetallicRoughness", "metallicRoughnessTexture"),
    ("emissiveTexture",),
    ("occlusionTexture",),
)
"""Textures that are mapped to the surface, most important first."""


@dataclass(frozen=True)
class _Placement:
    """How the images of a material lie on a surface.

    Attributes:
        set_index: Number of the set of texture coordinates.
        offset, rotation, scale: Values of KHR_texture_transform.
    """

    set_index: int = 0
    offset: tuple[float, float] = (0.0, 0.0)
    rotation: float = 0.0
    scale: tuple[float, float] = (1.0, 1.0)

    def apply(self, uvs: Float64) -> Float64:
        """Transform coordinates [n, 2], V measured from the top.

        Source: KHR_texture_transform: scaled, rotated counter-clockwise as seen, then moved.
        """
        c, s = round(math.cos(self.rotation), 12), round(math.sin(self.rotation), 12)
        u, v = uvs[:, 0] * self.scale[0], uvs[:, 1] * self.scale[1]
        return np.stack([c * u + s * v + self.offset[0], c * v - s * u + self.offset[1]], axis=1)


@dataclass(frozen=True)
class _Look:
    """A material, the place of its images, and whether they end at their border."""

    slot: MaterialSlot
    placement: _Placement = _Placement()
    ends: bool = False


def read_gltf(folder: Folder, relative: str, materials: bool) -> MeshSource:
    """Read the triangles of the default scene of a glTF file, in its own axes (Y up).

    Raises:
        AssetError: if it is malformed, states more data than it holds, or requires an unsupported
            extension.
    """
    return read_gltf_bytes(folder, relative, folder.read(relative), materials)


def read_gltf_bytes(folder: Folder, relative: str, data: bytes, materials: bool) -> MeshSource:
    """Read a glTF file from its bytes; see ``read_gltf``."""
    try:
        document = parse_document(folder, relative, data)

        @lru_cache(MAX_PARTS)
        def find_look(number: int | None) -> _Look:
            """Look of a material that triangles have: unused ones may have any fault."""
            if number is None or not materials:
                return _Look(MaterialSlot())
            return _make_look(document, document.item("materials", number, "material"))

        meshes = placed_meshes(document)
        if sum(len(placed.mesh["primitives"]) for placed in meshes) > MAX_PARTS:
            raise ValueError(f"more than {MAX_PARTS} primitives; join them")
        parts = [
            part for placed in meshes for part in _read_primitives(document, placed, find_look)
        ]
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, RecursionError) as error:
        reason = f"missing {error}" if isinstance(error, KeyError) else str(error)[:120]
        raise AssetError(
            f"{folder.root / relative}: malformed glTF ({reason}); export it again"
        ) from None
    if not parts:
        raise AssetError(f"{folder.root / relative}: holds no triangles; export it with its mesh")
    soup = join_soups(parts)
    if not materials:
        return MeshSource(replace(soup, colors=None))
    return MeshSource(soup, document.images, tuple(dict.fromkeys(document.remarks)))


def _read_primitives(
    document: Document, placed: PlacedMesh, find_look: Callable[[int | None], _Look]
) -> list[TriangleSoup]:
    soups = []
    for primitive in placed.mesh["primitives"]:
        if primitive.get("mode", _TRIANGLES) not in (_TRIANGLES, _STRIP, _FAN):
            document.remarks.append("lines and points are not read")
            continue
        if "POSITION" not in primitive["attributes"]:
            document.remarks.append("primitives without positions are not read")
            continue
        look = find_look(primitive.get("material"))
        soup = _read_primitive(document, primitive, look, placed)
        soup = replace(soup, group_names=(placed.name,))
        soups.append(soup if placed.joints is not None else soup.transformed(placed.matrix[:3]))
    return soups


def _read_primitive(
    document: Document, primitive: Mapping[str, Any], look: _Look, placed: PlacedMesh
) -> TriangleSoup:
    attributes = primitive["attributes"]
    positions = read_accessor(document, attributes["POSITION"], 3).astype(np.float64)
    if "indices" in primitive:
        indices = read_accessor(document, primitive["indices"], 1).astype(np.int64)[:, 0]
    else:
        indices = np.arange(len(positions))
    faces = _index_triangles(indices, primitive.get("mode", _TRIANGLES))
    if len(faces) > MAX_FACES:
        raise ValueError(f"more than {MAX_FACES} triangles")
    if len(faces) and (faces.max() >= len(positions) or faces.min() < 0):
        raise ValueError("an index out of range")
    normals = _optional_attribute(document, attributes, "NORMAL", 3, len(positions))
    positions, normals = _morph(document, primitive, placed.weights, positions, normals)
    if placed.joints is not None:
        positions, normals = _skin(document, attributes, placed.joints, positions, normals)
    uvs = _read_uvs(document, attributes, look, len(positions))
    slot, colors = _read_colors(document, attributes, look.slot, len(positions))
    zeros = np.zeros(len(faces), dtype=np.int64)
    corners = positions[faces]
    # glTF 2.0, 3.7.2.1: a primitive without normals has flat ones.
    flat = np.repeat(face_crosses(corners)[:, None], 3, axis=1) if normals is None else None
    return TriangleSoup(
        corners=corners,
        uvs=None if uvs is None else uvs[faces],
        normals=flat if normals is None else normals[faces],
        face_slots=zeros,
        face_groups=zeros,
        slots=(slot,),
        colors=None if colors is None else colors[faces],
        keeps_facets=True,
    )


def _read_uvs(
    document: Document, attributes: Mapping[str, Any], look: _Look, count: int
) -> Float64 | None:
    """Texture coordinates [count, 2] as the material uses them, V from the bottom."""
    name = f"TEXCOORD_{look.placement.set_index}"
    uvs = _optional_attribute(document, attributes, name, 2, count)
    if uvs is None:
        if look.slot.material.texture:
            document.remarks.append(f"material '{look.slot.name}': its image needs {name}")
        return None
    uvs = look.placement.apply(uvs) if look.placement != _Placement() else uvs
    if look.ends and (uvs.min() < -_BEYOND or uvs.max() > 1.0 + _BEYOND):
        document.remarks.append(f"material '{look.slot.name}': images repeat beyond their borders")
    # glTF measures V from the top of the image.
    return np.stack([uvs[:, 0], 1.0 - uvs[:, 1]], axis=1)


def _read_colors(
    document: Document, attributes: Mapping[str, Any], slot: MaterialSlot, count: int
) -> tuple[MaterialSlot, Float64 | None]:
    """Linear RGB [count, 3] of COLOR_0, and the slot: the default material becomes white."""
    if "COLOR_0" not in attributes:
        return slot, None
    accessor = document.item("accessors", attributes["COLOR_0"], "accessor")
    width = 4 if accessor.get("type") == "VEC4" else 3
    colors = _optional_attribute(document, attributes, "COLOR_0", width, count)
    assert colors is not None
    if accessor.get("componentType") != 5126 and not accessor.get("normalized"):
        colors = colors / (255.0 if accessor.get("componentType") == 5121 else 65535.0)
    if not np.isfinite(colors).all():
        raise ValueError("a colour that is not finite")
    if width == 4 and colors[:, 3].min() < 0.99:
        document.remarks.append("the opacity of vertices (COLOR_0) is not used")
    slot = slot if slot.from_file else replace(slot, material=WHITE, from_file=True)
    return slot, np.clip(colors[:, :3], 0.0, 1.0)


def _morph(
    document: Document,
    primitive: Mapping[str, Any],
    weights: tuple[float, ...],
    positions: Float64,
    normals: Float64 | None,
) -> tuple[Float64, Float64 | None]:
    targets = primitive.get("targets", ())
    if sum(weight != 0.0 for weight in weights) < len(targets):
        document.remarks.append("morph targets of weight 0 are not used")
    for weight, target in zip(weights, targets, strict=False):
        if weight != 0.0:
            positions = _displaced(document, target, "POSITION", weight, positions)
            if normals is not None:
                normals = _displaced(document, target, "NORMAL", weight, normals)
    return positions, normals


def _displaced(
    document: Document, target: Mapping[str, Any], name: str, weight: float, values: Float64
) -> Float64:
    """Positions or normals [n, 3], moved by a morph target if it has them."""
    moved = _optional_attribute(document, target, name, 3, len(values))
    return values if moved is None else values + weight * moved


def _skin(
    document: Document,
    attributes: Mapping[str, Any],
    joints: Float64,
    positions: Float64,
    normals: Float64 | None,
) -> tuple[Float64, Float64 | None]:
    """Positions and normals [n, 3] moved by the joints, by up to eight weights each."""
    total = np.zeros((len(positions), 4, 4))
    for k in (0, 1):
        if f"JOINTS_{k}" not in attributes:
            continue
        numbers = _optional_attribute(document, attributes, f"JOINTS_{k}", 4, len(positions))
        weights = _optional_attribute(document, attributes, f"WEIGHTS_{k}", 4, len(positions))
        if numbers is None or weights is None:
            raise ValueError(f"JOINTS_{k} without WEIGHTS_{k}")
        if numbers.min() < 0 or numbers.max() >= len(joints):
            raise ValueError("a joint out of range")
        for column in range(4):
            chosen = numbers[:, column].astype(np.int64)
            total += weights[:, column, None, None] * joints[chosen]
    if "JOINTS_2" in attributes:
        document.remarks.append("more than eight joints per vertex are not used")
    sums = total[:, 3, 3]
    if not (np.abs(sums) > 1e-6).all():
        raise ValueError("vertices of a skin without weights")
    total = total / sums[:, None, None]
    moved = np.einsum("nij,nj->ni", total[:, :3, :3], positions, optimize=False) + total[:, :3, 3]
    if normals is not None:
        normals = np.einsum("nij,nj->ni", total[:, :3, :3], normals, optimize=False)
    return moved, normals


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
    document: Document, attributes: Mapping[str, Any], name: str, width: int, count: int
) -> Float64 | None:
    if name not in attributes:
        return None
    values = read_accessor(document, attributes[name], width).astype(np.float64)
    if len(values) != count:
        raise ValueError(f"{name} has {len(values)} entries for {count} positions")
    return values


def _make_look(document: Document, description: Mapping[str, Any]) -> _Look:
    place = f"{document.folder.root / document.relative}"

    def pixels(name: str) -> UInt8:
        encoded = document.images.get(name) or document.folder.read(name)
        return decode_image(encoded, f"{place}#{name}", alpha=True)

    name = str(description.get("name", ""))

    def remark(text: str) -> None:
        document.remarks.append(f"material '{name[:40]}': {text}")

    images = Images(lambda reference: _image_name(document, reference), cache(pixels), remark)
    try:
        placement, described = _place_images(document, description)
        material = gltf_material(described, images)
    except ValueError as error:
        raise ValueError(f"material '{name[:40]}': {error}") from None
    ends = bool(material.texture) and any(_ends(document, r) for _, r in _references(described))
    return _Look(MaterialSlot(name, material, from_file=True), placement, ends)


def _ends(document: Document, reference: Mapping[str, Any]) -> bool:
    """Whether a texture does not repeat."""
    texture = document.item("textures", reference["index"], "texture")
    if "sampler" not in texture:
        return False
    sampler = document.item("samplers", texture["sampler"], "sampler")
    return any(sampler.get(key, _REPEAT) != _REPEAT for key in ("wrapS", "wrapT"))


def _references(
    description: Mapping[str, Any],
) -> Iterator[tuple[tuple[str, ...], Mapping[str, Any]]]:
    """Yield path and reference of the textures that a material maps to the surface."""
    for path in _REFERENCES:
        reference: Any = description
        for key in path:
            reference = reference.get(key, {})
        if reference:
            yield path, reference


def _place_images(
    document: Document, description: Mapping[str, Any]
) -> tuple[_Placement, Mapping[str, Any]]:
    """Placement of a material's images, and the material without images that lie otherwise.

    A mesh has one set of texture coordinates here.
    """
    placements = {path: _read_placement(found) for path, found in _references(description)}
    chosen = next(iter(placements.values()), _Placement())
    for path, placement in placements.items():
        if placement != chosen:
            description = _without(description, path)
            document.remarks.append(
                f"material '{str(description.get('name', ''))[:40]}': {path[-1]} is not used: it "
                "has other texture coordinates than the first image"
            )
    return chosen, description


def _without(tree: Mapping[str, Any], path: tuple[str, ...]) -> dict[str, Any]:
    if len(path) == 1:
        return {key: value for key, value in tree.items() if key != path[0]}
    return {**tree, path[0]: _without(tree[path[0]], path[1:])}


def _read_placement(reference: Mapping[str, Any]) -> _Placement:
    transform = reference.get("extensions", {}).get("KHR_texture_transform", {})
    u, v = (float(x) for x in transform.get("offset", (0.0, 0.0)))
    width, height = (float(x) for x in transform.get("scale", (1.0, 1.0)))
    number = transform.get("texCoord", reference.get("texCoord", 0))
    return _Placement(int(number), (u, v), float(transform.get("rotation", 0.0)), (width, height))


def _image_name(document: Document, reference: Mapping[str, Any]) -> str:
    """Name of a texture reference's image: its path, or the number of an embedded image."""
    texture = document.item("textures", reference["index"], "texture")
    number = texture.get("source")
    if number is None:
        further = texture.get("extensions", {})
        number = further.get("EXT_texture_webp", {}).get("source")
        if number is None and further:
            raise unsupported_extension(document.folder, document.relative, next(iter(further)))
        if number is None:
            document.remarks.append("textures without an image are not used")
            return ""
    image = document.item("images", number, "image")
    if "uri" in image and not image["uri"].startswith("data:"):
        uri = unquote(image["uri"])
        return locate_file(document.folder, document.relative, uri, document.remarks)
    name = str(number)
    if "uri" in image:
        document.images[name] = read_uri(document, image["uri"])
    else:
        view = document.item("bufferViews", image["bufferView"], "buffer view")
        document.images[name] = view_bytes(document, view)
    return name
