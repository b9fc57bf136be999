"""Triangle soup: what every file format is read into before it takes the normal form."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.core.asset_types import Material
from gen_data.generator.core.se3 import Vec3

Float64 = NDArray[np.float64]
Int64 = NDArray[np.int64]


_PLAIN = Material()


@dataclass(frozen=True, eq=False)
class MaterialSlot:
    """A named material of a file.

    Attributes:
        name: Its name in the file; empty = unnamed.
        from_file: Whether the mesh file itself says what it looks like; otherwise whoever refers
            to the mesh may.
        declared_color: Linear RGB that the file gives beside an image, though it means nothing
            there.
        missing_library: File that should have defined it and is not there; empty = none.
    """

    name: str = ""
    material: Material = _PLAIN
    from_file: bool = False
    declared_color: Vec3 = (1.0, 1.0, 1.0)
    missing_library: str = ""


@dataclass(frozen=True, eq=False)
class TriangleSoup:
    """Triangles that share nothing.

    Attributes:
        corners: float64 [m, 3, 3]: triangle, corner, xyz, in the unit and axes of the file.
        uvs: float64 [m, 3, 2], (0, 0) at the image's bottom left; None = there are none.
        normals: float64 [m, 3, 3] as the file gives them, not checked; None = there are none.
        face_slots: int64 [m].
        face_groups: int64 [m]: named object of the file that the triangle belongs to.
        slots: One per value of ``face_slots``.
    """

    corners: Float64
    uvs: Float64 | None
    normals: Float64 | None
    face_slots: Int64
    face_groups: Int64
    slots: tuple[MaterialSlot, ...]

    @classmethod
    def of(cls, corners: Float64, slot: MaterialSlot | None = None) -> TriangleSoup:
        """Bare triangles of one slot."""
        zeros = np.zeros(len(corners), dtype=np.int64)
        return cls(corners, None, None, zeros, zeros, (slot or MaterialSlot(),))

    def __len__(self) -> int:
        """Number of triangles."""
        return len(self.corners)

    def transformed(self, matrix: Float64) -> TriangleSoup:
        """The soup under an affine map [3, 4]; mirrored triangles are turned the right way out."""
        linear = matrix[:, :3]
        corners = apply_affine(matrix, self.corners)
        normals = self.normals
        if normals is not None:
            # Normals follow the cofactor matrix, which also exists for singular maps.
            normals = np.einsum("ij,...j->...i", _cofactors(linear), normals, optimize=False)
        moved = replace(self, corners=corners, normals=normals)
        return moved.flipped() if _determinant(linear) < 0.0 else moved

    def flipped(self) -> TriangleSoup:
        """Every triangle with the opposite winding."""
        return replace(
            self,
            corners=self.corners[:, ::-1],
            uvs=None if self.uvs is None else self.uvs[:, ::-1],
            normals=None if self.normals is None else -self.normals[:, ::-1],
        )

    def kept(self, chosen: NDArray[np.bool_]) -> TriangleSoup:
        """Some of the triangles."""
        return replace(
            self,
            corners=self.corners[chosen],
            uvs=None if self.uvs is None else self.uvs[chosen],
            normals=None if self.normals is None else self.normals[chosen],
            face_slots=self.face_slots[chosen],
            face_groups=self.face_groups[chosen],
        )


def apply_affine(matrix: Float64, points: Float64) -> Float64:
    """Points [..., 3] under an affine map [3, 4] or [4, 4]."""
    moved: Float64 = (
        np.einsum("ij,...j->...i", matrix[:3, :3], points, optimize=False) + matrix[:3, 3]
    )
    return moved


def join_soups(soups: list[TriangleSoup]) -> TriangleSoup:
    """All triangles of several soups; slots and groups stay apart.

    UVs and normals survive where a part has them: missing UVs become zero, missing normals make
    all normals unknown.
    """
    if len(soups) == 1:
        return soups[0]
    slot_starts = np.cumsum([0, *(len(s.slots) for s in soups)])
    group_starts = np.cumsum(
        [0, *(int(s.face_groups.max(initial=-1)) + 1 for s in soups)], dtype=np.int64
    )
    has_uvs = any(s.uvs is not None for s in soups)
    has_normals = all(s.normals is not None for s in soups)
    uvs = [np.zeros((len(s), 3, 2)) if s.uvs is None else s.uvs for s in soups]
    return TriangleSoup(
        corners=np.concatenate([s.corners for s in soups]),
        uvs=np.concatenate(uvs) if has_uvs else None,
        normals=np.concatenate([s.normals for s in soups if s.normals is not None])
        if has_normals
        else None,
        face_slots=np.concatenate(
            [s.face_slots + k for s, k in zip(soups, slot_starts, strict=False)]
        ),
        face_groups=np.concatenate(
            [s.face_groups + k for s, k in zip(soups, group_starts, strict=False)]
        ),
        slots=tuple(slot for s in soups for slot in s.slots),
    )


def _cofactors(m: Float64) -> Float64:
    return np.stack([np.cross(m[1], m[2]), np.cross(m[2], m[0]), np.cross(m[0], m[1])])


def _determinant(m: Float64) -> float:
    return float((m[0] * np.cross(m[1], m[2])).sum())
