"""Mesh decimation by quadric edge collapse."""

from dataclasses import replace

import numpy as np

from gen_data.assets.triangle_soup import Float64, TriangleSoup, first_occurrences, join_soups

_AGGRESSIVENESS = 3.0
"""From 1 to 10; slower but smoother than the library's default 7."""
_MAX_OVERSHOOT = 1.25
"""Largest tolerated number of triangles, as a multiple of the budget."""
_MIN_FACES = 40
"""Materials with at most this many triangles stay: each may be a whole side of a box."""


def decimate(soup: TriangleSoup, max_faces: int) -> TriangleSoup:
    """Reduce a soup to about ``max_faces`` triangles; normals and groups are lost.

    Each material is decimated separately, in proportion, with fixed borders and texture seams, so
    that no colour moves and no gap opens.

    Source: Garland and Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH
    1997.
    """
    share = max_faces / len(soup)
    materials = [slot.material for slot in soup.slots]
    first_slot = np.array([materials.index(material) for material in materials])[soup.face_slots]
    parts = []
    for k in np.unique(first_slot):
        slot, chosen = soup.slots[k], soup.select(first_slot == k)
        corners, uvs = chosen.corners, chosen.uvs if slot.material.texture else None
        if len(chosen) > _MIN_FACES:
            corners, uvs = _collapse_edges(corners, uvs, max(int(len(chosen) * share), _MIN_FACES))
        parts.append(replace(TriangleSoup.of(corners, slot), uvs=uvs))
    return replace(join_soups(parts), face_groups=np.zeros(sum(map(len, parts)), dtype=np.int64))


def _collapse_edges(
    corners: Float64, uvs: Float64 | None, max_faces: int
) -> tuple[Float64, Float64 | None]:
    """Corners [m, 3, 3] and UVs after the collapse; corners with different UVs stay separate."""
    import fast_simplification

    flat = corners.reshape(-1, 3)
    # Scaled to unit size, because the collapse uses absolute thresholds.
    low = flat.min(axis=0)
    scale = float((flat.max(axis=0) - low).max())
    unit = (flat - low) / scale
    keys = np.rint(unit * 1e7).astype(np.int64)
    if uvs is not None:
        keys = np.concatenate([keys, np.rint(uvs.reshape(-1, 2) * 1e5).astype(np.int64)], axis=1)
    vertex, first = first_occurrences(keys)
    points, triangles = unit[first], vertex.reshape(-1, 3).astype(np.int32)
    fewer_points, faces, collapses = fast_simplification.simplify(
        points,
        triangles,
        target_count=max_faces,
        agg=_AGGRESSIVENESS,
        return_collapses=True,
        preserve_border=True,
    )
    if uvs is None:
        if len(faces) > _MAX_OVERSHOOT * max_faces:
            # Loose sheets consist of borders only; these must be collapsed, too.
            fewer_points, faces = fast_simplification.simplify(
                fewer_points, faces.astype(np.int32), target_count=max_faces, agg=_AGGRESSIVENESS
            )
        return _restore_scale(fewer_points, scale, low)[faces], None
    # The replay yields the target of each vertex; its points are single precision and not used.
    _, _, merged = fast_simplification.replay_simplification(points, triangles, collapses)
    # Chart borders are fixed, so merged vertices lie in one chart and their UVs can be averaged,
    # weighted by inverse squared distance; the epsilon keeps unmoved vertices finite.
    square = ((points - fewer_points[merged]) ** 2).sum(axis=1)
    weights = 1.0 / (square + 1e-8)
    sums = np.zeros((len(fewer_points), 3))
    own = uvs.reshape(-1, 2)[first]
    np.add.at(
        sums, merged, np.concatenate([own, np.ones((len(own), 1))], axis=1) * weights[:, None]
    )
    mean: Float64 = (sums[:, :2] / sums[:, 2:])[faces]
    return _restore_scale(fewer_points, scale, low)[faces], mean


def _restore_scale(unit: Float64, scale: float, low: Float64) -> Float64:
    placed: Float64 = unit.astype(np.float64) * scale + low
    return placed
