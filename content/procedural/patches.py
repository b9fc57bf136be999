"""Patches: loose triangles, and their assembly into finished meshes.

Generators make ``Patch`` objects: triangles without shared vertices, which are moved and joined
freely. ``finish_mesh`` welds them, computes normals that are smooth except across creases, and
splits vertices where normals or texture coordinates differ.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gen_data.assets import family, triangle_soup
from gen_data.core.asset_types import ConvexParts, Material, MeshData
from gen_data.core.se3 import Vec3

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

# Vertices nearer than this are one vertex, and vertices are stored on this grid: the last bits of
# sine and cosine, which differ between processors, do not reach the mesh.
GRID_M = 1e-6
CREASE_DEG = 38.0


@dataclass(frozen=True, eq=False, slots=True)
class Patch:
    """Triangles without shared vertices, counter-clockwise seen from outside.

    Attributes:
        corners_m: float64 [n, 3 corners, 3].
        uvs: float64 [n, 3 corners, 2], (0, 0) at the image's bottom left.
        slots: int64 [n], material slot of each triangle.
    """

    corners_m: Array
    uvs: Array
    slots: Indices

    def moved(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Patch:
        """The patch translated [m]."""
        return replace(self, corners_m=self.corners_m + np.array([x, y, z]))

    def rotated(self, axis: str, angle_rad: float) -> Patch:
        """The patch turned about the axis ``x``, ``y`` or ``z`` by the right-hand rule."""
        return replace(self, corners_m=rotate(self.corners_m, axis, angle_rad))

    def painted(self, slot: int) -> Patch:
        """The patch with all triangles in one material slot."""
        return replace(self, slots=np.full(len(self.slots), slot, dtype=np.int64))

    def scaled(self, x: float, y: float, z: float) -> Patch:
        """The patch scaled along the axes; factors are positive."""
        return replace(self, corners_m=self.corners_m * np.array([x, y, z]))

    def flipped(self) -> Patch:
        """The patch seen from its other side."""
        return replace(self, corners_m=self.corners_m[:, ::-1], uvs=self.uvs[:, ::-1])

    def bounds_m(self) -> tuple[Array, Array]:
        """Smallest and largest coordinates, shape [3] each."""
        flat = self.corners_m.reshape(-1, 3)
        return flat.min(axis=0), flat.max(axis=0)


def unit(vectors: Array) -> Array:
    """Vectors, shape [..., k], of length 1; those without length stay zero."""
    scaled: Array = vectors / np.maximum(np.sqrt((vectors**2).sum(axis=-1, keepdims=True)), 1e-300)
    return scaled


def rotate(points: Array, axis: str, angle_rad: float) -> Array:
    """Points, shape [..., 3], turned about a coordinate axis by the right-hand rule."""
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    turned: Array = points.copy()
    turned[..., j] = c * points[..., j] - s * points[..., k]
    turned[..., k] = s * points[..., j] + c * points[..., k]
    return turned


def join_patches(patches: Iterable[Patch]) -> Patch:
    """One patch of all triangles."""
    parts = tuple(patches)
    return Patch(
        np.concatenate([p.corners_m for p in parts]),
        np.concatenate([p.uvs for p in parts]),
        np.concatenate([p.slots for p in parts]),
    )


def make_centred_solid(
    patches: Iterable[Patch],
    materials: Sequence[Material],
    hulls_m: Iterable[Array],
    crease_deg: float = CREASE_DEG,
) -> family.Solid:
    """A solid whose origin is the centre of its bounding box."""
    patch = join_patches(patches)
    x, y, z = centre_m(patch)
    moved = patch.moved(-x, -y, -z)
    hulls = tuple(hull - np.array([x, y, z]) for hull in hulls_m)
    return make_solid_in_place((moved,), materials, hulls, crease_deg)


def centre_m(patch: Patch) -> Vec3:
    """Centre of a patch's bounding box [m].

    It lies on the vertex grid: a shift by it does not change which vertices coincide.
    """
    low, high = patch.bounds_m()
    x, y, z = (round(float(v) / GRID_M) * GRID_M for v in round_values(0.5 * (low + high)))
    return (x, y, z)


def make_solid_in_place(
    patches: Iterable[Patch],
    materials: Sequence[Material],
    hulls_m: Iterable[Array],
    crease_deg: float = CREASE_DEG,
) -> family.Solid:
    """A solid that keeps its frame (furniture: the centre of the footprint on the floor)."""
    mesh = finish_mesh(join_patches(patches), materials, crease_deg)
    parts = tuple(np.round(round_values(hull), 6) + 0.0 for hull in hulls_m)
    return family.Solid(mesh, ConvexParts(parts))


def grid_bounds_m(patches: Sequence[Patch]) -> tuple[Vec3, Vec3]:
    """Smallest and largest coordinates of the mesh that ``finish_mesh`` makes of patches."""
    corners = np.concatenate([patch.corners_m.reshape(-1, 3) for patch in patches])
    vertices = (np.round(round_values(corners) / GRID_M) * GRID_M).astype(np.float32)
    (x0, y0, z0), (x1, y1, z1) = vertices.min(axis=0).tolist(), vertices.max(axis=0).tolist()
    return (x0, y0, z0), (x1, y1, z1)


def finish_mesh(patch: Patch, materials: Sequence[Material], crease_deg: float) -> MeshData:
    """The mesh of a patch, with normals smooth across edges that bend less than ``crease_deg``."""
    cells = np.round(round_values(patch.corners_m) / GRID_M).astype(np.int64)
    corners, keep = _whole_triangles(cells)
    cells, uvs, slots = cells[keep], round_values(patch.uvs[keep]), patch.slots[keep]
    places, _ = triangle_soup.first_occurrences(cells.reshape(-1, 3))
    normals = round_values(_corner_normals(places, corners, crease_deg))
    shading = [np.round(normals * 2048), np.round(uvs.reshape(-1, 2) * 65536)]
    key = np.concatenate([places[:, None], *(s.astype(np.int64) for s in shading)], axis=1)
    inverse, first = triangle_soup.first_occurrences(key)
    return MeshData(
        vertices_m=(cells.reshape(-1, 3)[first] * GRID_M).astype(np.float32),
        faces=inverse.reshape(-1, 3).astype(np.int32),
        # Adding zero turns -0.0 into 0.0: the sign of zero differs between processors too.
        normals=(np.round(normals[first], 6) + 0.0).astype(np.float32),
        uvs=(np.round(uvs.reshape(-1, 2)[first], 6) + 0.0).astype(np.float32),
        face_slots=slots.astype(np.int32),
        materials=tuple(materials),
    )


def round_values(values: Array) -> Array:
    """Round away the last bits, which differ between processors after sine, cosine and powers.

    Rounding twice, here and to a coarser grid, gives the same for values that lie exactly between
    two points of that grid, as a symmetric shape's do.
    """
    rounded: Array = np.round(values, 10)
    return rounded


def _whole_triangles(cells: Indices) -> tuple[Array, NDArray[np.bool_]]:
    """Corners of the triangles that have an area [grid cells], and which those are."""
    corners = cells.astype(np.float64)
    cross = triangle_soup.face_crosses(corners)
    longest = np.max([((corners[:, i] - corners[:, i - 1]) ** 2).sum(axis=1) for i in range(3)], 0)
    # Height below half a cell: a triangle that rounding has flattened to a line.
    keep = np.sqrt((cross**2).sum(axis=1)) > 0.5 * np.sqrt(longest) + 1e-9
    return corners[keep], keep


def _corner_normals(vertex: Indices, corners: Array, crease_deg: float) -> Array:
    """Unit normal per corner: the mean over the faces at its vertex that meet without a crease.

    Weighted by the angle of each face at the vertex (Thürmer and Wüthrich, "Computing vertex
    normals from polygonal facets", J. Graphics Tools 3(1), 1998) and by its area, which keeps a
    flat face flat next to a small bevel.
    """
    cross = triangle_soup.face_crosses(corners)
    x, y, z = unit(cross).T
    weighted = np.repeat(cross.T, 3, axis=1) * _corner_angles(corners).reshape(-1)
    order = np.argsort(vertex, kind="stable")
    counts = np.bincount(vertex)
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    fan = counts[vertex[order]]
    mine = np.repeat(order, fan)
    steps = np.arange(fan.sum()) - np.repeat(np.cumsum(fan) - fan, fan)
    theirs = order[np.repeat(starts[vertex[order]], fan) + steps]
    mine_face, their_face = mine // 3, theirs // 3
    cosine = x[mine_face] * x[their_face] + y[mine_face] * y[their_face]
    cosine += z[mine_face] * z[their_face]
    smooth = cosine > math.cos(math.radians(crease_deg))
    mine, theirs = mine[smooth], theirs[smooth]
    return unit(
        np.stack([np.bincount(mine, part[theirs], len(vertex)) for part in weighted], axis=1)
    )


def _corner_angles(corners: Array) -> Array:
    """Interior angles [rad], shape [n, 3]."""
    angles = []
    for i in range(3):
        a = unit(corners[:, (i + 1) % 3] - corners[:, i])
        b = unit(corners[:, (i + 2) % 3] - corners[:, i])
        angles.append(np.arccos(np.clip((a * b).sum(axis=1), -1.0, 1.0)))
    return np.stack(angles, axis=1)
