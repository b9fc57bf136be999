"""Voxels of bodies: where their surfaces are, and what these enclose."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.annotations import voxel_samples
from gen_data.annotations.voxel_box import VoxelBox
from gen_data.core import asset_types, interfaces
from gen_data.core.scene import Body
from gen_data.core.se3 import SE3

SAMPLES_PER_VOXEL = 2.0
"""Samples of a surface along the side of a voxel: a disc whose radius is 0.36 of it holds one."""
SAMPLES_MAX, CELLS_MAX = 400_000, 16_000_000
"""Samples on the faces of the bounds, and cells in them, of assets that are sampled once, as a
whole. Larger ones, such as the ground or a room, are sampled in columns that the box overlaps."""
TILE_SAMPLES = 160
"""Samples along the side of such a column."""
STEPS_PER_OCTAVE = 8
"""Pitches of samples of assets, which scaled bodies share; the next smaller one is taken."""
BOTTOMLESS = frozenset({"building"})
"""Tags of assets whose solids the ground closes."""


@dataclass(frozen=True, eq=False, slots=True)
class BodyVoxels:
    """Voxels of a body that are in a box, by their numbers; some appear several times.

    Attributes:
        surface: Voxels with a sample of its surface, [n].
        kinds: Index in ``asset_types.SURFACES`` of each, uint8 [n].
        inside: Voxels with a point inside it, [m].
        is_sheet: Whether it is a large surface that encloses nothing, such as the ground.
    """

    surface: NDArray[np.intp]
    kinds: NDArray[np.uint8]
    inside: NDArray[np.intp]
    is_sheet: bool = False


def find_body_voxels(
    body: Body, T_frame_body: SE3, box: VoxelBox, assets: interfaces.AssetLibrary
) -> BodyVoxels | None:
    """Voxels of a body; None if its bounds are beside the box."""
    low_m, high_m = assets.bounds_m(body.asset)
    if not box.may_contain(T_frame_body, low_m, high_m, body.scale):
        return None
    kinds = _surface_kinds(body.materials or assets.materials(body.asset))
    pitch_m = box.voxel_m / SAMPLES_PER_VOXEL / body.scale
    x, y, z = ((b - a) / pitch_m for a, b in zip(low_m, high_m, strict=True))
    shared_m = 2.0 ** (math.floor(STEPS_PER_OCTAVE * math.log2(pitch_m)) / STEPS_PER_OCTAVE)
    if 2.0 * (x * y + y * z + z * x) > SAMPLES_MAX or x * y * z > CELLS_MAX:
        voxels, slots, solid, is_sheet = _voxels_of_large(body, T_frame_body, box, shared_m, assets)
        return BodyVoxels(voxels, kinds[slots], solid, is_sheet)
    samples = _sample_asset(body.asset, shared_m, assets)
    surface = box.numbers(T_frame_body, samples.surface_m, body.scale)
    inside = box.numbers(T_frame_body, samples.inside_m, body.scale)
    kept = surface >= 0
    return BodyVoxels(surface[kept], kinds[samples.slots[kept]], inside[inside >= 0])


def _voxels_of_large(
    body: Body, T_frame_body: SE3, box: VoxelBox, pitch_m: float, assets: interfaces.AssetLibrary
) -> tuple[NDArray[np.intp], NDArray[np.int16], NDArray[np.intp], bool]:
    """Voxels of its surface in the box, their slots, voxels inside it, whether it is a sheet."""
    side_m = TILE_SAMPLES * pitch_m
    ends = T_frame_body.inverse().apply(box.corners_m) / (body.scale * side_m)
    first, last = np.floor(ends.min(axis=0)), np.floor(ends.max(axis=0))
    (x, y), (u, v) = first[:2].astype(int), last[:2].astype(int)
    tiles = [
        _sample_tile(body.asset, pitch_m, (i, j), assets)
        for i in range(x, u + 1)
        for j in range(y, v + 1)
    ]
    surface, slots = (np.concatenate(part) for part in zip(*tiles, strict=True))
    voxels = box.numbers(T_frame_body, surface, body.scale)
    kept = voxels >= 0
    inside = np.zeros(0, np.intp)
    is_sheet = _is_sheet(body.asset, assets)
    if not is_sheet:
        mesh = assets.mesh(body.asset)
        placed = T_frame_body.apply(mesh.vertices_m.astype(np.float64) * body.scale)[mesh.faces]
        low_m = np.asarray(box.low_m)
        solid = voxel_samples.inside_lattice(placed, low_m, box.voxel_m, box.shape)
        inside = np.flatnonzero(solid)
    return voxels[kept], slots[kept], inside, is_sheet


@lru_cache(maxsize=256)
def _sample_tile(
    asset: str, pitch_m: float, tile: tuple[int, int], assets: interfaces.AssetLibrary
) -> tuple[NDArray[np.float32], NDArray[np.int16]]:
    """Samples [m] of the surface of an asset in a column of its own frame, and their slots."""
    mesh = assets.mesh(asset)
    corners = mesh.vertices_m.astype(np.float64)[mesh.faces]
    side_m = TILE_SAMPLES * pitch_m
    low_m = np.array([tile[0] * side_m, tile[1] * side_m, -np.inf])
    high_m = np.array([low_m[0] + side_m, low_m[1] + side_m, np.inf])
    pieces, owner = voxel_samples.split_long(corners, 0.25 * side_m, low_m, high_m)
    points, piece = voxel_samples.sample_surface(pieces, pitch_m)
    kept = ((points >= low_m) & (points < high_m)).all(axis=1)
    slots = mesh.face_slots[owner[piece[kept]]].astype(np.int16)
    return points[kept].astype(np.float32), slots


@lru_cache(maxsize=256)
def _is_sheet(asset: str, assets: interfaces.AssetLibrary) -> bool:
    mesh = assets.mesh(asset)
    return not voxel_samples.is_closed(mesh.vertices_m.astype(np.float64)[mesh.faces])


@dataclass(frozen=True, eq=False, slots=True)
class _Samples:
    """Samples of an asset in its own frame [m].

    Attributes:
        surface_m: On its surface, float32 [n, 3].
        slots: Slot of the material of each, int16 [n].
        inside_m: In its solids, float32 [m, 3].
    """

    surface_m: NDArray[np.float32]
    slots: NDArray[np.int16]
    inside_m: NDArray[np.float32]


@lru_cache(maxsize=2048)
def _sample_asset(asset: str, pitch_m: float, assets: interfaces.AssetLibrary) -> _Samples:
    def compute() -> dict[str, NDArray[Any]]:
        return _compute_samples(asset, pitch_m, assets)

    if isinstance(assets, interfaces.DerivedArrays):
        return _Samples(**assets.derived(asset, f"voxel solids 1 {pitch_m:.6g}", compute))
    return _Samples(**compute())


def _compute_samples(
    asset: str, pitch_m: float, assets: interfaces.AssetLibrary
) -> dict[str, NDArray[Any]]:
    mesh = assets.mesh(asset)
    corners = mesh.vertices_m.astype(np.float64)[mesh.faces]
    surface, triangle = voxel_samples.sample_surface(corners, pitch_m)
    slots = mesh.face_slots[triangle].astype(np.int16)
    kept = voxel_samples.thin_out(surface, slots, 0.5 * pitch_m)
    low_m, high_m = (np.asarray(end) for end in mesh.bounds_m())
    nx, ny, nz = (int(n) for n in np.ceil((high_m - low_m) / pitch_m) + 1)
    inside = voxel_samples.inside_lattice(corners, low_m, pitch_m, (nx, ny, nz))
    dense, _ = voxel_samples.sample_surface(corners, 0.5 * pitch_m)
    shell = np.zeros((nx, ny, nz), np.bool_)
    shell[tuple(np.floor((dense - low_m) / pitch_m).astype(np.intp).T)] = True
    bottomless = not BOTTOMLESS.isdisjoint(assets.get(asset).tags)
    inside |= voxel_samples.enclosed_cells(shell, bottomless)
    return {
        "surface_m": surface[kept].astype(np.float32),
        "slots": slots[kept],
        "inside_m": (np.argwhere(inside) * pitch_m + low_m).astype(np.float32)
        + np.float32(pitch_m) * voxel_samples.PLACE,
    }


@lru_cache(maxsize=4096)
def _surface_kinds(materials: tuple[asset_types.Material, ...]) -> NDArray[np.uint8]:
    """Index of the surface of every slot."""
    known = {role: number for number, role in enumerate(asset_types.SURFACES)}
    return np.array([known.get(material.role, 0) for material in materials], np.uint8)
