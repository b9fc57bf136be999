"""Collision geometry: bounded unions of small convex hulls.

A solid that differs much from its hull is cut repeatedly by the axis-aligned plane that reduces the
hulls' volume most, until the pieces are nearly convex or their number reaches the bound. This is
the greedy core of approximate convex decomposition (Lien and Amato, "Approximate convex
decomposition of polyhedra", SPM 2007). Only the surface is cut, because a clipped surface and the
clipped solid have the same hull.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from gen_data.assets.triangle_soup import Float64, TriangleSoup, face_crosses, first_occurrences
from gen_data.core.asset_types import ConvexParts
from gen_data.core.errors import AssetError

MAX_PARTS = 24
MAX_VERTICES = 64
_CUTS = (0.25, 0.5, 0.75)
_MIN_SAVING = 0.02
"""Smallest saving of a cut, as a share of the whole hull's volume."""
_MIN_POCKET_DEPTH = 0.15
"""Smallest depth of a pocket, as a share of the extent."""
_MIN_THICKNESS = 0.02
"""Thickness given to flat parts, as a share of their largest extent."""
_SAMPLE_DIRECTIONS = 256
"""Upper bound on the points of the approximate hulls that rank cuts."""
_MANY_POINTS = 4096
"""Above this number only extreme points are used: qhull is slow on round shapes."""


def convex_parts(soup: TriangleSoup, place: str, max_parts: int = MAX_PARTS) -> ConvexParts:
    """Collision parts of a soup: one hull per group if there are several.

    A single group is cut into up to ``max_parts`` parts where that fits its surface much better.

    Raises:
        AssetError: if no hull can be made.
    """
    groups = [soup.corners[soup.face_groups == g] for g in np.unique(soup.face_groups)]
    pieces = groups if 1 < len(groups) <= MAX_PARTS else decompose(soup, max_parts)
    return ConvexParts(tuple(hull_vertices(piece.reshape(-1, 3), place) for piece in pieces))


def single_hull(soup: TriangleSoup, place: str) -> ConvexParts:
    """Convex hull of the whole soup. Raises AssetError if it has no volume."""
    return ConvexParts((hull_vertices(soup.corners.reshape(-1, 3), place),))


def hull_vertices(points: Float64, place: str, max_vertices: int = MAX_VERTICES) -> Float64:
    """Vertices [n, 3] of the convex hull of points, at most ``max_vertices``.

    Larger hulls start from their extreme points along the axes and diagonals and grow by the point
    that lies farthest outside, as in quickhull; this keeps the error small for the number.

    Raises:
        AssetError: if the points lie on a line or are too few.
    """
    from scipy.spatial import ConvexHull, QhullError

    points = _thicken_if_flat(_drop_duplicates(points))
    if len(points) > _MANY_POINTS:
        points = points[sorted({*_extreme_indices(points), *_corner_indices(points)})]
    try:
        hull = ConvexHull(points)
        points = points[np.sort(hull.vertices, kind="stable")]
        if len(points) <= max_vertices:
            return points
        chosen = _corner_indices(points)
        growing = ConvexHull(points[chosen], incremental=True)
        while len(chosen) < max_vertices:
            normals, offsets = growing.equations[:, :3], growing.equations[:, 3]
            outside = np.einsum("ij,kj->ik", points, normals, optimize=False) + offsets
            farthest = int(np.argmax(outside.max(axis=1)))
            if farthest in chosen:
                break
            chosen.append(farthest)
            growing.add_points(points[farthest : farthest + 1])
        growing.close()
    except QhullError:
        raise AssetError(
            f"{place}: has no volume to collide with; give it a collision mesh"
        ) from None
    return points[sorted(chosen)]


def decompose(soup: TriangleSoup, max_parts: int) -> list[Float64]:
    """Cut a soup into at most ``max_parts`` nearly convex pieces, each [m, 3, 3]."""
    pieces = [_Piece.of(soup.corners)]
    enough = _MIN_SAVING * pieces[0].volume
    cuts = [_find_first_cut(pieces[0], enough)]
    for _ in range(max_parts - 1):
        best = int(np.argmax([cut.saving for cut in cuts]))
        if cuts[best].saving <= enough:
            break
        halves = cuts[best].halves
        pieces[best : best + 1] = halves
        cuts[best : best + 1] = [_find_best_cut(half) for half in halves]
    return [piece.corners for piece in pieces]


@dataclass(frozen=True, eq=False)
class _Piece:
    """Part of a surface [m, 3, 3], and the volume of its hull."""

    corners: Float64
    volume: float

    @classmethod
    def of(cls, corners: Float64) -> "_Piece":
        return cls(corners, _hull_volume(corners.reshape(-1, 3)))


@dataclass(frozen=True, eq=False)
class _Cut:
    """Halves of a piece, and the volume by which their hulls are smaller than the piece's."""

    halves: tuple[_Piece, ...] = ()
    saving: float = 0.0


def _find_first_cut(piece: _Piece, enough: float) -> _Cut:
    """The cut that saves most, alone or together with the next one.

    Halving a bowl does not fit it better; quartering does. Hence the look-ahead by one cut.
    """
    cut = _find_best_cut(piece)
    if cut.saving > enough or not _has_pocket(piece):
        return cut
    for axis in range(3):
        halving = _cut_at(piece, axis, 0.5)
        saving = halving.saving + sum(_find_best_cut(half).saving for half in halving.halves)
        if saving > cut.saving:
            cut = _Cut(halving.halves, saving)
    return cut


def _find_best_cut(piece: _Piece) -> _Cut:
    cuts = [_cut_at(piece, axis, share) for axis in range(3) for share in _CUTS]
    return cuts[int(np.argmax([cut.saving for cut in cuts]))]


def _cut_at(piece: _Piece, axis: int, share: float) -> _Cut:
    """Cut at a share of the extent along an axis; an empty cut if one side is empty."""
    low, high = piece.corners[..., axis].min(), piece.corners[..., axis].max()
    at = low + share * (high - low)
    clipped = [_clip_triangles(piece.corners, axis, at, side) for side in (1.0, -1.0)]
    if not all(len(half) for half in clipped):
        return _Cut()
    halves = tuple(_Piece.of(half) for half in clipped)
    return _Cut(halves, piece.volume - sum(half.volume for half in halves))


def _has_pocket(piece: _Piece) -> bool:
    """Whether some triangle lies deep inside the hull, measured along its normal."""
    hull = _hull(piece.corners.reshape(-1, 3))
    if hull is None:
        return False
    crosses = face_crosses(piece.corners)
    lengths = np.sqrt((crosses * crosses).sum(axis=1))
    centres = piece.corners.mean(axis=1)[lengths > 0.0]
    outward = crosses[lengths > 0.0] / lengths[lengths > 0.0, None]
    facing = np.einsum("ij,kj->ik", outward, hull.equations[:, :3], optimize=False)
    depth = -np.einsum("ij,kj->ik", centres, hull.equations[:, :3], optimize=False)
    depth = np.maximum(depth - hull.equations[:, 3], 0.0)
    exits = np.where(facing > 1e-6, depth / np.maximum(facing, 1e-6), np.inf).min(axis=1)
    return float(exits.max()) > _MIN_POCKET_DEPTH * _extent(piece.corners.reshape(-1, 3))


def _clip_triangles(corners: Float64, axis: int, at: float, side: float) -> Float64:
    """Part of the triangles with ``side * (coordinate - at) >= 0``."""
    height = side * (corners[..., axis] - at)
    above = height >= 0.0
    whole = corners[above.all(axis=1)]
    split = above.any(axis=1) & ~above.all(axis=1)
    corners, height, above = corners[split], height[split], above[split]
    # Rotate each triangle: the corner that is alone on its side comes first.
    alone = np.where(above.sum(axis=1) == 1, np.argmax(above, axis=1), np.argmin(above, axis=1))
    turn = (alone[:, None] + np.arange(3)) % 3
    corners = np.take_along_axis(corners, turn[..., None], axis=1)
    height = np.take_along_axis(height, turn, axis=1)
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    t = height[:, :1] / (height[:, :1] - height[:, 1:])
    ab, ac = a + t[:, :1] * (b - a), a + t[:, 1:] * (c - a)
    tip = height[:, 0] >= 0.0
    tips = np.stack([a, ab, ac], axis=1)[tip]
    stumps = [np.stack(x, axis=1)[~tip] for x in ((ab, b, c), (ab, c, ac))]
    return np.concatenate([whole, tips, *stumps])


def _hull_volume(points: Float64) -> float:
    hull = _hull(points)
    return 0.0 if hull is None else float(hull.volume)


def _hull(points: Float64) -> Any:
    """Hull of the most extreme points; None if they are coplanar."""
    from scipy.spatial import ConvexHull, QhullError

    points = _drop_duplicates(points)
    if len(points) > _SAMPLE_DIRECTIONS:
        points = points[_extreme_indices(points)]
    try:
        return ConvexHull(points) if len(points) > 3 else None
    except QhullError:
        return None


def _extent(points: Float64) -> float:
    return float((points.max(axis=0) - points.min(axis=0)).max())


def _drop_duplicates(points: Float64) -> Float64:
    extent = _extent(points)
    _, first = first_occurrences(np.rint(points / max(extent * 1e-6, 1e-12)).astype(np.int64))
    return points[first]


def _directions(count: int) -> Float64:
    """Unit vectors spread evenly over the sphere (Vogel's spiral).

    Rounded, because the last bits of sine and cosine differ between C libraries.
    """
    k = np.arange(count) + 0.5
    z = 1.0 - 2.0 * k / count
    radius = np.sqrt(1.0 - z * z)
    turn = k * np.pi * (3.0 - np.sqrt(5.0))
    return np.round(np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1), 9)


def _extreme_indices(points: Float64) -> list[int]:
    """Indices of the points that are extreme in any of many directions."""
    heights = np.einsum("ij,kj->ik", points, _directions(_SAMPLE_DIRECTIONS), optimize=False)
    return sorted({int(k) for k in np.argmax(heights, axis=0)})


def _corner_indices(points: Float64) -> list[int]:
    """Indices of points that span a volume: extreme along the axes and diagonals."""
    signs = [(i, j, k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1)]
    heights = np.einsum("ij,kj->ik", points, np.array(signs, dtype=np.float64), optimize=False)
    return sorted({int(k) for k in np.argmax(heights, axis=0)})


def _thicken_if_flat(points: Float64) -> Float64:
    """Duplicate coplanar points to both sides of their plane; return others unchanged."""
    centred = points - points.mean(axis=0)
    covariance = np.einsum("ni,nj->ij", centred, centred, optimize=False)
    values, vectors = np.linalg.eigh(covariance)
    extent = _extent(points)
    normal = vectors[:, 0]
    heights = (centred * normal).sum(axis=1)
    missing = _MIN_THICKNESS * extent - float(heights.max() - heights.min())
    if values[1] <= 0.0 or missing <= 0.98 * _MIN_THICKNESS * extent:
        return points
    return np.concatenate([points + 0.5 * missing * normal, points - 0.5 * missing * normal])
