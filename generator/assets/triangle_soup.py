"""Triangle soup: the common intermediate of all mesh formats before the normal form."""

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gen_data.core import asset_types, se3

Float64 = NDArray[np.float64]
Int64 = NDArray[np.int64]
Bools = NDArray[np.bool_]
SEGMENTS = 32
_BOX_QUADS = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))


_PLAIN = asset_types.Material()


@dataclass(frozen=True, eq=False)
class MaterialSlot:
    """A named material of a file.

    Attributes:
        name: Its name in the file; empty = unnamed.
        from_file: Whether the mesh file itself defines the material; otherwise a file that refers
            to the mesh may define it.
        declared_color: Linear RGB that the file gives next to an image, where it has no effect.
        missing: Why a material that the file names is not defined; empty = it is.
    """

    name: str = ""
    material: asset_types.Material = _PLAIN
    from_file: bool = False
    declared_color: se3.Vec3 = (1.0, 1.0, 1.0)
    missing: str = ""


@dataclass(frozen=True, eq=False)
class TriangleSoup:
    """Triangles without shared vertices.

    Attributes:
        corners: float64 [m, 3, 3]: triangle, corner, xyz, in the unit and axes of the file.
        uvs: float64 [m, 3, 2], (0, 0) at the image's bottom left; None = none.
        normals: float64 [m, 3, 3] as in the file, unchecked; zero or None = none.
        face_slots: int64 [m].
        face_groups: int64 [m]: number of the named object in the file.
        slots: One per value of ``face_slots``.
        group_names: Names of the groups in the file, by number; the names of further groups are
            not known.
        colors: float64 [m, 3, 3]: linear RGB in [0, 1] at each corner, a factor on the base colour;
            None = none.
        keeps_facets: Whether normals are meant if all are flat; exporters of most formats write
            such without being asked.
    """

    corners: Float64
    uvs: Float64 | None
    normals: Float64 | None
    face_slots: Int64
    face_groups: Int64
    slots: tuple[MaterialSlot, ...]
    group_names: tuple[str, ...] = ()
    colors: Float64 | None = None
    keeps_facets: bool = False

    @classmethod
    def of(
        cls, corners: Float64, slot: MaterialSlot | None = None, colors: Float64 | None = None
    ) -> "TriangleSoup":
        """Make a soup of one slot without UVs and normals from corners [m, 3, 3]."""
        zeros = np.zeros(len(corners), dtype=np.int64)
        return cls(corners, None, None, zeros, zeros, (slot or MaterialSlot(),), (), colors)

    def __len__(self) -> int:
        """Number of triangles."""
        return len(self.corners)

    def transformed(self, matrix: Float64) -> "TriangleSoup":
        """Apply an affine map [3, 4]; mirroring maps also reverse the winding."""
        linear = matrix[:, :3]
        corners = apply_affine(matrix, self.corners)
        normals = self.normals
        if normals is not None:
            # Normals transform by the cofactor matrix, which unlike the inverse always exists.
            cofactors = np.cross(np.roll(linear, -1, axis=0), np.roll(linear, -2, axis=0))
            normals = np.einsum("ij,...j->...i", cofactors, normals, optimize=False)
        moved = replace(self, corners=corners, normals=normals)
        mirrors = float((linear[0] * np.cross(linear[1], linear[2])).sum()) < 0.0
        return moved.flipped() if mirrors else moved

    def flipped(self) -> "TriangleSoup":
        """Reverse the winding of every triangle."""
        return replace(
            self,
            corners=self.corners[:, ::-1],
            uvs=None if self.uvs is None else self.uvs[:, ::-1],
            normals=None if self.normals is None else -self.normals[:, ::-1],
            colors=None if self.colors is None else self.colors[:, ::-1],
        )

    def select(self, chosen: Bools) -> "TriangleSoup":
        """Select triangles by a mask [m]."""
        return replace(
            self,
            corners=self.corners[chosen],
            uvs=None if self.uvs is None else self.uvs[chosen],
            normals=None if self.normals is None else self.normals[chosen],
            face_slots=self.face_slots[chosen],
            face_groups=self.face_groups[chosen],
            colors=None if self.colors is None else self.colors[chosen],
        )


def apply_affine(matrix: Float64, points: Float64) -> Float64:
    """Map points [..., 3] by an affine matrix [3, 4] or [4, 4]."""
    moved: Float64 = (
        np.einsum("ij,...j->...i", matrix[:3, :3], points, optimize=False) + matrix[:3, 3]
    )
    return moved


def join_soups(soups: list[TriangleSoup]) -> TriangleSoup:
    """Concatenate soups; their slots and groups stay separate.

    If any soup has UVs or normals, missing ones become zero; missing colours become white.
    """
    if len(soups) == 1:
        return soups[0]
    slots, groups, names, first_slot, first_group = [], [], list[str](), 0, 0
    for s in soups:
        slots.append(s.face_slots + first_slot)
        groups.append(s.face_groups + first_group)
        first_slot += len(s.slots)
        count = int(s.face_groups.max(initial=-1)) + 1
        names += [*s.group_names, *[""] * count][:count]
        first_group += count
    has_uvs = any(s.uvs is not None for s in soups)
    uvs = [np.zeros((len(s), 3, 2)) if s.uvs is None else s.uvs for s in soups]
    has_normals = any(s.normals is not None for s in soups)
    normals = [np.zeros_like(s.corners) if s.normals is None else s.normals for s in soups]
    has_colors = any(s.colors is not None for s in soups)
    colors = [np.ones((len(s), 3, 3)) if s.colors is None else s.colors for s in soups]
    return TriangleSoup(
        corners=np.concatenate([s.corners for s in soups]),
        uvs=np.concatenate(uvs) if has_uvs else None,
        normals=np.concatenate(normals) if has_normals else None,
        face_slots=np.concatenate(slots),
        face_groups=np.concatenate(groups),
        slots=tuple(slot for s in soups for slot in s.slots),
        group_names=tuple(names) if any(names) else (),
        colors=np.concatenate(colors) if has_colors else None,
        keeps_facets=any(s.keeps_facets for s in soups),
    )


def without_degenerate(soup: TriangleSoup) -> TriangleSoup:
    """The triangles that have an area; all, if none has.

    Nodes of scale 0 hide their meshes: their points would count for bounds and collision.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        solid = (face_crosses(soup.corners) != 0.0).any(axis=1)
    return soup if solid.all() or not solid.any() else soup.select(solid)


def face_crosses(corners: Float64) -> Float64:
    """Cross product of two edges of each triangle [m, 3]: normals of twice the area's length."""
    crosses: Float64 = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return crosses


def first_occurrences(keys: Int64) -> tuple[Int64, Int64]:
    """Number the distinct rows of ``keys`` [n, k] in order of first occurrence.

    Returns:
        The number of each row [n], and the index of the first row with each number.
    """
    columns = _pack_columns(keys)
    order = np.lexsort(columns)
    changes = [column[order] for column in columns]
    starts = np.ones(len(keys), dtype=bool)
    starts[1:] = np.any([column[1:] != column[:-1] for column in changes], axis=0)
    group = np.cumsum(starts) - 1
    # lexsort is stable: the first row of a group is its first occurrence.
    first = order[starts]
    rank_order = np.argsort(first, kind="stable")
    rank = np.zeros(len(first), dtype=np.int64)
    rank[rank_order] = np.arange(len(first))
    numbers = np.zeros(len(keys), dtype=np.int64)
    numbers[order] = rank[group]
    return numbers, first[rank_order]


def _pack_columns(keys: Int64) -> list[Int64]:
    """Columns [n] that distinguish the same rows as ``keys``, as few as 63 bits allow."""
    packed, room = list[Int64](), 0
    for column in keys.T:
        low = int(column.min(initial=0))
        span = int(column.max(initial=0)) - low + 1
        if span <= room:
            packed[-1] = packed[-1] * span + (column - low)
            room //= span
        else:
            packed.append(column - low if span < 2**62 else column)
            room = 2**62 // span
    return packed


def box(size_m: tuple[float, float, float]) -> Float64:
    """Triangles [12, 3, 3] of a box centred at the origin."""
    x, y, z = (0.5 * side for side in size_m)
    corners = np.array([(i * x, j * y, k * z) for k in (-1, 1) for j in (-1, 1) for i in (-1, 1)])
    return np.array([[corners[i] for i in t] for q in _BOX_QUADS for t in (q[:3], (q[0], *q[2:]))])


def cylinder(radius_m: float, length_m: float) -> Float64:
    """Triangles [4 * SEGMENTS, 3, 3] of a cylinder about Z, centred at the origin."""
    return _revolve([(0.0, -0.5 * length_m), (radius_m, -0.5 * length_m),
                      (radius_m, 0.5 * length_m), (0.0, 0.5 * length_m)])  # fmt: skip


def capsule(radius_m: float, length_m: float) -> Float64:
    """Triangles [m, 3, 3] of a cylinder about Z with half spheres beyond its ends."""
    steps = SEGMENTS // 4
    angles = [0.5 * math.pi * (k / steps) for k in range(steps + 1)]
    cap = [(radius_m * math.cos(a), 0.5 * length_m + radius_m * math.sin(a)) for a in angles]
    return _revolve([*((r, -z) for r, z in reversed(cap)), *cap])


def sphere(radius_m: float) -> Float64:
    """Triangles [m, 3, 3] of a sphere centred at the origin."""
    steps = SEGMENTS // 2
    angles = [math.pi * (k / steps - 0.5) for k in range(steps + 1)]
    return _revolve([(radius_m * math.cos(a), radius_m * math.sin(a)) for a in angles])


def _revolve(profile: list[tuple[float, float]]) -> Float64:
    """Triangles of a profile (radius, height), bottom to top, revolved about Z."""
    triangles: list[tuple[tuple[float, float, float], ...]] = []
    turns = [2.0 * math.pi * k / SEGMENTS for k in range(SEGMENTS)]
    ring = [(math.cos(a), math.sin(a)) for a in turns]
    for (r0, z0), (r1, z1) in pairwise(profile):
        for (cx, cy), (nx, ny) in zip(ring, [*ring[1:], ring[0]], strict=True):
            a, b = (r0 * cx, r0 * cy, z0), (r0 * nx, r0 * ny, z0)
            c, d = (r1 * nx, r1 * ny, z1), (r1 * cx, r1 * cy, z1)
            triangles += [(a, b, c), (a, c, d)]
    return np.array(triangles, dtype=np.float64)
