"""Fewer triangles, the same shape."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gen_data.generator.assets.triangle_soup import (
    Float64,
    TriangleSoup,
    first_occurrences,
    join_soups,
)

_CALM = 3.0
"""How boldly edges are collapsed, from 1 to 10: slower and smoother than the library's 7."""
_TOLERATED = 1.25
"""Times the budget."""
_FEW = 40
"""Materials of so few triangles are left alone: each one may be a whole side of a box."""


def decimate(soup: TriangleSoup, max_faces: int) -> TriangleSoup:
    """About ``max_faces`` triangles by quadric edge collapse; normals are lost.

    Each material is thinned out by itself, by the same share, and its border stays as it is: no
    colour moves and no gap opens. So do the seams of textures. Groups are lost.

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
        if len(chosen) > _FEW:
            corners, uvs = _collapsed(corners, uvs, max(int(len(chosen) * share), _FEW))
        parts.append(replace(TriangleSoup.of(corners, slot), uvs=uvs))
    return replace(join_soups(parts), face_groups=np.zeros(sum(map(len, parts)), dtype=np.int64))


def _collapsed(
    corners: Float64, uvs: Float64 | None, max_faces: int
) -> tuple[Float64, Float64 | None]:
    """Corners and UVs of fewer triangles. Corners that differ in UV are never taken for one."""
    import fast_simplification

    flat = corners.reshape(-1, 3)
    # Scaled to unit size: the collapse compares with absolute thresholds.
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
        agg=_CALM,
        return_collapses=True,
        preserve_border=True,
    )
    if uvs is None:
        if len(faces) > _TOLERATED * max_faces:
            # Loose sheets are all border: then borders have to give way, too.
            fewer_points, faces = fast_simplification.simplify(
                fewer_points, faces.astype(np.int32), target_count=max_faces, agg=_CALM
            )
        return _placed(fewer_points, scale, low)[faces], None
    # Where each vertex went. (The points of a replay are single precision: unfit.)
    _, _, merged = fast_simplification.replay_simplification(points, triangles, collapses)
    # Borders of the charts stay, so that all that was merged lies in one chart; what lay nearest
    # to where they met counts most.
    square = ((points - fewer_points[merged]) ** 2).sum(axis=1)
    weights = 1.0 / (square + 1e-8)
    sums = np.zeros((len(fewer_points), 3))
    own = uvs.reshape(-1, 2)[first]
    np.add.at(
        sums, merged, np.concatenate([own, np.ones((len(own), 1))], axis=1) * weights[:, None]
    )
    mean: Float64 = (sums[:, :2] / sums[:, 2:])[faces]
    return _placed(fewer_points, scale, low)[faces], mean


def _placed(unit: Float64, scale: float, low: Float64) -> Float64:
    placed: Float64 = unit.astype(np.float64) * scale + low
    return placed
