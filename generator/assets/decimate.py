"""Fewer triangles, the same shape."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from generator.assets.soup import Int64, Soup


def decimated(soup: Soup, faces: Int64, max_faces: int) -> Soup:
    """At most about ``max_faces`` triangles by quadric edge collapse; UVs and normals are lost.

    Source: Garland and Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH
    1997. A new triangle takes slot and group of the old triangle whose centre is nearest to its
    own.

    Args:
        soup: Triangles.
        faces: Their vertex numbers after welding, [m, 3].
        max_faces: The budget.
    """
    import fast_simplification  # noqa: PLC0415
    from scipy.spatial import cKDTree  # noqa: PLC0415

    points = np.zeros((int(faces.max()) + 1, 3))
    points[faces.reshape(-1)] = soup.corners.reshape(-1, 3)
    # Scaled to unit size: the collapse compares with absolute thresholds.
    low, high = points.min(axis=0), points.max(axis=0)
    scale = float((high - low).max())
    new_points, new_faces = fast_simplification.simplify(
        (points - low) / scale, faces.astype(np.int32), target_count=max_faces
    )
    corners = (new_points.astype(np.float64) * scale + low)[new_faces]
    _, nearest = cKDTree(soup.corners.mean(axis=1)).query(corners.mean(axis=1))
    return replace(
        soup,
        corners=corners,
        uvs=None,
        normals=None,
        face_slots=soup.face_slots[nearest],
        face_groups=soup.face_groups[nearest],
    )
