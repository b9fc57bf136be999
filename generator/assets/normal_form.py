"""The normal form of meshes, and how triangle soup takes it.

Metres, Z up, counter-clockwise outward; vertices are welded, then split along creases, UV seams and
nothing else; degenerate and duplicate triangles are gone. All steps are stable sorts and plain
arithmetic, so that the same file gives the same bytes on every processor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from gen_data.generator.assets.mesh_decimation import decimate
from gen_data.generator.assets.triangle_soup import Float64, Int64, TriangleSoup, first_occurrences
from gen_data.generator.core.asset_types import Material, MeshData
from gen_data.generator.core.errors import AssetError

CREASE_DEG = 40.0
MAX_TEXTURED_FACES = 1_000_000
_MIN_EXTENT_M, _MAX_EXTENT_M, _MAX_COORDINATE_M = 1e-4, 1e3, 1e4
_MAX_UV = 1e4
_WELD = 1e-6
"""Vertices nearer than this fraction of the largest extent are one."""


@dataclass(frozen=True)
class NormalForm:
    """Parameters of the import.

    Attributes:
        crease_deg: Edges whose faces differ by more in direction stay sharp.
        max_faces: Triangle budget.
    """

    crease_deg: float = CREASE_DEG
    max_faces: int = 20_000


def normal_form(soup: TriangleSoup, place: str, form: NormalForm = NormalForm()) -> MeshData:
    """The mesh of a soup that is in metres and Z up already.

    The file's own normals are kept where they agree with the triangles and round them off at all;
    else normals are computed anew.

    Args:
        soup: Triangles; ``Material.texture`` empty or a texture id.
        place: What error messages call it.
        form: Parameters of the import.

    Raises:
        AssetError: if nothing usable is left, or the size is out of bounds.
    """
    check_coordinates(soup, place)
    soup, faces = _welded(soup)
    if not len(soup):
        raise AssetError(f"{place}: all its triangles are degenerate; export it again")
    textured = any(slot.material.texture for slot in soup.slots)
    if textured and len(soup) > MAX_TEXTURED_FACES:
        raise AssetError(
            f"{place}: {len(soup)} textured triangles, at most {MAX_TEXTURED_FACES}; decimate it"
        )
    if len(soup) > form.max_faces:
        soup, faces = _welded(decimate(soup, form.max_faces))
    soup, faces = _outward(soup, faces)
    soup = replace(soup, uvs=_sane_uvs(soup.uvs) if textured else None)
    own = _sane_normals(soup)
    return make_mesh(soup, _creased(soup, faces, form.crease_deg) if own is None else own)


def _sane_uvs(uvs: Float64 | None) -> Float64 | None:
    """UVs; those that no repetition explains, which exporters leave on loose corners, are zero."""
    return None if uvs is None else np.where(np.abs(uvs) > _MAX_UV, 0.0, uvs)


def check_coordinates(soup: TriangleSoup, place: str) -> None:
    """The post-conditions that loaders which fail softly leave open.

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
    """Indexed mesh of triangles with unit normals [m, 3, 3]; equal corners become one vertex."""
    slots, slot_of = _merged_slots(soup)
    uvs = np.zeros((len(soup), 3, 2)) if soup.uvs is None else soup.uvs
    # On grids much finer than anything that is seen, so that noise does not split vertices.
    keys = np.concatenate(
        [
            np.rint(soup.corners.reshape(-1, 3) / _grid(soup.corners)).astype(np.int64),
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


def _grid(corners: Float64) -> float:
    points = corners.reshape(-1, 3)
    return max(float((points.max(axis=0) - points.min(axis=0)).max()) * _WELD, 1e-12)


def _merged_slots(soup: TriangleSoup) -> tuple[tuple[Material, ...], Int64]:
    """Distinct materials that occur, and the slot of each of the soup's."""
    used = np.bincount(soup.face_slots, minlength=len(soup.slots)) > 0
    materials: dict[Material, int] = {}
    slot_of = np.zeros(len(soup.slots), dtype=np.int64)
    for k, slot in enumerate(soup.slots):
        if used[k]:
            slot_of[k] = materials.setdefault(slot.material, len(materials))
    return tuple(materials), slot_of


def _welded(soup: TriangleSoup) -> tuple[TriangleSoup, Int64]:
    """The soup without degenerate and duplicate triangles, and its faces over welded vertices."""
    points = soup.corners.reshape(-1, 3)
    vertex, first = first_occurrences(np.rint(points / _grid(soup.corners)).astype(np.int64))
    faces = vertex.reshape(-1, 3)
    distinct = (
        (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    )
    soup = replace(soup, corners=points[first][faces])
    distinct &= (face_crosses(soup.corners) != 0.0).any(axis=1)
    soup, faces = soup.select(distinct), faces[distinct]
    if not len(faces):
        return soup, faces
    _, originals = first_occurrences(np.sort(faces, axis=1, kind="stable"))
    chosen = np.zeros(len(faces), dtype=bool)
    chosen[originals] = True
    return soup.select(chosen), faces[chosen]


def face_crosses(corners: Float64) -> Float64:
    """Cross products of two edges [m, 3]: the normal, twice as long as the area."""
    crosses: Float64 = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return crosses


def corner_angles(corners: Float64) -> Float64:
    """Angle [rad] at each corner of each triangle, [m, 3]."""
    ahead = _unit(np.roll(corners, -1, axis=1) - corners)
    behind = _unit(np.roll(corners, 1, axis=1) - corners)
    cosines = np.clip((ahead * behind).sum(axis=2), -1.0, 1.0)
    # Rounded, because the last bits of arccos differ between processors.
    angles: Float64 = np.round(np.arccos(cosines), 6)
    return angles


@dataclass(frozen=True, eq=False)
class _Edges:
    """Edges shared by exactly two faces.

    Attributes:
        corners: int64 [e, 2, 2]: for each of the two faces, the corner numbers ``3 * face + k`` at
            the edge's smaller and larger vertex.
        opposed: bool [e]: the faces run along the edge in opposite directions, as they should.
    """

    corners: Int64
    opposed: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]


def _edges(faces: Int64) -> _Edges:
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
    # A pair: equal to the next edge, and neither to the one before nor to the one after that.
    after_next = np.concatenate([after[1:], [False]])
    pair = np.flatnonzero(after & ~before & ~after_next)
    one, two = order[pair], order[pair + 1]
    corners = np.stack([np.stack([low[one], high[one]], 1), np.stack([low[two], high[two]], 1)], 1)
    return _Edges(corners, forward[one] != forward[two])


def _outward(soup: TriangleSoup, faces: Int64) -> tuple[TriangleSoup, Int64]:
    """Triangles with one winding per connected piece, outward if the whole encloses space."""
    edges = _edges(faces)
    flip = np.zeros(len(faces), dtype=bool)
    if not edges.opposed.all():
        flip = _winding_flips(len(faces), edges)
        soup, faces = _flipped(soup, faces, flip)
    watertight = 2 * len(edges.corners) == faces.size
    if (watertight or flip.any()) and signed_volume(soup.corners) < 0.0:
        soup, faces = _flipped(soup, faces, np.ones(len(faces), dtype=bool))
    return soup, faces


def signed_volume(corners: Float64) -> float:
    """Enclosed volume [m^3] about the centre of the corners; negative if they wind inward."""
    centred = corners - corners.reshape(-1, 3).mean(axis=0)
    return float((centred[:, 0] * np.cross(centred[:, 1], centred[:, 2])).sum()) / 6.0


def _winding_flips(face_count: int, edges: _Edges) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Which faces to turn so that neighbours agree; each piece follows its majority."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    # Faces doubled into (as is, turned): an edge links equal sides if it is opposed, else unequal
    # ones. Sides in one component belong together.
    one, two = edges.corners[:, 0, 0] // 3, edges.corners[:, 1, 0] // 3
    other = np.where(edges.opposed, two, two + face_count)
    mirror = np.where(edges.opposed, two + face_count, two)
    rows, columns = np.concatenate([one, one + face_count]), np.concatenate([other, mirror])
    graph = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), (2 * face_count,) * 2)
    count, label = connected_components(graph, directed=False)
    as_is, turned = label[:face_count], label[face_count:]
    # Where both sides are one component the surface has no consistent winding (Moebius): leave it.
    votes = np.bincount(as_is, minlength=count)
    flips: np.ndarray[tuple[int], np.dtype[np.bool_]] = (votes[as_is] < votes[turned]) | (
        (votes[as_is] == votes[turned]) & (turned < as_is)
    )
    return flips


def _flipped(
    soup: TriangleSoup, faces: Int64, flip: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
) -> tuple[TriangleSoup, Int64]:
    turned = soup.flipped()

    def chosen(new: Float64 | None, old: Float64 | None) -> Float64 | None:
        return None if new is None or old is None else np.where(flip[:, None, None], new, old)

    return (
        replace(
            soup,
            corners=np.where(flip[:, None, None], turned.corners, soup.corners),
            uvs=chosen(turned.uvs, soup.uvs),
            normals=chosen(turned.normals, soup.normals),
        ),
        np.where(flip[:, None], faces[:, ::-1], faces),
    )


def _sane_normals(soup: TriangleSoup) -> Float64 | None:
    """The file's normals, if they point away from their triangles and smooth anything at all."""
    if soup.normals is None or not np.isfinite(soup.normals).all():
        return None
    normals = _unit(soup.normals)
    agreement = (normals * _unit(face_crosses(soup.corners))[:, None]).sum(axis=2)
    return normals if (agreement > 0.2).all() and (agreement < 0.9999).any() else None


def _creased(soup: TriangleSoup, faces: Int64, crease_deg: float) -> Float64:
    """Unit normals [m, 3, 3], smooth within pieces of the surface bounded by creases.

    A corner weighs by its triangle's area and its angle: large flats keep their look beside narrow
    bevels, and how a quad is cut in two does not matter ("weighted normals", as hard-surface
    modellers have them).
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    crosses = face_crosses(soup.corners)
    units = _unit(crosses)
    edges = _edges(faces)
    one, two = edges.corners[:, 0, 0] // 3, edges.corners[:, 1, 0] // 3
    cosine = (units[one] * units[two]).sum(axis=1)
    smooth = edges.corners[edges.opposed & (cosine > math.cos(math.radians(crease_deg)))]
    rows, columns = smooth[:, 0].reshape(-1), smooth[:, 1].reshape(-1)
    graph = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), (faces.size,) * 2)
    count, group = connected_components(graph, directed=False)
    weighted = (corner_angles(soup.corners)[..., None] * crosses[:, None]).reshape(-1, 3)
    sums: Float64 = np.stack(
        [np.bincount(group, weighted[:, k], minlength=count) for k in range(3)], axis=1
    )
    normals = _unit(sums)[group].reshape(-1, 3, 3)
    # Where the sum cancels out (a knife's edge), the face's own normal is as good as any.
    cancelled = (normals * units[:, None]).sum(axis=2) < 0.05
    return np.where(cancelled[..., None], np.broadcast_to(units[:, None], normals.shape), normals)


def _unit(vectors: Float64) -> Float64:
    lengths = np.sqrt((vectors**2).sum(axis=-1, keepdims=True))
    return vectors / np.where(lengths > 0.0, lengths, 1.0)
