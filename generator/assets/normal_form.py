"""Conversion of triangle soup to the normal form of meshes.

Metres, Z up, counter-clockwise outward; vertices are welded, then split at creases and UV seams
only; degenerate and duplicate triangles are removed. All steps are stable sorts and plain
arithmetic: a file yields the same bytes on every processor.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gen_data.assets.mesh_decimation import decimate
from gen_data.assets.triangle_soup import (
    Bools,
    Float64,
    Int64,
    TriangleSoup,
    face_crosses,
    first_occurrences,
)
from gen_data.core.asset_types import Material, MeshData
from gen_data.core.errors import AssetError

CREASE_DEG = 40.0
MAX_FACES = 20_000
MAX_TEXTURED_FACES = 1_000_000
_MIN_EXTENT_M, _MAX_EXTENT_M, _MAX_COORDINATE_M = 1e-4, 1e3, 1e4
_MAX_UV = 1e4
_WELD = 1e-6
"""Welding distance, as a share of the largest extent."""


def normal_form(
    soup: TriangleSoup, place: str, max_faces: int = MAX_FACES, crease_deg: float = CREASE_DEG
) -> MeshData:
    """Convert a soup in metres, Z up, to a mesh.

    The file's normals are kept where they agree with their triangle, unless all are flat and not
    meant (``keeps_facets``); others are computed.

    Args:
        soup: Triangles; ``Material.texture`` empty or a texture id.
        place: Name of the mesh in error messages.
        max_faces: Triangle budget.
        crease_deg: Edges with a larger angle between the faces' normals stay sharp.

    Raises:
        AssetError: if nothing usable is left, or the size is out of bounds.
    """
    check_coordinates(soup, place)
    soup, faces = _weld(soup)
    if not len(soup):
        raise AssetError(f"{place}: all its triangles are degenerate; export it again")
    textured = any(slot.material.texture for slot in soup.slots)
    if textured and len(soup) > MAX_TEXTURED_FACES:
        raise AssetError(
            f"{place}: {len(soup)} textured triangles, at most {MAX_TEXTURED_FACES}; decimate it"
        )
    if len(soup) > max_faces:
        soup, faces = _weld(decimate(soup, max_faces))
    soup, faces = _orient_outward(soup, faces)
    uvs = soup.uvs if textured else None
    if uvs is not None:
        # Far beyond any repetition: exporters write such values on unused corners.
        uvs = np.where(np.abs(uvs) > _MAX_UV, 0.0, uvs)
    soup = replace(soup, uvs=uvs)
    normals, valid = _read_normals(soup)
    if not valid.all():
        computed = _crease_normals(soup, faces, crease_deg)
        normals = np.where(valid[:, None, None], normals, computed)
    return make_mesh(soup, normals)


def check_coordinates(soup: TriangleSoup, place: str) -> None:
    """Check coordinates; readers accept any numbers.

    Raises:
        AssetError: if the soup is empty, not finite, too small, too large or far from the origin.
    """
    if not len(soup):
        raise AssetError(f"{place}: holds no triangles; export it again with its faces")
    if not np.isfinite(soup.corners).all():
        raise AssetError(f"{place}: holds vertices that are not finite; export it again")
    if soup.uvs is not None and not np.isfinite(soup.uvs).all():
        raise AssetError(f"{place}: holds texture coordinates that are not finite; export it again")
    if float(np.abs(soup.corners).max()) > _MAX_COORDINATE_M:
        raise AssetError(
            f"{place}: reaches beyond {_MAX_COORDINATE_M:g} m from its origin; set scale or size_m"
        )
    points = soup.corners.reshape(-1, 3)
    extent = float((points.max(axis=0) - points.min(axis=0)).max())
    if not _MIN_EXTENT_M <= extent <= _MAX_EXTENT_M:
        raise AssetError(
            f"{place}: is {extent:.3g} m large, not within {_MIN_EXTENT_M:g} to "
            f"{_MAX_EXTENT_M:g} m; set scale or size_m"
        )


def make_mesh(soup: TriangleSoup, normals: Float64) -> MeshData:
    """Build an indexed mesh from a soup and unit normals [m, 3, 3]; equal corners are merged."""
    slots, slot_of = _merge_slots(soup)
    uvs = np.zeros((len(soup), 3, 2)) if soup.uvs is None else soup.uvs
    # Rounded to grids finer than any visible detail: noise must not split vertices.
    keys = np.concatenate(
        [
            np.rint(soup.corners.reshape(-1, 3) / _grid_size(soup.corners)).astype(np.int64),
            np.rint(normals.reshape(-1, 3) * 1e4).astype(np.int64),
            np.rint(uvs.reshape(-1, 2) * 1e6).astype(np.int64),
        ],
        axis=1,
    )
    corner_vertex, first = first_occurrences(keys)
    mesh = MeshData(
        vertices_m=soup.corners.reshape(-1, 3)[first].astype(np.float32),
        faces=corner_vertex.reshape(-1, 3).astype(np.int32),
        normals=normals.reshape(-1, 3)[first].astype(np.float32),
        uvs=uvs.reshape(-1, 2)[first].astype(np.float32),
        face_slots=slot_of[soup.face_slots].astype(np.int32),
        materials=slots,
    )
    for array in (mesh.vertices_m, mesh.faces, mesh.normals, mesh.uvs, mesh.face_slots):
        array.setflags(write=False)
    return mesh


def _grid_size(corners: Float64) -> float:
    points = corners.reshape(-1, 3)
    return max(float((points.max(axis=0) - points.min(axis=0)).max()) * _WELD, 1e-12)


def _merge_slots(soup: TriangleSoup) -> tuple[tuple[Material, ...], Int64]:
    """Distinct used materials, and the new slot number of each old slot."""
    used = np.bincount(soup.face_slots, minlength=len(soup.slots)) > 0
    materials: dict[Material, int] = {}
    slot_of = np.zeros(len(soup.slots), dtype=np.int64)
    for k, slot in enumerate(soup.slots):
        if used[k]:
            slot_of[k] = materials.setdefault(slot.material, len(materials))
    return tuple(materials), slot_of


def _weld(soup: TriangleSoup) -> tuple[TriangleSoup, Int64]:
    """Drop degenerate and duplicate triangles; return the rest and its welded faces [m, 3]."""
    points = soup.corners.reshape(-1, 3)
    vertex, first = first_occurrences(np.rint(points / _grid_size(soup.corners)).astype(np.int64))
    faces = vertex.reshape(-1, 3)
    distinct = (faces != np.roll(faces, -1, axis=1)).all(axis=1)
    soup = replace(soup, corners=points[first][faces])
    distinct &= (face_crosses(soup.corners) != 0.0).any(axis=1)
    soup, faces = soup.select(distinct), faces[distinct]
    if not len(faces):
        return soup, faces
    _, originals = first_occurrences(np.sort(faces, axis=1, kind="stable"))
    chosen = np.zeros(len(faces), dtype=bool)
    chosen[originals] = True
    return soup.select(chosen), faces[chosen]


def corner_angles(corners: Float64) -> Float64:
    """Angle [rad] at each corner of each triangle, [m, 3]."""
    ahead = _normalize(np.roll(corners, -1, axis=1) - corners)
    behind = _normalize(np.roll(corners, 1, axis=1) - corners)
    cosines = np.clip((ahead * behind).sum(axis=2), -1.0, 1.0)
    # Rounded, because the last bits of arccos differ between processors.
    angles: Float64 = np.round(np.arccos(cosines), 6)
    return angles


@dataclass(frozen=True, eq=False)
class _Edges:
    """Edges that exactly two faces share.

    Attributes:
        corners: int64 [e, 2, 2]: for each of the two faces, the corner numbers ``3 * face + k`` at
            the edge's smaller and larger vertex.
        opposed: bool [e]: the faces traverse the edge in opposite directions (consistent winding).
    """

    corners: Int64
    opposed: Bools


def _find_edges(faces: Int64) -> _Edges:
    start = np.arange(faces.size)
    end = start - start % 3 + (start + 1) % 3
    flat = faces.reshape(-1)
    forward = flat[start] < flat[end]
    low, high = np.where(forward, start, end), np.where(forward, end, start)
    order = np.lexsort((flat[high], flat[low]))
    a, b = flat[low][order], flat[high][order]
    same = (a[1:] == a[:-1]) & (b[1:] == b[:-1])
    before = np.concatenate([[False], same])
    after = np.concatenate([same, [False]])
    # A pair equals the next edge, but neither the previous one nor the one after the next.
    after_next = np.concatenate([after[1:], [False]])
    pair = np.flatnonzero(after & ~before & ~after_next)
    one, two = order[pair], order[pair + 1]
    corners = np.stack([np.stack([low[one], high[one]], 1), np.stack([low[two], high[two]], 1)], 1)
    return _Edges(corners, forward[one] != forward[two])


def _orient_outward(soup: TriangleSoup, faces: Int64) -> tuple[TriangleSoup, Int64]:
    """Make winding consistent per connected piece, and outward if the surface is closed."""
    edges = _find_edges(faces)
    flip = np.zeros(len(faces), dtype=bool)
    if not edges.opposed.all():
        flip = _winding_flips(len(faces), edges)
        soup, faces = _flip_faces(soup, faces, flip)
    watertight = 2 * len(edges.corners) == faces.size
    if (watertight or flip.any()) and signed_volume(soup.corners) < 0.0:
        soup, faces = _flip_faces(soup, faces, np.ones(len(faces), dtype=bool))
    return soup, faces


def signed_volume(corners: Float64) -> float:
    """Enclosed volume [m^3] about the centre of the corners; negative if they wind inward."""
    centred = corners - corners.reshape(-1, 3).mean(axis=0)
    return float((centred[:, 0] * np.cross(centred[:, 1], centred[:, 2])).sum()) / 6.0


def _winding_flips(face_count: int, edges: _Edges) -> Bools:
    """Mask [m] of the faces to flip for neighbours to agree; the majority of a piece stays."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    # Two nodes per face, (as is, flipped): an opposed edge links equal states, any other edge
    # unequal ones. A connected component is then a consistent choice of states.
    one, two = edges.corners[:, 0, 0] // 3, edges.corners[:, 1, 0] // 3
    other = np.where(edges.opposed, two, two + face_count)
    mirror = np.where(edges.opposed, two + face_count, two)
    rows, columns = np.concatenate([one, one + face_count]), np.concatenate([other, mirror])
    graph = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), (2 * face_count,) * 2)
    count, label = connected_components(graph, directed=False)
    as_is, turned = label[:face_count], label[face_count:]
    # If both states share a component, no consistent winding exists (Moebius strip): no flips.
    votes = np.bincount(as_is, minlength=count)
    tied = votes[as_is] == votes[turned]
    flips: Bools = (votes[as_is] < votes[turned]) | (tied & (turned < as_is))
    return flips


def _flip_faces(soup: TriangleSoup, faces: Int64, flip: Bools) -> tuple[TriangleSoup, Int64]:
    turned = soup.flipped()

    def chosen(name: str) -> Any:
        old = getattr(soup, name)
        return None if old is None else np.where(flip[:, None, None], getattr(turned, name), old)

    soup = replace(soup, **{name: chosen(name) for name in ("corners", "uvs", "normals")})
    return soup, np.where(flip[:, None], faces[:, ::-1], faces)


def _read_normals(soup: TriangleSoup) -> tuple[Float64, Bools]:
    """The file's unit normals, and a mask [m] of triangles where they point outward and are meant.

    Flat normals alone are not meant, unless the soup states so.
    """
    known = np.zeros_like(soup.corners) if soup.normals is None else soup.normals
    normals = _normalize(np.where(np.isfinite(known), known, 0.0))
    agreement = (normals * _normalize(face_crosses(soup.corners))[:, None]).sum(axis=2)
    valid = (agreement > 0.2).all(axis=1)
    meant = soup.keeps_facets or bool((agreement[valid] < 0.9999).any())
    return normals, valid & meant


def _crease_normals(soup: TriangleSoup, faces: Int64, crease_deg: float) -> Float64:
    """Unit normals [m, 3, 3], smooth within pieces of the surface bounded by creases.

    Corners are weighted by area and angle ("weighted normals"): large flat faces stay flat next to
    narrow bevels, and the diagonal of a quad does not matter.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    crosses = face_crosses(soup.corners)
    units = _normalize(crosses)
    edges = _find_edges(faces)
    one, two = edges.corners[:, 0, 0] // 3, edges.corners[:, 1, 0] // 3
    cosine = (units[one] * units[two]).sum(axis=1)
    smooth = edges.corners[edges.opposed & (cosine > math.cos(math.radians(crease_deg)))]
    rows, columns = smooth[:, 0].reshape(-1), smooth[:, 1].reshape(-1)
    graph = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), (faces.size,) * 2)
    count, group = connected_components(graph, directed=False)
    weighted = (corner_angles(soup.corners)[..., None] * crosses[:, None]).reshape(-1, 3)
    sums: Float64 = np.stack([np.bincount(group, w, minlength=count) for w in weighted.T], axis=1)
    normals = _normalize(sums)[group].reshape(-1, 3, 3)
    # Where the sum nearly cancels (a knife's edge), use the face's own normal.
    cancelled = (normals * units[:, None]).sum(axis=2) < 0.05
    return np.where(cancelled[..., None], np.broadcast_to(units[:, None], normals.shape), normals)


def _normalize(vectors: Float64) -> Float64:
    lengths = np.sqrt((vectors**2).sum(axis=-1, keepdims=True))
    return vectors / np.where(lengths > 0.0, lengths, 1.0)
