"""Meshes that follow the relief of the ground: no cracks, layers apart, upright edges upright."""

from __future__ import annotations

import numpy as np
import pytest

from gen_data.assets.asset_ids import parse_asset_id
from gen_data.assets.drape import LAND_M, draped_id
from gen_data.assets.library import Library
from gen_data.core.asset_types import MeshData
from gen_data.core.errors import AssetError
from gen_data.core.relief import Relief, RoadProfile
from gen_data.core.se3 import SE3
from tests.embree import RayCaster

HILL = Relief((RoadProfile(-60.0, 3.0, 0.3, 0.004, 120.0, 12.0, 0.2, -0.2, 0.0, 0.09,
                           (20.0, 30.0, -0.15, 70.0, 40.0, 0.1, 0.0, 1.0, 0.0)),))  # fmt: skip
PLACE = SE3.about_z(0.3, (-60.0, 3.0, 0.2))


def _on_hill(library: Library, asset: str) -> MeshData:
    return library.mesh(draped_id(parse_asset_id(asset), PLACE, 1.0, HILL))


def test_land_has_no_crack(library: Library) -> None:
    """All open edges are on the outline of the square, as of the level mesh."""
    level = library.mesh("ground?seed=3&size_m=400,400")
    mesh = _on_hill(library, "ground?seed=3&size_m=400,400")
    assert len(mesh.faces) > len(level.faces)
    _, corner = np.unique(np.round(mesh.vertices_m, 4), axis=0, return_inverse=True)
    faces = corner.reshape(-1)[mesh.faces]
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges, count = np.unique(edges, axis=0, return_counts=True)
    assert count.max() == 2
    place = np.zeros((corner.max() + 1, 3))
    place[corner.reshape(-1)] = mesh.vertices_m
    ends = place[edges[count == 1]]
    at_rim = np.abs(np.abs(ends[..., :2]) - 200.0).min(axis=2) < 0.01
    assert at_rim.all()


def test_land_is_near_the_ground_with_its_slots_textures_area_and_normals(library: Library) -> None:
    """Near the road, by rays from above; it has the hollows of the level mesh."""
    rng = np.random.default_rng(1)
    places = np.column_stack([rng.uniform(0.0, 120.0, 4000), rng.uniform(-40.0, 40.0, 4000)])
    above = np.column_stack([places, np.full(4000, 80.0)])
    heights = []
    for mesh in (library.mesh("ground?seed=3"), _on_hill(library, "ground?seed=3")):
        hits = RayCaster((mesh.vertices_m, mesh.faces)).cast(above, (0.0, 0.0, -1.0))
        heights.append(80.0 - hits.distance.astype(np.float64))
    raised = HILL.height(PLACE.apply(np.column_stack([places, np.zeros(4000)])))
    # Halves of an edge may bend once more between the points that were asked.
    assert np.abs(heights[1] - heights[0] - raised).max() < 2.0 * LAND_M
    # Cutting and raising changes neither the plan of any slot nor the range of its texture.
    asset = "road?length_m=120&edge_lines=solid"
    level, mesh = library.mesh(asset), _on_hill(library, asset)
    assert mesh.materials == level.materials
    for slot in np.unique(level.face_slots):
        areas = []
        for one in (level, mesh):
            across = np.cross(*_sides(one, np.flatnonzero(one.face_slots == slot)))
            areas.append(0.5 * np.abs(across[:, 2]).sum())
        assert areas[1] == pytest.approx(areas[0], rel=1e-4, abs=1e-3)
    np.testing.assert_allclose(mesh.uvs.max(axis=0), level.uvs.max(axis=0), atol=1e-4)
    # On a slope of constant grade, the level land's normal turns by atan(0.09).
    ramp = Relief((RoadProfile(-60.0, 0.0, 0.0, 0.0, 120.0, 40.0, 0.0, 0.0, 0.0, 0.09,
                               (0.0, 1.0, 0.0) * 3),))  # fmt: skip
    asset = draped_id(parse_asset_id("paved_area"), SE3.about_z(1.0), 1.0, ramp)
    mesh = library.mesh(asset)
    top = mesh.normals[mesh.normals[:, 2] > 0.98]
    # The body is turned by 1 rad: uphill is at -1 rad in its frame.
    normal = np.array([-0.09 * np.cos(1.0), 0.09 * np.sin(1.0), 1.0]) / np.hypot(0.09, 1.0)
    np.testing.assert_allclose(np.median(top, axis=0), normal, atol=1e-3)


@pytest.mark.parametrize(
    "asset", ["road?length_m=120&curvature_per_m=0.004&wear=0.9&edge_lines=solid",
              "crosswalk?length_m=40"],
)  # fmt: skip
def test_points_of_layers_are_raised_by_the_ground_below_them(library: Library, asset: str) -> None:
    """Rays through random triangles of the level mesh meet the same layer, to 0.1 mm."""
    level, mesh = library.mesh(asset), _on_hill(library, asset)
    rng = np.random.default_rng(2)
    chosen = rng.integers(0, len(level.faces), 3000)
    shares = rng.dirichlet((1.0, 1.0, 1.0), 3000)
    points = np.einsum("nk,nkc->nc", shares, level.vertices_m[level.faces[chosen]].astype(float))
    expected = points[:, 2] + HILL.height(PLACE.apply(points))
    start = np.column_stack([points[:, :2], expected + 5e-4])
    hits = RayCaster((mesh.vertices_m, mesh.faces)).cast(start, (0.0, 0.0, -1.0))
    # Faces of kerbs and edges are upright: rays slide along them.
    upward = np.abs(np.cross(*_sides(level, chosen))[:, 2]) > 1e-4
    off = hits.distance.astype(float) - 5e-4
    assert upward.sum() > 1500
    assert np.abs(off[upward]).max() < 1e-4 + 5e-4
    assert (np.abs(off[upward]) < 1e-4).mean() > 0.98


def _sides(mesh: MeshData, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    a, b, c = mesh.vertices_m[mesh.faces[faces]].astype(float).transpose(1, 0, 2)
    return b - a, c - a


@pytest.mark.parametrize(
    ("text", "message"),
    [("paved_area?relief=1,2,3", "expected at=x,y,yaw,scale"),
     ("paved_area?at=0,0,0,1&relief=1,2,3", "3 numbers are not a relief; expected 20 per road"),
     ("car?at=0,0,0,1&relief=1,2,3", "has no parameter")],
)  # fmt: skip
def test_wrong_ids_are_refused(library: Library, text: str, message: str) -> None:
    """With the id, and the expected form."""
    with pytest.raises(AssetError, match=message):
        library.mesh(text)
