"""Meshes on the device, each with its hierarchy, and textures with mip chains."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import cv2
import numpy as np
import warp as wp
from numpy.typing import NDArray

from gen_data.core import code_digests, colorimetry, mapped_files, se3
from gen_data.core.asset_types import Material, MeshData, TextureData, UInt8
from gen_data.core.colorimetry import srgb_decode
from gen_data.renderers.warp.native_code import native
from gen_data.renderers.warp.scene import bvh, struct_dtypes
from gen_data.renderers.warp.scene.bvh import face_boxes, group_boxes, mesh_tree
from gen_data.renderers.warp.scene.kernels import bvh_build, records

Arrays = dict[str, NDArray[Any]]

_HOST_DTYPES: dict[Any, type[np.generic]] = {
    wp.vec3: np.float32,
    wp.vec2: np.float32,
    wp.float32: np.float32,
    wp.int32: np.int32,
    wp.uint32: np.uint32,
    wp.uint8: np.uint8,
}

# Cells along the longest side of the grid that groups faces into boxes.
_CELLS = 6
# Faces larger than three cells get boxes of their own, up to this number.
_LARGE_FACES_MAX = 256

# Above this number of faces, the quadratic test costs more than it saves.
_CONVEXITY_FACES_MAX = 2000


@cache
def arrays_version() -> str:
    """Everything but the asset that prepared arrays depend on: code and libraries.

    Read once: a street asks for hundreds of meshes and textures.
    """
    modules = (__file__, bvh.__file__, bvh_build.__file__, colorimetry.__file__)
    return code_digests.code_digest(
        modules, native("scene/kernels/grow.h"), cv2.__version__, np.__version__, wp.__version__
    )


# Without slots: caches hold some by weak references.
@dataclass(frozen=True, eq=False)
class DeviceMesh:
    """Geometry of one asset on the device.

    Attributes:
        record: A Geometry record [1].
        keep: The device arrays that the record points to.
        low_m, high_m: Bounds in the mesh frame.
    """

    record: NDArray[np.void]
    keep: tuple[object, ...]
    low_m: se3.Array
    high_m: se3.Array
    vertex_count: int
    materials: tuple[Material, ...]
    nbytes: int


def prepare_mesh(data: MeshData, *, quick: bool = False) -> Arrays:
    """Compute what rendering a mesh takes beside its own arrays.

    Args:
        data: The mesh.
        quick: Whether its ``tree`` is a quick one.

    Returns:
        ``boxes`` of ``boxes_around`` as by ``group_boxes``; ``convex`` [1], 0 or 1; the ``tree`` of
        ``mesh_tree``.
    """
    face_lows, face_highs = face_boxes(data.vertices_m, data.faces)
    lows, highs = boxes_around(face_lows, face_highs)
    is_convex = is_convex_solid(data.vertices_m, data.faces)
    return {
        "boxes": group_boxes(lows, highs),
        "convex": np.array([is_convex]),
        "tree": mesh_tree(data.vertices_m, data.faces, face_lows, face_highs, quick=quick),
    }


def upload_mesh(data: MeshData, prepared: Arrays, device: wp.Device) -> DeviceMesh:
    """Upload a mesh with its hierarchy.

    Args:
        data: The mesh.
        prepared: Arrays of ``prepare_mesh``.
        device: On the CPU, arrays are not copied: they must not change.
    """
    low, high = data.bounds_m()
    arrays = {
        "vertices_m": _upload(data.vertices_m, wp.vec3, device),
        "normals": _upload(data.normals, wp.vec3, device),
        "uvs": _upload(data.uvs, wp.vec2, device),
        "faces": _upload(data.faces.reshape(-1), wp.int32, device),
        "face_slots": _upload(data.face_slots, wp.int32, device),
        "boxes": _upload(prepared["boxes"], wp.float32, device),
        "tree": _upload(prepared["tree"], wp.float32, device),
    }
    fields: dict[str, object] = {name: array.field for name, array in arrays.items()}
    fields |= {"low_m": low, "high_m": high, "convex": prepared["convex"][0]}
    return DeviceMesh(
        _make_record(records.Geometry, fields),
        tuple(array.held for array in arrays.values()),
        np.array(low),
        np.array(high),
        len(data.vertices_m),
        data.materials,
        sum(array.nbytes for array in arrays.values()),
    )


class _Uploaded(NamedTuple):
    """An array on a device.

    Attributes:
        held: The array, which has to stay alive.
        field: Value of the field of a record that points to it.
        nbytes: Memory that it takes; 0 for a view of a mapped file.
    """

    held: Any
    field: tuple[object, ...]
    nbytes: int


def _upload(values: NDArray[Any], dtype: Any, device: wp.Device) -> _Uploaded:
    """Upload an array; on the CPU, records point to the array itself.

    A scene uploads a thousand arrays: wrapping each in an array of Warp would take longer than
    reading them.
    """
    values = np.ascontiguousarray(values, _HOST_DTYPES[dtype])
    if device.is_cpu:
        held, address = values, values.__array_interface__["data"][0]
        nbytes = mapped_files.owned_bytes(values)
    else:
        held = wp.array(values, dtype=dtype, device=device)
        address, nbytes = held.ptr or 0, values.nbytes
    # Address, address of a gradient, shape, strides [bytes], dimensions, flags.
    field = (address, 0, (len(values), 0, 0, 0), (values.strides[0], 0, 0, 0), 1, 0)
    return _Uploaded(held, field, nbytes)


def _make_record(struct: Any, fields: Mapping[str, object]) -> NDArray[np.void]:
    """A record [1] of a Warp struct from the values of all its fields."""
    dtype = struct_dtypes.struct_dtype(struct)
    assert dtype.names is not None
    return np.array([tuple(fields[name] for name in dtype.names)], dtype)


def boxes_around(
    lows: NDArray[np.float32], highs: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Low and high corners [m], [n, 3] each, of a few boxes that contain those of all faces.

    Faces whose centres lie in one cell of a coarse grid share a box; large ones have their own.
    """
    origin = np.array([column.min() for column in lows.T])
    top = np.array([column.max() for column in highs.T])
    cell_m = max(float((top - origin).max()) / _CELLS, 1e-9)
    # Column by column: numpy is slow on the short axis of [n, 3].
    columns = tuple(zip(lows.T, highs.T, strict=True))
    i, j, k = (
        ((np.float32(0.5) * (low + high) - start) / np.float32(cell_m)).astype(np.int64)
        for (low, high), start in zip(columns, origin, strict=True)
    )
    # NumPy sorts numbers of 16 bits ten times as fast.
    cells = (i + (_CELLS + 1) * j + (_CELLS + 1) ** 2 * k).astype(np.int16)
    x, y, z = (high - low for low, high in columns)
    large = np.flatnonzero(np.maximum(np.maximum(x, y), z) > 3.0 * cell_m)[:_LARGE_FACES_MAX]
    cells[large] = -1
    order = np.argsort(cells, kind="stable")
    order[: len(large)] = large[::-1]
    is_first = np.diff(cells.take(order), prepend=-2) != 0
    is_first[: len(large)] = True
    starts = np.flatnonzero(is_first)
    return (
        np.stack([np.minimum.reduceat(low.take(order), starts) for low, _ in columns], axis=1),
        np.stack([np.maximum.reduceat(high.take(order), starts) for _, high in columns], axis=1),
    )


def is_convex_solid(vertices_m: NDArray[np.float32], faces: NDArray[np.int32]) -> bool:
    """Whether no vertex lies outside the plane of any face; False for large meshes."""
    if len(faces) > _CONVEXITY_FACES_MAX:
        return False
    # Most concave meshes fail at one of the first few faces.
    return all(_behind_faces(vertices_m, part) for part in (faces[:: len(faces) // 8 + 1], faces))


def _behind_faces(vertices_m: NDArray[np.float32], faces: NDArray[np.int32]) -> bool:
    vertices = vertices_m.astype(np.float64)
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.sqrt((normals * normals).sum(axis=1))
    solid = lengths > 0.0
    normals = normals[solid] / lengths[solid, None]
    offsets = (normals * corners[solid, 0]).sum(axis=1)
    heights = np.einsum("fk,vk->fv", normals, vertices, optimize=False) - offsets[:, None]
    tolerance = 1e-5 * float(np.ptp(vertices, axis=0).max())
    return bool((heights <= tolerance).all())


Pixels = NDArray[Any]

_NO_TEXELS = np.zeros(1, np.uint32)
_NO_HOLE = np.full(1, 255, np.uint8)


# Without slots: caches hold some by weak references.
@dataclass(frozen=True, eq=False)
class DeviceTexture:
    """One texture on the device.

    Attributes:
        record: A Texture record [1].
        keep: The device arrays that the record points to.
        texels: The packed colours of all levels, the coarsest last.
        layered: Whether it has maps of emission, metal or occlusion.
        has_cutouts: Whether it has holes.
    """

    record: NDArray[np.void]
    keep: tuple[object, ...]
    texels: wp.array
    nbytes: int
    layered: bool
    has_cutouts: bool


_IMAGES = ("texels", "bumps", "shares", "glow")
_OPTIONAL = ("bumps", "shares", "glow", "cover")


def prepare_texture(data: TextureData) -> Arrays:
    """Compute a texture's mip levels.

    Returns:
        ``texels``, ``bumps``, ``shares``, ``glow``: four bytes per texel as uint32, all levels one
        after another, the coarsest last; maps that the texture does not have are missing.
        ``cover``: uint8 [h * w], missing if there are no holes. ``size`` [3]: height, width,
        levels. ``offsets`` int32 [levels]: the first texel of each level.
    """
    height, width = data.albedo.shape[:2]
    white = np.full((height, width), 255, np.uint8)
    albedo = data.albedo if data.alpha is None else remove_fringe(data.albedo, data.alpha)
    sizes, texels = _texels(albedo, white if data.roughness is None else data.roughness)
    arrays: Arrays = {
        "size": np.array([height, width, len(sizes)], np.int32),
        "offsets": np.cumsum([0, *sizes[:-1]]).astype(np.int32),
        "texels": texels,
    }
    if data.normal is not None:
        arrays["bumps"] = _mean_levels(_append_channel(data.normal, white))
    if data.metallic is not None or data.occlusion is not None:
        shares = [white if share is None else share for share in (data.metallic, data.occlusion)]
        arrays["shares"] = _mean_levels(cv2.merge([*shares, white, white]))
    if data.emission is not None:
        arrays["glow"] = _texels(data.emission, white)[1]
    if data.alpha is not None:
        arrays["cover"] = data.alpha.reshape(-1)
    return arrays


def upload_texture(prepared: Arrays, device: wp.Device) -> DeviceTexture:
    """Upload the arrays of ``prepare_texture``; on the CPU, they are not copied."""
    images = {name: prepared.get(name, _NO_TEXELS) for name in _IMAGES}
    cover = prepared.get("cover", _NO_HOLE)
    arrays = {name: _upload(values, wp.uint32, device) for name, values in images.items()}
    arrays["cover"] = _upload(cover, wp.uint8, device)
    arrays["offsets"] = _upload(prepared["offsets"], wp.int32, device)
    fields: dict[str, object] = {name: array.field for name, array in arrays.items()}
    fields |= dict(zip(("height", "width", "levels"), prepared["size"], strict=True))
    fields |= {f"has_{name}": int(name in prepared) for name in _OPTIONAL}
    texels = arrays["texels"].held
    if device.is_cpu:
        texels = wp.array(texels, dtype=wp.uint32, device=device, copy=False)
    return DeviceTexture(
        _make_record(records.TextureRecord, fields),
        tuple(array.held for array in arrays.values()),
        texels,
        sum(array.nbytes for array in arrays.values()),
        layered="shares" in prepared or "glow" in prepared,
        has_cutouts="cover" in prepared,
    )


def remove_fringe(albedo: UInt8, alpha: UInt8) -> UInt8:
    """Fill the colours of holes from their surroundings, so that coarser levels have no fringes.

    Source: Gortler et al., "The lumigraph", SIGGRAPH 1996 (pull and push). ``albedo`` is [h, w, 3],
    ``alpha`` the coverage [h, w]; holes are below 128.
    """
    solid = (alpha >= 128).astype(np.float32)[..., None]
    levels = _mip_levels(np.concatenate([albedo * solid, solid], axis=2))
    # Push: from coarse to fine, take the finer level's colour where it has any.
    filled = levels[-1][..., :3] / np.maximum(levels[-1][..., 3:], 1e-6)
    for level in levels[-2::-1]:
        height, width = level.shape[:2]
        wider = cv2.resize(filled, (width, height)).reshape(height, width, 3)
        weight = level[..., 3:]
        filled = np.where(weight > 0.0, level[..., :3] / np.maximum(weight, 1e-6), wider)
    return np.where(solid > 0.0, albedo, np.floor(filled + 0.5)).astype(np.uint8)


def halve_image(image: Pixels) -> Pixels:
    """Means of 2 x 2 blocks of an image [h, w, channels]; a single row or column stays.

    Odd sizes drop their last row or column: an invisible shift in a tiling image.
    """
    height, width = max(image.shape[0] // 2, 1), max(image.shape[1] // 2, 1)
    even = np.ascontiguousarray(image[: 2 * height, : 2 * width])
    smaller: Pixels = cv2.resize(even, (width, height), interpolation=cv2.INTER_AREA)
    return smaller.reshape(height, width, image.shape[2])


def _texels(albedo: UInt8, roughness: UInt8) -> tuple[list[int], NDArray[np.uint32]]:
    """Texels per mip level, and all levels packed one after another.

    Colours are stored as square roots of linear values, which distribute eight bits perceptually
    much like sRGB and are cheap to invert. Roughness is the fourth channel: coarser levels average
    its square, the width of a highlight.
    """
    finest = _append_channel(cv2.LUT(albedo, _sqrt_table()), roughness)
    levels = [finest]
    if max(finest.shape[:2]) > 1:
        squared = finest.astype(np.uint16)
        squared *= squared
        image = halve_image(squared).astype(np.float32) * np.float32(255.0**-2)
        levels += [_to_bytes(cv2.sqrt(level)) for level in _mip_levels(image)]
    return [level.shape[0] * level.shape[1] for level in levels], _pack(levels)


@cache
def _sqrt_table() -> UInt8:
    """Square roots of linear values by sRGB value."""
    return np.floor(np.sqrt(srgb_decode(np.arange(256) / 255.0)) * 255.0 + 0.5).astype(np.uint8)


def _mean_levels(finest: Pixels) -> NDArray[np.uint32]:
    """Four channels of all mip levels, packed one after another."""
    levels = [finest]
    if max(finest.shape[:2]) > 1:
        image = halve_image(finest).astype(np.float32) * np.float32(1.0 / 255.0)
        levels += [_to_bytes(level) for level in _mip_levels(image)]
    return _pack(levels)


def _mip_levels(image: Pixels) -> list[Pixels]:
    images = [image]
    while max(images[-1].shape[:2]) > 1:
        images.append(halve_image(images[-1]))
    return images


def _append_channel(three: Pixels, fourth: Pixels) -> Pixels:
    return np.asarray(cv2.merge([*cv2.split(three), fourth]))


def _to_bytes(image: Pixels) -> Pixels:
    """Values in [0, 1] as bytes, rounded."""
    return np.asarray(cv2.convertScaleAbs(image, alpha=255.0).reshape(image.shape))


def _pack(levels: Sequence[Pixels]) -> NDArray[np.uint32]:
    """Pack the four bytes of each texel into one integer, level after level; first byte lowest."""
    return np.concatenate([level.reshape(-1) for level in levels]).view("<u4")
