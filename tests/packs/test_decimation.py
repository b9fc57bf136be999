"""Fewer triangles, the same pictures on them."""

import numpy as np

from gen_data.assets.mesh_decimation import decimate
from gen_data.assets.triangle_soup import MaterialSlot, TriangleSoup
from gen_data.core.asset_types import Material


def sheet(n: int, textured: bool) -> TriangleSoup:
    """A gently curved square of 2 n^2 triangles; u and v are x and y."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    points = np.stack([x, y, 0.05 * np.sin(3.0 * x) * np.cos(2.0 * y)], axis=2)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    corners = np.concatenate([
        np.stack([a, b, c], axis=2).reshape(-1, 3, 3),
        np.stack([a, c, d], axis=2).reshape(-1, 3, 3),
    ])  # fmt: skip
    slot = MaterialSlot("cloth", Material(texture="t" if textured else ""))
    zeros = np.zeros(len(corners), dtype=np.int64)
    return TriangleSoup(corners, corners[..., :2].copy(), None, zeros, zeros, (slot,))


def test_texture_coordinates_follow_the_surface() -> None:
    """U and v still are x and y after nine tenths of the triangles are gone."""
    soup = decimate(sheet(40, textured=True), 320)
    assert len(soup) < 600
    assert soup.uvs is not None
    assert np.abs(soup.uvs - soup.corners[..., :2]).max() < 0.05
    assert np.abs(soup.uvs - soup.corners[..., :2]).mean() < 0.005


def test_seams_stay_where_they_are() -> None:
    """Two charts side by side: no corner near the seam takes a coordinate of the other chart."""
    soup = sheet(40, textured=True)
    right = soup.corners[..., 0].min(axis=1) >= 0.5 - 1e-9
    assert soup.uvs is not None
    soup.uvs[right] += 5.0
    thinned = decimate(soup, 640)
    assert thinned.uvs is not None
    offset = thinned.uvs[..., 0] - thinned.corners[..., 0]
    near = np.minimum(np.abs(offset), np.abs(offset - 5.0))
    assert near.max() < 0.05
    assert ((offset > 2.5).all(axis=1) == (thinned.corners[..., 0].mean(axis=1) > 0.5)).all()


def test_a_material_of_few_triangles_is_left_alone() -> None:
    """Each of them may be one whole side of a box."""
    large, small = sheet(40, textured=False), sheet(3, textured=False)
    both = TriangleSoup(
        np.concatenate([large.corners, small.corners + 2.0]),
        None,
        None,
        np.repeat([0, 1], [len(large), len(small)]),
        np.zeros(len(large) + len(small), dtype=np.int64),
        (large.slots[0], MaterialSlot("lid", Material(roughness=0.9))),
    )
    thinned = decimate(both, 400)
    assert (thinned.face_slots == 1).sum() == 18
    assert (thinned.face_slots == 0).sum() < 600
