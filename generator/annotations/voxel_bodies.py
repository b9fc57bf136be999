"""Voxels of bodies: their surfaces, and the space that these enclose."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.annotations import voxel_samples
from gen_data.annotations.voxel_box import VoxelBox, VoxelMap
from gen_data.annotations.voxel_painter import PointBlocks
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
NO_POINTS = PointBlocks.of(np.zeros((0, 3)), None, 1.0)


@dataclass(frozen=True, eq=False, slots=True)
class BodySamples:
    """Samples of a body that may be in a box.

    Attributes:
        onto: Map of the samples to the box.
        surface: Samples of its surface, in parts.
        kinds: Index in ``asset_types.SURFACES`` of each slot, uint8 [k].
        inside: Points in its solids.
        solid: Further voxels inside it, bool [x, y, z]; None = none.
        is_sheet: Whether it is a large surface that encloses nothing, such as the ground.
    """

    onto: VoxelMap
    surface: tuple[PointBlocks, ...]
    kinds: NDArray[np.uint8]
    inside: PointBlocks = NO_POINTS
    solid: NDArray[np.bool_] | None = None
    is_sheet: bool = False


def bodies_near(
    bodies: Sequence[Body], T_frame_world: SE3, box: VoxelBox, assets: interfaces.AssetLibrary
) -> list[Body]:
    """The bodies that may reach into a box, by spheres around their origins."""
    if not bodies:
        return []
    place_m = T_frame_world.apply(np.array([body.T_world_body.translation_m for body in bodies]))
    scale = np.array([body.scale for body in bodies])
    radius_m = scale * [_radius_m(body.asset, assets) for body in bodies] + 0.05 * box.voxel_m
    low, high = np.asarray(box.low_m), np.asarray(box.high_m)
    away = np.maximum(low - place_m, place_m - high).max(axis=1)
    return [body for body, near in zip(bodies, (away <= radius_m).tolist(), strict=True) if near]


@lru_cache(maxsize=4096)
def _radius_m(asset: str, assets: interfaces.AssetLibrary) -> float:
    """Radius of the sphere around the origin of an asset that encloses its bounds."""
    low_m, high_m = assets.bounds_m(asset)
    return math.hypot(*(max(-a, b) for a, b in zip(low_m, high_m, strict=True)))


def sample_body(
    body: Body, T_frame_body: SE3, box: VoxelBox, assets: interfaces.AssetLibrary
) -> BodySamples | None:
    """Samples of a body; None if its bounds are outside the box."""
    low_m, high_m = assets.bounds_m(body.asset)
    if not box.may_contain(T_frame_body, low_m, high_m, body.scale):
        return None
    kinds = _surface_kinds(body.materials or assets.materials(body.asset))
    onto = box.map_from(T_frame_body, body.scale)
    pitch_m = box.voxel_m / SAMPLES_PER_VOXEL / body.scale
    x, y, z = ((b - a) / pitch_m for a, b in zip(low_m, high_m, strict=True))
    shared_m = 2.0 ** (math.floor(STEPS_PER_OCTAVE * math.log2(pitch_m)) / STEPS_PER_OCTAVE)
    if 2.0 * (x * y + y * z + z * x) <= SAMPLES_MAX and x * y * z <= CELLS_MAX:
        surface, inside = _sample_asset(body.asset, shared_m, assets)
        return BodySamples(onto, (surface,), kinds, inside)
    tiles = _tiles_in(body, T_frame_body, box, shared_m, assets)
    if _is_sheet(body.asset, assets):
        return BodySamples(onto, tiles, kinds, is_sheet=True)
    mesh = assets.mesh(body.asset)
    placed = T_frame_body.apply(mesh.vertices_m.astype(np.float64) * body.scale)[mesh.faces]
    low = np.asarray(box.low_m)
    solid = voxel_samples.inside_lattice(placed, low, box.voxel_m, box.shape)
    return BodySamples(onto, tiles, kinds, solid=solid)


def _tiles_in(
    body: Body, T_frame_body: SE3, box: VoxelBox, pitch_m: float, assets: interfaces.AssetLibrary
) -> tuple[PointBlocks, ...]:
    """Samples of the surface of a large body in the columns that the box overlaps."""
    side_m = TILE_SAMPLES * pitch_m
    ends = T_frame_body.inverse().apply(box.corners_m) / (body.scale * side_m)
    first, last = np.floor(ends.min(axis=0)), np.floor(ends.max(axis=0))
    (x, y), (u, v) = first[:2].astype(int), last[:2].astype(int)
    return tuple(
        _sample_tile(body.asset, pitch_m, (i, j), assets)
        for i in range(x, u + 1)
        for j in range(y, v + 1)
    )


@lru_cache(maxsize=256)
def _sample_tile(
    asset: str, pitch_m: float, tile: tuple[int, int], assets: interfaces.AssetLibrary
) -> PointBlocks:
    """Samples of the surface of an asset in a column of the asset's frame."""
    mesh = assets.mesh(asset)
    corners = mesh.vertices_m.astype(np.float64)[mesh.faces]
    side_m = TILE_SAMPLES * pitch_m
    low_m = np.array([tile[0] * side_m, tile[1] * side_m, -np.inf])
    high_m = np.array([low_m[0] + side_m, low_m[1] + side_m, np.inf])
    pieces, owner = voxel_samples.split_long(corners, 0.25 * side_m, low_m, high_m)
    points, piece = voxel_samples.sample_surface(pieces, pitch_m)
    kept = ((points >= low_m) & (points < high_m)).all(axis=1)
    slots = mesh.face_slots[owner[piece[kept]]]
    return PointBlocks.of(points[kept], slots, pitch_m)


@lru_cache(maxsize=256)
def _is_sheet(asset: str, assets: interfaces.AssetLibrary) -> bool:
    mesh = assets.mesh(asset)
    return not voxel_samples.is_closed(mesh.vertices_m.astype(np.float64)[mesh.faces])


@lru_cache(maxsize=2048)
def _sample_asset(
    asset: str, pitch_m: float, assets: interfaces.AssetLibrary
) -> tuple[PointBlocks, PointBlocks]:
    """Samples of the surface of an asset, and points in its solids."""

    def compute() -> dict[str, NDArray[Any]]:
        return _compute_samples(asset, pitch_m, assets)

    if isinstance(assets, interfaces.DerivedArrays):
        found = assets.derived(asset, f"voxel solids 1 {pitch_m:.6g}", compute)
    else:
        found = compute()
    surface = PointBlocks.of(found["surface_m"], found["slots"], pitch_m)
    return surface, PointBlocks.of(found["inside_m"], None, pitch_m)


def _compute_samples(
    asset: str, pitch_m: float, assets: interfaces.AssetLibrary
) -> dict[str, NDArray[Any]]:
    """``surface_m`` float32 [n, 3], ``slots`` int16 [n], ``inside_m`` float32 [m, 3]."""
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


_KINDS = {role: number for number, role in enumerate(asset_types.SURFACES)}


def _surface_kinds(materials: Sequence[asset_types.Material]) -> NDArray[np.uint8]:
    """Index of the surface of every slot. A cache would hash all materials, which takes longer."""
    return np.array([_KINDS.get(material.role, 0) for material in materials], np.uint8)
