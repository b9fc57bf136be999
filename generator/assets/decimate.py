"""Fewer triangles, the same shape."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from generator.assets.soup import Float64, Soup, joined
from generator.assets.welding import first_occurrences

_CALM = 3.0
"""How boldly edges are collapsed, from 1 to 10: slower and smoother than the library's 7."""


def decimated(soup: Soup, max_faces: int) -> Soup:
    """About ``max_faces`` triangles by quadric edge collapse; UVs and normals are lost.

    Each material is thinned out by itself, by the same share, and its border stays as it is: no
    colour moves and no gap opens. Groups are lost.

    Source: Garland and Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH
    1997.
    """
    share = max_faces / len(soup)
    materials = [slot.material for slot in soup.slots]
    first_slot = np.array([materials.index(material) for material in materials])[soup.face_slots]
    parts = []
    for k in np.unique(first_slot):
        corners = soup.corners[first_slot == k]
        thinned = _collapsed(corners, max(int(len(corners) * share), 4))
        parts.append(Soup.of(thinned, soup.slots[k]))
    return replace(joined(parts), face_groups=np.zeros(sum(map(len, parts)), dtype=np.int64))


def _collapsed(corners: Float64, max_faces: int) -> Float64:
    import fast_simplification

    flat = corners.reshape(-1, 3)
    # Scaled to unit size: the collapse compares with absolute thresholds.
    low = flat.min(axis=0)
    scale = float((flat.max(axis=0) - low).max())
    unit = (flat - low) / scale
    vertex, first = first_occurrences(np.rint(unit * 1e7).astype(np.int64))
    points, faces = fast_simplification.simplify(
        unit[first],
        vertex.reshape(-1, 3).astype(np.int32),
        target_count=max_faces,
        agg=_CALM,
        preserve_border=True,
    )
    collapsed: Float64 = (points.astype(np.float64) * scale + low)[faces]
    return collapsed
