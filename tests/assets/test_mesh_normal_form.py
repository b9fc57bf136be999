"""The normal form: outward, welded, split along creases, bounded."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gen_data.assets.normal_form import normal_form
from gen_data.assets.triangle_soup import (
    MaterialSlot,
    TriangleSoup,
    box,
    cylinder,
    face_crosses,
    join_soups,
    sphere,
)
from gen_data.core.asset_types import Material, MeshData
from gen_data.core.errors import AssetError


def volume_m3(mesh: MeshData) -> float:
    """Signed volume: positive if triangles wind counter-clockwise seen from outside."""
    corners = mesh.vertices_m.astype(np.float64)[mesh.faces]
    return float(np.einsum("ni,ni->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))) / 6


def face_normals(mesh: MeshData) -> np.ndarray:
    corners = mesh.vertices_m.astype(np.float64)[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_a_box_keeps_its_edges_a_ball_is_smooth_and_a_cylinder_has_sharp_rims() -> None:
    """Six flat sides share no vertex: 24 vertices, each normal along an axis."""
    mesh = normal_form(TriangleSoup.of(box((0.2, 0.3, 0.4))), "box")
    assert (len(mesh.vertices_m), len(mesh.faces)) == (24, 12)
    assert np.abs(mesh.normals).max(axis=1) == pytest.approx(1.0)
    assert volume_m3(mesh) == pytest.approx(0.2 * 0.3 * 0.4, rel=1e-5)
    # No vertex is split, and normals point along the radius.
    mesh = normal_form(TriangleSoup.of(sphere(0.1)), "ball")
    directions = mesh.vertices_m / np.linalg.norm(mesh.vertices_m, axis=1, keepdims=True)
    assert (mesh.normals * directions).sum(axis=1).min() > 0.999
    assert len(mesh.vertices_m) == len(np.unique(mesh.vertices_m.round(6), axis=0))
    # Each rim vertex occurs twice: once for the side, once for the cap.
    mesh = normal_form(TriangleSoup.of(cylinder(0.05, 0.2)), "can")
    rim = np.abs(np.hypot(mesh.vertices_m[:, 0], mesh.vertices_m[:, 1]) - 0.05) < 1e-6
    assert rim.sum() == 2 * 2 * 32
    vertical = np.abs(mesh.normals[rim, 2])
    assert set(vertical.round(5).tolist()) == {0.0, 1.0}


@pytest.mark.parametrize("crease_deg", [5.0, 60.0])
def test_the_crease_angle_decides_what_is_smooth(crease_deg: float) -> None:
    """A 32-sided cylinder has 11.25 degrees between its sides."""
    mesh = normal_form(TriangleSoup.of(cylinder(0.05, 0.2)), "can", crease_deg=crease_deg)
    flat = np.repeat(face_normals(mesh), 3, axis=0)
    deviation = (mesh.normals[mesh.faces.reshape(-1)] * flat).sum(axis=1).min()
    expected = 1.0 if crease_deg < 11.25 else math.cos(math.radians(11.25 / 2))
    assert deviation == pytest.approx(expected, abs=1e-4)


def test_closed_surfaces_are_turned_outward_and_open_ones_keep_their_winding() -> None:
    """A closed surface encloses a positive volume."""
    mesh = normal_form(TriangleSoup.of(box((0.2, 0.2, 0.2))).flipped(), "box")
    assert volume_m3(mesh) == pytest.approx(0.008, rel=1e-5)
    outward = (face_normals(mesh) * mesh.vertices_m[mesh.faces].mean(axis=1)).sum(axis=1)
    assert (outward > 0).all()
    # Every third triangle of a ball is wound the wrong way.
    corners = sphere(0.1)
    corners[::3] = corners[::3, ::-1]
    mesh = normal_form(TriangleSoup.of(corners), "ball")
    assert volume_m3(mesh) == pytest.approx(
        volume_m3(normal_form(TriangleSoup.of(sphere(0.1)), "ball"))
    )
    assert (face_normals(mesh) * mesh.vertices_m[mesh.faces].mean(axis=1)).sum(axis=1).min() > 0
    # A single triangle has no inside.
    triangle = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    assert normal_form(TriangleSoup.of(triangle), "t").normals[0, 2] == 1.0
    assert normal_form(TriangleSoup.of(triangle).flipped(), "t").normals[0, 2] == -1.0
    # A scale of -1 along one axis, as some URDFs have, does not turn a mesh inside out.
    matrix = np.hstack([np.diag([-1.0, 1.0, 1.0]), np.zeros((3, 1))])
    soup = TriangleSoup.of(box((0.1, 0.2, 0.3))).transformed(matrix)
    assert (np.einsum("ni,ni->n", soup.corners.mean(axis=1),
            np.cross(soup.corners[:, 1] - soup.corners[:, 0],
                     soup.corners[:, 2] - soup.corners[:, 0])) > 0).all()  # fmt: skip


def test_degenerate_and_duplicate_triangles_and_equal_and_unused_materials_go() -> None:
    """A point, a line, and the same triangle twice leave one triangle."""
    triangle = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]
    turned = [triangle[1], triangle[2], triangle[0]]
    line = [[0.0, 0, 0], [0.5, 0, 0], [1, 0, 0]]
    mesh = normal_form(TriangleSoup.of(np.array([triangle, [triangle[0]] * 3, line, turned])), "t")
    assert mesh.faces.tolist() == [[0, 1, 2]]
    # Renderers get one draw per look, not one per name.
    plain = Material()
    names = {"a": plain, "b": plain, "c": Material(roughness=0.1)}
    slots = tuple(MaterialSlot(name, material) for name, material in names.items())
    soup = replace(TriangleSoup.of(box((1, 1, 1))), face_slots=np.array([0, 1] * 6), slots=slots)
    mesh = normal_form(soup, "box")
    assert mesh.materials == (plain,)
    assert set(mesh.face_slots.tolist()) == {0}


@pytest.mark.parametrize(
    ("normals", "kept"),
    [([[0.6, 0, 0.8], [0, 0.6, 0.8], [0.0, 0, 1]], True), (np.zeros((3, 3)), False),
     (np.full((3, 3), np.nan), False), ([[0.0, 0.0, -1.0]] * 3, False)],
    ids=["an artist's, up to 45 degrees off the face", "zero", "undefined", "backward"],
)  # fmt: skip
def test_good_normals_of_a_file_are_kept_and_bad_ones_replaced(normals: Any, kept: bool) -> None:
    soup = TriangleSoup.of(np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]]))
    found = normal_form(replace(soup, normals=np.array([normals])), "t").normals
    assert found == pytest.approx(np.array(normals if kept else [[0.0, 0.0, 1.0]] * 3))


def test_normals_are_kept_next_to_triangles_without_usable_ones() -> None:
    """Two balls with tilted normals, one of them backward, and with none."""
    corners = sphere(0.1)
    up = np.array([0.0, 0.0, 0.3])
    tilted = corners / 0.1 + up
    tilted /= np.linalg.norm(tilted, axis=2, keepdims=True)
    given = tilted.copy()
    given[100, 0] *= -1.0
    first = replace(TriangleSoup.of(corners), normals=given)
    mesh = normal_form(join_soups([first, TriangleSoup.of(corners + 0.5)]), "balls")
    count = len(mesh.faces) // 2
    at = mesh.vertices_m[mesh.faces].astype(np.float64)
    at[count:] -= 0.5
    radial = at / np.linalg.norm(at, axis=2, keepdims=True)
    own = radial + up
    own /= np.linalg.norm(own, axis=2, keepdims=True)
    found = mesh.normals[mesh.faces]
    kept = (np.abs(found - own).max(axis=2) < 1e-3).all(axis=1)
    assert (kept[:count].sum(), kept[count:].sum()) == (count - 1, 0)
    assert (found[~kept] * radial[~kept]).sum(axis=2).min() > 0.999


@pytest.mark.parametrize("meant", [True, False])
def test_facets_stay_if_the_file_means_them(meant: bool) -> None:
    """A cylinder of 32 sides whose normals are all flat."""
    soup = TriangleSoup.of(cylinder(0.05, 0.2))
    flat = np.repeat(face_crosses(soup.corners)[:, None], 3, axis=1)
    mesh = normal_form(replace(soup, normals=flat, keeps_facets=meant), "can")
    deviation = (mesh.normals[mesh.faces] * face_normals(mesh)[:, None]).sum(axis=2).min()
    assert deviation == pytest.approx(1.0 if meant else math.cos(math.pi / 32), abs=1e-4)


def test_a_dense_mesh_is_thinned_out_to_its_budget_and_keeps_its_shape() -> None:
    """A ball of 4,096 triangles in two colours comes down to about 1,000."""
    corners = _subdivided(sphere(0.1), 1)
    upper = (corners.mean(axis=1)[:, 2] > 0).astype(np.int64)
    red, blue = Material(base_color=(1, 0, 0)), Material(base_color=(0, 0, 1))
    slots = (MaterialSlot("a", red, True), MaterialSlot("b", blue, True))
    soup = replace(TriangleSoup.of(corners), face_slots=upper, slots=slots)
    mesh = normal_form(soup, "ball", max_faces=1000)
    assert len(corners) > 3500
    assert 800 < len(mesh.faces) < 1200
    assert np.abs(np.linalg.norm(mesh.vertices_m, axis=1) - 0.1).max() < 0.004
    heights = mesh.vertices_m[mesh.faces].mean(axis=1)[:, 2]
    assert mesh.materials == (red, blue)
    assert ((heights > 0) == (mesh.face_slots == 1)).all()


def _subdivided(corners: np.ndarray, times: int) -> np.ndarray:
    for _ in range(times):
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        corners = np.concatenate([np.stack(p, axis=1) for p in parts])
    return corners


@pytest.mark.parametrize(
    ("corners", "reason"),
    [(np.zeros((0, 3, 3)), "no triangles"), (np.full((1, 3, 3), np.nan), "not finite"),
     (box((1e-5, 1e-5, 1e-5)), "set scale or size_m"), (box((2e3, 1, 1)), "set scale or size_m"),
     (box((1, 1, 1)) + 1e5, "from its origin"),
     (np.array([[[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]]), "degenerate")],
)  # fmt: skip
def test_unusable_soups_are_refused(corners: np.ndarray, reason: str) -> None:
    """The message names the place, the fact and the remedy."""
    with pytest.raises(AssetError, match=rf"^place: .*{reason}"):
        normal_form(TriangleSoup.of(corners), "place")
